//! Which rows are cast together, and how closely their shooters are looked at.
//!
//! ```text
//! strongest patches without a row --Look by power and number--> Aim --not in the row cache: FormFactors, one query--> rows
//! ```

use super::form_factors::{FormFactors, Row};
use super::shooter::{Aim, Look, ShooterId};
use super::shooting::{Solver, is_large};
use super::state::{State, magnitude};
use super::stray::StrayShares;
use crate::mesh::PatchId;
use crate::raycast::{CastError, RayCaster};

/// Emitting patches are looked at closely, with all strata from everywhere, when there are at most this many; among more,
/// the errors of single ones average out, and rays would be spent fourfold.
const MAX_CLOSE_SHOOTERS: usize = 256;
/// The same where the rest is shot stochastically; more than these are looked at with one stratum from everywhere.
const MAX_FULL_SHOOTERS_OF_MANY: usize = 16;
/// Rows that are cast in one query, while there is memory to keep them: a command of the board is worth its set-up then,
/// and its clusters get equal shares. What is cast ahead and never shoots is at most this many rows.
pub(super) const ROWS_PER_QUERY: usize = 16;
/// But at most so many receivers' questions at once: they take about 100 bytes each.
const RECEIVERS_PER_QUERY: usize = 4_000_000;

impl Solver<'_> {
    /// Rows of shooters, and how many rays they took: those that are not in the cache are cast.
    pub(super) fn cast_rows(
        &mut self,
        shooters: &[ShooterId],
        caster: &mut dyn RayCaster,
    ) -> Result<(Vec<(Row, StrayShares)>, u64), CastError> {
        let Some(receivers) = &self.receivers else { return Ok((Vec::new(), 0)) };
        let factors = FormFactors {
            mesh: self.mesh,
            receivers,
            emitters: &self.emitters,
            seed: self.options.seed,
            offset_m: self.offset_m,
            kernel: self.options.kernel,
            // Only solves that end stochastically tell an error.
            twice: is_large(self.mesh, self.options),
            panes: &self.panes,
        };
        let aim = |shooter: &ShooterId| Aim { shooter: *shooter, look: self.look(*shooter) };
        let mut wanted: Vec<Aim> = shooters.iter().map(aim).collect();
        let cached = |aim: &Aim| self.row_cache.as_ref().and_then(|cache| cache.get(aim)).cloned();
        let at_hand: Vec<Option<(Row, StrayShares)>> = wanted.iter().map(cached).collect();
        let mut known = at_hand.iter().map(Option::is_some);
        wanted.retain(|_| known.next() == Some(false));
        if wanted.is_empty() {
            return Ok((at_hand.into_iter().flatten().collect(), 0));
        }
        let (strays, n_stray_rays) = factors.stray_shares(&wanted, caster)?;
        let mut rows = factors.rows(&wanted, caster)?;
        for ((aim, (row, _)), (_, passed)) in wanted.iter().zip(&mut rows).zip(&strays) {
            let area_m2 = match aim.shooter {
                ShooterId::Patch(patch) => self.mesh.patches[patch.0 as usize].area_m2,
                ShooterId::Emitter(e) => self.emitters[e as usize].area_m2,
            };
            row.passed_m2 = [0, 1].map(|side| row.passed_m2[side] + area_m2 * passed[side]);
        }
        let strays: Vec<StrayShares> = strays.into_iter().map(|(shares, _)| shares).collect();
        let n_rays = n_stray_rays + rows.iter().map(|(_, n_rays)| n_rays).sum::<u64>();
        if let Some(cache) = &mut self.row_cache {
            for (aim, ((row, _), stray)) in wanted.iter().zip(rows.iter().zip(&strays)) {
                cache.keep(*aim, row, *stray);
            }
        }
        let mut cast = rows.into_iter().map(|(row, _)| row).zip(strays);
        Ok((at_hand.into_iter().filter_map(|row| row.or_else(|| cast.next())).collect(), n_rays))
    }

    /// How a shooter is looked at: the more closely, the more of the power it has.
    fn look(&self, shooter: ShooterId) -> Look {
        let is_large = is_large(self.mesh, self.options);
        let max_full = if is_large { MAX_FULL_SHOOTERS_OF_MANY } else { MAX_CLOSE_SHOOTERS };
        let emits = match shooter {
            ShooterId::Patch(patch) => !self.exitance[patch.0 as usize].is_black(),
            ShooterId::Emitter(_) if self.emitters.len() <= MAX_CLOSE_SHOOTERS => return Look::Dense,
            ShooterId::Emitter(_) => false,
        };
        match self.n_emitting {
            n if emits && n <= max_full => Look::Full,
            n if emits && n <= MAX_CLOSE_SHOOTERS => Look::Dense,
            _ if self.options.dense_visibility => Look::Dense,
            _ => Look::Sparse,
        }
    }

    pub(super) fn rows_per_query(&self) -> usize {
        let n_receivers = self.receivers.as_ref().map_or(1, |r| r.all.len().max(1));
        ROWS_PER_QUERY.min(RECEIVERS_PER_QUERY / n_receivers).max(1)
    }

    /// The patches with most unshot power that have no row yet, strongest first: theirs are cast next, in one query.
    pub(super) fn strongest_without_row(&self, state: &State) -> Vec<PatchId> {
        let n_rows = if state.kept.full { 1 } else { self.rows_per_query() };
        let mut patches: Vec<(f64, PatchId)> = (0..)
            .map(PatchId)
            .zip(&state.unshot_w)
            .map(|(patch, w)| (magnitude(*w), patch))
            .filter(|(power_w, patch)| *power_w > 0.0 && !state.kept.patches.contains(&patch.0))
            .collect();
        let order = |a: &(f64, PatchId), b: &(f64, PatchId)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if patches.len() > n_rows {
            patches.select_nth_unstable_by(n_rows - 1, order);
            patches.truncate(n_rows);
        }
        patches.sort_by(order);
        patches.into_iter().map(|(_, patch)| patch).collect()
    }
}
