//! The answers to one job as bytes.
//!
//! ```text
//! steps     nibbles, ray after ray, the low half of a byte first:
//!             0..5 enter the neighbour in direction 2 axis + (1 when upward), 6..11 park before it,
//!             12 end, 13 enter and 14 park with the cell in six nibbles (x, y, z, low halves first), 15 no more steps
//! then for each lane (grid: each ray; shells: the bundle)
//! verdicts  varint n; grid: n bits, shells: n masks as varints
//! tests     varint n; n bits (hit or not); for each hit varint t, varint 2 patch + (1 for the back)
//! ```
//! Directions are from the cell that the ray entered last. Bits fill bytes from the lowest. A varint has 7 bits a byte,
//! lowest first, all bytes but the last with bit 7 set.

use crate::answers::Step;
use crate::datapath::cell_step::{Cell, Grid};
use crate::datapath::{Facing, HitWords};
use crate::packet::MAX_BUNDLE_RAYS;

const END: u8 = 12;
const ENTER_AT: u8 = 13;
const PARK_AT: u8 = 14;
const NO_MORE: u8 = 15;

/// What the streams of a job may hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Verdicts and tests have a lane per ray (grid partition), not one for the bundle.
    pub(super) per_ray: bool,
    /// The grid.
    pub(super) grid: Grid,
}

impl Limits {
    fn n_lanes(&self, n_rays: usize) -> usize {
        if self.per_ray { n_rays } else { 1 }
    }
}

/// The answers to a job, as they are given.
#[derive(Clone, Debug, Default)]
pub(super) struct Answered {
    pub(super) steps: Vec<Vec<Step>>,
    pub(super) lanes: Vec<Lane>,
}

/// Verdicts and tests of a ray (grid) or a bundle (shells).
#[derive(Clone, Debug, Default)]
pub(super) struct Lane {
    pub(super) wanted: Vec<u64>,
    pub(super) tests: Vec<Option<HitWords>>,
}

impl Answered {
    /// Empty, for a job of so many rays.
    pub(super) fn start(&mut self, n_rays: usize, per_ray: bool) {
        self.steps.resize_with(n_rays, Vec::new);
        self.steps.iter_mut().for_each(Vec::clear);
        self.lanes.resize_with(if per_ray { n_rays } else { 1 }, Lane::default);
        for lane in &mut self.lanes {
            lane.wanted.clear();
            lane.tests.clear();
        }
    }

    /// Appends the job's streams.
    pub(super) fn write(&self, per_ray: bool, bytes: &mut Vec<u8>) {
        let mut nibbles = Nibbles::default();
        for steps in &self.steps {
            let mut last = None;
            for step in steps {
                match *step {
                    Step::Enter(cell) => {
                        nibbles.cell(bytes, last, cell, 0, ENTER_AT);
                        last = Some(cell);
                    }
                    Step::Park(cell) => nibbles.cell(bytes, last, cell, 6, PARK_AT),
                    Step::End => nibbles.push(bytes, END),
                }
            }
            if steps.last() != Some(&Step::End) {
                nibbles.push(bytes, NO_MORE);
            }
        }
        for lane in &self.lanes {
            write_varint(bytes, lane.wanted.len() as u64);
            if per_ray {
                write_bits(bytes, lane.wanted.iter().map(|wanted| *wanted != 0));
            } else {
                lane.wanted.iter().for_each(|wanted| write_varint(bytes, *wanted));
            }
            write_varint(bytes, lane.tests.len() as u64);
            write_bits(bytes, lane.tests.iter().map(Option::is_some));
            for hit in lane.tests.iter().flatten() {
                write_varint(bytes, hit.t);
                write_varint(bytes, u64::from(hit.patch) << 1 | u64::from(hit.facing == Facing::Back));
            }
        }
    }
}

/// Two to a byte.
#[derive(Default)]
struct Nibbles {
    half: bool,
}

impl Nibbles {
    fn push(&mut self, bytes: &mut Vec<u8>, nibble: u8) {
        match bytes.last_mut() {
            Some(last) if self.half => *last |= nibble << 4,
            _ => bytes.push(nibble),
        }
        self.half = !self.half;
    }

    fn cell(&mut self, bytes: &mut Vec<u8>, last: Option<Cell>, cell: Cell, base: u8, explicit: u8) {
        match last.and_then(|last| direction(last, cell)) {
            Some(direction) => self.push(bytes, base + direction),
            None => {
                self.push(bytes, explicit);
                for place in cell.0 {
                    self.push(bytes, place & 15);
                    self.push(bytes, place >> 4);
                }
            }
        }
    }
}

/// The direction in which `to` is the neighbour of `from`.
fn direction(from: Cell, to: Cell) -> Option<u8> {
    (0..6).find(|direction| neighbour(from, *direction) == Some(to))
}

#[inline]
fn neighbour(cell: Cell, direction: u8) -> Option<Cell> {
    let mut next = cell;
    let place = &mut next.0[usize::from(direction >> 1)];
    *place = if direction & 1 == 1 { place.checked_add(1) } else { place.checked_sub(1) }?;
    Some(next)
}

fn write_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn write_bits(bytes: &mut Vec<u8>, bits: impl Iterator<Item = bool>) {
    for (i, bit) in bits.enumerate() {
        if i % 8 == 0 {
            bytes.push(0);
        }
        if let Some(last) = bytes.last_mut() {
            *last |= u8::from(bit) << (i % 8);
        }
    }
}

/// A step in one word: kind above the cell's 24 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StepWord(u32);

impl StepWord {
    #[inline]
    fn new(kind: u32, cell: Cell) -> StepWord {
        let [x, y, z] = cell.0.map(u32::from);
        StepWord(kind << 24 | z << 16 | y << 8 | x)
    }

    #[inline]
    pub(super) fn step(self) -> Step {
        let [x, y, z, kind] = self.0.to_le_bytes();
        let cell = Cell([x, y, z]);
        match kind {
            0 => Step::Enter(cell),
            1 => Step::Park(cell),
            _ => Step::End,
        }
    }
}

/// Where the part of each ray or lane begins, and, behind the last, ends.
pub(super) type Starts = [u32; MAX_BUNDLE_RAYS + 1];

/// A job's streams as arrays to be looked up in.
#[derive(Clone, Debug)]
pub(super) struct Decoded {
    pub(super) n_rays: usize,
    pub(super) n_lanes: usize,
    pub(super) steps: Vec<StepWord>,
    pub(super) steps_at: Starts,
    pub(super) wanted: Vec<u64>,
    pub(super) wanted_at: Starts,
    /// A bit per test: hit or not.
    pub(super) tests: Vec<u64>,
    pub(super) tests_at: Starts,
    pub(super) hits: Vec<HitWords>,
    pub(super) hits_at: Starts,
}

impl Default for Decoded {
    fn default() -> Self {
        let none = [0; MAX_BUNDLE_RAYS + 1];
        Decoded {
            n_rays: 0,
            n_lanes: 0,
            steps: Vec::new(),
            steps_at: none,
            wanted: Vec::new(),
            wanted_at: none,
            tests: Vec::new(),
            tests_at: none,
            hits: Vec::new(),
            hits_at: none,
        }
    }
}

impl Decoded {
    /// Reads the streams of a job of `n_rays` rays.
    ///
    /// # Errors
    /// Names the stream that cannot be.
    pub(super) fn read(&mut self, bytes: &[u8], n_rays: usize, limits: &Limits) -> Result<(), &'static str> {
        let mut input = Input { bytes };
        (self.n_rays, self.n_lanes) = (n_rays, limits.n_lanes(n_rays));
        self.steps.clear();
        self.wanted.clear();
        self.tests.clear();
        self.hits.clear();
        self.read_steps(&mut input, limits).ok_or("a step")?;
        let mut n_tests = 0;
        for lane in 0..self.n_lanes {
            let n = input.count().ok_or("the number of verdicts")?;
            if limits.per_ray {
                let bits = input.take(n.div_ceil(8)).ok_or("a verdict")?;
                self.wanted.extend((0..n).map(|i| u64::from(bits[i / 8] >> (i % 8) & 1)));
            } else {
                let rays = u64::MAX >> (MAX_BUNDLE_RAYS - n_rays);
                for _ in 0..n {
                    let mask = input.varint().filter(|mask| mask & !rays == 0).ok_or("a verdict")?;
                    self.wanted.push(mask);
                }
            }
            let n = input.count().ok_or("the number of tests")?;
            let bits = input.take(n.div_ceil(8)).ok_or("a test")?;
            self.tests.resize((n_tests + n).div_ceil(64), 0);
            for (at, bits) in bits.iter().enumerate() {
                let left = n - 8 * at;
                let bits = if left < 8 { bits & ((1 << left) - 1) } else { *bits };
                let at = n_tests + 8 * at;
                self.tests[at / 64] |= u64::from(bits) << (at % 64);
                if at % 64 > 56 && at / 64 + 1 < self.tests.len() {
                    self.tests[at / 64 + 1] |= u64::from(bits) >> (64 - at % 64);
                }
                for _ in 0..bits.count_ones() {
                    self.hits.push(input.hit().ok_or("a hit")?);
                }
            }
            n_tests += n;
            self.wanted_at[lane + 1] = u32::try_from(self.wanted.len()).map_err(|_| "the number of verdicts")?;
            self.tests_at[lane + 1] = u32::try_from(n_tests).map_err(|_| "the number of tests")?;
            self.hits_at[lane + 1] = self.hits.len() as u32;
        }
        if input.bytes.is_empty() { Ok(()) } else { Err("bytes after the end") }
    }

    fn read_steps(&mut self, input: &mut Input<'_>, limits: &Limits) -> Option<()> {
        let (mut at, mut high) = (0, false);
        let bytes = input.bytes;
        let mut nibble = || {
            let byte = *bytes.get(at)?;
            at += usize::from(high);
            high = !high;
            Some(if high { byte & 15 } else { byte >> 4 })
        };
        let sides = 1_u32 << limits.grid.log2_cells;
        for ray in 0..self.n_rays {
            let mut last = Cell([0; 3]);
            loop {
                let code = nibble()?;
                let (kind, cell) = match code {
                    0..6 => (0, neighbour(last, code)?),
                    6..12 => (1, neighbour(last, code - 6)?),
                    ENTER_AT | PARK_AT => {
                        let mut cell = [0; 3];
                        for place in &mut cell {
                            *place = nibble()? | nibble()? << 4;
                        }
                        (u32::from(code - ENTER_AT), Cell(cell))
                    }
                    END => {
                        self.steps.push(StepWord::new(2, last));
                        break;
                    }
                    _ => break,
                };
                if cell.0.iter().any(|place| u32::from(*place) >= sides) {
                    return None;
                }
                if kind == 0 {
                    last = cell;
                }
                self.steps.push(StepWord::new(kind, cell));
            }
            self.steps_at[ray + 1] = u32::try_from(self.steps.len()).ok()?;
        }
        input.bytes = &bytes[at + usize::from(high)..];
        Some(())
    }
}

struct Input<'a> {
    bytes: &'a [u8],
}

impl<'a> Input<'a> {
    #[inline]
    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for (i, byte) in self.bytes.iter().take(10).enumerate() {
            let part = u64::from(byte & 0x7f);
            if i == 9 && part > 1 {
                return None;
            }
            value |= part << (7 * i);
            if byte & 0x80 == 0 {
                self.bytes = &self.bytes[i + 1..];
                return Some(value);
            }
        }
        None
    }

    /// A number of items, none of which takes less than a bit.
    fn count(&mut self) -> Option<usize> {
        let n = self.varint()?;
        (n.div_ceil(8) <= self.bytes.len() as u64).then_some(n as usize)
    }

    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, left) = self.bytes.split_at_checked(n)?;
        self.bytes = left;
        Some(taken)
    }

    #[inline]
    fn hit(&mut self) -> Option<HitWords> {
        let t = self.varint()?;
        let patch = self.varint()?;
        let facing = if patch & 1 == 1 { Facing::Back } else { Facing::Front };
        Some(HitWords { t, patch: u32::try_from(patch >> 1).ok()?, facing })
    }
}
