//! Two ways of shooting power against each other on scenes without a closed form.
//!
//! ```text
//! scene --vertex (kernel x visibility, no noise)--> E_mean  -+-> RMS difference over the elements, against what
//!       --hemisphere (cosine-distributed rays)----> E_mean  -'   `hemisphere` says of its own error
//! ```

use super::row::{Group, Row};
use super::setting::solve_with;
use crate::experiments::ExperimentError;
use crate::radiosity::FormFactorMethod;
use crate::scene::{MeshTarget, Meshing};

const SCENES: [(&str, &str); 2] = [
    ("cornell-box", include_str!("../../../scenes/cornell-box/scene.toml")),
    ("sphere-room", include_str!("../../../scenes/sphere-room/scene.toml")),
];
/// The estimate is a standard error, of noise alone: what `vertex` gets wrong by few visibility rays is on top.
const ESTIMATES: f64 = 1.5;
/// Total incident power. No noise (seeds move it by 0.05 %): a patch shoots evenly what its four elements received, a bundle
/// starts where its element lies, which makes 0.6 % on the coarse mesh of the comparison.
const POWER: f64 = 0.01;

/// Rows of `hemisphere` against `vertex`.
///
/// # Errors
/// None in software.
pub fn rows(elements: u32) -> Result<Vec<Row>, ExperimentError> {
    let mut rows = Vec::new();
    for (name, text) in SCENES {
        let meshing = |m: Meshing| Meshing { target: MeshTarget::Elements(elements), ..m };
        let vertex = solve_with(text, meshing, FormFactorMethod::Vertex)?;
        let hemisphere = solve_with(text, meshing, FormFactorMethod::Hemisphere)?;
        let estimate = hemisphere.solution.error_estimate.as_ref().map_or(f64::NAN, |e| e.relative_rms);
        let (mut square, mut sums) = (0.0, [0.0; 2]);
        let pairs = vertex.solution.element_irradiance.iter().zip(&hemisphere.solution.element_irradiance);
        for (element, (v, h)) in vertex.mesh.elements.iter().zip(pairs) {
            let [v, h] = [v, h].map(|e| e.total().sum());
            square += element.area_m2 * (v - h) * (v - h);
            sums[0] += element.area_m2 * v;
            sums[1] += element.area_m2 * h;
        }
        let area_m2 = vertex.mesh.total_area_m2();
        let rms = (square / area_m2).sqrt() / (sums[0] / area_m2);
        let mut add = |what: &str, formula, expected, ours, bound| {
            let case = format!("{name}: {what}");
            rows.push(Row { group: Group::Methods, case, formula, expected, ours, bound });
        };
        add(
            "hemisphere less vertex, RMS of E_mean over the mean",
            "0; bound: 1.5 x the error estimate",
            0.0,
            rms,
            ESTIMATES * estimate,
        );
        add("incident power by hemisphere (W)", "by vertex", sums[0], sums[1], POWER);
    }
    Ok(rows)
}
