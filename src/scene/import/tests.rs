//! Model files, in the small.
