//! Design exploration: many boards, one question.
//!
//! ```text
//! space.toml --space/--> Space: candidates (choice of values -> BoardSpec, Cost), impossible ones with their reason
//!   strategy/  which candidates, in which order                        |
//!   evaluate/  candidates that share canonical work run from one record v
//!                                                    rows --store/--> SQLite --> Results
//!                                                                                  |
//!   results/   Pareto front, sensitivity | charts, page.html, Parquet, CSV, terminal <'
//! ```
//! A candidate is named by its ordinal: its place in the full grid of the axes, the last axis fastest.

pub mod collect;
pub mod evaluate;
pub mod metric;
mod points;
pub mod results;
pub mod run;
pub mod shard;
pub mod space;
pub mod store;
pub mod strategy;
pub mod sweep;
pub mod value;

/// The store of a sweep, in its folder.
pub const STORE_FILE: &str = "sweep.sqlite";

#[cfg(test)]
mod test_spaces;
