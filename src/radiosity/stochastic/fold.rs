//! The end of a pass, of a round, and of all rounds.
//!
//! ```text
//! pass:  tally --> E of elements and vertices (sums over rounds), what the next pass reflects
//!        vertex: mean under its hat
//! round: sum of what arrived, squared --> spread over rounds, variance of kernel shots --> error estimate --> another round?
//! all:   means over rounds --> State; ErrorEstimate
//!        vertices of borders: from the hat's centroid to the vertex along the plane through the elements around
//! ```

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::super::state::ElementState;
use super::super::state::{State, magnitude};
use super::{LEAST_ERROR_SHARE, MAX_ROUNDS, PLANNED_ROUNDS, StochasticState};
use crate::geom::tangent_frame;
use crate::mesh::{Corners, ElementId, Mesh, VertexId};
use crate::radiosity::{ErrorEstimate, SolveOptions};
use crate::units::Rgb;

/// A hat's centroid nearer to its vertex than this share of its size stands on it.
const CENTRED_SHARE: f64 = 1e-3;

/// Where a vertex's mean stands: what falls under its hat, over the hat's integral, is E at the hat's centroid.
pub(super) struct Hat {
    /// Integral over the elements around (m^2).
    area_m2: f64,
    /// From the hat's centroid to the vertex (m); zero where both are the same, away from borders.
    offset: DVec3,
}

/// The hats of all vertices.
pub(super) fn hats(mesh: &Mesh) -> Vec<Hat> {
    (0..mesh.vertices.len())
        .into_par_iter()
        .map(|v| {
            let vertex = VertexId(v as u32);
            let at = mesh.vertices[v].position;
            let (mut area_m2, mut moment) = (0.0, DVec3::ZERO);
            for &e in mesh.elements_around(vertex) {
                let Some(corner) = corner_of(mesh, e, vertex) else { continue };
                for (q, (point, weight)) in mesh.quadrature(e).points().iter().enumerate() {
                    let w = weight * hat_at(&mesh.elements[e.0 as usize].corners, corner, q);
                    area_m2 += w;
                    moment += w * (*point - at);
                }
            }
            let offset = if area_m2 > 0.0 { -moment / area_m2 } else { DVec3::ZERO };
            let is_centred = offset.length_squared() <= CENTRED_SHARE * CENTRED_SHARE * area_m2;
            Hat { area_m2, offset: if is_centred { DVec3::ZERO } else { offset } }
        })
        .collect()
}

fn corner_of(mesh: &Mesh, element: ElementId, vertex: VertexId) -> Option<usize> {
    mesh.elements[element.0 as usize].corners.vertices().iter().position(|v| *v == vertex)
}

/// The hat of a corner at quadrature point `q` of its element.
fn hat_at(corners: &Corners, corner: usize, q: usize) -> f64 {
    match corners {
        // Interior points 1/6 from two sides, 2/3 from the third, in the order of the corners.
        Corners::Triangle(_) => {
            if q == corner {
                2.0 / 3.0
            } else {
                1.0 / 6.0
            }
        }
        Corners::Quad(_) => {
            // Gauss points stand (low, low), (high, low), (low, high), (high, high); corners run around.
            let near = (1.0 + 3f64.sqrt().recip()) / 2.0;
            let (right, top) = ([false, true, true, false][corner], [false, false, true, true][corner]);
            let along = |high: bool, is_high: bool| if high == is_high { near } else { 1.0 - near };
            along(right, q & 1 == 1) * along(top, q & 2 == 2)
        }
    }
}

/// How much E changes along `offset` from a vertex: weights of elements' means, by the plane that fits those of the
/// elements around it and of their neighbours best (least squares). None where the offset is 0 or they stand in line.
fn shift_weights(mesh: &Mesh, vertex: VertexId, offset: DVec3) -> Vec<(ElementId, f64)> {
    if offset == DVec3::ZERO {
        return Vec::new();
    }
    let around = mesh.elements_around(vertex).iter();
    let corners = around.flat_map(|e| mesh.elements[e.0 as usize].corners.vertices().iter());
    let mut ring: Vec<ElementId> = corners.flat_map(|v| mesh.elements_around(*v)).copied().collect();
    ring.sort();
    ring.dedup();
    let (t1, t2) = tangent_frame(mesh.vertices[vertex.0 as usize].normal);
    let in_plane = |p: DVec3| DVec2::new(p.dot(t1), p.dot(t2));
    let centre = |e: &ElementId| {
        let corners = mesh.polygon(&mesh.elements[e.0 as usize].corners);
        in_plane(corners.iter().sum::<DVec3>() / corners.len() as f64)
    };
    let places: Vec<DVec2> = ring.iter().map(centre).collect();
    let mean = places.iter().sum::<DVec2>() / places.len().max(1) as f64;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in places.iter().map(|p| *p - mean) {
        xx += p.x * p.x;
        xy += p.x * p.y;
        yy += p.y * p.y;
    }
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-6 * (xx + yy).powi(2) {
        return Vec::new();
    }
    let o = in_plane(offset);
    let along = DVec2::new(yy * o.x - xy * o.y, xx * o.y - xy * o.x) / determinant;
    ring.into_iter().zip(&places).map(|(e, p)| (e, along.dot(*p - mean))).collect()
}

/// Adds a pass to its round; what arrived is what the next pass reflects.
pub(super) fn fold(mesh: &Mesh, hats: &[Hat], s: &mut StochasticState) {
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
        let hat = &hats[v];
        if hat.area_m2 <= 0.0 {
            return;
        }
        let mut power_w = Rgb::BLACK;
        for &e in mesh.elements_around(vertex) {
            let Some(corner) = corner_of(mesh, e, vertex) else { continue };
            let arrived = tally.of(mesh, e.0 as usize, pass_w);
            power_w += arrived.power_w * arrived.hats[corner];
        }
        let e = power_w / hat.area_m2;
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
    pub(super) fn end_round(
        &mut self,
        mesh: &Mesh,
        options: &SolveOptions,
        start: &[ElementState],
        kernel_variance: &[f64],
    ) {
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
        let enough =
            |kernel_variance: &[f64], wanted: f64| self.error(mesh, start, kernel_variance) <= wanted;
        let wanted = options.wanted_error;
        let good = enough(kernel_variance, wanted) || enough(&[], LEAST_ERROR_SHARE * wanted);
        if self.round >= PLANNED_ROUNDS && good || self.round >= MAX_ROUNDS {
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

    /// RMS standard error over the mean irradiance, both by area, that of kernel shots by their variance a surface.
    fn error(&self, mesh: &Mesh, start: &[ElementState], kernel_variance: &[f64]) -> f64 {
        let (mut variance, mut mean) = (kernel_variance.iter().sum(), 0.0);
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
        for (sums, variance) in of_surface.iter_mut().zip(&state.kernel_variance) {
            sums[1] += variance;
        }
        let relative_rms = self.error(mesh, &state.elements, &state.kernel_variance);
        let n = f64::from(self.round.max(1));
        for (element, (sum, left)) in state.elements.iter_mut().zip(self.elements.iter().zip(&self.left)) {
            element.irradiance.direct += sum.direct / n;
            element.irradiance.indirect += sum.indirect / n;
            element.unshot = *left / n;
        }
        let hats = hats(mesh);
        state.vertices.par_iter_mut().enumerate().for_each(|(v, vertex)| {
            let mut sum = self.vertices[v];
            for (e, weight) in shift_weights(mesh, VertexId(v as u32), hats[v].offset) {
                sum.direct += self.elements[e.0 as usize].direct * weight;
                sum.indirect += self.elements[e.0 as usize].indirect * weight;
            }
            // Noise may take dark borders below nothing.
            vertex.direct = (vertex.direct + sum.direct / n).map(|e| e.max(0.0));
            vertex.indirect = (vertex.indirect + sum.indirect / n).map(|e| e.max(0.0));
        });
        state.unshot_exitance.fill(Rgb::BLACK);
        state.account.lost_w += self.stray.lost_w / n;
        state.account.back_w += self.stray.back_w / n;
        let [fronts_w, backs_w] = self.stray.passed_w;
        state.account.specular_w -= fronts_w / n;
        state.account.back_w -= backs_w / n;
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
pub(super) fn relative(variance: f64, mean: f64, area: f64) -> f64 {
    if mean > 0.0 && area > 0.0 { (variance / area).sqrt() / (mean / area) } else { 0.0 }
}
