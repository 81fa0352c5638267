//! The comparison of board and oracle on one pair, and what the pair turned out to be.

use std::fmt;

use rtl_model::datapath::{Facing, ray_patch};
use rtl_model::fixed::Formats;
use rtl_model::oracle;

use crate::cases::Pair;

/// What a pair turned out to be. A pair can be several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any.
    Pair,
    /// A hit record.
    Hit,
    /// A hit on the front.
    Front,
    /// A hit on the back.
    Back,
    /// A hit at t = 0.
    HitAtZero,
    /// A hit with t = t_max > 0.
    HitAtMax,
    /// The ray's line meets a triangle behind the origin.
    Behind,
    /// The ray's line meets a triangle ahead, but there is no hit: its t is over t_max.
    Beyond,
    /// The ray's line meets both triangles of a quad.
    Both,
    /// An edge value is 0 although its edge has a length.
    EdgeZero,
    /// A triangle is hit, with an edge value of 0.
    HitAtEdge,
    /// All edge values of a triangle with an area are 0: the ray runs in its plane.
    InPlane,
    /// den is 1 or -1 and the ray's line meets the triangle.
    UnitDen,
    /// A triangle without area.
    NoArea,
}

const KINDS: usize = 14;

/// How many pairs were of each kind.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally([u64; KINDS]);

impl Tally {
    /// Counts a pair of this kind.
    fn note(&mut self, kind: Kind, is: bool) {
        self.0[kind as usize] += u64::from(is);
    }

    /// How many.
    pub fn count(&self, kind: Kind) -> u64 {
        self.0[kind as usize]
    }

    /// Adds the counts of another tally.
    pub fn add(&mut self, other: &Tally) {
        for (sum, count) in self.0.iter_mut().zip(other.0) {
            *sum += count;
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} pairs: {} hits ({} front, {} back, {} at edges, {} at t = 0, {} at t_max), {} behind, {} beyond, \
             {} edge values of 0",
            self.count(Kind::Pair),
            self.count(Kind::Hit),
            self.count(Kind::Front),
            self.count(Kind::Back),
            self.count(Kind::HitAtEdge),
            self.count(Kind::HitAtZero),
            self.count(Kind::HitAtMax),
            self.count(Kind::Behind),
            self.count(Kind::Beyond),
            self.count(Kind::EdgeZero),
        )
    }
}

/// Tests the pair on both sides and notes what it was.
///
/// # Errors
/// The pair with both hits and all wires side by side, when anything differs.
pub fn check(formats: &Formats, pair: &Pair, tally: &mut Tally) -> Result<(), String> {
    let Pair { ray, patch } = pair;
    let (board_hit, board) =
        (ray_patch::intersect(formats, ray, patch), ray_patch::taps(formats, ray, patch));
    let (oracle_hit, wires) = (oracle::intersect(formats, ray, patch), oracle::wires(formats, ray, patch));
    if board_hit != oracle_hit || wires.difference(&board).is_some() {
        let rows: Vec<String> = wires.side_by_side(&board).iter().map(ToString::to_string).collect();
        return Err(format!(
            "{formats:?}\n{ray:?}\n{patch:?}\nboard {board_hit:?}\noracle {oracle_hit:?}\n{}",
            rows.join("\n")
        ));
    }
    let t_limit = 4_u64 << formats.t_frac_bits;
    if oracle_hit.is_some_and(|hit| hit.t > ray.t_max || hit.t > t_limit || hit.patch != patch.id) {
        return Err(format!("{formats:?}\n{ray:?}\n{patch:?}\n{oracle_hit:?} is not in the ray's range"));
    }

    let edges = if patch.is_triangle { 3 } else { 5 };
    let edge_zero = (0..edges).any(|k| wires.e[k] == 0 && wires.c[k] != [0; 3]);
    let met = || wires.triangles.iter().flatten().filter(|triangle| triangle.inside);
    let behind = |num: i128, den: i128| num != 0 && (num < 0) != (den < 0);
    let hit = oracle_hit.is_some();
    tally.note(Kind::Pair, true);
    tally.note(Kind::Hit, hit);
    tally.note(Kind::Front, oracle_hit.is_some_and(|hit| hit.facing == Facing::Front));
    tally.note(Kind::Back, oracle_hit.is_some_and(|hit| hit.facing == Facing::Back));
    tally.note(Kind::HitAtZero, oracle_hit.is_some_and(|hit| hit.t == 0));
    tally.note(Kind::HitAtMax, oracle_hit.is_some_and(|hit| hit.t == ray.t_max && hit.t > 0));
    tally.note(Kind::Behind, met().any(|triangle| behind(triangle.num, triangle.den)));
    tally.note(Kind::Beyond, !hit && met().any(|triangle| !behind(triangle.num, triangle.den)));
    tally.note(Kind::Both, met().count() == 2);
    tally.note(Kind::EdgeZero, edge_zero);
    tally.note(Kind::HitAtEdge, hit && edge_zero);
    tally.note(
        Kind::InPlane,
        wires.triangles.iter().flatten().any(|triangle| triangle.den == 0 && triangle.n != [0; 3]),
    );
    tally.note(Kind::UnitDen, met().any(|triangle| triangle.den.abs() == 1));
    tally.note(Kind::NoArea, wires.triangles.iter().flatten().any(|triangle| triangle.n == [0; 3]));
    Ok(())
}
