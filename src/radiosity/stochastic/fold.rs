//! The end of a pass, of a round, and of all rounds.
//!
//! ```text
//! pass:  tally --> E of elements and vertices (sums over rounds), what the next pass reflects
//! round: sum of what arrived, squared --> spread over rounds --> error estimate --> another round?
//! all:   means over rounds --> State; ErrorEstimate
//! ```

use rayon::prelude::*;

use super::super::state::ElementState;
use super::super::state::{State, magnitude};
use super::{MAX_ROUNDS, PLANNED_ROUNDS, StochasticState};
use crate::mesh::{Corners, Element, ElementId, Mesh, VertexId};
use crate::radiosity::{ErrorEstimate, SolveOptions};
use crate::units::Rgb;

/// Integral of every vertex's hat over the elements around it (m^2).
pub(super) fn vertex_areas(mesh: &Mesh) -> Vec<f64> {
    (0..mesh.vertices.len())
        .into_par_iter()
        .map(|v| {
            let vertex = VertexId(v as u32);
            mesh.elements_around(vertex).iter().map(|&e| hat_area(mesh, e, vertex)).sum()
        })
        .collect()
}

/// Integral of a corner's hat over one element (m^2): exact, by its quadrature.
fn hat_area(mesh: &Mesh, element: ElementId, vertex: VertexId) -> f64 {
    let Element { corners, area_m2, .. } = mesh.elements[element.0 as usize];
    let Corners::Quad(corners) = corners else { return area_m2 / 3.0 };
    let Some(corner) = corners.iter().position(|v| *v == vertex) else { return 0.0 };
    // The Gauss points stand (low, low), (high, low), (low, high), (high, high); corners run around.
    let near = (1.0 + 3f64.sqrt().recip()) / 2.0;
    let (right, top) = ([false, true, true, false][corner], [false, false, true, true][corner]);
    let quadrature = mesh.quadrature(element);
    let weighted = quadrature.points().iter().enumerate().map(|(q, (_, weight))| {
        let along = |high: bool, is_high: bool| if high == is_high { near } else { 1.0 - near };
        weight * along(right, q & 1 == 1) * along(top, q & 2 == 2)
    });
    weighted.sum()
}

/// Adds a pass to its round; what arrived is what the next pass reflects.
pub(super) fn fold(mesh: &Mesh, vertex_area_m2: &[f64], s: &mut StochasticState) {
    let (tally, pass_w, emission) = (&s.tally, s.pass_w, s.emission);
    s.elements
        .par_iter_mut()
        .zip(s.of_round.par_iter_mut())
        .zip(s.unshot.par_iter_mut())
        .enumerate()
        .for_each(|(e, ((sum, of_round), unshot))| {
            let area_m2 = mesh.elements[e].area_m2;
            let e = if area_m2 > 0.0 { tally.of(mesh, e, pass_w).power_w / area_m2 } else { Rgb::BLACK };
            *of_round += e.sum();
            if emission {
                sum.direct += e;
                *unshot += e;
            } else {
                sum.indirect += e;
                *unshot = e;
            }
        });
    s.vertices.par_iter_mut().enumerate().for_each(|(v, sum)| {
        let vertex = VertexId(v as u32);
        let mut power_w = Rgb::BLACK;
        for e in mesh.elements_around(vertex) {
            let arrived = tally.of(mesh, e.0 as usize, pass_w);
            let corners = mesh.elements[e.0 as usize].corners;
            if let Some(corner) = corners.vertices().iter().position(|v| *v == vertex) {
                power_w += arrived.power_w * arrived.hats[corner];
            }
        }
        let e = if vertex_area_m2[v] > 0.0 { power_w / vertex_area_m2[v] } else { Rgb::BLACK };
        if emission {
            sum.direct += e;
        } else {
            sum.indirect += e;
        }
    });
    s.tally.clear();
}

impl StochasticState {
    /// Power that this round has still to reflect (W, magnitudes).
    pub(super) fn left_w(&self, mesh: &Mesh, reflectance: &[Rgb]) -> f64 {
        let elements = mesh.elements.iter().zip(&self.unshot);
        elements.map(|(el, e)| magnitude(reflectance[el.patch.0 as usize] * *e) * el.area_m2).sum()
    }

    /// Closes a round: the next one begins, or all is finished.
    pub(super) fn end_round(&mut self, mesh: &Mesh, options: &SolveOptions, start: &[ElementState]) {
        for ((square, of_round), (left, unshot)) in
            self.squares.iter_mut().zip(&self.of_round).zip(self.left.iter_mut().zip(&self.unshot))
        {
            *square += of_round * of_round;
            *left += *unshot;
        }
        if self.round == 0 {
            self.n_first_round_rays = self.n_round_rays;
        }
        self.round += 1;
        let good = self.round >= PLANNED_ROUNDS && self.error(mesh, start) <= options.wanted_error;
        if good || self.round >= MAX_ROUNDS {
            self.finished = true;
        } else {
            self.begin_round(start.iter().map(|e| e.unshot).collect());
        }
    }

    /// Variance of the mean over finished rounds of element `e`'s irradiance, all channels.
    fn variance(&self, e: usize) -> f64 {
        let n = f64::from(self.round);
        let sum = self.elements[e].total().sum();
        if self.round < 2 { 0.0 } else { ((self.squares[e] - sum * sum / n) / (n * (n - 1.0))).max(0.0) }
    }

    /// RMS standard error over the mean irradiance, both by area.
    fn error(&self, mesh: &Mesh, start: &[ElementState]) -> f64 {
        let (mut variance, mut mean) = (0.0, 0.0);
        for (e, element) in mesh.elements.iter().enumerate() {
            variance += element.area_m2 * self.variance(e);
            mean += element.area_m2 * self.irradiance(e, &start[e]).sum();
        }
        relative(variance, mean, mesh.total_area_m2())
    }

    /// Mean over finished rounds, and what was there before (W/m^2).
    fn irradiance(&self, e: usize, start: &ElementState) -> Rgb {
        start.irradiance.total() + self.elements[e].total() / f64::from(self.round.max(1))
    }

    /// Into `state`: the means. Returns how good they are.
    pub(in crate::radiosity) fn finish(
        self,
        mesh: &Mesh,
        n_surfaces: usize,
        state: &mut State,
    ) -> ErrorEstimate {
        // Area, area x variance, area x mean of every surface.
        let mut of_surface = vec![[0.0; 3]; n_surfaces];
        for (e, element) in mesh.elements.iter().enumerate() {
            let sums = &mut of_surface[mesh.patches[element.patch.0 as usize].surface.0 as usize];
            sums[0] += element.area_m2;
            sums[1] += element.area_m2 * self.variance(e);
            sums[2] += element.area_m2 * self.irradiance(e, &state.elements[e]).sum();
        }
        let relative_rms = self.error(mesh, &state.elements);
        let n = f64::from(self.round.max(1));
        for (element, (sum, left)) in state.elements.iter_mut().zip(self.elements.iter().zip(&self.left)) {
            element.irradiance.direct += sum.direct / n;
            element.irradiance.indirect += sum.indirect / n;
            element.unshot = *left / n;
        }
        for (vertex, sum) in state.vertices.iter_mut().zip(&self.vertices) {
            vertex.direct += sum.direct / n;
            vertex.indirect += sum.indirect / n;
        }
        state.unshot_exitance.fill(Rgb::BLACK);
        state.account.lost_w += self.stray.lost_w / n;
        state.account.back_w += self.stray.back_w / n;
        ErrorEstimate {
            relative_rms,
            surfaces: of_surface
                .iter()
                .map(|[area, variance, mean]| relative(*variance, *mean, *area))
                .collect(),
            n_rounds: self.round,
            n_rays: self.n_rays,
        }
    }
}

/// sqrt(mean variance) / mean, from sums over `area`.
fn relative(variance: f64, mean: f64, area: f64) -> f64 {
    if mean > 0.0 && area > 0.0 { (variance / area).sqrt() / (mean / area) } else { 0.0 }
}
