//! The `.radtrace` file: a workload's record on disk, refused when damaged, foreign or made for other work.
//!
//! ```text
//! byte 0   magic "RADTRC\r\n"          8 bytes
//!      8   version                    u32, little endian
//!     12   length of the body         u64
//!     20   CRC-32 of the body         u32
//!     24   body: postcard of WorkRecord
//!            settings   list of (name, value): the workload in words
//!            key        formats, grid, partition, shells, low-resolution share, hash of the memory image
//!            commands   list of (purpose, any hit, explicit rays, hash of the rays or bundles, bundles, low-resolution cast)
//! ```
//! Bundles and the rays of a cast are each a list of jobs (rays, descriptor bytes, end of its streams) and the streams'
//! bytes, whose layout `rtl_model::record` documents. The file is staged with the others of a command and put in place
//! whole.

use std::path::{Path, PathBuf};
use std::{fs, io};

use super::{OtherWork, WorkRecord};

/// First bytes of every record; the line end shows transfers in text mode.
const MAGIC: [u8; 8] = *b"RADTRC\r\n";
/// Version of the body's layout.
pub const VERSION: u32 = 1;
/// Bytes before the body.
const HEADER_BYTES: usize = 24;

/// Why a record cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordFileError {
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
    #[error("{}: not a record of work (it does not start with RADTRC)", path.display())]
    NotARecord {
        /// The file.
        path: PathBuf,
    },
    /// A layout that this program does not read.
    #[error("{}: version {found} of the format; this program reads version {VERSION}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// The version it states.
        found: u32,
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
    #[error("{}: damaged: checksum {found:08x}, its header says {expected:08x}", path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
        /// Of the body as read.
        found: u32,
        /// In the header.
        expected: u32,
    },
    /// The body does not hold a record.
    #[error("{}: the body is no record of work: {what}", path.display())]
    Body {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// It is one of other work.
    #[error("{}: {source}", path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// What differs.
        source: OtherWork,
    },
}

/// The bytes of a record's file.
///
/// # Errors
/// When the record cannot be encoded.
pub fn to_bytes(record: &WorkRecord) -> Result<Vec<u8>, String> {
    let body = postcard::to_stdvec(record).map_err(|error| error.to_string())?;
    let mut bytes = Vec::with_capacity(HEADER_BYTES + body.len());
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(crc32fast::hash(&body).to_le_bytes());
    bytes.extend(body);
    Ok(bytes)
}

/// Reads a record.
///
/// # Errors
/// One [`RecordFileError`] for every way in which the file can be wrong.
pub fn load(path: &Path) -> Result<WorkRecord, RecordFileError> {
    let bytes = fs::read(path).map_err(|error| RecordFileError::Io { path: path.to_path_buf(), error })?;
    decode(path, &bytes)
}

fn decode(path: &Path, bytes: &[u8]) -> Result<WorkRecord, RecordFileError> {
    let path = || path.to_path_buf();
    let length = |expected_bytes| RecordFileError::Length {
        path: path(),
        found_bytes: bytes.len() as u64,
        expected_bytes,
    };
    let magic = &bytes[..bytes.len().min(MAGIC.len())];
    if magic.is_empty() || *magic != MAGIC[..magic.len()] {
        return Err(RecordFileError::NotARecord { path: path() });
    }
    let Some((header, body)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(length(HEADER_BYTES as u64));
    };
    let u32_at = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| header[at + i]));
    let found = u32_at(8);
    if found != VERSION {
        return Err(RecordFileError::Version { path: path(), found });
    }
    let body_bytes = u64::from(u32_at(12)) | u64::from(u32_at(16)) << 32;
    if body_bytes != body.len() as u64 {
        return Err(length(body_bytes.saturating_add(HEADER_BYTES as u64)));
    }
    let (found, expected) = (crc32fast::hash(body), u32_at(20));
    if found != expected {
        return Err(RecordFileError::Checksum { path: path(), found, expected });
    }
    match postcard::take_from_bytes(body) {
        Ok((record, [])) => Ok(record),
        Ok((_, rest)) => {
            Err(RecordFileError::Body { path: path(), what: format!("{} bytes left over", rest.len()) })
        }
        Err(error) => Err(RecordFileError::Body { path: path(), what: error.to_string() }),
    }
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
