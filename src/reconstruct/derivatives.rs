//! Gradient and Hessian in a vertex's tangent plane, and what an element asks of them.

use crate::geom::DVec3;
use crate::units::Rgb;

/// First and second derivatives per channel in the tangent frame of the vertex normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Derivatives {
    /// d/du, d/dv (W/m^3).
    pub(super) gradient: [Rgb; 2],
    /// d2/du2, d2/dudv, d2/dv2 (W/m^4).
    pub(super) hessian: [Rgb; 3],
}

/// What an element needs to know of one corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) position: DVec3,
    pub(super) value: Rgb,
    pub(super) frame: (DVec3, DVec3),
    pub(super) derivatives: Derivatives,
}

/// Components of `d` in the plane of `frame`.
pub(super) fn in_frame(frame: (DVec3, DVec3), d: DVec3) -> [f64; 2] {
    [d.dot(frame.0), d.dot(frame.1)]
}

impl Derivatives {
    /// The same with another gradient: that of the frame's plane in which g . a = along_a and g . b = along_b; `None` when a
    /// and b do not span it.
    pub(super) fn follow(
        &self,
        frame: (DVec3, DVec3),
        (a, along_a): (DVec3, Rgb),
        (b, along_b): (DVec3, Rgb),
    ) -> Option<Derivatives> {
        let [p, q] = dual(frame, a, b)?;
        let gradient = [0, 1].map(|k| along_a * p[k] + along_b * q[k]);
        Some(Derivatives { gradient, ..*self })
    }

    /// The same with the Hessian changed so that a^T H b grows by `twist`, and neither a^T H a nor b^T H b changes.
    pub(super) fn twisted(&self, frame: (DVec3, DVec3), a: DVec3, b: DVec3, twist: Rgb) -> Derivatives {
        let Some([p, q]) = dual(frame, a, b) else { return *self };
        let part = [2.0 * p[0] * q[0], p[0] * q[1] + p[1] * q[0], 2.0 * p[1] * q[1]];
        let mut hessian = self.hessian;
        hessian.iter_mut().zip(part).for_each(|(h, part)| *h += twist * part);
        Derivatives { hessian, ..*self }
    }

    /// `factor` times both.
    pub(super) fn scaled(&self, factor: f64) -> Derivatives {
        Derivatives { gradient: self.gradient.map(|g| g * factor), hessian: self.hessian.map(|h| h * factor) }
    }
}

/// Vectors p, q of the frame's plane with p . a = q . b = 1 and p . b = q . a = 0.
fn dual(frame: (DVec3, DVec3), a: DVec3, b: DVec3) -> Option<[[f64; 2]; 2]> {
    let ([au, av], [bu, bv]) = (in_frame(frame, a), in_frame(frame, b));
    let det = au * bv - av * bu;
    let spans = det.abs() > 1e-9 * a.length() * b.length();
    spans.then(|| [[bv / det, -bu / det], [-av / det, au / det]])
}

impl Node {
    /// g . d
    pub(super) fn slope(&self, d: DVec3) -> Rgb {
        let [u, v] = self.derivatives.gradient;
        u * d.dot(self.frame.0) + v * d.dot(self.frame.1)
    }

    /// a^T H b
    pub(super) fn second(&self, a: DVec3, b: DVec3) -> Rgb {
        let ([au, av], [bu, bv]) = (in_frame(self.frame, a), in_frame(self.frame, b));
        let [uu, uv, vv] = self.derivatives.hessian;
        uu * (au * bu) + uv * (au * bv + av * bu) + vv * (av * bv)
    }
}
