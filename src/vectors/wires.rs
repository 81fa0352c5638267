//! The wires of a ray x patch test as one list, in the order of the files.
//!
//! ```text
//! a0 a1 a2 a3 (x y z each), c01 c12 c02 c23 c30 (x y z each), e01 e12 e02 e23 e30,
//! per triangle: inside (0 or 1), n (x y z), den, num, and divisor and dividend: den_shifted, num_shifted
//! ```
//! A triangle's edges are 01, 12, 20, so its c02 and e02 hold those of edge 20, its 23 and 30 zeros; a3 repeats a2.

use rtl_model::datapath::ray_patch::Taps;
use rtl_model::oracle::{TriangleWires, Wires};

/// Wires before those of the triangles.
const N_SHARED: usize = 12 + 15 + 5;
/// Wires of a triangle.
const N_TRIANGLE: usize = 8;

/// Wires of a test: 40 of a triangle, 48 of a quad.
pub(super) fn n_wires(is_triangle: bool) -> usize {
    N_SHARED + if is_triangle { N_TRIANGLE } else { 2 * N_TRIANGLE }
}

/// The names of the wires of a patch, in order.
pub fn wire_names(is_triangle: bool) -> Vec<String> {
    let edges = if is_triangle { ["01", "12", "20", "23", "30"] } else { ["01", "12", "02", "23", "30"] };
    let vector = |name: String| ["x", "y", "z"].map(|axis| format!("{name}.{axis}"));
    let mut names: Vec<String> = (0..4).flat_map(|i| vector(format!("a{i}"))).collect();
    names.extend(edges.iter().flat_map(|edge| vector(format!("c{edge}"))));
    names.extend(edges.iter().map(|edge| format!("e{edge}")));
    let triangles: &[&str] = if is_triangle { &["012"] } else { &["012", "023"] };
    for triangle in triangles {
        names.push(format!("inside{triangle}"));
        names.extend(vector(format!("n{triangle}")));
        names.extend(["den", "num", "den_shifted", "num_shifted"].map(|wire| format!("{wire}{triangle}")));
    }
    names
}

/// The values of the wires, in order.
pub fn wire_values(wires: &Wires) -> Vec<i128> {
    let mut values: Vec<i128> = wires.a.as_flattened().iter().map(|w| i128::from(*w)).collect();
    values.extend(wires.c.as_flattened());
    values.extend(wires.e);
    for t in wires.triangles.iter().flatten() {
        values.push(i128::from(t.inside));
        values.extend(t.n);
        values.extend([t.den, t.num, t.den_shifted, t.num_shifted]);
    }
    values
}

/// Wires from their values; the name of the first wire that cannot have its value where there is one.
pub(super) fn from_values(is_triangle: bool, values: &[i128]) -> Result<Wires, (usize, &'static str)> {
    if values.len() != n_wires(is_triangle) {
        return Err((values.len().min(n_wires(is_triangle)), "one value a wire"));
    }
    let mut a = [[0; 3]; 4];
    for (i, value) in values[..12].iter().enumerate() {
        a[i / 3][i % 3] = i64::try_from(*value).map_err(|_| (i, "a whole number of 64 bits"))?;
    }
    let mut c = [[0; 3]; 5];
    c.as_flattened_mut().copy_from_slice(&values[12..27]);
    let mut e = [0; 5];
    e.copy_from_slice(&values[27..N_SHARED]);
    let triangle = |at: usize| {
        let inside = match values[at] {
            0 => false,
            1 => true,
            _ => return Err((at, "0 or 1")),
        };
        let n = [values[at + 1], values[at + 2], values[at + 3]];
        let [den, num, den_shifted, num_shifted] = [4, 5, 6, 7].map(|k| values[at + k]);
        Ok(TriangleWires { inside, n, den, num, num_shifted, den_shifted })
    };
    let second = if is_triangle { None } else { Some(triangle(N_SHARED + N_TRIANGLE)?) };
    Ok(Wires { a, c, e, triangles: [Some(triangle(N_SHARED)?), second] })
}

/// The board's taps as wires.
pub fn board_wires(taps: &Taps) -> Wires {
    Wires {
        a: taps.a,
        c: taps.c.map(|normal| normal.map(i128::from)),
        e: taps.e,
        triangles: taps.triangles.map(|t| {
            t.map(|t| TriangleWires {
                inside: t.inside,
                n: t.n.map(i128::from),
                den: t.den,
                num: t.num,
                num_shifted: t.num_shifted,
                den_shifted: t.den_shifted,
            })
        }),
    }
}
