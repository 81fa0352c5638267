//! Rows of form factors at hand: cast once, kept up to a bound of memory.
//!
//! ```text
//! patch --KeptRows says kept, row at hand--> row
//!       --not kept: cast with the next strongest ones, counted--> row, kept when it fits
//!       --kept, but not at hand (the solve was resumed): cast again, not counted--> row
//! ```

use std::collections::BTreeMap;

use super::form_factors::Row;
use super::state::{Known, State};
use super::stray::StrayShares;
use crate::mesh::{Mesh, PatchId};

/// What is known of a shooter of `area_m2` once its row was cast.
pub(super) fn known(mesh: &Mesh, area_m2: f64, row: &Row, stray: StrayShares) -> Known {
    let arrived = row.elements.weighted_sum(|e| mesh.elements[e].area_m2);
    let twice = (row.passed_m2[0] + row.passed_m2[1]) / area_m2;
    Known { stray, area_m2, row_sum: arrived / area_m2 + stray.lost + stray.back - twice }
}

/// The rows themselves; which ones are kept is the state's.
#[derive(Default)]
pub(super) struct RowStore {
    rows: BTreeMap<PatchId, Row>,
}

impl RowStore {
    pub(super) fn get(&self, patch: PatchId) -> Option<&Row> {
        self.rows.get(&patch)
    }

    /// A row that was just cast: into the record, and kept when it fits.
    pub(super) fn keep(
        &mut self,
        state: &mut State,
        mesh: &Mesh,
        patch: PatchId,
        row: &Row,
        stray: StrayShares,
        max_bytes: u64,
    ) {
        let area_m2 = mesh.patches[patch.0 as usize].area_m2;
        state.known.entry(patch.0).or_insert_with(|| known(mesh, area_m2, row, stray));
        if state.kept.n_bytes + row.n_bytes() <= max_bytes {
            state.kept.n_bytes += row.n_bytes();
            state.kept.patches.insert(patch.0);
            self.rows.insert(patch, row.clone());
        } else {
            state.kept.full = true;
        }
    }

    /// A row that the state says is kept, cast again.
    pub(super) fn restore(&mut self, patch: PatchId, row: Row) {
        self.rows.insert(patch, row);
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
    }
}
