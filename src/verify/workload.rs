//! Which rays are verified: the wanted number, shared among the purposes.
//!
//! ```text
//! Recordings by purpose, wanted rays --equal quotas, what one cannot use goes to the others--> groups by purpose
//! ```

use std::collections::BTreeMap;

use super::PurposeRays;
use crate::raycast::Purpose;
use crate::raycast::recording::{RecordedGroup, Recording};

/// Shares `n` among takers that can use at most `available` each: equal shares, and what one cannot use goes to the
/// others. The sum is the smaller of `n` and the sum of `available`.
pub fn quotas(n: u64, available: &[u64]) -> Vec<u64> {
    let mut order: Vec<usize> = (0..available.len()).collect();
    order.sort_by_key(|&i| available[i]);
    let mut quotas = vec![0; available.len()];
    let mut left = n;
    for (served, &i) in order.iter().enumerate() {
        quotas[i] = available[i].min(left / (order.len() - served) as u64);
        left -= quotas[i];
    }
    quotas
}

/// The groups to verify, `n_rays` rays in all, by purpose.
pub fn chosen(
    recordings: BTreeMap<Purpose, Recording>,
    n_rays: u64,
) -> Vec<(PurposeRays, Vec<RecordedGroup>)> {
    let available: Vec<u64> = recordings.values().map(Recording::n_kept_rays).collect();
    let shares = quotas(n_rays, &available);
    let of_purpose = |((purpose, recording), quota): ((Purpose, Recording), u64)| {
        let cast = recording.cast;
        let groups = recording.choose(quota);
        let verified = groups.iter().map(|group| group.take as u64).sum();
        (PurposeRays { purpose, cast, verified }, groups)
    };
    recordings.into_iter().zip(shares).map(of_purpose).collect()
}
