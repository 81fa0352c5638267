//! `random-patches`: parallelograms of random place, size and orientation in a closed room.
//!
//! ```text
//! i, seed --Random, stream i--> two edges and a place, in tenths of a millimetre --> a two-sided quad inside the room
//! ```
//! A = [`TOTAL_AREA_M2`] is the area of all patches together, whatever their number N: a patch has edges of about
//! sqrt(A / N), and a ray flies about 2 V / A = 6 m from patch to patch, so experiments change the number alone.
//! Patches may cross each other; none touches a wall, and none comes near the camera.
//!
//! Source: mean free path 4 V / S of straight lines among surfaces of area S, here both sides of A.

use glam::IVec3;

use super::random::Random;
use super::room::Room;
use super::text::{Camera, Light, Quad, SceneText, mm};
use crate::geom::DVec3;

/// The room (um): V = 48 m^3.
const ROOM: IVec3 = IVec3::new(mm(4000), mm(4000), mm(3000));
/// Area of all patches together, one side (m^2), unless they are few.
const TOTAL_AREA_M2: f64 = 16.0;
/// Mean edge of a patch when they are few (m).
const MAX_EDGE_M: f64 = 0.6;
/// Coordinates are multiples of this (um).
const STEP: i32 = 100;
/// Least distance from the walls (um).
const MARGIN: i32 = mm(10);
/// Least distance of a patch from the eye (m).
const CLEAR_M: f64 = 0.5;
/// The eye (um).
const EYE: IVec3 = IVec3::new(mm(250), mm(250), mm(1500));
/// Least wish for elements: what the room needs for its shadows.
const MIN_ELEMENTS: u32 = 1000;
/// Wanted elements a patch. It gets 8, the least that two sides have, and the wish leaves the rest to the room.
const ELEMENTS_PER_PATCH: u32 = 4;

/// Reflectances that patches take by turns.
const COLORS: [(&str, [f64; 3]); 6] = [
    ("grey", [0.6, 0.6, 0.6]),
    ("red", [0.65, 0.16, 0.12]),
    ("ochre", [0.68, 0.47, 0.16]),
    ("green", [0.22, 0.5, 0.2]),
    ("blue", [0.16, 0.28, 0.6]),
    ("plum", [0.45, 0.2, 0.42]),
];

/// The scene of so many.
pub(super) fn scene(count: u32, seed: u64) -> SceneText {
    let room = Room::with_lamps(ROOM, [1, 1], [mm(1000), mm(1000)]);
    let mut materials = Room::materials([0.5, 0.48, 0.45], 8000);
    materials.extend(COLORS.map(|(name, rgb)| (name, Light::Reflects(rgb))));
    let mut quads = room.quads();
    let edge_m = (TOTAL_AREA_M2 / f64::from(count)).sqrt().min(MAX_EDGE_M);
    quads.extend((1..=count).map(|i| patch(i, edge_m, &mut Random::new(seed, u64::from(i)))));
    SceneText {
        about: format!(
            "A closed room of 4 x 4 x 3 m (z up) with {count} two-sided patches of random place, size and \
             orientation,\nand a ceiling lamp of 8000 lm. Patches may cross each other."
        ),
        camera: Camera { eye: EYE, target: IVec3::new(mm(2400), mm(2400), mm(1400)), fov_y_deg: 70 },
        materials,
        elements: MIN_ELEMENTS.max(ELEMENTS_PER_PATCH * count),
        quads,
    }
}

/// Patch `i` with edges of about `edge_m` (m).
fn patch(i: u32, edge_m: f64, random: &mut Random) -> Quad {
    loop {
        let (u, v) = edges(edge_m, random);
        // The first corner moves in a box that keeps all four inside.
        let low = IVec3::splat(MARGIN) - IVec3::ZERO.min(u).min(v).min(u + v);
        let high = ROOM - MARGIN - IVec3::ZERO.max(u).max(v).max(u + v);
        let mut place = |low: i32, high: i32| {
            let (low, high) = ((low + STEP - 1).div_euclid(STEP), high.div_euclid(STEP));
            STEP * random.whole(low, high)
        };
        let p = IVec3::new(place(low.x, high.x), place(low.y, high.y), place(low.z, high.z));
        let corners = [p, p + u, p + u + v, p + v];
        let middle = 0.5 * (corners[0] + corners[2]).as_dvec3();
        let radius = corners.iter().map(|c| c.as_dvec3().distance(middle)).fold(0.0, f64::max);
        if middle.distance(EYE.as_dvec3()) > radius + 1e6 * CLEAR_M {
            let material = COLORS[i as usize % COLORS.len()].0;
            return Quad { two_sided: true, ..Quad::new(format!("patch-{i}"), material, corners) };
        }
    }
}

/// Two edges (um, multiples of [`STEP`]) with angles of 60 degrees and more between them.
fn edges(edge_m: f64, random: &mut Random) -> (IVec3, IVec3) {
    let along = random.direction();
    let across = loop {
        let v = random.direction();
        let square = v - along * v.dot(along);
        if square.length_squared() > 0.01 {
            break square / square.length();
        }
    };
    let mut length = || edge_m * random.between(0.6, 1.4);
    let (a, b) = (length(), length());
    let shear = random.between(-0.5, 0.5);
    (rounded(a * along), rounded(b * (across + shear * along)))
}

fn rounded(v_m: DVec3) -> IVec3 {
    STEP * (v_m * (1e6 / f64::from(STEP))).round().as_ivec3()
}
