//! Exact sums and products of f64 as expansions.
//!
//! ```text
//! x + y = s + r, x y = p + r         s, p as the machine rounds them, r the exact rest
//! terms -> add -> parts, smallest first, that do not overlap -> sign (of the largest), rounded integer, i128
//! ```
//! Source: Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", 2.2-2.8:
//! Knuth's two_sum, two_product by a fused multiply-add, grow_expansion with zeros left out, compress.
//!
//! Exact as long as nothing over- or underflows. Here terms are integers under 2^128 and their multiples by powers of
//! two from 2^-64 up, far from both ends of the range. Not modelled: time.

use std::cmp::Ordering;

use crate::fixed::Rounding;

/// x + y = sum + rest, exactly.
#[inline]
fn two_sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let y_virtual = sum - x;
    let x_virtual = sum - y_virtual;
    (sum, (x - x_virtual) + (y - y_virtual))
}

/// x + y = sum + rest, exactly, for |x| >= |y| or x = 0.
#[inline]
fn fast_two_sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    (sum, y - (sum - x))
}

/// x y = product + rest, exactly.
#[inline]
fn two_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

/// An exact sum of at most N f64: nonzero parts that do not overlap, smallest first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expansion<const N: usize> {
    parts: [f64; N],
    count: usize,
}

impl<const N: usize> Expansion<N> {
    /// Nothing.
    pub(super) const ZERO: Self = Expansion { parts: [0.0; N], count: 0 };

    /// The parts, smallest first.
    #[inline]
    pub(super) fn parts(&self) -> &[f64] {
        &self.parts[..self.count]
    }

    /// Adds a number (grow_expansion). At most N numbers may be added.
    #[inline]
    pub(super) fn add(&mut self, x: f64) {
        let (mut carried, mut kept) = (x, 0);
        for i in 0..self.count {
            let (sum, rest) = two_sum(carried, self.parts[i]);
            if rest != 0.0 {
                self.parts[kept] = rest;
                kept += 1;
            }
            carried = sum;
        }
        if carried != 0.0 {
            self.parts[kept] = carried;
            kept += 1;
        }
        self.count = kept;
    }

    /// Adds x y: two numbers.
    #[inline]
    pub(super) fn add_product(&mut self, x: f64, y: f64) {
        let (product, rest) = two_product(x, y);
        if rest != 0.0 {
            self.add(rest);
        }
        self.add(product);
    }

    /// Adds another expansion of M numbers.
    #[inline]
    pub(super) fn add_all<const M: usize>(&mut self, other: &Expansion<M>) {
        other.parts().iter().for_each(|part| self.add(*part));
    }

    /// Adds another expansion times a number: 2 M numbers.
    #[inline]
    pub(super) fn add_scaled<const M: usize>(&mut self, other: &Expansion<M>, factor: f64) {
        other.parts().iter().for_each(|part| self.add_product(*part, factor));
    }

    /// This times a power of two, or minus one.
    #[inline]
    pub(super) fn scaled(mut self, power: f64) -> Self {
        self.parts.iter_mut().for_each(|part| *part *= power);
        self
    }

    /// How the value compares with 0: the largest part outweighs all others.
    #[inline]
    pub(super) fn sign(&self) -> Ordering {
        match self.parts().last() {
            Some(largest) if *largest > 0.0 => Ordering::Greater,
            Some(_) => Ordering::Less,
            None => Ordering::Equal,
        }
    }

    /// The value as one f64, within a relative error of 2^-52 after [`Expansion::compress`].
    #[inline]
    pub(super) fn estimate(&self) -> f64 {
        self.parts().iter().sum()
    }

    /// The same value in as few parts as this algorithm finds, each at most half a unit in the last place of the next
    /// one. An integer under 2^105 needs no more than two: what the first, of 53 bits, leaves is an integer of at most
    /// 52 bits, which the second holds.
    #[inline]
    pub(super) fn compress<const M: usize>(&self) -> Expansion<M> {
        let mut work = self.parts;
        let Some(top) = self.count.checked_sub(1) else {
            return Expansion::ZERO;
        };
        // Downward: the sums so far, largest first, from the end of the array.
        let (mut bottom, mut carried) = (top, work[top]);
        for i in (0..top).rev() {
            let (sum, rest) = fast_two_sum(carried, work[i]);
            if rest != 0.0 {
                work[bottom] = sum;
                bottom -= 1;
                carried = rest;
            } else {
                carried = sum;
            }
        }
        // Upward: the same from the smallest, which takes up what fits.
        let mut out = Expansion::ZERO;
        for part in &work[bottom + 1..=top] {
            let (sum, rest) = fast_two_sum(*part, carried);
            if rest != 0.0 {
                out.parts[out.count] = rest;
                out.count += 1;
            }
            carried = sum;
        }
        out.parts[out.count] = carried;
        out.count += 1;
        out
    }

    /// The value as an integer, which it must be, under 2^127.
    pub(super) fn to_i128(self) -> i128 {
        self.parts().iter().map(|part| *part as i128).sum()
    }
}

impl Expansion<2> {
    /// Rounded to an integer, once.
    pub(super) fn rounded(&self, rounding: Rounding) -> Expansion<2> {
        // Both parts rounded down: rest in [0, 2).
        let (mut floor, mut rest) = (Expansion::<3>::ZERO, Expansion::<6>::ZERO);
        for part in self.parts() {
            let down = part.floor();
            floor.add(down);
            rest.add(*part);
            rest.add(-down);
        }
        let mut over_one = rest;
        over_one.add(-1.0);
        if over_one.sign().is_ge() {
            floor.add(1.0);
            rest = over_one;
        }
        rest.add(-0.5);
        let tie_goes_up = match rounding {
            Rounding::Floor => false,
            Rounding::NearestEven => floor.parts().iter().filter(|part| is_odd(**part)).count() % 2 == 1,
            Rounding::HalfAway => self.sign().is_gt(),
        };
        let up = rounding != Rounding::Floor && (rest.sign().is_gt() || (rest.sign().is_eq() && tie_goes_up));
        let mut out = Expansion::<4>::ZERO;
        out.add_all(&floor);
        if up {
            out.add(1.0);
        }
        out.compress()
    }
}

/// Whether an integer is odd.
#[inline]
pub(super) fn is_odd(integer: f64) -> bool {
    integer % 2.0 != 0.0
}

/// 2^exponent for an exponent of magnitude under 1,000.
#[inline]
pub(super) fn power_of_two(exponent: i32) -> f64 {
    const BIAS: i32 = 1023;
    const FRACTION_BITS: u32 = 52;
    f64::from_bits(u64::from((BIAS + exponent).unsigned_abs()) << FRACTION_BITS)
}

#[cfg(test)]
#[path = "expansion_tests.rs"]
mod tests;
