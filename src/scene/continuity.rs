//! How irradiance continues from one piece of surface to the next, and what a scene says of it by hand.
//!
//! ```text
//! smooth groups, angles; shadow lines; [[continuity]] of a scene file --> C1 | C0 | C-1 across an edge
//! ```

use serde::{Deserialize, Serialize};

use super::SurfaceId;

/// How reconstruction may join two elements across an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Continuity {
    /// Value and gradient continue.
    C1,
    /// The value continues, the gradient may break.
    C0,
    /// Nothing continues (border, crease, shadow line): C-1.
    Broken,
}

impl Continuity {
    /// As a scene file and a report write it.
    pub fn name(self) -> &'static str {
        match self {
            Continuity::C1 => "C1",
            Continuity::C0 => "C0",
            Continuity::Broken => "C-1",
        }
    }
}

/// Continuity by hand, across all edges that two surfaces share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceContinuity {
    /// Two different surfaces, the one of the lower number first.
    pub between: [SurfaceId; 2],
    /// What holds whatever their smooth groups and normals say.
    pub continuity: Continuity,
}
