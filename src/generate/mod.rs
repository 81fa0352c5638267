//! Scene files made to measure for experiments: so many patches, pieces of furniture or segments, from a seed.
//!
//! ```text
//! Kind, count, seed --one file per kind--> SceneText --text.rs--> the bytes of a scene file
//!                       random.rs, room.rs, furniture.rs
//! ```
//! Equal kind, count and seed give equal bytes on every machine. Lengths are whole micrometres throughout.
//! Format: version 1, scenes/README.md.

use std::fmt;

mod furnished_room;
mod furniture;
mod many_lamps;
mod random;
mod random_patches;
mod room;
mod segments_2d;
#[cfg(test)]
mod tests;
mod text;

/// What to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two-sided parallelograms of random place, size and orientation in a closed room.
    RandomPatches,
    /// A room with tables, chairs, shelves and cupboards.
    FurnishedRoom,
    /// The same room under many small lamps.
    ManyLamps,
    /// Random segments of the unit square, extruded: a two-dimensional world.
    Segments2d,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Kind; 4] = [Kind::RandomPatches, Kind::FurnishedRoom, Kind::ManyLamps, Kind::Segments2d];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Kind::RandomPatches => "random-patches",
            Kind::FurnishedRoom => "furnished-room",
            Kind::ManyLamps => "many-lamps",
            Kind::Segments2d => "segments-2d",
        }
    }

    /// Largest count: with it the scene still meshes within a million elements or so.
    pub fn max_count(self) -> u32 {
        match self {
            Kind::RandomPatches => 100_000,
            Kind::FurnishedRoom => 1000,
            Kind::ManyLamps => 1000,
            Kind::Segments2d => 10_000,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A count that a kind cannot have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("count {count}: expected 1 to {max} for {kind}", max = .kind.max_count())]
pub struct CountError {
    /// The kind.
    pub kind: Kind,
    /// The count.
    pub count: u32,
}

/// A scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Generated {
    /// Its text.
    pub text: String,
    /// Its number of surfaces.
    pub n_surfaces: usize,
}

/// A scene of a kind with `count` patches, pieces or segments.
///
/// # Errors
/// When `count` is 0 or over [`Kind::max_count`].
pub fn generate(kind: Kind, count: u32, seed: u64) -> Result<Generated, CountError> {
    if !(1..=kind.max_count()).contains(&count) {
        return Err(CountError { kind, count });
    }
    let scene = match kind {
        Kind::RandomPatches => random_patches::scene(count, seed),
        Kind::FurnishedRoom => furnished_room::scene(count, seed),
        Kind::ManyLamps => many_lamps::scene(count, seed),
        Kind::Segments2d => segments_2d::scene(count, seed),
    };
    let command = format!("radeng generate {kind} --count {count} --seed {seed} -o scene.toml");
    Ok(Generated { text: scene.write(&command), n_surfaces: scene.quads.len() })
}
