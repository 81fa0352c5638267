//! Which caster answers: a choice, the caster made from it, and a router by purpose.
//!
//! ```text
//! CasterChoice + patches --> Caster::{Software, Board} --port()--> dyn RayCaster
//! RoutedCaster: rays of one purpose --> one caster, all others --> another
//! ```

use rtl_model::sim::FifoStatistics;
use rtl_model::spec::BoardSpec;
use serde::{Deserialize, Serialize};

use super::StatisticsByPurpose;
use crate::geom::DVec3;
use crate::mesh::PatchId;
use crate::raycast::board::BoardCaster;
use crate::raycast::software::SoftwareCaster;
use crate::raycast::{CastError, CastPatch, Purpose, Query, RayBundle, RayCaster, RayHit};

/// Who answers the rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CasterChoice {
    /// The software caster.
    Software,
    /// The emulated board.
    Board(Box<BoardSpec>),
}

impl CasterChoice {
    /// Its name in reports: that of the caster.
    pub fn name(&self) -> &'static str {
        match self {
            CasterChoice::Software => "software",
            CasterChoice::Board(_) => "board",
        }
    }

    /// All that its answers can depend on, in few words.
    pub fn identity(&self) -> String {
        match self {
            CasterChoice::Software => "software".to_owned(),
            CasterChoice::Board(spec) => {
                let crc = crc32fast::hash(&crate::framed_file::encode(spec));
                format!("board {} (specification {crc:08x})", spec.name)
            }
        }
    }
}

/// A caster with a scene loaded.
#[derive(Debug)]
pub enum Caster {
    /// The software caster.
    Software(SoftwareCaster),
    /// The emulated board.
    Board(Box<BoardCaster>),
}

impl Caster {
    /// Loads `patches`; `points` are places outside the surfaces where rays start.
    ///
    /// # Errors
    /// A scene that the board cannot take.
    pub fn new(
        choice: &CasterChoice,
        patches: Vec<CastPatch>,
        points: &[DVec3],
    ) -> Result<Caster, CastError> {
        Ok(match choice {
            CasterChoice::Software => Caster::Software(SoftwareCaster::new(patches)),
            CasterChoice::Board(spec) => Caster::Board(Box::new(BoardCaster::new(spec, &patches, points)?)),
        })
    }

    /// Its port.
    pub fn port(&mut self) -> &mut dyn RayCaster {
        match self {
            Caster::Software(caster) => caster,
            Caster::Board(caster) => caster.as_mut(),
        }
    }

    /// Its name in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Caster::Software(caster) => caster.name(),
            Caster::Board(caster) => caster.name(),
        }
    }

    /// What the board counted so far; `None` for software.
    pub fn statistics(&self) -> Option<StatisticsByPurpose> {
        match self {
            Caster::Software(_) => None,
            Caster::Board(caster) => Some(caster.statistics()),
        }
    }

    /// What the board's queues counted so far; none for software.
    pub fn link_statistics(&self) -> Vec<FifoStatistics> {
        match self {
            Caster::Software(_) => Vec::new(),
            Caster::Board(caster) => caster.link_statistics(),
        }
    }
}

/// Sends rays of one purpose to one caster and all others to another.
pub struct RoutedCaster<'a> {
    purpose: Purpose,
    chosen: &'a mut dyn RayCaster,
    others: &'a mut dyn RayCaster,
}

impl<'a> RoutedCaster<'a> {
    /// Rays for `purpose` go to `chosen`, the rest to `others`.
    pub fn new(
        purpose: Purpose,
        chosen: &'a mut dyn RayCaster,
        others: &'a mut dyn RayCaster,
    ) -> RoutedCaster<'a> {
        RoutedCaster { purpose, chosen, others }
    }

    fn route(&mut self, purpose: Purpose) -> &mut dyn RayCaster {
        if purpose == self.purpose { self.chosen } else { self.others }
    }
}

impl RayCaster for RoutedCaster<'_> {
    fn name(&self) -> &'static str {
        self.chosen.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.route(purpose).closest_hits(purpose, query)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.route(purpose).any_hits(purpose, query)
    }

    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        let caster: &dyn RayCaster = if purpose == self.purpose { self.chosen } else { self.others };
        caster.blocked_by(purpose, tests)
    }

    /// The larger one: good for both.
    fn surface_offset_m(&self) -> f64 {
        self.chosen.surface_offset_m().max(self.others.surface_offset_m())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Ray;
    use crate::raycast::null::NullCaster;

    /// Counts the rays that it is asked for and answers that all are blocked.
    #[derive(Default)]
    struct Counting {
        n_rays: usize,
    }

    impl RayCaster for Counting {
        fn name(&self) -> &'static str {
            "counting"
        }
        fn closest_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
            self.n_rays += query.n_rays();
            Ok(vec![None; query.n_rays()])
        }
        fn any_hits(&mut self, _: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
            self.n_rays += query.n_rays();
            Ok(vec![true; query.n_rays()])
        }
        fn blocked_by(&self, _: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
            vec![0; tests.len()]
        }
        fn surface_offset_m(&self) -> f64 {
            0.25
        }
    }

    #[test]
    fn routed_caster_sends_only_its_purpose_to_the_chosen_one() {
        let (mut chosen, mut others) = (Counting::default(), NullCaster);
        let mut routed = RoutedCaster::new(Purpose::Shadow, &mut chosen, &mut others);
        let rays = [Ray::unbounded(DVec3::ZERO, DVec3::X); 3];
        assert_eq!(routed.any_hits(Purpose::Shadow, Query::Rays(&rays)).unwrap(), [true; 3]);
        assert_eq!(routed.any_hits(Purpose::FormFactor, Query::Rays(&rays)).unwrap(), [false; 3]);
        assert_eq!(routed.closest_hits(Purpose::Primary, Query::Rays(&rays)).unwrap(), [None; 3]);
        assert_eq!(routed.surface_offset_m(), 0.25);
        assert_eq!(chosen.n_rays, 3);
    }
}
