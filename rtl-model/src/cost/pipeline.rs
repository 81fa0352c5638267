//! A datapath as a chain of indivisible slices, and the best cut of it into stages.
//!
//! ```text
//! phases of operators side by side --> slices: delay, live bits behind each --cut(n)--> longest stage, registers
//! ```
//! The longest operator of a phase makes its slices; those beside it run as late as they can where they take fewer bits
//! than they give, else as early, and their live bits are added at its boundaries, with what only passes the phase.
//! Of all cuts into n stages one with the least longest stage is taken: D_n(i) = min_j max(D_{n-1}(j), S(i) - S(j)), S the
//! sums of delays, its minimum where both are equal, which moves on with i (Manne, Sorevik 1995, on optimal partitioning
//! of sequences). Of those, from the end, each cut stands where the fewest bits are alive. Registers are the live bits at
//! the cuts and at the end.
//! A stage more that makes none of the others shorter is empty: it costs the narrowest place. One that does may by chance
//! meet narrower places and need fewer registers; then the count of the shallower cut stands, so that a stage more never
//! takes a register away.
//! With an interval of I cycles uses of an operator share units, ceil(uses / I) of them behind multiplexers, and the
//! stages hold a test in I cycles: registers / I, and the widest place once, where the operands of a test stand meanwhile.

use super::hardware::Hardware;
use super::operators::{Operator, Part};
use super::technology::Timing;

/// Lengths that differ by less are equal (ns).
const EQUAL_NS: f64 = 1e-9;

/// An indivisible slice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slice {
    phase: &'static str,
    delay_ns: f64,
    bits_after: u64,
}

/// A datapath.
#[derive(Clone, Debug)]
pub(super) struct Pipeline<'a> {
    timing: &'a Timing,
    interval: u64,
    slices: Vec<Slice>,
    widest_bits: u64,
    /// Operators and their multiplexers.
    pub(super) hardware: Hardware,
    /// Operators if none were shared: what works for one test.
    pub(super) work: Hardware,
    /// Units of operators.
    pub(super) n_units: u64,
}

/// A cut.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cut {
    /// Delay of the longest stage, without its register (ns).
    pub(super) longest_ns: f64,
    /// The phases that it goes through.
    pub(super) path: String,
    /// Registers.
    pub(super) register_bits: u64,
}

impl<'a> Pipeline<'a> {
    /// An empty one with a test every `interval` cycles, whose operands are `bits_in`.
    pub(super) fn new(timing: &'a Timing, interval: u32, bits_in: u64) -> Pipeline<'a> {
        Pipeline {
            timing,
            interval: u64::from(interval),
            slices: Vec::with_capacity(128),
            widest_bits: bits_in,
            hardware: Hardware::default(),
            work: Hardware::default(),
            n_units: 0,
        }
    }

    /// Adds a phase: operators side by side, each with its number of uses, and the bits that only pass.
    pub(super) fn phase(&mut self, name: &'static str, uses: Vec<(Operator, u64)>, passing_bits: u64) {
        let operators: Vec<Operator> =
            uses.into_iter().filter(|(_, n)| *n > 0).map(|(op, n)| self.share(op, n)).collect();
        let Some(main) = operators.iter().max_by(|a, b| a.total_ns().total_cmp(&b.total_ns())) else {
            return;
        };
        let total = main.total_ns();
        let mut at = 0.0;
        for (i, part) in main.parts.iter().enumerate() {
            at += part.delay_ns;
            let is_end = i + 1 == main.parts.len();
            let beside: u64 = operators
                .iter()
                .filter(|op| !std::ptr::eq(*op, main))
                .map(|op| if is_end { op.out_bits() } else { live_bits(op, at, total) })
                .sum();
            let bits_after = part.bits_after + beside + passing_bits;
            self.slices.push(Slice { phase: name, delay_ns: part.delay_ns, bits_after });
            if is_end {
                self.widest_bits = self.widest_bits.max(bits_after);
            }
        }
    }

    /// `n` slices of one kind one after the other, as the rows of a division.
    pub(super) fn rows(&mut self, name: &'static str, row: &Operator, n: u64, passing_bits: u64) {
        let shared = self.share(row.clone(), n);
        let delay_ns = shared.total_ns();
        let bits_after = row.out_bits() + passing_bits;
        self.slices.extend((0..n).map(|_| Slice { phase: name, delay_ns, bits_after }));
        self.widest_bits = self.widest_bits.max(bits_after);
    }

    /// `uses` of an operator on ceil(uses / interval) units; the bits of all uses.
    fn share(&mut self, operator: Operator, uses: u64) -> Operator {
        let units = uses.div_ceil(self.interval);
        let ways = uses.div_ceil(units.max(1));
        self.n_units += units;
        self.work += operator.hardware.times(uses);
        let multiplexers = Hardware::multiplexer(operator.in_bits, ways).times(units);
        self.hardware += operator.hardware.times(units) + multiplexers;
        let mut parts: Vec<Part> =
            operator.parts.iter().map(|part| Part { bits_after: part.bits_after * uses, ..*part }).collect();
        if ways > 1 {
            parts[0].delay_ns += self.timing.choice_ns(ways);
        }
        Operator { in_bits: operator.in_bits * uses, parts, ..operator }
    }

    /// Cuts it into `stages` stages.
    pub(super) fn cut(&self, stages: u32) -> Cut {
        let n = self.slices.len();
        let deepest = (stages as usize).min(n);
        let mut sums = vec![0.0; n + 1];
        for (i, slice) in self.slices.iter().enumerate() {
            sums[i + 1] = sums[i] + slice.delay_ns;
        }
        let best = best_cuts(&sums, deepest);
        let narrowest = self.slices.iter().map(|slice| slice.bits_after).min().unwrap_or(0);
        let (mut bits, mut ends) = (0_u64, Vec::new());
        for stages in 1..=deepest {
            if stages > 1 && best[stages - 1][n] >= best[stages - 2][n] - EQUAL_NS {
                bits += narrowest;
                continue;
            }
            ends = self.narrow_cuts(&sums, &best, stages);
            // The result's register is the last one.
            bits = bits.max(ends.iter().map(|&end| self.slices[end - 1].bits_after).sum());
        }
        bits += narrowest * u64::from(stages).saturating_sub(deepest as u64);
        let (from, to, longest_ns) = longest(&sums, &ends);
        Cut { longest_ns, path: self.phases(from, to), register_bits: self.held(bits) }
    }

    /// Registers when a test stays in each stage for the interval.
    fn held(&self, bits: u64) -> u64 {
        match self.interval {
            1 => bits,
            interval => bits.div_ceil(interval) + self.widest_bits,
        }
    }

    /// The ends of `stages` stages, as narrow as may be from the last cut to the first.
    fn narrow_cuts(&self, sums: &[f64], best: &[Vec<f64>], stages: usize) -> Vec<usize> {
        let n = sums.len() - 1;
        let limit = best[stages - 1][n] + EQUAL_NS;
        let mut ends = vec![n];
        let mut end = n;
        for before in (1..stages).rev() {
            let fits = |j: &usize| sums[end] - sums[*j] <= limit;
            let feasible = (before..end).rev().take_while(fits).filter(|&j| best[before - 1][j] <= limit);
            end = feasible.min_by_key(|&j| self.slices[j - 1].bits_after).unwrap_or(before);
            ends.push(end);
        }
        ends.reverse();
        ends
    }

    /// The phases of slices `from..to`, each once.
    fn phases(&self, from: usize, to: usize) -> String {
        let mut names: Vec<&str> = Vec::new();
        for slice in &self.slices[from..to] {
            if names.last() != Some(&slice.phase) {
                names.push(slice.phase);
            }
        }
        names.join(", ")
    }
}

/// Live bits of an operator `at` ns after the start of a phase of `total` ns.
fn live_bits(operator: &Operator, at: f64, total: f64) -> u64 {
    let is_late = operator.in_bits < operator.out_bits();
    let mut done = if is_late { total - operator.total_ns() } else { 0.0 };
    let mut bits = operator.in_bits;
    for part in &operator.parts {
        done += part.delay_ns;
        if done > at + EQUAL_NS {
            break;
        }
        bits = part.bits_after;
    }
    bits
}

/// D_q(i) for q = 1..=`stages`: the least longest of q stages over the first i slices.
fn best_cuts(sums: &[f64], stages: usize) -> Vec<Vec<f64>> {
    let n = sums.len() - 1;
    let mut best = vec![sums.to_vec()];
    for q in 2..=stages {
        let before = &best[q - 2];
        let mut row = vec![f64::INFINITY; n + 1];
        let mut j = q - 1;
        for i in q..=n {
            let longest = |j: usize| before[j].max(sums[i] - sums[j]);
            while j + 1 < i && longest(j + 1) <= longest(j) {
                j += 1;
            }
            row[i] = longest(j);
        }
        best.push(row);
    }
    best
}

/// The longest stage: its slices and its delay.
fn longest(sums: &[f64], ends: &[usize]) -> (usize, usize, f64) {
    let mut start = 0;
    let mut found = (0, 0, 0.0);
    for &end in ends {
        let length = sums[end] - sums[start];
        if length > found.2 {
            found = (start, end, length);
        }
        start = end;
    }
    found
}

#[cfg(test)]
#[path = "pipeline_tests.rs"]
mod tests;
