//! Pairs at which arithmetic, or a comparison in it, could go wrong.

use rtl_model::datapath::{PatchWords, RayWords};
use rtl_model::fixed::Formats;
use rtl_model::oracle;

use super::Pair;
use super::shapes::{Point, aim, aimed, along, any_patch, clamped, patch, plus, t_max, through};
use crate::draw::Draw;

/// A ray exactly through a corner of any patch.
pub fn vertex(formats: &Formats, draw: &mut Draw) -> Pair {
    let patch = any_patch(formats, draw);
    let corner = patch.corners[draw.below(if patch.is_triangle { 3 } else { 4 }) as usize];
    Pair { ray: through(formats, corner, draw), patch }
}

/// A ray exactly through a point of an edge or of the diagonal, or along it; the edge runs either way, as it does in
/// the two patches that share it.
pub fn edge(formats: &Formats, draw: &mut Draw) -> Pair {
    let f = formats.coord_frac_bits;
    let point = draw.signed_point(f - 1);
    let step = draw.signed_point((f - 3).min(formats.dir_frac_bits));
    let [before, after] = [0; 2].map(|_| i32::try_from(draw.below(4)).unwrap_or(0));
    let is_triangle = draw.below(2) == 1;
    let edges: &[(usize, usize)] =
        if is_triangle { &[(0, 1), (1, 2), (2, 0)] } else { &[(0, 2), (0, 1), (1, 2), (2, 3), (3, 0)] };
    let (from, to) = draw.of(edges);
    let mut corners = [0; 4].map(|_| draw.signed_point(f));
    (corners[from], corners[to]) = (plus(point, -before, step), plus(point, after, step));
    if draw.below(2) == 1 {
        corners.swap(from, to);
    }
    let patch = patch(corners, is_triangle, draw);
    let ray = match draw.below(6) {
        0 => {
            RayWords { origin: point, dir: along(formats, step.map(i64::from)), t_max: t_max(formats, draw) }
        }
        _ => through(formats, point, draw),
    };
    Pair { ray, patch }
}

/// A flat patch v0 + i u + j w with room around it for combinations of up to three steps each way.
struct Lattice {
    v0: Point,
    u: Point,
    w: Point,
}

impl Lattice {
    fn new(formats: &Formats, draw: &mut Draw) -> Lattice {
        let f = formats.coord_frac_bits;
        let bits = (f - 4).min(formats.dir_frac_bits - 4);
        let size = draw.below(bits);
        Lattice {
            v0: draw.signed_point(f - 1),
            u: draw.signed_point(bits - size),
            w: draw.signed_point(bits - size),
        }
    }

    fn at(&self, i: i32, j: i32) -> Point {
        plus(plus(self.v0, i, self.u), j, self.w)
    }

    /// Three steps by three.
    fn patch(&self, draw: &mut Draw) -> PatchWords {
        let corners = [self.at(0, 0), self.at(3, 0), self.at(3, 3), self.at(0, 3)];
        patch(corners, draw.below(2) == 1, draw)
    }
}

/// A ray in the patch's plane or parallel to it, or off that by a step of its origin or direction.
pub fn grazing(formats: &Formats, draw: &mut Draw) -> Pair {
    let lattice = Lattice::new(formats, draw);
    let [i, j, p, q] = [0; 4].map(|_| i32::try_from(draw.below(4)).unwrap_or(0));
    let toward = [0, 1, 2].map(|k| i64::from((p - 1) * lattice.u[k]) + i64::from((q - 1) * lattice.w[k]));
    let mut origin = lattice.at(i - 3, j);
    let mut dir = along(formats, toward);
    let axis = draw.below(3) as usize;
    let nudge = draw.of(&[1, -1]);
    match draw.below(4) {
        0 => {}
        1 => origin[axis] += nudge,
        2 => dir[axis] -= nudge * dir[axis].signum(),
        _ => {
            origin[axis] += nudge;
            dir[axis] -= dir[axis].signum();
        }
    }
    if dir == [0; 3] {
        dir[axis] = 1;
    }
    Pair { ray: RayWords { origin, dir, t_max: t_max(formats, draw) }, patch: lattice.patch(draw) }
}

/// A ray from a corner, a point of an edge, or a point inside.
pub fn on_patch(formats: &Formats, draw: &mut Draw) -> Pair {
    let lattice = Lattice::new(formats, draw);
    let [i, j] = [0; 2].map(|_| i32::try_from(draw.below(4)).unwrap_or(0));
    let dir = along(formats, draw.signed_point(formats.dir_frac_bits).map(i64::from));
    let ray = RayWords { origin: lattice.at(i.max(j), j), dir, t_max: t_max(formats, draw) };
    Pair { ray, patch: lattice.patch(draw) }
}

/// A patch a step or two wide, with a ray toward it, through a corner, or through a point of its axis.
pub fn sliver(formats: &Formats, draw: &mut Draw) -> Pair {
    let f = formats.coord_frac_bits;
    let v0 = draw.signed_point(f - 1);
    let step = draw.signed_point(f - 5);
    let tiny = |p: Point, draw: &mut Draw| plus(p, 1, draw.signed_point(1));
    let far = 2 + i32::try_from(draw.below(6)).unwrap_or(0);
    let v1 = tiny(plus(v0, i32::try_from(draw.below(8)).unwrap_or(0), step), draw);
    let (v2, v3) = (tiny(plus(v0, far, step), draw), tiny(plus(v0, 1, step), draw));
    let patch = patch([v0, v1, v2, v3].map(|v| clamped(formats, v)), draw.below(2) == 1, draw);
    let ray = match draw.below(4) {
        0 => through(formats, plus(v0, 1, step), draw),
        1 => through(formats, patch.corners[2], draw),
        _ => {
            let origin = draw.signed_point(f);
            aim(formats, origin, &patch, draw)
        }
    };
    Pair { ray, patch }
}

/// Patches and origins at the cube's corners, or up to two steps inside them.
pub fn cube_corner(formats: &Formats, draw: &mut Draw) -> Pair {
    let one = 1_i32 << formats.coord_frac_bits;
    let at = |draw: &mut Draw| {
        let bits = draw.word();
        let inset = draw.of(&[0, 0, 0, 1, 2]);
        [0, 1, 2].map(|k| if bits >> (8 * k) & 1 == 0 { -one + inset } else { one - 1 - inset })
    };
    let corners = [at(draw), at(draw), at(draw), at(draw)];
    let patch = patch(corners, draw.below(2) == 1, draw);
    let origin = if draw.below(2) == 0 { at(draw) } else { draw.signed_point(formats.coord_frac_bits) };
    let most = (1_i32 << formats.dir_frac_bits) - 1;
    let ray = match draw.below(4) {
        0 => RayWords {
            origin,
            dir: [most, 0, 0].map(|word| draw.of(&[word, most, -most, most / 2 + 1])),
            t_max: t_max(formats, draw),
        },
        _ => aim(formats, origin, &patch, draw),
    };
    Pair { ray: RayWords { dir: some_direction(ray.dir), ..ray }, patch }
}

/// Every word from the ends and the middle of its range. Directions may be shorter than normal ones.
pub fn extreme_words(formats: &Formats, draw: &mut Draw) -> Pair {
    let one = 1_i32 << formats.coord_frac_bits;
    let coordinates = [0, 1, -1, one - 1, -one, one - 2, 1 - one];
    let most = (1_i32 << formats.dir_frac_bits) - 1;
    let directions = [0, 1, -1, most, -most, most / 2 + 1, -most / 2 - 1];
    let mut point = |values: &[i32]| [0; 3].map(|_| draw.of(values));
    let (origin, dir) = (point(&coordinates), point(&directions));
    let corners = [0; 4].map(|_| point(&coordinates));
    let limit = formats.t_limit();
    let t_max = draw.of(&[limit, limit, 0, 1, limit - 1]);
    let patch = patch(corners, draw.below(2) == 1, draw);
    Pair { ray: RayWords { origin, dir: some_direction(dir), t_max }, patch }
}

/// The direction, or +x for none.
fn some_direction(dir: [i32; 3]) -> [i32; 3] {
    if dir == [0; 3] { [1, 0, 0] } else { dir }
}

/// A hit whose range ends one t word before it, at it, one after it, or elsewhere.
pub fn range_end(formats: &Formats, draw: &mut Draw) -> Pair {
    let limit = formats.t_limit();
    let mut pair = if draw.below(4) == 3 { across(formats, draw) } else { aimed(formats, draw) };
    pair.ray.t_max = limit;
    if let Some(hit) = oracle::intersect(formats, &pair.ray, &pair.patch) {
        let t = hit.t;
        pair.ray.t_max = draw.of(&[t, t.saturating_sub(1), (t + 1).min(limit), t, 0, limit]);
    }
    pair
}

/// From one face of the cube to a patch in the opposite one along the shortest normal direction: t next to 4.
fn across(formats: &Formats, draw: &mut Draw) -> Pair {
    let f = formats.coord_frac_bits;
    let one = 1_i32 << f;
    let tilt = i32::try_from(draw.below(3)).unwrap_or(0);
    let corners = [
        [one - 1, -one, -one],
        [one - 1, one - 1, -one],
        [one - 1 - tilt, one - 1, one - 1],
        [one - 1, -one, one - 1],
    ];
    let [_, y, z] = draw.signed_point(f - 1);
    let half = 1_i32 << (formats.dir_frac_bits - 1);
    let dir = [half + i32::try_from(draw.below(2)).unwrap_or(0), draw.signed(3), draw.signed(3)];
    let ray = RayWords { origin: [-one, y, z], dir, t_max: formats.t_limit() };
    Pair { ray, patch: patch(corners, draw.below(2) == 1, draw) }
}

/// The corner v0, edges u = (1, 0, p) and w = (0, 1, q): n = u x w = (-p, -q, 1), so that d_z = p d_x + q d_y + den
/// has the inner product den with it. From v0 less d, so that the corner is hit, or next to that.
pub fn tiny_den(formats: &Formats, draw: &mut Draw) -> Pair {
    let f = formats.coord_frac_bits;
    let room = f.min(formats.dir_frac_bits) - 4;
    let slope_bits = draw.below(room);
    let dir_bits = room - slope_bits;
    let den = draw.of(&[1, -1, 1, -1, 2, -2, 3]);
    let [p, q, _] = draw.signed_point(slope_bits);
    let [x, y, _] = draw.signed_point(dir_bits);
    let dir = [x, y, p * x + q * y + den];
    let (u, w) = ([1, 0, p], [0, 1, q]);
    let v0 = draw.signed_point(f - 1);
    let mut origin = plus(v0, draw.of(&[0, -1, 1]), dir);
    if draw.below(4) == 3 {
        origin[draw.below(3) as usize] += 1;
    }
    let corners = [v0, plus(v0, 1, u), plus(plus(v0, 1, u), 1, w), plus(v0, 1, w)];
    let turn = draw.below(3) as usize;
    let turned = |p: Point| [0, 1, 2].map(|k| p[(k + turn) % 3]);
    let dir = if draw.below(4) == 0 { along(formats, dir.map(i64::from)) } else { dir };
    let ray = RayWords { origin: turned(origin), dir: turned(dir), t_max: t_max(formats, draw) };
    let patch = patch(corners.map(turned), draw.below(2) == 1, draw);
    Pair { ray, patch }
}

/// Patches that have lost a triangle's area, or crossed their own edges, by quantising.
pub fn degenerate(formats: &Formats, draw: &mut Draw) -> Pair {
    let lattice = Lattice::new(formats, draw);
    let [v0, v1, v2, v3] = [lattice.at(0, 0), lattice.at(3, 0), lattice.at(3, 3), lattice.at(0, 3)];
    let corners = match draw.below(12) {
        0 => [v0; 4],
        1 => [v0, v0, v2, v3],
        2 => [v0, v1, v1, v3],
        3 => [v0, v1, v0, v3],
        4 => [v0, v1, v2, v2],
        5 => [v0, v1, v2, v0],
        6 => [v0, v1, v2, lattice.at(1, 1)],
        7 => [v0, lattice.at(2, 2), v2, v3],
        8 => [v0, lattice.at(1, 1), lattice.at(2, 2), v2],
        9 => [v0, v2, lattice.at(1, 1), lattice.at(-1, -1)],
        10 => [v0, v2, v1, v3],
        _ => [v0, v1, v3, v2],
    };
    let patch = patch(corners, draw.below(4) == 3, draw);
    let ray = match draw.below(3) {
        0 => through(formats, draw.of(&corners), draw),
        _ => {
            let origin = draw.signed_point(formats.coord_frac_bits);
            aim(formats, origin, &patch, draw)
        }
    };
    Pair { ray, patch }
}
