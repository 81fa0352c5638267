//! Triangles of a mesh primitive, in the scene's metres.
//!
//! ```text
//! POSITION, NORMAL, indices, mode --strips and fans unrolled--> corners; a mirroring node turns them around
//! ```

use std::collections::HashMap;

use glam::{DMat4, DVec3};
use gltf::json::Index;
use gltf::json::accessor::{Accessor, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::File;
use super::accessor::Values;
use crate::scene::MAX_FACES;
use crate::scene::faces::RawFaces;

/// Appends the triangles; how many, or `None` for points and lines. `n_before` were read from the file already.
pub(super) fn append(
    file: &File<'_>,
    primitive: &Primitive,
    world: &DMat4,
    faces: &mut RawFaces,
    n_before: usize,
) -> Result<Option<usize>, String> {
    let Checked::Valid(mode) = primitive.mode else { return Err("no valid mode".to_owned()) };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let positions = attribute(Semantic::Positions).ok_or("no POSITION")?;
    let positions = Values::new(file, positions, Type::Vec3)?;
    let of = |index: Index<Accessor>| Values::new(file, index, Type::Vec3);
    let normals = attribute(Semantic::Normals).map(of).transpose()?;
    if let Some(n) = normals.as_ref().filter(|n| n.len() != positions.len()) {
        return Err(format!("{} normals of {} positions", n.len(), positions.len()));
    }
    let indices = primitive.indices.map(|i| Values::new(file, i, Type::Scalar)).transpose()?;
    if indices.as_ref().is_some_and(|i| !i.is_unsigned()) {
        return Err("indices that are not unsigned whole numbers".to_owned());
    }
    let n_corners = indices.as_ref().map_or(positions.len(), Values::len);
    let n = match mode {
        Mode::Triangles => n_corners / 3,
        _ => n_corners.saturating_sub(2),
    };
    if n_before + n > MAX_FACES {
        return Err(format!("more than {MAX_FACES} triangles, the limit of imported meshes"));
    }
    let corner = |k: usize| -> Result<usize, String> {
        let index = indices.as_ref().map_or(k, |values| values.get(k)[0] as usize);
        if index < positions.len() {
            return Ok(index);
        }
        Err(format!("index {index} of {} positions", positions.len()))
    };
    let mirrored = world.determinant() < 0.0;
    // Many primitives may share one accessor: each takes the points that it uses, no more.
    let mut taken: HashMap<usize, u32> = HashMap::new();
    for t in 0..n {
        let [a, b, c] = match mode {
            Mode::Triangles => [3 * t, 3 * t + 1, 3 * t + 2],
            Mode::TriangleStrip => [t, t + 1 + t % 2, t + 2 - t % 2],
            _ => [0, t + 1, t + 2],
        };
        for k in if mirrored { [a, c, b] } else { [a, b, c] } {
            let index = corner(k)?;
            let id = match taken.get(&index) {
                Some(&id) => id,
                None => {
                    let [x, y, z, _] = positions.get(index);
                    let p = DVec3::new(x, y, z);
                    if !p.is_finite() {
                        return Err(format!("position {index} is {p}, expected finite numbers"));
                    }
                    let id = faces.points.len() as u32;
                    faces.points.push(world.transform_point3(p));
                    if let Some(normals) = &normals {
                        // Only compared with each other: they stay as they are in the node. As many as points.
                        let [x, y, z, _] = normals.get(index);
                        faces.normals.resize(id as usize, DVec3::ZERO);
                        faces.normals.push(DVec3::new(x, y, z));
                    }
                    taken.insert(index, id);
                    id
                }
            };
            faces.corners.push(id);
            faces.corner_normals.push(if normals.is_some() { id } else { u32::MAX });
        }
    }
    Ok(Some(n))
}
