//! Headers: of a cell's list in the patch memory, and of a command in the command ring. Two words each.
//!
//! ```text
//! cell     word 0: address of the first list word        word 1: entries
//! command  word 0: command 3, any hit 1, items 28        word 1: payload words that follow
//! ```
//! Worked example, trace 64 explicit rays of 6 words for any hit: words 0x0000_040A (command 2, bit 3, 64 at bit 4),
//! 0x0000_0180.

use super::PacketError;
use super::fields::{FieldReader, FieldWriter};

/// Where a cell's list lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellHeader {
    /// Word address of the first entry.
    pub first: u32,
    /// Number of entries.
    pub count: u32,
}

impl CellHeader {
    /// Words of a header.
    pub const WORDS: u32 = 2;

    /// Packs the header.
    pub fn pack(self) -> [u32; 2] {
        [self.first, self.count]
    }

    /// Unpacks a header.
    pub fn unpack(words: [u32; 2]) -> CellHeader {
        CellHeader { first: words[0], count: words[1] }
    }
}

/// What a command asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Fill the patch memory.
    LoadScene,
    /// Trace bundles.
    TraceBundles,
    /// Trace explicit rays.
    TraceRays,
    /// Read the counters.
    ReadCounters,
}

/// The two words in front of a command's payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandHeader {
    /// What to do.
    pub command: Command,
    /// Any hit instead of the nearest.
    pub any_hit: bool,
    /// Rays, bundles, or memory words; under 2^28.
    pub items: u32,
    /// Words that follow.
    pub payload_words: u32,
}

impl CommandHeader {
    /// Bytes of a header.
    pub const BYTES: u32 = 8;

    /// Packs the header.
    pub fn pack(self) -> Vec<u32> {
        let code = match self.command {
            Command::LoadScene => 0,
            Command::TraceBundles => 1,
            Command::TraceRays => 2,
            Command::ReadCounters => 3,
        };
        let mut record = FieldWriter::default();
        record.unsigned(code, 3);
        record.unsigned(u64::from(self.any_hit), 1);
        record.unsigned(u64::from(self.items), 28);
        record.unsigned(u64::from(self.payload_words), 32);
        record.finish()
    }

    /// Unpacks a header.
    ///
    /// # Errors
    /// Too few words, or an unknown command.
    pub fn unpack(words: &[u32]) -> Result<CommandHeader, PacketError> {
        let mut record = FieldReader::new("command", words, 64)?;
        let command = match record.unsigned(3) {
            0 => Command::LoadScene,
            1 => Command::TraceBundles,
            2 => Command::TraceRays,
            3 => Command::ReadCounters,
            value => {
                return Err(PacketError::Field {
                    record: "command",
                    field: "command",
                    value,
                    expected: "0 to 3",
                });
            }
        };
        let any_hit = record.bit();
        Ok(CommandHeader { command, any_hit, items: record.word(28), payload_words: record.word(32) })
    }
}
