//! The emulated board behind the port: quantises the scene once, every query per ray, and keeps the board's counts
//! by purpose.
//!
//! ```text
//! Query --quantized.rs--> RayWords | BundleWords --rtl_model::board::Board, cycle by cycle--> HitWords | bits
//! ```
//! Rays go down as they come: explicit rays as records, bundles as descriptors that the board expands itself.

use std::collections::BTreeMap;

use glam::DVec3;
use rtl_model::board::{Board, BoardError, Work};
use rtl_model::datapath::HitWords;
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use super::quantize::Quantizer;
use super::quantized::{self, Tracer};
use super::{CastError, CastPatch, Purpose, Query, RayCaster, RayHit};

/// Casts rays on the emulated board.
#[derive(Debug)]
pub struct BoardCaster {
    quantizer: Quantizer,
    board: Board,
    by_purpose: BTreeMap<Purpose, BoardStatistics>,
}

impl Tracer for Board {
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        Board::trace_nearest(self, work)
    }

    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        Board::trace_any(self, work)
    }
}

impl BoardCaster {
    /// Quantises the scene and loads it into the board. `extra_points` (m): camera, lights, probes.
    ///
    /// # Errors
    /// [`CastError::Board`] when the scene has no board numbers, the specification is unusable or the patch memory
    /// too small.
    pub fn new(
        spec: &BoardSpec,
        patches: &[CastPatch],
        extra_points: &[DVec3],
    ) -> Result<BoardCaster, CastError> {
        let (quantizer, image) = quantized::load(spec, patches, extra_points)?;
        let board = Board::new(spec, image).map_err(|e| CastError::Board(e.to_string()))?;
        Ok(BoardCaster { quantizer, board, by_purpose: BTreeMap::new() })
    }

    /// Scene space to words.
    pub fn quantizer(&self) -> &Quantizer {
        &self.quantizer
    }

    /// The board itself.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// What the board counted for each purpose that rays were cast for, in the order of [`Purpose`].
    pub fn statistics(&self) -> Vec<(Purpose, BoardStatistics)> {
        self.by_purpose.iter().map(|(p, s)| (*p, s.clone())).collect()
    }

    /// Runs `work` and books what the board counted meanwhile.
    fn booked<T>(
        &mut self,
        purpose: Purpose,
        work: impl FnOnce(&Quantizer, &mut Board) -> Result<T, CastError>,
    ) -> Result<T, CastError> {
        let before = self.board.statistics();
        let answer = work(&self.quantizer, &mut self.board);
        let spent = self.board.statistics().since(&before);
        let sum = match self.by_purpose.get(&purpose) {
            Some(earlier) => earlier.plus(&spent),
            None => spent,
        };
        self.by_purpose.insert(purpose, sum);
        answer
    }
}

impl RayCaster for BoardCaster {
    fn name(&self) -> &'static str {
        "board"
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.booked(purpose, |quantizer, board| quantized::closest_hits(quantizer, board, query))
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.booked(purpose, |quantizer, board| quantized::any_hits(quantizer, board, query))
    }

    fn surface_offset_m(&self) -> f64 {
        self.quantizer.surface_offset_m()
    }
}
