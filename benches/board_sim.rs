//! The cycle model's speed, one thread: the camera rays of a 256 x 256 picture of the Cornell box meshed into over 2,000
//! board patches, on the default board. Board cycles per second and tests per second, and the ICU utilisation that
//! they were reached at: an idle board ticks fast.

use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use radiosity_engine::mesh::Mesh;
use radiosity_engine::raycast::board::BoardCaster;
use radiosity_engine::raycast::{Purpose, Query, RayCaster};
use radiosity_engine::render::camera_bundles;
use radiosity_engine::scene::{MeshTarget, Scene};
use rtl_model::spec::BoardSpec;

fn board_sim(c: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let mut scene = Scene::load(&path).expect("the shipped scene is good");
    scene.meshing.target = MeshTarget::Elements(8000);
    let camera = scene.camera.expect("the shipped scene has a camera");
    let patches = Mesh::build(&scene).cast_patches();
    assert!(patches.len() >= 2000, "{} patches", patches.len());
    let spec = BoardSpec::preset("delft-1992").expect("a preset");
    let bundles = camera_bundles(&camera, 256, 256);
    let new_board = || BoardCaster::new(&spec, &patches, &[camera.eye]).expect("it fits");
    let cast = |caster: &mut BoardCaster| {
        caster.closest_hits(Purpose::Primary, Query::Bundles(&bundles)).expect("the board answers")
    };

    let mut first = new_board();
    cast(&mut first);
    let s = first.board().statistics();
    println!(
        "{} patches, {} rays, {} cycles, {} cells, {} tests, ICU utilisation {:.2}",
        patches.len(),
        s.canonical.rays,
        s.cycles,
        s.canonical.cells,
        s.canonical.tests,
        s.icu_utilisation()
    );
    let mut group = c.benchmark_group("board_sim");
    group.sample_size(10);
    for (unit, n) in [("cycles", s.cycles), ("tests", s.canonical.tests)] {
        group.throughput(Throughput::Elements(n));
        group.bench_function(unit, |b| {
            b.iter_batched_ref(new_board, cast, criterion::BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group!(benches, board_sim);
criterion_main!(benches);
