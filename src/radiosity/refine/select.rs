//! Which splits are made: largest gain per element first, a whole branch at a time.
//!
//! ```text
//! gains of tried splits (and, for the next round, of untried ones by extrapolation)
//!     --price of an element, L--> a split is kept when its gain and its branches' gains exceed 3 L an inner node
//! ```
//! For every L this is the best pruning of the tried quadtrees, squared error + L x elements; the largest L that meets
//! the wanted error is taken, or, where the limit on elements comes first, the smallest one under it.
//!
//! Source: Breiman, Friedman, Olshen, Stone 1984; Chou, Lookabaugh, Gray 1989.

use super::gain::ERROR_PER_GAIN;
use super::{ByNode, Node};
use crate::mesh::{MAX_LEVEL, Mesh, Place, Subdivision};

/// Squared error after a split over that before it, where nothing was measured: between a quadratic, 1/16, and a step,
/// 1/2.
const EXPECTED_FALL: f64 = 0.25;
/// A split is tried at this share of the price at which splits will be made: gains may fall slower than expected.
const TRIAL_SHARE: f64 = 0.25;
/// Where the limit of depth leaves more than the wanted squared error: what all splits leave, times this, is wanted instead.
/// The error is then 1.5 % above the least; to take that off elsewhere costs several times the elements.
const OVER_LEAST: f64 = 1.03;
/// Steps of the search for the price, each halving its logarithm's interval.
const N_BISECTIONS: u32 = 40;

/// Splits tried so far.
pub(super) struct Splits {
    /// Most splits inside each other, patch by patch.
    depths: Vec<u32>,
    gains: ByNode<f64>,
}

/// Splits to make, and what that leaves.
pub(super) struct Chosen {
    /// Nodes that are split, in order.
    pub(super) nodes: Vec<Node>,
    /// Estimated integral of the squared error (m^2).
    pub(super) squared_error: f64,
    pub(super) n_cut_by_count: u64,
    pub(super) n_cut_by_depth: u64,
}

impl Splits {
    /// Of whole patches; elements of `mesh` may be split `max_depth` times more than they are.
    pub(super) fn new(mesh: &Mesh, max_depth: u32) -> Splits {
        let deepest = |p: &crate::mesh::Patch| {
            let own = &mesh.elements[p.elements.start as usize..p.elements.end as usize];
            own.iter().map(|e| e.place.level()).max().unwrap_or(0)
        };
        let depths = mesh.patches.iter().map(|p| (deepest(p) + max_depth).min(MAX_LEVEL)).collect();
        Splits { depths, gains: ByNode::new() }
    }

    /// Most splits of any patch.
    pub(super) fn max_depth(&self) -> u32 {
        self.depths.iter().copied().max().unwrap_or(0)
    }

    fn roots(&self) -> impl Iterator<Item = (Node, u32)> {
        self.depths.iter().enumerate().map(|(p, depth)| ((p as u32, Place::ROOT), *depth))
    }

    pub(super) fn measured(&mut self, patch: u32, place: Place, gain: f64) {
        self.gains.insert((patch, place), gain);
    }

    /// Untried splits worth a trial: of all patches at first, then those of elements that a choice for the wanted squared
    /// error (m^2) within `limit` elements would make and, by extrapolation, split again.
    pub(super) fn candidates(&self, limit: u64, wanted: f64) -> Vec<Node> {
        if self.gains.is_empty() {
            return self.roots().filter(|(_, depth)| *depth > 0).map(|(root, _)| root).collect();
        }
        let wanted_price = self.price_of(self.reachable(wanted, true), true);
        let price = self.price_for(limit, true).max(TRIAL_SHARE * wanted_price);
        let chosen = self.pruned(price, true);
        let tried_above =
            |&(patch, place): &Node| place.parent().is_some_and(|up| self.gains.contains_key(&(patch, up)));
        chosen.into_iter().filter(|node| !self.gains.contains_key(node) && tried_above(node)).collect()
    }

    /// The best choice of tried splits for a squared error (m^2), or for one near the least where the limit of depth leaves
    /// more, within `limit` elements.
    pub(super) fn choose(&self, limit: u64, wanted: f64) -> Chosen {
        let wanted_price = self.price_of(self.reachable(wanted, false), false);
        let within = self.price_for(limit, false);
        let price = wanted_price.max(within);
        let nodes = self.pruned(price, false);
        let n_wanted = self.pruned(wanted_price, false).len();
        let squared_error = self.squared_error(&nodes);
        let deepest = self.leaves(&nodes).into_iter().filter(|(_, left, _)| *left == 0);
        let worth = 3.0 * ERROR_PER_GAIN * within.max(self.price_of(wanted, false));
        let n_cut_by_depth = deepest.filter(|(_, _, error)| *error > worth).count();
        Chosen {
            n_cut_by_count: (n_wanted.saturating_sub(nodes.len())) as u64,
            n_cut_by_depth: n_cut_by_depth as u64,
            squared_error,
            nodes,
        }
    }

    /// The squared error to aim at (m^2).
    fn reachable(&self, wanted: f64, extrapolate: bool) -> f64 {
        wanted.max(OVER_LEAST * self.squared_error(&self.pruned(self.least_price(), extrapolate)))
    }

    /// Largest price of which the choice meets a squared error (m^2).
    fn price_of(&self, squared_error: f64, extrapolate: bool) -> f64 {
        self.search(|price| self.squared_error(&self.pruned(price, extrapolate)) <= squared_error)
    }

    /// Far below any gain that matters.
    fn least_price(&self) -> f64 {
        1e-12 * self.gains.values().copied().fold(0.0, f64::max)
    }

    /// Smallest price at which the elements stay within `limit`.
    fn price_for(&self, limit: u64, extrapolate: bool) -> f64 {
        let room = limit.saturating_sub(self.depths.len() as u64) / 3;
        let largest = self.gains.values().copied().fold(0.0, f64::max);
        let fits = |price: f64| self.pruned(price, extrapolate).len() as u64 <= room;
        if largest <= 0.0 {
            return 0.0;
        }
        // To above every branch.
        let (mut low, mut high) = (self.least_price().ln(), (largest * 4.0).ln());
        if fits(low.exp()) {
            return low.exp();
        }
        for _ in 0..N_BISECTIONS {
            let middle = 0.5 * (low + high);
            if fits(middle.exp()) { high = middle } else { low = middle }
        }
        high.exp()
    }

    /// Largest price at which `enough` holds, or next to nothing when it never does.
    fn search(&self, enough: impl Fn(f64) -> bool) -> f64 {
        let largest = self.gains.values().copied().fold(0.0, f64::max);
        if largest <= 0.0 {
            return 0.0;
        }
        let (mut low, mut high) = (self.least_price().ln(), (largest * 4.0).ln());
        if enough(high.exp()) {
            return high.exp();
        }
        for _ in 0..N_BISECTIONS {
            let middle = 0.5 * (low + high);
            if enough(middle.exp()) { low = middle } else { high = middle }
        }
        low.exp()
    }

    /// The nodes that the best pruning at this price of an element splits, in order.
    fn pruned(&self, price: f64, extrapolate: bool) -> Vec<Node> {
        let mut kept = Vec::new();
        for (root, depth) in self.roots() {
            self.visit(root, depth, None, price, extrapolate, &mut kept);
        }
        kept.sort_unstable();
        kept
    }

    /// What the best branch from `node` on is worth at this price; its splits are added to `kept`.
    fn visit(
        &self,
        node: Node,
        depth_left: u32,
        expected: Option<f64>,
        price: f64,
        extrapolate: bool,
        kept: &mut Vec<Node>,
    ) -> f64 {
        if depth_left == 0 {
            return 0.0;
        }
        let measured = self.gains.get(&node).copied();
        let Some(gain) = measured.or(expected.filter(|_| extrapolate)) else { return 0.0 };
        // Extrapolated gains fall from level to level: their branch is worth it here or nowhere.
        if measured.is_none() && gain <= 3.0 * price {
            return 0.0;
        }
        let before = kept.len();
        let mut worth = gain - 3.0 * price;
        for k in 0..4 {
            let quarter = (node.0, node.1.quarter(k));
            let expected = Some(gain * EXPECTED_FALL / 4.0);
            worth += self.visit(quarter, depth_left - 1, expected, price, extrapolate, kept);
        }
        if worth > 0.0 {
            kept.push(node);
            worth
        } else {
            kept.truncate(before);
            0.0
        }
    }

    /// Elements under these splits: node, splits left to the limit, estimated integral of the squared error (m^2).
    fn leaves(&self, nodes: &[Node]) -> Vec<(Node, u32, f64)> {
        let mut leaves = Vec::new();
        let is_split = |node: &Node| nodes.binary_search(node).is_ok();
        // The gain one level up, and what was expected here.
        type Above = Option<(f64, f64)>;
        let mut open: Vec<(Node, u32, Above)> = Vec::new();
        for (root, depth) in self.roots() {
            open.push((root, depth, None));
            while let Some((node, left, above)) = open.pop() {
                let gain = self.gains.get(&node).copied();
                let gain = gain.or(above.map(|(_, expected)| expected)).unwrap_or(0.0);
                if is_split(&node) {
                    // How the gains fell on the way here says how they go on.
                    let fall = match above {
                        Some((up, _)) if up > 0.0 => (4.0 * gain / up).clamp(1.0 / 16.0, 0.5),
                        _ => EXPECTED_FALL,
                    };
                    open.extend((0..4).map(|k| {
                        let quarter = (node.0, node.1.quarter(k));
                        (quarter, left - 1, Some((gain, gain * fall / 4.0)))
                    }));
                } else {
                    leaves.push((node, left, ERROR_PER_GAIN * gain));
                }
            }
        }
        leaves
    }

    fn squared_error(&self, nodes: &[Node]) -> f64 {
        self.leaves(nodes).into_iter().map(|(_, _, error)| error).sum()
    }

    /// The splits of `nodes` and all above these.
    pub(super) fn subdivision(&self, nodes: &[Node]) -> Subdivision {
        let mut split: Vec<Node> = Vec::with_capacity(2 * nodes.len());
        for &(patch, place) in nodes {
            split.extend((0..=place.level()).map(|level| (patch, place.at_level(level))));
        }
        split.sort_unstable();
        split.dedup();
        Subdivision::new(self.depths.len() as u32, |patch, place| {
            split.binary_search(&(patch, place)).is_ok()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Trees of `n` patches, gains by hash; every node down to `depth` is tried.
    fn tried(n: u32, depth: u32, seed: u64) -> Splits {
        let mut splits = Splits { depths: vec![depth; n as usize], gains: ByNode::new() };
        let mut open: Vec<(Node, f64)> = (0..n).map(|p| ((p, Place::ROOT), 1.0)).collect();
        while let Some(((p, place), scale)) = open.pop() {
            let id = place.quarters().fold(1, |id, q| 4 * id + u64::from(q));
            let [u, _] = crate::sampling::unit_pair(crate::sampling::hash(seed, p.into(), id));
            splits.measured(p, place, scale * u * u * u);
            if place.level() + 1 < depth {
                open.extend((0..4).map(|k| ((p, place.quarter(k)), 0.4 * scale)));
            }
        }
        splits
    }

    /// Best total of gain - 3 price over all prunings under `node`, by trying all of them.
    fn best(splits: &Splits, node: Node, left: u32, price: f64) -> f64 {
        if left == 0 {
            return 0.0;
        }
        let below: f64 = (0..4).map(|k| best(splits, (node.0, node.1.quarter(k)), left - 1, price)).sum();
        (splits.gains[&node] - 3.0 * price + below).max(0.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn pruning_at_any_price_is_the_best_and_closed_upwards(seed: u64, log_price in -8.0..0.0f64) {
            let splits = tried(3, 3, seed);
            let price = log_price.exp();
            let nodes = splits.pruned(price, false);
            let got: f64 = nodes.iter().map(|n| splits.gains[n] - 3.0 * price).sum();
            let most: f64 = (0..3).map(|p| best(&splits, (p, Place::ROOT), 3, price)).sum();
            prop_assert!((got - most).abs() < 1e-12, "{} vs {}", got, most);
            prop_assert!(nodes.iter().all(|(p, place)| place.parent().is_none_or(|up| nodes.contains(&(*p, up)))));
        }

        #[test]
        fn choice_meets_the_error_within_the_limit_or_says_what_was_cut(
            seed: u64, limit in 8..200u64, wanted in 0.0..2.0f64
        ) {
            let splits = tried(8, 3, seed);
            let chosen = splits.choose(limit, wanted);
            prop_assert!(8 + 3 * chosen.nodes.len() as u64 <= limit);
            if chosen.squared_error > splits.reachable(wanted, false) {
                // More was wanted, or nothing is left to split.
                prop_assert!(chosen.n_cut_by_count > 0 || chosen.n_cut_by_depth > 0);
            }
            let more = splits.choose(limit + 30, wanted);
            // The estimate may grow, where a split shows more than was expected under it; what is gained never falls.
            let gained = |c: &Chosen| c.nodes.iter().map(|n| splits.gains[n]).sum::<f64>();
            prop_assert!(gained(&more) >= gained(&chosen) - 1e-12);
        }
    }
}
