//! What smooth reconstruction costs, as ratios to bilinear within one run: the kernel, over random places of lit-cube's mesh
//! and of the same faces cut into triangles; building; and a picture of 512 x 512 with the software caster. One thread for
//! the kernel, all for the rest.

use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use radiosity_engine::mesh::{Corners, ElementId, Mesh, SurfacePoint};
use radiosity_engine::radiosity::{SolveOptions, solve};
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::reconstruct::{Method, Reconstruction};
use radiosity_engine::render::{RenderOptions, render};
use radiosity_engine::scene::{Scene, Shape};
use radiosity_engine::units::Rgb;

/// Places that the kernel is evaluated at.
const N_PLACES: usize = 1 << 16;

/// Random places, scattered over the mesh as no picture scatters them.
fn places(mesh: &Mesh) -> Vec<SurfacePoint> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let n = mesh.elements.len() as f64;
    (0..N_PLACES)
        .map(|_| {
            let element = ElementId((next() * n) as u32);
            let (s, t) = (next(), next());
            let fold =
                matches!(mesh.elements[element.0 as usize].corners, Corners::Triangle(_)) && s + t > 1.0;
            let st = if fold { DVec2::new(1.0 - s, 1.0 - t) } else { DVec2::new(s, t) };
            SurfacePoint { element, st }
        })
        .collect()
}

fn lit_cube() -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/lit-cube/scene.toml");
    Scene::load(&path).expect("the shipped scene is good")
}

/// Every quad as two triangles.
fn in_triangles(mut scene: Scene) -> Scene {
    let halves = std::mem::take(&mut scene.surfaces).into_iter().flat_map(|surface| match surface.shape {
        Shape::Quad([a, b, c, d]) => {
            let half = |n: u32, corners| {
                let mut half = surface.clone();
                half.name = format!("{} {n}", surface.name);
                half.shape = Shape::Triangle(corners);
                half
            };
            vec![half(0, [a, b, c]), half(1, [a, c, d])]
        }
        _ => vec![surface],
    });
    scene.surfaces = halves.collect();
    scene
}

fn at_vertices(mesh: &Mesh) -> Vec<Rgb> {
    let light = |v: &radiosity_engine::mesh::Vertex| {
        let x = v.position;
        Rgb([1.0 + x.x * x.y, 2.0 + (3.0 * x.z).sin(), 0.5 + x.y * x.y])
    };
    mesh.vertices.iter().map(light).collect()
}

fn kernel(field: &Reconstruction, mesh: &Mesh, places: &[SurfacePoint]) -> Duration {
    let start = Instant::now();
    let sum: Rgb = places.iter().map(|at| field.evaluate(mesh, *at)).sum();
    black_box(sum);
    start.elapsed()
}

/// The fastest of `rounds` of each, in turn, so that whatever else the machine does meets all of them.
fn fastest<const N: usize>(rounds: usize, mut run: impl FnMut(usize) -> Duration) -> [Duration; N] {
    let mut best = [Duration::MAX; N];
    for _ in 0..rounds {
        best.iter_mut().enumerate().for_each(|(k, best)| *best = run(k).min(*best));
    }
    best
}

fn reconstruction(c: &mut Criterion) {
    let methods = &Method::ALL[1..];
    for (kind, scene) in [("quads", lit_cube()), ("triangles", in_triangles(lit_cube()))] {
        let mesh = Mesh::build(&scene);
        let (values, places) = (at_vertices(&mesh), places(&mesh));
        let new = |method: Method| Reconstruction::new(&mesh, method, &values, &[]);
        let fields: Vec<_> = methods.iter().map(|m| new(*m)).collect();
        let times: [Duration; 5] = fastest(40, |k| kernel(&fields[k], &mesh, &places));
        let builds: [Duration; 5] = fastest(5, |k| {
            let start = Instant::now();
            black_box(new(methods[k]));
            start.elapsed()
        });
        println!("{kind}: {} elements", mesh.elements.len());
        for (k, method) in methods.iter().enumerate() {
            println!(
                "  {:<16} {:5.1} ns a value, x {:.2} bilinear; built in {:7.3} ms; {:6.1} bytes an element",
                method.name(),
                times[k].as_secs_f64() * 1e9 / N_PLACES as f64,
                times[k].as_secs_f64() / times[0].as_secs_f64(),
                builds[k].as_secs_f64() * 1e3,
                fields[k].memory_bytes() as f64 / mesh.elements.len() as f64,
            );
        }
        let mut group = c.benchmark_group(format!("evaluate_{kind}"));
        group.throughput(Throughput::Elements(N_PLACES as u64));
        for (field, method) in fields.iter().zip(methods) {
            group.bench_function(method.name(), |b| b.iter(|| kernel(field, &mesh, &places)));
        }
        group.finish();
    }
}

fn picture(_: &mut Criterion) {
    let scene = lit_cube();
    let mesh = Mesh::build(&scene);
    let camera = scene.camera.expect("the shipped scene has a camera");
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let solution =
        solve(&scene, &mesh, &mut caster, &SolveOptions::default(), &mut |_| {}).expect("it solves");
    let methods = [Method::Bilinear, Method::Hermite, Method::HermiteLimited];
    let times: [Duration; 3] = fastest(5, |k| {
        let options =
            RenderOptions { width: 512, height: 512, reconstruct: methods[k], ..RenderOptions::default() };
        let start = Instant::now();
        let picture = render(&scene, &camera, &mesh, &solution, &mut caster, &options, &mut |_| {});
        black_box(picture.expect("it renders"));
        start.elapsed()
    });
    println!("pass 2 of lit-cube, 512 x 512, the reconstruction built anew each time:");
    for (method, time) in methods.iter().zip(times) {
        let ratio = time.as_secs_f64() / times[0].as_secs_f64();
        println!("  {:<16} {:.3} s, x {ratio:.3} bilinear", method.name(), time.as_secs_f64());
    }
}

criterion_group!(benches, reconstruction, picture);
criterion_main!(benches);
