//! Exact sums and products of f64 as expansions.
