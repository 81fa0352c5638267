//! `segments-2d`: random line segments of the unit square, extruded along z: flatland on the three-dimensional board.
//!
//! ```text
//! i, seed --Random, stream i--> a segment in the unit square (um) --z from 0 to h--> a two-sided quad
//! ```
//! Every surface but floor and ceiling is upright and as high as the box, so a ray in the plane z = h / 2 meets what
//! its two-dimensional shadow meets. L = [`TOTAL_LENGTH_M`] is the length of all segments together, whatever their
//! number N: a ray flies about pi / (2 L) = 0.52 m from segment to segment. Segments may cross each other. The four
//! walls shine, so that light too comes from the plane, and from all around.
//!
//! Source: mean free path pi A / (2 L) of straight lines in the plane among segments of length L in an area A.

use glam::IVec3;

use super::random::Random;
use super::room::Room;
use super::text::{Camera, Light, Quad, SceneText, mm};

/// Side of the square (um).
const SIDE: i32 = mm(1000);
/// Length of all segments together (m), unless they are few.
const TOTAL_LENGTH_M: f64 = 3.0;
/// Mean length of a segment when they are few (m).
const MAX_LENGTH_M: f64 = 0.3;
/// Height of the box when segments are few (um).
const MAX_HEIGHT: i32 = mm(250);
/// Least distance of a segment from the walls (um).
const MARGIN: i32 = mm(20);
/// The eye in the plane (um), in a corner.
const EYE: [i32; 2] = [mm(30), mm(30)];
/// Least distance of a segment from the eye (m).
const CLEAR_M: f64 = 0.15;
/// Luminous flux of each wall (lm).
const LAMP_LUMENS: u32 = 1000;
/// Wanted elements of the box, and of a segment, which gets some 25 however few are asked for: it is higher than long.
const ELEMENTS: [u32; 2] = [1000, 10];

/// Reflectances that segments take by turns.
const COLORS: [(&str, [f64; 3]); 4] = [
    ("grey", [0.6, 0.6, 0.6]),
    ("red", [0.65, 0.16, 0.12]),
    ("green", [0.22, 0.5, 0.2]),
    ("blue", [0.16, 0.28, 0.6]),
];

/// The scene of so many.
pub(super) fn scene(count: u32, seed: u64) -> SceneText {
    let mean_m = (TOTAL_LENGTH_M / f64::from(count)).min(MAX_LENGTH_M);
    // Even, so that the middle plane is a whole number; higher costs elements, lower loses light at floor and ceiling.
    let height = (4 * (mean_m * 1e6) as i32).min(MAX_HEIGHT);
    let room = Room { size: IVec3::new(SIDE, SIDE, height), lamps_x: vec![], lamps_y: vec![] };
    let mut materials = Room::materials([0.5, 0.5, 0.5], LAMP_LUMENS);
    materials.retain(|(name, _)| *name != "wall");
    materials.extend(COLORS.map(|(name, rgb)| (name, Light::Reflects(rgb))));
    let mut quads = room.quads();
    for quad in quads.iter_mut().filter(|quad| quad.material == "wall") {
        quad.material = "lamp";
    }
    quads.extend((1..=count).map(|i| segment(i, mean_m, height, &mut Random::new(seed, u64::from(i)))));
    SceneText {
        about: format!(
            "Flatland: {count} random segments of the unit square, extruded along z into two-sided quads as high as \
             their\nclosed box. In the plane z = h / 2, the camera's, rays see a two-dimensional world. The four \
             walls shine."
        ),
        camera: Camera {
            eye: IVec3::new(EYE[0], EYE[1], height / 2),
            target: IVec3::new(SIDE / 2, SIDE / 2, height / 2),
            fov_y_deg: 60,
        },
        materials,
        elements: ELEMENTS[0] + ELEMENTS[1] * count,
        quads,
    }
}

/// Segment `i`, 0.5 to 1.5 times `mean_m` long (m), `height` high (um).
fn segment(i: u32, mean_m: f64, height: i32, random: &mut Random) -> Quad {
    loop {
        // A direction in the plane: the vertical part of one in space is dropped.
        let direction = random.direction();
        let flat = (direction.x * direction.x + direction.y * direction.y).sqrt();
        if flat < 0.1 {
            continue;
        }
        let length_um = 1e6 * mean_m * random.between(0.5, 1.5);
        let along = |c: f64| (length_um * c / flat).round() as i32;
        let run = IVec3::new(along(direction.x), along(direction.y), 0);
        let mut place = |run: i32| random.whole(MARGIN - run.min(0), SIDE - MARGIN - run.max(0));
        let from = IVec3::new(place(run.x), place(run.y), 0);
        let to = from + run;
        let middle = 0.5 * (from + to).as_dvec3().truncate();
        let eye = glam::DVec2::new(f64::from(EYE[0]), f64::from(EYE[1]));
        if middle.distance(eye) > 0.5 * length_um + 1e6 * CLEAR_M {
            let up = IVec3::new(0, 0, height);
            let material = COLORS[i as usize % COLORS.len()].0;
            let corners = [from, to, to + up, from + up];
            return Quad { two_sided: true, ..Quad::new(format!("segment-{i}"), material, corners) };
        }
    }
}
