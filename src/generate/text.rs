//! A scene as it is being made, and its text.
//!
//! ```text
//! SceneText: camera, materials, quads in whole micrometres --write--> TOML of format version 1
//! ```
//! Whole micrometres make points exact: what touches shares its coordinates, opposite edges of a parallelogram are
//! equal, and the text is the same on every machine. Format: scenes/README.md.

use std::fmt::Write as _;

use glam::IVec3;

/// Micrometres in a metre.
const UM_PER_M: i32 = 1_000_000;

/// A length in whole micrometres.
pub(super) const fn mm(millimetres: i32) -> i32 {
    1000 * millimetres
}

/// How a material of a generated scene treats light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Light {
    /// Diffuse reflectance of each channel.
    Reflects([f64; 3]),
    /// Warm white light of so many lumens from each surface; reflects nothing.
    ShinesLumens(u32),
}

/// One surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Quad {
    /// Unique name.
    pub(super) name: String,
    /// Name of a material.
    pub(super) material: &'static str,
    /// Corners (um), counter-clockwise from the front.
    pub(super) corners: [IVec3; 4],
    /// Both sides reflect.
    pub(super) two_sided: bool,
    /// Non-zero: continues neighbours of the same group.
    pub(super) smooth_group: u32,
}

impl Quad {
    /// A one-sided surface with edges that end its light.
    pub(super) fn new(name: String, material: &'static str, corners: [IVec3; 4]) -> Quad {
        Quad { name, material, corners, two_sided: false, smooth_group: 0 }
    }
}

/// A camera that holds its head upright (z up).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Camera {
    /// Where it is (um).
    pub(super) eye: IVec3,
    /// What is in the middle of the picture (um).
    pub(super) target: IVec3,
    /// Vertical field of view (degrees).
    pub(super) fov_y_deg: u32,
}

/// A scene that can be written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SceneText {
    /// What it is, for the first lines of the file.
    pub(super) about: String,
    /// The view.
    pub(super) camera: Camera,
    /// Materials by name.
    pub(super) materials: Vec<(&'static str, Light)>,
    /// Wanted mesh elements.
    pub(super) elements: u32,
    /// Surfaces.
    pub(super) quads: Vec<Quad>,
}

impl SceneText {
    /// The scene file, which names the command that makes it again.
    pub(super) fn write(&self, command: &str) -> String {
        let mut out = String::with_capacity(512 + 200 * self.quads.len());
        for line in self.about.lines() {
            let _ = writeln!(out, "# {line}");
        }
        let _ = writeln!(out, "# Made by: {command}");
        let Camera { eye, target, fov_y_deg } = self.camera;
        let _ = writeln!(
            out,
            "version = 1\n\n[camera]\neye = {}\ntarget = {}\nup = [0.0, 0.0, 1.0]\nfov_y_deg = {fov_y_deg}.0",
            point(eye),
            point(target)
        );
        for (name, light) in &self.materials {
            let _ = writeln!(out, "\n[materials.{name}]");
            let _ = match light {
                Light::Reflects([r, g, b]) if r == g && g == b => writeln!(out, "reflectance = {r:?}"),
                Light::Reflects(rgb) => writeln!(out, "reflectance = {rgb:?}"),
                Light::ShinesLumens(lumens) => {
                    writeln!(out, "lumens = {lumens}.0\ncolor = [1.0, 0.93, 0.82]")
                }
            };
        }
        let _ = writeln!(out, "\n[meshing]\nelements = {}", self.elements);
        for quad in &self.quads {
            let _ = writeln!(
                out,
                "\n[[surface]]\nname = \"{}\"\nmaterial = \"{}\"\nquad = [{}]",
                quad.name,
                quad.material,
                quad.corners.map(point).join(", ")
            );
            if quad.two_sided {
                out.push_str("two_sided = true\n");
            }
            if quad.smooth_group != 0 {
                let _ = writeln!(out, "smooth_group = {}", quad.smooth_group);
            }
        }
        out
    }
}

/// `[x, y, z]` in metres.
fn point(p: IVec3) -> String {
    format!("[{}, {}, {}]", metres(p.x), metres(p.y), metres(p.z))
}

/// A length in metres: every digit that it has and at least one behind the point.
fn metres(um: i32) -> String {
    let sign = if um < 0 { "-" } else { "" };
    let um = um.unsigned_abs();
    let (whole, rest) = (um / UM_PER_M as u32, um % UM_PER_M as u32);
    let digits = format!("{rest:06}");
    let digits = digits.trim_end_matches('0');
    format!("{sign}{whole}.{}", if digits.is_empty() { "0" } else { digits })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metres_of_micrometres_are_exact_and_short() {
        let cases = [
            (0, "0.0"),
            (1, "0.000001"),
            (-1, "-0.000001"),
            (2_050_000, "2.05"),
            (-7_000_000, "-7.0"),
            (i32::MIN, "-2147.483648"),
        ];
        for (um, text) in cases {
            assert_eq!(metres(um), text);
            assert_eq!(text.parse::<f64>().unwrap(), f64::from(um) / 1e6);
        }
    }
}
