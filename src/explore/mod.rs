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

pub mod metric;
pub mod results;
pub mod space;
pub mod value;
