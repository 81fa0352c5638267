//! The ambient term: an estimate of the light that was not shot yet, for pictures of unfinished solutions.
//!
//! ```text
//! unshot power of all patches, mean reflectance --> irradiance everywhere (W/m^2) --> a copy of the solution, for display
//! ```
//! Unshot power U, spread over the area A and reflected again and again, arrives as E = U / A (1 + rho + rho^2 + ...) =
//! U / (A (1 - rho)), rho the area mean of the reflectance. Of exitance that was not shot yet only the reflections are
//! taken, rho U / (A (1 - rho)): pass 2 casts shadow rays for direct light anyway.
//! Source: Cohen, Chen, Wallace, Greenberg 1988, with the geometry left out of the form factors: the part that area i
//! gets is its share of the area. Never in the energy account. Not modelled: light lost through openings.

use super::Solution;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::units::Rgb;

/// Largest mean reflectance that is reckoned with.
const MAX_REFLECTANCE: f64 = 0.999;

/// The ambient irradiance (W/m^2) of what `solution` left unshot.
pub fn irradiance(scene: &Scene, mesh: &Mesh, solution: &Solution) -> Rgb {
    let (mut area_m2, mut reflecting, mut emitted_w, mut reflected_w) =
        (0.0, Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
    for (patch, unshot) in mesh.patches.iter().zip(&solution.unshot) {
        let material = scene.material(&scene.surfaces[patch.surface.0 as usize]);
        area_m2 += patch.area_m2;
        reflecting += material.reflectance * patch.area_m2;
        emitted_w += unshot.emitted * patch.area_m2;
        reflected_w += unshot.reflected * patch.area_m2;
    }
    if area_m2 == 0.0 {
        return Rgb::BLACK;
    }
    let of = |c: usize| {
        let rho = (reflecting.0[c] / area_m2).min(MAX_REFLECTANCE);
        (reflected_w.0[c] + rho * emitted_w.0[c]) / (area_m2 * (1.0 - rho))
    };
    Rgb([of(0), of(1), of(2)])
}

/// The ambient irradiance (W/m^2) of a scene that nothing was solved of: the reflections of all that surfaces emit.
pub fn of_emission(scene: &Scene, mesh: &Mesh) -> Rgb {
    let mut nothing_shot = Solution::dark(mesh);
    for (patch, unshot) in mesh.patches.iter().zip(&mut nothing_shot.unshot) {
        unshot.emitted = scene.surfaces[patch.surface.0 as usize].exitance;
    }
    irradiance(scene, mesh, &nothing_shot)
}

/// A copy of the solution with `ambient` (W/m^2) added to the indirect light of every element and vertex: for display.
pub fn added(solution: &Solution, ambient: Rgb) -> Solution {
    let mut shown = solution.clone();
    for e in shown.element_irradiance.iter_mut().chain(&mut shown.vertex_irradiance) {
        e.indirect += ambient;
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::tests::{grey, lit_cube, room, scene};
    use crate::radiosity::{SolveOptions, solve};
    use crate::raycast::software::SoftwareCaster;
    use glam::DVec3;

    fn after(scene: &Scene, max_shots: usize) -> (Mesh, Solution) {
        let mesh = Mesh::build(scene);
        let mut caster = SoftwareCaster::new(mesh.cast_patches());
        let options = SolveOptions { max_shots, unshot_share: 1e-6, ..SolveOptions::default() };
        let solution = solve(scene, &mesh, &mut caster, &options, &mut |_| {}).unwrap();
        (mesh, solution)
    }

    fn mean_irradiance(mesh: &Mesh, solution: &Solution) -> f64 {
        let pairs = mesh.elements.iter().zip(&solution.element_irradiance);
        pairs.map(|(el, e)| e.total().0[1] * el.area_m2).sum::<f64>() / mesh.total_area_m2()
    }

    /// In a closed room of one reflectance all power that is left arrives 1 / (1 - rho) times, wherever.
    #[test]
    fn ambient_term_of_a_furnace_is_what_is_missing_at_any_shot() {
        let furnace = scene(vec![grey("half", 0.6)], room(DVec3::new(1.0, 2.0, 1.5), 0.4), vec![], 300);
        for n_shots in [0, 1, 5, 50, 500] {
            let (mesh, solution) = after(&furnace, n_shots);
            let unshot = mesh.patches.iter().zip(&solution.unshot);
            let to_come: f64 =
                unshot.map(|(p, u)| u.emitted.0[1] * p.area_m2).sum::<f64>() / mesh.total_area_m2();
            let ambient = irradiance(&furnace, &mesh, &solution).0[1];
            let sum = mean_irradiance(&mesh, &solution) + to_come + ambient;
            assert!((sum - 1.0).abs() < 2e-3, "{n_shots} shots: {sum}");
        }
    }

    #[test]
    fn ambient_term_of_few_shots_brings_pictures_nearer_and_touches_no_account() {
        let cube = lit_cube(0.8, 300);
        let (mesh, converged) = after(&cube, 1_000_000);
        let (_, early) = after(&cube, 30);
        let shown = added(&early, irradiance(&cube, &mesh, &early));
        let error = |s: &Solution| {
            let pairs = s.element_irradiance.iter().zip(&converged.element_irradiance);
            pairs.map(|(a, b)| (a.total().0[1] - b.total().0[1]).powi(2)).sum::<f64>().sqrt()
        };
        assert!(error(&shown) < 0.5 * error(&early), "{} {}", error(&shown), error(&early));
        assert_eq!(shown.account, early.account);
        assert!(irradiance(&cube, &mesh, &converged).0[1] < 1e-5 * mean_irradiance(&mesh, &converged));
    }
}
