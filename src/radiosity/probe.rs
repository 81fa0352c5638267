//! Irradiance at free points: direct light integrated at the point, indirect gathered from `E_mean`.
//!
//! ```text
//! point, normal --kernel to every patch that shines; F <= 10^-3: one ray to it, its mean radiosity
//!                 else, and of emitters: kernel to cells of its elements, a ray to each --> sum F v M      (direct)
//!                                                                                           sum F v rho E  (indirect)
//!                 at the edge of a shadow: again, finer
//! ```
//! An element is cut into r x r cells, r growing with its form factor: F by the exact kernel, v whether the cell's ray arrives.
//! Every emitting surface is seen by at least 64 rays. What is partly seen, or seen otherwise than its neighbour, is cut finer
//! and looked at again. E of a cell is `E_mean` of its element with the slope of the values of its vertices, so that the mean
//! over the element stays `E_mean`: with the mean alone a point near a wall whose light changes was 0.6 % off (the lit cube's
//! ceiling, elements of 1/16 m).
//! Points are worked on in parallel, the rays of many in one query: a point's value never depends on the others.
//! Thin glass passes light straight through. Not modelled: light by way of mirrors and closed glass.

use std::ops::Range;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::kernel::Source;
use super::{ProbePoint, Solution, SolveError, SplitIrradiance, lights};
use crate::geom::Ray;
use crate::mesh::{Corners, ElementId, Mesh, Patch, PatchId, SurfacePoint, VertexId};
use crate::raycast::transmit::Panes;
use crate::raycast::{MAX_BUNDLE_RAYS, Purpose, Query, RayBundle, RayCaster};
use crate::sampling::{hash, unit_pair};
use crate::scene::{Light, Scene};
use crate::units::Rgb;

/// Rays that see each emitting surface at least.
const MIN_RAYS_PER_EMITTER: usize = 64;
/// A patch that does not emit is seen as one up to this form factor.
const WHOLE_FACTOR: f64 = 1e-3;
/// An element of a larger form factor is cut into r x r cells, F <= r^2 x this.
const FACTOR_PER_CELL: f64 = 2.5e-4;
/// But at most this many by this many.
const MAX_CELLS_SIDE: u32 = 8;
/// At the edge of a shadow so many times as many cells along each side, up to the number after.
const EDGE_FINENESS: u32 = 4;
const MAX_EDGE_CELLS_SIDE: u32 = 16;
/// Probe rays are the same in every run: their own seed.
const SEED: u64 = 0x70726f6265;

/// Rays of one query at most, so that targets and answers never take more than a few dozen megabytes; but a point's at
/// least.
const RAYS_PER_QUERY: usize = 1 << 20;
/// Points of one query at most: the caller hears of each query.
const POINTS_PER_QUERY: usize = 256;

/// A patch with a shining element.
struct ShiningPatch {
    patch: PatchId,
    /// The patch as one source and its mean radiosity of reflected light; none for emitters, whose elements are always
    /// seen one by one.
    whole: Option<(Source, Rgb)>,
    elements: Vec<Shining>,
}

/// An element as a probe sees it.
struct Shining {
    element: ElementId,
    source: Source,
    exitance: Rgb,
    /// rho E: its mean, and by how much it is more at each corner.
    reflected: Rgb,
    slopes: [Rgb; 4],
    /// Least cells along each side.
    min_side: u32,
}

impl Shining {
    /// rho E at a place of an element of so many corners.
    fn reflected_at(&self, n_corners: usize, st: DVec2) -> Rgb {
        let (s, t) = (st.x, st.y);
        let weights = match n_corners {
            3 => [1.0 - s - t, s, t, 0.0],
            _ => [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t],
        };
        let slope: Rgb = self.slopes.iter().zip(weights).map(|(slope, w)| *slope * w).sum();
        (self.reflected + slope).map(|b| b.max(0.0))
    }
}

/// A patch or an element that a point looks at.
struct Entry {
    /// Index into [`View::shining`].
    patch: usize,
    /// Index into its elements; `None`: the whole patch, one ray.
    element: Option<usize>,
    /// Cells along each side.
    side: u32,
    cells: Range<usize>,
}

/// What a point asks the caster.
struct Plan {
    normal: DVec3,
    apex: DVec3,
    entries: Vec<Entry>,
    /// What every cell, and after them every light at a place, gives when its ray arrives; and where that ray ends.
    cells: Vec<SplitIrradiance>,
    targets: Vec<DVec3>,
    /// Rays to lights infinitely far, and what each brings.
    far_rays: Vec<Ray>,
    far: Vec<Rgb>,
}

/// What all points see.
struct View<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    shining: Vec<ShiningPatch>,
    panes: Panes,
    offset_m: f64,
}

pub(super) fn run(
    scene: &Scene,
    mesh: &Mesh,
    solution: &Solution,
    caster: &mut dyn RayCaster,
    points: &[ProbePoint],
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<SplitIrradiance>, SolveError> {
    let shining = shining(scene, mesh, solution);
    let panes = Panes::of(scene, mesh);
    let view = View { scene, mesh, offset_m: caster.surface_offset_m(), panes, shining };
    let per_query = (RAYS_PER_QUERY / view.shining.len().max(1)).clamp(1, POINTS_PER_QUERY);
    let mut values = Vec::with_capacity(points.len());
    for chunk in points.chunks(per_query) {
        let plans: Vec<Plan> = chunk.par_iter().map(|point| view.plan(point)).collect();
        let arriving = Arriving::of(&plans, &view.panes, caster)?;
        let parts = plans.par_iter().zip(&arriving).zip(chunk);
        let (sums, finer): (Vec<SplitIrradiance>, Vec<Plan>) =
            parts.map(|((plan, arriving), point)| view.settle(plan, arriving, point)).unzip();
        let arriving = Arriving::of(&finer, &view.panes, caster)?;
        values.extend(sums.iter().zip(finer.iter().zip(&arriving)).map(|(sum, (plan, arriving))| {
            let more = plan.sum(0..plan.cells.len(), arriving);
            SplitIrradiance { direct: sum.direct + more.direct, indirect: sum.indirect + more.indirect }
        }));
        progress(values.len() as f64 / points.len() as f64);
    }
    Ok(values)
}

fn shining(scene: &Scene, mesh: &Mesh, solution: &Solution) -> Vec<ShiningPatch> {
    let n_elements_of: Vec<usize> = mesh
        .surfaces
        .iter()
        .map(|s| s.front.clone().map(|p| mesh.patches[p as usize].elements.len()).sum())
        .collect();
    let of_patch = |(p, patch): (usize, &Patch)| {
        let surface = &scene.surfaces[patch.surface.0 as usize];
        let exitance = surface.exitance;
        let reflectance = scene.material(surface).reflectance;
        let mut min_side = 1;
        if !exitance.is_black() {
            let n_elements = n_elements_of[patch.surface.0 as usize];
            while n_elements * ((min_side * min_side) as usize) < MIN_RAYS_PER_EMITTER {
                min_side += 1;
            }
        }
        let mut reflected_w = Rgb::BLACK;
        let mut elements = Vec::new();
        for e in patch.elements.clone() {
            let element = &mesh.elements[e as usize];
            let reflected = reflectance * solution.element_irradiance[e as usize].total();
            reflected_w += reflected * element.area_m2;
            if !(exitance.is_black() && reflected.is_black()) {
                let source = Source::new(&mesh.polygon(&element.corners));
                let slopes = slopes(element.corners.vertices(), reflectance, solution);
                elements.push(Shining {
                    element: ElementId(e),
                    source,
                    exitance,
                    reflected,
                    slopes,
                    min_side,
                });
            }
        }
        let whole = (exitance.is_black() && patch.area_m2 > 0.0)
            .then(|| (Source::new(&mesh.polygon(&patch.corners)), reflected_w / patch.area_m2));
        let shines = !elements.is_empty();
        shines.then_some(ShiningPatch { patch: PatchId(p as u32), whole, elements })
    };
    mesh.patches.par_iter().enumerate().filter_map(of_patch).collect()
}

/// By how much rho E is more at each corner than their mean.
fn slopes(corners: &[VertexId], reflectance: Rgb, solution: &Solution) -> [Rgb; 4] {
    let at = |v: &VertexId| solution.vertex_irradiance[v.0 as usize].total();
    let mean = corners.iter().map(at).sum::<Rgb>() / corners.len() as f64;
    let mut slopes = [Rgb::BLACK; 4];
    for (slope, v) in slopes.iter_mut().zip(corners) {
        *slope = reflectance * (at(v) - mean);
    }
    slopes
}

impl View<'_> {
    /// What shines on `point`, and the rays that tell whether it arrives.
    fn plan(&self, point: &ProbePoint) -> Plan {
        let mut plan = Plan::at(point, self.offset_m);
        let Plan { normal, apex, .. } = plan;
        for (p, patch) in self.shining.iter().enumerate() {
            if let Some((source, reflected)) = &patch.whole {
                let factor = source.form_factor(point.at, normal);
                if factor <= 0.0 {
                    continue;
                }
                if factor <= WHOLE_FACTOR {
                    let start = plan.cells.len();
                    let target = patch_target(self.mesh, patch.patch, source, apex, self.offset_m);
                    let given = SplitIrradiance { direct: Rgb::BLACK, indirect: *reflected * factor };
                    plan.look(given, source, point, target, self.offset_m * source.normal());
                    let cells = start..plan.cells.len();
                    plan.entries.push(Entry { patch: p, element: None, side: 1, cells });
                    continue;
                }
            }
            for (i, shining) in patch.elements.iter().enumerate() {
                let factor = shining.source.form_factor(point.at, normal);
                if factor > 0.0 {
                    let side = ((factor / FACTOR_PER_CELL).sqrt().ceil() as u32)
                        .clamp(shining.min_side, MAX_CELLS_SIDE.max(shining.min_side));
                    self.cut(&mut plan, point, (p, i), side);
                }
            }
        }
        for light in &self.scene.lights {
            let direct = lights::irradiance(light, point.at, normal);
            if direct.is_black() {
                continue;
            }
            if let Light::Directional { direction, .. } = light {
                plan.far_rays.push(Ray::unbounded(apex, DVec3::ZERO - *direction));
                plan.far.push(direct);
            } else if let Some(position) = lights::position(light) {
                plan.targets.push(position);
                plan.cells.push(SplitIrradiance { direct, indirect: Rgb::BLACK });
            }
        }
        plan
    }

    /// Looks at an element, `side` x `side` cells.
    fn cut(&self, plan: &mut Plan, point: &ProbePoint, (patch, i): (usize, usize), side: u32) {
        let shining = &self.shining[patch].elements[i];
        let (mesh, element) = (self.mesh, shining.element);
        let lift = self.offset_m * mesh.elements[element.0 as usize].normal;
        let start = plan.cells.len();
        for cell in Cell::all(mesh, element, side) {
            let source = if side == 1 { shining.source } else { cell.source(mesh, element) };
            let factor = source.form_factor(point.at, plan.normal);
            if factor > 0.0 {
                let given = SplitIrradiance {
                    direct: shining.exitance * factor,
                    indirect: shining.reflected_at(cell.n_corners, cell.centre()) * factor,
                };
                let place = mesh.position(SurfacePoint { element, st: cell.aim(element) });
                plan.look(given, &source, point, place + lift, lift);
            }
        }
        let cells = start..plan.cells.len();
        plan.entries.push(Entry { patch, element: Some(i), side, cells });
    }

    /// What arrives at a point, but for what lies at the edge of a shadow, which is planned anew, finer.
    fn settle(&self, plan: &Plan, arriving: &Arriving, point: &ProbePoint) -> (SplitIrradiance, Plan) {
        let all_or_nothing = |entry: &Entry| {
            let mut seen = entry.cells.clone().map(|i| !arriving.near[i].is_black());
            let first = seen.next();
            if seen.all(|s| Some(s) == first) { first } else { None }
        };
        let elements_of = |entry: &Entry| match (entry.element, &self.shining[entry.patch]) {
            (Some(i), patch) => patch.elements[i].element.0..patch.elements[i].element.0 + 1,
            (None, patch) => self.mesh.patches[patch.patch.0 as usize].elements.clone(),
        };
        // Of every element: not looked at, or all seen, nothing, or some of both.
        let mut state = vec![None; self.mesh.elements.len()];
        for entry in &plan.entries {
            elements_of(entry).for_each(|e| state[e as usize] = Some(all_or_nothing(entry)));
        }
        let is_edge = |entry: &Entry| {
            let own = all_or_nothing(entry);
            own.is_none()
                || elements_of(entry).any(|e| {
                    let neighbours = self.mesh.elements[e as usize].neighbours.iter().flatten();
                    neighbours.filter_map(|n| state[n.0 as usize]).any(|other| other != own)
                })
        };
        let lights = plan.entries.last().map_or(0, |e| e.cells.end)..plan.cells.len();
        let mut sum = plan.sum(lights, arriving);
        sum.direct += plan.far.iter().zip(&arriving.far).map(|(e, share)| *e * *share).sum();
        let mut finer = Plan::at(point, self.offset_m);
        for entry in &plan.entries {
            match (is_edge(entry), entry.element) {
                (false, _) => {
                    let part = plan.sum(entry.cells.clone(), arriving);
                    sum.direct += part.direct;
                    sum.indirect += part.indirect;
                }
                (true, Some(i)) => {
                    let side = (EDGE_FINENESS * entry.side).min(MAX_EDGE_CELLS_SIDE.max(entry.side));
                    self.cut(&mut finer, point, (entry.patch, i), side);
                }
                // Its elements are half as wide.
                (true, None) => (0..self.shining[entry.patch].elements.len())
                    .for_each(|i| self.cut(&mut finer, point, (entry.patch, i), EDGE_FINENESS / 2)),
            }
        }
        (sum, finer)
    }
}

impl Plan {
    /// Nothing to be seen yet.
    fn at(point: &ProbePoint, offset_m: f64) -> Plan {
        let normal = point.normal.normalize_or_zero();
        Plan {
            normal,
            apex: point.at + offset_m * normal,
            entries: Vec::new(),
            cells: Vec::new(),
            targets: Vec::new(),
            far_rays: Vec::new(),
            far: Vec::new(),
        }
    }

    /// A ray to `target`, on `source` and lifted off it, or, where that is below the horizon, to what is above.
    fn look(
        &mut self,
        given: SplitIrradiance,
        source: &Source,
        point: &ProbePoint,
        target: DVec3,
        lift: DVec3,
    ) {
        let above = (target - self.apex).dot(self.normal) > 0.0;
        let middle = || source.centre_above_horizon(point.at, self.normal).map(|m| m + lift);
        let target = if above { target } else { middle().unwrap_or(target) };
        self.targets.push(target);
        self.cells.push(given);
    }

    /// What arrives from some cells.
    fn sum(&self, cells: Range<usize>, arriving: &Arriving) -> SplitIrradiance {
        let mut sum = SplitIrradiance::default();
        for (cell, share) in self.cells[cells.clone()].iter().zip(&arriving.near[cells]) {
            sum.direct += cell.direct * *share;
            sum.indirect += cell.indirect * *share;
        }
        sum
    }
}

/// Which share of the light along each ray of a plan arrives: 1, 0, or what panes pass.
struct Arriving {
    near: Vec<Rgb>,
    far: Vec<Rgb>,
}

impl Arriving {
    /// Of every plan, from one query for all bundles and one for all rays to lights infinitely far.
    fn of(plans: &[Plan], panes: &Panes, caster: &mut dyn RayCaster) -> Result<Vec<Arriving>, SolveError> {
        let bundles_of = |plan: &Plan| -> Vec<RayBundle> {
            let chunks = plan.targets.chunks(MAX_BUNDLE_RAYS);
            chunks.map(|points| RayBundle::Targets { apex: plan.apex, points: points.to_vec() }).collect()
        };
        let bundles: Vec<RayBundle> = plans.iter().flat_map(bundles_of).collect();
        let far_rays: Vec<Ray> = plans.iter().flat_map(|plan| plan.far_rays.iter().copied()).collect();
        let near = match bundles.is_empty() {
            true => Vec::new(),
            false => panes.transmitted(caster, Purpose::Probe, Query::Bundles(&bundles))?,
        };
        let far = match far_rays.is_empty() {
            true => Vec::new(),
            false => panes.transmitted(caster, Purpose::Probe, Query::Rays(&far_rays))?,
        };
        let (mut near, mut far) = (&near[..], &far[..]);
        let split = plans.iter().map(|plan| {
            let (mine, rest) = near.split_at(plan.targets.len());
            let (mine_far, rest_far) = far.split_at(plan.far.len());
            (near, far) = (rest, rest_far);
            Arriving { near: mine.to_vec(), far: mine_far.to_vec() }
        });
        Ok(split.collect())
    }
}

/// Where a small patch is looked at: anywhere on it, lifted off.
fn patch_target(mesh: &Mesh, patch: PatchId, source: &Source, apex: DVec3, offset_m: f64) -> DVec3 {
    // Another place for every point, so that a shadow's edge on the patch does not show as a step in a grid.
    let from = apex.to_array().iter().fold(SEED, |h, x| hash(h, x.to_bits(), 0));
    let [s, t] = unit_pair(hash(from, u64::from(patch.0), 0)).map(|c| 0.02 + 0.96 * c);
    let at = |v: VertexId| mesh.vertices[v.0 as usize].position;
    let place = match mesh.patches[patch.0 as usize].corners {
        Corners::Triangle([a, b, c]) => {
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            (1.0 - s - t) * at(a) + s * at(b) + t * at(c)
        }
        Corners::Quad([a, b, c, d]) => at(a).lerp(at(b), s).lerp(at(d).lerp(at(c), s), t),
    };
    place + offset_m * source.normal()
}

/// A part of an element: corners in its (s,t).
struct Cell {
    corners: [DVec2; 4],
    n_corners: usize,
    index: u32,
}

impl Cell {
    /// `side` x `side` cells of an element, all of one shape.
    fn all(mesh: &Mesh, element: ElementId, side: u32) -> impl Iterator<Item = Cell> {
        let n_corners = mesh.elements[element.0 as usize].corners.vertices().len();
        (0..side * side).map(move |index| {
            let (i, j) = (index % side, index / side);
            let at = |i: u32, j: u32| DVec2::new(f64::from(i), f64::from(j)) / f64::from(side);
            let corners = if n_corners == 4 {
                [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
            } else if i + j < side {
                [at(i, j), at(i + 1, j), at(i, j + 1), at(i, j + 1)]
            } else {
                // Folded over the hypotenuse: the cells that stand on their heads.
                let (i, j) = (side - i, side - j);
                [at(i, j), at(i - 1, j), at(i, j - 1), at(i, j - 1)]
            };
            Cell { corners, n_corners, index }
        })
    }

    fn centre(&self) -> DVec2 {
        self.corners[..self.n_corners].iter().sum::<DVec2>() / self.n_corners as f64
    }

    fn source(&self, mesh: &Mesh, element: ElementId) -> Source {
        let place = |st: DVec2| mesh.position(SurfacePoint { element, st });
        Source::new(&self.corners.map(place)[..self.n_corners])
    }

    /// Where in the cell its ray ends.
    fn aim(&self, element: ElementId) -> DVec2 {
        let [u, v] =
            unit_pair(hash(SEED, u64::from(element.0), u64::from(self.index))).map(|c| 0.02 + 0.96 * c);
        let (u, v) = if self.n_corners == 3 && u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let [a, b, _, d] = self.corners;
        a + u * (b - a) + v * (d - a)
    }
}
