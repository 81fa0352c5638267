//! The answers to one job as bytes.
//!
//! ```text
//! head      for each ray: varint nibbles of its steps
//!           for each lane (grid: each ray; shells: the bundle): varints verdicts, tests, bytes of hits
//!           shells: varint bytes of verdicts
//! steps     nibbles, ray after ray, the low half of a byte first:
//!             0..5 enter the neighbour in direction 2 axis + (1 when upward), 6..11 park before it, 12 end,
//!             13 enter and 14 park with the cell in six nibbles (x, y, z, low halves first)
//! verdicts  grid: a bit each, lane after lane; shells: a mask each, as varints
//! tests     a bit each (hit or not), lane after lane
//! hits      varint t, varint 2 patch + (1 for the back), lane after lane
//! ```
//! Directions are from the cell that the ray entered last. Bits fill bytes from the lowest. A varint has 7 bits a byte,
//! lowest first, all bytes but the last with bit 7 set. Parts start on bytes. Look-ups read the bytes as they are: in a
//! replay 16 bundles are open at once, and their bytes, not arrays of them, fit the host's cache.

use crate::answers::Step;
use crate::datapath::cell_step::{Cell, Grid};
use crate::datapath::{Facing, HitWords};
use crate::packet::MAX_BUNDLE_RAYS;

const END: u8 = 12;
const ENTER_AT: u8 = 13;
const PARK_AT: u8 = 14;

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

    /// The bits that no packed cell of the grid has.
    fn no_cell(&self) -> u32 {
        !(((1_u32 << self.grid.log2_cells.min(8)) - 1) * 0x01_0101)
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

    /// The job's streams.
    pub(super) fn to_bytes(&self, per_ray: bool) -> Vec<u8> {
        let mut head = Vec::new();
        let mut nibbles = Nibbles::default();
        for steps in &self.steps {
            let before = nibbles.n;
            let mut last = None;
            for step in steps {
                match *step {
                    Step::Enter(cell) => {
                        nibbles.cell(last, cell, 0, ENTER_AT);
                        last = Some(cell);
                    }
                    Step::Park(cell) => nibbles.cell(last, cell, 6, PARK_AT),
                    Step::End => nibbles.push(END),
                }
            }
            write_varint(&mut head, nibbles.n - before);
        }
        let (mut verdicts, mut hits) = (Vec::new(), Vec::new());
        for lane in &self.lanes {
            let before = hits.len();
            for hit in lane.tests.iter().flatten() {
                write_varint(&mut hits, hit.t);
                write_varint(&mut hits, u64::from(hit.patch) << 1 | u64::from(hit.facing == Facing::Back));
            }
            for n in [lane.wanted.len(), lane.tests.len(), hits.len() - before] {
                write_varint(&mut head, n as u64);
            }
        }
        if per_ray {
            write_bits(
                &mut verdicts,
                self.lanes.iter().flat_map(|lane| &lane.wanted).map(|wanted| *wanted != 0),
            );
        } else {
            let masks = self.lanes.iter().flat_map(|lane| &lane.wanted);
            masks.for_each(|wanted| write_varint(&mut verdicts, *wanted));
            write_varint(&mut head, verdicts.len() as u64);
        }
        let mut tests = Vec::new();
        write_bits(&mut tests, self.lanes.iter().flat_map(|lane| &lane.tests).map(Option::is_some));
        [head, nibbles.bytes, verdicts, tests, hits].concat()
    }
}

/// Two to a byte.
#[derive(Default)]
struct Nibbles {
    bytes: Vec<u8>,
    n: u64,
}

impl Nibbles {
    fn push(&mut self, nibble: u8) {
        match self.bytes.last_mut() {
            Some(last) if self.n % 2 == 1 => *last |= nibble << 4,
            _ => self.bytes.push(nibble),
        }
        self.n += 1;
    }

    fn cell(&mut self, last: Option<Cell>, cell: Cell, base: u8, explicit: u8) {
        let from = last.map(pack);
        let is_neighbour =
            |d: &u8| from.map(|from| from.wrapping_add(STEPS[usize::from(*d)])) == Some(pack(cell));
        match (0..6).find(is_neighbour) {
            Some(direction) => self.push(base + direction),
            None => {
                self.push(explicit);
                for place in cell.0 {
                    self.push(place & 15);
                    self.push(place >> 4);
                }
            }
        }
    }
}

/// What a step in each direction adds to a packed cell.
const STEPS: [u32; 6] =
    [1_u32.wrapping_neg(), 1, 0x100_u32.wrapping_neg(), 0x100, 0x1_0000_u32.wrapping_neg(), 0x1_0000];

/// A cell's places in the bytes of a word; the grid has at most 128 cells a side, so a step out of it sets a bit that
/// no place has.
fn pack(cell: Cell) -> u32 {
    let [x, y, z] = cell.0;
    u32::from_le_bytes([x, y, z, 0])
}

#[inline]
fn unpack(packed: u32) -> Cell {
    let [x, y, z, _] = packed.to_le_bytes();
    Cell([x, y, z])
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

/// Where the part of each ray or lane begins, and, behind the last, ends.
type Places = [u32; MAX_BUNDLE_RAYS + 1];

/// Cursors into one kind of stream.
#[derive(Clone, Copy, Debug)]
struct Cursors {
    next: Places,
    starts: Places,
}

impl Cursors {
    const NONE: Cursors = Cursors { next: [0; MAX_BUNDLE_RAYS + 1], starts: [0; MAX_BUNDLE_RAYS + 1] };

    /// From the lengths in `starts[1..]`, the first part at `start`; where the last one ends.
    fn place(&mut self, start: u64, n: usize) -> Option<u64> {
        let mut end = start;
        self.starts[0] = u32::try_from(start).ok()?;
        for place in &mut self.starts[1..=n] {
            end += u64::from(*place);
            *place = u32::try_from(end).ok()?;
        }
        self.next = self.starts;
        Some(end)
    }

    fn are_at_end(&self, n: usize) -> bool {
        self.next[..n] == self.starts[1..=n]
    }
}

/// A job's streams, with what was looked up already.
#[derive(Clone, Debug)]
pub(super) struct Streams<'a> {
    bytes: &'a [u8],
    n_rays: usize,
    n_lanes: usize,
    no_cell: u32,
    /// In nibbles; the cell that each ray entered last.
    steps: Cursors,
    cells: [u32; MAX_BUNDLE_RAYS],
    /// In bits (grid) or bytes (shells).
    verdicts: Cursors,
    /// In bits.
    tests: Cursors,
    /// In bytes.
    hits: Cursors,
}

impl Default for Streams<'_> {
    fn default() -> Self {
        let none = Cursors::NONE;
        Streams {
            bytes: &[],
            n_rays: 0,
            n_lanes: 0,
            no_cell: 0,
            steps: none,
            cells: [0; MAX_BUNDLE_RAYS],
            verdicts: none,
            tests: none,
            hits: none,
        }
    }
}

impl<'a> Streams<'a> {
    /// Opens the streams of a job of `n_rays` rays.
    ///
    /// # Errors
    /// When the parts are not as long as the bytes are.
    pub(super) fn open(
        &mut self,
        bytes: &'a [u8],
        n_rays: usize,
        limits: &Limits,
    ) -> Result<(), &'static str> {
        (self.n_rays, self.n_lanes) = (n_rays, limits.n_lanes(n_rays));
        self.no_cell = limits.no_cell();
        self.cells = [0; MAX_BUNDLE_RAYS];
        self.bytes = bytes;
        self.place_parts(limits).ok_or_else(|| {
            (self.bytes, self.n_rays, self.n_lanes) = (&[], 0, 0);
            "the lengths"
        })
    }

    fn place_parts(&mut self, limits: &Limits) -> Option<()> {
        let mut at = 0;
        let mut length = || u32::try_from(varint(self.bytes, &mut at)?).ok();
        for ray in 1..=self.n_rays {
            self.steps.starts[ray] = length()?;
        }
        for lane in 1..=self.n_lanes {
            self.verdicts.starts[lane] = length()?;
            self.tests.starts[lane] = length()?;
            self.hits.starts[lane] = length()?;
        }
        if !limits.per_ray {
            self.verdicts.starts[1] = length()?;
        }
        let mut end = self.steps.place(2 * u64::from(at), self.n_rays)?.div_ceil(2);
        end = match limits.per_ray {
            true => self.verdicts.place(8 * end, self.n_lanes)?.div_ceil(8),
            false => self.verdicts.place(end, self.n_lanes)?,
        };
        end = self.tests.place(8 * end, self.n_lanes)?.div_ceil(8);
        end = self.hits.place(end, self.n_lanes)?;
        (end == self.bytes.len() as u64).then_some(())
    }

    /// Every item was looked up, and none beyond.
    pub(super) fn are_used_up(&self) -> bool {
        self.steps.are_at_end(self.n_rays)
            && self.verdicts.are_at_end(self.n_lanes)
            && self.tests.are_at_end(self.n_lanes)
            && self.hits.are_at_end(self.n_lanes)
    }

    /// Looks everything up.
    ///
    /// # Errors
    /// Names the stream that holds what cannot be.
    pub(super) fn check(&mut self, per_ray: bool) -> Result<(), &'static str> {
        for ray in 0..self.n_rays {
            while self.steps.next[ray] < self.steps.starts[ray + 1] {
                self.step(ray).ok_or("a step")?;
            }
        }
        let rays = u64::MAX >> (MAX_BUNDLE_RAYS - self.n_rays);
        for lane in 0..self.n_lanes {
            while self.verdicts.next[lane] < self.verdicts.starts[lane + 1] {
                let wanted = if per_ray { self.verdict(lane) } else { self.mask(lane) };
                wanted.filter(|wanted| wanted & !rays == 0).ok_or("a verdict")?;
            }
            while self.tests.next[lane] < self.tests.starts[lane + 1] {
                self.test(lane).ok_or("a hit")?;
            }
        }
        if self.are_used_up() { Ok(()) } else { Err("the lengths") }
    }

    #[inline]
    fn nibble(&self, at: u32) -> Option<u8> {
        let byte = *self.bytes.get((at / 2) as usize)?;
        Some(byte >> (4 * (at & 1)) & 15)
    }

    #[inline]
    fn bit(&self, at: u32) -> Option<bool> {
        let byte = *self.bytes.get((at / 8) as usize)?;
        Some(byte >> (at % 8) & 1 == 1)
    }

    /// The next step of a ray.
    #[inline]
    pub(super) fn step(&mut self, ray: usize) -> Option<Step> {
        let at = self.steps.next[ray];
        let code = self.nibble(at)?;
        self.steps.next[ray] = at + 1;
        let (is_enter, packed) = match code {
            0..6 => (true, self.cells[ray].wrapping_add(STEPS[usize::from(code)])),
            6..12 => (false, self.cells[ray].wrapping_add(STEPS[usize::from(code - 6)])),
            END => return Some(Step::End),
            ENTER_AT | PARK_AT => {
                let mut packed = 0;
                for i in 0..6 {
                    packed |= u32::from(self.nibble(at + 1 + i)?) << (4 * i);
                }
                self.steps.next[ray] = at + 7;
                (code == ENTER_AT, packed)
            }
            _ => return None,
        };
        if packed & self.no_cell != 0 {
            return None;
        }
        if is_enter {
            self.cells[ray] = packed;
            return Some(Step::Enter(unpack(packed)));
        }
        Some(Step::Park(unpack(packed)))
    }

    /// The next verdict of a ray (grid).
    #[inline]
    pub(super) fn verdict(&mut self, lane: usize) -> Option<u64> {
        let wanted = self.bit(self.verdicts.next[lane])?;
        self.verdicts.next[lane] += 1;
        Some(u64::from(wanted))
    }

    /// The next verdict of the bundle (shells).
    #[inline]
    pub(super) fn mask(&mut self, lane: usize) -> Option<u64> {
        varint(self.bytes, &mut self.verdicts.next[lane])
    }

    /// The next test; `None` when there is no such test.
    #[inline]
    pub(super) fn test(&mut self, lane: usize) -> Option<Option<HitWords>> {
        let is_hit = self.bit(self.tests.next[lane])?;
        self.tests.next[lane] += 1;
        if !is_hit {
            return Some(None);
        }
        let t = varint(self.bytes, &mut self.hits.next[lane])?;
        let patch = varint(self.bytes, &mut self.hits.next[lane])?;
        let facing = if patch & 1 == 1 { Facing::Back } else { Facing::Front };
        Some(Some(HitWords { t, patch: u32::try_from(patch >> 1).ok()?, facing }))
    }
}

/// A number of at most 64 bits at `at`, which moves on.
#[inline]
fn varint(bytes: &[u8], at: &mut u32) -> Option<u64> {
    let mut value = 0;
    for i in 0..10 {
        let byte = *bytes.get(*at as usize)?;
        *at += 1;
        let part = u64::from(byte & 0x7f);
        if i == 9 && part > 1 {
            return None;
        }
        value |= part << (7 * i);
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}
