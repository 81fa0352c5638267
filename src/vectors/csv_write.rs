//! Vectors to text: a record a line, its kind in the first field, all values whole numbers in decimal.

use std::fmt::Write as _;

use rtl_model::datapath::{Facing, HitWords};

use super::{Expected, RayVector, TestVector, Vectors, wire_names, wire_values};

/// Version of the text.
pub(super) const VERSION: u32 = 1;

/// What stands at the top of every file, for readers without this source.
const GUIDE: &str = "\
# Test vectors of the radiosity engine's board: a record a line, its kind first; # starts a comment.
#
# formats,F,D,T,K,rounding          fraction bits of coordinates, directions, t and kept edge normals (full: all 2F);
#                                   rounding nearest-even, half-away or floor
# grid,G                            the board's grid has 2^G cells a side. Where K is full no answer depends on it; where
#                                   K < 2F rounding may move a patch's edge out of the cells that list the patch, and
#                                   an answer is over the patches that the cells on the ray's way list
# patch,id,triangle|quad,x0,y0,z0,x1,y1,z1,x2,y2,z2[,x3,y3,z3]
#                                   corners, words of 2^-F in [-2^F, 2^F); a quad is the triangles 012 and 023
# ray,nearest,ox,oy,oz,dx,dy,dz,t_max[,miss | ,t,patch,front|back]
# ray,any,ox,oy,oz,dx,dy,dz,t_max[,miss | ,hit]
#                                   origin as corners; direction words of 2^-D, magnitudes under 2^D; t words of 2^-T
#                                   up to 4 2^T; then the expected answer, if any. Nearest: smallest (t, patch id)
# test,ray,patch,miss,-,wires...    one ray (number of its row, from 0) with one patch (its id), answer and wires:
# test,ray,patch,t,front|back,wires...
# end,patches,rays,tests            how many of each stand above; without this last record the file was cut off
";

/// The file's text.
pub fn to_csv(vectors: &Vectors) -> String {
    let mut out = format!("{GUIDE}#   of a quad     {}\n", wire_names(false).join(","));
    // Writing to a String cannot fail.
    let _ = writeln!(out, "#   of a triangle {}", wire_names(true).join(","));
    let _ = writeln!(out, "vectors,{VERSION}");
    let f = &vectors.formats;
    let keep = f.cross_keep_bits.map_or("full".to_owned(), |k| k.to_string());
    let rounding = rounding_name(f.rounding);
    let (coord, dir, t) = (f.coord_frac_bits, f.dir_frac_bits, f.t_frac_bits);
    let _ = writeln!(out, "formats,{coord},{dir},{t},{keep},{rounding}");
    if let Some(grid_log2) = vectors.grid_log2 {
        let _ = writeln!(out, "grid,{grid_log2}");
    }
    for patch in &vectors.patches {
        let (kind, n) = if patch.is_triangle { ("triangle", 3) } else { ("quad", 4) };
        let _ = write!(out, "patch,{},{kind}", patch.id);
        words(&mut out, patch.corners[..n].as_flattened());
        out.push('\n');
    }
    for ray in &vectors.rays {
        ray_line(&mut out, ray);
    }
    for test in &vectors.tests {
        test_line(&mut out, vectors, test);
    }
    let counts = [vectors.patches.len(), vectors.rays.len(), vectors.tests.len()];
    out.push_str("end");
    words(&mut out, &counts);
    out.push('\n');
    out
}

/// The word for a rounding mode, as in board files.
pub fn rounding_name(rounding: rtl_model::fixed::Rounding) -> &'static str {
    ROUNDINGS.iter().find(|(_, mode)| *mode == rounding).map_or("nearest-even", |(name, _)| *name)
}

/// The rounding modes by name.
pub(super) const ROUNDINGS: [(&str, rtl_model::fixed::Rounding); 3] = [
    ("nearest-even", rtl_model::fixed::Rounding::NearestEven),
    ("half-away", rtl_model::fixed::Rounding::HalfAway),
    ("floor", rtl_model::fixed::Rounding::Floor),
];

fn words<T: std::fmt::Display>(out: &mut String, values: &[T]) {
    for value in values {
        let _ = write!(out, ",{value}");
    }
}

fn ray_line(out: &mut String, ray: &RayVector) {
    out.push_str(if ray.any_hit { "ray,any" } else { "ray,nearest" });
    words(out, &ray.words.origin);
    words(out, &ray.words.dir);
    let _ = write!(out, ",{}", ray.words.t_max);
    match ray.expected {
        None => {}
        Some(Expected::Any(hit)) => out.push_str(if hit { ",hit" } else { ",miss" }),
        Some(Expected::Nearest(None)) => out.push_str(",miss"),
        Some(Expected::Nearest(Some(HitWords { t, patch, facing }))) => {
            let _ = write!(out, ",{t},{patch},{}", side(facing));
        }
    }
    out.push('\n');
}

fn test_line(out: &mut String, vectors: &Vectors, test: &TestVector) {
    let id = vectors.patches.get(test.patch).map_or(0, |p| p.id);
    let _ = write!(out, "test,{},{id}", test.ray);
    // The patch that is tested is the one that is hit.
    let _ = match test.hit {
        None => write!(out, ",miss,-"),
        Some(HitWords { t, facing, .. }) => write!(out, ",{t},{}", side(facing)),
    };
    words(out, &wire_values(&test.wires));
    out.push('\n');
}

/// A side as the files call it.
pub fn side(facing: Facing) -> &'static str {
    match facing {
        Facing::Front => "front",
        Facing::Back => "back",
    }
}
