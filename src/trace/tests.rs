//! Runs watched live and from their logs.

use super::*;
use crate::geom::DVec3;
use crate::raycast::board::BoardCaster;
use crate::raycast::{CastPatch, MAX_BUNDLE_RAYS, Query, RayBundle, RayCaster};
use crate::scene::Camera;
use rtl_model::sim::Phase;
use rtl_model::spec::{BoardSpec, Partition};

/// A wall of quads at z = 0, seen from z = 2.
pub(super) fn wall() -> Vec<CastPatch> {
    let n = 6;
    let at = |i: i32| f64::from(i) / f64::from(n) * 2.0 - 1.0;
    let quad = |i: i32, j: i32| CastPatch {
        corners: [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| DVec3::new(at(i), at(j), 0.0)),
        is_triangle: false,
    };
    (0..n).flat_map(|i| (0..n).map(move |j| quad(i, j))).collect()
}

const EYE: DVec3 = DVec3::new(0.1, 0.2, 2.0);

pub(super) fn spec(partition: Partition) -> BoardSpec {
    let mut spec = BoardSpec { partition, name: "test".to_owned(), ..BoardSpec::default() };
    spec.clusters.count = 2;
    spec.dispatch.low_resolution_min_bundles = 1;
    spec
}

fn camera_bundles(width: u32, height: u32) -> Vec<RayBundle> {
    let camera = Camera { eye: EYE, target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 70.0 };
    crate::render::camera_bundles(&camera, width, height)
}

pub(super) const PICTURE: Picture = Picture { width: 20, height: 12, samples: 1 };

fn about(spec: &BoardSpec) -> About {
    About {
        board: spec.name.clone(),
        clock_mhz: spec.clock_mhz,
        workload: "primary".to_owned(),
        scene: None,
        picture: Some(PICTURE),
    }
}

/// Casts 10 shadow rays, then a picture's camera rays, watched.
pub(super) fn watch(spec: &BoardSpec, options: WatchOptions) -> Result<(Observed, Vec<Pending>), TraceError> {
    let mut watch = Watch::new(options, about(spec))?;
    let mut caster = BoardCaster::new(spec, &wall(), &[EYE]).unwrap();
    let mut observed = caster.observed(&mut watch).unwrap();
    let bundles = camera_bundles(PICTURE.width, PICTURE.height);
    let rays: Vec<_> = (0..10).map(|i| bundles[0].ray(i)).collect();
    // A fault shows again when the watch ends.
    let _ = observed.any_hits(Purpose::Shadow, Query::Rays(&rays));
    let _ = observed.any_hits(Purpose::Shadow, Query::Rays(&[]));
    let _ = observed.closest_hits(Purpose::Primary, Query::Bundles(&bundles));
    watch.finish()
}

pub(super) fn put_in_place(files: Vec<Pending>) {
    files.into_iter().for_each(|(_, file)| file.commit().unwrap());
}

/// Decoded events of such a run, with its places and cycles.
pub(super) fn seen(spec: &BoardSpec) -> (Places, Vec<(Cycle, Seen)>, Cycle) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    let (observed, files) =
        watch(spec, WatchOptions { log: Some(path.clone()), ..Default::default() }).unwrap();
    put_in_place(files);
    let mut log = Reader::open(&path).unwrap();
    let mut decoder = Decoder::new(&observed.places);
    let mut all = Vec::new();
    while let Some(events) = log.next_chunk().unwrap() {
        all.extend(events.iter().filter_map(|event| decoder.read(*event).unwrap()));
    }
    (observed.places, all, observed.n_cycles)
}

#[test]
fn watched_run_seen_live_and_from_its_log_is_the_same_in_every_file() {
    for partition in [Partition::Grid, Partition::ShellsStatic] {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let spec = spec(partition);
        let look = |log: Option<&str>, wave: &str, slices: &str| WatchOptions {
            log: log.map(path),
            wave: Some(path(wave)),
            slices: Some(path(slices)),
            window: "100..900".parse().unwrap(),
            account: true,
            interval: Some(128),
            rays: Choice { rays: vec![3, 17], pixels: vec![[19, 11]] },
            force: false,
        };
        let (live, files) = watch(&spec, look(Some("t.radlog"), "live.fst", "live.json")).unwrap();
        assert!(!path("t.radlog").exists() && !path("live.fst").exists(), "nothing is in place yet");
        put_in_place(files);
        let log = Reader::open(&path("t.radlog")).unwrap();
        assert_eq!(log.trailer().commands, live.commands);
        let (again, files) = replay(log, look(None, "again.fst", "again.json")).unwrap();
        put_in_place(files);
        let bytes = |name: &str| std::fs::read(path(name)).unwrap();
        assert_eq!(bytes("live.fst"), bytes("again.fst"));
        assert_eq!(bytes("live.json"), bytes("again.json"));
        assert_eq!((live.n_events, live.n_cycles), (again.n_events, again.n_cycles));
        assert_eq!(live.chosen, again.chosen);
        let both = [&live, &again];
        let [a, b] = both.map(|seen| seen.roots.as_ref().unwrap().cycles().collect::<Vec<_>>());
        assert_eq!(a, b);
        let [a, b] = both.map(|seen| seen.intervals.as_ref().unwrap().intervals().to_vec());
        assert_eq!(a, b);
        let [a, b] = both.map(|seen| seen.lives.as_ref().unwrap());
        assert_eq!(a.rays(), b.rays());
        assert_eq!(a.rays().rays, 10 + 240);
        assert_eq!(a.low_resolution().rays > 0, partition == Partition::ShellsStatic);
    }
}

#[test]
fn watched_run_finds_chosen_rays_in_their_commands_and_bundles() {
    let choice = Choice { rays: vec![3, 10 + 64 + 5], pixels: vec![[0, 0], [19, 11]] };
    let options = WatchOptions { rays: choice, ..WatchOptions::default() };
    let (observed, files) = watch(&spec(Partition::Grid), options).unwrap();
    assert!(files.is_empty());
    let places: Vec<_> = observed.chosen.iter().map(|ray| ray.cast.unwrap()).collect();
    // 3 x 2 tiles in Morton order: widths 8 8 | 8 8 | 4 4, heights 8 4 8 4: the last pixel is the last ray.
    assert_eq!(places, [(0, 3), (1, 69), (1, 0), (1, 239)]);
    for ray in &observed.chosen {
        let life = ray.life.as_ref().unwrap();
        assert_eq!(life.cycles.iter().sum::<u64>(), life.died.unwrap() - life.born);
        assert_eq!(life.spans[0], (life.born, Phase::Waiting));
        assert_eq!((life.command, life.ray), ray.cast.unwrap());
    }
    let in_bundle =
        |i: usize| observed.chosen[i].life.as_ref().map(|life| (life.bundle, life.index)).unwrap();
    assert_eq!([0, 1, 2].map(in_bundle), [(0, 3), (1, 5), (0, 0)]);
}

#[test]
fn pixel_of_a_picture_has_the_rays_that_meet_what_the_pixel_shows() {
    // All rays of a many-sampled picture, bands and all, in the order of their casting.
    for (width, height, samples) in [(20, 12, 1), (20, 12, 3), (200, 130, 2)] {
        let mut seen = std::collections::HashSet::new();
        let mut first = vec![u64::MAX; samples as usize];
        for y in 0..height {
            for x in 0..width {
                let numbers = crate::render::camera_ray_numbers(width, height, samples, x, y);
                assert_eq!(numbers.len(), samples as usize);
                first.iter_mut().zip(&numbers).for_each(|(first, n)| *first = (*first).min(*n));
                assert!(numbers.iter().all(|n| seen.insert(*n)), "a ray of two pixels");
            }
        }
        assert_eq!(seen.len() as u32, width * height * samples);
        assert_eq!(seen.iter().max(), Some(&(u64::from(width * height * samples) - 1)));
        let tile_rays = MAX_BUNDLE_RAYS as u64;
        assert!(first.iter().enumerate().all(|(s, n)| *n % 4 == 0 && *n <= s as u64 * 256 * tile_rays));
    }
}

#[test]
fn choice_outside_of_the_run_is_refused_with_its_range() {
    let fault = |rays: &[u64], pixels: &[[u32; 2]]| {
        let rays = Choice { rays: rays.to_vec(), pixels: pixels.to_vec() };
        watch(&spec(Partition::Grid), WatchOptions { rays, ..Default::default() }).unwrap_err().to_string()
    };
    assert_eq!(fault(&[250], &[]), "--ray 250: the board cast 250 rays, expected a number in 0..=249");
    let e = fault(&[], &[[20, 0]]);
    assert_eq!(e, "--pixel 20,0: expected a column in 0..=19 and a row in 0..=11");
    let none = Choice { pixels: vec![[0, 0]], ..Choice::default() }.resolve(None).unwrap_err();
    assert!(none.to_string().contains("expected a workload with camera rays"));
}

#[test]
fn watch_with_a_fault_ends_the_run_and_leaves_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let options = WatchOptions {
        wave: Some(dir.path().join("w.fst")),
        log: Some(dir.path().join("t.radlog")),
        window: "90000000..".parse().unwrap(),
        ..WatchOptions::default()
    };
    let e = watch(&spec(Partition::Grid), options).unwrap_err().to_string();
    assert!(e.starts_with("--window begins with cycle 90000000: expected one of the run's"), "{e}");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    let many = WatchOptions { interval: Some(1), ..WatchOptions::default() };
    let mut watch = Watch::new(many, about(&spec(Partition::Grid))).unwrap();
    watch.board(Directory { blocks: vec!["what".to_owned()], links: Vec::new() }).unwrap_err();
    let e = watch.finish().unwrap_err().to_string();
    assert!(e.contains("'what' is no block"), "{e}");
}

#[test]
fn log_that_tells_what_no_board_tells_is_refused() {
    use rtl_model::sim::EventKind;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.radlog");
    let directory = Directory { blocks: vec!["dram".to_owned()], links: Vec::new() };
    let header = Header {
        board: "x".to_owned(),
        clock_mhz: 25.0,
        workload: "primary".to_owned(),
        scene: None,
        picture: None,
        directory,
    };
    let mut writer = Writer::create(&path, &header).unwrap();
    writer.events(&[Event::new(0, EventKind::Clock, 0, 0), Event::new(0, EventKind::Push, 7, 0)]).unwrap();
    writer.finish(Vec::new()).unwrap().commit().unwrap();
    let options = WatchOptions { account: true, ..WatchOptions::default() };
    let e = replay(Reader::open(&path).unwrap(), options).unwrap_err().to_string();
    assert_eq!(e, "event 1: link 7, but the directory has 0");
}
