//! Tests of the record layouts: worked examples, sizes, round trips at random widths.

use proptest::prelude::*;

use super::*;
use crate::datapath::bundle::BundleWords;
use crate::datapath::test_support::{direction, formats, patch, point, ray};
use crate::datapath::{Facing, HitWords, PatchWords, RayWords};
use crate::fixed::Formats;

#[test]
fn record_sizes_default_formats_are_those_of_the_table() {
    let default = Formats::default();
    assert_eq!([ray_bytes(&default), patch_bytes(&default), hit_bytes(&default)], [24, 44, 8]);
    assert_eq!([any_hit_bytes(1), any_hit_bytes(32), any_hit_bytes(64)], [4, 4, 8]);
    let apex = [0; 3];
    let (corner, step_u, step_v) = ([0; 3], [0; 3], [0; 3]);
    let bytes = |bundle: BundleWords| bundle_bytes(&bundle, &default);
    assert_eq!(bytes(BundleWords::Tile { apex, corner, step_u, step_v, n: 8, m: 8 }), 52);
    assert_eq!(bytes(BundleWords::Fan { apex, vertices: [[0; 3]; 3], n: 4, m: 4, jitter: [0; 2] }), 48);
    assert_eq!(bytes(BundleWords::Hemisphere { apex, frame: [[0; 3]; 3], n: 8, m: 8, jitter: [32; 2] }), 44);
    assert_eq!(bytes(BundleWords::Targets { apex, points: vec![[0; 3]; 1] }), 24);
    assert_eq!(bytes(BundleWords::Targets { apex, points: vec![[0; 3]; 64] }), 616);
}

#[test]
fn pack_worked_examples_give_the_documented_words() {
    let small = formats(8, 8, 8);
    let corners = [[1, 2, 3], [-1, 0, 0], [0; 3], [0; 3]];
    let patch = PatchWords { corners, is_triangle: true, id: 5 };
    let mut words = vec![0xF80C_0401, 0x0000_000F, 0, 0x0000_5000, 0x0000_0100];
    assert_eq!(pack_patch(&small, &patch), words);
    assert_eq!(unpack_patch(&small, &words), Ok(patch));
    words.pop();
    let short = PacketError::Short { record: "patch", found: 4, expected: 5 };
    assert_eq!(unpack_patch(&small, &words), Err(short));

    let ray = RayWords { origin: [1, 0, 0], dir: [0, 0, -255], t_max: 1024 };
    assert_eq!(pack_ray(&small, &ray, 3), [0x0000_0001, 0x0020_2000, 0x0000_0007]);

    let hit = HitWords { t: 1 << 24, patch: 5, facing: Facing::Back };
    assert_eq!(pack_hit(&Formats::default(), Some(hit)), [0x2900_0000, 0x0180_0000]);
    assert_eq!(pack_hit(&Formats::default(), None), [0, 0]);

    let command = CommandHeader { command: Command::TraceRays, any_hit: true, items: 64, payload_words: 384 };
    assert_eq!(command.pack(), [0x0000_040A, 0x0000_0180]);

    let bundle = BundleWords::Targets { apex: [1, 0, 0], points: vec![[0, 1, 0]] };
    let packet = BundlePacket { bundle, any_hit: false, tag: 1 };
    assert_eq!(pack_bundle(&small, &packet), [0x4000_8003, 0, 0x0000_0004]);
}

#[test]
fn unpack_command_unknown_code_is_refused_with_its_value() {
    let expected = "0 to 3";
    let error = PacketError::Field { record: "command", field: "command", value: 5, expected };
    assert_eq!(CommandHeader::unpack(&[5, 0]), Err(error));
    let none = PacketError::Short { record: "command", found: 1, expected: 2 };
    assert_eq!(CommandHeader::unpack(&[0]), Err(none));
}

#[test]
fn unpack_bundle_of_too_many_rays_is_refused() {
    // Tile, n - 1 = 63, m - 1 = 1.
    let mut words = vec![0; 13];
    words[0] = 63 << 3 | 1 << 9;
    let expected = "1 to 64";
    let error = PacketError::Field { record: "bundle", field: "n * m", value: 128, expected };
    assert_eq!(unpack_bundle(&Formats::default(), &words), Err(error));
}

fn some_formats() -> impl Strategy<Value = Formats> {
    (8_u32..=28, 8_u32..=28, 8_u32..=32).prop_map(|(f, d, t)| formats(f, d, t))
}

fn bundle(formats: Formats) -> impl Strategy<Value = BundleWords> {
    let (f, d) = (formats.coord_frac_bits, formats.dir_frac_bits);
    let tile = (1_i64 << (d + 9)) - 1;
    let raw = move || [-tile..=tile, -tile..=tile, -tile..=tile];
    let size = || (1_u32..=8, 1_u32..=8);
    let frame = move || [direction(d), direction(d), direction(d)];
    prop_oneof![
        (point(f), raw(), raw(), raw(), size()).prop_map(|(apex, corner, step_u, step_v, (n, m))| {
            BundleWords::Tile { apex, corner, step_u, step_v, n, m }
        }),
        (point(f), [point(f), point(f), point(f)], size(), [0_u32..4096, 0_u32..4096])
            .prop_map(|(apex, vertices, (n, m), jitter)| BundleWords::Fan { apex, vertices, n, m, jitter }),
        (point(f), frame(), size(), [0_u32..64, 0_u32..64])
            .prop_map(|(apex, frame, (n, m), jitter)| BundleWords::Hemisphere { apex, frame, n, m, jitter }),
        (point(f), prop::collection::vec(point(f), 1..=64))
            .prop_map(|(apex, points)| BundleWords::Targets { apex, points }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pack_then_unpack_any_record_at_any_width_is_the_identity(
        (formats, ray, patch, bundle) in some_formats().prop_flat_map(|formats| {
            let (f, d, t) = (formats.coord_frac_bits, formats.dir_frac_bits, formats.t_frac_bits);
            (Just(formats), ray(f, d, t), patch(f), bundle(formats))
        }),
        tag in 0_u16..1 << 15,
        id in 0_u32..1 << 28,
        any_hit in any::<bool>(),
        back in any::<bool>(),
        bits in prop::collection::vec(any::<bool>(), 1..=64),
        items in 0_u32..1 << 28,
        payload_words in any::<u32>(),
    ) {
        let words = pack_ray(&formats, &ray, tag);
        prop_assert_eq!(words.len() * 4, ray_bytes(&formats) as usize);
        prop_assert_eq!(unpack_ray(&formats, &words), Ok((ray, tag)));

        let patch = PatchWords { id, ..patch };
        let words = pack_patch(&formats, &patch);
        prop_assert_eq!(words.len() * 4, patch_bytes(&formats) as usize);
        prop_assert_eq!(unpack_patch(&formats, &words), Ok(patch));

        let facing = if back { Facing::Back } else { Facing::Front };
        for hit in [None, Some(HitWords { t: ray.t_max, patch: id, facing })] {
            let words = pack_hit(&formats, hit);
            prop_assert_eq!(words.len() * 4, hit_bytes(&formats) as usize);
            prop_assert_eq!(unpack_hit(&formats, &words), Ok(hit));
        }

        let words = pack_any_hits(&bits);
        prop_assert_eq!(words.len() * 4, any_hit_bytes(bits.len()) as usize);
        prop_assert_eq!(unpack_any_hits(bits.len(), &words), Ok(bits));

        let packet = BundlePacket { bundle, any_hit, tag };
        let words = pack_bundle(&formats, &packet);
        prop_assert_eq!(words.len() * 4, bundle_bytes(&packet.bundle, &formats) as usize);
        prop_assert_eq!(unpack_bundle(&formats, &words), Ok(packet));

        for command in [Command::LoadScene, Command::TraceBundles, Command::TraceRays, Command::ReadCounters] {
            let header = CommandHeader { command, any_hit, items, payload_words };
            prop_assert_eq!(CommandHeader::unpack(&header.pack()), Ok(header));
        }
        let header = CellHeader { first: items, count: payload_words };
        prop_assert_eq!(CellHeader::unpack(header.pack()), header);
    }
}
