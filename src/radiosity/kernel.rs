//! The form-factor kernel: Lambert's polygon formula, clipped to the receiver's horizon; Wallace's disc form to compare.
//!
//! ```text
//! point x, unit normal n, polygon v_k --> F = -1/(2 pi) sum_k angle(r_k, r_k+1) n . unit(r_k x r_k+1),  r_k = v_k - x
//! ```
//! The part of the polygon under the tangent plane of x is cut off first (Sutherland, Hodgman 1974, one plane).
//! Source: Lambert 1760, Photometria; Baum, Rushmeier, Winget 1989, "Improving radiosity solutions through the use
//! of analytically determined form-factors". Not modelled: occlusion, which is the caller's.
//!
//! Disc form: F = A cos cos' / (pi r^2 + A), a patch taken as a disc of its area at its centre (Wallace, Elmquist, Haines 1989).
//! The patch is quartered until a cell and its quarters agree to an eighth of [`DISC_ERROR`] of the whole; cells below the horizon give 0.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Estimated error of the disc form, as a share of the form factor.
pub const DISC_ERROR: f64 = 1e-3;
/// Quarterings of a patch for the disc form at most.
const MAX_DISC_DEPTH: u32 = 8;

/// Form factor of a point to a patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// Lambert's formula: exact.
    #[default]
    Polygon,
    /// Wallace's disc form of a subdivided patch: for comparison.
    Disc,
}

/// A point closer to a polygon's plane than this share of its distance to a corner lies in the plane.
const IN_PLANE_SHARE: f64 = 1e-12;
/// A quad whose fourth corner leaves the plane of the others by more than this share of its size is bent.
const BENT_SHARE: f64 = 1e-9;

/// Unoccluded form factor from a point with unit normal to a planar (or bent) polygon, in [0, 1].
///
/// Irradiance at the point = this x the polygon's (uniform) radiosity. The polygon counts as seen from its front
/// (vertices counter-clockwise as seen from the point); seen from its back or edge-on it gives 0. A bent quad is
/// two triangles that share the diagonal v0 v2. Under three corners give 0, over four are cut into triangles
/// around the first.
pub fn point_to_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    match polygon.len() {
        0..=2 => 0.0,
        3 | 4 => Source::new(polygon).form_factor(point, normal),
        n => (1..n - 1)
            .map(|k| Facet::triangle([polygon[0], polygon[k], polygon[k + 1]]).form_factor(point, normal))
            .sum::<f64>()
            .min(1.0),
    }
}

/// A triangle or quad made ready for many evaluations of the kernel.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    facets: [Facet; 2],
    n_facets: usize,
    kernel: Kernel,
}

impl Source {
    /// The same source by another kernel.
    pub fn with_kernel(self, kernel: Kernel) -> Source {
        Source { kernel, ..self }
    }

    /// Prepares a triangle or quad, corners counter-clockwise seen from its front (m).
    ///
    /// # Panics
    /// When `polygon` has neither 3 nor 4 corners.
    pub fn new(polygon: &[DVec3]) -> Source {
        match *polygon {
            [a, b, c] => Source::of([Facet::triangle([a, b, c]); 2], 1),
            [a, b, c, d] => {
                let flat = Facet::quad([a, b, c, d]);
                let size = (c - a).length().max((d - b).length());
                if (b - a).dot(flat.normal).abs() > BENT_SHARE * size {
                    Source::of([Facet::triangle([a, b, c]), Facet::triangle([a, c, d])], 2)
                } else {
                    Source::of([flat; 2], 1)
                }
            }
            _ => panic!("{} corners: a triangle or quad was expected", polygon.len()),
        }
    }

    fn of(facets: [Facet; 2], n_facets: usize) -> Source {
        Source { facets, n_facets, kernel: Kernel::Polygon }
    }

    /// Unoccluded form factor from `point` with unit `normal`, in [0, 1].
    #[inline]
    pub fn form_factor(&self, point: DVec3, normal: DVec3) -> f64 {
        if self.kernel == Kernel::Disc {
            let facets = self.facets[..self.n_facets].iter();
            return facets.map(|facet| facet.by_discs(point, normal)).sum::<f64>().min(1.0);
        }
        let first = self.facets[0].form_factor(point, normal);
        if self.n_facets == 1 { first } else { (first + self.facets[1].form_factor(point, normal)).min(1.0) }
    }

    /// Mean of the corners of the part above the horizon of `point` (m): where to look when no sample is above it.
    ///
    /// `None` when nothing is above the horizon.
    pub fn centre_above_horizon(&self, point: DVec3, normal: DVec3) -> Option<DVec3> {
        let (mut sum, mut n) = (DVec3::ZERO, 0);
        for facet in &self.facets[..self.n_facets] {
            facet.clip(point, normal, |r| {
                sum += r;
                n += 1;
            });
        }
        (n > 0).then(|| point + sum / n as f64)
    }

    /// Unit normal of the (first) facet.
    pub fn normal(&self) -> DVec3 {
        self.facets[0].normal
    }
}

/// A planar polygon of 3 or 4 corners.
#[derive(Clone, Copy, Debug)]
struct Facet {
    corners: [DVec3; 4],
    n: usize,
    normal: DVec3,
}

impl Facet {
    fn triangle([a, b, c]: [DVec3; 3]) -> Facet {
        Facet { corners: [a, b, c, c], n: 3, normal: (b - a).cross(c - a).normalize_or_zero() }
    }

    fn quad(corners: [DVec3; 4]) -> Facet {
        let [a, b, c, d] = corners;
        Facet { corners, n: 4, normal: (c - a).cross(d - b).normalize_or_zero() }
    }

    #[inline]
    fn form_factor(&self, point: DVec3, normal: DVec3) -> f64 {
        let to_first = self.corners[0] - point;
        let height = -to_first.dot(self.normal);
        // Written so that a NaN gives 0 as well.
        let in_front =
            height > 0.0 && height * height > IN_PLANE_SHARE * IN_PLANE_SHARE * to_first.length_squared();
        if !in_front {
            return 0.0;
        }
        let mut r = [to_first; 4];
        let mut above = 0;
        for (k, r) in r.iter_mut().enumerate().take(self.n) {
            *r = self.corners[k] - point;
            above += usize::from(r.dot(normal) >= 0.0);
        }
        let sum = if above == self.n {
            let mut sum = edge(r[self.n - 1], r[0], normal);
            for k in 1..self.n {
                sum += edge(r[k - 1], r[k], normal);
            }
            sum
        } else if above == 0 {
            return 0.0;
        } else {
            let (mut first, mut last, mut sum) = (None, DVec3::ZERO, 0.0);
            self.clip(point, normal, |r| {
                match first {
                    None => first = Some(r),
                    Some(_) => sum += edge(last, r, normal),
                }
                last = r;
            });
            sum + first.map_or(0.0, |first| edge(last, first, normal))
        };
        (sum * -0.5 * std::f64::consts::FRAC_1_PI).clamp(0.0, 1.0)
    }

    /// By Wallace's discs.
    fn by_discs(&self, point: DVec3, normal: DVec3) -> f64 {
        let disc = |cell: &[DVec3; 4]| self.disc(point, normal, cell);
        let whole = self.corners;
        let coarse = disc(&whole);
        let first: f64 = self.quarters(&whole).iter().map(disc).sum();
        // Cells agree with their quarters long before they are right: an eighth of the bound keeps to it.
        let tolerance = 0.125 * DISC_ERROR * first.max(coarse);
        self.discs_within(point, normal, &whole, coarse, tolerance, 0)
    }

    /// Sum over a cell's discs, quartered (three times at least: the horizon may cut it where it looks even) until it agrees
    /// with the coarser value. The tolerance is halved from level to level, not quartered: errors lie where the point is near,
    /// not everywhere.
    fn discs_within(
        &self,
        point: DVec3,
        normal: DVec3,
        cell: &[DVec3; 4],
        coarse: f64,
        tolerance: f64,
        depth: u32,
    ) -> f64 {
        let quarters = self.quarters(cell);
        let values = quarters.map(|q| self.disc(point, normal, &q));
        let sum: f64 = values.iter().sum();
        if depth >= 2 && (depth >= MAX_DISC_DEPTH || (sum - coarse).abs() <= tolerance) {
            return sum;
        }
        let parts = quarters.iter().zip(values);
        parts.map(|(q, v)| self.discs_within(point, normal, q, v, 0.5 * tolerance, depth + 1)).sum()
    }

    /// A cell as one disc of its area.
    fn disc(&self, point: DVec3, normal: DVec3, cell: &[DVec3; 4]) -> f64 {
        let [a, b, c, d] = *cell;
        let (centre, area) = match self.n {
            3 => ((a + b + c) / 3.0, 0.5 * (b - a).cross(c - a).length()),
            _ => (0.25 * (a + b + c + d), 0.5 * (c - a).cross(d - b).length()),
        };
        let r = centre - point;
        let cosines = r.dot(normal).max(0.0) * (-r.dot(self.normal)).max(0.0);
        let r2 = r.length_squared();
        if cosines > 0.0 { area * cosines / (r2 * (std::f64::consts::PI * r2 + area)) } else { 0.0 }
    }

    fn quarters(&self, cell: &[DVec3; 4]) -> [[DVec3; 4]; 4] {
        quarters(cell, self.n == 3)
    }

    /// Gives the corners, relative to `point`, of the part of the facet above the horizon, in order.
    fn clip(&self, point: DVec3, normal: DVec3, mut corner: impl FnMut(DVec3)) {
        let mut a = self.corners[self.n - 1] - point;
        let mut height_a = a.dot(normal);
        for k in 0..self.n {
            let b = self.corners[k] - point;
            let height_b = b.dot(normal);
            if (height_a >= 0.0) != (height_b >= 0.0) {
                corner(a + (b - a) * (height_a / (height_a - height_b)));
            }
            if height_b >= 0.0 {
                corner(b);
            }
            (a, height_a) = (b, height_b);
        }
    }
}

/// A triangle (its last corner twice) or quad cut at the middles of its edges.
pub(super) fn quarters([a, b, c, d]: &[DVec3; 4], is_triangle: bool) -> [[DVec3; 4]; 4] {
    let (a, b, c, d) = (*a, *b, *c, *d);
    let mid = |p: DVec3, q: DVec3| 0.5 * (p + q);
    if is_triangle {
        let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
        return [[a, ab, ca, ca], [ab, b, bc, bc], [ca, bc, c, c], [bc, ca, ab, ab]];
    }
    let (ab, bc, cd, da, m) = (mid(a, b), mid(b, c), mid(c, d), mid(d, a), 0.25 * (a + b + c + d));
    [[a, ab, m, da], [ab, b, bc, m], [m, bc, c, cd], [da, m, cd, d]]
}

/// angle(a, b) n . unit(a x b), the cross product as a x (b - a), which keeps its digits for short edges; 0 when
/// the edge points at the receiver, where the limit is 0 or undefined.
#[inline]
fn edge(a: DVec3, b: DVec3, normal: DVec3) -> f64 {
    let cross = a.cross(b - a);
    let sine = cross.length();
    if sine > 0.0 { normal.dot(cross) * angle_over_sine(sine, a.dot(b)) } else { 0.0 }
}

/// atan2(s, c) / s for s > 0: most edges are short as seen from the receiver, where the series of atan, with
/// (1/4)^24 / 25 < 2^-52 left out, takes a third of the time.
#[inline]
fn angle_over_sine(s: f64, c: f64) -> f64 {
    if s >= 0.25 * c {
        return s.atan2(c) / s;
    }
    let t = s / c;
    let z = t * t;
    let z2 = z * z;
    let z4 = z2 * z2;
    let low = (1.0 - z / 3.0) + (1.0 / 5.0 - z / 7.0) * z2;
    let middle = (1.0 / 9.0 - z / 11.0) + (1.0 / 13.0 - z / 15.0) * z2;
    let high = (1.0 / 17.0 - z / 19.0) + (1.0 / 21.0 - z / 23.0) * z2;
    ((low + middle * z4) + high * (z4 * z4)) / c
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use proptest::prelude::*;

    const Z: DVec3 = DVec3::Z;

    /// a x b rectangle in the plane z = c over the origin's quadrant, facing down.
    fn ceiling(a: f64, b: f64, c: f64) -> [DVec3; 4] {
        [DVec3::new(0., 0., c), DVec3::new(0., b, c), DVec3::new(a, b, c), DVec3::new(a, 0., c)]
    }

    fn parallel_closed_form(a: f64, b: f64, c: f64) -> f64 {
        let (a, b) = (a / c, b / c);
        let part = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        (part(a, b) + part(b, a)) / (2.0 * PI)
    }

    fn perpendicular_closed_form(width: f64, height: f64, distance: f64) -> f64 {
        let (x, y) = (height / width, distance / width);
        let s = x.hypot(y);
        ((1.0 / y).atan() - y / s * (1.0 / s).atan()) / (2.0 * PI)
    }

    fn box_walls() -> Vec<[DVec3; 4]> {
        let v = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
            .map(|w| w.map(v))
            .to_vec()
    }

    fn unit(z: f64, phi: f64) -> DVec3 {
        let s = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(s * phi.cos(), s * phi.sin(), z)
    }

    #[test]
    fn kernel_of_parallel_rectangle_over_its_corner_is_the_closed_form() {
        let unit_case = point_to_polygon(DVec3::ZERO, Z, &ceiling(1., 1., 1.));
        assert!((unit_case - 0.1385316060).abs() < 1e-10, "{unit_case}");
        for (a, b, c) in [(2., 0.5, 1.), (0.1, 7., 3.), (1e3, 1e3, 1e-2), (1., 2., 1e-7)] {
            let f = point_to_polygon(DVec3::ZERO, Z, &ceiling(a, b, c));
            assert!((f - parallel_closed_form(a, b, c)).abs() < 1e-13, "{a} {b} {c}: {f}");
        }
    }

    #[test]
    fn kernel_of_perpendicular_rectangle_is_the_closed_form() {
        for (w, h, d) in [(1., 1., 1.), (2., 1., 0.3), (0.5, 4., 1e-6), (1., 1., 40.)] {
            let wall =
                [DVec3::new(0., 0., 0.), DVec3::new(0., 0., h), DVec3::new(w, 0., h), DVec3::new(w, 0., 0.)];
            let f = point_to_polygon(DVec3::new(0., d, 0.), Z, &wall);
            assert!((f - perpendicular_closed_form(w, h, d)).abs() < 1e-13, "{w} {h} {d}: {f}");
        }
        assert!((perpendicular_closed_form(1., 1., 1.) - 0.0557341970).abs() < 1e-10);
    }

    #[test]
    fn kernel_over_a_wall_that_goes_below_the_horizon_is_that_of_its_upper_part() {
        let wall = |z0: f64, z1: f64| {
            [DVec3::new(-1., 0., z0), DVec3::new(-1., 0., z1), DVec3::new(2., 0., z1), DVec3::new(2., 0., z0)]
        };
        let x = DVec3::new(0., 0.7, 0.);
        let (whole, upper) = (point_to_polygon(x, Z, &wall(-3., 1.)), point_to_polygon(x, Z, &wall(0., 1.)));
        assert!(upper > 0.05 && (whole - upper).abs() < 1e-15, "{whole} {upper}");
    }

    #[test]
    fn kernel_far_away_tends_to_cos_cos_over_pi_r_squared() {
        let side = 1e-3;
        for (z, phi) in [(0.9, 0.3), (0.5, 2.0), (0.1, 4.0)] {
            let r = 10.0;
            let c = unit(z, phi) * r;
            let polygon = ceiling(side, side, 0.0).map(|v| v + c - DVec3::new(side / 2., side / 2., 0.));
            let f = point_to_polygon(DVec3::ZERO, Z, &polygon);
            let limit = z * z * side * side / (PI * r * r);
            assert!((f / limit - 1.0).abs() < 1e-7, "{f} {limit}");
        }
    }

    #[test]
    fn kernel_from_behind_or_within_the_plane_or_on_an_edge_is_zero_or_finite() {
        let q = ceiling(1., 1., 1.);
        assert_eq!(point_to_polygon(DVec3::new(0.5, 0.5, 2.), -Z, &q), 0.0);
        assert_eq!(point_to_polygon(DVec3::new(0.5, 0.5, 1.), Z, &q), 0.0);
        assert_eq!(point_to_polygon(DVec3::new(3., 0.5, 1.), Z, &q), 0.0);
        assert_eq!(point_to_polygon(DVec3::new(0.5, 0., 1.), Z, &q), 0.0);
        assert_eq!(point_to_polygon(q[0], Z, &q), 0.0);
        assert_eq!(point_to_polygon(DVec3::splat(f64::NAN), Z, &q), 0.0);
        assert_eq!(point_to_polygon(DVec3::ZERO, Z, &q[..2]), 0.0);
    }

    #[test]
    fn kernel_just_under_a_polygon_is_one_and_just_beside_a_wall_one_half() {
        let q = ceiling(1., 1., 1.);
        let under = point_to_polygon(DVec3::new(0.5, 0.5, 1. - 1e-9), Z, &q);
        assert!((under - 1.0).abs() < 1e-8, "{under}");
        let wall = [DVec3::ZERO, DVec3::new(0., 0., 1.), DVec3::new(1., 0., 1.), DVec3::new(1., 0., 0.)];
        let beside = point_to_polygon(DVec3::new(0.5, 1e-9, 0.), Z, &wall);
        assert!((beside - 0.5).abs() < 1e-8, "{beside}");
    }

    #[test]
    fn kernel_of_a_bent_quad_is_the_sum_of_its_triangles() {
        let mut q = ceiling(1., 1., 1.);
        q[1].z = 0.8;
        let x = DVec3::new(0.3, 0.1, 0.);
        let whole = point_to_polygon(x, Z, &q);
        let parts = point_to_polygon(x, Z, &q[..3]) + point_to_polygon(x, Z, &[q[0], q[2], q[3]]);
        assert!((whole - parts).abs() < 1e-15 && whole > 0.1);
        assert!((whole - point_to_polygon(x, Z, &ceiling(1., 1., 1.))).abs() > 1e-3);
    }

    #[test]
    fn disc_kernel_is_within_its_bound_of_lamberts_formula_near_and_far() {
        let quad = ceiling(1., 1., 1.);
        let mut n = 0;
        for polygon in [&quad[..], &quad[..3]] {
            let exact = Source::new(polygon);
            for height in [0.0, 0.5, 0.8, 0.95] {
                for (x, y, z, phi) in [(0.5, 0.4, 1.0, 0.0), (0.1, 0.9, 0.8, 1.0), (1.6, -0.3, 0.6, 3.0)] {
                    let (at, normal) = (DVec3::new(x, y, height), unit(z, phi));
                    let f = exact.form_factor(at, normal);
                    let by_discs = exact.with_kernel(Kernel::Disc).form_factor(at, normal);
                    assert!((by_discs - f).abs() < DISC_ERROR * f + 1e-6, "{at} {normal}: {by_discs} {f}");
                    n += usize::from(f > 0.0);
                }
            }
        }
        assert!(n > 16, "{n}");
    }

    #[test]
    fn centre_above_horizon_of_a_sunken_wall_is_above_it() {
        let wall = [
            DVec3::new(0., 1., -9.),
            DVec3::new(0., 1., 1.),
            DVec3::new(1., 1., 1.),
            DVec3::new(1., 1., -9.),
        ];
        let centre = Source::new(&wall).centre_above_horizon(DVec3::ZERO, Z).expect("a part is above");
        assert!((centre - DVec3::new(0.5, 1., 0.5)).length() < 1e-12, "{centre}");
        assert_eq!(Source::new(&wall).centre_above_horizon(DVec3::new(0., 0., 5.), Z), None);
    }

    #[test]
    fn angle_over_sine_is_atan2_over_sine_on_both_sides_of_its_switch() {
        let mut worst = 0.0_f64;
        for i in 1..4000 {
            let angle = PI * f64::from(i) / 4000.0 * if i % 2 == 0 { 1.0 } else { 0.09 };
            let (s, c) = (2.5 * angle.sin(), 2.5 * angle.cos());
            worst = worst.max((angle_over_sine(s, c) * s / s.atan2(c) - 1.0).abs());
        }
        assert!(worst < 1e-15, "{worst:e}");
        assert!((angle_over_sine(1e-300, 2.0) - 0.5).abs() < 1e-16);
    }

    proptest! {
        #[test]
        fn kernel_inside_a_closed_box_sums_to_one(
            x in 0.001..0.999f64, y in 0.001..0.999f64, w in 0.001..0.999f64,
            z in -1.0..1.0f64, phi in 0.0..2.0 * PI,
        ) {
            let n = unit(z, phi);
            let sum: f64 = box_walls().iter().map(|q| point_to_polygon(DVec3::new(x, y, w), n, q)).sum();
            prop_assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        }

        #[test]
        fn kernel_of_a_subdivision_sums_to_the_whole(
            x in -2.0..2.0f64, y in -2.0..2.0f64, h in 1e-6..3.0f64,
            z in -1.0..1.0f64, phi in 0.0..2.0 * PI, s in 0.01..0.99f64, t in 0.01..0.99f64,
        ) {
            let (p, n) = (DVec3::new(x, y, 1.0 - h), unit(z, phi));
            let q = ceiling(1., 1., 1.);
            let whole = point_to_polygon(p, n, &q);
            let at = |s: f64, t: f64| q[0] + s * (q[1] - q[0]) + t * (q[3] - q[0]);
            let (ss, ts) = ([0., s, 1.], [0., t, 1.]);
            let mut sum = 0.0;
            for i in 0..2 {
                for j in 0..2 {
                    let part = [
                        at(ss[i], ts[j]), at(ss[i + 1], ts[j]), at(ss[i + 1], ts[j + 1]), at(ss[i], ts[j + 1]),
                    ];
                    sum += point_to_polygon(p, n, &part);
                }
            }
            prop_assert!((sum - whole).abs() < 1e-12, "{sum} {whole}");
        }

        #[test]
        fn kernel_of_any_quad_lies_in_zero_to_one(v in prop::collection::vec(-1.0..1.0f64, 12),
            z in -1.0..1.0f64, phi in 0.0..2.0 * PI,
        ) {
            let q: Vec<DVec3> = v.chunks(3).map(DVec3::from_slice).collect();
            let f = point_to_polygon(DVec3::ZERO, unit(z, phi), &q);
            prop_assert!((0.0..=1.0).contains(&f));
        }
    }
}
