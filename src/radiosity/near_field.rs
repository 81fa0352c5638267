//! Mean form factor over receivers that are close to the shooter, where four quadrature points do not suffice.
//!
//! ```text
//! element, shooter --2x2 Gauss against the sum over its quarters--> error estimate --over the bound: quarters again--> mean F
//! ```
//! The kernel is exact at a point (Lambert), or nearly so (`--kernel disc`), and the Gauss rule is for far elements; close to the shooter it varies within
//! the element: along a common edge it jumps from 1/2 to 0 where the shooter ends, and an element of another grid, at a
//! T-junction, may straddle that. Cells are quartered where their rule and that of their quarters disagree
//! (Hart, Dutre, Greenberg 1999 integrate the same kernel by parts), until the estimated error of the element's mean is under
//! [`RELATIVE_ERROR`] of it.
//!
//! Which rays are cast and which share of them arrives is not changed. Not modelled: radiosity that varies over the shooter.

use glam::DVec3;

use super::kernel::{Source, quarters};

/// Estimated error of the mean over an element, as a share of it.
pub const RELATIVE_ERROR: f64 = 1e-3;
/// Or this much of the form factor, whichever is larger.
const ABSOLUTE_ERROR: f64 = 1e-6;
/// Quarterings at most: cells of 1/32 of the element's sides.
const MAX_DEPTH: u32 = 5;
/// Receivers whose centre is nearer to the shooter's bounding sphere than this many times their own radius are close.
const NEAR: f64 = 4.0;
/// Abscissae of the two-point Gauss rule on [0, 1]: (1 -+ 1/sqrt 3) / 2.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// A polygon's centre and the largest distance of a corner from it (m).
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    centre: DVec3,
    radius_m: f64,
}

impl Extent {
    /// Of a polygon with at least one corner.
    pub fn of(polygon: &[DVec3]) -> Extent {
        let centre = polygon.iter().sum::<DVec3>() / polygon.len().max(1) as f64;
        let radius = |r: f64, v: &DVec3| r.max(v.distance_squared(centre));
        Extent { centre, radius_m: polygon.iter().fold(0.0, radius).sqrt() }
    }

    /// So close to a shooter that the Gauss rule may not do.
    #[inline]
    pub fn is_near(&self, shooter: &Extent) -> bool {
        let reach = shooter.radius_m + NEAR * self.radius_m;
        self.centre.distance_squared(shooter.centre) < reach * reach
    }
}

/// Mean of the form factor of `source` over a receiving triangle or quad with unit `normal`, its estimated error under
/// [`RELATIVE_ERROR`] of it.
pub fn mean_form_factor(source: &Source, receiver: &[DVec3], normal: DVec3) -> f64 {
    let (cell, is_triangle) = match *receiver {
        [a, b, c] => ([a, b, c, c], true),
        [a, b, c, d] => ([a, b, c, d], false),
        _ => return 0.0,
    };
    let integrator = Integrator { source, normal, is_triangle };
    let area = integrator.area(&cell);
    if area <= 0.0 {
        return 0.0;
    }
    let first = integrator.rule(&cell);
    let quarters = integrator.quarters(&cell);
    let rules = quarters.map(|q| integrator.rule(&q));
    let better: f64 = rules.iter().sum();
    let tolerance = (RELATIVE_ERROR * better).max(ABSOLUTE_ERROR * area);
    if (better - first).abs() <= tolerance {
        return better / area;
    }
    let sum: f64 = (quarters.iter().zip(rules)).map(|(q, r)| integrator.refined(q, r, tolerance, 1)).sum();
    sum / area
}

/// The kernel over cells of one receiver.
struct Integrator<'a> {
    source: &'a Source,
    normal: DVec3,
    is_triangle: bool,
}

type Cell = [DVec3; 4];

impl Integrator<'_> {
    fn area(&self, [a, b, c, d]: &Cell) -> f64 {
        0.5 * if self.is_triangle { (*b - *a).cross(*c - *a) } else { (*c - *a).cross(*d - *b) }.length()
    }

    /// Integral over a cell by the Gauss rule (three interior points of a triangle).
    fn rule(&self, cell: &Cell) -> f64 {
        let [a, b, c, d] = *cell;
        let f = |x: DVec3| self.source.form_factor(x, self.normal);
        if self.is_triangle {
            let thirds = [[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]];
            let sum: f64 = thirds.iter().map(|[i, j, k]| f((*i * a + *j * b + *k * c) / 6.0)).sum();
            return self.area(cell) / 3.0 * sum;
        }
        let mut sum = 0.0;
        for t in GAUSS {
            for s in GAUSS {
                let x = (1.0 - t) * ((1.0 - s) * a + s * b) + t * ((1.0 - s) * d + s * c);
                let along_s = (1.0 - t) * (b - a) + t * (c - d);
                let along_t = (1.0 - s) * (d - a) + s * (c - b);
                sum += 0.25 * along_s.cross(along_t).length() * f(x);
            }
        }
        sum
    }

    fn quarters(&self, cell: &Cell) -> [Cell; 4] {
        quarters(cell, self.is_triangle)
    }

    /// Integral over a cell whose rule gave `coarse`. The tolerance is halved from level to level, not quartered: errors of
    /// cells lie along lines.
    fn refined(&self, cell: &Cell, coarse: f64, tolerance: f64, depth: u32) -> f64 {
        let quarters = self.quarters(cell);
        let rules = quarters.map(|q| self.rule(&q));
        let better: f64 = rules.iter().sum();
        let tolerance = 0.5 * tolerance;
        if depth >= MAX_DEPTH || (better - coarse).abs() <= tolerance {
            return better;
        }
        (quarters.iter().zip(rules)).map(|(q, r)| self.refined(q, r, tolerance, depth + 1)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square at x = 0 that faces +x.
    fn wall() -> Source {
        let v = DVec3::new;
        Source::new(&[v(0., 0., 0.), v(0., 1., 0.), v(0., 1., 1.), v(0., 0., 1.)])
    }

    fn floor(x: [f64; 2], y: [f64; 2]) -> [DVec3; 4] {
        let v = |x, y| DVec3::new(x, y, 0.0);
        [v(x[0], y[0]), v(x[1], y[0]), v(x[1], y[1]), v(x[0], y[1])]
    }

    /// Midpoints of a fine grid.
    fn by_midpoints(source: &Source, x: [f64; 2], y: [f64; 2], n: u32) -> f64 {
        let at = |span: [f64; 2], i: u32| span[0] + (span[1] - span[0]) * (f64::from(i) + 0.5) / f64::from(n);
        let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let f = |(i, j)| source.form_factor(DVec3::new(at(x, i), at(y, j), 0.0), DVec3::Z);
        cells.map(f).sum::<f64>() / f64::from(n * n)
    }

    #[test]
    fn mean_over_a_square_with_a_common_edge_is_the_view_factor() {
        let f = mean_form_factor(&wall(), &floor([0.0, 1.0], [0.0, 1.0]), DVec3::Z);
        assert!((f / 0.200_043_776_1 - 1.0).abs() < RELATIVE_ERROR, "{f}");
    }

    #[test]
    fn mean_over_an_element_that_straddles_the_shooters_end_is_within_the_bound_where_gauss_is_not() {
        let source = wall();
        let (x, y) = ([0.0, 0.1], [0.93, 1.03]);
        let exact = by_midpoints(&source, x, y, 1500);
        let cell = floor(x, y);
        let f = mean_form_factor(&source, &cell, DVec3::Z);
        assert!((f / exact - 1.0).abs() < RELATIVE_ERROR, "{f}, {exact} expected");
        let integrator = Integrator { source: &source, normal: DVec3::Z, is_triangle: false };
        let gauss = integrator.rule(&cell) / integrator.area(&cell);
        assert!((gauss / exact - 1.0).abs() > 0.02, "{gauss}, {exact} expected");
    }

    #[test]
    fn mean_over_two_triangles_is_that_over_their_quad() {
        let source = wall();
        let [a, b, c, d] = floor([0.0, 0.4], [0.5, 1.3]);
        let halves = [[a, b, c], [a, c, d]].map(|t| mean_form_factor(&source, &t, DVec3::Z));
        let quad = mean_form_factor(&source, &[a, b, c, d], DVec3::Z);
        assert!((0.5 * (halves[0] + halves[1]) / quad - 1.0).abs() < 2.0 * RELATIVE_ERROR);
    }
}
