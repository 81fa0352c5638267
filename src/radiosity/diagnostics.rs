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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::row::SparseRow;
    use crate::radiosity::tests::{grey, room, scene};
    use glam::DVec3;

    #[test]
    fn reciprocity_of_rows_by_hand_is_the_weighted_difference_of_their_exchanges() {
        let mesh = Mesh::build(&scene(vec![grey("half", 0.5)], room(DVec3::ONE, 0.0), vec![], 24));
        let row = |to: usize, factor: f32| {
            let mut dense = vec![0.0; mesh.elements.len()];
            for e in mesh.patches[to].elements.clone() {
                dense[e as usize] = factor;
            }
            Row { elements: SparseRow::pack(&dense), ..Row::default() }
        };
        // Patches of equal area A: they exchange 0.2 A one way and 0.25 A the other.
        let (a, b) = (row(1, 0.25), row(0, 0.2));
        let error = reciprocity(&mesh, &[(PatchId(0), &a), (PatchId(1), &b)]);
        let expected = 0.05 / 0.225;
        assert_eq!(error.n_pairs, 1);
        assert!(
            (error.rms / expected - 1.0).abs() < 1e-6 && (error.max / expected - 1.0).abs() < 1e-6,
            "{error:?}"
        );
        // One side that sees nothing: the largest difference that there can be, twice the mean.
        let blind = row(0, 0.0);
        let error = reciprocity(&mesh, &[(PatchId(0), &a), (PatchId(1), &blind)]);
        assert!((error.rms - 2.0).abs() < 1e-6, "{error:?}");
        assert_eq!(reciprocity(&mesh, &[(PatchId(0), &a)]), ReciprocityError::default());
    }
}
