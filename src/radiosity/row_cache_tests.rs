use super::*;
use crate::radiosity::shooter::{Look, ShooterId};
use crate::radiosity::tests::{cluttered, lit_cube};
use crate::radiosity::{Aids, Solution, Start, solve, solve_on};
use crate::raycast::RayCaster;
use crate::raycast::software::SoftwareCaster;

/// Solves with the rows of `path`, and writes them.
fn solved(path: &Path, scene: &Scene, options: &SolveOptions) -> Result<Solution, RowFileError> {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let offset_m = caster.surface_offset_m();
    let mut cache = RowCache::open(path, scene, &mesh, options, "software".to_owned(), offset_m)?;
    let solution = solve_on(
        scene,
        &mesh,
        &mut caster,
        options,
        Start::Anew,
        Aids { checkpoint: None, rows: Some(&mut cache) },
        &mut |_| {},
    )
    .unwrap();
    cache.write()?;
    Ok(solution)
}

#[test]
fn solve_with_rows_of_a_file_has_the_bits_of_one_without_and_casts_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.radrow");
    let options = SolveOptions::default();
    for scene in [cluttered(), lit_cube(0.5, 300)] {
        let mesh = Mesh::build(&scene);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let alone = solve(&scene, &mesh, &mut caster, &options, &mut |_| {}).unwrap();
        let first = solved(&path, &scene, &options).unwrap();
        assert_eq!(first, alone);
        // Lights without area shine anew.
        let second = solved(&path, &scene, &options).unwrap();
        assert!(
            alone.n_rays > 1000 && second.n_rays < alone.n_rays / 20,
            "{} {}",
            second.n_rays,
            alone.n_rays
        );
        assert_eq!(Solution { n_rays: alone.n_rays, ..second }, alone);
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn rows_serve_another_reflectance_and_a_new_lamp_is_looked_at_anew() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.radrow");
    let options = SolveOptions::default();
    solved(&path, &lit_cube(0.5, 300), &options).unwrap();
    let darker = lit_cube(0.3, 300);
    assert_eq!(solved(&path, &darker, &options).unwrap().n_rays, 0);
    let mut lit = lit_cube(0.5, 300);
    lit.surfaces[0].exitance = crate::units::Rgb::WHITE;
    let mesh = Mesh::build(&lit);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let alone = solve(&lit, &mesh, &mut caster, &options, &mut |_| {}).unwrap();
    let with_rows = solved(&path, &lit, &options).unwrap();
    assert!(with_rows.n_rays > 0 && with_rows.n_rays < alone.n_rays);
    assert_eq!(Solution { n_rays: alone.n_rays, ..with_rows }, alone);
}

#[test]
fn rows_of_another_solve_and_damaged_files_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.radrow");
    let options = SolveOptions::default();
    let scene = lit_cube(0.5, 300);
    solved(&path, &scene, &options).unwrap();
    let said = |scene: &Scene, options: &SolveOptions| solved(&path, scene, options).unwrap_err().to_string();
    assert!(said(&lit_cube(0.5, 500), &options).contains("of a mesh with hash"));
    assert!(said(&scene, &SolveOptions { seed: 9, ..options }).contains("sampled with seed"));
    let bytes = std::fs::read(&path).unwrap();
    for at in (0..bytes.len()).step_by(bytes.len() / 50) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        std::fs::write(&path, &damaged).unwrap();
        assert!(said(&scene, &options).contains("a.radrow"), "byte {at}");
    }
    // Sound bytes that are no rows of the mesh.
    let mesh = Mesh::build(&scene);
    let offset_m = SoftwareCaster::new(mesh.cast_patches()).surface_offset_m();
    let empty = dir.path().join("none.radrow");
    let mut cache = RowCache::open(&empty, &scene, &mesh, &options, "software".to_owned(), offset_m).unwrap();
    let row = Row::default();
    let aim = Aim { shooter: ShooterId::Emitter(0), look: Look::Dense };
    cache.keep(aim, &row, StrayShares::default());
    cache.path.clone_from(&path);
    cache.write().unwrap();
    assert!(said(&scene, &options).contains("row 0 in ROWS is no row of this mesh"));
}
