//! A polygon cut into what the mesh can hold: triangles and planar convex quads.
//!
//! ```text
//! 3 corners, or 4 in one plane and convex --> as they are      else --ear cutting--> triangles
//! ```
//! Source: Held 2001, "FIST: fast industrial-strength triangulation of polygons" (crate `earcut`).

use glam::DVec3;

/// Height over the longest edge below which three points are one line.
const MIN_HEIGHT: f64 = 1e-9;

/// Distance of a quad's corners from one plane over its longest edge, up to which it is planar.
const MAX_NON_PLANARITY: f64 = 1e-6;

/// Likewise over the largest coordinate: what single precision makes of a planar quad.
const SINGLE_PRECISION: f64 = 2.4e-7;

/// Cuts polygons, one after the other.
#[derive(Default)]
pub(super) struct Cutter {
    ears: earcut::Earcut<f64>,
    flat: Vec<[f64; 2]>,
    triangles: Vec<u32>,
}

impl Cutter {
    /// Calls `face` with the 3 or 4 corners of each face with an area.
    pub(super) fn cut(&mut self, ring: &[(u32, u32)], places: &[DVec3], mut face: impl FnMut(&[(u32, u32)])) {
        let at = |i: usize| places[ring[i].0 as usize];
        match ring.len() {
            0..=2 => {}
            3 => {
                if has_area([at(0), at(1), at(2)]) {
                    face(ring);
                }
            }
            4 if is_planar_convex([at(0), at(1), at(2), at(3)]) => face(ring),
            4 => {
                // The diagonal that is inside: of a concave quad the one at the dent, else the shorter one.
                let [first, second] = [[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]];
                let folds = |t: &[[usize; 3]; 2]| {
                    let n = t.map(|[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a)).normalize_or_zero());
                    n[0].dot(n[1])
                };
                let (a, b) = (folds(&first), folds(&second));
                let shorter = at(0).distance_squared(at(2)) <= at(1).distance_squared(at(3));
                let chosen = if (a > 0.0) == (b > 0.0) { shorter } else { a > b };
                for [i, j, k] in if chosen { first } else { second } {
                    if has_area([at(i), at(j), at(k)]) {
                        face(&[ring[i], ring[j], ring[k]]);
                    }
                }
            }
            n => {
                let corners: Vec<[f64; 3]> = (0..n).map(|i| at(i).to_array()).collect();
                self.flat.clear();
                if !earcut::utils3d::project3d_to_2d(&corners, n, &mut self.flat) {
                    return;
                }
                self.ears.earcut_slice::<u32>(&self.flat, &[], &mut self.triangles);
                let normal = newell(&corners);
                for t in self.triangles.chunks_exact(3) {
                    let [i, mut j, mut k] = [t[0] as usize, t[1] as usize, t[2] as usize];
                    if (at(j) - at(i)).cross(at(k) - at(i)).dot(normal) < 0.0 {
                        (j, k) = (k, j);
                    }
                    if has_area([at(i), at(j), at(k)]) {
                        face(&[ring[i], ring[j], ring[k]]);
                    }
                }
            }
        }
    }
}

/// Twice the area vector of a polygon (Newell).
fn newell(corners: &[[f64; 3]]) -> DVec3 {
    let at = |i: usize| DVec3::from_array(corners[i % corners.len()]);
    (1..corners.len().saturating_sub(1)).map(|i| (at(i) - at(0)).cross(at(i + 1) - at(0))).sum()
}

fn has_area(v: [DVec3; 3]) -> bool {
    let size = (0..3).map(|i| v[i].distance(v[(i + 1) % 3])).fold(0.0, f64::max);
    (v[1] - v[0]).cross(v[2] - v[0]).length() / (size * size) > MIN_HEIGHT
}

/// Planar within single precision of its coordinates, and convex with no straight corner.
pub(super) fn is_planar_convex(v: [DVec3; 4]) -> bool {
    let normal = (v[2] - v[0]).cross(v[3] - v[1]);
    let size = (0..4).map(|i| v[i].distance(v[(i + 1) % 4])).fold(0.0, f64::max);
    let Some(normal) = normal.try_normalize() else { return false };
    let reach = v.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let limit = (MAX_NON_PLANARITY * size).max((SINGLE_PRECISION * reach).min(1e-3 * size));
    // Both diagonals are across the normal: the distance between them is twice that of each corner from the mean plane.
    let off_plane = (v[1] - v[0]).dot(normal).abs();
    let turns_left = |i: usize| {
        let (back, here, forth) = (v[(i + 3) % 4], v[i], v[(i + 1) % 4]);
        (here - back).cross(forth - here).dot(normal) / (size * size) > MIN_HEIGHT
    };
    off_plane <= limit && (0..4).all(turns_left)
}
