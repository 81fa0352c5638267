//! Bit layout of every record that crosses the patch memory or the bus; tokens inside the board are Rust structs.
//!
//! ```text
//! datapath words -> pack (fields from bit 0 up, two's complement, padded with 0 to 32-bit words) -> u32 words -> unpack
//! ```
//! | record | fields in order | bytes at default |
//! |---|---|---|
//! | [`pack_ray`] | o 3 (F+1), d 3 (D+1), t_max T+3, tag 15 | 24 |
//! | [`pack_patch`] | corners 12 (F+1), id 28, is_triangle 1 | 44 |
//! | [`pack_hit`] | t T+3, id 28, facing 1, valid 1 | 8 |
//! | any hits | one bit a ray, up to 64 | 4 or 8 |
//! | [`pack_bundle`] | kind 2, any hit 1, n-1 6, m-1 6, tag 15, apex 3 (F+1), then the kind's parameters | 44 to 616 |
//! | [`CellHeader`] | address 32, entries 32 | 8 |
//! | [`CommandHeader`] | command 3, any hit 1, items 28, payload words 32 | 8 |
//!
//! Not modelled: parity, the bus's own framing, and moving command headers and the memory image (no bytes, no cycles).

mod bundle;
mod fields;
mod headers;
mod hit;
mod patch;
mod ray;

pub use bundle::{BundlePacket, bundle_bytes, pack_bundle, unpack_bundle};
pub use headers::{CellHeader, Command, CommandHeader};
pub use hit::{any_hit_bytes, hit_bytes, pack_any_hits, pack_hit, unpack_any_hits, unpack_hit};
pub use patch::{PATCH_LINE_WORDS, pack_patch, patch_bytes, unpack_patch};
pub use ray::{pack_ray, ray_bytes, unpack_ray};

/// Bits of a ray's or bundle's tag: 32,768 in flight.
pub const TAG_BITS: u32 = 15;

/// Bits of a patch id.
pub const PATCH_ID_BITS: u32 = 28;

/// Most rays of a bundle.
pub const MAX_BUNDLE_RAYS: usize = 64;

/// Bytes of a record of so many bits, padded to 32-bit words.
fn padded_bytes(bits: u32) -> u32 {
    bits.div_ceil(32) * 4
}

/// A malformed record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// Fewer words than the record has.
    #[error("the {record} record ends after {found} words; {expected} were expected")]
    Short {
        /// Which record.
        record: &'static str,
        /// Words there.
        found: usize,
        /// Words needed.
        expected: usize,
    },
    /// A field with a value that means nothing.
    #[error("{field} = {value} in a {record} record; expected {expected}")]
    Field {
        /// Which record.
        record: &'static str,
        /// Which field.
        field: &'static str,
        /// Its value.
        value: u64,
        /// What it may be.
        expected: &'static str,
    },
}

#[cfg(test)]
#[path = "packet_tests.rs"]
mod tests;
