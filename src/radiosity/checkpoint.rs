//! The state of a running solve on disk, now and then: a solve that is killed goes on from it, to the same bits.
//!
//! ```text
//! State --every N seconds, and when asked to stop--> DIR/solve.radchk --the same command again--> State
//! frame of framed_file.rs, magic "RADCHK\r\n"; sections
//!   OFWH   what it belongs to: mesh, lighting, options, start, caster     -> Key
//!   TREE   how the patches are cut into elements                          -> Subdivision
//!   STAT   the state between two steps                                    -> State
//! ```
//! A checkpoint is written beside the last one and takes its place by one rename, flushed to the disk first: there is a whole
//! one at any moment. When it is written changes nothing of the result: a step depends on the state alone, and rows of
//! form factors, which are not in it, are the same rays cast again, not counted twice.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use atomic_write_file::AtomicWriteFile;
use serde::{Deserialize, Serialize};

use super::lighting::Lighting;
use super::solution_file::geometry_hash;
use super::state::State;
use super::{SolveOptions, Start};
use crate::framed_file::{FramedFileError, Kind, encode, put_section};
use crate::mesh::{Mesh, Subdivision};
use crate::scene::Scene;

/// The kind of these files.
const KIND: Kind =
    Kind { magic: *b"RADCHK\r\n", version: 3, name: "a checkpoint of a solve", sectioned: true };
/// Name of the file in its folder, and of the one that a running solve holds locked.
const NAME: &str = "solve.radchk";
const LOCK: &str = "solve.lock";
/// Room beside the lists of a state: shooters' records and framing.
const SPARE_BYTES: u64 = 1 << 16;

/// Why a checkpoint was not written or is of no use.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The folder cannot be used.
    #[error("--checkpoint {}: {what}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        what: String,
    },
    /// The folder cannot take a file of that size.
    #[error("--checkpoint {}: a checkpoint of this solve takes {n_bytes} bytes, which cannot be written there: {error}", path.display())]
    Space {
        /// The folder.
        path: PathBuf,
        /// Size of a checkpoint.
        n_bytes: u64,
        /// What the system said.
        #[source]
        error: io::Error,
    },
    /// It cannot be read or written.
    #[error(transparent)]
    File(#[from] FramedFileError),
    /// It is one of another solve.
    #[error("{}: a checkpoint of another solve: {what}; name another folder, or remove the file to begin anew", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        what: String,
    },
    /// The solve was asked to stop.
    #[error("stopped after {n_shots} shots, as asked; the same command goes on from {}", path.display())]
    Stopped {
        /// The checkpoint.
        path: PathBuf,
        /// Shots so far.
        n_shots: usize,
    },
}

/// What a checkpoint belongs to.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Key {
    geometry_hash: u64,
    lighting: Lighting,
    options: SolveOptions,
    /// Of the solution that the solve goes on from.
    start_crc: Option<u32>,
    caster: String,
    /// Of the caster (m): it depends on all that is in the scene.
    surface_offset_m: f64,
}

/// Where and how often a solve's state is kept: given along with the solve, asked afterwards.
#[derive(Clone, Debug)]
pub struct Keeper {
    folder: PathBuf,
    every: Duration,
    stop: Arc<AtomicBool>,
    used: Arc<Mutex<Option<Checkpoint>>>,
}

impl Keeper {
    /// Keeps states in `folder`, one `every` so often; a solve ends when `stop` becomes true.
    pub fn new(folder: &Path, every: Duration, stop: Arc<AtomicBool>) -> Keeper {
        Keeper { folder: folder.to_path_buf(), every, stop, used: Arc::default() }
    }

    /// The checkpoint of a solve that begins; `caster` says in words what the answers to rays depend on.
    ///
    /// # Errors
    /// As [`Checkpoint::open`].
    pub fn open(&self, caster: String) -> Result<Checkpoint, CheckpointError> {
        Checkpoint::open(&self.folder, self.every, self.stop.clone(), caster)
    }

    /// Takes back the checkpoint of a solve that ended: who is asked to stop from now on need not wait for its next step.
    pub fn put_back(&self, checkpoint: Checkpoint) {
        self.stop.store(true, Ordering::Relaxed);
        *self.lock() = Some(checkpoint);
    }

    /// Removes the checkpoint when all is written that the solve was for; what the user should know of it.
    pub fn finish(&self) -> Vec<String> {
        let Some(checkpoint) = self.lock().take() else { return Vec::new() };
        let trouble = checkpoint.trouble.clone();
        checkpoint.remove();
        trouble.into_iter().collect()
    }

    fn lock(&self) -> MutexGuard<'_, Option<Checkpoint>> {
        // A panic elsewhere leaves nothing half done in here.
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PartialEq for Keeper {
    fn eq(&self, other: &Keeper) -> bool {
        (&self.folder, self.every) == (&other.folder, other.every)
    }
}

/// Keeps a solve's state in a folder.
#[derive(Debug)]
pub struct Checkpoint {
    folder: PathBuf,
    file: PathBuf,
    every: Duration,
    stop: Arc<AtomicBool>,
    caster: String,
    /// Once the solve began.
    key: Option<Key>,
    subdivision: Option<Subdivision>,
    last: Instant,
    /// Shots at which the solve went on.
    resumed_at: Option<usize>,
    trouble: Option<String>,
    /// Held locked while this lives.
    _lock: File,
}

impl Checkpoint {
    /// Makes `folder` ready, which is made when only it is missing: every `every` of a solve's time its state is written there,
    /// and when `stop` becomes true, which ends the solve. `caster` says in words what the answers to rays depend on.
    ///
    /// # Errors
    /// A folder that cannot be used, or that another solve uses now.
    pub fn open(
        folder: &Path,
        every: Duration,
        stop: Arc<AtomicBool>,
        caster: String,
    ) -> Result<Checkpoint, CheckpointError> {
        let fault = |what: String| CheckpointError::Folder { path: folder.to_path_buf(), what };
        if !folder.is_dir() {
            fs::create_dir(folder).map_err(|e| fault(format!("the folder cannot be made: {e}")))?;
        }
        let lock = File::create(folder.join(LOCK)).map_err(|e| fault(format!("cannot write here: {e}")))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(fault("another solve is using this folder now".to_owned()));
            }
            Err(TryLockError::Error(e)) => return Err(fault(format!("cannot be locked: {e}"))),
        }
        remove_unfinished(folder);
        Ok(Checkpoint {
            folder: folder.to_path_buf(),
            file: folder.join(NAME),
            every,
            stop,
            caster,
            key: None,
            subdivision: None,
            last: Instant::now(),
            resumed_at: None,
            trouble: None,
            _lock: lock,
        })
    }

    /// The mesh of `scene` that the checkpoint is of, where there is one that cuts the patches of `mesh` otherwise: a solve
    /// that goes on does not refine again.
    ///
    /// # Errors
    /// A checkpoint that is damaged or cannot be read.
    pub fn remeshed(&self, scene: &Scene, mesh: &Mesh) -> Result<Option<Mesh>, CheckpointError> {
        if !self.file.exists() {
            return Ok(None);
        }
        let body = KIND.read(&self.file)?;
        let rest = &mut body.as_slice();
        let _: Key = KIND.section(&self.file, rest, *b"OFWH")?;
        let subdivision: Subdivision = KIND.section(&self.file, rest, *b"TREE")?;
        if subdivision.n_patches() as usize != mesh.patches.len() {
            return Ok(None);
        }
        let remeshed = Mesh::build_with(scene, &subdivision);
        Ok(Some(remeshed.map_err(|fault| KIND.fault(&self.file, format!("TREE: {fault}")))?))
    }

    /// The state to go on from, if there is one; else checks that there is room for one.
    pub(super) fn resume(
        &mut self,
        scene: &Scene,
        mesh: &Mesh,
        options: &SolveOptions,
        start: Start<'_>,
        surface_offset_m: f64,
    ) -> Result<Option<State>, CheckpointError> {
        let key = Key {
            geometry_hash: geometry_hash(scene, mesh),
            lighting: Lighting::of(scene),
            options: *options,
            start_crc: match start {
                Start::Anew => None,
                Start::From(stored) => Some(stored.crc()),
            },
            caster: self.caster.clone(),
            surface_offset_m,
        };
        self.last = Instant::now();
        self.subdivision = Some(mesh.subdivision());
        if !self.file.exists() {
            self.key = Some(key);
            self.try_room(mesh)?;
            return Ok(None);
        }
        let body = KIND.read(&self.file)?;
        let rest = &mut body.as_slice();
        let found: Key = KIND.section(&self.file, rest, *b"OFWH")?;
        if let Some(what) = found.difference(&key, scene) {
            return Err(CheckpointError::Other { path: self.file.clone(), what });
        }
        let _: Subdivision = KIND.section(&self.file, rest, *b"TREE")?;
        let state: State = KIND.section(&self.file, rest, *b"STAT")?;
        KIND.end(&self.file, rest)?;
        if !state.fits(mesh) {
            return Err(KIND.fault(&self.file, "its lists are not as long as the mesh's".to_owned()).into());
        }
        self.key = Some(key);
        self.resumed_at = Some(state.n_shots);
        Ok(Some(state))
    }

    /// After a step: writes the state when it is time to, and ends the solve when that was asked for.
    pub(super) fn after_step(&mut self, state: &State) -> Result<(), CheckpointError> {
        if self.stop.load(Ordering::Relaxed) {
            self.write(state)?;
            return Err(CheckpointError::Stopped { path: self.file.clone(), n_shots: state.n_shots });
        }
        if self.last.elapsed() >= self.every {
            // Hours of work do not end because the disk is full: the last checkpoint stays, and it is told.
            if let Err(error) = self.write(state) {
                self.trouble = Some(format!("a checkpoint could not be written: {error}"));
            }
            self.last = Instant::now();
        }
        Ok(())
    }

    fn write(&self, state: &State) -> Result<(), FramedFileError> {
        let mut body = Vec::new();
        let (Some(key), Some(subdivision)) = (&self.key, &self.subdivision) else { return Ok(()) };
        put_section(&mut body, *b"OFWH", key);
        put_section(&mut body, *b"TREE", subdivision);
        put_section(&mut body, *b"STAT", state);
        KIND.write(&self.file, &body)
    }

    /// Writes as many bytes as a checkpoint will have, and takes them away again.
    fn try_room(&self, mesh: &Mesh) -> Result<(), CheckpointError> {
        let n_bytes = State::n_bytes(mesh)
            + encode(&self.key).len() as u64
            + encode(&self.subdivision).len() as u64
            + SPARE_BYTES;
        let fill = || {
            let mut file = AtomicWriteFile::open(&self.file)?;
            let zeros = vec![0u8; 1 << 20];
            let mut left = n_bytes;
            while left > 0 {
                let n = left.min(zeros.len() as u64);
                file.write_all(&zeros[..n as usize])?;
                left -= n;
            }
            file.as_file().sync_all()?;
            file.discard()
        };
        fill().map_err(|error| CheckpointError::Space { path: self.folder.clone(), n_bytes, error })
    }

    /// Shots at which the solve went on, when it did.
    pub fn resumed_at(&self) -> Option<usize> {
        self.resumed_at
    }

    /// Removes the checkpoint: what it was for is done. What cannot be removed stays.
    pub fn remove(self) {
        let _ = fs::remove_file(&self.file);
        let _ = fs::remove_file(self.folder.join(LOCK));
    }
}

/// Removes what a write that was killed just before its rename left behind.
fn remove_unfinished(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(&format!(".{NAME}.")) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

impl Key {
    /// The first thing in which `now` is different.
    fn difference(&self, now: &Key, scene: &Scene) -> Option<String> {
        if self.geometry_hash != now.geometry_hash {
            let (then, now) = (self.geometry_hash, now.geometry_hash);
            return Some(format!("its mesh is another one (hash {then:016x}, this one's is {now:016x})"));
        }
        if let Some(what) = self.lighting.difference(scene) {
            return Some(what);
        }
        if self.options != now.options {
            return Some(format!("its options were {:?}, these are {:?}", self.options, now.options));
        }
        if self.start_crc != now.start_crc {
            return Some("it began with another solution".to_owned());
        }
        let caster = |key: &Key| format!("{} with offsets of {} m", key.caster, key.surface_offset_m);
        (caster(self) != caster(now))
            .then(|| format!("its rays were cast by {}, these are by {}", caster(self), caster(now)))
    }
}

#[cfg(test)]
#[path = "checkpoint_tests.rs"]
mod tests;
