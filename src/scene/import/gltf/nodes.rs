//! The nodes of the scene that is shown, each once, with their matrices.
//!
//! ```text
//! scene's roots --stack, parents' matrices times own--> (node, world matrix); a node met twice is a cycle or has two parents
//! ```

use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use gltf::json::Root;
use gltf::json::scene::Node;

use crate::scene::SceneError;

/// Nodes of the default scene, else of the first, else all that are nobody's child.
pub(super) fn visible(path: &Path, root: &Root) -> Result<Vec<(usize, DMat4)>, SceneError> {
    let scene = root.scene.and_then(|s| root.get(s)).or(root.scenes.first());
    let roots: Vec<usize> = match scene {
        Some(scene) => scene.nodes.iter().map(|n| n.value()).collect(),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                if let Some(flag) = is_child.get_mut(child.value()) {
                    *flag = true;
                }
            }
            (0..root.nodes.len()).filter(|&i| !is_child[i]).collect()
        }
    };
    let mut met = vec![false; root.nodes.len()];
    let mut stack: Vec<(usize, DMat4)> = roots.into_iter().rev().map(|n| (n, DMat4::IDENTITY)).collect();
    let mut list = Vec::new();
    while let Some((index, parent)) = stack.pop() {
        let node = root.nodes.get(index);
        let node =
            node.ok_or_else(|| SceneError::of_file(path, format!("node {index} of {}", root.nodes.len())))?;
        if std::mem::replace(&mut met[index], true) {
            let message = format!("node {index} is met twice: a cycle, or a node of two parents");
            return Err(SceneError::of_file(path, message));
        }
        let world = parent * local(node);
        if !world.is_finite() {
            return Err(SceneError::of_file(
                path,
                format!("node {index} has a transform that is not finite"),
            ));
        }
        for child in node.children.iter().flatten().rev() {
            stack.push((child.value(), world));
        }
        list.push((index, world));
    }
    Ok(list)
}

fn local(node: &Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector =
        |v: Option<[f32; 3]>, or: f64| v.map_or(DVec3::splat(or), |v| DVec3::from_array(v.map(f64::from)));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| {
        let q = DQuat::from_array(q.0.map(f64::from));
        // Single precision leaves it not quite unit.
        if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
    });
    DMat4::from_scale_rotation_translation(vector(node.scale, 1.0), rotation, vector(node.translation, 0.0))
}
