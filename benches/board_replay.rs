//! Replay of recorded work against the full simulation, without host work, one thread: the camera rays of a 256 x 256
//! picture of the Cornell box meshed into over 2,000 board patches, on the default board. Cycles and every counter are
//! checked to be equal first.

use std::path::Path;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use radiosity_engine::mesh::Mesh;
use radiosity_engine::raycast::Purpose;
use radiosity_engine::raycast::board::{BoardCaster, PurposeCommand};
use radiosity_engine::raycast::commands::{CastCommand, CommandCaster};
use radiosity_engine::raycast::null::NullCaster;
use radiosity_engine::raycast::{Query, RayCaster};
use radiosity_engine::render::camera_bundles;
use radiosity_engine::scene::{MeshTarget, Scene};
use rtl_model::board::Board;
use rtl_model::spec::BoardSpec;

fn board_replay(c: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let mut scene = Scene::load(&path).expect("the shipped scene is good");
    scene.meshing.target = MeshTarget::Elements(8000);
    let camera = scene.camera.expect("the shipped scene has a camera");
    let patches = Mesh::build(&scene).cast_patches();
    assert!(patches.len() >= 2000, "{} patches", patches.len());
    let spec = BoardSpec::preset("delft-1992").expect("a preset");
    let bundles = camera_bundles(&camera, 256, 256);
    let mut caster = BoardCaster::new(&spec, &patches, &[camera.eye]).expect("it fits");
    let new_board = caster.board().clone();
    let new_board = || new_board.clone();
    let commands: Vec<CastCommand> = {
        let mut nothing = NullCaster;
        let mut kept = CommandCaster::new(&mut nothing, caster.quantizer());
        kept.closest_hits(Purpose::Primary, Query::Bundles(&bundles)).expect("good rays");
        kept.into_commands()
    };
    caster.record();
    caster.closest_hits(Purpose::Primary, Query::Bundles(&bundles)).expect("the board answers");
    let recorded: Vec<PurposeCommand> = caster.take_recorded();

    let run = |board: &mut Board| {
        for command in &commands {
            board.trace_nearest(command.words.work()).expect("the board answers");
        }
    };
    let replay = |board: &mut Board| {
        for (_, command) in &recorded {
            board.replay(command).expect("a record of this board");
        }
    };
    let (mut full, mut replayed) = (new_board(), new_board());
    run(&mut full);
    replay(&mut replayed);
    assert_eq!(full.statistics(), replayed.statistics());
    assert_eq!(full.link_statistics(), replayed.link_statistics());
    let s = full.statistics();
    let bytes: usize = recorded.iter().map(|(_, command)| command.stream_bytes()).sum();
    println!(
        "{} patches, {} rays, {} cycles, {} tests, record {:.1} bytes a ray",
        patches.len(),
        s.canonical.rays,
        s.cycles,
        s.canonical.tests,
        bytes as f64 / s.canonical.rays as f64
    );
    let mut group = c.benchmark_group("board_replay");
    group.sample_size(20);
    group.throughput(Throughput::Elements(s.cycles));
    group.bench_function("full", |b| b.iter_batched_ref(new_board, run, BatchSize::PerIteration));
    group.bench_function("replay", |b| b.iter_batched_ref(new_board, replay, BatchSize::PerIteration));
    group.finish();
}

criterion_group!(benches, board_replay);
criterion_main!(benches);
