//! The closed account: every block-cycle has exactly one cause.
//!
//! ```text
//! tick() -> Activity --Accounts::record--> cycles by Cause      idle before the first token = fill, after the last = drain
//! ```

use serde::{Deserialize, Serialize};

use super::event::activity_payload;
use super::{Cycle, EventKind, Observer};

/// Why a block did what it did in a cycle: exactly one cause per block and cycle, the first that applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Did useful work.
    Work,
    /// Has a token and nowhere to put it.
    OutputFull,
    /// Waits for a unit of its own (context, table entry, pipeline slot).
    Resource,
    /// Waits for a line that a cache asked for.
    CacheMiss,
    /// Waits for the memory itself.
    Memory,
    /// Waits for the host bus.
    Bus,
    /// Nothing to do, while work assigned to its cluster (or the board) is in progress elsewhere.
    Starved,
    /// Nothing assigned.
    Idle,
    /// Before its first token of the run.
    Fill,
    /// After its last token of the run.
    Drain,
}

impl Cause {
    /// Every cause, in order of precedence.
    pub const ALL: [Cause; 10] = [
        Cause::Work,
        Cause::OutputFull,
        Cause::Resource,
        Cause::CacheMiss,
        Cause::Memory,
        Cause::Bus,
        Cause::Starved,
        Cause::Idle,
        Cause::Fill,
        Cause::Drain,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Work => "work",
            Cause::OutputFull => "output full",
            Cause::Resource => "resource",
            Cause::CacheMiss => "cache miss",
            Cause::Memory => "memory",
            Cause::Bus => "bus",
            Cause::Starved => "starved",
            Cause::Idle => "idle",
            Cause::Fill => "fill",
            Cause::Drain => "drain",
        }
    }
}

/// What a block's tick returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Did useful work.
    Work,
    /// Held something and could not go on, for this cause.
    Stall(Cause),
    /// Held nothing.
    Idle,
}

impl Activity {
    /// A number for each, never 0.
    #[inline]
    fn code(self) -> u8 {
        match self {
            Activity::Work => 1,
            Activity::Idle => 2,
            Activity::Stall(cause) => 3 + cause as u8,
        }
    }
}

/// The closed account of one block.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockAccount {
    /// Hierarchical name: `cluster0.module0.icu`.
    pub block: String,
    /// Cycles by cause, in the order of [`Cause::ALL`].
    pub cycles: [u64; 10],
}

impl BlockAccount {
    /// Cycles of one cause.
    pub fn of(&self, cause: Cause) -> u64 {
        self.cycles[cause as usize]
    }

    /// Cycles of all causes: the cycles of the run.
    pub fn total(&self) -> u64 {
        self.cycles.iter().sum()
    }
}

/// Accumulates the accounts of a set of blocks, run by run.
///
/// Each block's activity of now is kept apart from the sums, in a byte: a cycle that repeats the last one touches nothing
/// else.
#[derive(Clone, Debug)]
pub struct Accounts {
    /// Activity of each block in the latest cycle, 0 before the first one of a run.
    codes: Box<[u8]>,
    spells: Vec<Spell>,
    sums: Vec<Sums>,
    /// Number of block 0 in the board's directory.
    first: u16,
}

/// Equal cycles in a row.
#[derive(Clone, Copy, Debug, Default)]
struct Spell {
    /// The first of them.
    since: Cycle,
    /// What the block does in them; `None` before the first cycle of a run.
    latest: Option<(Activity, bool)>,
}

#[derive(Clone, Debug, Default)]
struct Sums {
    cycles: [u64; 10],
    /// Idle and starved cycles since the last token of this run: that if another one comes, drain if none does.
    trailing: [u64; 2],
    /// Had a token in this run.
    started: bool,
}

impl Accounts {
    /// Empty accounts of `n_blocks` blocks, of which the first has number `first` in the board's directory.
    pub fn new(n_blocks: usize, first: u16) -> Self {
        Accounts {
            codes: vec![0; n_blocks].into_boxed_slice(),
            spells: vec![Spell::default(); n_blocks],
            sums: vec![Sums::default(); n_blocks],
            first,
        }
    }

    /// A block's number in the board's directory.
    #[inline]
    pub fn number(&self, block: usize) -> u16 {
        self.first + block as u16
    }

    /// Records what a block does in cycle `now`, and in all that follow until another call says otherwise. `assigned`
    /// tells whether the surroundings have work in progress: an idle block is then starved.
    #[inline(always)]
    pub fn record<O: Observer>(
        &mut self,
        now: Cycle,
        block: usize,
        activity: Activity,
        assigned: bool,
        observer: &mut O,
    ) {
        let code = activity.code() << 1 | u8::from(assigned);
        if self.codes[block] != code {
            self.codes[block] = code;
            self.change(now, block, (activity, assigned));
            if O::ON {
                let payload = activity_payload(activity, assigned);
                observer.event(now, EventKind::Activity, self.first + block as u16, payload);
            }
        }
    }

    #[inline(never)]
    fn change(&mut self, now: Cycle, block: usize, latest: (Activity, bool)) {
        let spell = &mut self.spells[block];
        self.sums[block].add(spell, now);
        *spell = Spell { since: now, latest: Some(latest) };
    }

    /// Ends a run before cycle `now`: what was idle since the last token was drain, as are `after` more cycles with
    /// nothing on the board (the host's interrupt).
    pub fn end_run(&mut self, now: Cycle, after: u64) {
        self.codes.fill(0);
        for (spell, sums) in self.spells.iter_mut().zip(&mut self.sums) {
            sums.add(spell, now);
            *spell = Spell::default();
            sums.cycles[Cause::Drain as usize] +=
                std::mem::take(&mut sums.trailing).iter().sum::<u64>() + after;
            sums.started = false;
        }
    }

    /// What a block did in the latest cycle, for the watchdog's message.
    pub fn latest(&self, block: usize) -> &'static str {
        match self.spells[block].latest {
            None => "never ticked",
            Some((Activity::Work, _)) => Cause::Work.name(),
            Some((Activity::Stall(cause), _)) => cause.name(),
            Some((Activity::Idle, true)) => Cause::Starved.name(),
            Some((Activity::Idle, false)) => Cause::Idle.name(),
        }
    }

    /// A block's account so far, under a name; closed between runs.
    pub fn named(&self, block: usize, name: String) -> BlockAccount {
        BlockAccount { block: name, cycles: self.sums[block].cycles }
    }
}

impl Sums {
    fn add(&mut self, spell: &Spell, now: Cycle) {
        let n = now - spell.since;
        let cause = match spell.latest {
            None => return,
            Some((Activity::Work, _)) => Cause::Work,
            Some((Activity::Stall(cause), _)) => cause,
            Some((Activity::Idle, _)) if !self.started => {
                self.cycles[Cause::Fill as usize] += n;
                return;
            }
            Some((Activity::Idle, assigned)) => {
                self.trailing[usize::from(assigned)] += n;
                return;
            }
        };
        self.started = true;
        let [idle, starved] = std::mem::take(&mut self.trailing);
        self.cycles[Cause::Idle as usize] += idle;
        self.cycles[Cause::Starved as usize] += starved;
        self.cycles[cause as usize] += n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::Silent;

    #[test]
    fn account_of_a_run_with_gaps_names_fill_idle_and_drain_and_closes() {
        let mut account = Accounts::new(1, 0);
        let activities = [
            Activity::Idle,
            Activity::Idle,
            Activity::Work,
            Activity::Idle,
            Activity::Stall(Cause::OutputFull),
            Activity::Work,
            Activity::Idle,
            Activity::Idle,
            Activity::Idle,
        ];
        for (now, activity) in (100..).zip(activities) {
            account.record(now, 0, activity, false, &mut Silent);
        }
        account.end_run(109, 0);
        let closed = account.named(0, "block".into());
        assert_eq!(closed.total(), 9);
        let of = |c| closed.of(c);
        assert_eq!(
            [of(Cause::Fill), of(Cause::Work), of(Cause::Idle), of(Cause::OutputFull), of(Cause::Drain)],
            [2, 2, 1, 1, 3]
        );
    }

    #[test]
    fn account_of_an_idle_block_with_work_elsewhere_is_starved() {
        let mut account = Accounts::new(1, 0);
        let activities = [
            (Activity::Work, true),
            (Activity::Idle, true),
            (Activity::Idle, false),
            (Activity::Idle, true),
            (Activity::Work, true),
            (Activity::Idle, true),
            (Activity::Idle, false),
        ];
        for (now, (activity, assigned)) in (0..).zip(activities) {
            account.record(now, 0, activity, assigned, &mut Silent);
        }
        account.end_run(7, 5);
        let closed = account.named(0, String::new());
        let cycles = [Cause::Work, Cause::Starved, Cause::Idle, Cause::Drain].map(|c| closed.of(c));
        assert_eq!(cycles, [2, 2, 1, 2 + 5], "after the last token all is drain, assigned or not");
        assert_eq!(closed.total(), 12);
    }
}
