//! Utilisation over time: in each interval of N cycles, the cycles of every kind of block by cause.
//!
//! ```text
//! Seen::Activity --> spells of blocks, cut at the interval's ends --> causes by kind, interval by interval
//! ```
//! Time is the board's clock. Fill and drain cannot be told from idle and starved while a run goes on, so those four are to
//! be taken together: [`Interval::waiting`]. Sums over the intervals are those of the account.

use super::{Kind, Places, Seen, StreamError};
use crate::sim::{Cause, CommandMark, Cycle};

/// Kinds of blocks.
const KINDS: usize = Kind::ALL.len();
/// Causes.
const CAUSES: usize = Cause::ALL.len();

/// What the kinds of blocks did in an interval.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interval {
    /// By kind and cause: block-cycles.
    cycles: [[u64; CAUSES]; KINDS],
}

/// Intervals, and the account of every block over all of them.
#[derive(Clone, Debug)]
pub struct Intervals {
    length: u64,
    limit: usize,
    kinds: Vec<Kind>,
    /// By block: what it does, since when; `None` outside commands.
    spells: Vec<Option<(Cause, Cycle)>>,
    intervals: Vec<Interval>,
    account: Vec<[u64; CAUSES]>,
}

impl Interval {
    const EMPTY: Interval = Interval { cycles: [[0; CAUSES]; KINDS] };

    /// Block-cycles of a kind with a cause. Fill and drain are 0: see [`Interval::waiting`].
    pub fn of(&self, kind: Kind, cause: Cause) -> u64 {
        self.cycles[kind as usize][cause as usize]
    }

    /// Block-cycles of a kind with nothing to do: starved, idle, fill or drain.
    pub fn waiting(&self, kind: Kind) -> u64 {
        self.of(kind, Cause::Starved) + self.of(kind, Cause::Idle)
    }

    /// Block-cycles of a kind.
    pub fn total(&self, kind: Kind) -> u64 {
        self.cycles[kind as usize].iter().sum()
    }

    /// The cause of most block-cycles of a kind, work included; none when it had no cycles. The first of equals leads.
    pub fn leading(&self, kind: Kind) -> Option<Cause> {
        let all = Cause::ALL.into_iter().map(|cause| (cause, self.of(kind, cause)));
        all.reduce(|best, next| if next.1 > best.1 { next } else { best })
            .filter(|(_, n)| *n > 0)
            .map(|(c, _)| c)
    }
}

impl Intervals {
    /// Intervals of `length` cycles each (1 at least), at most `limit` of them.
    pub fn new(places: &Places, length: u64, limit: usize) -> Intervals {
        Intervals {
            length: length.max(1),
            limit,
            kinds: places.blocks.iter().map(|b| b.kind).collect(),
            spells: vec![None; places.blocks.len()],
            intervals: Vec::new(),
            account: vec![[0; CAUSES]; places.blocks.len()],
        }
    }

    /// Cycles of each.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// The intervals, from cycle 0 on. The last one may have fewer cycles.
    pub fn intervals(&self) -> &[Interval] {
        &self.intervals
    }

    /// By block: cycles by cause, in the order of [`Cause::ALL`], fill and drain among starved and idle.
    pub fn account(&self) -> &[[u64; CAUSES]] {
        &self.account
    }

    /// Takes what a decoder saw.
    ///
    /// # Errors
    /// [`StreamError::Tokens`]: more intervals than the limit.
    #[inline]
    pub fn see(&mut self, now: Cycle, seen: &Seen) -> Result<(), StreamError> {
        match *seen {
            Seen::Activity { block, cause } => {
                self.close(usize::from(block), now)?;
                self.spells[usize::from(block)] = Some((cause, now));
            }
            Seen::Command(CommandMark::End) => {
                for block in 0..self.spells.len() {
                    self.close(block, now)?;
                    self.spells[block] = None;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Counts a block's spell up to `now`.
    fn close(&mut self, block: usize, now: Cycle) -> Result<(), StreamError> {
        let Some((cause, mut since)) = self.spells[block] else { return Ok(()) };
        self.account[block][cause as usize] += now - since;
        let kind = self.kinds[block] as usize;
        while since < now {
            let at = since / self.length;
            if at >= self.limit as u64 {
                let what = format!("over {} intervals of {} cycles", self.limit, self.length);
                return Err(StreamError::Tokens { cycle: since, what });
            }
            let at = at as usize;
            if at >= self.intervals.len() {
                self.intervals.resize(at + 1, Interval::EMPTY);
            }
            let end = now.min((at as u64 + 1).saturating_mul(self.length));
            self.intervals[at].cycles[kind][cause as usize] += end - since;
            since = end;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Directory;

    #[test]
    fn intervals_cut_spells_at_their_ends_and_name_the_leading_cause() {
        let blocks = ["dram", "cluster0.module0.icu", "cluster0.module1.icu"].map(String::from).to_vec();
        let places = Places::new(&Directory { blocks, links: Vec::new() }).unwrap();
        let mut intervals = Intervals::new(&places, 10, 4);
        for (now, block, cause) in [
            (0, 1, Cause::Idle),
            (0, 2, Cause::Idle),
            (4, 1, Cause::Work),
            (6, 2, Cause::Starved),
            (25, 1, Cause::OutputFull),
        ] {
            intervals.see(now, &Seen::Activity { block, cause }).unwrap();
        }
        intervals.see(28, &Seen::Command(CommandMark::End)).unwrap();
        let of = |i: usize, cause| intervals.intervals()[i].of(Kind::Icu, cause);
        assert_eq!([0, 1, 2].map(|i| of(i, Cause::Work)), [6, 10, 5]);
        assert_eq!([0, 1, 2].map(|i| of(i, Cause::OutputFull)), [0, 0, 3]);
        assert_eq!([0, 1, 2].map(|i| intervals.intervals()[i].waiting(Kind::Icu)), [10 + 4, 10, 8]);
        assert_eq!([0, 1, 2].map(|i| intervals.intervals()[i].total(Kind::Icu)), [20, 20, 16]);
        let leading = [0, 1, 2].map(|i| intervals.intervals()[i].leading(Kind::Icu));
        assert_eq!(leading, [Some(Cause::Idle), Some(Cause::Work), Some(Cause::Starved)]);
        assert_eq!(intervals.intervals()[0].leading(Kind::Dram), None);
        intervals.see(30, &Seen::Activity { block: 0, cause: Cause::Work }).unwrap();
        let e = intervals.see(41, &Seen::Command(CommandMark::End)).unwrap_err().to_string();
        assert_eq!(e, "cycle 40: over 4 intervals of 10 cycles");
    }
}
