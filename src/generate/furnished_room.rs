//! `furnished-room`: a room with tables, chairs, shelves and cupboards under ceiling lamps.
//!
//! ```text
//! count, seed --Random--> cells of a lattice --a piece each, jittered, never over its cell's edge--> Room + Pieces
//!
//!   y   +--------------------+  shelves and cupboards stand with their backs to the two walls that the camera sees,
//!   |   | [==] [==]  [=] [==]|  tables and chairs anywhere
//!   |   |  /\   ||   __   [] |
//!   |   |  ||   __   ||   [] |
//!   |   |camera              |
//!   '---+-------------------- x
//! ```
//! Not modelled: what stands on tables and in shelves; curved furniture.

use glam::{IVec2, IVec3};

use super::furniture::{Design, Piece, Turn};
use super::random::Random;
use super::room::Room;
use super::text::{Camera, Light, SceneText, mm};

/// Side of a cell (um): the longest table fits in it as it may be turned.
const CELL: i32 = mm(1500);
/// What a piece stays away from its cell's edge (um): half the least gap between two.
const GAP: i32 = mm(30);
/// From the lattice to the walls (um): the camera stands here.
const AISLE: i32 = mm(700);
/// From a shelf or cupboard to its wall (um).
const BEHIND: i32 = mm(20);
/// Places are multiples of this (um).
const STEP: i32 = mm(5);
/// Height of the room (um).
const HEIGHT: i32 = mm(2700);
/// The eye (um).
pub(super) const EYE: IVec3 = IVec3::new(mm(300), mm(300), mm(1650));
/// Luminous flux of the lamps (lm) for each square metre of the floor.
const LUMENS_PER_M2: i32 = 400;
/// Wanted elements of the room and of a piece. A piece has some 400 however few are asked for: legs and boards are thin.
const ELEMENTS: [u32; 2] = [300, 140];

/// Reflectances of what furniture is made of.
pub(super) const MATERIALS: [(&str, [f64; 3]); 9] = [
    ("beech", [0.58, 0.42, 0.26]),
    ("oak", [0.42, 0.29, 0.16]),
    ("walnut", [0.2, 0.12, 0.07]),
    ("white", [0.72, 0.72, 0.7]),
    ("grey", [0.45, 0.46, 0.48]),
    ("dark", [0.08, 0.08, 0.08]),
    ("cloth-red", [0.5, 0.09, 0.07]),
    ("cloth-blue", [0.1, 0.2, 0.42]),
    ("cloth-green", [0.15, 0.32, 0.14]),
];

/// The room's lattice and what stands in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Furnished {
    /// The room.
    pub(super) room: Room,
    /// Its furniture.
    pub(super) pieces: Vec<Piece>,
}

/// The scene of so many.
pub(super) fn scene(count: u32, seed: u64) -> SceneText {
    let Furnished { room, pieces } = furnish(count, seed);
    let [x, y] = [room.size.x, room.size.y].map(|um| f64::from(um) / 1e6);
    let n_lamps = (room.lamps_x.len() * room.lamps_y.len()) as i32;
    let floor_m2 = (x * y).round() as i32;
    // Whole hundreds, as lamps are sold.
    let lumens = 100 * (LUMENS_PER_M2 * floor_m2 / n_lamps / 100);
    let mut materials = Room::materials([0.32, 0.26, 0.2], lumens.unsigned_abs());
    materials.extend(MATERIALS.map(|(name, rgb)| (name, Light::Reflects(rgb))));
    let mut quads = room.quads();
    quads.extend(pieces.iter().flat_map(Piece::quads));
    SceneText {
        about: format!(
            "A room of {x} x {y} x 2.7 m (z up) with {count} pieces of furniture under {n_lamps} flush ceiling \
             lamps of {lumens} lm.\nFaces that stand on the floor or on another part are left out."
        ),
        camera: Camera {
            eye: EYE,
            target: IVec3::new(room.size.x / 2, room.size.y / 2, mm(750)),
            fov_y_deg: 65,
        },
        materials,
        elements: ELEMENTS[0] + ELEMENTS[1] * count,
        quads,
    }
}

/// The room and its pieces.
pub(super) fn furnish(count: u32, seed: u64) -> Furnished {
    let mut random = Random::new(seed, 0);
    let cells = lattice(count);
    let size = cells * CELL + 2 * AISLE;
    let lamps = [size.x, size.y].map(|length| (length / mm(3500)).clamp(2, 4));
    // In a hall the few lamps grow: a sixth of their part.
    let lamp_size = [0, 1].map(|axis| (size[axis] / lamps[axis] / 6 / mm(100) * mm(100)).max(mm(600)));
    let room = Room::with_lamps(size.extend(HEIGHT), lamps, lamp_size);

    let mut free: Vec<IVec2> =
        (0..cells.y).flat_map(|j| (0..cells.x).map(move |i| IVec2::new(i, j))).collect();
    while free.len() > count as usize {
        free.swap_remove(random.whole(0, free.len() as i32 - 1) as usize);
    }
    free.sort_unstable_by_key(|cell| (cell.y, cell.x));
    let mut n_of = [0; 4];
    let pieces = free.iter().map(|&cell| {
        let at_wall = [cell.x == cells.x - 1, cell.y == cells.y - 1];
        let design = choose(at_wall, &mut random);
        n_of[design as usize] += 1;
        let name = format!("{}-{}", design.name(), n_of[design as usize]);
        put(name, design, cell, at_wall, &mut random)
    });
    let pieces = pieces.collect();
    Furnished { room, pieces }
}

/// Cells along x and y: the least lattice of about 4 to 3 that has as many as there are pieces.
fn lattice(count: u32) -> IVec2 {
    let count = count as i32;
    let mut x = 1;
    while x * (3 * x + 3) / 4 < count {
        x += 1;
    }
    IVec2::new(x, (count + x - 1) / x)
}

fn choose(at_wall: [bool; 2], random: &mut Random) -> Design {
    let tall = at_wall.contains(&true) && random.whole(1, 10) <= 7;
    if tall {
        random.pick(&[Design::Shelf, Design::Cupboard])
    } else {
        random.pick(&[Design::Table, Design::Chair, Design::Chair])
    }
}

/// A piece in its cell.
fn put(name: String, design: Design, cell: IVec2, at_wall: [bool; 2], random: &mut Random) -> Piece {
    let blocks = design.blocks(random);
    let wall = match at_wall {
        _ if matches!(design, Design::Table | Design::Chair) => None,
        [true, true] => Some(random.pick(&[0, 1])),
        [east, _] => Some(usize::from(!east)),
    };
    let turn = match (design, wall) {
        // A back looks along +y; three quarters turn it to +x.
        (_, Some(0)) => Turn::NONE.quarters(3),
        (_, Some(_)) => Turn::NONE,
        (Design::Chair, None) => random.pick(&Turn::ANY).quarters(random.whole(0, 3)),
        (_, None) => random.pick(&Turn::SLIGHT).quarters(random.whole(0, 3)),
    };
    let mut piece = Piece { name, blocks, turn, at: IVec2::ZERO };
    let [low, high] = piece.footprint();
    // The middle's range: the footprint stays inside the cell, or touches the aisle's wall.
    let corner = cell * CELL + AISLE;
    let from = corner + GAP - low;
    let to = corner + CELL - GAP - high;
    for axis in [0, 1] {
        piece.at[axis] = if wall == Some(axis) {
            corner[axis] + CELL + AISLE - BEHIND - high[axis]
        } else {
            STEP * random.whole((from[axis] + STEP - 1).div_euclid(STEP), to[axis].div_euclid(STEP))
        };
    }
    piece
}
