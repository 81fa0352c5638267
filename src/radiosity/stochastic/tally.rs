//! What arrives in a pass, in integers: sums that no order changes.
//!
//! ```text
//! hit --patch, point--> element, (s,t) --> cells of the element: power per channel; magnitude, and times s, t, s t
//! ```
//! One unit is the pass's power x 2^-61, so no sum overflows; a ray of a pass of 2^32 still has 29 bits. The four last
//! cells give the power that falls under the hat of each corner, in the mean colour of the element.

use std::hint::black_box;
use std::sync::atomic::{AtomicI64, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::super::state::magnitude;
use super::bundles::Source;
use crate::huge_pages::move_table;
use crate::mesh::{Corners, Locator, Mesh, SurfacePoint};
use crate::raycast::RayHit;
use crate::raycast::transmit::Passed;
use crate::units::Rgb;

/// Fraction bits of the unit.
const UNIT_BITS: i32 = 61;
/// Cells of an element.
const N_CELLS: usize = 7;

/// Sums of every element.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Tally {
    cells: Vec<Cells>,
}

/// A cache line, since hits come from all over the scene.
#[derive(Debug, Default, Serialize, Deserialize)]
#[repr(align(64))]
struct Cells([AtomicI64; N_CELLS]);

/// Power that reached no element (W).
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Stray {
    pub lost_w: Rgb,
    pub back_w: Rgb,
    /// What came through panes, which is counted at the glass, too: by elements, and on backs.
    pub passed_w: [Rgb; 2],
}

/// What arrived at one element.
pub(super) struct Arrived {
    /// Power (W).
    pub power_w: Rgb,
    /// Shares of it under the hats of the corners.
    pub hats: [f64; 4],
}

impl Tally {
    pub(super) fn new(n_elements: usize) -> Tally {
        let cells: Vec<Cells> = (0..n_elements).map(|_| Cells::default()).collect();
        move_table(&cells);
        Tally { cells }
    }

    pub(super) const fn bytes_per_element() -> usize {
        size_of::<Cells>()
    }

    /// Adds the hits of `sources`, ray by ray, of a pass of `pass_w`.
    pub(super) fn add(
        &self,
        mesh: &Mesh,
        locator: &Locator,
        sources: &[Source],
        hits: &[Option<RayHit>],
        pass_w: f64,
    ) -> Stray {
        let per_bundle = hits.len() / sources.len().max(1);
        let unit = 2f64.powi(UNIT_BITS) / pass_w;
        let strays: Vec<(u32, u32)> = sources
            .par_iter()
            .zip(hits.par_chunks(per_bundle.max(1)))
            .with_min_len(16)
            .map_init(Vec::new, |places, (source, hits)| {
                self.add_bundle(mesh, locator, source, hits, unit, places)
            })
            .collect();
        // In the order of the bundles.
        strays.iter().zip(sources).fold(Stray::default(), |sum, ((lost, back), source)| Stray {
            lost_w: sum.lost_w + source.ray_power_w * f64::from(*lost),
            back_w: sum.back_w + source.ray_power_w * f64::from(*back),
            ..sum
        })
    }

    /// Adds what the rays of `sources`, `n_rays` in all, brought behind panes.
    pub(super) fn add_beyond(
        &self,
        mesh: &Mesh,
        locator: &Locator,
        sources: &[Source],
        n_rays: usize,
        beyond: &[Passed],
        pass_w: f64,
    ) -> Stray {
        let per_bundle = (n_rays / sources.len().max(1)).max(1);
        let unit = 2f64.powi(UNIT_BITS) / pass_w;
        let mut stray = Stray::default();
        for p in beyond {
            let power_w = sources[p.index / per_bundle].ray_power_w * p.share;
            stray.passed_w[usize::from(p.by_back)] += power_w;
            match p.hit.map(|hit| (hit.t, mesh.patch_of_hit(hit.patch, hit.facing))) {
                None => stray.lost_w += power_w,
                Some((_, None)) => stray.back_w += power_w,
                Some((t, Some(patch))) => {
                    let power = power_w.0.map(|w| (w * unit) as i64);
                    let weight = magnitude(power_w) * unit;
                    self.deposit(&locator.locate(mesh, patch, p.ray.at(t)), power, weight);
                }
            }
        }
        stray
    }

    fn deposit(&self, place: &SurfacePoint, power: [i64; 3], weight: f64) {
        let (s, t) = (place.st.x, place.st.y);
        let values = [
            power[0],
            power[1],
            power[2],
            weight as i64,
            (weight * s) as i64,
            (weight * t) as i64,
            (weight * s * t) as i64,
        ];
        for (cell, value) in self.cells[place.element.0 as usize].0.iter().zip(values) {
            cell.fetch_add(value, Ordering::Relaxed);
        }
    }

    /// How many rays were lost, and how many met backs. `places` is a buffer.
    fn add_bundle(
        &self,
        mesh: &Mesh,
        locator: &Locator,
        source: &Source,
        hits: &[Option<RayHit>],
        unit: f64,
        places: &mut Vec<SurfacePoint>,
    ) -> (u32, u32) {
        let power = source.ray_power_w.0.map(|w| (w * unit) as i64);
        let weight = magnitude(source.ray_power_w) * unit;
        let (mut lost, mut back) = (0, 0);
        let mut hits = hits.iter();
        places.clear();
        // All places first: nothing is fetched ahead past an atomic addition.
        source.bundle.for_each_ray(|ray| {
            let Some(Some(hit)) = hits.next() else {
                lost += 1;
                return;
            };
            let Some(patch) = mesh.patch_of_hit(hit.patch, hit.facing) else {
                back += 1;
                return;
            };
            let place = locator.locate(mesh, patch, ray.at(hit.t));
            black_box(self.cells[place.element.0 as usize].0[0].load(Ordering::Relaxed));
            places.push(place);
        });
        for place in places {
            self.deposit(place, power, weight);
        }
        (lost, back)
    }

    /// What arrived at element `e` in a pass of `pass_w`.
    pub(super) fn of(&self, mesh: &Mesh, e: usize, pass_w: f64) -> Arrived {
        let cells = self.cells[e].0.each_ref().map(|cell| cell.load(Ordering::Relaxed) as f64);
        let unit = pass_w / 2f64.powi(UNIT_BITS);
        let corners = &mesh.elements[e].corners;
        let middle =
            if matches!(corners, Corners::Quad(_)) { [0.5, 0.5, 0.25] } else { [1.0 / 3.0, 1.0 / 3.0, 0.0] };
        let share = |k: usize| if cells[3] > 0.0 { cells[4 + k] / cells[3] } else { middle[k] };
        let [s, t, st] = [share(0), share(1), share(2)];
        let hats = match corners {
            Corners::Triangle(_) => [1.0 - s - t, s, t, 0.0],
            Corners::Quad(_) => [1.0 - s - t + st, s - st, st, t - st],
        };
        Arrived { power_w: Rgb([cells[0], cells[1], cells[2]]) * unit, hats }
    }

    pub(super) fn clear(&mut self) {
        self.cells.par_iter_mut().for_each(|cells| *cells = Cells::default());
    }
}
