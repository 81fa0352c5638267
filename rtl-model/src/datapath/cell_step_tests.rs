//! Tests of the cell step.
