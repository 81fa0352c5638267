//! Closed forms of watertightness: rays exactly through corners, edges and along faces of two solids.

use crate::datapath::ray_patch::{intersect, taps};
use crate::datapath::test_support::formats;
use crate::datapath::{PatchWords, RayWords};

/// The octahedron with corners 100 from the middle, as 8 triangles, and all 26 lattice directions from a point.
fn octahedron() -> Vec<PatchWords> {
    let corner = |axis: usize, sign: i32| {
        let mut at = [0; 3];
        at[axis] = 100 * sign;
        at
    };
    (0..8_u32)
        .map(|id| {
            let sign = |axis: u32| if id >> axis & 1 == 0 { 1 } else { -1 };
            let [x, y, z] = [0, 1, 2].map(|axis| corner(axis, sign(axis as u32)));
            PatchWords { corners: [x, y, z, z], is_triangle: true, id }
        })
        .collect()
}

fn lattice_directions() -> impl Iterator<Item = [i32; 3]> {
    (0..27).filter(|n| *n != 13).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1])
}

#[test]
fn intersect_octahedron_from_its_middle_hits_every_face_around_the_corner_or_edge() {
    let formats = formats(8, 8, 8);
    let patches = octahedron();
    for direction in lattice_directions() {
        let ray = RayWords { origin: [0; 3], dir: direction.map(|w| 128 * w), t_max: formats.t_limit() };
        let hits: Vec<u64> =
            patches.iter().filter_map(|patch| intersect(&formats, &ray, patch)).map(|hit| hit.t).collect();
        // Through a corner: four faces at 100/128 of 2^8 = 200. Through an edge's middle: two, at half of it; through
        // a face's middle: one, at a third, 66.7.
        let (count, t) = match direction.iter().filter(|w| **w != 0).count() {
            1 => (4, 200),
            2 => (2, 100),
            _ => (1, 67),
        };
        assert_eq!(hits, vec![t; count], "{direction:?}");
    }
}

#[test]
fn intersect_box_from_a_point_in_the_plane_of_inner_faces_drops_those_and_hits_the_rest() {
    // An L: the box [-100, 100] x [-100, 0] x [-50, 50] and on it [-100, 0] x [0, 100] x [-50, 50]. The step at
    // y = 0, 0 <= x <= 100 lies in the plane of the origin.
    let formats = formats(8, 8, 8);
    let step = [[0, 0, -50], [100, 0, -50], [100, 0, 50], [0, 0, 50]];
    let rise = [[0, 0, -50], [0, 0, 50], [0, 100, 50], [0, 100, -50]];
    let wall = [[100, -100, -50], [100, 0, -50], [100, 0, 50], [100, -100, 50]];
    let quad = |corners, id| PatchWords { corners, is_triangle: false, id };
    let (step, rise, wall) = (quad(step, 0), quad(rise, 1), quad(wall, 2));
    let ray = RayWords { origin: [-50, 0, 0], dir: [128, 0, 0], t_max: formats.t_limit() };
    // Along the step: all five edge values are 0, no hit. The ray touches the lower edge of the rise, then leaves
    // by the upper edge of the wall.
    assert_eq!(taps(&formats, &ray, &step).e, [0; 5]);
    assert_eq!(intersect(&formats, &ray, &step), None);
    assert_eq!(intersect(&formats, &ray, &rise).map(|hit| hit.t), Some(100));
    assert_eq!(intersect(&formats, &ray, &wall).map(|hit| hit.t), Some(300));
    // Upward from the plane the step is behind, downward too: it holds no point of these rays but the origin's plane.
    for dir in [[128, 3, 0], [128, -3, 0]] {
        assert_eq!(intersect(&formats, &RayWords { dir, ..ray }, &step), None);
    }
}

#[test]
fn intersect_quads_and_triangles_without_area_are_never_hit() {
    let formats = formats(8, 8, 8);
    let flat: [[[i32; 3]; 4]; 3] = [
        [[50, 50, 50]; 4],
        [[50, 0, 0], [100, 0, 0], [75, 0, 0], [60, 0, 0]],
        [[50, -10, 3], [50, 10, 3], [50, 0, 3], [50, -10, 3]],
    ];
    let mut cases = 0;
    for corners in flat {
        for is_triangle in [true, false] {
            let patch = PatchWords { corners, is_triangle, id: 0 };
            let targets = corners.into_iter().chain([[50, 3, 3], [80, 0, 0], [100, 1, 0]]);
            for target in targets {
                let ray = RayWords { origin: [0; 3], dir: target, t_max: formats.t_limit() };
                assert_eq!(intersect(&formats, &ray, &patch), None, "{target:?} {patch:?}");
                cases += 1;
            }
        }
    }
    assert_eq!(cases, 3 * 2 * 7);
}
