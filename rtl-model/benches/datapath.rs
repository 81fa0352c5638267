//! Speed of the board's arithmetic on one thread: ray x patch, cell step, both, a whole trace, and the image.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use rtl_model::datapath::cell_step::{Grid, advance};
use rtl_model::datapath::first_test::{self, FirstTest, first_test};
use rtl_model::datapath::ray_patch::intersect;
use rtl_model::datapath::{PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::functional::trace;
use rtl_model::memory_image::MemoryImage;
use rtl_model::oracle::{self, Oracle};

/// Ray and patch pairs of one batch.
const PAIRS: u64 = 4096;

/// splitmix64: the same inputs in every run.
struct Random(u64);

impl Random {
    /// A value in -bound..=bound.
    fn within(&mut self, bound: i32) -> i32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        let span = 2 * i64::from(bound) + 1;
        ((mixed >> 33) as i64 % span) as i32 - bound
    }

    fn point(&mut self, bound: i32) -> [i32; 3] {
        [0; 3].map(|_: i32| self.within(bound))
    }
}

/// Small quads all over the cube.
fn quads(random: &mut Random, formats: &Formats, n: u32, size_log2: u32) -> Vec<PatchWords> {
    let one = 1 << formats.coord_frac_bits;
    let quad = |id| {
        let centre = random.point(one - (one >> size_log2) * 2 - 1);
        let (u, v) = (random.point(one >> size_log2), random.point(one >> size_log2));
        let corner = |a: i32, b: i32| [0, 1, 2].map(|k| centre[k] + a * u[k] / 2 + b * v[k] / 2);
        let corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
        PatchWords { corners, is_triangle: false, id }
    };
    (0..n).map(quad).collect()
}

/// A ray that passes the middle of the patch within its size: a third or so of such rays hit.
fn aimed(random: &mut Random, formats: &Formats, patch: &PatchWords, spread: i32) -> RayWords {
    let origin = random.point((1 << formats.coord_frac_bits) - 1);
    let jitter = random.point(spread);
    let raw = [0, 1, 2].map(|k| {
        i64::from(patch.corners[0][k]) / 2 + i64::from(patch.corners[2][k]) / 2 + i64::from(jitter[k])
            - i64::from(origin[k])
    });
    let most = raw.iter().map(|w| w.abs()).max().unwrap_or(1).max(1);
    let dir = raw.map(|w| (w * ((1 << formats.dir_frac_bits) - 1) / most) as i32);
    RayWords { origin, dir, t_max: formats.t_limit() }
}

fn arithmetic(criterion: &mut Criterion) {
    let formats = Formats::default();
    let grid = Grid { log2_cells: 5 };
    let mut random = Random(1);
    let patches = quads(&mut random, &formats, PAIRS as u32, 4);
    let rays: Vec<RayWords> = patches.iter().map(|p| aimed(&mut random, &formats, p, 1 << 20)).collect();
    let pairs: Vec<_> = rays.iter().zip(&patches).collect();
    let hits = pairs.iter().filter(|(r, p)| intersect(&formats, r, p).is_some()).count();

    let mut group = criterion.benchmark_group("datapath");
    group.throughput(Throughput::Elements(PAIRS));
    group.bench_function(format!("quad_test_{}_percent_hit", 100 * hits / pairs.len()), |bench| {
        bench.iter(|| pairs.iter().filter(|(r, p)| intersect(&formats, black_box(r), p).is_some()).count());
    });
    let shifted: Vec<_> = rays.iter().zip(patches.iter().cycle().skip(1)).collect();
    group.bench_function("quad_test_miss", |bench| {
        bench.iter(|| shifted.iter().filter(|(r, p)| intersect(&formats, black_box(r), p).is_some()).count());
    });
    group.bench_function("quad_test_by_the_oracle", |bench| {
        bench.iter(|| {
            pairs.iter().filter(|(r, p)| oracle::intersect(&formats, black_box(r), p).is_some()).count()
        });
    });
    group.bench_function("cell_step", |bench| {
        bench.iter(|| {
            let next = |r: &RayWords| advance(&formats, &grid, r, grid.cell_of(&formats, r.origin), r.t_max);
            rays.iter().filter(|r| next(black_box(r)).is_some()).count()
        });
    });
    group.bench_function("quad_test_with_cell_step", |bench| {
        bench.iter(|| {
            let work = |(r, p): &(&RayWords, &PatchWords)| {
                let hit = intersect(&formats, r, p);
                let limit = hit.map_or(r.t_max, |h| h.t);
                advance(&formats, &grid, r, grid.cell_of(&formats, r.origin), limit).is_some()
            };
            pairs.iter().filter(|pair| work(black_box(pair))).count()
        });
    });
    group.finish();
}

/// Rays that pass a patch within about its own size: the narrow test alone, and before the exact one.
fn dual_precision(criterion: &mut Criterion) {
    let formats = Formats::default();
    let mut random = Random(3);
    let patches = quads(&mut random, &formats, PAIRS as u32, 4);
    let rays: Vec<RayWords> = patches.iter().map(|p| aimed(&mut random, &formats, p, 1 << 20)).collect();
    let pairs: Vec<_> = rays.iter().zip(&patches).collect();

    let mut group = criterion.benchmark_group("dual_precision");
    group.throughput(Throughput::Elements(PAIRS));
    let hits = pairs.iter().filter(|(r, p)| intersect(&formats, r, p).is_some()).count();
    group.bench_function(format!("exact_{}_percent_hit", 100 * hits / pairs.len()), |bench| {
        bench.iter(|| pairs.iter().filter(|(r, p)| intersect(&formats, black_box(r), p).is_some()).count());
    });
    for bits in [8, 12, 16] {
        let is_open = |r: &RayWords, p: &PatchWords| first_test(&formats, bits, r, p) != FirstTest::Miss;
        let open = pairs.iter().filter(|(r, p)| is_open(r, p)).count();
        group.bench_function(
            format!("first_{bits}_bits_{}_percent_left", 100 * open / pairs.len()),
            |bench| {
                bench.iter(|| pairs.iter().filter(|(r, p)| is_open(black_box(r), p)).count());
            },
        );
        group.bench_function(format!("first_{bits}_bits_then_exact"), |bench| {
            let dual = |r: &RayWords, p: &PatchWords| first_test::intersect(&formats, bits, r, p);
            bench.iter(|| pairs.iter().filter(|(r, p)| dual(black_box(r), p).is_some()).count());
        });
    }
    group.finish();
}

fn scene(criterion: &mut Criterion) {
    let formats = Formats::default();
    let mut random = Random(2);
    let patches = quads(&mut random, &formats, 100_000, 6);
    let mut group = criterion.benchmark_group("scene_100k");
    group.sample_size(10);
    group.bench_function("memory_image", |bench| {
        bench.iter_batched(
            || patches.clone(),
            |p| MemoryImage::build(&formats, &p, None),
            BatchSize::LargeInput,
        );
    });
    let image = MemoryImage::build(&formats, &patches, None);
    let rays: Vec<RayWords> =
        patches.iter().step_by(100).map(|p| aimed(&mut random, &formats, p, 1 << 22)).collect();
    let tests: u64 = rays.iter().map(|r| u64::from(trace(&image, r, false).tests)).sum();
    group.throughput(Throughput::Elements(tests));
    group.bench_function("functional_trace_tests", |bench| {
        bench.iter(|| rays.iter().filter(|r| trace(&image, black_box(r), false).hit.is_some()).count());
    });
    group.throughput(Throughput::Elements(rays.len() as u64));
    let oracle = Oracle::new(&formats, &patches);
    group.bench_function("oracle_nearest_rays", |bench| {
        bench.iter(|| rays.iter().filter(|r| oracle.nearest(black_box(r)).is_some()).count());
    });
    group.finish();
}

criterion_group!(benches, arithmetic, dual_precision, scene);
criterion_main!(benches);
