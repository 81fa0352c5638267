//! Tests that no ray slips through a closed mesh at its edges and vertices.

use std::collections::BTreeMap;

use proptest::prelude::*;

use crate::datapath::ray_patch::intersect;
use crate::datapath::test_support::formats;
use crate::datapath::{PatchWords, RayWords};
use crate::fixed::{Formats, Rounding};

/// Quads and triangles over the six faces of a cube, n x n each, pushed to random radii: closed and star-shaped.
/// Vertices are shared: one word triple a lattice point.
fn bumpy_ball(f: u32, n: i32, radii: &[f64], triangles: bool) -> (Vec<PatchWords>, Vec<[i32; 3]>) {
    let mut vertices = BTreeMap::<[i32; 3], [i32; 3]>::new();
    let mut patches = Vec::new();
    let mut vertex = |place: [i32; 3]| {
        let next = vertices.len();
        *vertices.entry(place).or_insert_with(|| {
            let p = place.map(|w| f64::from(2 * w - n) / f64::from(n));
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            let radius = radii[next % radii.len()] * f64::from(1_i32 << f);
            p.map(|x| (x / length * radius).round() as i32)
        })
    };
    for axis in 0..3 {
        for end in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let mut at = |u: i32, v: i32| {
                        let mut place = [0; 3];
                        (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (end, u, v);
                        vertex(place)
                    };
                    let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    if triangles {
                        let half = |a: usize, b: usize, c: usize| PatchWords {
                            corners: [corners[a], corners[b], corners[c], corners[c]],
                            is_triangle: true,
                            id: 0,
                        };
                        // The other diagonal than a quad's.
                        patches.extend([half(0, 1, 3), half(1, 2, 3)]);
                    } else {
                        patches.push(PatchWords { corners, is_triangle: false, id: 0 });
                    }
                }
            }
        }
    }
    (patches, vertices.into_values().collect())
}

/// The direction to a target given with one more fraction bit than coordinates, exact where D >= F + 3.
fn toward(formats: &Formats, origin: [i32; 3], doubled: [i32; 3]) -> RayWords {
    let raw = [0, 1, 2].map(|k| i64::from(doubled[k]) - 2 * i64::from(origin[k]));
    let most = raw.iter().map(|w| w.abs()).max().unwrap();
    let mut shift = 0;
    while most << (shift + 1) < 1 << formats.dir_frac_bits {
        shift += 1;
    }
    RayWords { origin, dir: raw.map(|w| i32::try_from(w << shift).unwrap()), t_max: formats.t_limit() }
}

/// Rays aimed from inside at every vertex, and at the middle of every edge and diagonal; how many, how many leak.
fn leaks(formats: &Formats, radii: &[f64], triangles: bool, origin: [i32; 3]) -> (usize, usize) {
    let (patches, vertices) = bumpy_ball(formats.coord_frac_bits, 3, radii, triangles);
    let mut targets: Vec<[i32; 3]> = vertices.iter().map(|v| v.map(|w| 2 * w)).collect();
    for patch in &patches {
        for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)] {
            targets.push([0, 1, 2].map(|k| patch.corners[i][k] + patch.corners[j][k]));
        }
    }
    let lost = targets
        .iter()
        .map(|target| toward(formats, origin, *target))
        .filter(|ray| patches.iter().all(|patch| intersect(formats, ray, patch).is_none()))
        .count();
    (targets.len(), lost)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn intersect_closed_bumpy_ball_from_inside_always_hits(
        f in 8_u32..=16,
        radii in prop::collection::vec(0.5_f64..0.95, 56),
        triangles in any::<bool>(),
        place in [-0.15_f64..0.15, -0.15_f64..0.15, -0.15_f64..0.15],
        mode in 0_usize..3,
    ) {
        let rounding = [Rounding::NearestEven, Rounding::HalfAway, Rounding::Floor][mode];
        let formats = Formats { rounding, ..formats(f, f + 4, 12) };
        let origin = place.map(|x| (x * f64::from(1_i32 << f)).round() as i32);
        let (rays, lost) = leaks(&formats, &radii, triangles, origin);
        prop_assert!(rays > 300);
        prop_assert_eq!(lost, 0, "of {}", rays);
    }
}

#[test]
fn intersect_floored_edge_normals_do_leak() {
    // The reason for full products, and proof that the test above can fail.
    let radii: Vec<f64> = (0..56).map(|k| 0.5 + 0.45 * f64::from(k * 37 % 56) / 56.0).collect();
    let floored = Formats { cross_keep_bits: Some(10), rounding: Rounding::Floor, ..formats(12, 16, 12) };
    let (rays, lost) = leaks(&floored, &radii, true, [100, -50, 30]);
    assert!(rays > 300 && lost > rays / 100, "{lost} of {rays}");
}
