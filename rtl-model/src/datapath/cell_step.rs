//! Exact stepping of a ray through the uniform grid: the CTU's function.
//!
//! ```text
//! ray, cell, limit t -> distances to the three far planes -> nearest by cross-multiplying -> next cell, or the end
//! ```
//! Far plane of cell index c along an axis: p = c' 2^(F+1-g) - 2^F with c' = c, or c + 1 where d > 0; crossing
//! t = |p - o| / |d|, a ratio of integers that is compared, never divided and never summed up. Ties go to the first
//! axis, so a ray through an edge passes one more cell, at a point; closed cell lists make that harmless. One cell a
//! clock cycle.
//! Source: Amanatides, Woo 1987 (the walk); exactness is ours. Not modelled here: lists, mailbox, time.

use super::RayWords;
use crate::fixed::{Formats, Rounding, clamp_to_u8, index};

/// A grid of 2^g cells along each axis over the cube [-1, 1)^3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// g, at most min(F, 7).
    pub log2_cells: u32,
}

/// A cell of the grid: indices along x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Cell(pub [u8; 3]);

/// How a ray leaves a cell: across the plane at integer distance `num` along an axis with direction word `den`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// |boundary - origin| along the axis, coordinate words.
    pub num: u64,
    /// |direction| along the axis, direction words, > 0.
    pub den: u64,
    /// The cell behind the plane; `None` when it is outside the grid.
    pub next: Option<Cell>,
}

/// Bit i of the place moved to bit 3 i, for the 7 bits of a cell's place.
const SPREAD: [u32; 128] = {
    let mut table = [0; 128];
    let mut place = 0;
    while place < 128 {
        let mut bit = 0;
        while bit < 7 {
            table[place] |= ((place >> bit & 1) as u32) << (3 * bit);
            bit += 1;
        }
        place += 1;
    }
    table
};

impl Grid {
    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        1 << (3 * self.log2_cells)
    }

    /// Index of a cell in Morton order: the bits of x, y, z interleaved, x lowest. Eight cells around a corner are one
    /// 64-byte line of headers, so a ray in any direction finds its next header near the last one.
    #[inline]
    pub fn index(&self, cell: Cell) -> usize {
        let [x, y, z] = cell.0.map(|place| SPREAD[usize::from(place & 0x7f)]);
        index(x | y << 1 | z << 2)
    }

    /// log2 of a cell's side in coordinate steps: F + 1 - g.
    #[inline]
    pub fn cell_log2(&self, formats: &Formats) -> u32 {
        formats.coord_frac_bits + 1 - self.log2_cells
    }

    /// The half-open cell that holds a coordinate; coordinates outside the cube give the nearest cell.
    #[inline]
    pub fn cell_of(&self, formats: &Formats, point: [i32; 3]) -> Cell {
        let last = (1_i64 << self.log2_cells) - 1;
        let cube = 1_i64 << formats.coord_frac_bits;
        Cell(
            point.map(|word| {
                clamp_to_u8(((i64::from(word) + cube) >> self.cell_log2(formats)).clamp(0, last))
            }),
        )
    }

    /// Where the ray leaves `cell`, a cell that it has entered.
    #[inline(always)]
    pub fn crossing(&self, formats: &Formats, ray: &RayWords, cell: Cell) -> Crossing {
        let cell_log2 = self.cell_log2(formats);
        let cube = 1_i64 << formats.coord_frac_bits;
        // "Never": a ratio above all others, for the axes that the ray does not move along.
        let (mut num, mut den, mut axis) = (1_u64, 0_u64, 0);
        for k in 0..3 {
            let direction = i64::from(ray.dir[k]);
            let plane = ((i64::from(cell.0[k]) + i64::from(direction > 0)) << cell_log2) - cube;
            let ahead = plane - i64::from(ray.origin[k]);
            // With the direction's sign, all bits 1 for a negative one: -x = (x ^ sign) - sign.
            let sign = direction >> 63;
            let distance = ((ahead ^ sign) - sign).max(0).cast_unsigned();
            let speed = direction.unsigned_abs();
            // 2^(F+1) * 2^D < 2^58. An axis at rest has speed 0: its right side is 0, never greater.
            if distance * den < num * speed {
                (num, den, axis) = (distance, speed, k);
            }
        }
        Crossing { num, den: den.max(1), next: self.neighbour(cell, axis, ray.dir[axis]) }
    }

    /// The neighbour along an axis, on the side of the direction's sign.
    #[inline(always)]
    fn neighbour(&self, cell: Cell, axis: usize, direction: i32) -> Option<Cell> {
        // Below 0 wraps to 255, which is beyond every grid.
        let step = if direction < 0 { u8::MAX } else { 1 };
        let index = cell.0[axis].wrapping_add(step);
        if direction == 0 || u32::from(index) >> self.log2_cells != 0 {
            return None;
        }
        let mut next = cell;
        next.0[axis] = index;
        Some(next)
    }
}

/// The termination rule: true when `best_t` is strictly less than the crossing's t rounded as a hit's t is.
///
/// Without a division: with x = num 2^(T+D-F) / den the crossing and b the best t word, round(x) > b exactly when
/// x > b + 1/2, or x = b + 1/2 and that tie goes up (nearest even: b odd; half away: always); floor(x) > b when
/// x >= b + 1. Rounding is monotone, so a patch behind the crossing has a rounded t that is greater than b too.
#[inline]
pub fn ends_before(formats: &Formats, best_t: u64, crossing: &Crossing) -> bool {
    // num, den and best_t have at most 35 bits, so these products are exact in f64 or rounded once, by 2^-53 of
    // themselves. Where they differ by more than two words of t and a 2^-40th, no rounding mode decides otherwise.
    let (t, d, f) = (formats.t_frac_bits, formats.dir_frac_bits, formats.coord_frac_bits);
    let den = crossing.den as f64;
    let far = crossing.num as f64 * power_of_two((t + d).wrapping_sub(f));
    let near = best_t as f64 * den;
    let doubt = 2.0 * den + (far + near) * (1.0 / (1_u64 << 40) as f64);
    if (far - near).abs() > doubt {
        return far > near;
    }
    ends_before_exactly(formats, best_t, crossing)
}

/// 2^n for an n that may wrap below zero.
#[inline]
fn power_of_two(n: u32) -> f64 {
    f64::from_bits(u64::from(n.wrapping_add(1023)) << 52)
}

/// [`ends_before`] in integers alone.
fn ends_before_exactly(formats: &Formats, best_t: u64, crossing: &Crossing) -> bool {
    let (up, down) = formats.t_shifts();
    let num = u128::from(crossing.num) << up;
    let den = u128::from(crossing.den) << down;
    let best = u128::from(best_t);
    match formats.rounding {
        Rounding::NearestEven => {
            let (left, right) = (2 * num, (2 * best + 1) * den);
            left > right || (left == right && best_t & 1 == 1)
        }
        Rounding::HalfAway => 2 * num >= (2 * best + 1) * den,
        Rounding::Floor => num >= (best + 1) * den,
    }
}

/// The CTU's decision after a cell, once every result of it is reduced: the next cell, or `None` when the ray ends.
/// `limit_t` is the best t so far, or the ray's t_max when nothing was hit.
#[inline]
pub fn advance(formats: &Formats, grid: &Grid, ray: &RayWords, cell: Cell, limit_t: u64) -> Option<Cell> {
    let crossing = grid.crossing(formats, ray, cell);
    if ends_before(formats, limit_t, &crossing) { None } else { crossing.next }
}

#[cfg(test)]
#[path = "cell_step_tests.rs"]
mod tests;
