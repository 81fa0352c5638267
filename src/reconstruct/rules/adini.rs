//! `adini`: the twists of the quads around a vertex, as one Hessian.
//!
//! ```text
//! per quad, at the node's corner (f_s, f_t of the shared gradients, edge by edge):
//!   f_st = (f_t(1,0) - f_t(0,0)) + (f_s(0,1) - f_s(0,0)) - (f(1,1) - f(1,0) - f(0,1) + f(0,0))
//!   wanted: x_s^T H x_t = f_st - g . x_st
//! all quads around, lengths taken out --least squares where three of them differ; else the mean of each one's smallest H--> H
//! ```
//! Second-order accurate on a regular grid; exact for quadratics there. On grids all quads ask for the same component of H.
//!
//! Source: Adini, Clough 1961; Farin, "Curves and Surfaces for CAGD", section 15.4 (twist estimation).

use super::super::bicubic::{CORNERS, corner_tangents};
use super::super::derivatives::in_frame;
use super::super::least_squares::LeastSquares;
use super::super::nodes::Nodal;
use crate::mesh::Corners;
use crate::units::Rgb;

/// d2/du2, d2/dudv, d2/dv2 at a node; 0 without quads.
pub(super) fn hessian(nodal: &Nodal<'_>, node: usize) -> [Rgb; 3] {
    let mut system = LeastSquares::default();
    let (mut sum, mut n) = ([Rgb::BLACK; 3], 0.0);
    for &element in nodal.table.elements(node) {
        if !matches!(nodal.mesh.elements[element.0 as usize].corners, Corners::Quad(_)) {
            continue;
        }
        let Some(corner) = (0..4).find(|c| nodal.table.at(element, *c) == node) else { continue };
        let nodes = nodal.corners(element);
        let x = nodes.each_ref().map(|n| n.position);
        // The corners reached along s and along t.
        let at = |i: usize, j: usize| CORNERS.iter().position(|c| *c == (i, j)).unwrap_or(0);
        let (i, j) = CORNERS[corner];
        let [x_s, x_t, x_st] = corner_tangents(&x, (i, j));
        let (here, along_s, along_t) = (&nodes[corner], &nodes[at(1 - i, j)], &nodes[at(i, 1 - j)]);
        let mixed = nodes[0].value - nodes[1].value + nodes[2].value - nodes[3].value;
        let far_t = corner_tangents(&x, (1 - i, j))[1];
        let far_s = corner_tangents(&x, (i, 1 - j))[0];
        // Backwards from corners at 1.
        let (step_s, step_t) = (1.0 - 2.0 * i as f64, 1.0 - 2.0 * j as f64);
        let twist = (along_s.slope(far_t) - here.slope(x_t)) * step_s
            + (along_t.slope(far_s) - here.slope(x_s)) * step_t
            - mixed;
        let wanted = twist - here.slope(x_st);
        let ([au, av], [bu, bv]) = (in_frame(here.frame, x_s), in_frame(here.frame, x_t));
        let size = au.hypot(av) * bu.hypot(bv);
        if size == 0.0 {
            continue;
        }
        let row = [au * bu, au * bv + av * bu, av * bv].map(|c| c / size);
        let right = wanted / size;
        system.push([row[0], row[1], row[2], 0.0, 0.0], right.0);
        // The smallest symmetric H (sum of squares of its four entries) that this quad is content with.
        let square = row[0] * row[0] + 0.5 * row[1] * row[1] + row[2] * row[2];
        for (sum, part) in sum.iter_mut().zip([row[0], 0.5 * row[1], row[2]]) {
            *sum += right * (part / square);
        }
        n += 1.0;
    }
    match system.solve::<3>() {
        Some(x) => [Rgb(x[0]), Rgb(x[1]), Rgb(x[2])],
        None if n > 0.0 => sum.map(|h| h / n),
        None => [Rgb::BLACK; 3],
    }
}
