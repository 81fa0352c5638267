//! What a user may choose: the method, the rule for gradients, the rule for twists.

use serde::{Deserialize, Serialize};

/// How irradiance is reconstructed inside elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The element's mean.
    Constant,
    /// Bilinear on quads, linear on triangles.
    Bilinear,
    /// Powell-Sabin quadratics on triangles of twelve parts; quads as two triangles.
    Quadratic,
    /// Clough-Tocher cubics on triangles; quads as two triangles.
    CubicTriangle,
    /// Bicubic Hermite on quads, Clough-Tocher on triangles.
    #[default]
    Hermite,
    /// The same, with the derivatives at kinks limited so that nothing overshoots there.
    HermiteLimited,
}

/// Where the gradients at the vertices come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GradientRule {
    /// The mean of the normals of the edges at the vertex, as the 1992 paper says: half the gradient.
    SeedEdgeNormals,
    /// The mean of the normals of the facets around the vertex.
    FacetNormals,
    /// A quadratic fitted to the vertices around.
    #[default]
    LeastSquares,
    /// No gradients and no twists: flat at every vertex.
    Zero,
}

/// Where the second derivatives come from that the twists of bicubic patches take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TwistRule {
    /// No second derivatives.
    Zero,
    /// Adini's twists of the quads around the vertex, averaged in world units.
    Adini,
    /// The quadratic fitted to the vertices around.
    #[default]
    Fit,
}

/// A method with its rules; `constant` and `bilinear` need none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReconstructOptions {
    /// The method.
    pub method: Method,
    /// Its gradients.
    #[serde(default)]
    pub gradients: GradientRule,
    /// Its twists.
    #[serde(default)]
    pub twists: TwistRule,
}

impl From<Method> for ReconstructOptions {
    fn from(method: Method) -> ReconstructOptions {
        ReconstructOptions { method, ..ReconstructOptions::default() }
    }
}

impl Method {
    /// All methods, simplest first.
    pub const ALL: [Method; 6] = [
        Method::Constant,
        Method::Bilinear,
        Method::Quadratic,
        Method::CubicTriangle,
        Method::Hermite,
        Method::HermiteLimited,
    ];

    /// Its name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Method::Constant => "constant",
            Method::Bilinear => "bilinear",
            Method::Quadratic => "quadratic",
            Method::CubicTriangle => "cubic-triangle",
            Method::Hermite => "hermite",
            Method::HermiteLimited => "hermite-limited",
        }
    }
}

impl GradientRule {
    /// All rules.
    pub const ALL: [GradientRule; 4] = [
        GradientRule::SeedEdgeNormals,
        GradientRule::FacetNormals,
        GradientRule::LeastSquares,
        GradientRule::Zero,
    ];

    /// Its name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            GradientRule::SeedEdgeNormals => "seed-edge-normals",
            GradientRule::FacetNormals => "facet-normals",
            GradientRule::LeastSquares => "least-squares",
            GradientRule::Zero => "zero",
        }
    }
}

impl TwistRule {
    /// All rules.
    pub const ALL: [TwistRule; 3] = [TwistRule::Zero, TwistRule::Adini, TwistRule::Fit];

    /// Its name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            TwistRule::Zero => "zero",
            TwistRule::Adini => "adini",
            TwistRule::Fit => "fit",
        }
    }
}
