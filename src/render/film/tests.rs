//! The film loop over a shader that is a function of the ray.
