//! Which part of an area source is visible: a lattice of looks that is refined where they disagree.
//!
//! ```text
//! two corners across the square --as is likely here--> all of it is visible, or none
//! all four corners --all agree--> the same
//!   --disagree, or doubtful--> quarters, their corners --disagree--> ... --cells of the last level but one--> a jittered
//!   sample in each of its quarters
//! visible share = sum w v / sum w over the cells that are left
//! ```
//! w = (area of the cell) x (cos cos' / r^2 at its centre, or at its sample). Corners decide, since a straight edge that
//! crosses a convex cell has some of its corners on either side: samples inside cells miss shadows that touch their border
//! only, and refining what was seen by chance is a bias that eats penumbrae from both sides. Samples within the last cells
//! are random, so that no bands show.
//! Not noticed: what blocks a part of a cell between its corners, unless somebody said that the part is doubtful.
//! Source: Kok, Jansen 1992 (adaptive area-light sampling).

use crate::units::Rgb;

/// Splits of the whole square into the cells that are sampled, at most: 8 x 8.
pub(super) const MAX_LEVEL: u8 = 3;
/// Seeds are this many bits along a side.
pub(super) const SEED_SIDE: u32 = 4;
/// Corners along a side: those of the cells of the last level but one.
const CORNERS: usize = (1 << (MAX_LEVEL - 1)) + 1;
/// Looks at a source at most.
const MAX_LOOKS: usize = 64;
/// Corners of the source are looked at this share of its side inside: its border may touch what holds it.
const INSET: f64 = 1.0 / 64.0;

/// What is known of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Corner {
    /// Nothing yet.
    Unknown,
    /// It is under the receiver's horizon, where no light counts.
    Hidden,
    /// What passes from there.
    Seen(Rgb),
}

/// A cell: column and row among those of its level, of which the whole square is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell {
    x: u8,
    y: u8,
    level: u8,
}

/// A cell that is not split further, or a sample in a quarter of one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Leaf {
    weight: f64,
    passed: Rgb,
    /// Its part of the seed's bits.
    bits: u16,
}

/// Where to look next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// In the unit square.
    pub place: [f64; 2],
    what: Looked,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Looked {
    Corner(usize),
    Leaf(usize),
}

/// How finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fineness {
    /// Splits at most, from 1 on.
    pub max_level: u8,
    /// Cells of at most this share of the weight are not worth a split.
    pub least_share: f64,
    /// Seed's bits whose cells are looked into though their corners agree.
    pub doubtful: u16,
}

/// A source under inspection.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    corners: [Corner; CORNERS * CORNERS],
    /// Cells whose corners are asked for.
    open: Vec<Cell>,
    leaves: Vec<Leaf>,
    n_looks: usize,
    /// What two corners across are to confirm.
    likely: Option<bool>,
}

/// The whole square.
const WHOLE: Cell = Cell { x: 0, y: 0, level: 0 };

impl Cell {
    fn corners(self) -> [usize; 4] {
        let step = (CORNERS - 1) >> self.level;
        let at = |dx: usize, dy: usize| {
            CORNERS * step * (usize::from(self.y) + dy) + step * (usize::from(self.x) + dx)
        };
        [at(0, 0), at(1, 0), at(0, 1), at(1, 1)]
    }

    fn quarters(self) -> [Cell; 4] {
        let quarter = |dx, dy| Cell { x: 2 * self.x + dx, y: 2 * self.y + dy, level: self.level + 1 };
        [quarter(0, 0), quarter(1, 0), quarter(0, 1), quarter(1, 1)]
    }

    fn side(self) -> f64 {
        1.0 / f64::from(1_u32 << self.level)
    }

    fn centre(self) -> [f64; 2] {
        self.place([0.5, 0.5])
    }

    /// A place in it.
    fn place(self, within: [f64; 2]) -> [f64; 2] {
        [(f64::from(self.x) + within[0]) * self.side(), (f64::from(self.y) + within[1]) * self.side()]
    }

    /// Its part of the seed's bits; of a smaller cell, the bit that it lies in.
    fn bits(self) -> u16 {
        let n = SEED_SIDE as f64;
        let range = |low: f64| (low * n) as u32..((low + self.side()) * n).ceil() as u32;
        let [x, y] = self.place([0.0, 0.0]);
        range(y)
            .flat_map(|row| range(x).map(move |column| SEED_SIDE * row + column))
            .fold(0, |b, k| b | 1 << k)
    }
}

/// Where a corner is looked at.
fn corner_place(corner: usize) -> [f64; 2] {
    let at = |k: usize| (k as f64 / (CORNERS - 1) as f64).clamp(INSET, 1.0 - INSET);
    [at(corner % CORNERS), at(corner / CORNERS)]
}

impl Lattice {
    /// The whole square and the looks that it needs; `weight` of a place per unit of the square's area. Two looks do where
    /// they confirm what is `likely`, all of it visible or none: a straight edge between them and the other corners cuts off
    /// an eighth of the square in the mean.
    pub fn new(likely: Option<bool>, weight: &impl Fn([f64; 2]) -> f64) -> (Lattice, Vec<Look>) {
        let whole = WHOLE;
        let mut lattice = Lattice {
            corners: [Corner::Unknown; CORNERS * CORNERS],
            open: vec![whole],
            leaves: Vec::new(),
            n_looks: 0,
            likely,
        };
        let [first, _, _, last] = whole.corners();
        let looks = match likely {
            Some(_) => lattice.ask(&[first, last], weight),
            None => lattice.ask_corners(weight),
        };
        (lattice, looks)
    }

    /// What came back from a look.
    pub fn book(&mut self, look: &Look, passed: Rgb) {
        match look.what {
            Looked::Corner(k) => self.corners[k] = Corner::Seen(passed),
            Looked::Leaf(k) => self.leaves[k].passed = passed,
        }
    }

    /// Closes cells, splits others, and says where to look next; nowhere when all is known. Places jittered by `jitter`
    /// (level, column, row).
    pub fn refine(
        &mut self,
        how: Fineness,
        weight: &impl Fn([f64; 2]) -> f64,
        jitter: &impl Fn(u8, u8, u8) -> [f64; 2],
    ) -> Vec<Look> {
        if let Some(likely) = self.likely.take() {
            let (mean, agree) = self.looked_at(WHOLE);
            if !agree || mean.is_black() == likely || how.doubtful != 0 {
                let looks = self.ask_corners(weight);
                if !looks.is_empty() {
                    return looks;
                }
            }
        }
        let open = std::mem::take(&mut self.open);
        let centre_weight = |c: Cell| weight(c.centre()) * c.side() * c.side();
        let whole = centre_weight(WHOLE);
        let mut sampled = Vec::new();
        for cell in open {
            let (mean, agree) = self.looked_at(cell);
            let w = centre_weight(cell);
            let is_doubtful = cell.bits() & how.doubtful != 0 && cell.level < 2;
            let worth = whole <= 0.0 || w > how.least_share * whole;
            if (agree && !is_doubtful) || !worth {
                self.leaves.push(Leaf { weight: w, passed: mean, bits: cell.bits() });
            } else if cell.level + 1 < how.max_level {
                self.open.extend(cell.quarters());
            } else {
                sampled.push(cell);
            }
        }
        let mut looks = self.ask_corners(weight);
        // All four quarters of each, as long as there are looks for them; else two, across.
        let quarters: &[usize] =
            if self.n_looks + 4 * sampled.len() <= MAX_LOOKS { &[0, 1, 2, 3] } else { &[0, 3] };
        for cell in sampled {
            for quarter in quarters.iter().map(|q| cell.quarters()[*q]) {
                let place = quarter.place(jitter(quarter.level, quarter.x, quarter.y));
                let share = 4.0 / quarters.len() as f64 * quarter.side() * quarter.side();
                let w = weight(place) * share;
                if w > 0.0 {
                    looks.push(Look { place, what: Looked::Leaf(self.leaves.len()) });
                    self.n_looks += 1;
                }
                self.leaves.push(Leaf { weight: w, passed: Rgb::WHITE, bits: quarter.bits() });
            }
        }
        looks
    }

    /// Mean over the corners of a cell that count, and whether they agree.
    fn looked_at(&self, cell: Cell) -> (Rgb, bool) {
        let (mut sum, mut n, mut low, mut high) = (Rgb::BLACK, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        for k in cell.corners() {
            if let Corner::Seen(passed) = self.corners[k] {
                sum += passed;
                n += 1.0;
                low = low.min(passed.min_channel());
                high = high.max(passed.max_channel());
            }
        }
        if n == 0.0 { (Rgb::BLACK, true) } else { (sum / n, low >= high) }
    }

    /// Looks at the corners of open cells of which nothing is known.
    fn ask_corners(&mut self, weight: &impl Fn([f64; 2]) -> f64) -> Vec<Look> {
        let corners: Vec<usize> = self.open.iter().flat_map(|cell| cell.corners()).collect();
        self.ask(&corners, weight)
    }

    /// Looks at those of some corners of which nothing is known.
    fn ask(&mut self, corners: &[usize], weight: &impl Fn([f64; 2]) -> f64) -> Vec<Look> {
        let mut looks = Vec::new();
        for &corner in corners {
            let place = corner_place(corner);
            if self.corners[corner] != Corner::Unknown {
                continue;
            }
            if weight(place) > 0.0 {
                // Black until it is back: nobody reads it before.
                self.corners[corner] = Corner::Seen(Rgb::BLACK);
                looks.push(Look { place, what: Looked::Corner(corner) });
            } else {
                self.corners[corner] = Corner::Hidden;
            }
        }
        self.n_looks += looks.len();
        looks
    }

    /// Visible share; `None` when nothing counts.
    pub fn share(&self) -> Option<Rgb> {
        let weight: f64 = self.leaves.iter().map(|l| l.weight).sum();
        let visible: Rgb = self.leaves.iter().map(|l| l.passed * l.weight).sum();
        (weight > 0.0).then(|| visible / weight)
    }

    /// Parts that are visible, half of them at least.
    pub fn seed(&self) -> u16 {
        (0..SEED_SIDE * SEED_SIDE).fold(0, |seed, k| {
            let of = |l: &&Leaf| l.bits >> k & 1 == 1 && l.weight > 0.0;
            let (visible, all) = self
                .leaves
                .iter()
                .filter(of)
                .fold((0.0, 0.0), |(v, a), l| (v + l.weight * l.passed.max_channel(), a + l.weight));
            seed | u16::from(2.0 * visible >= all) << k
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const EVEN: fn([f64; 2]) -> f64 = |_| 1.0;

    fn how(max_level: u8) -> Fineness {
        Fineness { max_level, least_share: 0.0, doubtful: 0 }
    }

    /// Looks until nothing is left to see; how many looks that took.
    fn inspect(how: Fineness, seed: u64, sees: impl Fn([f64; 2]) -> bool) -> (Lattice, usize) {
        inspect_likely(None, how, seed, sees)
    }

    fn inspect_likely(
        likely: Option<bool>,
        how: Fineness,
        seed: u64,
        sees: impl Fn([f64; 2]) -> bool,
    ) -> (Lattice, usize) {
        let (mut lattice, mut looks) = Lattice::new(likely, &EVEN);
        let mut n = 0;
        while !looks.is_empty() {
            n += looks.len();
            for look in &looks {
                lattice.book(look, if sees(look.place) { Rgb::WHITE } else { Rgb::BLACK });
            }
            let jitter = |level: u8, x: u8, y: u8| {
                let name = u64::from(level) << 16 | u64::from(x) << 8 | u64::from(y);
                crate::sampling::unit_pair(crate::sampling::hash(seed, name, 1))
            };
            looks = lattice.refine(how, &EVEN, &jitter);
        }
        (lattice, n)
    }

    #[test]
    fn square_that_is_all_visible_or_all_hidden_takes_its_four_corners() {
        for (sees, seed) in [(true, u16::MAX), (false, 0)] {
            let (lattice, n) = inspect(how(3), 1, |_| sees);
            assert_eq!(n, 4);
            assert_eq!(lattice.share(), Some(if sees { Rgb::WHITE } else { Rgb::BLACK }));
            assert_eq!(lattice.seed(), seed);
        }
    }

    #[test]
    fn two_corners_do_where_they_confirm_what_is_likely() {
        for likely in [true, false] {
            let (lattice, n) = inspect_likely(Some(likely), how(3), 1, |_| likely);
            assert_eq!((n, lattice.share()), (2, Some(if likely { Rgb::WHITE } else { Rgb::BLACK })));
            let (lattice, n) = inspect_likely(Some(likely), how(3), 1, |_| !likely);
            assert_eq!((n, lattice.share()), (4, Some(if likely { Rgb::BLACK } else { Rgb::WHITE })));
            let half = |[s, _]: [f64; 2]| s < 0.5;
            let (lattice, n) = inspect_likely(Some(likely), how(3), 1, half);
            assert!(n > 8 && (lattice.share().unwrap().0[0] - 0.5).abs() < 0.1, "{n}");
        }
    }

    #[test]
    fn half_of_a_square_seeds_half_of_the_bits() {
        let (lattice, n) = inspect(how(2), 1, |[_, t]| t < 0.5);
        assert_eq!(lattice.seed(), 0x00ff);
        assert!((lattice.share().unwrap().0[0] - 0.5).abs() < 0.26 && n <= 25, "{n}");
    }

    #[test]
    fn doubtful_bits_are_looked_into_though_corners_agree() {
        // A hole in the middle of the first quarter.
        let hole = |[s, t]: [f64; 2]| !(0.1..0.2).contains(&s) || !(0.1..0.2).contains(&t);
        let plain = inspect(how(3), 1, hole);
        assert_eq!((plain.1, plain.0.share()), (4, Some(Rgb::WHITE)));
        let doubting = Fineness { doubtful: 1, ..how(3) };
        let (_, n) = inspect(doubting, 1, hole);
        assert!(n > 9, "{n}");
    }

    #[test]
    fn cells_that_weigh_little_are_not_split() {
        let coarse = Fineness { least_share: 0.3, ..how(3) };
        let (lattice, n) = inspect(coarse, 1, |[s, _]| s < 0.4);
        assert_eq!(n, 9, "the square is split, its quarters are not");
        assert!((lattice.share().unwrap().0[0] - 0.25).abs() < 0.26);
    }

    proptest! {
        /// Any straight edge: the mean over jitters is the visible area, and no share of one is far from it.
        #[test]
        fn share_beyond_a_straight_edge_is_its_area(angle in 0.0..std::f64::consts::TAU, at in 0.06..0.94_f64) {
            let (dx, dy) = (angle.cos(), angle.sin());
            // From corner to corner along the normal.
            let reach = 0.5 * (dx.abs() + dy.abs());
            let offset = (2.0 * at - 1.0) * reach;
            let sees = |[s, t]: [f64; 2]| (s - 0.5) * dx + (t - 0.5) * dy < offset;
            let n = 256;
            let area = (0..n * n).filter(|k| {
                sees([(f64::from(k % n) + 0.5) / f64::from(n), (f64::from(k / n) + 0.5) / f64::from(n)])
            }).count() as f64 / f64::from(n * n);
            let shares: Vec<f64> = (0..64).map(|seed| {
                let (lattice, looks) = inspect(how(3), seed, sees);
                assert!(looks <= MAX_LOOKS, "{looks} looks");
                lattice.share().unwrap().0[0]
            }).collect();
            let mean = shares.iter().sum::<f64>() / 64.0;
            prop_assert!((mean - area).abs() < 0.012, "{mean}, not {area}");
            prop_assert!(shares.iter().all(|s| (s - area).abs() < 0.12), "{shares:?} {area}");
        }
    }
}
