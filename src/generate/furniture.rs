//! Tables, chairs, shelves and cupboards of blocks, turned and put into a room.
//!
//! ```text
//! Random --designs--> Blocks in steps of 5 mm, front toward -y, standing on z = 0
//!        --Turn, place--> Quads in um, fronts outward
//! ```
//! A face that lies on another block, or on the floor, is left out: no surface lies on another. Angles of turns have
//! rational sines (24 7 25 and 4 3 5 triangles), so that turned corners are whole micrometres and what touches still
//! shares its planes exactly.

use glam::{IVec2, IVec3};

use super::random::Random;
use super::text::{Quad, mm};

/// Length of a step (um): a multiple of 25, so that every turn is exact.
const STEP: i32 = mm(5);

/// A side of a block, seen from the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Face {
    /// x low.
    Left,
    /// x high.
    Right,
    /// y low.
    Front,
    /// y high.
    Back,
    /// z low.
    Bottom,
    /// z high.
    Top,
}

use Face::{Back, Bottom, Front, Left, Right, Top};

impl Face {
    fn name(self) -> &'static str {
        match self {
            Left => "left",
            Right => "right",
            Front => "front",
            Back => "back",
            Bottom => "bottom",
            Top => "top",
        }
    }
}

/// Faces of a block that stands on something.
const STANDING: &[Face] = &[Left, Right, Front, Back, Top];
/// Faces of a leg: below the floor, above what it carries.
const UPRIGHT: &[Face] = &[Left, Right, Front, Back];
/// All faces.
const ALL: &[Face] = &[Left, Right, Front, Back, Bottom, Top];

/// A box of a piece with the faces that can be seen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// Name within the piece.
    pub(super) part: String,
    /// Material of its faces, but for the front.
    pub(super) material: &'static str,
    /// Material of its front.
    pub(super) front: &'static str,
    /// Corner of least coordinates (steps).
    pub(super) low: IVec3,
    /// Corner of largest coordinates (steps).
    pub(super) high: IVec3,
    /// Faces that are surfaces.
    pub(super) faces: &'static [Face],
}

impl Block {
    /// Corners of a face (steps), counter-clockwise from outside.
    pub(super) fn corners(&self, face: Face) -> [IVec3; 4] {
        let (a, b) = (self.low, self.high);
        let p = IVec3::new;
        match face {
            Left => [p(a.x, a.y, a.z), p(a.x, a.y, b.z), p(a.x, b.y, b.z), p(a.x, b.y, a.z)],
            Right => [p(b.x, a.y, a.z), p(b.x, b.y, a.z), p(b.x, b.y, b.z), p(b.x, a.y, b.z)],
            Front => [p(a.x, a.y, a.z), p(b.x, a.y, a.z), p(b.x, a.y, b.z), p(a.x, a.y, b.z)],
            Back => [p(a.x, b.y, a.z), p(a.x, b.y, b.z), p(b.x, b.y, b.z), p(b.x, b.y, a.z)],
            Bottom => [p(a.x, a.y, a.z), p(a.x, b.y, a.z), p(b.x, b.y, a.z), p(b.x, a.y, a.z)],
            Top => [p(a.x, a.y, b.z), p(b.x, a.y, b.z), p(b.x, b.y, b.z), p(a.x, b.y, b.z)],
        }
    }
}

/// What a piece is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Design {
    /// A top on four legs.
    Table,
    /// A seat on four legs, with a back.
    Chair,
    /// Sides, back and boards.
    Shelf,
    /// A closed body with two doors on a plinth.
    Cupboard,
}

impl Design {
    /// Its name in surfaces' names.
    pub(super) fn name(self) -> &'static str {
        match self {
            Design::Table => "table",
            Design::Chair => "chair",
            Design::Shelf => "shelf",
            Design::Cupboard => "cupboard",
        }
    }

    /// Blocks of one piece, its sizes drawn.
    pub(super) fn blocks(self, random: &mut Random) -> Vec<Block> {
        match self {
            Design::Table => table(random),
            Design::Chair => chair(random),
            Design::Shelf => shelf(random),
            Design::Cupboard => cupboard(random),
        }
    }
}

/// Woods that furniture is made of.
const WOODS: [&str; 3] = ["beech", "oak", "walnut"];

fn block(part: &str, material: &'static str, low: [i32; 3], high: [i32; 3], faces: &'static [Face]) -> Block {
    Block {
        part: part.to_owned(),
        material,
        front: material,
        low: IVec3::from_array(low),
        high: IVec3::from_array(high),
        faces,
    }
}

/// Four legs of a width under a rectangle of half sizes `x`, `y`, up to `top` (steps).
fn legs(material: &'static str, [x, y]: [i32; 2], width: i32, top: i32) -> impl Iterator<Item = Block> {
    let corners = [[-x, -y], [x - width, -y], [-x, y - width], [x - width, y - width]];
    corners.into_iter().enumerate().map(move |(i, [x, y])| {
        block(&format!("leg-{}", i + 1), material, [x, y, 0], [x + width, y + width, top], UPRIGHT)
    })
}

/// 0.9 to 1.2 m by 0.65 to 0.8 m, 0.745 m high.
fn table(random: &mut Random) -> Vec<Block> {
    let (x, y) = (random.whole(90, 120), random.whole(65, 80));
    let wood = random.pick(&WOODS);
    let under = 136;
    let top = block("top", wood, [-x, -y, under], [x, y, under + 13], ALL);
    [top].into_iter().chain(legs(wood, [x - 8, y - 8], 16, under)).collect()
}

/// 0.42 to 0.46 m wide and deep, seat at 0.46 m, back up to 0.88 m.
fn chair(random: &mut Random) -> Vec<Block> {
    let x = random.whole(42, 46);
    let wood = random.pick(&WOODS);
    let cloth = random.pick(&["cloth-red", "cloth-blue", "cloth-green"]);
    let (under, seat) = (80, 92);
    let pieces = [
        block("seat", cloth, [-x, -x, under], [x, x, seat], ALL),
        block("back", cloth, [-x, x - 10, seat], [x, x, seat + random.whole(80, 88)], STANDING),
    ];
    pieces.into_iter().chain(legs(wood, [x - 1, x - 1], 12, under)).collect()
}

/// 0.8 to 0.9 m wide, 0.35 m deep, 0.95 to 1.85 m high: boards of 0.05 m, 0.3 m apart.
fn shelf(random: &mut Random) -> Vec<Block> {
    let (x, y) = (random.whole(80, 90), 35);
    let wood = random.pick(&WOODS);
    let n_boards = random.whole(4, 7);
    let (thick, pitch) = (10, 60);
    let under_top = pitch * (n_boards - 1);
    let height = under_top + thick;
    let (inner, panel) = (x - thick, y - 4);
    let mut blocks = vec![
        block("side-1", wood, [-x, -y, 0], [-inner, y, height], STANDING),
        block("side-2", wood, [inner, -y, 0], [x, y, height], STANDING),
        block("panel", wood, [-inner, panel, 0], [inner, y, under_top], &[Front, Back]),
        block("top", wood, [-inner, -y, under_top], [inner, y, height], &[Front, Back, Bottom, Top]),
    ];
    for k in 0..n_boards - 1 {
        let faces: &[Face] = if k == 0 { &[Front, Top] } else { &[Front, Bottom, Top] };
        let low = [-inner, -y, pitch * k];
        let high = [inner, panel, pitch * k + thick];
        blocks.push(block(&format!("board-{}", k + 1), wood, low, high, faces));
    }
    blocks
}

/// 0.9 to 1.1 m wide, 0.5 m deep, 0.9 to 1.9 m high; a door is the front of half the body.
fn cupboard(random: &mut Random) -> Vec<Block> {
    let (x, y) = (random.whole(90, 110), 50);
    let (body, doors) = random.pick(&[
        ("white", ["grey", "white"]),
        ("oak", ["beech", "oak"]),
        ("walnut", ["oak", "walnut"]),
    ]);
    let (foot, height) = (16, random.whole(180, 380));
    let inset = 8;
    let left = block("left", body, [-x, -y, foot], [0, y, height], &[Left, Front, Back, Bottom, Top]);
    let right = block("right", body, [0, -y, foot], [x, y, height], &[Right, Front, Back, Bottom, Top]);
    vec![
        block("plinth", "dark", [inset - x, inset - y, 0], [x - inset, y, foot], UPRIGHT),
        Block { front: doors[0], ..left },
        Block { front: doors[1], ..right },
    ]
}

/// A turn about z with rational cosine and sine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    cos: i32,
    sin: i32,
    of: i32,
}

impl Turn {
    /// None.
    pub(super) const NONE: Turn = Turn { cos: 1, sin: 0, of: 1 };
    /// 16.26 degrees, the smallest.
    const SMALL: Turn = Turn { cos: 24, sin: 7, of: 25 };
    /// 36.87 degrees.
    const LARGE: Turn = Turn { cos: 4, sin: 3, of: 5 };

    /// Up to 16 degrees to either side.
    pub(super) const SLIGHT: [Turn; 3] = [Turn::NONE, Turn::SMALL, Turn::SMALL.back()];
    /// Up to 37 degrees to either side.
    pub(super) const ANY: [Turn; 5] =
        [Turn::NONE, Turn::SMALL, Turn::SMALL.back(), Turn::LARGE, Turn::LARGE.back()];

    /// The other way round.
    const fn back(self) -> Turn {
        Turn { sin: -self.sin, ..self }
    }

    /// With so many quarter turns counter-clockwise on top.
    pub(super) fn quarters(self, n: i32) -> Turn {
        (0..n).fold(self, |t, _| Turn { cos: -t.sin, sin: t.cos, of: t.of })
    }

    /// A corner (steps) turned (um).
    fn apply(self, p: IVec3) -> IVec3 {
        let exact = |n: i32| n * (STEP / self.of);
        IVec3::new(exact(self.cos * p.x - self.sin * p.y), exact(self.sin * p.x + self.cos * p.y), STEP * p.z)
    }
}

/// A piece of furniture in its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    /// First part of its surfaces' names.
    pub(super) name: String,
    /// What it is made of.
    pub(super) blocks: Vec<Block>,
    /// How it stands.
    pub(super) turn: Turn,
    /// Where its middle stands (um).
    pub(super) at: IVec2,
}

impl Piece {
    fn place(&self, p: IVec3) -> IVec3 {
        self.turn.apply(p) + self.at.extend(0)
    }

    /// Its surfaces.
    pub(super) fn quads(&self) -> impl Iterator<Item = Quad> {
        self.blocks.iter().flat_map(move |block| {
            block.faces.iter().map(move |&face| {
                let name = format!("{}-{}-{}", self.name, block.part, face.name());
                let material = if face == Front { block.front } else { block.material };
                Quad::new(name, material, block.corners(face).map(|p| self.place(p)))
            })
        })
    }

    /// The axis-parallel rectangle on the floor that holds it (um).
    pub(super) fn footprint(&self) -> [IVec2; 2] {
        let corners = self.blocks.iter().flat_map(|block| {
            [Left, Right].into_iter().flat_map(|face| block.corners(face)).map(|p| self.place(p).truncate())
        });
        corners.fold([IVec2::MAX, IVec2::MIN], |[low, high], p| [low.min(p), high.max(p)])
    }
}
