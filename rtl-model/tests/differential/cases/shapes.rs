//! Parts that the classes share: points, patches, directions, ranges.

use rtl_model::datapath::{PatchWords, RayWords};
use rtl_model::fixed::Formats;

use super::Pair;
use crate::draw::Draw;

/// A point in coordinate words, before it is known to lie in the cube.
pub type Point = [i32; 3];

/// p + factor s.
pub fn plus(p: Point, factor: i32, s: Point) -> Point {
    [0, 1, 2].map(|k| p[k] + factor * s[k])
}

/// The nearest point in the cube.
pub fn clamped(formats: &Formats, p: Point) -> Point {
    let one = 1_i32 << formats.coord_frac_bits;
    p.map(|word| word.clamp(-one, one - 1))
}

/// Direction words along a vector: scaled by the power of two that puts the largest into [2^(D-1), 2^D). Exact when
/// no component has D bits or more. No direction gives +x.
pub fn along(formats: &Formats, vector: [i64; 3]) -> [i32; 3] {
    let most = vector.iter().map(|x| x.unsigned_abs()).max().unwrap_or(0);
    if most == 0 {
        return [1 << (formats.dir_frac_bits - 1), 0, 0];
    }
    let bits = 64 - most.leading_zeros();
    let scaled = |x: i64| match formats.dir_frac_bits.checked_sub(bits) {
        Some(up) => x << up,
        None => x / (1 << (bits - formats.dir_frac_bits)),
    };
    vector.map(|x| i32::try_from(scaled(x)).expect("a direction word has at most 28 bits"))
}

/// An end of the range, mostly the whole.
pub fn t_max(formats: &Formats, draw: &mut Draw) -> u64 {
    let limit = formats.t_limit();
    let share = f64::from(draw.word().unsigned_abs()) * 0.5_f64.powi(31);
    match draw.below(8) {
        0..5 => limit,
        5 => (limit as f64 * share) as u64,
        6 => (limit as f64 * share / 8.0) as u64,
        _ => draw.of(&[0, 1, 2, limit - 1]),
    }
}

/// A patch with these corners; triangles repeat the third.
pub fn patch(corners: [Point; 4], is_triangle: bool, draw: &mut Draw) -> PatchWords {
    let [v0, v1, v2, v3] = corners;
    let id = draw.of(&[7, 0, (1 << 28) - 1]);
    PatchWords { corners: [v0, v1, v2, if is_triangle { v2 } else { v3 }], is_triangle, id }
}

/// A triangle or a quad (a parallelogram, one bent by a little, any four points) of any size.
pub fn any_patch(formats: &Formats, draw: &mut Draw) -> PatchWords {
    let f = formats.coord_frac_bits;
    let v0 = draw.signed_point(f);
    // Half of them large: a random ray seldom meets a small one.
    let size = draw.below(3).max(draw.below(2) * draw.below(f));
    let (u, w) = (draw.signed_point(f - size), draw.signed_point(f - size));
    let bent = match draw.below(3) {
        0 => [0; 3],
        1 => [1, -1, 2],
        _ => u.map(|word| word / 3),
    };
    let (v1, v3) = (plus(v0, 1, u), plus(v0, 1, w));
    let v2 = plus(plus(v1, 1, w), 1, bent);
    patch([v0, v1, v2, v3].map(|v| clamped(formats, v)), draw.below(2) == 1, draw)
}

/// Any ray, any patch.
pub fn random(formats: &Formats, draw: &mut Draw) -> Pair {
    let patch = any_patch(formats, draw);
    let dir = along(formats, draw.signed_point(formats.dir_frac_bits).map(i64::from));
    let origin = draw.signed_point(formats.coord_frac_bits);
    Pair { ray: RayWords { origin, dir, t_max: t_max(formats, draw) }, patch }
}

/// Any patch, a ray toward it.
pub fn aimed(formats: &Formats, draw: &mut Draw) -> Pair {
    let patch = any_patch(formats, draw);
    let origin = draw.signed_point(formats.coord_frac_bits);
    Pair { ray: aim(formats, origin, &patch, draw), patch }
}

/// A ray toward a point of one of the patch's triangles, as close as direction words come.
pub fn aim(formats: &Formats, origin: Point, patch: &PatchWords, draw: &mut Draw) -> RayWords {
    let [v0, v1, v2, v3] = patch.corners;
    let triangle = if patch.is_triangle || draw.below(2) == 0 { [v0, v1, v2] } else { [v0, v2, v3] };
    let weights = [0; 3].map(|_| 1 + i64::from(draw.below(255)));
    let toward = [0, 1, 2].map(|k| {
        triangle
            .iter()
            .zip(weights)
            .map(|(v, weight)| weight * (i64::from(v[k]) - i64::from(origin[k])))
            .sum()
    });
    RayWords { origin, dir: along(formats, toward), t_max: t_max(formats, draw) }
}

/// A ray exactly through a point of the cube, from the point less a power of two times its direction.
pub fn through(formats: &Formats, point: Point, draw: &mut Draw) -> RayWords {
    let f = formats.coord_frac_bits;
    let most_bits = f.min(formats.dir_frac_bits);
    let bits = 1 + draw.below(most_bits);
    let most = (1 << bits) - 1;
    let mut step = draw.signed_point(bits).map(|word| word.clamp(-most, most));
    if step == [0; 3] {
        step = [1, 0, 0];
    }
    let shift = draw.below(f - bits + 1);
    let mut origin = [0; 3];
    for k in 0..3 {
        // Of both ways along an axis one stays inside the cube.
        let back = point[k] - (step[k] << shift);
        if clamped(formats, [back; 3])[0] != back {
            step[k] = -step[k];
        }
        origin[k] = point[k] - (step[k] << shift);
    }
    RayWords { origin, dir: along(formats, step.map(i64::from)), t_max: t_max(formats, draw) }
}
