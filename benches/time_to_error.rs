//! Time to a given error: two-pass to RMSE 1 % of the Cornell box, its bias included, against path tracing to the same.
//!
//! ```text
//! cargo bench --bench time_to_error -- [side, default 512] [reference paths, default 128] [scene file]
//!
//! paths n, 4 n  --------> RMSE s/sqrt(n), checked: ratio 2 --> time at 1 % = time(4 n) (RMSE(4 n) / 1 %)^2
//! two-pass, settings from fast to good --> the first with RMSE <= 1 % --> its time, both passes
//! two references of other seeds --> MSE of any picture P: mean of (P - R1) (P - R2), free of their own noise
//! ```
//! RMSE: linear luminance, over the pixels that are not within one pixel of a directly seen emitter, clamped to 4x the mean,
//! over the mean. A reference of finite length is no truth; but with two independent ones the mean of the product of the
//! differences has the expectation of the square of the true error (clamping aside), whatever their noise.
//! One camera ray through each pixel's centre, so that nothing is to be filtered. Seconds are of CPU (user, all threads).

use std::fs::read_to_string;
use std::path::PathBuf;
use std::time::Instant;

use radiosity_engine::direct::DirectOptions;
use radiosity_engine::image::Film;
use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::{Solution, SolveOptions, solve};
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::render::{RenderMethod, RenderOptions, render};
use radiosity_engine::scene::{MeshTarget, Scene};

/// The error that both are to reach.
const WANTED: f64 = 0.01;
/// Paths per pixel of the first count.
const FIRST_PATHS: u32 = 16;
/// Settings of two-pass, from fast to good: elements, shadow strata, dense visibility in pass 1.
const SETTINGS: [(u32, u32, bool); 4] =
    [(5000, 8, true), (10_000, 8, true), (20_000, 8, true), (40_000, 8, true)];

/// A picture, and what it took.
struct Timed {
    film: Film,
    wall_s: f64,
    cpu_s: f64,
}

fn timed(work: impl FnOnce() -> Film) -> Timed {
    let (begun, begun_cpu) = (Instant::now(), cpu_seconds());
    let film = work();
    Timed { film, wall_s: begun.elapsed().as_secs_f64(), cpu_s: cpu_seconds() - begun_cpu }
}

fn main() {
    // Cargo adds flags of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let number = |k: usize, default: u32| arguments.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (side, reference_paths) = (number(0, 512), number(1, 128));
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let path = arguments.get(2).map_or(default, PathBuf::from);
    let mut scene = Scene::load(&path).expect("the scene can be read");
    let usual = RenderOptions { width: side, height: side, ..RenderOptions::default() };

    println!("{}, {side} x {side}, {} threads", path.display(), rayon::current_num_threads());
    let trace = |scene: &Scene, paths, seed| {
        timed(|| {
            let options = RenderOptions { method: RenderMethod::Path, paths, seed, ..usual.clone() };
            let mesh = Mesh::build(scene);
            picture(scene, &mesh, &Solution::dark(&mesh), &options)
        })
    };
    let references = [101, 102].map(|seed| trace(&scene, reference_paths, seed).film);
    let judge = Judge::new(&references);
    println!("reference: 2 x {reference_paths} paths, noise of each {:.2} %", 100.0 * judge.noise());

    println!("| method | setting | wall s | CPU s | RMSE |");
    println!("|---|---|---|---|---|");
    let row = |method: &str, setting: String, t: &Timed| {
        let rmse = judge.rmse(&t.film);
        println!("| {method} | {setting} | {:.1} | {:.1} | {:.2} % |", t.wall_s, t.cpu_s, 100.0 * rmse);
        rmse
    };
    let counts = [FIRST_PATHS, 4 * FIRST_PATHS];
    let traced = counts.map(|paths| trace(&scene, paths, 1));
    let rmse = [0, 1].map(|k| row("path", format!("{} paths", counts[k]), &traced[k]));
    let ratio = rmse[0] / rmse[1];
    println!("ratio of these errors: {ratio:.3}, 2 by 1/sqrt(N)");
    assert!((ratio - 2.0).abs() < 0.1, "the error of path tracing does not fall as 1/sqrt(N)");
    let path_cpu_s = traced[1].cpu_s * (rmse[1] / WANTED).powi(2);

    for (elements, shadow_strata, dense_visibility) in SETTINGS {
        let two_pass = timed(|| {
            scene.meshing.target = MeshTarget::Elements(elements);
            let mesh = Mesh::build(&scene);
            let mut caster = SoftwareCaster::new(mesh.cast_patches());
            // Of scenes with many patches: bundles of rays must not be what limits the error.
            let how =
                SolveOptions { dense_visibility, wanted_error: 0.5 * WANTED, ..SolveOptions::default() };
            let solution = solve(&scene, &mesh, &mut caster, &how, &mut |_| {})
                .expect("the software caster does not fail");
            let options =
                RenderOptions { direct: DirectOptions { shadow_strata, ..usual.direct }, ..usual.clone() };
            picture(&scene, &mesh, &solution, &options)
        });
        let dense = if dense_visibility { ", dense visibility" } else { "" };
        let setting = format!("{elements} elements, {shadow_strata} x {shadow_strata} shadow strata{dense}");
        if row("two-pass", setting, &two_pass) <= WANTED {
            println!(
                "to RMSE {:.0} %: two-pass {:.1} s, path {path_cpu_s:.0} s (extrapolated): a share of {:.4} of CPU time",
                100.0 * WANTED,
                two_pass.cpu_s,
                two_pass.cpu_s / path_cpu_s
            );
            return;
        }
    }
    println!("two-pass reaches {} % with none of its settings", 100.0 * WANTED);
    std::process::exit(1);
}

fn picture(scene: &Scene, mesh: &Mesh, solution: &Solution, options: &RenderOptions) -> Film {
    let camera = scene.camera.expect("the scene has a camera");
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    render(scene, &camera, mesh, solution, &mut caster, options, &mut |_| {})
        .expect("the software caster does not fail")
        .film
}

/// Judges pictures by two references.
struct Judge {
    /// Pixels that count.
    pixels: Vec<usize>,
    mean: f64,
    references: [Vec<f64>; 2],
}

impl Judge {
    fn new(references: &[Film; 2]) -> Judge {
        let film = &references[0];
        let (width, height) = (film.width, film.height);
        let near_emitter = |at: usize| {
            let (x, y) = (at % width, at / width);
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            rows.flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
                .any(|at| film.emitter[at])
        };
        let pixels: Vec<usize> = (0..width * height).filter(|at| !near_emitter(*at)).collect();
        let raw = |film: &Film, at: usize| film.pixels[at].luminance();
        let both = |at: &usize| 0.5 * (raw(&references[0], *at) + raw(&references[1], *at));
        let mean = pixels.iter().map(both).sum::<f64>() / pixels.len() as f64;
        let mut judge = Judge { pixels, mean, references: [Vec::new(), Vec::new()] };
        judge.references = [0, 1].map(|k| judge.luminances(&references[k]));
        judge
    }

    /// Over the mean, clamped.
    fn luminances(&self, film: &Film) -> Vec<f64> {
        self.pixels.iter().map(|at| (film.pixels[*at].luminance() / self.mean).min(4.0)).collect()
    }

    fn rmse(&self, film: &Film) -> f64 {
        let [first, second] = &self.references;
        let of_picture = self.luminances(film);
        let products = of_picture.iter().zip(first).zip(second).map(|((p, a), b)| (p - a) * (p - b));
        (products.sum::<f64>() / of_picture.len() as f64).max(0.0).sqrt()
    }

    /// RMS noise of one reference.
    fn noise(&self) -> f64 {
        let [first, second] = &self.references;
        let squares: f64 = first.iter().zip(second).map(|(a, b)| (a - b).powi(2)).sum();
        (0.5 * squares / first.len() as f64).sqrt()
    }
}

/// User time of this process, all threads (s).
fn cpu_seconds() -> f64 {
    // The 14th field, in hundredths of a second; the second, in parentheses, may hold spaces.
    let stat = read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    after_name.split_whitespace().nth(11).and_then(|ticks| ticks.parse::<f64>().ok()).unwrap_or(0.0) / 100.0
}
