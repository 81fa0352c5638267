//! One mesh with the reference's own values at its vertices, and every method's metrics on it.
//!
//! ```text
//! mesh, reference --vertex values, samples--> Case --measure(way)--> Metrics a part, time a point, limited vertices
//! ```
//! Converged vertex values: all error is that of interpolation.

use std::hint::black_box;
use std::time::Instant;

use crate::experiments::ExperimentError;
use crate::mesh::{ElementId, Mesh, SurfacePoint};
use crate::reconstruct::metrics::{Metrics, Reference, Samples, element_means, vertex_values};
use crate::reconstruct::{GradientRule, Method, ReconstructOptions, Reconstruction};
use crate::scene::Scene;
use crate::units::Rgb;

/// Wall time that the evaluation of one method is measured for, at least (s).
const TIMED_S: f64 = 0.004;

/// A method with its gradient rule.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Its name in tables.
    pub name: &'static str,
    /// How.
    pub options: ReconstructOptions,
}

impl Way {
    fn new(name: &'static str, method: Method, gradients: GradientRule) -> Way {
        Way { name, options: ReconstructOptions { gradients, ..method.into() } }
    }
}

/// All methods, Hermite with every gradient rule; the names that others look for are constants.
pub fn ways() -> [Way; 9] {
    use GradientRule::{FacetNormals, LeastSquares, SeedEdgeNormals, Zero};
    [
        Way::new(CONSTANT, Method::Constant, LeastSquares),
        Way::new(BILINEAR, Method::Bilinear, LeastSquares),
        Way::new("quadratic", Method::Quadratic, LeastSquares),
        Way::new("cubic-triangle", Method::CubicTriangle, LeastSquares),
        Way::new(ZERO, Method::Hermite, Zero),
        Way::new(LITERAL, Method::Hermite, SeedEdgeNormals),
        Way::new("hermite facet-normals", Method::Hermite, FacetNormals),
        Way::new(HERMITE, Method::Hermite, LeastSquares),
        Way::new(LIMITED, Method::HermiteLimited, LeastSquares),
    ]
}

/// Means of elements.
pub const CONSTANT: &str = "constant";
/// Gouraud's method.
pub const BILINEAR: &str = "bilinear";
/// Hermite with least-squares gradients.
pub const HERMITE: &str = "hermite";
/// Hermite with limited gradients at kinked elements.
pub const LIMITED: &str = "hermite-limited";
/// Hermite without slopes at vertices.
pub const ZERO: &str = "hermite zero";
/// Hermite with the tangent rule of the 1992 paper as it is written.
pub const LITERAL: &str = "hermite seed-edge-normals";

/// The way of a name.
///
/// # Panics
/// When there is none.
pub fn way(name: &str) -> Way {
    ways().into_iter().find(|w| w.name == name).unwrap_or_else(|| panic!("no method {name}"))
}

/// Surfaces that are looked at as one: its name, and what their names begin with.
pub type Part = (&'static str, &'static [&'static str]);

/// What a method does on a case.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Of all parts together, each over its own mean.
    pub all: Metrics,
    /// A part at a time, in the case's order.
    pub parts: Vec<Metrics>,
    /// Wall time of evaluating one point, one thread (ns).
    pub ns_per_point: f64,
    /// Vertices whose gradient was limited.
    pub n_limited: usize,
}

/// A mesh with a reference.
pub struct Case {
    /// The mesh.
    pub mesh: Mesh,
    /// The reference at its vertices.
    pub values: Vec<Rgb>,
    /// Per element, its part.
    pub part_of: Vec<Option<usize>>,
    means: Vec<Rgb>,
    samples: Samples,
    n_parts: usize,
}

impl Case {
    /// Samples a reference on the parts of a mesh.
    ///
    /// # Errors
    /// A part that no surface belongs to.
    pub fn new(
        scene: &Scene,
        mesh: Mesh,
        parts: &[Part],
        reference: &impl Reference,
    ) -> Result<Case, ExperimentError> {
        let values = vertex_values(&mesh, reference);
        Case::with_values(scene, mesh, parts, reference, values)
    }

    /// As [`Case::new`], with other values at the vertices.
    ///
    /// # Errors
    /// As [`Case::new`].
    pub fn with_values(
        scene: &Scene,
        mesh: Mesh,
        parts: &[Part],
        reference: &impl Reference,
        values: Vec<Rgb>,
    ) -> Result<Case, ExperimentError> {
        let part = |e: usize| {
            let name =
                &scene.surfaces[mesh.patches[mesh.elements[e].patch.0 as usize].surface.0 as usize].name;
            parts.iter().position(|(_, begin)| begin.iter().any(|b| name.starts_with(b)))
        };
        let part_of: Vec<Option<usize>> = (0..mesh.elements.len()).map(part).collect();
        if let Some((name, _)) = (0..).zip(parts).find(|(p, _)| !part_of.contains(&Some(*p))).map(|(_, p)| p)
        {
            return Err(ExperimentError::Scene(format!("no surface is a part of '{name}'")));
        }
        let samples = Samples::new(&mesh, |e: ElementId| part_of[e.0 as usize], reference);
        let means = element_means(&mesh, reference);
        Ok(Case { mesh, values, part_of, means, samples, n_parts: parts.len() })
    }

    /// The field that a way makes of it.
    pub fn field(&self, way: &Way) -> Reconstruction {
        Reconstruction::new(&self.mesh, way.options, &self.values, &self.means)
    }

    /// Mean luminance of each part (W/m^2).
    pub fn means(&self) -> &[f64] {
        self.samples.means()
    }

    /// Means of the reference over elements.
    pub fn element_means(&self) -> &[Rgb] {
        &self.means
    }

    /// Elements that count.
    pub fn n_elements(&self) -> usize {
        self.part_of.iter().flatten().count()
    }

    /// Measures a way; `timed`: its speed as well.
    pub fn measure(&self, way: &Way, timed: bool) -> Measured {
        let field = self.field(way);
        let of = |part| self.samples.only(part).measure(&self.mesh, &field);
        Measured {
            all: self.samples.measure(&self.mesh, &field),
            parts: (0..self.n_parts).map(of).collect(),
            ns_per_point: if timed { self.time(&field) } else { 0.0 },
            n_limited: field.limited_vertices(),
        }
    }

    fn time(&self, field: &Reconstruction) -> f64 {
        let places: Vec<SurfacePoint> = self.samples.places().collect();
        let start = Instant::now();
        let mut n = 0;
        loop {
            for at in &places {
                black_box(field.evaluate(&self.mesh, black_box(*at)));
            }
            n += places.len();
            let seconds = start.elapsed().as_secs_f64();
            if seconds > TIMED_S {
                return 1e9 * seconds / n as f64;
            }
        }
    }
}

impl Case {
    /// Relative L2 error of a way that is given all values times `factor`: the same for every way that is linear in them.
    pub fn scaled_l2(&self, way: &Way, factor: f64) -> f64 {
        let times = |values: &[Rgb]| values.iter().map(|v| *v * factor).collect::<Vec<Rgb>>();
        let field = Reconstruction::new(&self.mesh, way.options, &times(&self.values), &times(&self.means));
        self.samples.scaled(factor).measure(&self.mesh, &field).l2
    }
}
