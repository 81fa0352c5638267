//! The emulated board behind the port: quantises the scene once, every query per ray, and keeps the board's counts
//! by purpose.
//!
//! ```text
//! Query --quantized.rs--> RayWords | BundleWords --rtl_model::board::Board, cycle by cycle--> HitWords | bits
//! BoardCaster --observed(CommandSink)--> ObservedBoard: the same answers, every event told to the sink
//! ```
//! Rays go down as they come: explicit rays as records, bundles as descriptors that the board expands itself. A query of
//! many rays is several commands.

use std::collections::BTreeMap;

use glam::DVec3;
use rtl_model::board::{Board, BoardError, Work};
use rtl_model::datapath::HitWords;
use rtl_model::sim::{Directory, Event};
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

/// One query's way through a watched board.
struct Watched<'a> {
    board: &'a mut Board,
    sink: &'a mut dyn CommandSink,
    purpose: Purpose,
}

impl Watched<'_> {
    fn begin(&mut self, work: Work<'_>) {
        let n_rays = match work {
            Work::Rays(rays) => rays.len(),
            Work::Bundles(bundles) => {
                bundles.iter().map(rtl_model::datapath::bundle::BundleWords::n_rays).sum()
            }
        };
        if n_rays > 0 {
            self.sink.command(self.purpose, n_rays as u64);
        }
    }
}

impl Tracer for Watched<'_> {
    fn trace_nearest(&mut self, work: Work<'_>) -> Result<Vec<Option<HitWords>>, BoardError> {
        self.begin(work);
        let sink = &mut *self.sink;
        self.board.trace_nearest_observed(work, &mut |events| sink.events(events))
    }

    fn trace_any(&mut self, work: Work<'_>) -> Result<Vec<bool>, BoardError> {
        self.begin(work);
        let sink = &mut *self.sink;
        self.board.trace_any_observed(work, &mut |events| sink.events(events))
    }
}

impl RayCaster for ObservedBoard<'_> {
    fn name(&self) -> &'static str {
        self.caster.name()
    }

    fn closest_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<Option<RayHit>>, CastError> {
        let sink = &mut *self.sink;
        let hits = self.caster.booked(purpose, |quantizer, board| {
            quantized::closest_hits(quantizer, &mut Watched { board, sink, purpose }, query)
        })?;
        self.sink.answered(self.caster.board.clocked_cycles())?;
        Ok(hits)
    }

    fn any_hits(&mut self, purpose: Purpose, query: Query<'_>) -> Result<Vec<bool>, CastError> {
        let sink = &mut *self.sink;
        let hits = self.caster.booked(purpose, |quantizer, board| {
            quantized::any_hits(quantizer, &mut Watched { board, sink, purpose }, query)
        })?;
        self.sink.answered(self.caster.board.clocked_cycles())?;
        Ok(hits)
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
