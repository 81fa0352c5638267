//! Both files of vectors: round trips, worked records, faults that are named, hostile bytes.

use proptest::prelude::*;
use rtl_model::datapath::{Facing, HitWords, PatchWords, RayWords};
use rtl_model::fixed::{Formats, Rounding};

use super::wires::{from_values, n_wires};
use super::*;

const FORMATS: Formats = Formats {
    coord_frac_bits: 8,
    dir_frac_bits: 8,
    t_frac_bits: 8,
    cross_keep_bits: None,
    rounding: Rounding::NearestEven,
};

/// A triangle, a quad, a ray of each kind, a test of each patch.
const SMALL: &str = "vectors,1
formats,8,8,8,full,nearest-even
patch,7,triangle,-10,-10,100,10,-10,100,0,20,100
patch,3,quad,-10,-10,50,10,-10,50,10,10,50,-10,10,50 # in front of it
ray,nearest,0,0,0,0,0,255,1024,50,3,back
ray,any,0,0,-200,0,0,255,1024,hit
ray,nearest,0,0,0,0,0,-255,1024,miss
ray,any,0,0,0,255,0,0,3
end,2,4,0
";

/// [`SMALL`] without its last record.
fn small_open() -> &'static str {
    SMALL.strip_suffix("end,2,4,0\n").unwrap()
}

fn some_formats() -> impl Strategy<Value = Formats> {
    let rounding = prop_oneof![Just(Rounding::NearestEven), Just(Rounding::HalfAway), Just(Rounding::Floor)];
    let keep = prop::option::of(4_u32..=16);
    (8_u32..=28, 8_u32..=28, 8_u32..=32, keep, rounding).prop_map(
        |(coord_frac_bits, dir_frac_bits, t_frac_bits, cross_keep_bits, rounding)| Formats {
            coord_frac_bits,
            dir_frac_bits,
            t_frac_bits,
            cross_keep_bits,
            rounding,
        },
    )
}

fn some_hit(formats: Formats) -> impl Strategy<Value = Option<HitWords>> {
    let facing = any::<bool>().prop_map(|back| if back { Facing::Back } else { Facing::Front });
    let hit = (0..=formats.t_limit(), 0_u32..1 << 28, facing);
    prop::option::of(hit.prop_map(|(t, patch, facing)| HitWords { t, patch, facing }))
}

fn some_ray(formats: Formats) -> impl Strategy<Value = RayVector> {
    let (cube, unit) = (1_i32 << formats.coord_frac_bits, 1_i32 << formats.dir_frac_bits);
    let origin = [-cube..cube, -cube..cube, -cube..cube];
    let dir = [1 - unit..unit, 1 - unit..unit, 1..unit];
    let words = (origin, dir, 0..=formats.t_limit());
    let words = words.prop_map(|(origin, dir, t_max)| RayWords { origin, dir, t_max });
    (words, any::<bool>(), any::<bool>(), any::<bool>(), some_hit(formats)).prop_map(
        |(words, any_hit, bit, answered, hit)| {
            let expected = if any_hit { Expected::Any(bit) } else { Expected::Nearest(hit) };
            RayVector { words, any_hit, expected: answered.then_some(expected) }
        },
    )
}

fn some_patch(formats: Formats) -> impl Strategy<Value = PatchWords> {
    let cube = 1_i32 << formats.coord_frac_bits;
    let corner = move || [-cube..cube, -cube..cube, -cube..cube];
    ([corner(), corner(), corner(), corner()], any::<bool>()).prop_map(|(mut corners, is_triangle)| {
        if is_triangle {
            corners[3] = corners[2];
        }
        PatchWords { corners, is_triangle, id: 0 }
    })
}

/// A test of any wires: the files carry what they are given.
fn some_test(vectors: &Vectors, seed: u64) -> TestVector {
    let (ray, patch) = (seed as usize % vectors.rays.len(), seed as usize / 7 % vectors.patches.len());
    let record = &vectors.patches[patch];
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (i128::from(state.cast_signed()) << 60) >> (state >> 58)
    };
    let mut values: Vec<i128> = (0..n_wires(record.is_triangle)).map(|_| next()).collect();
    for (value, name) in values.iter_mut().zip(wire_names(record.is_triangle)) {
        match name.as_bytes()[0] {
            b'a' => *value >>= 64,
            b'i' => *value &= 1,
            _ => {}
        }
    }
    let hit = HitWords { t: seed % 1000, patch: record.id, facing: Facing::Back };
    let wires = from_values(record.is_triangle, &values).unwrap();
    TestVector { ray, patch, hit: (seed & 1 == 0).then_some(hit), wires }
}

fn some_vectors() -> impl Strategy<Value = Vectors> {
    some_formats().prop_flat_map(|formats| {
        let patches = prop::collection::vec(some_patch(formats), 1..6);
        let rays = prop::collection::vec(some_ray(formats), 1..6);
        let grid = prop::option::of(1_u32..=7);
        (patches, rays, prop::collection::vec(any::<u64>(), 0..4), grid).prop_map(
            move |(mut patches, rays, seeds, grid_log2)| {
                for (patch, i) in patches.iter_mut().zip(0_u32..) {
                    patch.id = (1 << 28) - 1 - 5 * i;
                }
                let mut vectors = Vectors { formats, grid_log2, patches, rays, tests: Vec::new() };
                vectors.tests = seeds.into_iter().map(|seed| some_test(&vectors, seed)).collect();
                vectors
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn vectors_of_any_formats_survive_text_and_binary(vectors in some_vectors()) {
        let text = to_csv(&vectors);
        prop_assert_eq!(VectorsFormat::sniff(text.as_bytes()), Some(VectorsFormat::Csv));
        let read = Vectors::from_bytes(text.as_bytes()).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert_eq!(&read, &vectors);
        let bytes = to_binary(&read);
        prop_assert_eq!(VectorsFormat::sniff(&bytes), Some(VectorsFormat::Binary));
        let read = Vectors::from_bytes(&bytes).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert_eq!(&read, &vectors);
        prop_assert_eq!(to_csv(&read), text);
    }

    #[test]
    fn binary_with_any_bit_flipped_or_cut_is_refused(vectors in some_vectors(), at in any::<prop::sample::Index>(), bit in 0_u32..8) {
        let good = to_binary(&vectors);
        let mut bytes = good.clone();
        let at = at.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        // A changed magic number makes it no binary file at all.
        prop_assert!(Vectors::from_bytes(&bytes).is_err());
        prop_assert!(Vectors::from_bytes(&good[..at]).is_err());
    }

    #[test]
    fn binary_with_hostile_words_and_a_right_crc_does_not_panic(
        vectors in some_vectors(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u32>(), any::<bool>()), 1..6),
    ) {
        let mut bytes = to_binary(&vectors);
        let n_words = bytes.len() / 4 - 1;
        for (at, word, small) in changes {
            let word = if small { word % 64 } else { word };
            bytes[4 * (1 + at.index(n_words - 1))..][..4].copy_from_slice(&word.to_le_bytes());
        }
        let crc = crc32fast::hash(&bytes[..4 * n_words]);
        bytes[4 * n_words..].copy_from_slice(&crc.to_le_bytes());
        // What is accepted means something: it survives the trip through text.
        if let Ok(read) = from_binary(&bytes) {
            prop_assert_eq!(from_csv(&to_csv(&read)), Ok(read));
        }
    }

    #[test]
    fn text_with_bytes_replaced_or_lines_moved_does_not_panic(
        vectors in some_vectors(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![Just(b','), Just(b'-'), Just(b'\n'), Just(b'9'), Just(b'#'), any::<u8>()]), 1..4),
        cut in any::<prop::sample::Index>(),
    ) {
        let text = to_csv(&vectors);
        let mut bytes = text.into_bytes();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let _ = Vectors::from_bytes(&bytes[..cut.index(bytes.len())]);
        if let Ok(read) = Vectors::from_bytes(&bytes) {
            prop_assert_eq!(from_binary(&to_binary(&read)), Ok(read));
        }
    }

    #[test]
    fn random_bytes_do_not_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..400), magic in any::<bool>()) {
        if magic && bytes.len() >= 4 {
            bytes[..4].copy_from_slice(b"RVEC");
        }
        prop_assert!(Vectors::from_bytes(&bytes).is_err());
    }
}

#[test]
fn csv_of_every_record_kind_is_read_as_written() {
    let vectors = from_csv(SMALL).unwrap();
    assert_eq!(vectors.formats, FORMATS);
    assert_eq!((vectors.patches.len(), vectors.rays.len(), vectors.tests.len()), (2, 4, 0));
    let triangle = vectors.patches[0];
    assert!(triangle.is_triangle && triangle.id == 7);
    assert_eq!(triangle.corners, [[-10, -10, 100], [10, -10, 100], [0, 20, 100], [0, 20, 100]]);
    assert_eq!(vectors.patches[1].corners[3], [-10, 10, 50]);
    let hit = HitWords { t: 50, patch: 3, facing: Facing::Back };
    let answers =
        [Some(Expected::Nearest(Some(hit))), Some(Expected::Any(true)), Some(Expected::Nearest(None)), None];
    assert_eq!(vectors.rays.iter().map(|r| r.expected).collect::<Vec<_>>(), answers);
    assert_eq!(vectors.rays.iter().map(|r| r.any_hit).collect::<Vec<_>>(), [false, true, false, true]);
    assert_eq!(vectors.rays[3].words, RayWords { origin: [0; 3], dir: [255, 0, 0], t_max: 3 });
}

#[test]
fn binary_of_a_triangle_and_a_ray_has_the_documented_words() {
    let corners = [[1, 2, 3], [-1, 0, 0], [0, 0, 0], [0, 0, 0]];
    let vectors = Vectors {
        formats: FORMATS,
        grid_log2: Some(3),
        patches: vec![PatchWords { corners, is_triangle: true, id: 5 }],
        rays: vec![RayVector {
            words: RayWords { origin: [1, 0, 0], dir: [0, 0, -255], t_max: 1024 },
            any_hit: true,
            expected: Some(Expected::Any(true)),
        }],
        tests: Vec::new(),
    };
    let bytes = to_binary(&vectors);
    let words: Vec<u32> = bytes.chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
    let header = [0x4345_5652, 1, 8, 8, 8, u32::MAX, 0, 1, 1, 0, 3];
    // The records are the worked examples of rtl_model::packet, the ray's with tag 0.
    let patch = [0xF80C_0401, 0x0000_000F, 0, 0x0000_5000, 0x0000_0100];
    let ray = [0x0000_0001, 0x0020_2000, 0x0000_0001];
    let control_and_hit = [0b111, 0, 0];
    let records = [&header[..], &patch, &ray, &control_and_hit].concat();
    assert_eq!(words[..words.len() - 1], records);
}

#[test]
fn csv_with_a_fault_names_line_field_value_and_what_was_expected() {
    let cases = [
        ("", ":1: the end of the file is here, expected a line vectors,1"),
        ("# nothing\n\n", ":2: the end of the file is here, expected a line vectors,1"),
        ("vectors,1\n", ":1: the end of the file is here, expected a line formats,"),
        ("vectors,2\n", ":1: the version is '2', expected 1"),
        ("vectors\n", ":1: the version is missing"),
        ("vectors,1,x\n", ":1: field 3 is 'x', expected the end of the line"),
        ("patch,1\n", ":1: the first record is 'patch', expected vectors,1"),
        ("vectors,1\nray\n", ":2: the second record is 'ray', expected formats,"),
        ("vectors,1\nformats,29,8,8,full,floor\n", ":2: coord_frac_bits is 29, expected 8 to 28"),
        ("vectors,1\nformats,8,8,8,17,floor\n", ":2: cross_keep_bits is 17, expected 4 to 16"),
        ("vectors,1\nformats,8,8,8,most,floor\n", ":2: cross_keep_bits is 'most'"),
        (
            "vectors,1\nformats,8,8,8,full,up\n",
            ":2: the rounding is 'up', expected nearest-even or half-away or floor",
        ),
    ];
    for (text, message) in cases {
        let e = from_csv(text).unwrap_err().to_string();
        assert!(e.starts_with(message), "{text:?}: {e}");
    }
    let n_lines = small_open().lines().count();
    let lines = [
        ("hit,1", "the record is 'hit', expected patch, ray, test or end"),
        ("patch,1,disk", "the kind is 'disk', expected triangle or quad"),
        ("patch,268435456,quad", "the id is '268435456', expected a whole number, 0 to 268435455"),
        ("patch,7,triangle,0,0,0,1,0,0,0,1,0", "the id is 7, expected another: patch 1 of the file has it"),
        ("patch,1,triangle,0,0,0,1,0,256,0,1,0", "z1 is '256', expected a whole number, -256 to 255"),
        ("patch,1,triangle,0,0,0,1,0,0,0,1", "z2 is missing"),
        ("patch,1,triangle,0,0,0,1,0,0,0,1,0,5", "field 13 is '5', expected the end of the line"),
        ("ray,best,0", "the mode is 'best', expected nearest or any"),
        ("ray,any,0,0,0,0,0,256,0", "dz is '256', expected a whole number, -255 to 255"),
        ("ray,any,0,0,0,0,0,0,0", "the direction is 0,0,0, expected at least one word other than 0"),
        ("ray,any,0,0,0,0,0,1,1025", "t_max is '1025', expected a whole number, 0 to 1024"),
        ("ray,any,0,0,0,0,0,1,-1", "t_max is '-1'"),
        ("ray,any,0,0,0,0,0,0.5,1", "dz is '0.5'"),
        ("ray,any,0,0,0,0,0,1,1,yes", "the answer of an any-hit ray is 'yes', expected miss or hit"),
        ("ray,nearest,0,0,0,0,0,1,1,hit", "t of the hit is 'hit'"),
        ("ray,nearest,0,0,0,0,0,1,1,5,3", "the side of the hit is missing, expected front or back"),
        ("ray,nearest,0,0,0,0,0,1,1,5,3,left", "the side of the hit is 'left'"),
        ("test,0,5,miss,-", "the test's patch is 5, expected the id of a patch before it"),
        ("test,0,7,miss,front", "the side of a miss is 'front', expected -"),
        ("grid,3", "the grid is behind other records, expected before patches, rays and tests"),
        ("grid,8", "the grid is '8', expected a whole number, 1 to 7"),
        ("end,2,4", "the number of tests at the end is missing"),
        ("end,3,4,0", "the number of patches at the end is 3, expected 2, as many as stand before it"),
        ("end,2,40,0", "the number of rays at the end is 40, expected 4, as many"),
        ("end,2,4,1", "the number of tests at the end is 1, expected 0, as many"),
        ("end,2,4,0,0", "field 5 is '0', expected the end of the line"),
        ("test,0,7,miss,-,1,2", "a0.z is missing, expected a whole number"),
    ];
    for (line, message) in lines {
        let e = from_csv(&format!("{}{line}\n", small_open())).unwrap_err();
        assert_eq!(e.place, Place::Line(n_lines + 1), "{line}");
        assert!(e.to_string().contains(message), "{line}: {e}");
    }
    let test = |ray: &str, wires: &[i128]| {
        let wires: Vec<String> = wires.iter().map(ToString::to_string).collect();
        from_csv(&format!("{}test,{ray},7,miss,-,{}\nend,2,4,1\n", small_open(), wires.join(",")))
            .map_err(|e| e.to_string())
    };
    let mut wires = vec![0; n_wires(true)];
    assert!(test("3", &wires).is_ok());
    assert!(test("4", &wires).unwrap_err().contains("the test's ray is 4"));
    wires[32] = 2;
    assert!(test("3", &wires).unwrap_err().contains("inside012 is 2, expected 0 or 1"));
    wires[32] = 1;
    wires[0] = 1 << 64;
    assert!(test("3", &wires).unwrap_err().contains("a0.x is"));
    wires.push(0);
    assert!(test("3", &wires).unwrap_err().contains("expected the end of the line"));
}

#[test]
fn fault_with_a_huge_field_stays_short() {
    let e = from_csv(&format!("vectors,1\nformats,{}\n", "9".repeat(100_000))).unwrap_err().to_string();
    assert!(e.len() < 200 && e.contains("..."), "{e}");
    let e = from_csv(&"é".repeat(50_000)).unwrap_err().to_string();
    assert!(e.len() < 300, "{e}");
}

#[test]
fn binary_with_a_fault_names_the_byte_and_the_field() {
    let good = to_binary(&from_csv(SMALL).unwrap());
    let words = good.len() / 4;
    let with = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[4 * at..4 * at + 4].copy_from_slice(&word.to_le_bytes());
        let crc = crc32fast::hash(&bytes[..4 * (words - 1)]);
        bytes[4 * (words - 1)..].copy_from_slice(&crc.to_le_bytes());
        from_binary(&bytes).unwrap_err().to_string()
    };
    let (patches, rays) = (11, 11 + 2 * 5);
    let cases = [
        (1, 2, " byte 4: the version is 2, expected 1"),
        (2, 7, " byte 8: coord_frac_bits is 7, expected 8 to 28"),
        (6, 3, " byte 24: the rounding is 3, expected 0 to 2"),
        (7, 1 << 23, " byte 28: the number of patches is 8388608, expected 0 to 4194304"),
        (
            7,
            1,
            " byte 184: the length of the file is 184 bytes, expected 164 bytes for 1 patches, 4 rays, 0 tests",
        ),
        (8, 100, ": the length of the file is 184 bytes, expected 2488 bytes for 2 patches, 100 rays"),
        (8, 3, ": the length of the file is 184 bytes, expected 160 bytes"),
        (
            9,
            1,
            ": the length of the file is 184 bytes, expected 840 to 968 bytes for 2 patches, 4 rays, 1 tests",
        ),
        (10, 8, " byte 40: the grid is 8, expected 0 to 7"),
        (patches + 4, 1 << 31, " byte 44: a bit of the patch record outside its fields is 1, expected 0"),
        (rays + 3, 8, " byte 84: the ray's control word is 8, expected 0 to 7"),
        (rays + 3, 0, " byte 84: a bit of the ray record outside its fields is 1, expected 0"),
        (rays + 2, 1 << 31, " byte 84: a bit of the ray record outside its fields is 1, expected 0"),
    ];
    for (at, word, message) in cases {
        let e = with(at, word);
        assert!(e.contains(message), "word {at} = {word}: {e}");
    }
    let e = from_binary(&good[..good.len() - 4]).unwrap_err().to_string();
    assert!(e.contains("the length of the file is 180 bytes, expected 184 bytes"), "{e}");
    let mut flipped = good.clone();
    flipped[50] ^= 1;
    let e = from_binary(&flipped).unwrap_err().to_string();
    assert!(e.starts_with(" byte 180: the CRC is"), "{e}");
    // Counts of a file far larger than this one are refused by its length: before the CRC, and before any record.
    let mut hostile = good.clone();
    hostile[32..36].copy_from_slice(&(MAX_RAYS as u32).to_le_bytes());
    let e = from_binary(&hostile).unwrap_err().to_string();
    assert!(e.contains("the length of the file is 184 bytes, expected 402653272 bytes"), "{e}");
    let e = from_binary(b"PK\x03\x04").unwrap_err().to_string();
    assert_eq!(e, " byte 0: the magic is 'PK\\x03\\x04', expected RVEC");
    for empty in [from_binary(&[]), Vectors::from_bytes(&[])] {
        assert_eq!(empty.unwrap_err().to_string(), " byte 0: the file is empty, expected test vectors");
    }
    let e = from_binary(&good[..7]).unwrap_err().to_string();
    assert!(e.contains("the length of the file is 7 bytes, expected a multiple of 4"), "{e}");
    let e = Vectors::from_bytes(b"vectors,1\n\xff").unwrap_err().to_string();
    assert!(e.starts_with(" byte 10: the file is no UTF-8 text"), "{e}");
}

#[test]
fn csv_cut_off_anywhere_is_refused() {
    let vectors = Vectors { grid_log2: Some(4), ..from_csv(SMALL).unwrap() };
    let text = to_csv(&vectors);
    let text = text.trim_end();
    let start = text.find("vectors,1\n").unwrap();
    let mut n = 0;
    for cut in start..text.len() {
        assert!(from_csv(&text[..cut]).is_err(), "cut at byte {cut}: {:?}", &text[start..cut]);
        n += 1;
    }
    assert!(n > 200, "{n}");
    assert_eq!(from_csv(text), Ok(vectors));
    let e = from_csv(small_open()).unwrap_err().to_string();
    assert_eq!(
        e,
        ":8: the end of the file is here, expected a line end,patches,rays,tests after 2 patches, 4 rays, 0 tests"
    );
}

#[test]
fn csv_with_anything_but_comments_behind_its_end_is_refused() {
    assert!(from_csv(&format!("{SMALL}\n# done\n")).is_ok());
    for line in ["end,2,4,0", "ray,any,0,0,0,255,0,0,3", "x"] {
        let e = from_csv(&format!("{SMALL}{line}\n")).unwrap_err().to_string();
        assert!(
            e.starts_with(":10: the record is '") && e.ends_with("expected nothing after the record end"),
            "{e}"
        );
    }
}

#[test]
fn csv_with_a_grid_keeps_it_and_takes_it_once() {
    let with = |grid: &str| from_csv(&SMALL.replacen("patch,7", &format!("{grid}patch,7"), 1));
    assert_eq!(with("").unwrap().grid_log2, None);
    assert_eq!(with("grid,7\n").unwrap().grid_log2, Some(7));
    let e = with("grid,7\ngrid,7\n").unwrap_err().to_string();
    assert_eq!(e, ":4: the grid is there twice, expected once: it is 7 already");
    assert!(to_csv(&with("grid,7\n").unwrap()).contains("\ngrid,7\n"));
}

#[test]
fn csv_with_a_byte_order_mark_is_read_as_without() {
    let marked = format!("\u{feff}{SMALL}");
    assert_eq!(VectorsFormat::sniff(marked.as_bytes()), Some(VectorsFormat::Csv));
    assert_eq!(Vectors::from_bytes(marked.as_bytes()), from_csv(SMALL));
    assert!(from_csv(SMALL).is_ok());
}

#[test]
fn sniff_tells_vectors_from_rays_in_metres() {
    assert_eq!(VectorsFormat::sniff(b"# a comment\n\n vectors,1\n"), Some(VectorsFormat::Csv));
    assert_eq!(VectorsFormat::sniff(b"vectors"), Some(VectorsFormat::Csv));
    assert_eq!(VectorsFormat::sniff(b"RVEC"), Some(VectorsFormat::Binary));
    for other in [&b"0,0,0,1,0,0\n"[..], b"", b"# vectors,1\n", b"vectorsx,1"] {
        assert_eq!(VectorsFormat::sniff(other), None);
    }
    assert_eq!(VectorsFormat::of(Path::new("a.RVEC")), Some(VectorsFormat::Binary));
    assert_eq!(VectorsFormat::of(Path::new("a.csv")), Some(VectorsFormat::Csv));
    assert_eq!(VectorsFormat::of(Path::new("a.txt")), None);
}

#[test]
fn wire_names_and_values_have_one_length_and_order() {
    for is_triangle in [true, false] {
        let names = wire_names(is_triangle);
        assert_eq!(names.len(), n_wires(is_triangle));
        let values: Vec<i128> =
            (0..names.len() as i128).map(|i| if (i - 32) % 8 == 0 { 1 } else { i }).collect();
        assert_eq!(wire_values(&from_values(is_triangle, &values).unwrap()), values);
    }
    assert_eq!(wire_names(false)[0..4], ["a0.x", "a0.y", "a0.z", "a1.x"]);
    assert_eq!(wire_names(false)[27..34], ["e01", "e12", "e02", "e23", "e30", "inside012", "n012.x"]);
    assert_eq!(wire_names(true)[29], "e20");
}
