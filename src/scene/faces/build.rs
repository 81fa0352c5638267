//! From a file's polygons to a [`FaceSet`]: points welded, faces cut, cleaned, joined and smoothed.
//!
//! ```text
//! points --Welder--> places    polygons --polygon.rs--> triangles and planar convex quads of places
//!        --degenerate and doubled ones dropped--> faces --join.rs, smooth.rs--> FaceSet
//! ```

use std::collections::HashSet;

use glam::DVec3;

use super::{FaceCounts, FaceSet, NONE, area_vector, join, polygon, smooth};
use crate::geom::Aabb;
use crate::geom::weld::Welder;

/// Points closer than this share of the object's size are one: files hold single precision, 6e-8 of a coordinate.
const WELD_SHARE: f64 = 1e-7;

/// How a polygon continues its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shading {
    /// Only where they lie in one plane.
    Flat,
    /// Neighbours of the same group do.
    Group(u32),
    /// Where they have the same normal at both ends of the common edge; per corner, indices into the normals.
    Normals,
}

/// Polygons of one object and material as a file has them.
#[derive(Clone, Debug, Default)]
pub(crate) struct RawFaces {
    /// Positions, in the file's order and unit.
    pub(crate) points: Vec<DVec3>,
    /// Shading normals.
    pub(crate) normals: Vec<DVec3>,
    /// Corners of all polygons, one after the other: indices into `points`.
    pub(crate) corners: Vec<u32>,
    /// Index into `normals` of each corner; empty when the file has none.
    pub(crate) corner_normals: Vec<u32>,
    /// Corners of each polygon; empty: all are triangles.
    pub(crate) arities: Vec<u32>,
    /// Smooth group of each polygon, 0 for none; empty when the file has none.
    pub(crate) groups: Vec<u32>,
}

/// What a file's object must not have.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Faults {
    /// A point beyond the coordinates that scenes may have (m).
    FarPoint(DVec3),
}

/// A face under way: places of its corners, and what its corners' shading is told by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Draft {
    /// Places; the fourth of a triangle is `NONE`.
    pub(super) places: [u32; 4],
    /// Normals of the corners, or `NONE`.
    pub(super) normals: [u32; 4],
    /// Smooth group, or 0.
    pub(super) group: u32,
}

impl Draft {
    pub(super) fn n_corners(&self) -> usize {
        if self.places[3] == NONE { 3 } else { 4 }
    }
}

impl RawFaces {
    /// How many polygons.
    pub(crate) fn n_polygons(&self) -> usize {
        if self.arities.is_empty() { self.corners.len() / 3 } else { self.arities.len() }
    }

    /// The surface that these polygons are, and whether some faces were there twice, once from either side; `None` when
    /// no face is left.
    ///
    /// `max_coordinate_m` bounds every coordinate. Indices must be in range.
    pub(crate) fn build(&self, max_coordinate_m: f64) -> Result<(Option<FaceSet>, bool), Faults> {
        let used = || self.corners.iter().map(|&c| self.points[c as usize]);
        if let Some(far) = used().find(|p| !p.is_finite() || p.abs().max_element() > max_coordinate_m) {
            return Err(Faults::FarPoint(far));
        }
        let size = Aabb::around(used()).size().length();
        let mut welder = Welder::new((WELD_SHARE * size).max(f64::MIN_POSITIVE * 1e20));
        let mut place_of = vec![NONE; self.points.len()];
        let mut places: Vec<DVec3> = Vec::new();
        let mut counts = FaceCounts { n_polygons: self.n_polygons(), ..FaceCounts::default() };
        for &c in &self.corners {
            if place_of[c as usize] == NONE {
                let (id, at) = welder.weld(self.points[c as usize]);
                if id as usize == places.len() {
                    places.push(at);
                } else {
                    counts.n_welded += 1;
                }
                place_of[c as usize] = id;
            }
        }
        drop(welder);
        let mut drafts = self.drafts(&place_of, &places, &mut counts);
        let from_both_sides = drop_doubled(&mut drafts, &mut counts);
        let rule = if self.corner_normals.is_empty() && self.groups.is_empty() {
            Shading::Flat
        } else if self.corner_normals.is_empty() {
            Shading::Group(0)
        } else {
            Shading::Normals
        };
        let smoothness = smooth::Smoothness { places: &places, normals: &self.normals, rule };
        join::parallelograms(&mut drafts, &smoothness, &mut counts);
        if drafts.is_empty() {
            return Ok((None, from_both_sides));
        }
        let area_m2 =
            drafts.iter().map(|d| 0.5 * area_vector(|i| places[i as usize], &d.places).length()).sum();
        let (points, faces) = smooth::split_at_creases(&drafts, &smoothness);
        Ok((Some(FaceSet { points, faces, area_m2, counts }), from_both_sides))
    }

    /// Triangles and planar convex quads.
    fn drafts(&self, place_of: &[u32], places: &[DVec3], counts: &mut FaceCounts) -> Vec<Draft> {
        let mut drafts = Vec::with_capacity(self.n_polygons());
        let mut cutter = polygon::Cutter::default();
        let mut start = 0;
        for index in 0..self.n_polygons() {
            let n = self.arities.get(index).map_or(3, |&n| n as usize);
            let range = start..start + n;
            start += n;
            // Neighbouring corners on one place are one corner: a quad may become a triangle.
            let mut ring: Vec<(u32, u32)> = Vec::with_capacity(n);
            for c in range {
                let place = place_of[self.corners[c] as usize];
                let normal = self.corner_normals.get(c).copied().unwrap_or(NONE);
                if ring.last().is_none_or(|&(last, _)| last != place) {
                    ring.push((place, normal));
                }
            }
            while ring.len() > 1 && ring.first().map(|r| r.0) == ring.last().map(|r| r.0) {
                ring.pop();
            }
            let before = drafts.len();
            let group = self.groups.get(index).copied().unwrap_or(0);
            cutter.cut(&ring, places, |corners: &[(u32, u32)]| {
                let mut draft = Draft { places: [NONE; 4], normals: [NONE; 4], group };
                for (k, &(place, normal)) in corners.iter().enumerate() {
                    draft.places[k] = place;
                    draft.normals[k] = normal;
                }
                drafts.push(draft);
            });
            match drafts.len() - before {
                0 => counts.n_degenerate += 1,
                1 => {}
                _ => counts.n_cut += 1,
            }
        }
        drafts
    }
}

/// Keeps the first face of each set of corners; true when a dropped one looked the other way.
fn drop_doubled(drafts: &mut Vec<Draft>, counts: &mut FaceCounts) -> bool {
    let mut seen = HashSet::with_capacity(drafts.len());
    let mut doubled = HashSet::new();
    drafts.retain(|draft| {
        let mut key = draft.places;
        key.sort_unstable();
        let first = seen.insert(key);
        if !first {
            counts.n_doubled += 1;
            doubled.insert((key, is_even(&draft.places)));
        }
        first
    });
    // A second look only where there is something to see.
    !doubled.is_empty()
        && drafts.iter().any(|draft| {
            let mut key = draft.places;
            key.sort_unstable();
            doubled.contains(&(key, !is_even(&draft.places)))
        })
}

/// Which way round a face is: the parity of the permutation that sorts its corners; for quads, of the first three, counted
/// from the smallest.
fn is_even(places: &[u32; 4]) -> bool {
    let n = if places[3] == NONE { 3 } else { 4 };
    let least = (0..n).min_by_key(|&i| places[i]).unwrap_or(0);
    places[(least + 1) % n] < places[(least + n - 1) % n]
}
