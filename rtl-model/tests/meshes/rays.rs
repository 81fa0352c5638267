//! Rays from inside a mesh at its corners, at points of its edges and anywhere.
//!
//! ```text
//! aimed: origin inside, point -> raw = point - origin -> direction words by the board's rule, rounded
//! exact: point, short integer direction g -> origin = point - m g, inside -> direction words g 2^k, not rounded
//! ```
//! A point of an edge need not be a word: it has [`EDGE_LOG2`] more fraction bits.

use rtl_model::datapath::RayWords;
use rtl_model::fixed::Formats;

use super::Mesh;
use super::inside::is_inside;
use super::random::Random;

/// Fraction bits of a place on an edge.
pub const EDGE_LOG2: u32 = 4;

/// What a ray is aimed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A corner.
    Vertex,
    /// A point between the ends of an edge, a quad's diagonal included.
    Edge,
    /// No matter where.
    Anywhere,
}

impl Target {
    /// All of them.
    pub const ALL: [Target; 3] = [Target::Vertex, Target::Edge, Target::Anywhere];
}

/// Direction words by the board's rule: scaled by a power of two so that the largest lies in [2^(D-1), 2^D), rounded to
/// nearest even. `None` for a zero direction.
pub fn direction_words(raw: [i64; 3], dir_frac_bits: u32) -> Option<[i32; 3]> {
    let most = raw.iter().map(|w| w.unsigned_abs()).max().filter(|most| *most > 0)?;
    let length = i32::try_from(u64::BITS - most.leading_zeros()).ok()?;
    // Exact: words under 2^53, powers of two.
    let words = |length: i32| {
        let scale = f64::from(dir_frac_bits.cast_signed() - length).exp2();
        raw.map(|w| (w as f64 * scale).round_ties_even() as i32)
    };
    let plain = words(length);
    let too_long = plain.iter().any(|w| w.unsigned_abs() >> dir_frac_bits != 0);
    Some(if too_long { words(length + 1) } else { plain })
}

/// A ray from a point inside at a target, direction rounded to D bits: it passes near the target.
pub fn aimed(
    formats: &Formats,
    mesh: &Mesh,
    origin: [i32; 3],
    target: Target,
    random: &mut Random,
) -> Option<RayWords> {
    let raw = match target {
        Target::Vertex => minus(mesh.vertices[random.below(mesh.vertices.len())], origin),
        Target::Edge => {
            let [p, q] = mesh.edge(random).map(|corner| minus(corner, origin));
            let place = random.integer(1, (1 << EDGE_LOG2) - 1);
            [0, 1, 2].map(|k| (p[k] << EDGE_LOG2) + place * (q[k] - p[k]))
        }
        Target::Anywhere => {
            let most = 1_i64 << formats.dir_frac_bits;
            [(); 3].map(|()| random.integer(-most, most))
        }
    };
    let dir = direction_words(raw, formats.dir_frac_bits)?;
    Some(RayWords { origin, dir, t_max: formats.t_limit() })
}

/// A ray that passes exactly through a corner or a whole-word point of an edge: from `base`, moved until the direction
/// has few enough bits. `None` when the moved origin is not inside, or the edge has no such point.
pub fn exact(
    formats: &Formats,
    mesh: &Mesh,
    base: [i32; 3],
    target: Target,
    random: &mut Random,
) -> Option<RayWords> {
    let point = match target {
        Target::Edge => {
            let [p, q] = mesh.edge(random);
            let along = minus(q, p);
            let parts = along.iter().fold(0, |g, w| gcd(g, w.unsigned_abs())).cast_signed();
            if parts < 2 {
                return None;
            }
            let place = random.integer(1, parts - 1);
            [0, 1, 2].map(|k| i64::from(p[k]) + place * (along[k] / parts))
        }
        Target::Vertex | Target::Anywhere => mesh.vertices[random.below(mesh.vertices.len())].map(i64::from),
    };
    let raw = [0, 1, 2].map(|k| point[k] - i64::from(base[k]));
    let bits = u32::try_from(random.integer(3, i64::from(formats.dir_frac_bits))).ok()?;
    let short = direction_words(raw, bits)?;
    let most = |words: [i64; 3]| words.into_iter().map(i64::abs).max().unwrap_or(0);
    let times = (most(raw) / most(short.map(i64::from))).max(1);
    let cube = 1_i64 << formats.coord_frac_bits;
    let origin = [0, 1, 2].map(|k| point[k] - times * i64::from(short[k]));
    if origin.iter().any(|w| !(-cube..cube).contains(w)) {
        return None;
    }
    let origin = origin.map(|w| i32::try_from(w).expect("inside the cube"));
    let dir = short.map(|w| w << (formats.dir_frac_bits - bits));
    is_inside(mesh, origin, random).then_some(RayWords { origin, dir, t_max: formats.t_limit() })
}

fn minus(p: [i32; 3], q: [i32; 3]) -> [i64; 3] {
    [0, 1, 2].map(|k| i64::from(p[k]) - i64::from(q[k]))
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
