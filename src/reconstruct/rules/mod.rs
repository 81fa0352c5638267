//! Derivatives at the nodes, by the rules that a user may choose.
//!
//! ```text
//! GradientRule: seed-edge-normals, facet-normals (normals.rs) | least-squares (fit.rs) | zero --> gradients
//! TwistRule:    zero | adini (adini.rs), from the gradients | fit (fit.rs)                    --> Hessians
//! ```
//! Every rule looks at the node's own group of elements only: nothing crosses a C0 edge.

use rayon::prelude::*;

use super::derivatives::{Derivatives, in_frame};
use super::nodes::Nodal;
use super::{GivenDerivatives, GradientRule, ReconstructOptions, TwistRule};
use crate::geom::tangent_frame;
use crate::units::Rgb;

mod adini;
mod fit;
mod normals;

pub(super) use fit::stencil;

/// Gradients by the rule; Hessians too where a fit has them.
pub(super) fn estimate_gradients(nodal: &mut Nodal<'_>, options: &ReconstructOptions) {
    let fitted = options.gradients == GradientRule::LeastSquares || options.twists == TwistRule::Fit;
    nodal.derivatives = match options.gradients {
        GradientRule::Zero => return,
        _ if fitted => fit::fit_all(nodal),
        _ => vec![Derivatives::default(); nodal.table.len()],
    };
    let normals = match options.gradients {
        GradientRule::SeedEdgeNormals => normals::seed_edge_normals,
        GradientRule::FacetNormals => normals::facet_normals,
        GradientRule::LeastSquares | GradientRule::Zero => return,
    };
    let gradients = per_node(nodal, |node| normals(nodal, node));
    nodal.derivatives.iter_mut().zip(gradients).for_each(|(d, gradient)| d.gradient = gradient);
}

/// Hessians by the rule, once the gradients are settled.
pub(super) fn estimate_hessians(nodal: &mut Nodal<'_>, options: &ReconstructOptions) {
    if options.gradients == GradientRule::Zero {
        return;
    }
    match options.twists {
        TwistRule::Fit => {}
        TwistRule::Zero => nodal.derivatives.iter_mut().for_each(|d| d.hessian = Default::default()),
        TwistRule::Adini => {
            let hessians = per_node(nodal, |node| adini::hessian(nodal, node));
            nodal.derivatives.iter_mut().zip(hessians).for_each(|(d, hessian)| d.hessian = hessian);
        }
    }
}

/// Derivatives as given; without Hessians, `twists` makes them from the gradients (`fit` from the values).
pub(super) fn take(nodal: &mut Nodal<'_>, given: GivenDerivatives<'_>, twists: TwistRule) {
    if given.hessians.is_none() && twists == TwistRule::Fit {
        nodal.derivatives = fit::fit_all(nodal);
    }
    for node in 0..nodal.table.len() {
        let v = nodal.table.vertex(node).0 as usize;
        let (t1, t2) = tangent_frame(nodal.mesh.vertices[v].normal);
        let [x, y, z] = given.gradients[v];
        let derivatives = &mut nodal.derivatives[node];
        derivatives.gradient = [t1, t2].map(|t| x * t.x + y * t.y + z * t.z);
        if let Some(hessians) = given.hessians {
            let second = |a: glam::DVec3, b: glam::DVec3| -> Rgb {
                let (a, b) = (a.to_array(), b.to_array());
                (0..9).map(|k| hessians[v][k / 3][k % 3] * (a[k / 3] * b[k % 3])).sum()
            };
            derivatives.hessian = [second(t1, t1), second(t1, t2), second(t2, t2)];
        }
    }
    if given.hessians.is_none() && twists == TwistRule::Adini {
        let hessians = per_node(nodal, |node| adini::hessian(nodal, node));
        nodal.derivatives.iter_mut().zip(hessians).for_each(|(d, hessian)| d.hessian = hessian);
    }
}

/// One answer per node, the same for any number of threads.
fn per_node<R: Send>(nodal: &Nodal<'_>, answer: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    (0..nodal.table.len()).into_par_iter().with_min_len(256).map(answer).collect()
}

/// From a node to another: (u, v) in the first one's tangent plane, and the difference of their values.
fn lifted(nodal: &Nodal<'_>, from: usize, to: usize) -> ([f64; 2], Rgb) {
    let [a, b] = [from, to].map(|n| nodal.table.vertex(n).0 as usize);
    let vertex = &nodal.mesh.vertices[a];
    let d = nodal.mesh.vertices[b].position - vertex.position;
    (in_frame(tangent_frame(vertex.normal), d), nodal.values[b] - nodal.values[a])
}
