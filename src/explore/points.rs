//! An outcome as a point of the store: status, error, parameters and metrics as JSON.

use std::collections::BTreeMap;

use super::evaluate::Extent;
use super::metric::METRICS;
use super::space::Space;
use super::store::StoredPoint;
use super::sweep::Outcome;
use super::value::Value;

/// The point of a combination, its parameters, its metrics.
pub(super) fn point_of(space: &Space, ordinal: u64, outcome: &Outcome) -> (StoredPoint, String, String) {
    let (status, error) = match outcome {
        Outcome::Known { extent: Extent::Whole, .. } => ("simulated", None),
        Outcome::Known { extent: Extent::Sample { .. }, .. } => ("sampled", None),
        Outcome::Known { extent: Extent::Rung(_), .. } => ("shortened", None),
        Outcome::Pruned => ("pruned", None),
        Outcome::Impossible(reason) => ("impossible", Some(reason.clone())),
        Outcome::Failed(error) => ("failed", Some(error.clone())),
    };
    let parameters: BTreeMap<&str, &Value> = space
        .axes
        .iter()
        .zip(space.choice(ordinal))
        .map(|(axis, place)| (axis.name.as_str(), &axis.values[place]))
        .collect();
    let metrics: BTreeMap<&str, f64> = match outcome {
        Outcome::Known { metrics, .. } => {
            METRICS.iter().zip(metrics).filter_map(|(metric, value)| Some((metric.name, (*value)?))).collect()
        }
        _ => BTreeMap::new(),
    };
    let json = |value: serde_json::Result<String>| {
        value.unwrap_or_else(|e| panic!("plain maps have a JSON form: {e}"))
    };
    (
        StoredPoint { ordinal, status: status.to_owned(), error },
        json(serde_json::to_string(&parameters)),
        json(serde_json::to_string(&metrics)),
    )
}
