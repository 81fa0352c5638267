//! Width and largest magnitude of every wire of the datapath, as functions of the formats.
//!
//! With S = 2^(F+1) - 1 the longest difference of two coordinates and s = 2F - K the dropped bits of an edge normal:
//!
//! | wire | largest magnitude, s = 0 | why |
//! |---|---|---|
//! | a | S | difference of two coordinates |
//! | c, n | S^2 | each component is twice the area of a triangle in a square of side S |
//! | e, den | 3 S^2 (2^D - 1) | three such components times a direction word |
//! | num | 2 S^3 | six times the volume of a tetrahedron in a cube of side S |
//!
//! | tile_product | 2 (2^(D+9) - 1) | difference of two of the tile's directions, each under 2^(D+9) |
//! | target_direction | S | difference of two points |
//! | fan_den | 2^18 | n m strata, at most 64, of 2^12 places each |
//! | fan_product | (2^18 - 1) S | place in the last stratum, at most 2^12 n - 1, times m times an edge; most for m = 1 |
//! | fan_num | 2^(F+18) + 2^17 | fan_den times a point that rounds into the cube: at most half a step outside |
//! | hemisphere_word | 2^D | a component of a unit vector, 1 included |
//! | hemisphere_direction | 7/4 2^(2D) | sum of a unit vector's components, at most sqrt 3 + 3/2 2^-D, times 2^D |
//! | direction_rounded | 2^D | rounded up before the scale is halved once more |
//! | cell_plane | 2^F | the cube's face |
//!
//! A fan's v0 fan_den plus its first product is a point between v0 and v1, so it is within fan_num's bound; its
//! numerator counts 1/(n m) of its last fraction bit. Partial sums of a hemisphere's direction are within its bound.
//!
//! For s > 0 each rounded normal is off by less than one unit of its last place, which adds under 3 to n and 9 S to
//! num. Widths (`bits`) are DESIGN 3.2's, from adding operand widths; the magnitudes leave a bit or two of them free.

use serde::Serialize;

use super::Formats;
use crate::datapath::bundle::{JITTER_BITS, STEP_GUARD_BITS};
use crate::packet::MAX_BUNDLE_RAYS;

/// One row of the width table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WireWidth {
    /// Which wire, as named in `datapath/`.
    pub wire: &'static str,
    /// Its width in bits, sign included.
    pub bits: u32,
    /// Its fraction bits.
    pub frac_bits: u32,
    /// Largest magnitude that it can carry.
    pub max_magnitude: i128,
}

impl Formats {
    /// Width and largest magnitude of every wire of the datapath.
    pub fn width_table(&self) -> Vec<WireWidth> {
        let (f, d, t) = (self.coord_frac_bits, self.dir_frac_bits, self.t_frac_bits);
        let (keep, drop) = (self.cross_keep(), self.cross_drop());
        let (up, down) = self.t_shifts();
        let one = 1_i128;
        let side = (one << (f + 1)) - 1;
        let dir = (one << d) - 1;
        let square = side * side;
        let (cross, normal, num) = if drop == 0 {
            (square, square, 2 * side * square)
        } else {
            let up_to = |value: i128| -((-value) >> drop);
            (up_to(square), (square >> drop) + 3, up_to(2 * side * square) + 9 * side)
        };
        let den = 3 * normal * dir;
        let row = |wire, bits, frac_bits, max_magnitude| WireWidth { wire, bits, frac_bits, max_magnitude };
        let guard = STEP_GUARD_BITS;
        // log2 of a fan's places: 6 + 12.
        let places = MAX_BUNDLE_RAYS.ilog2() + JITTER_BITS;
        let tile = (one << (d + guard + 1)) - 1;
        vec![
            row("coordinate", f + 1, f, one << f),
            row("direction", d + 1, d, dir),
            row("a", f + 2, f, side),
            row("c", keep + 4, keep, cross),
            row("e", keep + d + 6, keep + d, 3 * cross * dir),
            row("n", keep + 4, keep, normal),
            row("den", keep + d + 6, keep + d, den),
            row("num", keep + f + 7, keep + f, num),
            row("num_shifted", keep + f + 7 + up, keep + f + up, num << up),
            row("den_shifted", keep + d + 6 + down, keep + d + down, den << down),
            // Unsigned; one more bit than its fraction and integer bits would be a sign.
            row("t", t + 3, t, one << (t + 2)),
            row("cell_plane", f + 2, f, one << f),
            row("cell_num", f + 2, f, one << (f + 1)),
            row("cell_den", d + 1, d, dir),
            row("cell_product", f + d + 3, f + d, dir << (f + 1)),
            row("cell_num_shifted", f + 2 + up, f + up, one << (f + 1 + up)),
            row("end_product", t + d + 5 + down, t + d + down, ((one << (t + 3)) + 1) * (dir << down)),
            row("tile_product", d + guard + 3, d + guard, 2 * tile),
            row("tile_direction", d + guard + 2, d + guard, tile),
            row("target_direction", f + 2, f, side),
            row("fan_product", f + places + 2, f + JITTER_BITS, ((one << places) - 1) * side),
            row("fan_num", f + places + 2, f + JITTER_BITS, (one << (f + places)) + (one << (places - 1))),
            // Unsigned as well.
            row("fan_den", places + 1, JITTER_BITS, one << places),
            row("hemisphere_word", d + 2, d, one << d),
            row("hemisphere_product", 2 * d + 2, 2 * d, one << (2 * d)),
            row("hemisphere_direction", 2 * d + 2, 2 * d, 7 << (2 * d - 2)),
            row("direction_rounded", d + 2, d, one << d),
        ]
    }
}

#[cfg(test)]
#[path = "width_table_tests.rs"]
mod tests;
