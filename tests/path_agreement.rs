//! `two-pass` against `path --transport two-pass`, and `probe` against path tracing: two methods, one light.
//!
//! ```text
//! scene --two-pass--> film A;  --path, transport two-pass--> film B;  both blurred: mean of |A - B| / B
//! ```

use std::path::{Path, PathBuf};

use glam::DVec3;
use radiosity_engine::frame::{
    CasterChoice, FrameOptions, PassOne, probe_by_paths, probe_scene, render_frame,
};
use radiosity_engine::image::Film;
use radiosity_engine::radiosity::{ProbePoint, SolveOptions};
use radiosity_engine::render::path::PathOptions;
use radiosity_engine::render::{RenderMethod, RenderOptions, Transport};

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml")
}

fn frame_options(caster: CasterChoice, elements: Option<u32>) -> FrameOptions {
    FrameOptions { elements, adaptive: None, caster, pass_1: PassOne::Solve(SolveOptions::default()) }
}

fn film(name: &str, options: &FrameOptions, picture: &RenderOptions) -> Film {
    render_frame(&shipped(name), options, picture, &mut |_| {}).unwrap().rendering.film
}

/// Luminance under a Gaussian of `sigma` pixels, cut off at three of them.
fn blurred(film: &Film, sigma: f64) -> Vec<f64> {
    let reach = (3.0 * sigma).ceil() as isize;
    let kernel = |d: isize| (-0.5 * (d as f64 / sigma).powi(2)).exp();
    let (width, height) = (film.width as isize, film.height as isize);
    let along = |values: &[f64], n: isize, stride: isize, at: isize, k: isize| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for d in -reach..=reach {
            if (0..n).contains(&(k + d)) {
                sum += kernel(d) * values[(at + d * stride) as usize];
                weight += kernel(d);
            }
        }
        sum / weight
    };
    let mut values: Vec<f64> = film.pixels.iter().map(|l| l.luminance()).collect();
    let all = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y, y * width + x)));
    values = all().map(|(x, _, at)| along(&values, width, 1, at, x)).collect();
    all().map(|(_, y, at)| along(&values, height, width, at, y)).collect()
}

/// Mean over the pixels of |a - b| / b, of blurred pictures; pixels under a hundredth of the mean are left out.
fn mean_relative_difference(a: &Film, b: &Film, sigma: f64) -> f64 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let (a, b) = (blurred(a, sigma), blurred(b, sigma));
    let least = 0.01 * b.iter().sum::<f64>() / b.len() as f64;
    let lit: Vec<f64> =
        a.iter().zip(&b).filter(|(_, b)| **b > least).map(|(a, b)| (a - b).abs() / b).collect();
    assert!(lit.len() > a.len() / 2);
    lit.iter().sum::<f64>() / lit.len() as f64
}

/// The difference between the methods, and that between two runs of chance, which has no other cause than noise.
fn agreement(name: &str, side: u32, paths: u32, options: &FrameOptions) -> (f64, f64) {
    let picture = RenderOptions { width: side, height: side, samples: 4, ..RenderOptions::default() };
    let two_pass = film(name, options, &picture);
    let path = |seed| {
        let picture = RenderOptions {
            method: RenderMethod::Path,
            transport: Transport::TwoPass,
            paths: paths / 4,
            seed,
            ..picture.clone()
        };
        film(name, options, &picture)
    };
    let (one, other) = (path(1), path(2));
    let sigma = 2.0;
    let noise = mean_relative_difference(&one, &other, sigma);
    (mean_relative_difference(&two_pass, &one, sigma), noise)
}

#[test]
fn two_pass_and_path_tracing_of_its_transport_agree_on_small_pictures() {
    for name in ["cornell-box", "sphere-room", "mirror-glass"] {
        let options = frame_options(CasterChoice::Software, Some(2000));
        let (difference, noise) = agreement(name, 40, 128, &options);
        assert!(difference < 0.03, "{name}: {difference}, noise {noise}");
    }
}

/// `cargo test --release --test path_agreement -- --ignored --nocapture two_pass`: minutes.
#[test]
#[ignore = "minutes"]
fn two_pass_and_path_tracing_of_its_transport_agree_within_one_and_a_half_per_cent() {
    for name in ["cornell-box", "sphere-room", "mirror-glass"] {
        let (difference, noise) = agreement(name, 128, 512, &frame_options(CasterChoice::Software, None));
        println!("{name}, software: {:.2} %, noise {:.2} %", 100.0 * difference, 100.0 * noise);
        assert!(difference < 0.015, "{name}: {difference}, noise {noise}");
        let board = CasterChoice::Board(Box::default());
        let (difference, noise) = agreement(name, 24, 16, &frame_options(board, Some(600)));
        println!("{name}, board, small: {:.2} %, noise {:.2} %", 100.0 * difference, 100.0 * noise);
    }
}

/// Points of the Cornell box (m), their normals, and how far `probe` may be off: 2 % in penumbrae and on the ceiling. None is
/// closer to a block than an element is wide: there the radiosity of the block's foot matters, which no element resolves.
fn points() -> Vec<(ProbePoint, f64)> {
    let p = |x, y, z, nx, ny, nz, most| {
        (ProbePoint { at: DVec3::new(x, y, z), normal: DVec3::new(nx, ny, nz) }, most)
    };
    vec![
        // The open floor, penumbrae of both blocks, their umbrae.
        p(4.8, 0.0, 5.0, 0.0, 1.0, 0.0, 0.01),
        p(3.4, 0.0, 0.4, 0.0, 1.0, 0.0, 0.01),
        p(0.6, 0.0, 3.0, 0.0, 1.0, 0.0, 0.01),
        p(2.8, 0.0, 0.15, 0.0, 1.0, 0.0, 0.02),
        p(2.85, 0.0, 0.15, 0.0, 1.0, 0.0, 0.02),
        p(2.2, 0.0, 0.15, 0.0, 1.0, 0.0, 0.02),
        p(5.2, 0.0, 2.0, 0.0, 1.0, 0.0, 0.02),
        p(0.6, 0.0, 1.5, 0.0, 1.0, 0.0, 0.01),
        p(5.2, 0.0, 3.5, 0.0, 1.0, 0.0, 0.01),
        // Ceiling, back wall, red wall.
        p(2.78, 5.488, 1.0, 0.0, -1.0, 0.0, 0.02),
        p(1.0, 5.488, 5.0, 0.0, -1.0, 0.0, 0.02),
        p(2.78, 2.7, 5.592, 0.0, 0.0, -1.0, 0.01),
        p(0.001, 2.0, 2.0, 1.0, 0.0, 0.0, 0.01),
        p(0.001, 1.0, 4.0, 1.0, 0.0, 0.0, 0.01),
    ]
}

fn compare_probes(n_paths: u32, elements: Option<u32>, sigmas: f64) {
    let options = frame_options(CasterChoice::Software, elements);
    let (points, most): (Vec<ProbePoint>, Vec<f64>) = points().into_iter().unzip();
    let scene = shipped("cornell-box");
    let probed = probe_scene(&scene, &options, &points, false, &mut |_| {}).unwrap();
    let how = PathOptions { transport: Transport::Full, n_paths, max_depth: 6, seed: 1 };
    let traced = probe_by_paths(&scene, &options, &points, how).unwrap();
    let errors = traced.standard_error.unwrap();
    for (i, point) in points.iter().enumerate() {
        let (a, b, error) = (probed.irradiance[i].0, traced.irradiance[i].0, errors[i].0);
        let off = a.luminance() / b.luminance() - 1.0;
        let noise = error.luminance() / b.luminance();
        println!("{}: {:+.2} %, noise {:.2} %", point.at, 100.0 * off, 100.0 * noise);
        assert!(off.abs() < most[i] + sigmas * noise, "{}: {a:?}, {b:?} +- {error:?}", point.at);
        for c in 0..3 {
            let off = (a.0[c] / b.0[c] - 1.0).abs();
            assert!(off < 0.03 + sigmas * error.0[c] / b.0[c], "{}, channel {c}: {a:?}, {b:?}", point.at);
        }
    }
}

#[test]
fn probe_of_the_cornell_box_is_what_path_tracing_finds_within_its_noise() {
    compare_probes(40_000, None, 3.0);
}

/// `cargo test --release --test path_agreement -- --ignored --nocapture probe`: minutes.
#[test]
#[ignore = "minutes"]
fn probe_of_the_cornell_box_is_what_path_tracing_finds_within_one_per_cent() {
    compare_probes(4_000_000, None, 1.0);
}
