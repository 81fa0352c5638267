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

/// A copy of the solution with `ambient` (W/m^2) added to the indirect light of every element and vertex: for display.
pub fn added(solution: &Solution, ambient: Rgb) -> Solution {
    let mut shown = solution.clone();
    for e in shown.element_irradiance.iter_mut().chain(&mut shown.vertex_irradiance) {
        e.indirect += ambient;
    }
    shown
}
