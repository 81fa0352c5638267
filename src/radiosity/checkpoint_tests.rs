use super::*;
use crate::framed_file::tests::assert_damage_is_refused;
use crate::radiosity::solution_file::{Stored, load_of_geometry, save};
use crate::radiosity::tests::{cluttered, lit_cube};
use crate::radiosity::{Aids, FormFactorMethod, Solution, SolveError, solve_on};
use crate::raycast::software::SoftwareCaster;

const NEVER: Duration = Duration::from_secs(3600);

/// A solve that is asked to stop each time that it took `steps` more steps, and goes on each time; how often.
fn in_pieces(
    scene: &Scene,
    options: &SolveOptions,
    start: Option<&Stored>,
    steps: usize,
) -> (Solution, usize) {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("state");
    let mesh = Mesh::build(scene);
    for stops in 0.. {
        let stop = Arc::new(AtomicBool::new(false));
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let mut checkpoint = Checkpoint::open(&folder, NEVER, stop.clone(), "software".into()).unwrap();
        let mut n = 0;
        let mut count = |p: crate::radiosity::SolveProgress| {
            assert_eq!(p.resumed, stops > 0 && n == 0);
            n += 1;
            stop.store(n >= steps, Ordering::Relaxed);
        };
        let start = start.map_or(Start::Anew, Start::From);
        match solve_on(
            scene,
            &mesh,
            &mut caster,
            options,
            start,
            Aids { checkpoint: Some(&mut checkpoint), rows: None },
            &mut count,
        ) {
            Err(SolveError::Checkpoint(CheckpointError::Stopped { .. })) => {}
            other => {
                let solution = other.unwrap();
                checkpoint.remove();
                assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
                return (solution, stops);
            }
        }
    }
    unreachable!()
}

fn whole(scene: &Scene, options: &SolveOptions) -> Solution {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    crate::radiosity::solve(scene, &mesh, &mut caster, options, &mut |_| {}).unwrap()
}

#[test]
fn solve_in_pieces_gives_the_bits_of_one_whatever_memory_rows_have() {
    let scene = cluttered();
    for max_row_bytes in [u64::MAX, 100_000, 0] {
        let options = SolveOptions { unshot_share: 5e-3, max_row_bytes, ..SolveOptions::default() };
        let (pieces, stops) = in_pieces(&scene, &options, None, 23);
        assert!(stops > 3, "{stops}");
        assert_eq!(pieces, whole(&scene, &options), "{max_row_bytes} bytes");
    }
}

#[test]
fn stochastic_solve_in_pieces_gives_the_bits_of_one() {
    let scene = cluttered();
    for form_factors in [FormFactorMethod::Vertex, FormFactorMethod::Hemisphere] {
        let options = SolveOptions { form_factors, max_shooters: 20, ..SolveOptions::default() };
        let (pieces, stops) = in_pieces(&scene, &options, None, 7);
        assert!(stops > 2 && pieces.error_estimate.is_some(), "{stops}");
        assert_eq!(pieces, whole(&scene, &options), "{form_factors:?}");
    }
}

#[test]
fn relighting_in_pieces_gives_the_bits_of_one() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.radsol");
    let options = SolveOptions::default();
    let (old, new) = (lit_cube(0.5, 200), lit_cube(0.6, 200));
    let mesh = Mesh::build(&new);
    save(&path, &old, &mesh, &options, &whole(&old, &options)).unwrap();
    let stored = load_of_geometry(&path, &new, &mesh).unwrap();
    let (pieces, stops) = in_pieces(&new, &options, Some(&stored), 9);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let start = Start::From(&stored);
    let one = solve_on(&new, &mesh, &mut caster, &options, start, Aids::default(), &mut |_| {}).unwrap();
    assert!(stops > 2 && pieces.earlier.is_some(), "{stops}");
    assert_eq!(pieces, one);
}

/// Leaves a checkpoint of a small solve in a folder.
fn left_behind(
    folder: &Path,
    scene: &Scene,
    options: &SolveOptions,
    caster_name: &str,
) -> Result<(), SolveError> {
    let stop = Arc::new(AtomicBool::new(true));
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let mut checkpoint = Checkpoint::open(folder, NEVER, stop, caster_name.into())?;
    let start = Start::Anew;
    solve_on(
        scene,
        &mesh,
        &mut caster,
        options,
        start,
        Aids { checkpoint: Some(&mut checkpoint), rows: None },
        &mut |_| {},
    )
    .map(|_| ())
}

#[test]
fn checkpoint_of_another_solve_is_refused_with_what_differs() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("state");
    let (scene, options) = (lit_cube(0.5, 100), SolveOptions::default());
    let refusal = |scene: &Scene, options: &SolveOptions, caster: &str| {
        left_behind(&folder, scene, options, caster).unwrap_err().to_string()
    };
    let text = refusal(&scene, &options, "software");
    assert!(text.contains("stopped after 1 shots, as asked; the same command goes on from"), "{text}");
    let text = refusal(&lit_cube(0.6, 100), &options, "software");
    assert!(text.contains("another solve: reflectance") && text.contains("'floor'"), "{text}");
    let text = refusal(&lit_cube(0.5, 400), &options, "software");
    assert!(text.contains("its mesh is another one"), "{text}");
    let text = refusal(&scene, &SolveOptions { seed: 2, ..options }, "software");
    assert!(text.contains("its options were") && text.contains("seed: 2"), "{text}");
    let text = refusal(&scene, &options, "board");
    assert!(text.contains("cast by software") && text.contains("by board"), "{text}");
    let text = refusal(&scene, &options, "software");
    assert!(text.contains("stopped after 2 shots"), "{text}");
}

#[test]
fn checkpoint_damaged_in_any_way_is_refused_with_its_own_error() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("state");
    left_behind(&folder, &lit_cube(0.5, 20), &SolveOptions::default(), "software").unwrap_err();
    let mut good = fs::read(folder.join(NAME)).unwrap();
    // Its lists cut to the first tenth would do: the test goes over every bit.
    let path = Path::new("dir/a.radchk");
    let read = |bytes: &[u8]| -> Result<(), FramedFileError> {
        let body = KIND.read_from(path, bytes, bytes.len() as u64)?;
        let rest = &mut body.as_slice();
        let _: Key = KIND.section(path, rest, *b"OFWH")?;
        let _: Subdivision = KIND.section(path, rest, *b"TREE")?;
        let _: State = KIND.section(path, rest, *b"STAT")?;
        KIND.end(path, rest)
    };
    read(&good).unwrap();
    if good.len() < 40_000 {
        assert_damage_is_refused(&KIND, &good, &read);
    }
    good[30] ^= 1;
    fs::write(folder.join(NAME), &good).unwrap();
    let text = left_behind(&folder, &lit_cube(0.5, 20), &SolveOptions::default(), "software").unwrap_err();
    assert!(text.to_string().contains("solve.radchk: damaged"), "{text}");
}

#[test]
fn folder_that_cannot_be_used_is_refused_by_name_before_the_work() {
    let dir = tempfile::tempdir().unwrap();
    let open = |path: &Path| Checkpoint::open(path, NEVER, Arc::default(), String::new());
    let text = open(&dir.path().join("no/such")).unwrap_err().to_string();
    assert!(text.contains("no/such: the folder cannot be made"), "{text}");
    let file = dir.path().join("file");
    fs::write(&file, "x").unwrap();
    let text = open(&file).unwrap_err().to_string();
    assert!(text.contains("the folder cannot be made"), "{text}");
    let folder = dir.path().join("state");
    let first = open(&folder).unwrap();
    let text = open(&folder).unwrap_err().to_string();
    assert!(text.contains("another solve is using this folder now"), "{text}");
    drop(first);
    open(&folder).unwrap();
}

#[test]
fn write_that_was_killed_before_its_rename_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join(".solve.radchk.aB3"), "half").unwrap();
    fs::write(dir.path().join("mine.txt"), "stays").unwrap();
    let checkpoint = Checkpoint::open(dir.path(), NEVER, Arc::default(), String::new()).unwrap();
    assert!(!dir.path().join(".solve.radchk.aB3").exists());
    checkpoint.remove();
    assert!(dir.path().join("mine.txt").exists());
}
