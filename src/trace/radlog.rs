//! The binary event log of a run (`.radlog`): everything that the board told, 8 bytes an event.
//!
//! ```text
//! chunks of Event --Writer--> file beside its place --commit--> FILE.radlog --Reader--> chunks of Event
//! ```
//! All integers little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | magic `RADLOG\r\n` |
//! | 4 | version, 1 |
//! | 4 | H, bytes of the header |
//! | H | header, JSON: [`Header`] |
//! | 8 n | events, `rtl_model::sim::Event`, in the order in which they were told |
//! | T | trailer, JSON: [`Trailer`] |
//! | 4 | T, bytes of the trailer |
//! | 4 | CRC-32 (IEEE) of all bytes before |
//! | 4 | `END\n` |
//!
//! The bits of an event are described where it is defined. A file that is cut, changed or something else is refused by
//! name. Nothing shows at the file's place before the whole of it is written.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender};
use std::thread::JoinHandle;

use atomic_write_file::AtomicWriteFile;
use crc32fast::Hasher;
use rtl_model::sim::{Directory, Event};
use serde::{Deserialize, Serialize};

use super::Picture;
use crate::raycast::Purpose;

const MAGIC: &[u8; 8] = b"RADLOG\r\n";
const VERSION: u32 = 1;
const END: &[u8; 4] = b"END\n";
/// Bytes around header, events and trailer.
const FRAME_BYTES: u64 = 8 + 4 + 4 + 4 + 4 + 4;
/// Largest header or trailer.
const MAX_JSON_BYTES: u32 = 1 << 28;
/// Events read at once.
const CHUNK: usize = 1 << 15;
/// Bytes of an event.
const EVENT_BYTES: usize = 8;

/// What the events are about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Name of the board's specification.
    pub board: String,
    /// Its clock (MHz).
    pub clock_mhz: f64,
    /// What was traced.
    pub workload: String,
    /// The scene file.
    pub scene: Option<PathBuf>,
    /// The picture whose camera rays are among the rays.
    pub picture: Option<Picture>,
    /// Names of blocks and links.
    pub directory: Directory,
}

/// What is known at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trailer {
    /// Events in the file.
    pub events: u64,
    /// Commands in order.
    pub commands: Vec<CommandFact>,
}

/// A command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandFact {
    /// What its rays were cast for.
    pub purpose: Purpose,
    /// Its rays.
    pub rays: u64,
}

/// Why a file is no event log.
#[derive(Debug, thiserror::Error)]
pub enum RadlogError {
    /// Reading or writing failed.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Another kind of file.
    #[error("not an event log: begins with {found}, expected \"RADLOG\\r\\n\"")]
    Foreign {
        /// Its first bytes.
        found: String,
    },
    /// A log of another version.
    #[error("version {found} of the event log, expected {VERSION}")]
    Version {
        /// The file's.
        found: u32,
    },
    /// The file ends early.
    #[error("cut off: {0}")]
    Truncated(String),
    /// Something in it is not what was written.
    #[error("damaged: {0}")]
    Damaged(String),
}

/// Chunks on their way to the file.
const QUEUED_CHUNKS: usize = 8;

/// What the writing thread comes back with.
type Written = Result<(AtomicWriteFile, Hasher), RadlogError>;

/// Writes a log, on a thread of its own.
#[derive(Debug)]
pub struct Writer {
    /// Chunks to the thread; none: they are all there.
    full: Option<SyncSender<Vec<Event>>>,
    /// Chunks that it is through with.
    empty: Receiver<Vec<Event>>,
    thread: Option<JoinHandle<Written>>,
    n_events: u64,
}

impl Writer {
    /// Begins the log that will be at `path`.
    ///
    /// # Errors
    /// When the place takes no file.
    pub fn create(path: &Path, header: &Header) -> Result<Writer, RadlogError> {
        let mut file = AtomicWriteFile::open(path)?;
        let json = serde_json::to_vec(header).map_err(std::io::Error::from)?;
        let length = json_bytes(json.len())?;
        let mut start = MAGIC.to_vec();
        start.extend_from_slice(&VERSION.to_le_bytes());
        start.extend_from_slice(&length.to_le_bytes());
        start.extend_from_slice(&json);
        let mut crc = Hasher::new();
        put(&mut file, &mut crc, &start)?;
        let (full, chunks) = std::sync::mpsc::sync_channel::<Vec<Event>>(QUEUED_CHUNKS);
        let (used, empty) = std::sync::mpsc::channel();
        let thread = std::thread::Builder::new().name("radlog".to_owned()).spawn(move || {
            let mut bytes = Vec::new();
            for events in chunks {
                bytes.resize(events.len() * EVENT_BYTES, 0);
                let (words, _) = bytes.as_chunks_mut::<EVENT_BYTES>();
                words.iter_mut().zip(&events).for_each(|(word, event)| *word = event.0.to_le_bytes());
                put(&mut file, &mut crc, &bytes)?;
                // Who wants no chunks back has all that it needs.
                let _ = used.send(events);
            }
            Ok((file, crc))
        })?;
        Ok(Writer { full: Some(full), empty, thread: Some(thread), n_events: 0 })
    }

    /// Adds events.
    ///
    /// # Errors
    /// When the disk is full, or whatever else keeps a file from growing, be it some chunks later.
    pub fn events(&mut self, events: &[Event]) -> Result<(), RadlogError> {
        self.n_events += events.len() as u64;
        let mut chunk = self.empty.try_recv().unwrap_or_default();
        chunk.clear();
        chunk.extend_from_slice(events);
        let sent = self.full.as_ref().is_some_and(|full| full.send(chunk).is_ok());
        if sent { Ok(()) } else { Err(self.join().err().unwrap_or_else(ended)) }
    }

    /// Ends the log. It is in place once the file is committed.
    ///
    /// # Errors
    /// As [`Writer::events`].
    pub fn finish(mut self, commands: Vec<CommandFact>) -> Result<AtomicWriteFile, RadlogError> {
        let (mut file, mut crc) = self.join()?;
        let trailer = Trailer { events: self.n_events, commands };
        let mut end = serde_json::to_vec(&trailer).map_err(std::io::Error::from)?;
        let length = json_bytes(end.len())?;
        end.extend_from_slice(&length.to_le_bytes());
        put(&mut file, &mut crc, &end)?;
        file.write_all(&crc.finalize().to_le_bytes())?;
        file.write_all(END)?;
        Ok(file)
    }

    /// Waits for the thread.
    fn join(&mut self) -> Written {
        self.full = None;
        self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or_else(|| Err(ended()))
    }
}

impl Drop for Writer {
    /// Waits until an unfinished file is gone.
    fn drop(&mut self) {
        let _ = self.join();
    }
}

fn ended() -> RadlogError {
    std::io::Error::other("the log's writer has ended").into()
}

fn put(file: &mut AtomicWriteFile, crc: &mut Hasher, bytes: &[u8]) -> Result<(), RadlogError> {
    crc.update(bytes);
    Ok(file.write_all(bytes)?)
}

fn json_bytes(length: usize) -> Result<u32, RadlogError> {
    let small = u32::try_from(length).ok().filter(|n| *n <= MAX_JSON_BYTES);
    small.ok_or_else(|| RadlogError::Damaged(format!("a header or trailer of {length} bytes")))
}

/// Reads a log.
#[derive(Debug)]
pub struct Reader {
    file: BufReader<File>,
    header: Header,
    trailer: Trailer,
    /// Of everything up to the next event.
    crc: Hasher,
    /// Events still to come.
    left: u64,
    bytes: Vec<u8>,
    events: Vec<Event>,
    expected_crc: u32,
    trailer_bytes: Vec<u8>,
}

impl Reader {
    /// Opens a log and reads what stands around its events.
    ///
    /// # Errors
    /// Any [`RadlogError`] but damage within the events, which shows when they are read.
    pub fn open(path: &Path) -> Result<Reader, RadlogError> {
        let file = File::open(path)?;
        if file.metadata()?.is_dir() {
            return Err(std::io::Error::new(ErrorKind::IsADirectory, "is a directory").into());
        }
        let size = file.metadata()?.len();
        let mut file = BufReader::with_capacity(1 << 18, file);
        let mut start = Vec::new();
        file.by_ref().take(16).read_to_end(&mut start)?;
        let magic = &start[..start.len().min(8)];
        if magic != MAGIC {
            if !magic.is_empty() && MAGIC.starts_with(magic) {
                return Err(RadlogError::Truncated(format!("{size} bytes")));
            }
            return Err(RadlogError::Foreign { found: format!("\"{}\"", magic.escape_ascii()) });
        }
        let word = |bytes: &[u8]| bytes.first_chunk().map(|b| u32::from_le_bytes(*b));
        let Some((version, length)) =
            word(start.get(8..).unwrap_or(&[])).zip(word(start.get(12..).unwrap_or(&[])))
        else {
            return Err(RadlogError::Truncated(format!("{size} bytes")));
        };
        if version != VERSION {
            return Err(RadlogError::Version { found: version });
        }
        let rest = size.saturating_sub(FRAME_BYTES);
        if length > MAX_JSON_BYTES {
            return Err(RadlogError::Damaged(format!("a header of {length} bytes")));
        }
        if u64::from(length) > rest {
            return Err(RadlogError::Truncated(format!("{size} bytes, with a header of {length}")));
        }
        let header_bytes = read(&mut file, u64::from(length))?;
        let header: Header = parse("header", &header_bytes)?;
        if !(header.clock_mhz > 0.0 && header.clock_mhz <= 1e6) {
            return Err(RadlogError::Damaged(format!(
                "a clock of {} MHz, expected more than 0 and at most 1e6",
                header.clock_mhz
            )));
        }
        let first_event = file.stream_position()?;
        file.seek(SeekFrom::Start(size - 12))?;
        let end = read(&mut file, 12)?;
        if &end[8..] != END {
            return Err(RadlogError::Truncated("its end is not there".to_owned()));
        }
        let (trailer_length, crc) = word(&end).zip(word(&end[4..])).unwrap_or_default();
        if u64::from(trailer_length) > rest - u64::from(length) {
            return Err(RadlogError::Damaged(format!("a trailer of {trailer_length} bytes")));
        }
        let trailer_at = size - 12 - u64::from(trailer_length);
        file.seek(SeekFrom::Start(trailer_at))?;
        let trailer_bytes = read(&mut file, u64::from(trailer_length))?;
        let trailer: Trailer = parse("trailer", &trailer_bytes)?;
        let between = trailer_at - first_event;
        if trailer.events.checked_mul(EVENT_BYTES as u64) != Some(between) {
            return Err(RadlogError::Damaged(format!(
                "{between} bytes of events, expected {} events of {EVENT_BYTES}",
                trailer.events
            )));
        }
        file.seek(SeekFrom::Start(first_event))?;
        let mut hasher = Hasher::new();
        hasher.update(&start);
        hasher.update(&header_bytes);
        Ok(Reader {
            file,
            header,
            left: trailer.events,
            trailer,
            crc: hasher,
            bytes: Vec::new(),
            events: Vec::new(),
            expected_crc: crc,
            trailer_bytes,
        })
    }

    /// What the events are about.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// What was known at the end.
    pub fn trailer(&self) -> &Trailer {
        &self.trailer
    }

    /// The next events; none at the end, when the whole file has been found undamaged.
    ///
    /// # Errors
    /// [`RadlogError::Damaged`] at the end, when a byte of the file is not as written.
    pub fn next_chunk(&mut self) -> Result<Option<&[Event]>, RadlogError> {
        let n = self.left.min(CHUNK as u64);
        if n == 0 {
            self.crc.update(&self.trailer_bytes);
            self.crc.update(&(self.trailer_bytes.len() as u32).to_le_bytes());
            let crc = std::mem::take(&mut self.crc).finalize();
            if crc != self.expected_crc {
                return Err(RadlogError::Damaged(format!(
                    "its CRC-32 is {crc:08x}, expected {:08x}",
                    self.expected_crc
                )));
            }
            return Ok(None);
        }
        self.left -= n;
        self.bytes.resize(n as usize * EVENT_BYTES, 0);
        self.file.read_exact(&mut self.bytes)?;
        self.crc.update(&self.bytes);
        let (words, _) = self.bytes.as_chunks::<EVENT_BYTES>();
        self.events.clear();
        self.events.extend(words.iter().map(|word| Event(u64::from_le_bytes(*word))));
        Ok(Some(&self.events))
    }
}

fn read(file: &mut impl Read, length: u64) -> Result<Vec<u8>, RadlogError> {
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes)?;
    if bytes.len() as u64 == length {
        Ok(bytes)
    } else {
        Err(RadlogError::Truncated(format!("{} of {length} bytes", bytes.len())))
    }
}

fn parse<'a, T: Deserialize<'a>>(what: &str, bytes: &'a [u8]) -> Result<T, RadlogError> {
    serde_json::from_slice(bytes).map_err(|e| RadlogError::Damaged(format!("its {what}: {e}")))
}

#[cfg(test)]
#[path = "radlog_tests.rs"]
mod tests;
