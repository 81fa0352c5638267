//! Ray x patch in f64: the oracle of the ICU.
//!
//! ```text
//! words -> f64 (exact) -> a = v - o (exact) -> c = a_i x a_j (expansion; rounded to K bits, once) -> e = c . d
//!                               signs of e: of exact geometry by `robust::orient3d`; of rounded c by expansions
//!                         n = sum of c, den = n . d, num = a_0 . n -> estimate of num/den, exact remainder -> t, once
//! ```
//! With full products the sign of an edge value is the orientation of (v_i, v_j, o + d, o), whose coordinates are
//! integers under 2^30 and so exact as f64. All wires are integers under 2^105, which two parts hold. Rounding: the
//! quotient's estimate q is off by under 2^-10 where it can count (t words end at 2^34), so the rounded quotient is q
//! or its neighbour, and the exact signs of num - q den and of 2 (num - q den) against den say which.
//! Source: DESIGN 3.2, 3.3; Shewchuk 1997. Not modelled: pipeline, time.

use std::cmp::Ordering;

use robust::{Coord3D, orient3d};

use super::expansion::{Expansion, is_odd, power_of_two};
use crate::datapath::{Facing, HitWords, PatchWords, RayWords};
use crate::fixed::{Formats, Rounding};

/// The wires of a test, each the exact sum of its expansion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wires {
    /// Corners relative to the origin.
    pub a: [[i64; 3]; 4],
    /// Rounded normals of the edges 01, 12, 02, 23, 30 (for a triangle 01, 12, 20 and zeros).
    pub c: [[i128; 3]; 5],
    /// Their edge values.
    pub e: [i128; 5],
    /// The triangles v0 v1 v2 and, of a quad, v0 v2 v3.
    pub triangles: [Option<TriangleWires>; 2],
}

/// The wires of one triangle of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleWires {
    /// The ray's line meets the triangle.
    pub inside: bool,
    /// Face normal.
    pub n: [i128; 3],
    /// Sum of the edge values.
    pub den: i128,
    /// a_0 . n.
    pub num: i128,
    /// Dividend: num, in units in which the quotient is a t word.
    pub num_shifted: i128,
    /// Divisor.
    pub den_shifted: i128,
}

/// A wire: an integer under 2^105.
type Wire = Expansion<2>;

/// A directed edge of a patch. A quad's diagonal is one edge, rounded once, which the first triangle runs backward.
#[derive(Clone, Copy)]
struct Edge {
    /// Its place in [`Wires::c`].
    place: usize,
    from: usize,
    to: usize,
    backward: bool,
}

const fn edge(place: usize, from: usize, to: usize) -> Edge {
    Edge { place, from, to, backward: false }
}

const TRIANGLE: [Edge; 3] = [edge(0, 0, 1), edge(1, 1, 2), edge(2, 2, 0)];
const QUAD: [[Edge; 3]; 2] = [
    [edge(0, 0, 1), edge(1, 1, 2), Edge { place: 2, from: 0, to: 2, backward: true }],
    [edge(2, 0, 2), edge(3, 2, 3), edge(4, 3, 0)],
];

/// Tests one ray with one patch. The words must be valid for the formats.
pub fn intersect(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Option<HitWords> {
    let test = Test::new(formats, ray, patch);
    let hit = |edges: &[Edge; 3]| {
        if !test.contains(edges) {
            return None;
        }
        let (t, facing) = test.range(&test.face(edges.map(|edge| test.normal(&edge))))?;
        Some(HitWords { t, patch: patch.id, facing })
    };
    if patch.is_triangle {
        return hit(&TRIANGLE);
    }
    match (hit(&QUAD[0]), hit(&QUAD[1])) {
        // One id: equal t keeps the first triangle.
        (Some(first), Some(second)) => Some(if second.t < first.t { second } else { first }),
        (first, second) => first.or(second),
    }
}

/// The wires of a test.
pub fn wires(formats: &Formats, ray: &RayWords, patch: &PatchWords) -> Wires {
    let test = Test::new(formats, ray, patch);
    let (mut normals, mut values) = ([[Wire::ZERO; 3]; 5], [Wire::ZERO; 5]);
    let loops: &[[Edge; 3]] = if patch.is_triangle { &[TRIANGLE] } else { &QUAD };
    for edge in loops.iter().flatten().filter(|edge| !edge.backward) {
        normals[edge.place] = test.normal(edge);
        values[edge.place] = test.along(&normals[edge.place], test.dir);
    }
    let (up, down) = test.t_scales();
    let triangle = |edges: &[Edge; 3]| {
        let face = test.face(edges.map(|edge| edge.turn(normals[edge.place])));
        let signs = edges.map(|edge| edge.turn([values[edge.place]])[0].sign());
        TriangleWires {
            inside: signs.contains(&Ordering::Less) != signs.contains(&Ordering::Greater),
            n: face.normal.map(Wire::to_i128),
            den: face.den.to_i128(),
            num: face.num.to_i128(),
            num_shifted: face.num.scaled(up).to_i128(),
            den_shifted: face.den.scaled(down).to_i128(),
        }
    };
    Wires {
        // Differences of coordinate words are integers: the conversion is exact.
        a: test.a.map(|p| p.map(|x| x as i64)),
        c: normals.map(|normal| normal.map(Wire::to_i128)),
        e: values.map(Wire::to_i128),
        triangles: [0, 1].map(|k| loops.get(k).map(triangle)),
    }
}

impl Edge {
    /// A quantity of the edge as it is run: negated for backward.
    fn turn<const N: usize>(&self, forward: [Wire; N]) -> [Wire; N] {
        if self.backward { forward.map(|word| word.scaled(-1.0)) } else { forward }
    }
}

/// One ray and one patch as real numbers, in steps of their words.
struct Test<'a> {
    formats: &'a Formats,
    t_max: u64,
    origin: [f64; 3],
    dir: [f64; 3],
    corners: [[f64; 3]; 4],
    /// Corners relative to the origin.
    a: [[f64; 3]; 4],
}

/// What the division of a triangle starts from.
struct Face {
    normal: [Wire; 3],
    den: Wire,
    num: Wire,
}

impl<'a> Test<'a> {
    fn new(formats: &'a Formats, ray: &RayWords, patch: &PatchWords) -> Test<'a> {
        let origin = ray.origin.map(f64::from);
        let corners = patch.corners.map(|corner| corner.map(f64::from));
        let a = corners.map(|corner| [0, 1, 2].map(|k| corner[k] - origin[k]));
        Test { formats, t_max: ray.t_max, origin, dir: ray.dir.map(f64::from), corners, a }
    }

    /// The edge's normal as the board keeps it.
    fn normal(&self, edge: &Edge) -> [Wire; 3] {
        let (p, q) = (self.a[edge.from], self.a[edge.to]);
        let kept = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
            let mut exact = Expansion::<4>::ZERO;
            exact.add_product(p[i], q[j]);
            exact.add_product(-p[j], q[i]);
            self.keep(exact.compress())
        });
        edge.turn(kept)
    }

    /// Rounds a product of coordinates from 2F fraction bits to the K that are kept.
    fn keep(&self, exact: Wire) -> Wire {
        match self.dropped_bits() {
            0 => exact,
            dropped => exact.scaled(power_of_two(-dropped)).rounded(self.formats.rounding),
        }
    }

    /// 2F - K, or 0 with full products.
    fn dropped_bits(&self) -> i32 {
        let full = 2 * self.formats.coord_frac_bits.cast_signed();
        full - self.formats.cross_keep_bits.map_or(full, u32::cast_signed)
    }

    /// The inner product of a normal with a vector.
    fn along(&self, normal: &[Wire; 3], vector: [f64; 3]) -> Wire {
        let mut sum = Expansion::<12>::ZERO;
        for (word, x) in normal.iter().zip(vector) {
            sum.add_scaled(word, x);
        }
        sum.compress()
    }

    /// The sign of an edge value.
    fn side(&self, edge: &Edge) -> Ordering {
        if self.dropped_bits() == 0 {
            let forward = self.orientation(edge);
            if edge.backward { forward.reverse() } else { forward }
        } else {
            self.clear_side(edge).unwrap_or_else(|| self.along(&self.normal(edge), self.dir).sign())
        }
    }

    /// The sign of an edge value of rounded products, where plain f64 arithmetic is sure of it.
    ///
    /// With S = 2^(F+1), u = 2^-53: each of the two products of a component of c is off by u S^2, their difference by
    /// another 2 u S^2; times d (under 2^D), with the product's own error, 6 u S^2 2^D; three of them and two sums, of
    /// magnitudes under 4 and 6 S^2 2^D: 28 u S^2 2^D, with higher powers of u under 32 u S^2 2^D = 2^(2F+D-46).
    /// Rounding to K bits moves each component of c by under one of 2^(2F-K), so e by under 2^(2F-K) (|d_x|+|d_y|+|d_z|).
    fn clear_side(&self, edge: &Edge) -> Option<Ordering> {
        let (p, q, d) = (self.a[edge.from], self.a[edge.to], self.dir);
        let value = (p[1] * q[2] - p[2] * q[1]) * d[0]
            + (p[2] * q[0] - p[0] * q[2]) * d[1]
            + (p[0] * q[1] - p[1] * q[0]) * d[2];
        let Formats { coord_frac_bits, dir_frac_bits, .. } = *self.formats;
        let arithmetic = power_of_two((2 * coord_frac_bits + dir_frac_bits).cast_signed() - 46);
        let rounding = power_of_two(self.dropped_bits()) * d.iter().map(|x| x.abs()).sum::<f64>();
        let forward = (value.abs() > arithmetic + rounding).then(|| value.total_cmp(&0.0))?;
        Some(if edge.backward { forward.reverse() } else { forward })
    }

    /// The sign of det(v_from - o, v_to - o, d) by an exact predicate.
    fn orientation(&self, edge: &Edge) -> Ordering {
        let point = |p: [f64; 3]| Coord3D { x: p[0], y: p[1], z: p[2] };
        let ahead = [0, 1, 2].map(|k| self.origin[k] + self.dir[k]);
        let (from, to) = (self.corners[edge.from], self.corners[edge.to]);
        let det = orient3d(point(from), point(to), point(ahead), point(self.origin));
        det.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
    }

    /// Whether the ray's line meets the triangle of these edges: no two edge values of opposite sign, not all 0.
    fn contains(&self, edges: &[Edge; 3]) -> bool {
        let mut seen = Ordering::Equal;
        for edge in edges {
            match self.side(edge) {
                Ordering::Equal => {}
                side if seen == side.reverse() => return false,
                side => seen = side,
            }
        }
        seen.is_ne()
    }

    /// The face of a triangle from the normals of its edges.
    fn face(&self, edges: [[Wire; 3]; 3]) -> Face {
        let normal = [0, 1, 2].map(|k| {
            let mut sum = Expansion::<6>::ZERO;
            edges.iter().for_each(|c| sum.add_all(&c[k]));
            sum.compress()
        });
        let den = self.along(&normal, self.dir);
        let num = self.along(&normal, self.a[0]);
        Face { normal, den, num }
    }

    /// Powers of two for num and den, one of them 1: t = num/den 2^(D-F) in units of the direction, its word 2^T that.
    fn t_scales(&self) -> (f64, f64) {
        let Formats { coord_frac_bits, dir_frac_bits, t_frac_bits, .. } = *self.formats;
        let exponent =
            t_frac_bits.cast_signed() + dir_frac_bits.cast_signed() - coord_frac_bits.cast_signed();
        (power_of_two(exponent.max(0)), power_of_two((-exponent).max(0)))
    }

    /// Distance and side of a triangle that contains the ray's line, when they are in the range.
    fn range(&self, face: &Face) -> Option<(u64, Facing)> {
        if face.num.sign() == face.den.sign().reverse() {
            return None;
        }
        let (sign, facing) =
            if face.den.sign().is_lt() { (-1.0, Facing::Front) } else { (1.0, Facing::Back) };
        let (up, down) = self.t_scales();
        let t = rounded_quotient(
            &face.num.scaled(sign * up),
            &face.den.scaled(sign * down),
            self.formats.rounding,
        )?;
        (t <= self.t_max).then_some((t, facing))
    }
}

/// num / den for num >= 0 and den > 0, rounded to an integer, once; none where it is far over every t word.
fn rounded_quotient(num: &Wire, den: &Wire, rounding: Rounding) -> Option<u64> {
    const FAR: f64 = (1_u64 << 40) as f64;
    let estimate = num.estimate() / den.estimate();
    // Off by under 2^-50 of itself: a quotient under 2^40 by under 2^-10.
    if estimate > FAR {
        return None;
    }
    let q = estimate.round();
    // num - q den, which lies within (1/2 + 2^-10) den of 0.
    let mut rest = Expansion::<6>::ZERO;
    rest.add_all(num);
    rest.add_scaled(den, -q);
    let step = match rounding {
        Rounding::Floor => {
            if rest.sign().is_lt() {
                -1.0
            } else {
                0.0
            }
        }
        Rounding::NearestEven | Rounding::HalfAway => {
            let (mut over, mut under) = (Expansion::<8>::ZERO, Expansion::<8>::ZERO);
            for (sum, sign) in [(&mut over, -1.0), (&mut under, 1.0)] {
                sum.add_all(&rest.scaled(2.0));
                sum.add_all(&den.scaled(sign));
            }
            let to_even = rounding == Rounding::NearestEven && is_odd(q);
            // Halfway over q: away from 0 is up. Halfway under q: q is away from 0.
            let up =
                over.sign().is_gt() || (over.sign().is_eq() && (to_even || rounding == Rounding::HalfAway));
            let down = under.sign().is_lt() || (under.sign().is_eq() && to_even);
            f64::from(u8::from(up)) - f64::from(u8::from(down))
        }
    };
    // An integer from 0 to 2^40.
    Some((q + step) as u64)
}

#[cfg(test)]
#[path = "ray_patch_tests.rs"]
mod tests;
