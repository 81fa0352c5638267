//! A bundle through its shells, without time.
//!
//! ```text
//! for each shell: open rays step, ray by ray and round by round, to its far side --(cell, ray)--> table
//!     table full, or all rays there: its entries in order --lists, tested masks--> (patch, rays) -> tests -> best hits
//!     barrier: any-hit rays with a hit end; the limits of the next shell are the best t so far
//! ```
//! Canonical order: in a shell the walking rays take a step each in ray order, again and again; a cell that is occupied
//! enters the table. When the table has no room for a cell, all that is in it is processed before the walk goes on. An
//! entry's list is read to its end; a patch is tested with the rays of the entry that it was not yet tested with in
//! this bundle. A ray's walk ends where it would in grid partition with the best t that it had at the last barrier:
//! kills act at barriers only.

use crate::datapath::cell_step::{Cell, advance};
use crate::datapath::ray_patch::SeenPatch;
use crate::datapath::shell::{BundleTable, Inserted, distance, next_radius};
use crate::datapath::{HitWords, RayWords};
use crate::memory_image::MemoryImage;
use crate::packet::MAX_BUNDLE_RAYS;
use crate::spec::ShellSpec;

use super::CanonicalCounters;

/// What a bundle did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BundleTrace {
    /// The nearest hits in ray order; for any-hit rays whatever made them stop.
    pub hits: Vec<Option<HitWords>>,
    /// Rays, cells, list entries, tests, hits. Not the bundle itself.
    pub work: CanonicalCounters,
    /// Shells entered.
    pub shells: u32,
    /// Times that a full table was processed before the end of its shell.
    pub splits: u32,
}

/// Traces bundles one after another.
#[derive(Debug)]
pub struct ShellTracer<'a> {
    image: &'a MemoryImage,
    spec: ShellSpec,
    table: BundleTable,
    /// The rays that each patch was tested with in the current bundle.
    tested: Vec<u64>,
    /// Patches with a mask other than 0.
    touched: Vec<u32>,
}

impl<'a> ShellTracer<'a> {
    /// For a scene and a partition in shells.
    pub fn new(image: &'a MemoryImage, spec: &ShellSpec) -> Self {
        ShellTracer {
            image,
            spec: *spec,
            table: BundleTable::new(spec.entries),
            tested: vec![0; crate::fixed::index(image.n_patches)],
            touched: Vec::new(),
        }
    }

    /// Traces a bundle, or up to 64 explicit rays together.
    ///
    /// # Panics
    /// With more than 64 rays.
    pub fn trace(&mut self, rays: &[RayWords], any_hit: bool) -> BundleTrace {
        assert!(rays.len() <= MAX_BUNDLE_RAYS, "{} rays in a bundle", rays.len());
        let image = self.image;
        let apex: Vec<Cell> = rays.iter().map(|r| image.grid.cell_of(&image.formats, r.origin)).collect();
        let mut cell = apex.clone();
        let mut done = BundleTrace { hits: vec![None; rays.len()], ..BundleTrace::default() };
        done.work.rays = rays.len() as u64;
        let mut open = (0..rays.len()).fold(0_u64, |mask, i| mask | 1 << i);
        while open != 0 {
            let entering = done.shells == 0;
            let radius = next_radius(&self.spec, done.shells);
            let limits: Vec<u64> =
                rays.iter().zip(&done.hits).map(|(ray, hit)| hit.map_or(ray.t_max, |h| h.t)).collect();
            let mut walking = open;
            let mut first_round = entering;
            while walking != 0 {
                for i in 0..rays.len() {
                    if walking >> i & 1 == 0 {
                        continue;
                    }
                    if !first_round {
                        match advance(&image.formats, &image.grid, &rays[i], cell[i], limits[i]) {
                            None => {
                                walking &= !(1 << i);
                                open &= !(1 << i);
                                continue;
                            }
                            Some(next) if distance(next, apex[i]) >= radius => {
                                walking &= !(1 << i);
                                continue;
                            }
                            Some(next) => cell[i] = next,
                        }
                    }
                    done.work.cells += 1;
                    if image.is_occupied(cell[i]) && self.table.insert(cell[i], i as u8) == Inserted::Full {
                        self.process(rays, &mut done);
                        done.splits += 1;
                        self.table.insert(cell[i], i as u8);
                    }
                }
                first_round = false;
            }
            self.process(rays, &mut done);
            if any_hit {
                for (i, hit) in done.hits.iter().enumerate() {
                    open &= !(u64::from(hit.is_some()) << i);
                }
            }
            done.shells += 1;
        }
        for patch in self.touched.drain(..) {
            self.tested[crate::fixed::index(patch)] = 0;
        }
        done.work.hits = done.hits.iter().flatten().count() as u64;
        done
    }

    /// Tests what is in the table and empties it.
    fn process(&mut self, rays: &[RayWords], done: &mut BundleTrace) {
        let image = self.image;
        for i in 0..self.table.len() {
            let entry = self.table.entry(i);
            let (first, count) = image.cell_list(entry.cell);
            for address in first..first + count {
                let patch = image.list_entry(address);
                done.work.list_entries += 1;
                let tested = &mut self.tested[crate::fixed::index(patch)];
                let mut wanted = entry.mask & !*tested;
                if wanted == 0 {
                    continue;
                }
                if *tested == 0 {
                    self.touched.push(patch);
                }
                *tested |= entry.mask;
                done.work.tests += u64::from(wanted.count_ones());
                let record = image.patch_ref(patch);
                let mut seen: Option<([i32; 3], SeenPatch)> = None;
                while wanted != 0 {
                    let at = wanted.trailing_zeros() as usize;
                    wanted &= wanted - 1;
                    let RayWords { origin, dir, t_max } = rays[at];
                    let from = match seen.take() {
                        Some((apex, patch)) if apex == origin => patch,
                        _ => SeenPatch::new(&image.formats, origin, record),
                    };
                    done.hits[at] = HitWords::nearer(done.hits[at], from.test(&image.formats, dir, t_max));
                    seen = Some((origin, from));
                }
            }
        }
        self.table.clear();
    }
}

#[cfg(test)]
#[path = "shells_tests.rs"]
mod tests;
