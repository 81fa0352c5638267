//! Going on from a solution after a change of emission, reflectance or lights: only the difference is shot.
//!
//! ```text
//! Stored (E, what was unshot, old lighting), new scene --> State: same E, unshot = what the change adds or takes away
//! ```
//! E = sum_j F_j B_j of what was shot. With the new lighting a patch has to have shot M' + rho' E in the end; it has shot
//! M + rho E less what was unshot. So it shoots, beside what was unshot, M' - M as direct light and (rho' - rho) E as
//! indirect light, both exact, of either sign. A light without area shines once as it was, negatively, and once as it is.
//! Light is linear: E is first scaled, channel by channel, by the k that leaves the least to shoot, so that M' - k M stands
//! for M' - M. Lamps that are dimmed or change their colour together then cost nothing.
//! Source: Chen 1990, "Incremental radiosity"; George, Sillion, Greenberg 1990.
//!
//! What reflectance zero leaves cannot be said as irradiance that waits to be reflected; it waits as radiosity.
//! Where thin glass passes another share than before, all is shot anew. Not modelled: changes of geometry and of ior.

use super::deposit::add_light;
use super::shooting::Solver;
use super::solution_file::Stored;
use super::state::{Known, State, magnitude};
use super::{EarlierWork, EnergyAccount, ErrorEstimate, SolveError, SplitIrradiance};
use crate::raycast::RayCaster;
use crate::raycast::transmit::is_pane;
use crate::scene::Surface;
use crate::units::Rgb;

/// Least reflectance that a difference of radiosity is divided by.
const MIN_REFLECTANCE: f64 = 1e-6;
/// A change of a light's strength that is only rounding.
const ROUNDING: f64 = 1e-12;

/// The state of a solve that goes on from `stored`; one with nothing shot where that is less work, because the change is
/// as large as all that the scene emits.
pub(super) fn begin(
    solver: &mut Solver<'_>,
    stored: &Stored,
    caster: &mut dyn RayCaster,
) -> Result<State, SolveError> {
    if other_panes(solver, stored) {
        return solver.begin(caster);
    }
    let state = changed(solver, stored, caster)?;
    if state.unshot_power_w() < magnitude(state.account.emitted_w) {
        return Ok(state);
    }
    let mut anew = solver.begin(caster)?;
    anew.n_rays += state.n_rays;
    Ok(anew)
}

/// Thin glass passes another share of the light than it did: form factors changed.
fn other_panes(solver: &Solver<'_>, stored: &Stored) -> bool {
    let surfaces = solver.scene.surfaces.iter().zip(&stored.lighting.surfaces);
    let passes = |surface: &Surface| solver.scene.material(surface).transmission;
    let is_thin = |surface: &Surface, then: Rgb| is_pane(solver.scene, surface) || !then.is_black();
    surfaces
        .into_iter()
        .any(|(now, then)| is_thin(now, then.transmission) && passes(now) != then.transmission)
}

fn changed(
    solver: &mut Solver<'_>,
    stored: &Stored,
    caster: &mut dyn RayCaster,
) -> Result<State, SolveError> {
    let Stored { solution, lighting, .. } = stored;
    let (scene, mesh) = (solver.scene, solver.mesh);
    let mut state = State::new(scene, mesh);
    let k = best_scale(solver, stored);
    let scaled = |e: &SplitIrradiance| SplitIrradiance { direct: e.direct * k, indirect: e.indirect * k };
    for (element, e) in state.elements.iter_mut().zip(&solution.element_irradiance) {
        element.irradiance = scaled(e);
    }
    state.vertices = solution.vertex_irradiance.iter().map(scaled).collect();
    let EnergyAccount { emitted_w: before_w, lost_w, back_w, .. } = solution.account;
    let (mut emitted_w, lost_w, back_w) = (before_w * k, lost_w * k, back_w * k);
    for (p, patch) in mesh.patches.iter().enumerate() {
        let surface = patch.surface.0 as usize;
        let (then, now) = (&lighting.surfaces[surface], &scene.surfaces[surface]);
        let (rho_then, rho) = (then.reflectance, scene.material(now).reflectance);
        let more = now.exitance - then.exitance * k;
        emitted_w += more * patch.area_m2;
        state.unshot_exitance[p] = solution.unshot[p].emitted * k + more;
        let left = solution.unshot[p].reflected * k;
        for e in patch.elements.clone() {
            let share = mesh.elements[e as usize].area_m2 / patch.area_m2;
            let element = &mut state.elements[e as usize];
            let to_shoot = (rho - rho_then) * element.irradiance.total() + left;
            for c in 0..3 {
                if rho.0[c] >= MIN_REFLECTANCE {
                    element.unshot.0[c] = to_shoot.0[c] / rho.0[c];
                } else if patch.area_m2 > 0.0 {
                    state.unshot_reflected[p].0[c] += to_shoot.0[c] * share;
                }
            }
        }
    }
    state.account = EnergyAccount { emitted_w, lost_w, back_w, ..EnergyAccount::default() };
    if !solver.panes.is_empty() {
        // What panes passed on so far: less was left on them than arrived there.
        let specular = mesh.elements.iter().zip(&state.elements).map(|(element, e)| {
            let surface = &lighting.surfaces[mesh.patches[element.patch.0 as usize].surface.0 as usize];
            (surface.specular + surface.transmission) * e.irradiance.total() * element.area_m2
        });
        state.account.specular_w = solution.account.specular_w * k - specular.sum();
    }
    let n = lighting.lights.len().max(scene.lights.len());
    for i in 0..n {
        let (then, now) = (lighting.lights.get(i).map(|l| l.scaled(k)), scene.lights.get(i));
        let shots = match (then, now) {
            (Some(then), Some(now)) if then.shines_like(now) => {
                let more = now.strength() - then.strength();
                let rounding = magnitude(more) <= ROUNDING * magnitude(now.strength());
                [(!rounding).then(|| (now.with_strength(more), 1.0)), None]
            }
            (then, now) => [then.map(|l| (l, -1.0)), now.map(|l| (*l, 1.0))],
        };
        for (light, share) in shots.into_iter().flatten() {
            let shot = solver.light_shot(&light, caster)?;
            add_light(&mut state, &shot, share);
        }
    }
    state.known = solution.shooters.iter().map(|s| (s.patch, Known::of(s))).collect();
    let before = solution.earlier.unwrap_or_default();
    state.earlier = Some(EarlierWork {
        n_solves: before.n_solves + 1,
        n_shots: before.n_shots + solution.n_shots as u64,
        n_rays: before.n_rays + solution.n_rays,
    });
    state.earlier_error.clone_from(&solution.error_estimate);
    solver.measure_unshot(&mut state);
    Ok(state)
}

/// The k, a channel each, for which the exitance M' - k M and the same of lights have least power: the median of M' / M
/// weighted by the power of M. Lights without area share evenly what the surfaces did not emit: a light's own power takes
/// a cast.
fn best_scale(solver: &Solver, Stored { solution, lighting, .. }: &Stored) -> Rgb {
    let (scene, mesh) = (solver.scene, solver.mesh);
    let mut area_m2 = vec![0.0; scene.surfaces.len()];
    mesh.patches.iter().for_each(|p| area_m2[p.surface.0 as usize] += p.area_m2);
    Rgb([0, 1, 2].map(|c| {
        // (ratio, weight)
        let mut sources: Vec<(f64, f64)> = Vec::new();
        let mut of_lights_w = solution.account.emitted_w.0[c];
        for ((then, now), area_m2) in lighting.surfaces.iter().zip(&scene.surfaces).zip(&area_m2) {
            let (then, now) = (then.exitance.0[c], now.exitance.0[c]);
            if then > 0.0 {
                sources.push((now / then, then * area_m2));
                of_lights_w -= then * area_m2;
            }
        }
        for (i, then) in lighting.lights.iter().enumerate() {
            let strength = then.strength().0[c];
            if strength > 0.0 {
                let like = scene.lights.get(i).filter(|now| then.shines_like(now));
                let ratio = like.map_or(0.0, |now| now.strength().0[c] / strength);
                sources.push((ratio, of_lights_w.max(0.0) / lighting.lights.len() as f64));
            }
        }
        sources.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = 0.5 * sources.iter().map(|s| s.1).sum::<f64>();
        let mut below = 0.0;
        let median = sources.iter().find(|(_, weight)| {
            below += weight;
            below >= half
        });
        median.map_or(1.0, |s| s.0)
    }))
}

/// The standard error of two independent parts of the light.
pub(super) fn combined(earlier: Option<ErrorEstimate>, now: Option<ErrorEstimate>) -> Option<ErrorEstimate> {
    let (Some(a), Some(b)) = (&earlier, &now) else { return earlier.or(now) };
    Some(ErrorEstimate {
        relative_rms: a.relative_rms.hypot(b.relative_rms),
        surfaces: a.surfaces.iter().zip(&b.surfaces).map(|(a, b)| a.hypot(*b)).collect(),
        n_rounds: b.n_rounds,
        n_rays: a.n_rays + b.n_rays,
    })
}

#[cfg(test)]
#[path = "relight_tests.rs"]
mod tests;
