//! Source selection: which sources are sampled at a patch and which are stored, blended so that no border shows.
//!
//! ```text
//! points (vertices, middles of elements) x sources --kernel, shadow rays--> e_j (W/m^2), visible shares v_j
//! patch i: u_j = largest unoccluded contribution at its points
//!   settled: v_j = 0 at all points of i and of its edge neighbours, or 1 at all of them and over 0.1 sr -> STORED
//!   others in falling u_j until the rest sums to under tau sum u: SAMPLE; the rest STORED
//! w_j(vertex) = 1 if all patches there SAMPLE j, else 0; bilinear in between
//! E = R[E_indirect + e of sources that are sampled nowhere] + sum (1 - w_j) R[e_j] + sum w_j D_j
//! ```
//! Every source counts once, and E is continuous across borders of classes, since w_j and R[e_j] are. The e_j are measured
//! anew at these points, by the same adaptive shadow rays as pixels', so that they belong to whatever pass 1 came from; pass
//! 1's own direct light is not used.
//! Source: Shirley 1990; Chen, Rushmeier, Miller, Turner 1991; Kok, Jansen 1991.
//! Memory: a reconstruction for three sources that are sampled somewhere (for one with `hermite-limited`), 2 bytes a vertex
//! and such source.
//! Not modelled: a shadow that lies between the points of patches that all see a source, or none of it.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::sampler::{Ask, ShadowCounts};
use super::{DirectLight, DirectOptions, Outlook, SampledSource, ShadowSampling, pattern};
use crate::mesh::{Element, ElementId, Mesh, PatchId, SurfacePoint, VertexId};
use crate::radiosity::{Receiver, Solution};
use crate::raycast::{CastError, Purpose, RayCaster};
use crate::reconstruct::{Method, ReconstructOptions, Reconstruction};
use crate::sampling::mix;
use crate::units::Rgb;

/// Solid angle (sr) over which a source that all of a patch sees is smooth enough to be stored.
const SMOOTH_SR: f64 = 0.1;
/// Pairs of a point and a source that are asked at once.
const PAIRS_PER_CHUNK: usize = 1 << 16;
/// Share of the mean irradiance that darker points are taken for, where errors are measured by what is there.
const DARKEST: f64 = 0.01;

/// Stored light at a point, and what is to be sampled there.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredLight {
    /// Stored irradiance (W/m^2), not negative.
    pub irradiance: Rgb,
    /// A part of it had to be made 0.
    pub clamped: bool,
    /// Luminance of the irradiance that is expected in all (W/m^2).
    pub expected: f64,
    /// Sources to sample; without, all of them, wholly.
    pub sampled: Option<Vec<SampledSource>>,
}

impl StoredLight {
    /// How many sources are sampled, each by its weight.
    pub fn n_sampled(&self) -> f64 {
        self.sampled.iter().flatten().map(|s| s.weight).sum()
    }
}

/// What selection found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SelectionCounts {
    /// Sources.
    pub sources: u64,
    /// Those that some patch samples.
    pub sampled_sources: u64,
    /// Pairs of a patch and a source that is sampled there.
    pub sampled: u64,
    /// Stored, because nothing of it can be seen.
    pub stored_hidden: u64,
    /// Stored, because all of it is seen and it is large.
    pub stored_smooth: u64,
    /// Stored, because others give more.
    pub stored_weak: u64,
    /// Shadow rays from vertices.
    pub shadow: ShadowCounts,
}

/// Classes of a patch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PatchClasses {
    /// Sources that are sampled, strongest first.
    pub sampled: Vec<u32>,
    /// All of it is seen from here and from around, by source that is sampled.
    settled: Vec<bool>,
    hidden: u64,
    smooth: u64,
    weak: u64,
}

/// Which light is stored where.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Indirect light, and sources that are sampled nowhere.
    base: Reconstruction,
    /// All light by pass 1: what errors are measured by.
    expected: Reconstruction,
    /// Luminance (W/m^2) that darker points are taken for.
    least_expected: f64,
    /// Sources that are sampled somewhere.
    active: Vec<Active>,
    /// e_j of active sources, over their colour where that is apart, and w_j.
    fields: Fields,
    weights: Fields,
    /// By vertex, then active source.
    seeds: Vec<u16>,
    /// By patch: places in `active`, and whether all of it is seen from there and from around.
    of_patch: Vec<Vec<(u32, bool)>>,
    counts: SelectionCounts,
}

/// A source that is sampled somewhere.
#[derive(Clone, Copy, Debug)]
struct Active {
    source: u32,
    colour: Rgb,
    /// No patch stores it.
    everywhere: bool,
}

/// A field a source.
#[derive(Clone, Debug)]
enum Fields {
    /// Scalars, three in the channels of a reconstruction.
    Packed(Vec<Reconstruction>),
    /// One each, where channels are not alike (coloured glass) or not apart (the limiter looks at luminance).
    Each(Vec<Reconstruction>),
}

impl Fields {
    /// `value(k, v)`: of scalar field k at vertex v.
    fn packed(
        mesh: &Mesh,
        options: ReconstructOptions,
        n: usize,
        value: impl Fn(usize, usize) -> f64 + Sync,
    ) -> Fields {
        let field = |f: usize| {
            let channel = |c: usize, v: usize| if 3 * f + c < n { value(3 * f + c, v) } else { 0.0 };
            reconstruct(mesh, options, |v| Rgb([channel(0, v), channel(1, v), channel(2, v)]))
        };
        Fields::Packed((0..n.div_ceil(3)).into_par_iter().map(field).collect())
    }

    /// `value(k, v)`: of field k at vertex v.
    fn each(
        mesh: &Mesh,
        options: ReconstructOptions,
        n: usize,
        value: impl Fn(usize, usize) -> Rgb + Sync,
    ) -> Fields {
        Fields::Each((0..n).into_par_iter().map(|k| reconstruct(mesh, options, |v| value(k, v))).collect())
    }

    /// All fields at a point; scalars in all channels.
    fn at(&self, mesh: &Mesh, at: SurfacePoint, values: &mut Vec<Rgb>) {
        values.clear();
        match self {
            Fields::Each(fields) => values.extend(fields.iter().map(|f| f.evaluate_unclamped(mesh, at))),
            Fields::Packed(fields) => {
                values.extend(fields.iter().flat_map(|f| f.evaluate_unclamped(mesh, at).0).map(Rgb::splat));
            }
        }
    }
}

/// From values at the vertices.
fn reconstruct(mesh: &Mesh, options: ReconstructOptions, value: impl Fn(usize) -> Rgb) -> Reconstruction {
    let vertex: Vec<Rgb> = (0..mesh.vertices.len()).map(value).collect();
    Reconstruction::new(mesh, options, &vertex, &element_means(mesh, &vertex))
}

/// Means of the corners' values.
fn element_means(mesh: &Mesh, vertex: &[Rgb]) -> Vec<Rgb> {
    let mean = |e: &Element| {
        let corners = e.corners.vertices();
        corners.iter().map(|v| vertex[v.0 as usize]).sum::<Rgb>() / corners.len() as f64
    };
    mesh.elements.iter().map(mean).collect()
}

/// What a vertex receives from a source.
#[derive(Clone, Copy, Debug, Default)]
struct Contribution {
    unoccluded: Rgb,
    /// Visible part of it.
    received: Rgb,
    seed: u16,
    /// Its visible share is 0 or 1, by channel alike.
    share: Option<bool>,
}

impl Selection {
    /// Measures every source at every vertex, and chooses.
    ///
    /// # Errors
    /// When the caster fails.
    pub fn new(
        direct: &mut DirectLight,
        mesh: &Mesh,
        solution: &Solution,
        caster: &mut dyn RayCaster,
        reconstruct: ReconstructOptions,
    ) -> Result<Selection, CastError> {
        let options = direct.options;
        let total: Vec<Rgb> = solution.vertex_irradiance.iter().map(|e| e.total()).collect();
        let mean = total.iter().map(|e| e.luminance()).sum::<f64>() / total.len().max(1) as f64;
        let least_expected = DARKEST * mean;
        let n_sources = direct.sources.len();
        let adaptive = options.shadow_sampling == ShadowSampling::Adaptive;
        let measured = if options.stored_share > 0.0 || adaptive {
            direct.sampler.purpose = Purpose::Selection;
            let measured = measure(direct, mesh, solution, least_expected, caster);
            direct.sampler.purpose = Purpose::Shadow;
            measured?
        } else {
            Vec::new()
        };
        let classes = classes(direct, mesh, &measured, &options);
        let mut is_active = vec![false; n_sources];
        classes.iter().flat_map(|c| &c.sampled).for_each(|s| is_active[*s as usize] = true);
        let n_sampling = |s: u32| classes.iter().filter(|c| c.sampled.contains(&s)).count();
        let active: Vec<Active> = (0..n_sources as u32)
            .filter(|s| is_active[*s as usize])
            .map(|source| Active {
                source,
                colour: direct.sources[source as usize].colour(),
                everywhere: n_sampling(source) == mesh.patches.len(),
            })
            .collect();
        let place = |s: &u32| active.iter().position(|a| a.source == *s).map(|k| k as u32);
        let with_place = |c: &PatchClasses| {
            let pairs = c.sampled.iter().zip(&c.settled);
            pairs.filter_map(|(s, settled)| Some((place(s)?, *settled))).collect()
        };
        let of_patch: Vec<Vec<(u32, bool)>> = classes.iter().map(with_place).collect();

        let received = |s: usize, v: usize| measured.get(s * n_points(mesh) + v);
        let never: Vec<usize> = (0..n_sources).filter(|s| !is_active[*s]).collect();
        let vertex: Vec<Rgb> = (0..mesh.vertices.len())
            .map(|v| {
                let stored = never.iter().filter_map(|s| received(*s, v)).map(|c| c.received).sum::<Rgb>();
                solution.vertex_irradiance[v].indirect + stored
            })
            .collect();
        let element: Vec<Rgb> = match reconstruct.method {
            Method::Constant => {
                let never = |v: usize| never.iter().filter_map(|s| received(*s, v)).map(|c| c.received).sum();
                let stored: Vec<Rgb> = (0..mesh.vertices.len()).map(never).collect();
                let means = element_means(mesh, &stored);
                solution.element_irradiance.iter().zip(means).map(|(e, stored)| e.indirect + stored).collect()
            }
            _ => Vec::new(),
        };
        let stored = |k: usize, v: usize| {
            let Active { source, everywhere, .. } = active[k];
            received(source as usize, v).filter(|_| !everywhere).map_or(Rgb::BLACK, |c| c.received)
        };
        let scalar = |k: usize, v: usize| stored(k, v).max_channel() / active[k].colour.max_channel();
        let samples = |k: usize, v: usize| {
            let around = mesh.elements_around(VertexId(v as u32));
            let all = around.iter().all(|e| {
                let patch = mesh.elements[e.0 as usize].patch;
                of_patch[patch.0 as usize].iter().any(|(of, _)| *of as usize == k)
            });
            if all && !around.is_empty() { 1.0 } else { 0.0 }
        };
        let each = reconstruct.method == Method::HermiteLimited || !direct.sampler.panes.is_empty();
        let fields = if active.iter().all(|a| a.everywhere) { 0 } else { active.len() };
        let seeds = (0..mesh.vertices.len()).flat_map(|v| active.iter().map(move |a| (v, a.source)));
        let seed = |(v, s): (usize, u32)| received(s as usize, v).map_or(0, |c| c.seed);
        let sum = |of: fn(&PatchClasses) -> u64| classes.iter().map(of).sum();
        let counts = SelectionCounts {
            sources: n_sources as u64,
            sampled_sources: active.len() as u64,
            sampled: sum(|c| c.sampled.len() as u64),
            stored_hidden: sum(|c| c.hidden),
            stored_smooth: sum(|c| c.smooth),
            stored_weak: sum(|c| c.weak),
            shadow: direct.counts(),
        };
        Ok(Selection {
            base: Reconstruction::new(mesh, reconstruct, &vertex, &element),
            expected: Reconstruction::new(mesh, Method::Bilinear, &total, &[]),
            least_expected,
            weights: Fields::packed(mesh, Method::Bilinear.into(), fields, samples),
            fields: match each {
                true => Fields::each(mesh, reconstruct, fields, stored),
                false => Fields::packed(mesh, reconstruct, fields, scalar),
            },
            seeds: if measured.is_empty() { Vec::new() } else { seeds.map(seed).collect() },
            active,
            of_patch,
            counts,
        })
    }

    /// What was found.
    pub fn counts(&self) -> SelectionCounts {
        self.counts
    }

    /// Vertices whose derivatives the limiter made smaller.
    pub fn limited_vertices(&self) -> usize {
        self.base.limited_vertices()
    }

    /// Stored light at a point, and what is to be sampled.
    pub fn at(&self, mesh: &Mesh, at: SurfacePoint) -> StoredLight {
        let base = self.base.evaluate_unclamped(mesh, at);
        let mut clamped = base.min_channel() < 0.0;
        let mut irradiance = base.map(|e| e.max(0.0));
        let (mut fields, mut weights) = (Vec::new(), Vec::new());
        self.fields.at(mesh, at, &mut fields);
        self.weights.at(mesh, at, &mut weights);
        for (k, active) in self.active.iter().enumerate() {
            let (Some(e), Some(Rgb([w, ..]))) = (fields.get(k), weights.get(k)) else { continue };
            if !active.everywhere && *w < 1.0 {
                clamped |= e.min_channel() < 0.0;
                let e = e.map(|e| e.max(0.0));
                let e = if matches!(self.fields, Fields::Packed(_)) { active.colour * e } else { e };
                irradiance += e * (1.0 - w);
            }
        }
        let patch = mesh.elements[at.element.0 as usize].patch;
        let sampled = self.of_patch[patch.0 as usize].iter().filter_map(|(k, settled)| {
            let active = &self.active[*k as usize];
            let weight = if active.everywhere { 1.0 } else { weights.get(*k as usize)?.0[0] };
            let seen = self.seen_at(mesh, at.element, *k as usize);
            let outlook = Outlook { settled: settled.then_some(true), ..seen };
            (weight > 0.0).then_some(SampledSource { source: active.source, weight, outlook })
        });
        let sampled = Some(sampled.collect());
        let expected = self.expected.evaluate(mesh, at).luminance().max(self.least_expected);
        StoredLight { irradiance, clamped, expected, sampled }
    }

    /// What the corners of an element see of an active source.
    fn seen_at(&self, mesh: &Mesh, element: ElementId, k: usize) -> Outlook {
        if self.seeds.is_empty() {
            return Outlook::default();
        }
        let corners = mesh.elements[element.0 as usize].corners;
        let seed = |v: &VertexId| self.seeds[v.0 as usize * self.active.len() + k];
        let join = |[all, any]: [u16; 2], seed: u16| [all & seed, any | seed];
        let [all, any] = corners.vertices().iter().map(seed).fold([u16::MAX, 0], join);
        let likely = match [all, any] {
            [u16::MAX, _] => Some(true),
            [_, 0] => Some(false),
            _ => None,
        };
        Outlook { settled: None, likely, doubtful: any & !all }
    }
}

/// Points that look at the sources: the vertices, then the middles of the elements.
fn n_points(mesh: &Mesh) -> usize {
    mesh.vertices.len() + mesh.elements.len()
}

/// A point: where light is received, where rays start, with which normal, and on which patch.
struct Point {
    at: DVec3,
    apex: DVec3,
    normal: DVec3,
    patch: Option<PatchId>,
}

impl Point {
    fn new(mesh: &Mesh, i: usize, offset_m: f64) -> Point {
        if let Some(e) = i.checked_sub(mesh.vertices.len()) {
            let element = &mesh.elements[e];
            let corners = mesh.polygon(&element.corners);
            let at = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let normal = element.normal;
            return Point { at, apex: at + offset_m * normal, normal, patch: Some(element.patch) };
        }
        let receiver = Receiver::of_vertex(&mesh.vertices[i], i as u32, offset_m);
        let around = mesh.elements_around(VertexId(i as u32));
        Point {
            at: receiver.point,
            apex: receiver.target,
            normal: receiver.normal,
            patch: around.first().map(|e| mesh.elements[e.0 as usize].patch),
        }
    }
}

/// What every point receives from every source: source by source.
fn measure(
    direct: &mut DirectLight,
    mesh: &Mesh,
    solution: &Solution,
    least_expected: f64,
    caster: &mut dyn RayCaster,
) -> Result<Vec<Contribution>, CastError> {
    let (sources, options, offset_m) = (&direct.sources, direct.options, direct.sampler.offset_m);
    // Seeds have four leaves a side.
    let options =
        DirectOptions { shadow_strata: options.shadow_strata.min(super::cells::SEED_SIDE), ..options };
    let n = n_points(mesh);
    let expected = |i: usize| {
        let vertex = solution.vertex_irradiance.get(i);
        let element = || &solution.element_irradiance[i - mesh.vertices.len()];
        vertex.unwrap_or_else(element).total().luminance().max(least_expected)
    };
    let mut contributions = vec![Contribution::default(); n * sources.len()];
    let all: Vec<usize> = (0..contributions.len()).collect();
    for chunk in all.chunks(PAIRS_PER_CHUNK) {
        let asks: Vec<(usize, Rgb, Ask<'_>)> = chunk
            .par_iter()
            .filter_map(|&i| {
                let (s, p) = (i / n, i % n);
                let source = &sources[s];
                let Point { at, apex, normal, patch } = Point::new(mesh, p, offset_m);
                let unoccluded = source.unoccluded(at, normal);
                if unoccluded.is_black() {
                    return None;
                }
                let ask = Ask {
                    source,
                    source_index: s as u32,
                    position: at,
                    normal,
                    apex,
                    key: mix(!(p as u64)),
                    region: patch,
                    pattern: pattern(&options, unoccluded.luminance(), expected(p), Outlook::default()),
                };
                Some((i, unoccluded, ask))
            })
            .collect();
        let queries: Vec<Ask<'_>> = asks.iter().map(|(_, _, ask)| *ask).collect();
        for ((i, unoccluded, _), sampled) in asks.iter().zip(direct.sampler.cast(caster, &queries)?) {
            let share = match (sampled.share.min_channel(), sampled.share.max_channel()) {
                (low, _) if low >= 1.0 => Some(true),
                (_, high) if high <= 0.0 => Some(false),
                _ => None,
            };
            contributions[*i] = Contribution {
                unoccluded: *unoccluded,
                received: *unoccluded * sampled.share,
                seed: sampled.seed,
                share,
            };
        }
    }
    Ok(contributions)
}

/// The classes of every patch.
fn classes(
    direct: &DirectLight,
    mesh: &Mesh,
    measured: &[Contribution],
    options: &DirectOptions,
) -> Vec<PatchClasses> {
    let n_sources = direct.sources.len();
    if options.stored_share <= 0.0 {
        let all = PatchClasses {
            sampled: (0..n_sources as u32).collect(),
            settled: vec![false; n_sources],
            ..PatchClasses::default()
        };
        return vec![all; mesh.patches.len()];
    }
    let points: Vec<Vec<u32>> = (0..mesh.patches.len()).map(|p| points_of(mesh, PatchId(p as u32))).collect();
    let of_patch = |p: usize| {
        let neighbourhood = neighbourhood(mesh, PatchId(p as u32), &points);
        let mut classes = PatchClasses::default();
        let (mut rest, mut sum) = (Vec::new(), 0.0);
        for s in 0..n_sources {
            let at = |i: &u32| &measured[s * n_points(mesh) + *i as usize];
            let strongest = points[p].iter().map(|i| at(i).unoccluded.luminance()).fold(0.0, f64::max);
            sum += strongest;
            let lit: Vec<_> = neighbourhood.iter().map(at).filter(|c| !c.unoccluded.is_black()).collect();
            let is_large = || {
                let vertices = points[p].iter().filter_map(|i| mesh.vertices.get(*i as usize));
                let angles = vertices.map(|v| direct.sources[s].solid_angle(v.position));
                angles.fold(f64::INFINITY, f64::min) > SMOOTH_SR
            };
            let all = |seen: bool| lit.iter().all(|c| c.share == Some(seen));
            if strongest == 0.0 || all(false) {
                classes.hidden += 1;
            } else if all(true) && is_large() {
                classes.smooth += 1;
            } else {
                rest.push((s as u32, strongest, all(true)));
            }
        }
        rest.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut left: f64 = rest.iter().map(|(_, u, _)| u).sum();
        for (s, u, settled) in &rest {
            // 1 stores all, however sums are rounded.
            if options.stored_share >= 1.0 || left <= options.stored_share * sum {
                break;
            }
            classes.sampled.push(*s);
            classes.settled.push(*settled);
            left -= u;
        }
        classes.weak = (rest.len() - classes.sampled.len()) as u64;
        classes
    };
    (0..mesh.patches.len()).into_par_iter().map(of_patch).collect()
}

/// A patch's points: all vertices of its elements, and their middles.
fn points_of(mesh: &Mesh, patch: PatchId) -> Vec<u32> {
    let elements = mesh.patches[patch.0 as usize].elements.clone();
    let corners = elements.clone().flat_map(|e| mesh.elements[e as usize].corners.vertices().to_vec());
    let middles = elements.map(|e| mesh.vertices.len() as u32 + e);
    let mut points: Vec<u32> = corners.map(|v| v.0).chain(middles).collect();
    points.sort_unstable();
    points.dedup();
    points
}

/// Those and the points of the patches across its edges.
fn neighbourhood(mesh: &Mesh, patch: PatchId, points: &[Vec<u32>]) -> Vec<u32> {
    let mut patches = vec![patch.0];
    for e in mesh.patches[patch.0 as usize].elements.clone() {
        let n_edges = mesh.elements[e as usize].corners.vertices().len();
        let across = (0..n_edges).flat_map(|edge| mesh.neighbours_across(ElementId(e), edge));
        patches.extend(across.map(|n| mesh.elements[n.0 as usize].patch.0));
    }
    patches.sort_unstable();
    patches.dedup();
    let mut all: Vec<u32> = patches.iter().flat_map(|p| &points[*p as usize]).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
