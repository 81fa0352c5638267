//! The board's speed on a closed room: board cycles and tests per second of one thread, with the ICU utilisation.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rtl_model::board::{Board, Work};
use rtl_model::datapath::PatchWords;
use rtl_model::datapath::bundle::{BundleWords, STEP_GUARD_BITS};
use rtl_model::memory_image::MemoryImage;
use rtl_model::spec::BoardSpec;

/// A box of 6 walls of `n` x `n` quads, side 1.5 of the cube's 2.
fn room(f: u32, n: i32) -> Vec<PatchWords> {
    let half = 3 << (f - 2);
    let at = |i: i32| -half + (2 * i64::from(half) * i64::from(i) / i64::from(n)) as i32;
    let mut patches = Vec::new();
    for axis in 0..3 {
        for side in [-half, half] {
            for i in 0..n {
                for j in 0..n {
                    let corner = |u: i32, v: i32| {
                        let mut p = [side; 3];
                        p[(axis + 1) % 3] = at(i + u);
                        p[(axis + 2) % 3] = at(j + v);
                        p
                    };
                    let corners = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    patches.push(PatchWords { corners, is_triangle: false, id: patches.len() as u32 });
                }
            }
        }
    }
    patches
}

/// Camera tiles of 8 x 8 rays over `tiles` x `tiles`, from the room's middle toward one corner region.
fn tiles(f: u32, d: u32, tiles: i64) -> Vec<BundleWords> {
    let one = 1i64 << (d + STEP_GUARD_BITS);
    let step = one / (8 * tiles);
    let mut bundles = Vec::new();
    for ty in 0..tiles {
        for tx in 0..tiles {
            bundles.push(BundleWords::Tile {
                apex: [0, 0, -(1 << (f - 1))],
                corner: [-one / 2 + tx * 8 * step, -one / 2 + ty * 8 * step, one / 4 * 3],
                step_u: [step, 0, 0],
                step_v: [0, step, 0],
                n: 8,
                m: 8,
            });
        }
    }
    bundles
}

fn board(c: &mut Criterion) {
    let spec = BoardSpec::preset("delft-1992").expect("preset");
    let formats = spec.formats;
    let image = MemoryImage::build(&formats, &room(formats.coord_frac_bits, 20), Some(4));
    let bundles = tiles(formats.coord_frac_bits, formats.dir_frac_bits, 16);
    let run = || {
        let mut board = Board::new(&spec, image.clone()).expect("board");
        board.trace_nearest(Work::Bundles(&bundles)).expect("trace");
        board.statistics()
    };
    let s = run();
    let c2 = s.canonical;
    println!(
        "room of {} patches, {} rays: {} cycles, {} cells, {} entries, {} tests, ICU utilisation {:.2}",
        image.n_patches,
        c2.rays,
        s.cycles,
        c2.cells,
        c2.list_entries,
        c2.tests,
        s.icu_utilisation()
    );
    for block in &s.blocks {
        println!("  {:40} {:?}", block.block, block.cycles);
    }
    for level in &s.memory {
        println!("  {level:?}");
    }
    let mut group = c.benchmark_group("board");
    group.sample_size(10);
    group.throughput(Throughput::Elements(s.cycles));
    group.bench_function("cycles", |b| b.iter(run));
    group.throughput(Throughput::Elements(c2.tests));
    group.bench_function("tests", |b| b.iter(run));
    group.finish();
}

criterion_group!(benches, board);
criterion_main!(benches);
