//! Blocks by kind: the closed accounts of all instances together, and the one that works least.
//!
//! ```text
//! cluster2.module0.ctu3 --kind--> ctu        [BlockReport] --> [Group: kind, instances, sum of causes, least work]
//! ```

use rtl_model::sim::Cause;
use serde::Serialize;

use super::board::{BlockReport, CauseTable};
use super::si::share;

/// What kind a block or link is: the last part of its name without its number.
pub fn kind(name: &str) -> &str {
    let last = name.rsplit('.').next().unwrap_or(name);
    last.trim_end_matches(|c: char| c.is_ascii_digit())
}

/// Where an instance is, in short: `cluster3.module0.ctu2` is `c3.m0.ctu2`.
pub fn short(name: &str) -> String {
    name.replace("cluster", "c").replace("module", "m").replace("c_buffer", "cluster_buffer")
}

/// All blocks of a kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Group {
    /// Their kind.
    pub kind: String,
    /// How many.
    pub n: usize,
    /// Cycles by cause, summed over them.
    pub cycles: CauseTable,
    /// The one that works least, and its share of work; none where there is one instance.
    pub least_work: Option<(String, f64)>,
}

impl Group {
    /// The blocks by kind, in the order in which the kinds first come.
    pub fn of(blocks: &[BlockReport]) -> Vec<Group> {
        let mut groups: Vec<(Group, &BlockReport)> = Vec::new();
        for block in blocks {
            let which = kind(&block.block);
            let Some((group, least)) = groups.iter_mut().find(|(g, _)| g.kind == which) else {
                let group = Group { kind: which.to_owned(), n: 1, cycles: block.cycles, least_work: None };
                groups.push((group, block));
                continue;
            };
            group.n += 1;
            for (sum, n) in group.cycles.0.iter_mut().zip(block.cycles.0) {
                *sum += n;
            }
            if block.cycles.of(Cause::Work) < least.cycles.of(Cause::Work) {
                *least = block;
            }
        }
        let finish = |(group, least): (Group, &BlockReport)| {
            let work = share(least.cycles.of(Cause::Work), least.cycles.total());
            let least_work = (group.n > 1).then(|| (least.block.clone(), work));
            Group { least_work, ..group }
        };
        groups.into_iter().map(finish).collect()
    }

    /// Share of the cycles that went to a cause, mean over the instances.
    pub fn share(&self, cause: Cause) -> f64 {
        share(self.cycles.of(cause), self.cycles.total())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kind_and_short_name_of_blocks_and_links() {
        let cases = [
            ("dram", "dram", "dram"),
            ("cluster12.module3.ctu15", "ctu", "c12.m3.ctu15"),
            ("cluster0.module0.shell_tracker", "shell_tracker", "c0.m0.shell_tracker"),
            ("cluster0.cluster_buffer", "cluster_buffer", "c0.cluster_buffer"),
            ("cluster3.dram_requests", "dram_requests", "c3.dram_requests"),
        ];
        for (name, expected, in_short) in cases {
            assert_eq!((kind(name), short(name).as_str()), (expected, in_short));
        }
    }

    #[test]
    fn groups_sum_their_instances_and_name_the_one_that_works_least() {
        let block = |name: &str, work: u64, starved: u64| BlockReport {
            block: name.to_owned(),
            cycles: CauseTable([work, 0, 0, 0, 0, 0, starved, 0, 0, 0]),
        };
        let groups = Group::of(&[
            block("dram", 10, 90),
            block("cluster0.module0.icu", 60, 40),
            block("cluster0.reducer", 1, 99),
            block("cluster1.module0.icu", 20, 80),
            block("cluster2.module0.icu", 20, 80),
        ]);
        let kinds: Vec<_> = groups.iter().map(|g| (g.kind.as_str(), g.n)).collect();
        assert_eq!(kinds, [("dram", 1), ("icu", 3), ("reducer", 1)]);
        assert_eq!(groups[1].least_work, Some(("cluster1.module0.icu".to_owned(), 0.2)));
        assert_eq!((groups[0].least_work.as_ref(), groups[1].cycles.total()), (None, 300));
        assert!((groups[1].share(Cause::Work) - 1.0 / 3.0).abs() < 1e-12);
    }
}
