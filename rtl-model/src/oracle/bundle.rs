//! Bundle descriptors to rays in f64: the oracle of the bundle generator.
//!
//! ```text
//! descriptor, i -> raw direction, exact as a sum of two f64 -> L, its length in bits -> times 2^(D-L), rounded once
//!                                                                 '-> t_max at the point
//! ```
//! Formulas: DESIGN 4 and the table in the header of `datapath/bundle.rs`. What is exact, and why:
//! - tile: words of at most D + 9 bits times at most 64: under 2^45, exact in f64;
//! - fan: with one denominator q = n m 2^12 <= 2^18 the numerator stays under 2^50 and is exact. The rounded quotient is
//!   under 2^31, so off by under 2^-23, but a quotient that is no tie is at least 1/(2 q) >= 2^-19 away from one, and a
//!   tie is itself an f64: rounding the rounded quotient rounds the exact one;
//! - targets: differences of coordinate words, exact;
//! - hemisphere: three products of up to 2^56 each: split without error by fma and added by two-sums; what is lost in
//!   the large parts are small whole numbers, whose sum is exact.
//!
//! The direction scales by a power of two, exact, and is rounded once, ties to even. No function is shared with the
//! datapath; the concentric map is computed by its four regions and half-angle tangents, not from one angle's sine and
//! cosine. Not modelled: the generator's clock.

use std::f64::consts::FRAC_PI_4;

use crate::datapath::RayWords;
use crate::datapath::bundle::BundleWords;
use crate::fixed::Formats;

/// Fraction bits of a tile's words beyond D.
const TILE_GUARD_BITS: i32 = 8;

/// Steps of a fan's jitter in a stratum.
const JITTER_STEPS: f64 = 4096.0;

/// Side of the hemisphere's table.
const TABLE_SIDE: f64 = 64.0;

/// A whole number as an unevaluated sum: the first part is the rounded sum, the second what rounding took.
type Exact = (f64, f64);

/// Ray `i` of a valid descriptor.
///
/// # Panics
/// When a descriptor lists fewer than `i + 1` targets.
pub fn ray(formats: &Formats, bundle: &BundleWords, i: usize) -> RayWords {
    scaled_ray(formats, bundle, i).0
}

/// Ray `i` of a valid descriptor and its scale s: raw direction = (direction words / 2^D) 2^s, to rounding.
///
/// # Panics
/// As [`ray`].
pub fn scaled_ray(formats: &Formats, bundle: &BundleWords, i: usize) -> (RayWords, i32) {
    let (d, f, t) = (bits(formats.dir_frac_bits), bits(formats.coord_frac_bits), bits(formats.t_frac_bits));
    let whole = |x: f64| (x, 0.0);
    let (origin, raw, frac_bits, ends_at_point) = match bundle {
        BundleWords::Tile { apex, corner, step_u, step_v, n, .. } => {
            let (column, row) = stratum(i, *n);
            let word = |k: usize| step_u[k] as f64 * column + step_v[k] as f64 * row + corner[k] as f64;
            (*apex, [0, 1, 2].map(word).map(whole), d + TILE_GUARD_BITS, false)
        }
        BundleWords::Fan { apex, vertices, n, m, jitter } => {
            let (column, row) = stratum(i, *n);
            let (n, m) = (f64::from(*n), f64::from(*m));
            // Places along the edges, in units of 1/(n 2^12) and 1/(m 2^12) of them.
            let along_u = column * JITTER_STEPS + f64::from(jitter[0]);
            let along_v = row * JITTER_STEPS + f64::from(jitter[1]);
            let word = |k: usize| {
                let [v0, v1, v2] = vertices.map(|vertex| f64::from(vertex[k]));
                let moved = (v1 - v0) * (along_u * m) + (v2 - v0) * (along_v * n);
                let q = n * m * JITTER_STEPS;
                libm::rint((v0 * q + moved) / q) - f64::from(apex[k])
            };
            (*apex, [0, 1, 2].map(word).map(whole), f, true)
        }
        BundleWords::Hemisphere { apex, frame, n, m, jitter } => {
            let (column, row) = stratum(i, *n);
            let [along_u, along_v] = jitter.map(|place| f64::from(place) / TABLE_SIDE);
            let entry = table_entry(d, table_place(column + along_u, *n), table_place(row + along_v, *m));
            let word = |k: usize| sum_of_products(entry, frame.map(|axis| f64::from(axis[k])));
            (*apex, [0, 1, 2].map(word), 2 * d, false)
        }
        BundleWords::Targets { apex, points } => {
            let word = |k: usize| f64::from(points[i][k]) - f64::from(apex[k]);
            (*apex, [0, 1, 2].map(word).map(whole), f, true)
        }
    };
    let (dir, length) = direction_words(raw, d);
    // t = 1 is 2^D / 2^D; the point lies at raw / dir = 2^(L-F) of it.
    let t_max = if ends_at_point { libm::scalbn(1.0, t + length - f) } else { f64::INFINITY };
    let t_max = t_max.max(1.0).min(libm::scalbn(4.0, t));
    (RayWords { origin, dir, t_max: t_max as u64 }, length - frac_bits)
}

/// Column and row of ray `i` in rows of `n`.
fn stratum(i: usize, n: u32) -> (f64, f64) {
    let row = (i as f64 / f64::from(n.max(1))).floor();
    (i as f64 - row * f64::from(n.max(1)), row)
}

/// The place in the table, 0..64, at or just below `place`/n of the square, `place` in strata.
fn table_place(place: f64, n: u32) -> f64 {
    // Whole numbers below 64^2 over at most 64: a quotient that is not whole is 1/64 away from the next whole number, far
    // over its error.
    (TABLE_SIDE * place / f64::from(n.max(1))).floor().min(TABLE_SIDE - 1.0)
}

/// A table entry in words of D fraction bits: concentric map of places (k, l)/64, place 0 at 1/128.
fn table_entry(d: i32, column: f64, row: f64) -> [f64; 3] {
    concentric(column, row).map(|x| libm::rint(libm::scalbn(x, d)))
}

/// The direction at a place of the table (Shirley, Chiu 1997, by regions; what of the square is right, above, left and
/// below of its diagonals).
fn concentric(column: f64, row: f64) -> [f64; 3] {
    // In steps of 1/64 of half the square: whole numbers -63 to 62.
    let at = |place: f64| if place == 0.0 { 1.0 - TABLE_SIDE } else { 2.0 * place - TABLE_SIDE };
    let (a, b) = (at(column), at(row));
    // Radius, how far around from the region's axis (-1 to 1 eighths of a turn), and that axis.
    let (r, eighths, [axis_x, axis_y]) = if a > -b && a > b {
        (a, b / a, [1.0, 0.0])
    } else if a > -b {
        (b, -a / b, [0.0, 1.0])
    } else if a < b {
        (-a, b / a, [-1.0, 0.0])
    } else if b != 0.0 {
        (-b, -a / b, [0.0, -1.0])
    } else {
        return [0.0, 0.0, 1.0];
    };
    // cos = (1 - h^2)/(1 + h^2), sin = 2 h/(1 + h^2) with h the tangent of half the angle.
    let half = libm::tan(0.5 * FRAC_PI_4 * eighths);
    let (cos, sin) = ((1.0 - half * half) / (1.0 + half * half), 2.0 * half / (1.0 + half * half));
    let disk = |cosine: f64| r / TABLE_SIDE * cosine;
    let height = ((TABLE_SIDE - r) * (TABLE_SIDE + r)).sqrt() / TABLE_SIDE;
    [disk(axis_x * cos - axis_y * sin), disk(axis_y * cos + axis_x * sin), height]
}

/// p . q of whole numbers under 2^29, exactly.
fn sum_of_products(p: [f64; 3], q: [f64; 3]) -> Exact {
    let product = |k: usize| {
        let high = p[k] * q[k];
        (high, p[k].mul_add(q[k], -high))
    };
    let [x, y, z] = [0, 1, 2].map(product);
    let (xy, lost_xy) = two_sum(x.0, y.0);
    let (sum, lost) = two_sum(xy, z.0);
    two_sum(sum, lost_xy + lost + x.1 + y.1 + z.1)
}

/// a + b and what its rounding took (Knuth).
fn two_sum(a: f64, b: f64) -> Exact {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// L with 2^(L-1) <= |value| < 2^L, 0 for 0.
fn bit_length(value: Exact) -> i32 {
    let (high, low) = if value.0 < 0.0 { (-value.0, -value.1) } else { value };
    if high == 0.0 {
        return 0;
    }
    let (fraction, length) = libm::frexp(high);
    // Rounded up to a power of two: the value itself is below it.
    if fraction == 0.5 && low < 0.0 { length - 1 } else { length }
}

/// The nearest whole number to an unevaluated sum, ties to even.
///
/// The second part is at most half a step of the first, so it decides only where the first is a tie.
fn round(value: Exact) -> f64 {
    let whole = libm::rint(value.0);
    let rest = value.0 - whole;
    if rest == 0.5 && value.1 > 0.0 {
        whole + 1.0
    } else if rest == -0.5 && value.1 < 0.0 {
        whole - 1.0
    } else {
        whole
    }
}

/// raw 2^(D-L) rounded, L the bits of its largest component, or one more where rounding reaches 2^D; and L.
fn direction_words(raw: [Exact; 3], d: i32) -> ([i32; 3], i32) {
    let length = raw.map(bit_length).into_iter().fold(0, i32::max);
    let scaled = |length: i32| {
        raw.map(|(high, low)| round((libm::scalbn(high, d - length), libm::scalbn(low, d - length))))
    };
    let words = scaled(length);
    let reaches_one = words.iter().any(|word| word.abs() >= libm::scalbn(1.0, d));
    let (words, length) = if reaches_one { (scaled(length + 1), length + 1) } else { (words, length) };
    // Under 2^28: exact.
    (words.map(|word| word as i32), length)
}

/// A bit count as a signed number.
fn bits(count: u32) -> i32 {
    count.cast_signed()
}

#[cfg(test)]
#[path = "bundle/tests.rs"]
mod tests;
