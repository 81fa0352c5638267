//! Closest hit of the software caster: 100 k triangles in a closed room, coherent and random rays, one thread and all.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use radiosity_engine::geom::Ray;
use radiosity_engine::raycast::software::SoftwareCaster;
use radiosity_engine::raycast::{CastPatch, Purpose, Query, RayCaster};

/// Rays per query.
const N_RAYS: u32 = 1 << 16;

/// A bumpy closed room of 2 x 2 x n x 2n triangles (as quads) with 64 bumpy balls in it.
fn scene() -> Vec<CastPatch> {
    let mut patches = Vec::new();
    ball(&mut patches, DVec3::ZERO, 4.0, 80);
    for k in 0..64 {
        let place = DVec3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16)) - 1.5;
        ball(&mut patches, 1.1 * place, 0.35, 17);
    }
    patches
}

fn ball(patches: &mut Vec<CastPatch>, center: DVec3, radius: f64, n: u32) {
    let vertex = |i: u32, j: u32| {
        let theta = std::f64::consts::PI * (f64::from(i) + 1e-3) / (f64::from(n) + 2e-3);
        let phi = std::f64::consts::PI * f64::from(j % (2 * n)) / f64::from(n);
        let bump = 1.0 + 0.02 * (9.0 * theta).sin() * (7.0 * phi).cos();
        center + radius * bump * DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
    };
    for i in 0..n {
        for j in 0..2 * n {
            let corners = [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1), vertex(i + 1, j)];
            patches.push(CastPatch { corners, is_triangle: false });
        }
    }
}

/// A 256 x 256 picture, 8 x 8 tile after tile.
fn coherent() -> Vec<Ray> {
    (0..N_RAYS)
        .map(|k| {
            let (tile, i) = (k / 64, k % 64);
            let (x, y) = (tile % 32 * 8 + i % 8, tile / 32 * 8 + i / 8);
            let dir = DVec3::new(f64::from(x) / 128.0 - 1.0, f64::from(y) / 128.0 - 1.0, -1.2);
            Ray::unbounded(DVec3::new(0.1, 0.2, 3.3), dir)
        })
        .collect()
}

/// Origins and directions from additive recurrences (Roberts 2018): spread evenly, no two neighbours alike.
fn random() -> Vec<Ray> {
    let at = |k: u32, j: i32| (f64::from(k) * 1.1673_f64.powi(-j)).fract() * 2.0 - 1.0;
    (0..N_RAYS)
        .map(|k| {
            let origin = 2.0 * DVec3::new(at(k, 1), at(k, 2), at(k, 3));
            Ray::unbounded(origin, DVec3::new(at(k, 4), at(k, 5), at(k, 6)))
        })
        .collect()
}

fn bench(criterion: &mut Criterion) {
    let patches = scene();
    let n_triangles = 2 * patches.len();
    let mut caster = SoftwareCaster::new(patches);
    let mut group = criterion.benchmark_group(format!("software_caster/{n_triangles}_triangles"));
    group.throughput(Throughput::Elements(u64::from(N_RAYS))).sample_size(10);
    for (name, rays) in [("coherent", coherent()), ("random", random())] {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            group.bench_function(format!("closest/{name}/{threads}_threads"), |bencher| {
                bencher.iter(|| {
                    pool.install(|| black_box(caster.closest_hits(Purpose::Primary, Query::Rays(&rays))))
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
