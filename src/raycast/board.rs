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
use rtl_model::record::RecordedCommand;
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
    /// The commands so far, when they are to be recorded.
    recorded: Option<Vec<PurposeCommand>>,
}

/// A recorded command, and what its rays were cast for.
pub type PurposeCommand = (Purpose, RecordedCommand);

/// The board, recording as it runs.
struct Recording<'a> {
    board: &'a mut Board,
    purpose: Purpose,
    commands: &'a mut Vec<PurposeCommand>,
}

impl Tracer for Recording<'_> {
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        let (hits, command) = self.board.record_nearest(work)?;
        self.commands.push((self.purpose, command));
        Ok(hits)
    }

    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        let (hits, command) = self.board.record_any(work)?;
        self.commands.push((self.purpose, command));
        Ok(hits)
    }
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
        Ok(BoardCaster { quantizer, board, by_purpose: BTreeMap::new(), recorded: None })
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

    /// From here on every command is recorded.
    pub fn record(&mut self) {
        self.recorded.get_or_insert_with(Vec::new);
    }

    /// The commands recorded since [`BoardCaster::record`] or since they were taken last.
    pub fn take_recorded(&mut self) -> Vec<PurposeCommand> {
        self.recorded.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Runs recorded commands, without their rays; `progress` gets the share that is done.
    ///
    /// # Errors
    /// [`CastError::Board`] when a command is not one of this scene and partition.
    pub fn replay(
        &mut self,
        commands: &[PurposeCommand],
        progress: &mut dyn FnMut(f64),
    ) -> Result<(), CastError> {
        for (done, (purpose, command)) in commands.iter().enumerate() {
            self.booked(*purpose, |_, board| {
                board.replay(command).map_err(|e| CastError::Board(format!("command {done}: {e}")))
            })?;
            progress((done + 1) as f64 / commands.len() as f64);
        }
        Ok(())
    }

    /// Runs commands as they are, and counts nothing of them by purpose.
    pub fn board_mut(&mut self) -> &mut Board {
        &mut self.board
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
        let mut recorded = self.recorded.take();
        let answer = self.booked(purpose, |quantizer, board| match &mut recorded {
            Some(commands) => {
                quantized::closest_hits(quantizer, &mut Recording { board, purpose, commands }, query)
            }
            None => quantized::closest_hits(quantizer, board, query),
        });
        self.recorded = recorded;
        answer
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        let mut recorded = self.recorded.take();
        let answer = self.booked(purpose, |quantizer, board| match &mut recorded {
            Some(commands) => {
                quantized::any_hits(quantizer, &mut Recording { board, purpose, commands }, query)
            }
            None => quantized::any_hits(quantizer, board, query),
        });
        self.recorded = recorded;
        answer
    }

    fn surface_offset_m(&self) -> f64 {
        self.quantizer.surface_offset_m()
    }
}
