use glam::DVec3;

use super::*;
use crate::framed_file::HEADER_BYTES;
use crate::framed_file::tests::{assert_damage_is_refused, reframed};
use crate::scene::Light;
use crate::units::Rgb;

/// Every field with a value of its own.
fn stored() -> (Geometry, Stored) {
    let e = SplitIrradiance { direct: Rgb([1.0, 2.0, 3.0]), indirect: Rgb([0.5, 0.25, 1e-300]) };
    let estimate = ErrorEstimate { relative_rms: 0.02, surfaces: vec![0.1], n_rounds: 4, n_rays: 1000 };
    let solution = Solution {
        element_irradiance: vec![e; 3],
        vertex_irradiance: vec![e; 5],
        account: EnergyAccount { emitted_w: Rgb::WHITE, ..EnergyAccount::default() },
        n_shots: 7,
        n_shooters: 2,
        n_rays: 1 << 40,
        row_sum_error: RowSumError { max: 0.1, mean: 0.01 },
        reciprocity: ReciprocityError { n_pairs: 3, rms: 0.002, max: 0.03 },
        error_estimate: Some(estimate),
        unshot: vec![UnshotRadiosity { emitted: Rgb::BLACK, reflected: Rgb([0.1, -0.2, 0.3]) }],
        shooters: vec![ShooterRecord { patch: 0, area_m2: 1.0, lost: 0.25, back: 0.125, row_sum: 0.999 }],
        earlier: Some(EarlierWork { n_solves: 1, n_shots: 9, n_rays: 90 }),
        exact: false,
    };
    let optics = super::super::lighting::SurfaceOptics {
        exitance: Rgb::WHITE,
        reflectance: Rgb::splat(0.5),
        specular: Rgb::BLACK,
        transmission: Rgb::BLACK,
    };
    let light = Light::Point { position: DVec3::new(1.0, 2.0, 3.0), intensity: Rgb::WHITE };
    let lighting = Lighting { surfaces: vec![optics], lights: vec![light] };
    let geometry = Geometry { hash: 42, n_elements: 3, n_vertices: 5, n_patches: 1 };
    (geometry, Stored { solution, options: SolveOptions::default(), lighting })
}

/// One patch that is one element.
fn uncut() -> Subdivision {
    Subdivision::new(1, |_, _| false)
}

fn file() -> Vec<u8> {
    let (geometry, Stored { solution, options, lighting }) = stored();
    KIND.frame(&body_of(&geometry, &uncut(), &lighting, &options, &solution))
}

fn read(bytes: &[u8]) -> Result<(Geometry, Stored), FramedFileError> {
    let path = Path::new("dir/a.radsol");
    decode(path, &KIND.read_from(path, bytes, bytes.len() as u64)?)
}

#[test]
fn solution_encoded_and_decoded_is_the_same() {
    assert_eq!(read(&file()).unwrap(), stored());
}

#[test]
fn solution_file_damaged_in_any_way_is_refused_with_its_own_error() {
    assert_damage_is_refused(&KIND, &file(), &|bytes| read(bytes).map(|_| ()));
}

/// Damage that the checksums do not see, as of a file made by another program: an error or other numbers, never a panic.
#[test]
fn solution_file_with_a_byte_changed_and_good_checksums_is_refused_or_read_without_a_panic() {
    let good = file();
    let (mut refused, mut accepted) = (0, 0);
    for at in 0..good.len() - HEADER_BYTES {
        for bits in [1, 0x80, 0xff] {
            let bytes = reframed(&KIND, &good, |body| {
                body[at] ^= bits;
                mend_sections(body);
            });
            match read(&bytes) {
                Ok(_) => accepted += 1,
                Err(FramedFileError::Body { .. }) => refused += 1,
                Err(other) => panic!("byte {at}: {other}"),
            }
        }
    }
    assert!(refused > 300 && accepted > 300, "{refused} refused, {accepted} accepted");
}

/// Puts the checksums of a body's sections right.
fn mend_sections(body: &mut [u8]) {
    let mut at = 0;
    while let Some(length) = body.get(at + 4..at + 12) {
        let length = u64::from_le_bytes(length.try_into().unwrap()) as usize;
        let Some(payload) = length.checked_add(at + 16).and_then(|end| body.get(at + 16..end)) else {
            return;
        };
        let crc = crc32fast::hash(payload);
        body[at + 12..at + 16].copy_from_slice(&crc.to_le_bytes());
        at += 16 + length;
    }
}

#[test]
fn solution_with_lists_or_numbers_that_cannot_be_is_refused_with_their_place() {
    let fault = |change: &dyn Fn(&mut Geometry, &mut Stored)| {
        let (mut geometry, mut s) = stored();
        change(&mut geometry, &mut s);
        let body = body_of(&geometry, &uncut(), &s.lighting, &s.options, &s.solution);
        read(&KIND.frame(&body)).unwrap_err().to_string()
    };
    let text = fault(&|g, _| g.n_elements = 4);
    assert!(text.contains("3 entries in ELEM, GEOM says 4"), "{text}");
    let text = fault(&|_, s| s.solution.vertex_irradiance[2].direct.0[1] = f64::NAN);
    assert!(text.contains("entry 2 of VERT is no finite irradiance"), "{text}");
    let text = fault(&|_, s| s.solution.unshot[0].emitted.0[0] = f64::INFINITY);
    assert!(text.contains("entry 0 of REST"), "{text}");
    let text = fault(&|_, s| s.lighting.surfaces[0].reflectance.0[2] = 1.5);
    assert!(text.contains("surface 1 with"), "{text}");
}

/// The example of docs/radsol.md, byte by byte: the file with one element, one vertex and one patch.
#[test]
fn solution_file_of_the_document_has_the_bytes_that_it_shows() {
    let document = include_str!("../../docs/radsol.md");
    let example = document.split("```hex\n").nth(1).expect("an example").split("```").next().unwrap();
    let shown: Vec<u8> = example
        .lines()
        .flat_map(|line| line.split('|').next().unwrap_or("").split_whitespace())
        .map(|byte| u8::from_str_radix(byte, 16).expect("two hexadecimal digits"))
        .collect();
    let optics = super::super::lighting::SurfaceOptics {
        exitance: Rgb([1.0, 1.0, 1.0]),
        reflectance: Rgb::splat(0.5),
        specular: Rgb::BLACK,
        transmission: Rgb::BLACK,
    };
    let lighting = Lighting { surfaces: vec![optics], lights: Vec::new() };
    let geometry = Geometry { hash: 0x0123_4567_89ab_cdef, n_elements: 1, n_vertices: 1, n_patches: 1 };
    let e = SplitIrradiance { direct: Rgb::splat(1.0), indirect: Rgb::splat(0.5) };
    let solution = Solution {
        element_irradiance: vec![e],
        vertex_irradiance: vec![e],
        account: EnergyAccount::default(),
        n_shots: 1,
        n_shooters: 1,
        n_rays: 300,
        row_sum_error: RowSumError { max: 0.0, mean: 0.0 },
        reciprocity: ReciprocityError::default(),
        error_estimate: None,
        unshot: vec![UnshotRadiosity { emitted: Rgb::BLACK, reflected: Rgb::splat(0.25) }],
        shooters: vec![ShooterRecord { patch: 0, area_m2: 1.0, lost: 0.0, back: 0.0, row_sum: 1.0 }],
        earlier: None,
        exact: false,
    };
    let bytes = KIND.frame(&body_of(&geometry, &uncut(), &lighting, &SolveOptions::default(), &solution));
    if std::env::var_os("RADSOL_DUMP").is_some() {
        for (i, line) in bytes.chunks(16).enumerate() {
            let hex: Vec<String> = line.iter().map(|b| format!("{b:02x}")).collect();
            println!("{:<47} | {}", hex.join(" "), 16 * i);
        }
    }
    assert_eq!(shown.len(), bytes.len());
    for (i, (shown, byte)) in shown.iter().zip(&bytes).enumerate() {
        assert_eq!(shown, byte, "byte {i}");
    }
}
