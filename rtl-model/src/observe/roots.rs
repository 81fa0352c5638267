//! Where stalls come from: a block whose output is full, followed downstream to the first block with another cause.
//!
//! ```text
//! in each cycle: block "output full" --its full link--> reader "output full" --...--> first other cause = the root
//! ```
//! A block's full link is the first one, in the order of the directory, that has no entry free at the start of the cycle;
//! where several are full (a loader before both ICU and memory) the cause alone does not tell for which it waits. A root
//! may be work: whoever is waited for is busy. Blocks that wait for each other in a ring have the block at which the walk
//! meets itself as their root, with cause output full. A root's starved and idle also stand for fill and drain.

use std::collections::BTreeMap;

use super::{LinkPlace, Places, Seen, StreamError};
use crate::sim::{Cause, CommandMark, Cycle};

/// Where a stall ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Root {
    /// The block.
    pub block: u16,
    /// What it did or waited for.
    pub cause: Cause,
}

/// Counts the roots of output-full cycles.
#[derive(Clone, Debug)]
pub struct Roots {
    places: Places,
    /// By block: what it does.
    causes: Vec<Cause>,
    /// By link: tokens inside at the start of cycle `now`, and what that cycle changes.
    occupancy: Vec<(u32, i8)>,
    /// Links that change in cycle `now`.
    changed: Vec<u16>,
    /// Blocks whose output is full.
    full: Vec<u16>,
    /// The root of each of `full`, when nothing changed since.
    roots: Vec<Root>,
    is_current: bool,
    now: Cycle,
    in_command: bool,
    cycles: BTreeMap<(u16, Root), u64>,
}

impl Roots {
    /// Nothing counted.
    pub fn new(places: &Places) -> Roots {
        Roots {
            causes: vec![Cause::Idle; places.blocks.len()],
            occupancy: vec![(0, 0); places.links.len()],
            changed: Vec::new(),
            full: Vec::new(),
            roots: Vec::new(),
            is_current: false,
            now: 0,
            in_command: false,
            cycles: BTreeMap::new(),
            places: places.clone(),
        }
    }

    /// Cycles by block and root.
    pub fn cycles(&self) -> impl Iterator<Item = (u16, Root, u64)> {
        self.cycles.iter().map(|((block, root), n)| (*block, *root, *n))
    }

    /// Takes what a decoder saw.
    ///
    /// # Errors
    /// [`StreamError::Tokens`]: a link has more tokens than entries, or fewer than none.
    #[inline]
    pub fn see(&mut self, now: Cycle, seen: &Seen) -> Result<(), StreamError> {
        if now > self.now {
            self.pass_to(now)?;
        }
        match *seen {
            Seen::Activity { block, cause } => {
                let before = std::mem::replace(&mut self.causes[usize::from(block)], cause);
                if before == Cause::OutputFull {
                    self.full.retain(|b| *b != block);
                }
                if cause == Cause::OutputFull {
                    self.full.push(block);
                }
                self.is_current = false;
            }
            Seen::Push { link, .. } => self.change(link, 1),
            Seen::Pop { link, .. } => self.change(link, -1),
            Seen::Command(CommandMark::Nearest | CommandMark::Any) => {
                self.in_command = true;
                // What a block did last in another command it does no longer.
                self.causes.fill(Cause::Idle);
                self.full.clear();
            }
            Seen::Command(CommandMark::End) => self.in_command = false,
            Seen::Command(_) | Seen::Rays { .. } | Seen::Bundle { .. } => {}
        }
        Ok(())
    }

    fn change(&mut self, link: u16, by: i8) {
        self.occupancy[usize::from(link)].1 += by;
        self.changed.push(link);
    }

    /// Counts the cycles from `self.now` to the one before `now`: the first of them with the links as they were at its
    /// start.
    fn pass_to(&mut self, now: Cycle) -> Result<(), StreamError> {
        self.count(1);
        for link in std::mem::take(&mut self.changed) {
            let (tokens, by) = &mut self.occupancy[usize::from(link)];
            let LinkPlace { name, depth, .. } = &self.places.links[usize::from(link)];
            let after = tokens.checked_add_signed(i32::from(std::mem::take(by)));
            *tokens = after.filter(|n| n <= depth).ok_or_else(|| StreamError::Tokens {
                cycle: self.now,
                what: format!("more tokens go into {name}, of depth {depth}, or come out than fit"),
            })?;
            self.is_current = false;
        }
        self.count(now - self.now - 1);
        self.now = now;
        Ok(())
    }

    /// Counts `n` cycles as they are now.
    fn count(&mut self, n: u64) {
        if n == 0 || !self.in_command || self.full.is_empty() {
            return;
        }
        if !self.is_current {
            let mut roots = std::mem::take(&mut self.roots);
            roots.clear();
            roots.extend(self.full.iter().map(|block| self.root_of(*block)));
            (self.roots, self.is_current) = (roots, true);
        }
        for (block, root) in self.full.iter().zip(&self.roots) {
            *self.cycles.entry((*block, *root)).or_default() += n;
        }
    }

    /// Follows a block's full links.
    fn root_of(&self, block: u16) -> Root {
        let mut at = block;
        // No path is longer than there are blocks, unless it is a ring.
        for _ in 0..self.causes.len() {
            let cause = self.causes[usize::from(at)];
            if cause != Cause::OutputFull {
                return Root { block: at, cause };
            }
            let is_full = |link: &&u16| {
                let place = usize::from(**link);
                self.occupancy[place].0 == self.places.links[place].depth
            };
            let Some(link) = self.places.outputs[usize::from(at)].iter().find(is_full) else { break };
            at = self.places.links[usize::from(*link)].to;
        }
        Root { block: at, cause: Cause::OutputFull }
    }
}
