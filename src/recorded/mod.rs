//! Recorded work and samples of it: a workload's cycles without all of its rays.
//!
//! ```text
//! BoardCaster::record --commands--> WorkRecord --file.rs--> w.radtrace --> BoardCaster::replay
//! commands --sample.rs: blocks of bundles, run on the board--> cycles of all, with an error bar
//! ```
//! A record belongs to a workload (its settings, in words), to a scene and to what of a board answers depend on
//! ([`RecordKey`]); it is refused for any other.

mod file;
pub mod sample;

pub(crate) use file::fault;
pub use file::{RecordFileError, load, to_bytes};

use rtl_model::record::RecordKey;
use serde::{Deserialize, Serialize};

use crate::raycast::board::PurposeCommand;

/// Something that a workload's rays depend on, in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// What.
    pub name: String,
    /// Its value.
    pub value: String,
}

/// A workload as the board ran it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkRecord {
    /// What its rays depend on.
    pub settings: Vec<Setting>,
    /// What the answers depend on.
    pub key: RecordKey,
    /// The commands, in the order in which they ran.
    pub commands: Vec<PurposeCommand>,
}

/// What a record was made for and what it is to be used for are not the same.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("recorded for other work: {what} of the record: {recorded}; asked for: {given}")]
pub struct OtherWork {
    /// What differs.
    pub what: String,
    /// As recorded.
    pub recorded: String,
    /// As asked for.
    pub given: String,
}

impl WorkRecord {
    /// Checks that the record is one of this work.
    ///
    /// # Errors
    /// The first thing that differs.
    pub fn check(&self, settings: &[Setting], key: &RecordKey) -> Result<(), OtherWork> {
        let value = |settings: &[Setting], name: &str| {
            settings.iter().find(|s| s.name == name).map_or("none".to_owned(), |s| s.value.clone())
        };
        for Setting { name, .. } in settings.iter().chain(&self.settings) {
            let (recorded, given) = (value(&self.settings, name), value(settings, name));
            if recorded != given {
                return Err(OtherWork { what: name.clone(), recorded, given });
            }
        }
        match self.key.difference(key) {
            None => Ok(()),
            Some(d) => Err(OtherWork { what: d.what.to_owned(), recorded: d.recorded, given: d.given }),
        }
    }

    /// Bundles, or chunks of up to 64 explicit rays.
    pub fn n_jobs(&self) -> u64 {
        self.commands.iter().map(|(_, command)| command.n_jobs() as u64).sum()
    }

    /// Rays.
    pub fn n_rays(&self) -> u64 {
        self.commands.iter().map(|(_, command)| command.n_rays()).sum()
    }
}
