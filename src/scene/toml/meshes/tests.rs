//! `[[mesh]]`: order of the transform, names, materials, faults.
