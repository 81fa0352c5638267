use radiosity_engine::mesh::Mesh;
use radiosity_engine::raycast::quantize::Quantizer;
use radiosity_engine::render::camera_bundles;
use radiosity_engine::scene::{MeshTarget, Scene};
use rtl_model::board::{Board, Work};
use rtl_model::functional::{centre_rays, trace_command};
use rtl_model::memory_image::MemoryImage;
use rtl_model::sim::EventKind;
use rtl_model::spec::{BoardSpec, Partition};
use std::path::Path;
use std::time::Instant;

fn main() {
    let scene_name = std::env::args().nth(1).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{scene_name}/scene.toml"));
    let mut scene = Scene::load(&path).unwrap();
    scene.meshing.target = MeshTarget::Elements(8000);
    let camera = scene.camera.unwrap();
    let patches = Mesh::build(&scene).cast_patches();
    let spec = BoardSpec::preset("delft-1992").unwrap();
    let q = Quantizer::new(&spec.formats, &patches, &[camera.eye]).unwrap();
    let words: Vec<_> = patches.iter().enumerate().map(|(i, p)| q.patch(i as u32, p).unwrap()).collect();
    let image = MemoryImage::for_board(&spec, &words);
    let bundles: Vec<_> = camera_bundles(&camera, 256, 256).iter().map(|b| q.bundle(0, b).unwrap()).collect();
    let piece = BoardSpec { partition: Partition::Shells, ..spec.clone() };
    let t = Instant::now();
    let work: Vec<_> = bundles.iter().map(|b| trace_command(&piece, &image, Work::Bundles(std::slice::from_ref(b)), false).1).collect();
    eprintln!("functional {:?}", t.elapsed());
    let t = Instant::now();
    let centres = centre_rays(&spec, Work::Bundles(&bundles), bundles.len());
    let cwork: Vec<_> = centres.iter().map(|r| rtl_model::functional::trace(&image, r, false)).collect();
    eprintln!("centres {:?}", t.elapsed());
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let t = Instant::now();
    for band in bundles.chunks(256) { board.trace_nearest(Work::Bundles(band)).unwrap(); }
    eprintln!("full {:?} cycles {}", t.elapsed(), board.statistics().cycles);
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let mut records = Vec::new();
    let t = Instant::now();
    for band in bundles.chunks(256) { records.push(board.record_nearest(Work::Bundles(band)).unwrap().1); }
    eprintln!("record {:?} cycles {} bytes {}", t.elapsed(), board.statistics().cycles, records.iter().map(|r| r.stream_bytes()).sum::<usize>());
    for _ in 0..3 {
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let t = Instant::now();
    for r in &records { board.replay(r).unwrap(); }
    eprintln!("replay {:?} cycles {}", t.elapsed(), board.statistics().cycles);
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let t = Instant::now();
    for band in bundles.chunks(256) { board.trace_nearest(Work::Bundles(band)).unwrap(); }
    eprintln!("full {:?} cycles {}", t.elapsed(), board.statistics().cycles);
    }
    let mut board = Board::new(&spec, image.clone()).unwrap();
    let names = board.directory().blocks;
    for (k, band) in bundles.chunks(256).enumerate() {
        let mut clock = 0;
        let mut starts = vec![(0u64, String::new()); band.len()];
        let mut marks = Vec::new();
        let mut low = false;
        let mut sink = |events: &[rtl_model::sim::Event]| for e in events {
            match e.kind() {
                Some(EventKind::Clock) => clock = u64::from(e.payload()),
                Some(EventKind::Command) => { marks.push((e.payload(), e.cycle(clock))); low = e.payload() == 2; }
                Some(EventKind::Bundle) if !low => starts[(e.payload() & 0xff_ffff) as usize] = (e.cycle(clock), names[e.place() as usize].clone()),
                _ => {}
            }
        };
        board.trace_nearest_observed(Work::Bundles(band), &mut sink).unwrap();
        eprintln!("marks {marks:?}");
        for (i, (cycle, name)) in starts.iter().enumerate() {
            let (w, c) = (&work[k * 256 + i], &cwork[k * 256 + i]);
            println!("{k},{i},{cycle},{},{},{},{},{},{},{}", &name[7..8], w.cells, w.list_entries, w.tests, c.cells, c.list_entries, c.tests);
        }
    }
    // thinned runs
    for n in [32usize, 64, 128, 256] {
        for run in [1usize, 2, 4, 8] {
            let stride = bundles.len() / n * run;
            let mut line = format!("thin n={n} run={run}:");
            for off in 0..4 {
                let chosen: Vec<_> = (0..n / run).flat_map(|b| { let s = b * stride + off * stride / 4; bundles[s..(s + run).min(bundles.len())].to_vec() }).collect();
                let mut board = Board::new(&spec, image.clone()).unwrap();
                board.trace_nearest(Work::Bundles(&chosen)).unwrap();
                line += &format!(" {}", board.statistics().cycles);
            }
            eprintln!("{line}");
        }
    }
}
