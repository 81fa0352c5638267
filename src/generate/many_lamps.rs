//! `many-lamps`: the furnished room under a lattice of many small ceiling lamps.
//!
//! ```text
//! count, seed --> lamps a x b = count, a : b as near as can be to the room's sides; furniture as in furnished_room.rs
//! ```

use glam::IVec3;

use super::furnished_room::{self, Furnished};
use super::furniture::Piece;
use super::room::Room;
use super::text::{Camera, Light, SceneText, mm};

/// Pieces of furniture.
const N_PIECES: u32 = 12;
/// Longest side of a lamp (um); where they are many, a half of their part.
const LAMP: i32 = mm(200);
/// Luminous flux of the lamps (lm) for each square metre of the floor.
const LUMENS_PER_M2: u32 = 400;
/// Wanted elements.
const ELEMENTS: u32 = 6000;

/// The scene of so many lamps.
pub(super) fn scene(count: u32, seed: u64) -> SceneText {
    let Furnished { room, pieces } = furnished_room::furnish(N_PIECES, seed);
    let n = lattice(count, f64::from(room.size.x) / f64::from(room.size.y));
    let side = |axis: usize| LAMP.min(room.size[axis] / n[axis] / 2);
    let room = Room::with_lamps(room.size, n, [side(0), side(1)]);
    let [x, y] = [room.size.x, room.size.y].map(|um| f64::from(um) / 1e6);
    let lumens = (f64::from(LUMENS_PER_M2) * x * y / f64::from(count)).round().max(1.0) as u32;
    let mut materials = Room::materials([0.32, 0.26, 0.2], lumens);
    materials.extend(furnished_room::MATERIALS.map(|(name, rgb)| (name, Light::Reflects(rgb))));
    let mut quads = room.quads();
    quads.extend(pieces.iter().flat_map(Piece::quads));
    SceneText {
        about: format!(
            "A room of {x} x {y} x 2.7 m (z up) with {N_PIECES} pieces of furniture under {count} flush ceiling lamps of \
             {lumens} lm.\nFaces that stand on the floor or on another part are left out."
        ),
        camera: Camera {
            eye: furnished_room::EYE,
            target: IVec3::new(room.size.x / 2, room.size.y / 2, mm(750)),
            fov_y_deg: 65,
        },
        materials,
        elements: ELEMENTS,
        quads,
    }
}

/// a x b = `count`, with a / b nearest to `aspect` by ratio.
fn lattice(count: u32, aspect: f64) -> [i32; 2] {
    let divisors = (1..=count).filter(|a| count.is_multiple_of(*a)).map(|a| [a as i32, (count / a) as i32]);
    let off = |[a, b]: &[i32; 2]| (f64::from(*a) / f64::from(*b) / aspect).ln().abs();
    divisors.min_by(|p, q| off(p).total_cmp(&off(q))).unwrap_or([1, 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattice_of_fifty_lamps_is_ten_by_five_in_a_long_room_and_a_row_for_a_prime() {
        assert_eq!(lattice(50, 1.5), [10, 5]);
        assert_eq!(lattice(50, 0.6), [5, 10]);
        assert_eq!(lattice(7, 2.0), [7, 1]);
        assert_eq!(lattice(16, 1.1), [4, 4]);
    }

    #[test]
    fn every_lamp_is_a_surface() {
        let scene = scene(50, 1);
        assert_eq!(scene.quads.iter().filter(|q| q.material == "lamp").count(), 50);
    }
}
