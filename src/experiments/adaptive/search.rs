//! Search for the coarsest refined mesh that is no worse than the uniform one.
//!
//! ```text
//! wanted error --refine, solve--> error over the uniform mesh's --secant of logarithms, inside the bracket--> wanted error ...
//! ```
//! The error of a solution grows with what was wanted, about in proportion, until noise or the limit of depth holds it up:
//! where refinement did not reach what was wanted, the next wish is well above what it reached.

/// The search aims at this ratio to the allowed error: what is aimed at is missed a little to either side.
const AIM: f64 = 0.97;
/// A mesh with at least this ratio, and at most 1, ends the search.
pub(super) const GOOD_RATIO: f64 = 0.94;
/// Largest factor from one wanted error to the next while all errors lie on one side.
const MAX_STEP: f64 = 2.5;
/// Factor from an error that refinement reached to the next wanted one, where more was wanted than it could do.
const ABOVE_REACHED: f64 = 1.5;
/// An estimate up to this much above what was wanted has reached it: the balance and the last split count.
const REACHED: f64 = 1.02;
/// New wanted errors keep this share of a bracket's width off its ends.
const MARGIN: f64 = 0.15;

/// One mesh that was made.
#[derive(Clone, Copy, Debug)]
struct Tried {
    wanted: f64,
    ratio: f64,
    /// Refinement estimates that it did what was wanted.
    is_reached: bool,
}

/// The search.
#[derive(Debug)]
pub(super) struct Search {
    wanted: f64,
    /// The largest wanted error that was good enough, the smallest that was not.
    enough: Option<Tried>,
    too_much: Option<Tried>,
}

impl Search {
    pub(super) fn new(first: f64) -> Search {
        Search { wanted: first, enough: None, too_much: None }
    }

    /// The wanted error to try next.
    pub(super) fn wanted(&self) -> f64 {
        self.wanted
    }

    pub(super) fn is_over(&self) -> bool {
        self.enough.is_some_and(|tried| tried.is_reached && tried.ratio >= GOOD_RATIO)
    }

    /// The mesh of the wanted error has this ratio of its error to the allowed one; refinement estimates `estimated`.
    pub(super) fn tell(&mut self, ratio: f64, estimated: f64) {
        let is_reached = estimated <= REACHED * self.wanted;
        let tried = Tried { wanted: self.wanted.max(estimated), ratio, is_reached };
        if ratio <= 1.0 {
            self.enough = Some(self.enough.filter(|best| best.wanted > tried.wanted).unwrap_or(tried));
        } else {
            self.too_much = Some(self.too_much.filter(|least| least.wanted < tried.wanted).unwrap_or(tried));
        }
        self.wanted = match (self.enough, self.too_much) {
            (Some(low), Some(high)) => {
                let way = (AIM / low.ratio).ln() / (high.ratio / low.ratio).ln();
                let way = if way.is_finite() { way.clamp(MARGIN, 1.0 - MARGIN) } else { 0.5 };
                low.wanted * (high.wanted / low.wanted).powf(way)
            }
            (Some(low), None) if !is_reached => low.wanted * ABOVE_REACHED,
            _ => tried.wanted * (AIM / ratio.max(1e-3)).clamp(1.0 / MAX_STEP, MAX_STEP),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wanted errors and ratios of five meshes at most; refinement reaches no error under `floor`.
    fn tried_above(floor: f64, error: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mut search = Search::new(0.02);
        let mut tried = Vec::new();
        while tried.len() < 5 && !search.is_over() {
            let (wanted, ratio) = (search.wanted(), error(search.wanted()));
            tried.push((wanted, ratio));
            search.tell(ratio, wanted.max(floor));
        }
        tried
    }

    fn tried(error: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        tried_above(0.0, error)
    }

    #[test]
    fn search_goes_on_above_an_error_that_refinement_cannot_reach() {
        // Flat under 0.1: the first mesh is good enough, and far from the coarsest that is.
        let tried = tried_above(0.1, |wanted| if wanted < 0.14 { 0.95 } else { 0.95 * wanted / 0.14 });
        let best = tried.iter().filter(|t| t.1 <= 1.0).map(|t| t.0).fold(0.0, f64::max);
        assert!(best > 0.11, "{tried:?}");
    }

    #[test]
    fn search_finds_the_crossing_of_errors_that_grow_in_proportion_or_faster() {
        for limit in [0.004, 0.011, 0.0199, 0.037, 0.09] {
            for power in [1.0, 2.0] {
                let tried = tried(|wanted| (wanted / limit).powf(power));
                let best = tried.iter().map(|t| t.1).filter(|ratio| *ratio <= 1.0).fold(0.0, f64::max);
                assert!(best > 0.88, "{tried:?} for {limit}, power {power}");
            }
        }
    }

    #[test]
    fn search_gets_close_to_a_jump_and_stops_where_an_error_does_not_move() {
        // No mesh between 60 % and 120 % of what is allowed.
        let jump = tried(|wanted| if wanted < 0.03 { 0.6 } else { 1.2 });
        let best = jump.iter().filter(|t| t.1 <= 1.0).map(|t| t.0).fold(0.0, f64::max);
        assert!(best > 0.8 * 0.03, "{jump:?}");
        assert!(tried(|_| 3.0).windows(2).all(|pair| pair[1].0 < pair[0].0));
        assert_eq!(tried(|_| 0.95).len(), 1);
    }
}
