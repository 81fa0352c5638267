//! What a board counted: canonical work, traffic, and the closed account of every block.

use serde::{Deserialize, Serialize};

use crate::functional::CanonicalCounters;
use crate::occupancy::UnitOccupancy;
use crate::sim::{BlockAccount, Cause};

/// Everything counted since the board was made, or between two moments.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoardStatistics {
    /// Board clock cycles.
    pub cycles: u64,
    /// Commands that the host gave.
    pub commands: u64,
    /// Work that no timing choice changes.
    pub canonical: CanonicalCounters,
    /// How full the bundles were.
    pub bundles: UnitOccupancy,
    /// How full the units of up to 64 were that rays without a bundle were cut into.
    pub explicit: UnitOccupancy,
    /// Bytes from host to board.
    pub bus_down_bytes: u64,
    /// Bytes from board to host.
    pub bus_up_bytes: u64,
    /// Bus cycles of transfers from host to board, their arbitration included.
    pub bus_down_cycles: u64,
    /// Bus cycles of transfers from board to host, their arbitration included.
    pub bus_up_cycles: u64,
    /// Cycles in which the DRAM was occupied.
    pub dram_busy_cycles: u64,
    /// Times that the dispatcher cut the partition anew.
    pub rebalances: u64,
    /// Cache and memory levels, from the ICU outward.
    pub memory: Vec<LevelStatistics>,
    /// The closed account of every block: causes sum to `cycles`.
    pub blocks: Vec<BlockAccount>,
}

/// Traffic of one memory level, summed over its instances.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelStatistics {
    /// Which level.
    pub level: String,
    /// Look-ups (cache) or line transfers (DRAM).
    pub accesses: u64,
    /// Look-ups that missed (DRAM: row misses).
    pub misses: u64,
    /// Bytes brought in from the next level (DRAM: read): lines, each of which may serve several misses.
    pub bytes: u64,
    /// Bytes written to the next level (DRAM: written).
    pub written_bytes: u64,
}

impl BoardStatistics {
    /// What was counted since `earlier`, a previous state of the same board.
    pub fn since(&self, earlier: &BoardStatistics) -> BoardStatistics {
        self.combine(earlier, |now, before| now - before)
    }

    /// The sum of two counts of the same board.
    pub fn plus(&self, other: &BoardStatistics) -> BoardStatistics {
        self.combine(other, |a, b| a + b)
    }

    /// Each counter with its counterpart. A default value (nothing counted yet) has no levels or blocks: zeros.
    fn combine(&self, other: &BoardStatistics, f: fn(u64, u64) -> u64) -> BoardStatistics {
        if self.blocks.is_empty() && !other.blocks.is_empty() {
            let zeros = other.combine(other, |_, _| 0);
            return zeros.combine(other, f);
        }
        BoardStatistics {
            cycles: f(self.cycles, other.cycles),
            commands: f(self.commands, other.commands),
            canonical: self.canonical.combine(&other.canonical, f),
            bundles: self.bundles.combine(&other.bundles, f),
            explicit: self.explicit.combine(&other.explicit, f),
            bus_down_bytes: f(self.bus_down_bytes, other.bus_down_bytes),
            bus_up_bytes: f(self.bus_up_bytes, other.bus_up_bytes),
            bus_down_cycles: f(self.bus_down_cycles, other.bus_down_cycles),
            bus_up_cycles: f(self.bus_up_cycles, other.bus_up_cycles),
            dram_busy_cycles: f(self.dram_busy_cycles, other.dram_busy_cycles),
            rebalances: f(self.rebalances, other.rebalances),
            memory: self
                .memory
                .iter()
                .enumerate()
                .map(|(i, level)| {
                    let o = other.memory.get(i).cloned().unwrap_or_default();
                    LevelStatistics {
                        level: level.level.clone(),
                        accesses: f(level.accesses, o.accesses),
                        misses: f(level.misses, o.misses),
                        bytes: f(level.bytes, o.bytes),
                        written_bytes: f(level.written_bytes, o.written_bytes),
                    }
                })
                .collect(),
            blocks: self
                .blocks
                .iter()
                .enumerate()
                .map(|(i, block)| {
                    let o = other.blocks.get(i).map_or([0; 10], |b| b.cycles);
                    let cycles = std::array::from_fn(|c| f(block.cycles[c], o[c]));
                    BlockAccount { block: block.block.clone(), cycles }
                })
                .collect(),
        }
    }

    /// Share of all ICU cycles in which an ICU worked, in [0, 1].
    pub fn icu_utilisation(&self) -> f64 {
        let icus = self.blocks.iter().filter(|b| b.block.ends_with(".icu"));
        let (work, total) = icus.fold((0, 0), |(w, t), b| (w + b.of(Cause::Work), t + b.total()));
        if total == 0 { 0.0 } else { work as f64 / total as f64 }
    }
}
