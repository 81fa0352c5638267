//! The `.radtrace` file: a workload's record on disk, refused when damaged, foreign or made for other work.
//!
//! ```text
//! frame of framed_file.rs, magic "RADTRC\r\n"; its body: postcard of WorkRecord
//!            settings   list of (name, value): the workload in words
//!            key        formats, grid, partition, shells, low-resolution share, hash of the memory image
//!            commands   list of (purpose, any hit, explicit rays, hash of the rays or bundles, bundles, low-resolution cast)
//! ```
//! Bundles and the rays of a cast are each a list of jobs (rays, descriptor bytes, end of its streams) and the streams'
//! bytes, whose layout `rtl_model::record` documents. The file is staged with the others of a command and put in place
//! whole.

use std::path::{Path, PathBuf};

use super::{OtherWork, WorkRecord};
use crate::framed_file::{FramedFileError, Kind, encode};

/// The kind of these files.
const KIND: Kind = Kind { magic: *b"RADTRC\r\n", version: 1, name: "a record of work", sectioned: false };

/// Why a record cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordFileError {
    /// It cannot be read.
    #[error(transparent)]
    File(#[from] FramedFileError),
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
pub fn to_bytes(record: &WorkRecord) -> Vec<u8> {
    KIND.frame(&encode(record))
}

/// Reads a record.
///
/// # Errors
/// One [`RecordFileError`] for every way in which the file can be wrong.
pub fn load(path: &Path) -> Result<WorkRecord, RecordFileError> {
    Ok(KIND.decode(path, &KIND.read(path)?)?)
}

/// The error of a record whose body cannot be what it says.
pub(crate) fn fault(path: &Path, what: String) -> RecordFileError {
    KIND.fault(path, what).into()
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
