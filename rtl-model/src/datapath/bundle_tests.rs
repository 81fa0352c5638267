//! Tests of the bundle expansion.
