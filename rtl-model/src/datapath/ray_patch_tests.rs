//! Tests of ray x patch.
