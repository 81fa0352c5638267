//! Is a point inside a closed mesh? Independent of the datapath: exact orientation predicates, an odd number of
//! crossings.

use robust::{Coord3D, orient3d};

use super::Mesh;
use super::random::Random;

/// Segments that are tried before a point counts as lying on the mesh.
const TRIES: usize = 8;

/// True when a segment from the point to far outside crosses the mesh an odd number of times; a point on a triangle is
/// not inside.
pub fn is_inside(mesh: &Mesh, point: [i32; 3], random: &mut Random) -> bool {
    (0..TRIES).find_map(|_| crossings(mesh, point, random)).is_some_and(|n| n % 2 == 1)
}

/// A random point inside: near one of the mesh's cores.
pub fn origin(mesh: &Mesh, random: &mut Random) -> Option<[i32; 3]> {
    let cube = 1_i64 << mesh.coord_frac_bits;
    (0..20).find_map(|_| {
        let core = mesh.cores[random.below(mesh.cores.len())];
        let reach = cube >> (1 + random.below(4));
        let point = core.map(|w| {
            let word = i64::from(w) + random.integer(-reach, reach);
            i32::try_from(word.clamp(-cube, cube - 1)).expect("inside the cube")
        });
        is_inside(mesh, point, random).then_some(point)
    })
}

/// How often a random segment from the point to outside the cube crosses the mesh; `None` when it meets an edge, or
/// the point lies on a triangle.
fn crossings(mesh: &Mesh, point: [i32; 3], random: &mut Random) -> Option<usize> {
    let far_side = 1_i64 << (mesh.coord_frac_bits + 1);
    let mut far = [(); 3].map(|()| random.integer(-far_side, far_side));
    far[random.below(3)] = if random.below(2) == 0 { far_side } else { -far_side };
    let at = |p: [i32; 3]| Coord3D { x: f64::from(p[0]), y: f64::from(p[1]), z: f64::from(p[2]) };
    let (o, q) = (at(point), Coord3D { x: far[0] as f64, y: far[1] as f64, z: far[2] as f64 });
    let mut n = 0;
    for [v0, v1, v2] in mesh.triangles() {
        // With two equal corners its edges cancel: no surface.
        if v0 == v1 || v1 == v2 || v2 == v0 {
            continue;
        }
        let [a, b, c] = [at(v0), at(v1), at(v2)];
        let sides = [orient3d(o, q, a, b), orient3d(o, q, b, c), orient3d(o, q, c, a)];
        if sides.iter().any(|s| *s > 0.0) && sides.iter().any(|s| *s < 0.0) {
            continue;
        }
        if sides.contains(&0.0) {
            return None;
        }
        match orient3d(a, b, c, o) {
            0.0 => return None,
            here => n += usize::from((here > 0.0) != (orient3d(a, b, c, q) > 0.0)),
        }
    }
    Some(n)
}
