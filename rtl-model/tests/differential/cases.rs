//! Rays and patches by class, each from the words of a [`Draw`].

mod adversarial;
mod shapes;

use rtl_model::datapath::{PatchWords, RayWords};
use rtl_model::fixed::{Formats, Rounding};

use crate::agreement::Kind;
use crate::draw::{Draw, Words};

/// A ray and a patch.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The ray.
    pub ray: RayWords,
    /// The patch.
    pub patch: PatchWords,
}

/// What a pair is built to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Any ray, any patch.
    Random,
    /// A ray toward a point of the patch, as close as direction words come.
    Aimed,
    /// Exactly through a corner.
    Vertex,
    /// Exactly through a point of an edge or of the diagonal, or along it.
    Edge,
    /// In the patch's plane, parallel to it, or off either by one step.
    Grazing,
    /// From a corner, a point of an edge, or a point inside.
    OnPatch,
    /// Patches a step or two wide.
    Sliver,
    /// Patches and origins at the corners of the cube.
    CubeCorner,
    /// Words at the ends of their ranges, and next to 0.
    ExtremeWords,
    /// t at the end of the range: t_max one less, equal, one more, 0; and t next to 4.
    RangeEnd,
    /// den = 1, -1 and a few steps from 0.
    TinyDen,
    /// Equal corners, collinear corners, halves without area, bow ties.
    Degenerate,
}

/// All classes; the first two are those of the long runs' "random" pairs.
pub const CLASSES: [Class; 12] = [
    Class::Random,
    Class::Aimed,
    Class::Vertex,
    Class::Edge,
    Class::Grazing,
    Class::OnPatch,
    Class::Sliver,
    Class::CubeCorner,
    Class::ExtremeWords,
    Class::RangeEnd,
    Class::TinyDen,
    Class::Degenerate,
];

/// How many format sets there are.
pub const SETS: u32 = 5;

/// A format set; the last drops bits of its edge normals, where the tie rule and the direction of rounding show.
pub fn format_set(set: u32, draw: &mut Draw) -> Formats {
    let widths =
        |f, d, t| Formats { coord_frac_bits: f, dir_frac_bits: d, t_frac_bits: t, ..Formats::default() };
    match set {
        0 => widths(8, 8, 8),
        1 => widths(16, 16, 16),
        2 => widths(24, 24, 24),
        3 => widths(28, 28, 32),
        _ => Formats {
            cross_keep_bits: Some(16),
            rounding: draw.of(&[Rounding::Floor, Rounding::HalfAway]),
            ..widths(12, 20, 24)
        },
    }
}

/// Any valid formats, half of them with edge normals rounded.
pub fn any_formats(draw: &mut Draw) -> Formats {
    let coord_frac_bits = 8 + draw.below(21);
    let dir_frac_bits = 8 + draw.below(21);
    let t_frac_bits = 8 + draw.below(25);
    let keep = 4 + draw.below(2 * coord_frac_bits - 3);
    let cross_keep_bits = draw.of(&[None, Some(keep)]);
    let rounding = draw.of(&[Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor]);
    Formats { coord_frac_bits, dir_frac_bits, t_frac_bits, cross_keep_bits, rounding }
}

impl Class {
    /// The pair of these words at one of the five format sets, chosen by the first word.
    pub fn pair_at_a_set(self, words: &Words) -> (Formats, Pair) {
        let mut draw = Draw::new(words);
        let set = draw.below(SETS);
        let formats = format_set(set, &mut draw);
        (formats, self.pair(&formats, &mut draw))
    }

    /// The pair of these words.
    pub fn pair(self, formats: &Formats, draw: &mut Draw) -> Pair {
        let build = match self {
            Class::Random => shapes::random,
            Class::Aimed => shapes::aimed,
            Class::Vertex => adversarial::vertex,
            Class::Edge => adversarial::edge,
            Class::Grazing => adversarial::grazing,
            Class::OnPatch => adversarial::on_patch,
            Class::Sliver => adversarial::sliver,
            Class::CubeCorner => adversarial::cube_corner,
            Class::ExtremeWords => adversarial::extreme_words,
            Class::RangeEnd => adversarial::range_end,
            Class::TinyDen => adversarial::tiny_den,
            Class::Degenerate => adversarial::degenerate,
        };
        build(formats, draw)
    }

    /// What pairs of this class must show often: the smallest share of pairs, in thousandths.
    pub fn must_show(self) -> &'static [(Kind, u64)] {
        match self {
            Class::Random => &[(Kind::Front, 1), (Kind::Back, 1), (Kind::Behind, 1)],
            Class::Aimed => &[(Kind::Front, 200), (Kind::Back, 200), (Kind::Both, 1), (Kind::Beyond, 1)],
            Class::Vertex => &[(Kind::EdgeZero, 700), (Kind::HitAtEdge, 200)],
            Class::Edge => &[(Kind::EdgeZero, 700), (Kind::HitAtEdge, 100), (Kind::InPlane, 20)],
            Class::Grazing => &[(Kind::InPlane, 200), (Kind::Hit, 10), (Kind::Behind, 10)],
            Class::OnPatch => &[(Kind::HitAtZero, 300)],
            Class::Sliver => &[(Kind::Hit, 50), (Kind::Behind, 1)],
            Class::CubeCorner => &[(Kind::Hit, 50), (Kind::Behind, 10), (Kind::EdgeZero, 50)],
            Class::ExtremeWords => &[(Kind::Hit, 5), (Kind::Behind, 5), (Kind::EdgeZero, 50)],
            Class::RangeEnd => &[(Kind::HitAtMax, 100), (Kind::Beyond, 100)],
            Class::TinyDen => &[(Kind::UnitDen, 50), (Kind::HitAtEdge, 50)],
            Class::Degenerate => &[(Kind::NoArea, 300), (Kind::Hit, 50)],
        }
    }
}
