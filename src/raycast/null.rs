//! A caster without a scene: every ray misses. Tests of the port and the bound of a free caster.

use super::{CastError, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::mesh::PatchId;

/// Every ray misses.
#[derive(Clone, Copy, Debug, Default)]
pub struct NullCaster;

impl RayCaster for NullCaster {
    fn name(&self) -> &'static str {
        "null"
    }

    fn closest_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        Ok(vec![None; query.n_rays()])
    }

    fn any_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        Ok(vec![false; query.n_rays()])
    }

    fn blocked_by(&self, _: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        vec![0; tests.len()]
    }

    fn surface_offset_m(&self) -> f64 {
        0.0
    }
}
