//! Board against oracle, pair by pair: every field of the hit record and every wire of ray x patch.
//!
//! ```text
//! 32 words (proptest, or a seeded generator) -> cases.rs: formats, ray, patch of a class
//!     -> datapath::ray_patch::{intersect, taps}, oracle::{intersect, wires} -> agreement.rs: equal? what was it?
//! ```
//! A case is a list of pairs; each pair is built from 32 words that shrink toward 0, and 0 builds the simplest pair of
//! its class. Each class states what it must have produced (hits, edge values of 0, ...) and fails when it did not.
//!
//! **Failing cases** are shrunk, and the seed of each goes with its shrunken words into
//! `rtl-model/tests/proptest-regressions/properties.txt`. Every later run replays that file first; commit it together
//! with the repair. A line there holds for the strategy that wrote it: when the number of words or pairs changes, turn
//! lines worth keeping into tests of their own.
//!
//! `PROPTEST_CASES=N` runs N cases (of 32 pairs on average) of each class instead of 3,500. The long runs:
//!
//! ```text
//! cargo test --release -p rtl-model --test differential -- --ignored --nocapture ten_million_pairs
//! cargo test --release -p rtl-model --test differential -- --ignored --nocapture hundred_million_pairs
//! ```

mod agreement;
mod cases;
mod divided;
mod draw;
mod long_runs;
mod properties;
