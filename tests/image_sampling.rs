//! What adaptive image sampling and the qualities buy on the Cornell box, against a reference of 256 places a pixel.
//!
//! Long: `cargo test --release --test image_sampling -- --ignored --nocapture`; docs/image-sampling.md has the figures.

use std::path::{Path, PathBuf};

use radiosity_engine::direct::DirectOptions;
use radiosity_engine::frame::{CasterChoice, Frame, FrameOptions, PassOne, render_frame};
use radiosity_engine::image::Exposure;
use radiosity_engine::image::png::srgb_encode;
use radiosity_engine::radiosity::SolveOptions;
use radiosity_engine::render::{AdaptiveSampling, Filter, RenderOptions};
use radiosity_engine::units::Rgb;

const SIDE: usize = 256;

fn cornell_box() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml")
}

fn frame(elements: u32, picture: &RenderOptions) -> Frame {
    let options = FrameOptions {
        elements: Some(elements),
        adaptive: None,
        caster: CasterChoice::Software,
        pass_1: PassOne::Solve(SolveOptions::default()),
    };
    render_frame(&cornell_box(), &options, picture, &mut |_| {}).unwrap()
}

fn picture(side: usize, samples: u32) -> RenderOptions {
    // Full sampling of lamps: what is measured is the film.
    let direct = DirectOptions::full(4);
    RenderOptions { width: side as u32, height: side as u32, samples, direct, ..RenderOptions::default() }
}

/// A picture's pixels and where they are near a lamp that is seen directly.
struct Reference {
    pixels: Vec<Rgb>,
    near_lamp: Vec<bool>,
    /// Display-linear value of unit radiance.
    scale: f64,
}

impl Reference {
    /// 4 x 4 pixels of 16 rays each for one, other shadow rays in each.
    fn new(elements: u32) -> Reference {
        let fine = RenderOptions { seed: 77, ..picture(4 * SIDE, 16) };
        let film = frame(elements, &fine).rendering.film;
        let mut pixels = vec![Rgb::BLACK; SIDE * SIDE];
        let mut lamp = vec![false; SIDE * SIDE];
        for (i, (l, emitter)) in film.pixels.iter().zip(&film.emitter).enumerate() {
            let (x, y) = (i % film.width / 4, i / film.width / 4);
            pixels[y * SIDE + x] += *l / 16.0;
            lamp[y * SIDE + x] |= *emitter;
        }
        let near = |i: usize| {
            let (x, y) = (i % SIDE, i / SIDE);
            let ys = y.saturating_sub(1)..=(y + 1).min(SIDE - 1);
            ys.into_iter().any(|y| (x.saturating_sub(1)..=(x + 1).min(SIDE - 1)).any(|x| lamp[y * SIDE + x]))
        };
        let near_lamp = (0..SIDE * SIDE).map(near).collect();
        let scale = Exposure::Auto.resolve(&film).scale();
        Reference { pixels, near_lamp, scale }
    }

    /// RMSE of linear luminance, clamped to 4 times the mean, over the mean; of tones.
    fn errors(&self, pixels: &[Rgb]) -> [f64; 2] {
        let kept: Vec<usize> = (0..pixels.len()).filter(|i| !self.near_lamp[*i]).collect();
        let mean = kept.iter().map(|i| self.pixels[*i].luminance()).sum::<f64>() / kept.len() as f64;
        let rms = |of: &dyn Fn(Rgb) -> f64| {
            let squares: f64 = kept.iter().map(|i| (of(pixels[*i]) - of(self.pixels[*i])).powi(2)).sum();
            (squares / kept.len() as f64).sqrt()
        };
        let linear = rms(&|l| l.luminance().min(4.0 * mean)) / mean;
        let tone = rms(&|l| srgb_encode((l.luminance() * self.scale).clamp(0.0, 1.0)));
        [linear, tone]
    }
}

fn adaptive(min: u32, max: u32, contrast: f64) -> RenderOptions {
    let adaptive = Some(AdaptiveSampling { max, contrast, exposure: Exposure::Auto });
    RenderOptions { adaptive, ..picture(SIDE, min) }
}

/// Rays a pixel, the two errors.
fn row(reference: &Reference, elements: u32, name: &str, options: &RenderOptions) -> [f64; 3] {
    let rendering = frame(elements, options).rendering;
    let rays = rendering.n_camera_rays as f64 / (SIDE * SIDE) as f64;
    let [linear, tone] = reference.errors(&rendering.film.pixels);
    println!("{name:<22} {rays:>6.2} rays  RMSE {:>6.3} %  tone {:>7.5}", 100.0 * linear, tone);
    [rays, linear, tone]
}

/// The error of fixed counts at `rays` a pixel, on a line through the measured ones in log-log.
fn at(fixed: &[[f64; 3]], rays: f64, which: usize) -> f64 {
    let pair = fixed.windows(2).find(|w| rays <= w[1][0]).unwrap_or(&fixed[fixed.len() - 2..]);
    let (a, b) = (pair[0], pair[1]);
    let slope = (b[which] / a[which]).ln() / (b[0] / a[0]).ln();
    a[which] * (rays / a[0]).powf(slope)
}

#[test]
#[ignore = "minutes: renders a reference of 16.8 million camera rays"]
fn adaptive_sampling_at_equal_rays_has_a_smaller_error_than_fixed_counts() {
    const ELEMENTS: u32 = 1200;
    let reference = Reference::new(ELEMENTS);
    let run = |name: &str, options: &RenderOptions| row(&reference, ELEMENTS, name, options);
    let fixed: Vec<_> =
        [1, 2, 3, 4, 6, 8, 12, 16].map(|n| run(&format!("fixed {n}"), &picture(SIDE, n))).to_vec();
    for filter in [Filter::Tent, Filter::Gaussian, Filter::Mitchell] {
        for n in [1, 4, 16] {
            let options = RenderOptions { filter, ..picture(SIDE, n) };
            run(&format!("fixed {n} {}", filter.name()), &options);
        }
    }
    for (min, contrast) in [
        (1, 0.01),
        (1, 0.02),
        (1, 0.03),
        (1, 0.05),
        (1, 0.1),
        (2, 0.02),
        (2, 0.03),
        (2, 0.05),
        (4, 0.02),
        (4, 0.03),
        (4, 0.05),
    ] {
        let [rays, linear, tone] =
            run(&format!("{min}..16, contrast {contrast}"), &adaptive(min, 16, contrast));
        let (fixed_linear, fixed_tone) = (at(&fixed, rays, 1), at(&fixed, rays, 2));
        println!(
            "{:<22} fixed counts at these rays: RMSE {:.3} % ({:.2}x), tone {:.5} ({:.2}x)",
            "",
            100.0 * fixed_linear,
            fixed_linear / linear,
            fixed_tone,
            fixed_tone / tone
        );
        assert!(linear < fixed_linear && tone < fixed_tone);
    }
}

#[test]
#[ignore = "minutes: renders a reference of 16.8 million camera rays on a fine mesh"]
fn qualities_trade_time_for_error() {
    let reference = Reference::new(32_000);
    for (elements, min, max, strata, error, contrast) in [
        (1000, 1, 1, 4, 0.05, 0.05),
        (1000, 1, 4, 4, 0.05, 0.05),
        (1000, 1, 8, 4, 0.05, 0.05),
        (4000, 1, 1, 8, 0.02, 0.03),
        (4000, 1, 4, 8, 0.02, 0.05),
        (4000, 1, 8, 8, 0.02, 0.03),
        (4000, 1, 16, 8, 0.02, 0.03),
        (16_000, 1, 16, 8, 0.005, 0.02),
        (16_000, 4, 16, 8, 0.02, 0.02),
        (16_000, 4, 16, 8, 0.005, 0.02),
    ] {
        let direct = DirectOptions { shadow_strata: strata, shadow_error: error, ..DirectOptions::default() };
        let options = RenderOptions { direct, ..adaptive(min, max, contrast) };
        let frame = frame(elements, &options);
        let [linear, tone] = reference.errors(&frame.rendering.film.pixels);
        let seconds =
            |name: &str| frame.timings.phases.iter().find(|p| p.name == name).map_or(0.0, |p| p.seconds);
        println!(
            "{elements:>6} elements, {min}..{max} at {contrast}, {strata} x {strata} to {error}: pass 1 {:.2} s, \
             pass 2 {:.2} s, {:.2} rays, RMSE {:.3} %, tone {tone:.5}",
            seconds("pass 1"),
            seconds("pass 2"),
            frame.rendering.mean_rays_per_pixel(),
            100.0 * linear
        );
    }
}
