//! `verify` on every shipped scene, and what the width of the words costs: long runs.
//!
//! ```text
//! cargo test --release --test verify_scenes -- --ignored --nocapture
//! ```

use std::path::{Path, PathBuf};

use radiosity_engine::frame::{Verified, verify_scene};
use radiosity_engine::radiosity::SolveOptions;
use radiosity_engine::render::RenderOptions;
use radiosity_engine::verify::VerifyOptions;
use rtl_model::spec::BoardSpec;

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml")
}

/// A scene with its own mesh, and the default board with words of so many fraction bits.
fn verified(name: &str, bits: u32, n_rays: u64) -> Verified {
    let mut board = BoardSpec::default();
    (board.formats.coord_frac_bits, board.formats.dir_frac_bits, board.formats.t_frac_bits) =
        (bits, bits, bits);
    let options = VerifyOptions {
        n_rays,
        n_clocked: 2_000,
        first_test_bits: vec![8, 12],
        solve: SolveOptions::default(),
        picture: RenderOptions::default(),
        compare_image: false,
    };
    let verified = verify_scene(&scene(name), None, &board, &options, &mut |_| ()).unwrap();
    let found = &verified.verification;
    println!("{name}, {bits} bits: {} rays, {:?}, {:?}", found.n_rays(), found.misclassified, found.t_error);
    assert!(found.passed() && found.n_wire_tests > 0, "{name}, {bits} bits: {:?}", found.first_mismatch);
    assert_eq!(found.misclassified.unexplained, 0, "{name}, {bits} bits: {:?}", found.first_unexplained);
    verified
}

#[test]
#[ignore = "a minute or two: the rays of ten scenes"]
fn verify_of_every_shipped_scene_passes_and_explains_every_difference() {
    let scenes = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")).unwrap();
    let is_scene = |path: &Path| path.is_dir() && !path.ends_with("spaces");
    let folders = scenes.map(|entry| entry.unwrap()).filter(|entry| is_scene(&entry.path()));
    let names: Vec<String> = folders.map(|entry| entry.file_name().into_string().unwrap()).collect();
    assert!(names.len() >= 10, "{names:?}");
    for name in names {
        verified(&name, 24, 100_000);
    }
}

#[test]
#[ignore = "some minutes: a million rays at each of five widths, two scenes"]
fn verify_at_growing_widths_misclassifies_less_and_under_a_thousandth_at_16_bits() {
    for name in ["cornell-box", "sphere-room"] {
        let shares = [8, 12, 16, 20, 24].map(|bits| {
            let found = verified(name, bits, 1_000_000).verification;
            found.misclassified.total() as f64 / found.n_rays() as f64
        });
        assert!(shares.windows(2).all(|pair| pair[1] <= pair[0]), "{name}: {shares:?}");
        assert!(shares[0] > 0.0 && shares[2] <= 1e-3, "{name}: {shares:?}");
    }
}
