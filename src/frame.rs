//! The main path: one function, one call per arrow of the flow. Start reading here.
