//! Pass 1 of the Cornell box with the software caster, and the kernel that it calls most.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use radiosity_engine::mesh::Mesh;
use radiosity_engine::radiosity::{SolveOptions, kernel, solve};
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::scene::{MeshTarget, Scene};

fn cornell(elements: u32) -> (Scene, Mesh) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let mut scene = Scene::load(&path).expect("the shipped scene is good");
    scene.meshing.target = MeshTarget::Elements(elements);
    let mesh = Mesh::build(&scene);
    (scene, mesh)
}

fn point_to_polygon(c: &mut Criterion) {
    let side = 0.17;
    let sources: Vec<kernel::Source> = (0..64)
        .map(|i| {
            let (x, y) = (f64::from(i % 8) * side, f64::from(i / 8) * side);
            let corner = |s: f64, t: f64| DVec3::new(x + s * side, y + t * side, 2.0);
            kernel::Source::new(&[corner(0., 0.), corner(0., 1.), corner(1., 1.), corner(1., 0.)])
        })
        .collect();
    let (above, clipped) = (DVec3::Z, DVec3::new(1.0, 0.0, 0.1).normalize());
    for (name, normal) in
        [("kernel_64_quads_above_horizon", above), ("kernel_64_quads_some_clipped", clipped)]
    {
        c.bench_function(name, |b| {
            b.iter(|| -> f64 {
                let point = black_box(DVec3::new(0.7, 0.6, 0.0));
                sources.iter().map(|s| s.form_factor(point, normal)).sum()
            });
        });
    }
}

fn solve_cornell(c: &mut Criterion) {
    let mut group = c.benchmark_group("solve_cornell");
    group.sample_size(10);
    for elements in [500, 1500] {
        let (scene, mesh) = cornell(elements);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        group.bench_function(format!("{elements}_elements"), |b| {
            b.iter(|| solve(&scene, &mesh, &mut caster, &SolveOptions::default(), &mut |_| {}));
        });
    }
    group.finish();
}

criterion_group!(benches, point_to_polygon, solve_cornell);
criterion_main!(benches);
