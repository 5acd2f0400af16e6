//! glTF 2.0 and GLB, through the `gltf` crate: geometry with its node transforms flattened, metallic-roughness materials
//! and the first perspective camera. Skins, morph targets and animations stay in their rest pose; points and lines are left
//! out; files that require an extension are refused. External files must lie in the file's own folder or below.
//!
//! glTF's `v` grows downwards and ours upwards, so coordinates are flipped on the way in; tangents need no change, as glTF
//! gives them for a `v` that grows upwards.

use crate::offline::error::{At, Error, Result};
use crate::offline::mesh::Mesh;
use crate::offline::world::Camera;
use std::path::Path;

mod buffers;
mod document;
mod material;
mod nodes;
mod primitive;
mod shading;

pub use material::Material;
pub(crate) use shading::shaded;

/// A part of the model with one material.
#[derive(Clone, Debug)]
pub struct Primitive {
    /// Its geometry in the file's world space.
    pub mesh: Mesh,
    /// Index into [`Model::materials`].
    pub material: usize,
}

/// What a glTF file holds.
#[derive(Clone, Debug)]
pub struct Model {
    /// At least one, in the order of the default scene's nodes.
    pub primitives: Vec<Primitive>,
    /// The file's materials; where primitives have none, glTF's default is the last.
    pub materials: Vec<Material>,
    /// The first perspective camera among the nodes.
    pub camera: Option<Camera>,
}

/// Reads a `.glb` or `.gltf` file with its materials and the encoded images that they name.
///
/// # Errors
/// [`Error::File`] names the entry that is malformed, missing, out of range or outside of the file's folder; also for
/// instances that would take far more memory than the file.
pub fn read(path: &Path) -> Result<Model> {
    let document = document::Document::read(path)?;
    let scene = nodes::flatten(&document)?;
    let mut materials = material::all(&document)?;
    let fallback = materials.len();
    let place = |material: Option<usize>| material.unwrap_or(fallback);
    let primitives: Vec<_> =
        scene.primitives.into_iter().map(|(mesh, material)| Primitive { mesh, material: place(material) }).collect();
    if primitives.iter().any(|p| p.material == fallback) {
        materials.push(Material::default());
    }
    Ok(Model { primitives, materials, camera: scene.camera })
}

/// Reads all primitives of a `.glb` or `.gltf` file as one mesh, without materials and images. It has texture coordinates,
/// and tangents, if all of them do.
///
/// # Errors
/// As for [`read`].
pub fn read_mesh(path: &Path) -> Result<Mesh> {
    let scene = nodes::flatten(&document::Document::read(path)?)?;
    let mut merged = Mesh { has_uvs: true, ..Default::default() };
    let mut has_tangents = true;
    for (mesh, _) in scene.primitives {
        let first = u32::try_from(merged.positions.len());
        let first = first.map_err(|_| Error::file(path, At::File, "vertices", "fewer than 2^32", "more"))?;
        merged.has_uvs &= mesh.has_uvs;
        has_tangents &= !mesh.tangents.is_empty();
        merged.indices.extend(mesh.indices.iter().map(|i| i.saturating_add(first)));
        merged.positions.extend(mesh.positions);
        merged.normals.extend(mesh.normals);
        merged.uvs.extend(mesh.uvs);
        merged.tangents.extend(mesh.tangents);
    }
    if !merged.has_uvs {
        merged.uvs.fill([0.0; 2]);
    }
    if !merged.has_uvs || !has_tangents {
        merged.tangents.clear();
    }
    Ok(merged)
}
