//! What watching costs, one thread: the camera rays of `board_sim` on the default board, unwatched, with every event made and
//! thrown away, with the whole binary log written, and with the accounts of rays and stalls. Prints the ratios to the
//! unwatched board, measured in turn within one run, and the events.

use std::path::Path;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use radiosity_engine::mesh::Mesh;
use radiosity_engine::raycast::board::{BoardCaster, CommandSink};
use radiosity_engine::raycast::{CastError, Purpose, Query, RayBundle, RayCaster};
use radiosity_engine::render::camera_bundles;
use radiosity_engine::scene::{MeshTarget, Scene};
use radiosity_engine::trace::{About, Watch, WatchOptions};
use rtl_model::sim::{Directory, Event};
use rtl_model::spec::BoardSpec;

/// Counts events and drops them.
#[derive(Default)]
struct Dropped {
    n_events: usize,
}

impl CommandSink for Dropped {
    fn board(&mut self, _: Directory) -> Result<(), CastError> {
        Ok(())
    }
    fn command(&mut self, _: Purpose, _: u64) {}
    fn events(&mut self, events: &[Event]) {
        self.n_events += std::hint::black_box(events).len();
    }
    fn answered(&mut self, _: u64) -> Result<(), CastError> {
        Ok(())
    }
}

fn cast(caster: &mut dyn RayCaster, bundles: &[RayBundle]) -> Duration {
    let start = Instant::now();
    caster.closest_hits(Purpose::Primary, Query::Bundles(bundles)).expect("the board answers");
    start.elapsed()
}

fn board_trace(c: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/scene.toml");
    let mut scene = Scene::load(&path).expect("the shipped scene is good");
    scene.meshing.target = MeshTarget::Elements(8000);
    let camera = scene.camera.expect("the shipped scene has a camera");
    let patches = Mesh::build(&scene).cast_patches();
    let spec = BoardSpec::preset("delft-1992").expect("a preset");
    let bundles = camera_bundles(&camera, 256, 256);
    let new_board = || BoardCaster::new(&spec, &patches, &[camera.eye]).expect("it fits");
    let folder = std::env::temp_dir();
    let log = folder.join(format!("radeng-bench-{}.radlog", std::process::id()));
    let about = About {
        board: spec.name.clone(),
        clock_mhz: spec.clock_mhz,
        workload: "primary".to_owned(),
        scene: None,
        picture: None,
    };
    let watched = |options: WatchOptions| {
        let mut watch = Watch::new(options, about.clone()).expect("nothing is chosen");
        let mut board = new_board();
        let start = Instant::now();
        cast(&mut board.observed(&mut watch).expect("it watches"), &bundles);
        let (seen, files) = watch.finish().expect("it is written");
        files.into_iter().for_each(|(_, file)| file.commit().expect("it is written"));
        (start.elapsed(), seen.n_events)
    };
    let unwatched = || cast(&mut new_board(), &bundles);
    let dropped = || {
        let (mut board, mut sink) = (new_board(), Dropped::default());
        cast(&mut board.observed(&mut sink).expect("it watches"), &bundles)
    };
    let logged = || watched(WatchOptions { log: Some(log.clone()), ..WatchOptions::default() });
    let accounted =
        || watched(WatchOptions { account: true, interval: Some(1000), ..WatchOptions::default() });

    // In turn, so that whatever else the machine does meets all of them; the fastest of each counts.
    let mut best = [Duration::MAX; 4];
    let mut n_events = 0;
    for _ in 0..5 {
        let (with_log, n) = logged();
        n_events = n;
        let times = [unwatched(), dropped(), with_log, accounted().0];
        best.iter_mut().zip(times).for_each(|(best, time)| *best = time.min(*best));
    }
    let ratio = |i: usize| best[i].as_secs_f64() / best[0].as_secs_f64();
    println!(
        "{n_events} events, {} bytes of log; unwatched {:.3} s, events made x {:.2}, log written x {:.2}, accounts x {:.2}",
        std::fs::metadata(&log).map_or(0, |file| file.len()),
        best[0].as_secs_f64(),
        ratio(1),
        ratio(2),
        ratio(3)
    );

    let mut group = c.benchmark_group("board_trace");
    group.sample_size(10);
    group.bench_function("unwatched", |b| b.iter_custom(|n| (0..n).map(|_| unwatched()).sum()));
    group.bench_function("log", |b| b.iter_custom(|n| (0..n).map(|_| logged().0).sum()));
    group.finish();
    // A file that isn't there needs no removing.
    let _ = std::fs::remove_file(&log);
}

criterion_group!(benches, board_trace);
criterion_main!(benches);
