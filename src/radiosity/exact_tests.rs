use glam::DVec3;

use super::*;
use crate::radiosity::tests::{cluttered, grey, lit_cube, room, scene};
use crate::radiosity::{solve, solve_exactly, summary};
use crate::raycast::software::SoftwareCaster;

fn exact(scene: &Scene) -> (Mesh, Solution) {
    let mesh = Mesh::build(scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let options = SolveOptions::default();
    let solution = solve_exactly(scene, &mesh, &mut caster, &options, &mut |_| {}).unwrap();
    (mesh, solution)
}

#[test]
fn progressive_refinement_converges_to_the_exact_solution() {
    for scene in [lit_cube(0.8, 300), cluttered()] {
        let (mesh, exact) = exact(&scene);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let mut errors = Vec::new();
        for unshot_share in [1e-3, 1e-8] {
            let options = SolveOptions { unshot_share, ..SolveOptions::default() };
            let progressive = solve(&scene, &mesh, &mut caster, &options, &mut |_| {}).unwrap();
            let pairs = |of: fn(&Solution) -> &Vec<crate::radiosity::SplitIrradiance>| {
                let pairs = of(&exact).iter().zip(of(&progressive));
                pairs.map(|(a, b)| (a.total() - b.total()).0.map(f64::abs)).collect::<Vec<_>>()
            };
            let all = [pairs(|s| &s.element_irradiance), pairs(|s| &s.vertex_irradiance)].concat();
            let mean: f64 = exact.element_irradiance.iter().map(|e| e.total().0[0]).sum::<f64>()
                / exact.element_irradiance.len() as f64;
            errors.push(all.into_iter().flatten().fold(0.0, f64::max) / mean);
        }
        assert!(errors[1] < 1e-6 && errors[0] > 1e-5, "{errors:?}");
    }
}

#[test]
fn exact_account_has_nothing_unshot_and_the_residual_that_row_sums_tell() {
    let (mesh, s) = exact(&lit_cube(0.5, 400));
    assert!(s.exact && s.account.unshot_w == Rgb::BLACK, "{:?}", s.account);
    // Every patch shot B; what its row lacks is the residual: a renormalised row, or a row sum taken after one, breaks this.
    let scene = lit_cube(0.5, 400);
    let mut missing_w = 0.0;
    for record in &s.shooters {
        let patch = &mesh.patches[record.patch as usize];
        let surface = &scene.surfaces[patch.surface.0 as usize];
        let incident_w: f64 = patch
            .elements
            .clone()
            .map(|e| s.element_irradiance[e as usize].total().0[1] * mesh.elements[e as usize].area_m2)
            .sum();
        let shot_w =
            surface.exitance.0[1] * patch.area_m2 + scene.material(surface).reflectance.0[1] * incident_w;
        missing_w += shot_w * (1.0 - record.row_sum);
    }
    let residual_w = s.account.residual_w.0[1];
    assert!((missing_w - residual_w).abs() < 1e-9, "{missing_w} {residual_w}");
    assert!(residual_w.abs() > 1e-8, "rows of finite elements never sum to one exactly: {residual_w}");
    assert!(s.row_sum_error.max > 1e-6, "{:?}", s.row_sum_error);
}

#[test]
fn exact_furnace_has_radiosity_one() {
    let furnace = scene(vec![grey("half", 0.5)], room(DVec3::new(1.0, 2.0, 1.5), 0.5), vec![], 300);
    let (mesh, s) = exact(&furnace);
    for surface in summary::summarise(&furnace, &mesh, &s) {
        assert!((surface.mean_radiosity_w_m2.0[1] - 1.0).abs() < 2e-3, "{surface:?}");
    }
    assert!(s.reciprocity.n_pairs > 1000 && s.reciprocity.rms < 0.02, "{:?}", s.reciprocity);
}

#[test]
fn exact_solve_of_too_many_patches_is_refused_with_both_numbers() {
    let scene = lit_cube(0.5, 30_000);
    let mesh = Mesh::build(&scene);
    let mut caster = SoftwareCaster::new(mesh.cast_patches());
    let result = solve_exactly(&scene, &mesh, &mut caster, &SolveOptions::default(), &mut |_| {});
    let text = result.unwrap_err().to_string();
    let n = mesh.patches.len();
    assert!(text.contains("at most 5000 patches") && text.contains(&format!("the mesh has {n}")), "{text}");
}
