//! The nodes of a glTF scene, flattened.

use crate::offline::error::Result;
use crate::offline::gltf::document::Document;
use crate::offline::gltf::primitive;
use crate::offline::mesh::Mesh;
use crate::offline::world::Camera;
use glam::{DMat4, DQuat, DVec3};
use gltf::json::scene::{Node, UnitQuaternion};

/// Vertices and corners that any file may have after flattening, and how many more for each byte of its buffers. A mesh
/// that is there once has at most one vertex and one corner a byte; many nodes may share one.
const ALWAYS_ALLOWED: u64 = 1 << 20;
const MOST_PER_BYTE: u64 = 16;

/// A scene's triangles in world space, with the indices of their materials.
pub(super) struct Flat {
    pub primitives: Vec<(Mesh, Option<usize>)>,
    pub camera: Option<Camera>,
}

/// Walks the default scene, the first one if there is none, or all nodes without a parent if there is no scene.
pub(super) fn flatten(document: &Document) -> Result<Flat> {
    let root = &document.root;
    let scene = root.scene.and_then(|index| root.get(index)).or(root.scenes.first());
    let mut stack: Vec<(usize, DMat4)> = match scene {
        Some(scene) => scene.nodes.iter().rev().map(|node| (node.value(), DMat4::IDENTITY)).collect(),
        None => {
            let mut has_parent = vec![false; root.nodes.len()];
            for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
                has_parent.get_mut(child.value()).into_iter().for_each(|slot| *slot = true);
            }
            (0..root.nodes.len()).rev().filter(|i| has_parent.get(*i) == Some(&false)).map(|i| (i, DMat4::IDENTITY)).collect()
        }
    };
    let bytes = document.buffers.iter().map(|b| b.len() as u64).sum::<u64>();
    let most = ALWAYS_ALLOWED + MOST_PER_BYTE * bytes;
    let mut size = 0;
    let mut seen = vec![false; root.nodes.len()];
    let mut flat = Flat { primitives: Vec::new(), camera: None };
    while let Some((index, parent)) = stack.pop() {
        let field = format!("nodes[{index}]");
        let (Some(node), Some(seen)) = (root.nodes.get(index), seen.get_mut(index)) else {
            return Err(document.error(field, format!("an index below {}", root.nodes.len()), index));
        };
        if std::mem::replace(seen, true) {
            return Err(document.error(field, "one parent, and no cycle", "it is reached twice"));
        }
        let world = parent * local(node);
        if !world.is_finite() {
            return Err(document.error(field, "a finite transform", "another"));
        }
        if flat.camera.is_none() {
            flat.camera = camera(document, node, world)?;
        }
        let mesh = node.mesh.and_then(|index| Some((index.value(), root.get(index)?)));
        for (i, primitive) in mesh.iter().flat_map(|(_, mesh)| mesh.primitives.iter().enumerate()) {
            let field = format!("meshes[{}].primitives[{i}]", mesh.map_or(0, |(index, _)| index));
            let Some(mesh) = primitive::read(document, &field, primitive, world)? else { continue };
            size += (mesh.positions.len() + mesh.indices.len()) as u64;
            if size > most {
                let expected = format!("at most {most} vertices and corners from {bytes} bytes of buffers");
                return Err(document.error("nodes", expected, "more instances"));
            }
            if mesh.indices.len() >= 3 {
                flat.primitives.push((mesh, primitive.material.map(|m| m.value())));
            }
        }
        stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), world)));
    }
    if flat.primitives.is_empty() {
        return Err(document.error("meshes", "at least one triangle in the scene", "none"));
    }
    Ok(flat)
}

/// Parent from node.
fn local(node: &Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
    let UnitQuaternion(rotation) = node.rotation.unwrap_or_default();
    let rotation = glam::DVec4::from(rotation.map(f64::from)).try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4);
    DMat4::from_scale_rotation_translation(vector(node.scale, DVec3::ONE), rotation, vector(node.translation, DVec3::ZERO))
}

/// The node's perspective camera, which looks along its own -Z.
fn camera(document: &Document, node: &Node, world: DMat4) -> Result<Option<Camera>> {
    let keys = node.camera.and_then(|index| Some((index.value(), document.root.get(index)?.perspective.as_ref()?)));
    let Some((index, keys)) = keys else { return Ok(None) };
    let fov_y = f64::from(keys.yfov).to_degrees();
    let position = world.transform_point3(DVec3::ZERO);
    let forward = world.transform_vector3(DVec3::NEG_Z).try_normalize();
    let up = world.transform_vector3(DVec3::Y).try_normalize();
    match (forward, up) {
        (Some(forward), Some(up)) if fov_y > 0.0 && fov_y < 180.0 && forward.cross(up).length() > 1e-6 => {
            Ok(Some(Camera { position, target: position + forward, up, fov_y }))
        }
        _ => {
            let expected = "a field of view between 0 and pi, and a direction to look in";
            Err(document.error(format!("cameras[{index}]"), expected, format!("yfov {}", keys.yfov)))
        }
    }
}
