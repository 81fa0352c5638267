//! Tests of the memory image.
