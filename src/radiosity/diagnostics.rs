//! What form factors should obey and how far they are from it, before any correction: none is made.
//!
//! ```text
//! rows kept --areas--> exchange G_ij = sum over elements e of i of A_e F_ej (m^2) --pairs--> ReciprocityError
//! record of shooters --> RowSumError
//! ```
//! Reciprocity: G_ij = G_ji, both being (1/pi) times the integral of cos cos / r^2 over both patches. Each side of it comes
//! from other source points, other receivers and other rays, so the difference tells how wrong both are.
//! In a closed scene sum_i G_ij = A_j; in an open one what leaves and what falls on backs is added.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::form_factors::Row;
use crate::mesh::{Mesh, PatchId};

/// Rows among which pairs are looked at, those of the patches that shot most: a quarter of a million values at most.
pub(super) const MAX_ROWS: usize = 512;
/// Pairs of a smaller form factor, of the smaller patch to the larger one, do not count for the largest error.
const MIN_FACTOR: f64 = 1e-3;

/// How far A_i F_ij is from A_j F_ji, over the pairs of patches whose rows are both kept (of at most 512 patches).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReciprocityError {
    /// Pairs that see each other.
    pub n_pairs: u64,
    /// Root mean square of the relative difference, weighted by what the pair exchanges.
    pub rms: f64,
    /// Largest relative difference of a pair with a form factor over 0.001.
    pub max: f64,
}

/// Compares the two rows of every pair.
pub(super) fn reciprocity(mesh: &Mesh, rows: &[(PatchId, &Row)]) -> ReciprocityError {
    let n = rows.len();
    let mut place = vec![u32::MAX; mesh.patches.len()];
    for (i, (patch, _)) in rows.iter().enumerate() {
        place[patch.0 as usize] = i as u32;
    }
    let exchange: Vec<Vec<f64>> = rows
        .par_iter()
        .map(|(_, row)| {
            let mut of_row = vec![0.0; n];
            row.elements.for_each(|e, factor| {
                let element = &mesh.elements[e];
                if let Some(sum) = of_row.get_mut(place[element.patch.0 as usize] as usize) {
                    *sum += element.area_m2 * factor;
                }
            });
            of_row
        })
        .collect();
    let area_m2 = |i: usize| mesh.patches[rows[i].0.0 as usize].area_m2;
    let (mut error, mut squares, mut weights) = (ReciprocityError::default(), 0.0, 0.0);
    for (i, of_row) in exchange.iter().enumerate() {
        for (j, there) in of_row.iter().enumerate().skip(i + 1) {
            let mean = 0.5 * (there + exchange[j][i]);
            if mean > 0.0 {
                let relative = (there - exchange[j][i]).abs() / mean;
                error.n_pairs += 1;
                squares += mean * relative * relative;
                weights += mean;
                if mean > MIN_FACTOR * area_m2(i).min(area_m2(j)) {
                    error.max = error.max.max(relative);
                }
            }
        }
    }
    error.rms = if weights > 0.0 { (squares / weights).sqrt() } else { 0.0 };
    error
}
