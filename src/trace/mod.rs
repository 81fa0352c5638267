//! Looking inside a run of the board: its events to files, and to accounts of rays and stalls.
//!
//! ```text
//! BoardCaster --events--> Watch --radlog.rs--> FILE.radlog --replay--> Watch
//!                           | Decoder: (cycle, Seen)
//!                           |--fst.rs------> FILE.fst, a waveform           |  in a window of
//!                           |--perfetto.rs-> FILE.json, slices              |  cycles (window.rs)
//!                           `--rtl_model::observe--> lives, roots, intervals --> Observed --> report
//! ```
//! Cycles are those in which the board is clocked: the host's side of interrupts, which a run's account counts, is not
//! among them. Rays have numbers, from 0, in the order in which they were cast. Files are written beside their places and
//! handed over to be put in place together with all others.

mod choice;
mod fst;
mod perfetto;
mod radlog;
mod window;

pub use choice::{Choice, Chosen};
pub use fst::Wave;
pub use perfetto::{MAX_SLICES, Slices};
pub use radlog::{CommandFact, Header, RadlogError, Reader, Trailer, Writer};
pub use window::{MAX_CYCLES, Window};

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;
use rtl_model::observe::{Decoder, Intervals, Lives, Places, Roots, Seen, StreamError};
use rtl_model::sim::{CommandMark, Cycle, Directory, Event};
use serde::{Deserialize, Serialize};

use crate::raycast::board::CommandSink;
use crate::raycast::{CastError, Purpose};

/// Most intervals, unless it is forced.
pub const MAX_INTERVALS: usize = 100_000;

/// Why a run could not be watched.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// A window or choice that the run has not.
    #[error("{0}")]
    Window(String),
    /// Events that no board tells.
    #[error("{0}")]
    Stream(#[from] StreamError),
    /// A log that cannot be written or read.
    #[error("{0}")]
    Radlog(#[from] RadlogError),
    /// A file that cannot be written.
    #[error("{0}")]
    Write(#[from] std::io::Error),
    /// One of the above, at a file.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<TraceError>,
    },
}

impl TraceError {
    fn at(self, path: &Path) -> TraceError {
        match self {
            TraceError::Window(_) | TraceError::File { .. } => self,
            other => TraceError::File { path: path.to_owned(), source: Box::new(other) },
        }
    }
}

/// The picture whose camera rays are cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Camera rays a pixel.
    pub samples: u32,
}

/// What is watched.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WatchOptions {
    /// Event log to write.
    pub log: Option<PathBuf>,
    /// Waveform to write.
    pub wave: Option<PathBuf>,
    /// Slices to write.
    pub slices: Option<PathBuf>,
    /// Cycles of waveform and slices.
    pub window: Window,
    /// Phases of all rays and roots of stalls.
    pub account: bool,
    /// Cycles of an interval of utilisation over time.
    pub interval: Option<u64>,
    /// Rays whose lives are told.
    pub rays: Choice,
    /// No limits.
    pub force: bool,
}

/// What is known of a run before it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Name of the board's specification.
    pub board: String,
    /// Its clock (MHz).
    pub clock_mhz: f64,
    /// What is traced.
    pub workload: String,
    /// The scene file.
    pub scene: Option<PathBuf>,
    /// The picture whose camera rays are among the rays.
    pub picture: Option<Picture>,
}

/// Output of one kind, with its place.
struct At<T> {
    path: PathBuf,
    to: T,
}

type File = BufWriter<AtomicWriteFile>;

/// Watches a run.
pub struct Watch {
    options: WatchOptions,
    about: About,
    commands: Vec<CommandFact>,
    chosen: Vec<Chosen>,
    /// Once the board is known.
    eyes: Option<Eyes>,
    fault: Option<TraceError>,
}

/// Everything that is told of events.
struct Eyes {
    places: Places,
    decoder: Decoder,
    /// End of the latest command.
    n_cycles: Cycle,
    n_events: u64,
    log: Option<At<Writer>>,
    wave: Option<At<Wave<File>>>,
    slices: Option<At<Slices<File>>>,
    lives: Option<Lives>,
    roots: Option<Roots>,
    intervals: Option<Intervals>,
}

/// What was seen.
#[derive(Debug)]
pub struct Observed {
    /// Blocks and links.
    pub places: Places,
    /// Events.
    pub n_events: u64,
    /// Cycles in which the board was clocked.
    pub n_cycles: Cycle,
    /// Commands in order.
    pub commands: Vec<CommandFact>,
    /// Lives of rays, where they were asked for.
    pub lives: Option<Lives>,
    /// Lives of all rays are to be told, not only those of the chosen.
    pub account: bool,
    /// Roots of stalls, where they were asked for.
    pub roots: Option<Roots>,
    /// Utilisation over time, where it was asked for.
    pub intervals: Option<Intervals>,
    /// The chosen rays, in order.
    pub chosen: Vec<Chosen>,
    /// Files, in the order log, waveform, slices.
    pub files: Vec<PathBuf>,
}

/// A written file that is not yet in its place.
pub type Pending = (PathBuf, AtomicWriteFile);

impl WatchOptions {
    /// True when anything is to be watched.
    pub fn is_on(&self) -> bool {
        self.files().next().is_some() || self.account || self.interval.is_some() || !self.rays.is_empty()
    }

    /// The files to be written.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        [&self.log, &self.wave, &self.slices].into_iter().flatten().map(PathBuf::as_path)
    }
}

impl Watch {
    /// A watch over a run that has not begun.
    ///
    /// # Errors
    /// A window over the limit; a pixel that the picture has not.
    pub fn new(options: WatchOptions, about: About) -> Result<Watch, TraceError> {
        options.window.check(options.force)?;
        let chosen = options.rays.resolve(about.picture)?;
        Ok(Watch { options, about, commands: Vec::new(), chosen, eyes: None, fault: None })
    }

    /// Ends the watch: what was seen, and the files that are to be put in place.
    ///
    /// # Errors
    /// The first thing that went wrong, now or before; a chosen ray that was not cast.
    pub fn finish(self) -> Result<(Observed, Vec<Pending>), TraceError> {
        let Watch { options, commands, mut chosen, eyes, fault, .. } = self;
        if let Some(fault) = fault {
            return Err(fault);
        }
        let Some(eyes) = eyes else {
            return Err(TraceError::Window("no ray was cast on the board".to_owned()));
        };
        choice::check_all_cast(&chosen, &commands)?;
        let kept = eyes.lives.as_ref().map(Lives::kept).unwrap_or_default();
        chosen.iter_mut().for_each(|ray| ray.find_life(kept));
        let mut files = Vec::new();
        if let Some(At { path, to }) = eyes.log {
            let file = to.finish(commands.clone()).map_err(|e| TraceError::from(e).at(&path))?;
            files.push((path, file));
        }
        let into_file = |buffered: File| buffered.into_inner().map_err(|e| TraceError::Write(e.into_error()));
        if let Some(At { path, to }) = eyes.wave {
            let file = to.finish(eyes.n_cycles).and_then(into_file).map_err(|e| e.at(&path))?;
            files.push((path, file));
        }
        if let Some(At { path, to }) = eyes.slices {
            let lives: Vec<_> = chosen.iter().filter_map(|ray| ray.life.clone()).collect();
            let file = to.finish(eyes.n_cycles, &lives).and_then(into_file).map_err(|e| e.at(&path))?;
            files.push((path, file));
        }
        let observed = Observed {
            places: eyes.places,
            n_events: eyes.n_events,
            n_cycles: eyes.n_cycles,
            commands,
            lives: eyes.lives,
            account: options.account,
            roots: eyes.roots,
            intervals: eyes.intervals,
            chosen,
            files: files.iter().map(|(path, _)| path.clone()).collect(),
        };
        Ok((observed, files))
    }

    /// Keeps the first fault.
    fn keep<T>(&mut self, result: Result<T, TraceError>) -> Option<T> {
        result.map_err(|fault| self.fault.get_or_insert(fault)).ok()
    }
}

impl Eyes {
    fn new(directory: Directory, options: &WatchOptions, about: &About) -> Result<Eyes, TraceError> {
        let places = Places::new(&directory)?;
        let open =
            |path: &Path| -> Result<File, TraceError> { Ok(BufWriter::new(AtomicWriteFile::open(path)?)) };
        let log = match &options.log {
            None => None,
            Some(path) => {
                let header = Header {
                    board: about.board.clone(),
                    clock_mhz: about.clock_mhz,
                    workload: about.workload.clone(),
                    scene: about.scene.clone(),
                    picture: about.picture,
                    directory,
                };
                let to = Writer::create(path, &header).map_err(|e| TraceError::from(e).at(path))?;
                Some(At { path: path.clone(), to })
            }
        };
        let (board, clock_mhz) = (about.board.as_str(), about.clock_mhz);
        let wave = options.wave.as_ref().map(|path| {
            let wave = open(path)
                .and_then(|file| Wave::new(file, &places, board, clock_mhz, options.window, options.force));
            wave.map(|to| At { path: path.clone(), to }).map_err(|e| e.at(path))
        });
        let slices = options.slices.as_ref().map(|path| {
            let slices = open(path)
                .and_then(|file| Slices::new(file, &places, board, clock_mhz, options.window, options.force));
            slices.map(|to| At { path: path.clone(), to }).map_err(|e| e.at(path))
        });
        let limit = if options.force { usize::MAX } else { MAX_INTERVALS };
        Ok(Eyes {
            decoder: Decoder::new(&places),
            n_cycles: 0,
            n_events: 0,
            log,
            wave: wave.transpose()?,
            slices: slices.transpose()?,
            lives: (options.account || !options.rays.is_empty()).then(|| Lives::new(&places)),
            roots: options.account.then(|| Roots::new(&places)),
            intervals: options.interval.map(|length| Intervals::new(&places, length, limit)),
            places,
        })
    }

    fn see(&mut self, events: &[Event]) -> Result<(), TraceError> {
        self.n_events += events.len() as u64;
        if let Some(At { path, to }) = &mut self.log {
            to.events(events).map_err(|e| TraceError::from(e).at(path))?;
        }
        let is_log_only = self.wave.is_none()
            && self.slices.is_none()
            && self.lives.is_none()
            && self.roots.is_none()
            && self.intervals.is_none();
        if is_log_only {
            return Ok(());
        }
        for event in events {
            let Some((now, seen)) = self.decoder.read(*event)? else { continue };
            if seen == Seen::Command(CommandMark::End) {
                self.n_cycles = now;
            }
            if let Some(lives) = &mut self.lives {
                lives.see(now, &seen)?;
            }
            if let Some(roots) = &mut self.roots {
                roots.see(now, &seen)?;
            }
            if let Some(intervals) = &mut self.intervals {
                intervals.see(now, &seen)?;
            }
            if let Some(At { path, to }) = &mut self.wave {
                to.see(now, &seen).map_err(|e| e.at(path))?;
            }
            if let Some(At { path, to }) = &mut self.slices {
                to.see(now, &seen).map_err(|e| e.at(path))?;
            }
        }
        Ok(())
    }
}

impl CommandSink for Watch {
    fn board(&mut self, directory: Directory) -> Result<(), CastError> {
        let eyes = Eyes::new(directory, &self.options, &self.about);
        self.eyes = self.keep(eyes);
        self.answered(0)
    }

    fn command(&mut self, purpose: Purpose, n_rays: u64) {
        let number = self.commands.len() as u32;
        if let Some(lives) = self.eyes.as_mut().and_then(|eyes| eyes.lives.as_mut()) {
            for ray in &mut self.chosen {
                if let Some(ray) = ray.look_in(number, purpose, n_rays) {
                    lives.ask(number, ray);
                }
            }
        }
        self.commands.push(CommandFact { purpose, rays: n_rays });
    }

    fn events(&mut self, events: &[Event]) {
        if self.fault.is_none()
            && let Some(eyes) = &mut self.eyes
        {
            let seen = eyes.see(events);
            self.keep(seen);
        }
    }

    fn answered(&mut self, clocked_cycles: u64) -> Result<(), CastError> {
        if let Some(eyes) = &mut self.eyes {
            eyes.n_cycles = clocked_cycles;
        }
        match &self.fault {
            None => Ok(()),
            Some(fault) => Err(CastError::Watcher(fault.to_string())),
        }
    }
}

/// Watches a run again, from its log.
///
/// # Errors
/// A log that is damaged or tells what no board tells; whatever the watch finds wrong.
pub fn replay(mut log: Reader, options: WatchOptions) -> Result<(Observed, Vec<Pending>), TraceError> {
    let Header { board, clock_mhz, workload, scene, picture, directory } = log.header().clone();
    let about = About { board, clock_mhz, workload, scene, picture };
    let mut watch = Watch::new(options, about)?;
    let eyes = Eyes::new(directory, &watch.options, &watch.about)?;
    watch.eyes = Some(eyes);
    for CommandFact { purpose, rays } in log.trailer().commands.clone() {
        watch.command(purpose, rays);
    }
    while let Some(events) = log.next_chunk()? {
        watch.events(events);
        if watch.fault.is_some() {
            break;
        }
    }
    watch.finish()
}

#[cfg(test)]
mod tests;
