//! The frame of this program's binary files: magic, version, length, checksum, body; written whole or not at all.
//!
//! ```text
//! byte 0   magic, such as "RADSOL\r\n"   8 bytes
//!      8   version                      u32, little endian
//!     12   length of the body           u64
//!     20   CRC-32 (IEEE) of the body    u32
//!     24   body
//! ```
//! A body may be sections one behind the other, so that it can be said which one is damaged:
//! ```text
//! byte 0   tag, such as "ELEM"          4 bytes
//!      4   length of the payload        u64
//!     12   CRC-32 of the payload        u32
//!     16   payload
//! ```
//! Magic, version and length are looked at before the body is read, so nothing larger than the file is ever allocated,
//! whatever its header says. A file is replaced by one rename: readers see the old one or the new one, never half a file.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bytes before the body.
pub const HEADER_BYTES: usize = 24;
/// Bytes of the magic; its line end shows transfers in text mode.
const MAGIC_BYTES: usize = 8;

/// Beginnings of files that are taken for one of ours by mistake.
const KNOWN: [(&[u8], &str); 11] = [
    (b"RADSOL\r\n", "a solution (.radsol)"),
    (b"RADTRC\r\n", "a record of work (.radtrace)"),
    (b"RADCHK\r\n", "a checkpoint of a solve"),
    (b"RADROW\r\n", "a file of form factors (.radrow)"),
    (b"RADLOG\r\n", "an event log (.radlog)"),
    (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
    (b"\x89PNG", "a PNG picture"),
    (b"glTF", "a binary glTF model"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"{", "JSON text"),
    (b"version =", "a scene file"),
];

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// First bytes.
    pub magic: [u8; MAGIC_BYTES],
    /// Version of the body's layout that this program writes and reads.
    pub version: u32,
    /// What it is, with its article.
    pub name: &'static str,
    /// Its body is sections.
    pub sectioned: bool,
}

/// Tag of a section.
pub type Tag = [u8; 4];
/// Bytes before the payload of a section.
const SECTION_HEADER_BYTES: usize = 16;

/// Why a file was not written or not read.
#[derive(Debug, thiserror::Error)]
pub enum FramedFileError {
    /// The file system refused.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        #[source]
        error: io::Error,
    },
    /// Another kind of file.
    #[error("{}: not {expected}: {found}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it should be.
        expected: &'static str,
        /// What it seems to be.
        found: String,
    },
    /// A layout that this program does not read.
    #[error("{}: version {found} of the format, {}; this program reads version {expected}", path.display(),
        if found < expected { "an older one: make the file again" } else { "a newer one, or damage" })]
    Version {
        /// The file.
        path: PathBuf,
        /// The version it states.
        found: u32,
        /// The version that is read.
        expected: u32,
    },
    /// Bytes are missing or left over.
    #[error("{}: {found_bytes} bytes long, its header says {expected_bytes}", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// Length of the file.
        found_bytes: u64,
        /// Length that the header asks for.
        expected_bytes: u64,
    },
    /// The bytes are not those that were written.
    #[error("{}: damaged{}: checksum {found:08x}, its header says {expected:08x}", path.display(),
        section.as_ref().map_or(String::new(), |tag| format!(" in its section {tag}")))]
    Checksum {
        /// The file.
        path: PathBuf,
        /// The section, where that can be told.
        section: Option<String>,
        /// Of the body as read.
        found: u32,
        /// In the header.
        expected: u32,
    },
    /// The body does not hold what it should.
    #[error("{}: the body is not that of {expected}: {what}", path.display())]
    Body {
        /// The file.
        path: PathBuf,
        /// What it should be.
        expected: &'static str,
        /// What is wrong with it.
        what: String,
    },
}

impl Kind {
    /// The bytes of a file with this body.
    pub fn frame(&self, body: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len());
        bytes.extend(self.header(body));
        bytes.extend(body);
        bytes
    }

    fn header(&self, body: &[u8]) -> [u8; HEADER_BYTES] {
        let mut header = [0; HEADER_BYTES];
        header[..8].copy_from_slice(&self.magic);
        header[8..12].copy_from_slice(&self.version.to_le_bytes());
        header[12..20].copy_from_slice(&(body.len() as u64).to_le_bytes());
        header[20..].copy_from_slice(&crc32fast::hash(body).to_le_bytes());
        header
    }

    /// Writes a file, flushed to the disk, in place of the one that may be there.
    ///
    /// # Errors
    /// [`FramedFileError::Io`]; the previous file is then untouched.
    pub fn write(&self, path: &Path, body: &[u8]) -> Result<(), FramedFileError> {
        let io = |error| FramedFileError::Io { path: path.to_path_buf(), error };
        let mut file = AtomicWriteFile::open(path).map_err(io)?;
        file.write_all(&self.header(body)).map_err(io)?;
        file.write_all(body).map_err(io)?;
        file.commit().map_err(io)
    }

    /// Reads a file's body.
    ///
    /// # Errors
    /// One [`FramedFileError`] for every way in which a frame can be wrong.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>, FramedFileError> {
        let io = |error| FramedFileError::Io { path: path.to_path_buf(), error };
        if path.is_dir() {
            return Err(io(io::Error::new(io::ErrorKind::IsADirectory, "is a folder, expected a file")));
        }
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        self.read_from(path, file, length)
    }

    /// As [`Kind::read`], from `source` of `n_bytes`; `path` is for messages.
    ///
    /// # Errors
    /// As [`Kind::read`].
    pub fn read_from(
        &self,
        path: &Path,
        mut source: impl Read,
        n_bytes: u64,
    ) -> Result<Vec<u8>, FramedFileError> {
        let io = |error| FramedFileError::Io { path: path.to_path_buf(), error };
        let path = || path.to_path_buf();
        let mut header = Vec::with_capacity(HEADER_BYTES);
        source.by_ref().take(HEADER_BYTES as u64).read_to_end(&mut header).map_err(io)?;
        let magic = &header[..header.len().min(MAGIC_BYTES)];
        if magic.is_empty() || *magic != self.magic[..magic.len()] {
            return Err(FramedFileError::Foreign {
                path: path(),
                expected: self.name,
                found: seems(&header, &self.magic),
            });
        }
        let length = |found_bytes, expected_bytes| FramedFileError::Length {
            path: path(),
            found_bytes,
            expected_bytes,
        };
        let Some(header) = header.first_chunk::<HEADER_BYTES>() else {
            return Err(length(header.len() as u64, HEADER_BYTES as u64));
        };
        let u32_at = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| header[at + i]));
        let found = u32_at(8);
        if found != self.version {
            return Err(FramedFileError::Version { path: path(), found, expected: self.version });
        }
        let expected_bytes =
            (u64::from(u32_at(12)) | u64::from(u32_at(16)) << 32).saturating_add(HEADER_BYTES as u64);
        if expected_bytes != n_bytes {
            return Err(length(n_bytes, expected_bytes));
        }
        let mut body = Vec::with_capacity(n_bytes as usize - HEADER_BYTES);
        // One byte more than there should be: a file that grew since its length was asked.
        source.take(n_bytes - HEADER_BYTES as u64 + 1).read_to_end(&mut body).map_err(io)?;
        if body.len() + HEADER_BYTES != n_bytes as usize {
            return Err(length((body.len() + HEADER_BYTES) as u64, expected_bytes));
        }
        let (found, expected) = (crc32fast::hash(&body), u32_at(20));
        if found != expected {
            let section = if self.sectioned { damaged_section(&body) } else { None };
            return Err(FramedFileError::Checksum { path: path(), section, found, expected });
        }
        Ok(body)
    }

    /// The value of the section that `body` begins with; what is behind it is left in `body`.
    ///
    /// # Errors
    /// [`FramedFileError::Body`] when it is another section or does not hold such a value.
    pub fn section<T: DeserializeOwned>(
        &self,
        path: &Path,
        body: &mut &[u8],
        tag: Tag,
    ) -> Result<T, FramedFileError> {
        let name = tag_name(tag);
        let Some((found, crc, payload, rest)) = split_section(body) else {
            return Err(self.fault(path, format!("it ends in or before its section {name}")));
        };
        if found != tag {
            let found = tag_name(found);
            return Err(self.fault(path, format!("section {found} stands where {name} should be")));
        }
        if crc32fast::hash(payload) != crc {
            return Err(self.fault(path, format!("the checksum of its section {name} is wrong")));
        }
        *body = rest;
        match postcard::take_from_bytes(payload) {
            Ok((value, [])) => Ok(value),
            Ok((_, rest)) => Err(self.fault(path, format!("{} bytes left over in {name}", rest.len()))),
            Err(error) => Err(self.fault(path, format!("section {name}: {error}"))),
        }
    }

    /// Checks that all sections were read.
    ///
    /// # Errors
    /// [`FramedFileError::Body`].
    pub fn end(&self, path: &Path, body: &[u8]) -> Result<(), FramedFileError> {
        match body.len() {
            0 => Ok(()),
            n => Err(self.fault(path, format!("{n} bytes left over behind its last section"))),
        }
    }

    /// A value out of the bytes of a body, which must hold it and nothing more.
    ///
    /// # Errors
    /// [`FramedFileError::Body`].
    pub fn decode<T: DeserializeOwned>(&self, path: &Path, body: &[u8]) -> Result<T, FramedFileError> {
        match postcard::take_from_bytes(body) {
            Ok((value, [])) => Ok(value),
            Ok((_, rest)) => Err(self.fault(path, format!("{} bytes left over", rest.len()))),
            Err(error) => Err(self.fault(path, error.to_string())),
        }
    }

    /// The error of a body that does not hold what it should.
    pub fn fault(&self, path: &Path, what: String) -> FramedFileError {
        FramedFileError::Body { path: path.to_path_buf(), expected: self.name, what }
    }
}

/// The bytes of a value, for a body or a part of one.
///
/// # Panics
/// Never for types whose sequences and maps know their lengths.
pub fn encode(value: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(value).expect("lists of this program know their lengths")
}

/// Adds a section to a body.
pub fn put_section(body: &mut Vec<u8>, tag: Tag, value: &impl Serialize) {
    let payload = encode(value);
    body.extend(tag);
    body.extend((payload.len() as u64).to_le_bytes());
    body.extend(crc32fast::hash(&payload).to_le_bytes());
    body.extend(payload);
}

/// Tag, checksum and payload of the section at the front, and what follows it.
fn split_section(body: &[u8]) -> Option<(Tag, u32, &[u8], &[u8])> {
    let (header, rest) = body.split_first_chunk::<SECTION_HEADER_BYTES>()?;
    let (tag, numbers) = header.split_first_chunk::<4>()?;
    let (length, crc) = numbers.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (payload, rest) = rest.split_at_checked(length)?;
    Some((*tag, u32::from_le_bytes(*crc.first_chunk()?), payload, rest))
}

/// The first section whose checksum is wrong, if the way to it is not damaged.
fn damaged_section(mut body: &[u8]) -> Option<String> {
    while let Some((tag, crc, payload, rest)) = split_section(body) {
        if crc32fast::hash(payload) != crc {
            return Some(tag_name(tag));
        }
        body = rest;
    }
    None
}

fn tag_name(tag: Tag) -> String {
    String::from_utf8_lossy(&tag).into_owned()
}

/// What a file that starts so seems to be, said to who expected `magic`.
fn seems(start: &[u8], magic: &[u8]) -> String {
    if start.is_empty() {
        return "it is empty".to_owned();
    }
    if let Some((_, name)) = KNOWN.iter().find(|(known, _)| *known != magic && start.starts_with(known)) {
        return format!("it looks like {name}");
    }
    let name = String::from_utf8_lossy(&magic[..6]).into_owned();
    format!("it does not start with {name}")
}

#[cfg(test)]
#[path = "framed_file_tests.rs"]
pub(crate) mod tests;
