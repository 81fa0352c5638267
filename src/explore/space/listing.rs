//! Combinations that are no candidates, with their reasons counted.

use std::collections::BTreeMap;

use super::{Impossible, Space};

/// Which of some combinations are no candidates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImpossibleList {
    /// How many were asked for.
    pub n_asked: u64,
    /// Each of them that is none, in the order asked for.
    pub list: Vec<Impossible>,
    /// Reasons, the most frequent first, then in the order of the alphabet.
    pub by_reason: Vec<(String, u64)>,
}

impl Space {
    /// The combinations among `ordinals` that are no candidates.
    pub fn impossible(&self, ordinals: impl IntoIterator<Item = u64>) -> ImpossibleList {
        let mut found = ImpossibleList::default();
        let mut reasons: BTreeMap<String, u64> = BTreeMap::new();
        for ordinal in ordinals {
            found.n_asked += 1;
            if let Err(impossible) = self.candidate(ordinal) {
                *reasons.entry(impossible.reason.clone()).or_default() += 1;
                found.list.push(impossible);
            }
        }
        found.by_reason = reasons.into_iter().collect();
        found.by_reason.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        found
    }
}
