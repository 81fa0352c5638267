//! Pass 1 of the Cornell box from 10 k elements up, to 1 % unshot power: rays, time, memory, error against other seeds.
//!
//! ```text
//! cargo bench --bench solve_scale -- [most elements, default 100000] [reference seeds, default 3] [scene file] [least elements]
//! ```
//! Reference: the mean of solves of the same mesh with other seeds, which share nothing with the first but the mesh: other
//! visibility rays of kernel shots, other bundles. With k of them a solve of standard error s is s sqrt(1 + 1/k) away.
//! Seconds are of wall and of CPU (user, all threads); on a busy machine only the second means something. The exponent is
//! the slope of a least-squares line through log seconds against log elements.

use std::fs::read_to_string;
use std::path::PathBuf;
use std::time::Instant;

use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::{Solution, SolveOptions, solve};
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::scene::{MeshTarget, Scene};

/// Wanted elements.
const SIZES: [u32; 5] = [10_000, 30_000, 100_000, 300_000, 1_000_000];

fn main() {
    // Cargo adds flags of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let number = |k: usize, default: u64| arguments.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (most, n_reference) = (number(0, 100_000), number(1, 3));
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let path = arguments.get(2).map_or(default, PathBuf::from);
    println!("{}, to 1 % unshot power, {} threads", path.display(), rayon::current_num_threads());
    println!(
        "| elements | patches | shots | rays | wall s | CPU s | peak MiB | estimate | RMS to reference | E mean |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let (mut wall, mut cpu) = (Vec::new(), Vec::new());
    for size in SIZES.into_iter().filter(|n| (number(3, 0)..=most).contains(&u64::from(*n))) {
        let mut scene = Scene::load(&path).expect("the scene can be read");
        scene.meshing.target = MeshTarget::Elements(size);
        let mesh = Mesh::build(&scene);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let mut of_seed = |seed| {
            let options = SolveOptions { unshot_share: 0.01, seed, ..SolveOptions::default() };
            let (begun, begun_cpu) = (Instant::now(), cpu_seconds());
            let solution = solve(&scene, &mesh, &mut caster, &options, &mut |_| {})
                .expect("the software caster does not fail");
            (solution, begun.elapsed().as_secs_f64(), cpu_seconds() - begun_cpu)
        };
        let (solution, seconds, seconds_cpu) = of_seed(1);
        let peak_mib = peak_mib();
        let mut reference = vec![0.0; mesh.elements.len()];
        for seed in 2..2 + n_reference {
            for (sum, e) in reference.iter_mut().zip(of_seed(seed).0.element_irradiance) {
                *sum += e.total().sum() / n_reference as f64;
            }
        }
        let n = mesh.elements.len();
        wall.push(((n as f64).ln(), seconds.ln()));
        cpu.push(((n as f64).ln(), seconds_cpu.ln()));
        let estimate = solution.error_estimate.as_ref().map_or(0.0, |e| e.relative_rms);
        println!(
            "| {n} | {} | {} | {:.1} M | {seconds:.1} | {seconds_cpu:.1} | {peak_mib:.0} | {:.2} % | {:.2} % | {:.6} |",
            mesh.patches.len(),
            solution.n_shots,
            solution.n_rays as f64 / 1e6,
            100.0 * estimate,
            100.0 * rms(&mesh, &solution, &reference),
            mean(&mesh, &solution),
        );
    }
    if wall.len() > 1 {
        println!("\nseconds grow with elements^{:.3} (wall), ^{:.3} (CPU)", slope(&wall), slope(&cpu));
    }
}

/// RMS difference of E_mean over the mean of the reference, both by area, sums of the channels.
fn rms(mesh: &Mesh, solution: &Solution, reference: &[f64]) -> f64 {
    let (mut square, mut mean) = (0.0, 0.0);
    for ((element, e), r) in mesh.elements.iter().zip(&solution.element_irradiance).zip(reference) {
        square += element.area_m2 * (e.total().sum() - r).powi(2);
        mean += element.area_m2 * r;
    }
    let area = mesh.total_area_m2();
    (square / area).sqrt() / (mean / area)
}

/// Mean irradiance, sum of the channels (W/m^2).
fn mean(mesh: &Mesh, solution: &Solution) -> f64 {
    let incident = mesh.elements.iter().zip(&solution.element_irradiance);
    incident.map(|(el, e)| el.area_m2 * e.total().sum()).sum::<f64>() / mesh.total_area_m2()
}

/// Slope of the least-squares line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let along: f64 = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    along / points.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}

/// User CPU time of this process so far (s), where Linux tells it; else 0.
fn cpu_seconds() -> f64 {
    let stat = read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks: f64 = after_name.split_whitespace().nth(11).and_then(|t| t.parse().ok()).unwrap_or(0.0);
    ticks / 100.0
}

/// Peak resident memory of this process so far (MiB), where Linux tells it; else 0.
fn peak_mib() -> f64 {
    let status = read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default();
    line.split_whitespace().nth(1).and_then(|k| k.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}
