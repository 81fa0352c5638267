//! Bilinear on quads, linear on triangles (Gouraud 1971).

use super::field::{Field, corner_positions, quad_tangents, world_gradient};
use crate::mesh::{Continuity, Corners, Hanging, Mesh, SurfacePoint};
use crate::units::Rgb;

/// One value per vertex; hanging ones have the mean of their edge's ends.
#[derive(Debug)]
pub(super) struct Bilinear {
    values: Vec<Rgb>,
}

impl Bilinear {
    pub(super) fn new(mesh: &Mesh, values: &[Rgb]) -> Bilinear {
        let mut values = values.to_vec();
        for Hanging { vertex, ends: [a, b], coarse, edge, .. } in &mesh.hanging {
            if mesh.elements[coarse.0 as usize].continuity[usize::from(*edge)] != Continuity::Broken {
                values[vertex.0 as usize] = (values[a.0 as usize] + values[b.0 as usize]) * 0.5;
            }
        }
        Bilinear { values }
    }
}

impl Field for Bilinear {
    fn value(&self, mesh: &Mesh, at: SurfacePoint) -> Rgb {
        let (s, t) = (at.st.x, at.st.y);
        match mesh.elements[at.element.0 as usize].corners {
            Corners::Triangle(v) => {
                let [a, b, c] = v.map(|v| self.values[v.0 as usize]);
                a * (1.0 - s - t) + b * s + c * t
            }
            Corners::Quad(v) => {
                let [a, b, c, d] = v.map(|v| self.values[v.0 as usize]);
                (a * (1.0 - s) + b * s) * (1.0 - t) + (d * (1.0 - s) + c * s) * t
            }
        }
    }

    fn gradient(&self, mesh: &Mesh, at: SurfacePoint) -> [Rgb; 3] {
        let (s, t) = (at.st.x, at.st.y);
        let corners = &mesh.elements[at.element.0 as usize].corners;
        let x = corner_positions(mesh, corners);
        match *corners {
            Corners::Triangle(v) => {
                let [a, b, c] = v.map(|v| self.values[v.0 as usize]);
                world_gradient([x[1] - x[0], x[2] - x[0]], [b - a, c - a])
            }
            Corners::Quad(v) => {
                let [a, b, c, d] = v.map(|v| self.values[v.0 as usize]);
                let f_s = (b - a) * (1.0 - t) + (c - d) * t;
                let f_t = (d - a) * (1.0 - s) + (c - b) * s;
                world_gradient(quad_tangents(&x, s, t), [f_s, f_t])
            }
        }
    }

    fn memory_bytes(&self) -> usize {
        self.values.capacity() * size_of::<Rgb>()
    }
}
