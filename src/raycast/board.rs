//! The emulated board behind the port: quantises the scene once, every query per ray, and keeps the board's counts
//! by purpose.
//!
//! ```text
//! Query --quantized.rs--> RayWords | BundleWords --rtl_model::board::Board, cycle by cycle--> HitWords | bits
//! BoardCaster --observed(CommandSink)--> ObservedBoard: the same answers, every event told to the sink
//! ```
//! Rays go down as they come: explicit rays as records, bundles as descriptors that the board expands itself. A query of
//! many rays is several commands.
//! A warm-up leaves the first commands out of every count: those up to the first that ends at or after a given cycle.

use std::collections::BTreeMap;

use glam::DVec3;
use rtl_model::board::{Board, BoardError, Work};
use rtl_model::datapath::HitWords;
use rtl_model::record::RecordedCommand;
use rtl_model::sim::{Directory, Event, FifoStatistics};
use rtl_model::spec::BoardSpec;
use rtl_model::statistics::BoardStatistics;

use super::quantize::Quantizer;
use super::quantized::{self, Tracer};
use super::{CastError, CastPatch, Purpose, Query, RayBundle, RayCaster, RayHit};
use crate::mesh::PatchId;

/// Casts rays on the emulated board.
#[derive(Debug)]
pub struct BoardCaster {
    quantizer: Quantizer,
    board: Board,
    by_purpose: BTreeMap<Purpose, BoardStatistics>,
    warming: Warming,
    /// The commands so far, when they are to be recorded.
    recorded: Option<Vec<PurposeCommand>>,
}

/// A recorded command, and what its rays were cast for.
pub type PurposeCommand = (Purpose, RecordedCommand);

/// Commands that were left out of every count.
#[derive(Clone, Debug, PartialEq)]
pub struct WarmUp {
    /// Cycles that were asked for.
    pub asked_cycles: u64,
    /// What the board counted in it.
    pub excluded: BoardStatistics,
    /// What its queues counted in it.
    pub excluded_links: Vec<FifoStatistics>,
}

#[derive(Clone, Debug, Default)]
enum Warming {
    /// Everything counts.
    #[default]
    None,
    /// Until the first command that ends at or after this cycle.
    Until(u64),
    /// It is over.
    Over(Box<WarmUp>),
}

/// Who watches a board: is told its places, then of each command its purpose, its rays and its events.
pub trait CommandSink {
    /// The board's blocks and links.
    ///
    /// # Errors
    /// Why it will not watch.
    fn board(&mut self, directory: Directory) -> Result<(), CastError>;

    /// A command of `n_rays >= 1` rays begins.
    fn command(&mut self, purpose: Purpose, n_rays: u64);

    /// Its next events.
    fn events(&mut self, events: &[Event]);

    /// A query is answered, with one command or several; the board was clocked in `clocked_cycles` so far.
    ///
    /// # Errors
    /// Why it wants no more.
    fn answered(&mut self, clocked_cycles: u64) -> Result<(), CastError>;
}

/// A board caster, watched.
pub struct ObservedBoard<'a> {
    caster: &'a mut BoardCaster,
    sink: &'a mut dyn CommandSink,
}

/// One query's way through a board: who watches is told before and during every command, the warm-up looks after it.
struct Passage<'a, 's> {
    board: &'a mut Board,
    warming: &'a mut Warming,
    sink: Option<&'a mut (dyn CommandSink + 's)>,
    recorded: Option<&'a mut Vec<PurposeCommand>>,
    purpose: Purpose,
}

impl Passage<'_, '_> {
    fn begin(&mut self, work: Work<'_>) {
        let n_rays = match work {
            Work::Rays(rays) => rays.len(),
            Work::Bundles(bundles) => {
                bundles.iter().map(rtl_model::datapath::bundle::BundleWords::n_rays).sum()
            }
        };
        if let Some(sink) = self.sink.as_mut().filter(|_| n_rays > 0) {
            sink.command(self.purpose, n_rays as u64);
        }
    }

    fn end_warm_up(&mut self) {
        if let Warming::Until(asked_cycles) = *self.warming {
            let excluded = self.board.statistics();
            if excluded.cycles >= asked_cycles {
                let excluded_links = self.board.link_statistics();
                let warm_up = WarmUp { asked_cycles, excluded, excluded_links };
                *self.warming = Warming::Over(Box::new(warm_up));
            }
        }
    }
}

impl Tracer for Passage<'_, '_> {
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        self.begin(work);
        let hits = if let Some(sink) = &mut self.sink {
            self.board.trace_nearest_observed(work, &mut |events| sink.events(events))?
        } else if let Some(commands) = &mut self.recorded {
            let (hits, command) = self.board.record_nearest(work)?;
            commands.push((self.purpose, command));
            hits
        } else {
            self.board.trace_nearest(work)?
        };
        self.end_warm_up();
        Ok(hits)
    }

    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        self.begin(work);
        let hits = if let Some(sink) = &mut self.sink {
            self.board.trace_any_observed(work, &mut |events| sink.events(events))?
        } else if let Some(commands) = &mut self.recorded {
            let (hits, command) = self.board.record_any(work)?;
            commands.push((self.purpose, command));
            hits
        } else {
            self.board.trace_any(work)?
        };
        self.end_warm_up();
        Ok(hits)
    }
}

impl RayCaster for ObservedBoard<'_> {
    fn name(&self) -> &'static str {
        self.caster.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        let hits = self.caster.booked(purpose, Some(&mut *self.sink), |quantizer, board| {
            quantized::closest_hits(quantizer, board, query)
        })?;
        self.sink.answered(self.caster.board.clocked_cycles())?;
        Ok(hits)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        let hits = self.caster.booked(purpose, Some(&mut *self.sink), |quantizer, board| {
            quantized::any_hits(quantizer, board, query)
        })?;
        self.sink.answered(self.caster.board.clocked_cycles())?;
        Ok(hits)
    }

    fn blocked_by(&self, purpose: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        self.caster.blocked_by(purpose, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.caster.surface_offset_m()
    }
}

impl BoardCaster {
    /// The same caster, every event of its commands told to `sink`.
    ///
    /// # Errors
    /// When the sink will not watch this board.
    pub fn observed<'a>(&'a mut self, sink: &'a mut dyn CommandSink) -> Result<ObservedBoard<'a>, CastError> {
        sink.board(self.board.directory())?;
        Ok(ObservedBoard { caster: self, sink })
    }

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
        Ok(BoardCaster {
            quantizer,
            board,
            by_purpose: BTreeMap::new(),
            warming: Warming::None,
            recorded: None,
        })
    }

    /// Scene space to words.
    pub fn quantizer(&self) -> &Quantizer {
        &self.quantizer
    }

    /// The board itself.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// Leaves commands out of all counts, up to the first that ends at or after board cycle `cycles`.
    ///
    /// # Panics
    /// When rays were cast already.
    pub fn warm_up(&mut self, cycles: u64) {
        assert!(self.by_purpose.is_empty(), "a warm-up comes first");
        self.warming = if cycles == 0 { Warming::None } else { Warming::Until(cycles) };
    }

    /// What was left out; `None` without a warm-up, or while it lasts.
    pub fn warmed_up(&self) -> Option<&WarmUp> {
        match &self.warming {
            Warming::Over(warm_up) => Some(warm_up),
            Warming::None | Warming::Until(_) => None,
        }
    }

    /// What the board counted after its warm-up for each purpose that rays were cast for, in the order of [`Purpose`].
    pub fn statistics(&self) -> Vec<(Purpose, BoardStatistics)> {
        self.by_purpose.iter().map(|(p, s)| (*p, s.clone())).collect()
    }

    /// What the board's queues counted after its warm-up.
    pub fn link_statistics(&self) -> Vec<FifoStatistics> {
        let now = self.board.link_statistics();
        match self.warmed_up() {
            Some(warm_up) => {
                now.iter().zip(&warm_up.excluded_links).map(|(now, before)| now.since(before)).collect()
            }
            None => now,
        }
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
            self.booked(*purpose, None, |_, passage| {
                let replayed = passage.board.replay(command);
                replayed.map_err(|e| CastError::Board(format!("command {done}: {e}")))
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
        sink: Option<&mut dyn CommandSink>,
        work: impl FnOnce(&Quantizer, &mut Passage<'_, '_>) -> Result<T, CastError>,
    ) -> Result<T, CastError> {
        let mut before = self.board.statistics();
        let was_over = self.warmed_up().is_some();
        let (board, warming) = (&mut self.board, &mut self.warming);
        let mut passage = Passage { board, warming, sink, recorded: self.recorded.as_mut(), purpose };
        let answer = work(&self.quantizer, &mut passage);
        match &self.warming {
            Warming::Until(_) => return answer,
            Warming::Over(warm_up) if !was_over => before = warm_up.excluded.clone(),
            Warming::Over(_) | Warming::None => {}
        }
        let spent = self.board.statistics().since(&before);
        if spent.commands > 0 {
            let sum = match self.by_purpose.get(&purpose) {
                Some(earlier) => earlier.plus(&spent),
                None => spent,
            };
            self.by_purpose.insert(purpose, sum);
        }
        answer
    }
}

impl RayCaster for BoardCaster {
    fn name(&self) -> &'static str {
        "board"
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        self.booked(purpose, None, |quantizer, board| quantized::closest_hits(quantizer, board, query))
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        self.booked(purpose, None, |quantizer, board| quantized::any_hits(quantizer, board, query))
    }

    fn blocked_by(&self, _: Purpose, tests: &[(&RayBundle, PatchId)]) -> Vec<u64> {
        quantized::blocked_by(&self.quantizer, self.board.image(), &self.board.spec().formats, tests)
    }

    fn surface_offset_m(&self) -> f64 {
        self.quantizer.surface_offset_m()
    }
}
