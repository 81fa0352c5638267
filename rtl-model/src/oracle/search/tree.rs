//! A tree of boxes over quantised patches, and the slab test with its error bound.
//!
//! ```text
//! boxes -> cut where the surface area heuristic is least, to single patches -> nodes, children side by side
//! ray -> per node: t at which its box is entered, too small by at most 2^-49 of itself -> nearer child first
//! ```
//! Slab test along an axis with direction word d != 0, plane p, origin o: p - o is exact in f64 (31 bits), 1/d and its
//! product with p - o are rounded once each, so the crossing has a relative error under (1 + u)^2 - 1, u = 2^-53, and
//! its sign and its zero are exact. Maximum and minimum are monotone, so both bounds hold for entry and exit too.
//! Entry (1 - 2^-50) and exit (1 + 2^-50), rounded once more, lie below and above the exact ones, as 3u < 2^-50: a box
//! that the ray meets is never missed. An axis with d = 0 has no crossing: o lies between the planes, exactly, or not.
//! Source: Kay, Kajiya 1986 (slabs); Wald 2007 (binned heuristic). Not modelled: cells.

use std::ops::ControlFlow;

use crate::datapath::{PatchWords, RayWords};
use crate::fixed::{Formats, index, word_count};

/// Bins along an axis.
const N_BINS: usize = 16;

/// Below this depth boxes are cut in halves of equal count, so that a tree of 2^32 patches has at most 96 levels.
const BINNED_LEVELS: u32 = 64;

/// Levels of the deepest tree: the walk keeps at most one node a level for later.
const MAX_LEVELS: usize = 96;

/// Relative error that a slab crossing is given.
const SLAB_ERROR: f64 = 1.0 / (1_u64 << 50) as f64;

/// A closed box, coordinate words.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    low: [i32; 3],
    high: [i32; 3],
}

/// A box with what is in it.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    content: Content,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    /// The place of a patch.
    Patch(u32),
    /// The first of two children.
    Children(u32),
}

/// The tree; node 0 is its root.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

/// A patch's box and place while the tree is built.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    place: u32,
}

impl Bounds {
    /// A box that holds nothing.
    const EMPTY: Bounds = Bounds { low: [i32::MAX; 3], high: [i32::MIN; 3] };

    /// The box of a patch's own corners: three of a triangle.
    pub(super) fn of(patch: &PatchWords) -> Bounds {
        let n_corners = if patch.is_triangle { 3 } else { 4 };
        let point = |corner: &[i32; 3]| Bounds { low: *corner, high: *corner };
        patch.corners[..n_corners].iter().map(point).fold(Bounds::EMPTY, Bounds::union)
    }

    fn union(self, other: Bounds) -> Bounds {
        Bounds {
            low: [0, 1, 2].map(|k| self.low[k].min(other.low[k])),
            high: [0, 1, 2].map(|k| self.high[k].max(other.high[k])),
        }
    }

    /// Twice the centre.
    fn centre(&self) -> [i64; 3] {
        [0, 1, 2].map(|k| i64::from(self.low[k]) + i64::from(self.high[k]))
    }

    /// Half the surface; 0 for a box that holds nothing.
    fn half_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| (f64::from(self.high[k]) - f64::from(self.low[k])).max(0.0));
        x * y + y * z + z * x
    }

    /// Whether o + s d lies in the box for some s with 0 <= s and s 2^(T+D-F) < t_max + 1, exactly.
    pub(super) fn is_met(&self, formats: &Formats, ray: &RayWords) -> bool {
        // Fractions with positive denominators; products stay under 2^110.
        let mut enter = (0_i128, 1_i128);
        let mut leave: Option<(i128, i128)> = None;
        for k in 0..3 {
            let (o, d) = (i128::from(ray.origin[k]), i128::from(ray.dir[k]));
            let (low, high) = (i128::from(self.low[k]) - o, i128::from(self.high[k]) - o);
            if d == 0 {
                if low > 0 || high < 0 {
                    return false;
                }
                continue;
            }
            let (near, far) = if d > 0 { (low, high) } else { (-high, -low) };
            if near * enter.1 > enter.0 * d.abs() {
                enter = (near, d.abs());
            }
            if leave.is_none_or(|leave| far * leave.1 < leave.0 * d.abs()) {
                leave = Some((far, d.abs()));
            }
        }
        let range = (i128::from(ray.t_max) + 1) << formats.coord_frac_bits;
        let in_range = enter.0 << (formats.t_frac_bits + formats.dir_frac_bits) < range * enter.1;
        in_range && leave.is_none_or(|leave| enter.0 * leave.1 <= leave.0 * enter.1)
    }
}

/// A ray made ready for slab tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    origin: [f64; 3],
    /// 1/d, rounded; `None` where d = 0.
    inverse: [Option<f64>; 3],
    /// t words of one coordinate word over one direction word: 2^(T+D-F).
    t_scale: f64,
}

impl Slabs {
    pub(super) fn new(formats: &Formats, ray: &RayWords) -> Slabs {
        let power = |bits: u32| (1_u64 << bits) as f64;
        Slabs {
            origin: ray.origin.map(f64::from),
            inverse: ray.dir.map(|d| (d != 0).then(|| 1.0 / f64::from(d))),
            t_scale: power(formats.t_frac_bits) * power(formats.dir_frac_bits)
                / power(formats.coord_frac_bits),
        }
    }

    /// A lower bound of the t, in words, at which the ray enters the box; `None` when it certainly does not.
    #[inline]
    fn entry_t(&self, bounds: &Bounds) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let low = f64::from(bounds.low[k]) - self.origin[k];
            let high = f64::from(bounds.high[k]) - self.origin[k];
            match self.inverse[k] {
                Some(inverse) => {
                    let (p, q) = (low * inverse, high * inverse);
                    enter = enter.max(p.min(q));
                    leave = leave.min(p.max(q));
                }
                None if low > 0.0 || high < 0.0 => return None,
                None => {}
            }
        }
        let enter = enter * (1.0 - SLAB_ERROR);
        (enter <= leave * (1.0 + SLAB_ERROR)).then_some(enter * self.t_scale)
    }
}

impl Tree {
    /// The same tree for the same patches, on every machine: integers, and f64 sums and products in a fixed order.
    pub(super) fn new(patches: &[PatchWords]) -> Tree {
        let mut items: Vec<Item> =
            patches.iter().zip(0..).map(|(patch, place)| Item { bounds: Bounds::of(patch), place }).collect();
        let mut nodes = Vec::with_capacity(2 * items.len());
        let root = Node { bounds: Bounds::EMPTY, content: Content::Patch(0) };
        let mut open = Vec::new();
        if !items.is_empty() {
            nodes.push(root);
            open.push((0, 0..items.len(), 0));
        }
        while let Some((node, range, level)) = open.pop() {
            let items = &mut items[range.clone()];
            let bounds = items.iter().fold(Bounds::EMPTY, |all, item| all.union(item.bounds));
            let content = if let [item] = items {
                Content::Patch(item.place)
            } else {
                let middle = range.start + cut(items, level);
                let first = nodes.len();
                nodes.extend([root; 2]);
                open.push((first, range.start..middle, level + 1));
                open.push((first + 1, middle..range.end, level + 1));
                Content::Children(word_count(first))
            };
            nodes[node] = Node { bounds, content };
        }
        Tree { nodes }
    }

    /// Visits the patches whose boxes the ray may enter at or before the limit, nearer child first. `visit` takes a
    /// patch's place and box, and answers the new limit (the greatest t word that still counts) or ends the walk.
    pub(super) fn walk(
        &self,
        slabs: &Slabs,
        t_max: u64,
        mut visit: impl FnMut(usize, &Bounds) -> ControlFlow<(), u64>,
    ) {
        // Words of t have at most 35 bits: exact. At limit + 1 and beyond rounding cannot lead back to the limit.
        let beyond = |limit: u64| limit as f64 + 1.0;
        let mut end = beyond(t_max);
        let mut later = [(0.0, 0); MAX_LEVELS];
        let mut n_later = 0;
        let enter = |node: usize, end: f64| {
            slabs.entry_t(&self.nodes[node].bounds).filter(|t| *t < end).map(|t| (t, node))
        };
        let mut here = if self.nodes.is_empty() { None } else { enter(0, end) };
        while let Some((_, node)) = here {
            here = match self.nodes[node].content {
                Content::Patch(place) => {
                    match visit(index(place), &self.nodes[node].bounds) {
                        ControlFlow::Continue(limit) => end = beyond(limit),
                        ControlFlow::Break(()) => return,
                    }
                    None
                }
                Content::Children(first) => {
                    let first = index(first);
                    match (enter(first, end), enter(first + 1, end)) {
                        (Some(p), Some(q)) => {
                            let (near, far) = if q.0 < p.0 { (q, p) } else { (p, q) };
                            later[n_later] = far;
                            n_later += 1;
                            Some(near)
                        }
                        (p, q) => p.or(q),
                    }
                }
            };
            while here.is_none() && n_later > 0 {
                n_later -= 1;
                here = Some(later[n_later]).filter(|(t, _)| *t < end);
            }
        }
    }
}

/// Orders two or more items so that the first so many, at least one and not all, are one child; returns how many.
fn cut(items: &mut [Item], level: u32) -> usize {
    let best = if level < BINNED_LEVELS { best_bin(items) } else { None };
    if let Some((bins, last)) = best {
        items.sort_by_key(|item| bins.of(item) > last);
        return items.partition_point(|item| bins.of(item) <= last);
    }
    let middle = items.len() / 2;
    let bins = (0..3).map(|axis| Bins::new(items, axis)).max_by_key(|bins| bins.extent);
    let axis = bins.map_or(0, |bins| bins.axis);
    items.select_nth_unstable_by_key(middle, |item| (item.bounds.centre()[axis], item.place));
    middle
}

/// Equal bins over the centres along an axis.
#[derive(Clone, Copy)]
struct Bins {
    axis: usize,
    /// Least centre.
    least: i64,
    /// Greatest centre less the least.
    extent: i64,
}

impl Bins {
    fn new(items: &[Item], axis: usize) -> Bins {
        let centres = || items.iter().map(|item| item.bounds.centre()[axis]);
        let (least, most) = (centres().min().unwrap_or(0), centres().max().unwrap_or(0));
        Bins { axis, least, extent: most - least }
    }

    /// The bin of an item: least centre in bin 0, greatest in the last one (if there are two centres).
    fn of(&self, item: &Item) -> usize {
        let place = (item.bounds.centre()[self.axis] - self.least) * (N_BINS as i64 - 1);
        usize::try_from(place / self.extent.max(1)).unwrap_or(0)
    }
}

/// The axis and the last bin of the first child that make area times count least; `None` when all centres are equal.
fn best_bin(items: &[Item]) -> Option<(Bins, usize)> {
    let mut best: Option<(f64, Bins, usize)> = None;
    for bins in (0..3).map(|axis| Bins::new(items, axis)).filter(|bins| bins.extent > 0) {
        let mut filled = [(Bounds::EMPTY, 0_u32); N_BINS];
        for item in items {
            let (bounds, count) = &mut filled[bins.of(item)];
            (*bounds, *count) = (bounds.union(item.bounds), *count + 1);
        }
        let add = |sum: &mut (Bounds, u32), bin: &(Bounds, u32)| {
            *sum = (sum.0.union(bin.0), sum.1 + bin.1);
            Some(sum.0.half_area() * f64::from(sum.1))
        };
        let mut costs = [0.0; N_BINS];
        for (cost, first) in costs.iter_mut().zip(filled.iter().scan((Bounds::EMPTY, 0), add)) {
            *cost += first;
        }
        let second = filled.iter().rev().scan((Bounds::EMPTY, 0), add);
        for (cost, second) in costs[..N_BINS - 1].iter_mut().rev().zip(second) {
            *cost += second;
        }
        // Bin 0 and the last bin are never empty, so neither child is.
        for (last, cost) in costs[..N_BINS - 1].iter().enumerate() {
            if best.is_none_or(|(least, ..)| *cost < least) {
                best = Some((*cost, bins, last));
            }
        }
    }
    best.map(|(_, bins, last)| (bins, last))
}
