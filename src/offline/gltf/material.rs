//! Metallic-roughness materials and their encoded images.

use crate::material::LEAST_ALPHA;
use crate::offline::error::{Error, Result};
use crate::offline::gltf::document::Document;
use crate::reflectance::Ggx;
use glam::DVec3;
use gltf::json::{Index, texture};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Specular reflectance at normal incidence of what is no metal (glTF 2.0 specification, appendix B.2.1).
pub(super) const DIELECTRIC: f64 = 0.04;

/// The metallic-roughness part of a glTF material. Factors multiply what the textures hold.
///
/// Textures are carried, encoded as they stand in the file; scenes decode them. Emission, occlusion, transparency, sidedness,
/// samplers and texture transforms are left out.
#[derive(Clone, Debug)]
pub struct Material {
    /// The file's name for it, or `material N`.
    pub name: String,
    /// Linear Rec.709 colour and opacity.
    pub base_color: [f32; 4],
    /// 0 to 1.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// PNG or JPEG bytes: sRGB colour and linear opacity.
    pub base_color_texture: Option<Arc<Vec<u8>>>,
    /// PNG or JPEG bytes: roughness in green, metallic in blue, both linear.
    pub metallic_roughness_texture: Option<Arc<Vec<u8>>>,
    /// PNG or JPEG bytes: unit-encoded normals, green towards growing `v` of [`crate::offline::mesh::Mesh::uvs`].
    pub normal_texture: Option<Arc<Vec<u8>>>,
    /// Factor on the normal map's x and y.
    pub normal_scale: f32,
}

/// What glTF gives to primitives without a material: white, metallic and rough.
impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            base_color: [1.0; 4],
            metallic: 1.0,
            roughness: 1.0,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

impl Material {
    /// The reflectance of the factors alone: `f0` from 0.04 to the base colour and `albedo` from the base colour to 0 as
    /// `metallic` goes from 0 to 1; `alpha` is the squared roughness, at least 0.001.
    pub fn ggx(&self) -> Ggx {
        let [r, g, b, _] = self.base_color.map(f64::from);
        let (base, metallic) = (DVec3::new(r, g, b), f64::from(self.metallic));
        let alpha = f64::from(self.roughness).powi(2).clamp(LEAST_ALPHA, 1.0);
        Ggx { alpha, f0: DVec3::splat(DIELECTRIC).lerp(base, metallic), albedo: base * (1.0 - metallic) }
    }
}

/// All materials of a file.
pub(super) fn all(document: &Document) -> Result<Vec<Material>> {
    let mut images = Images { document, files: HashMap::new(), known: HashMap::new() };
    let read = |(i, keys): (usize, &gltf::json::Material)| {
        let field = format!("materials[{i}]");
        let pbr = &keys.pbr_metallic_roughness;
        let factors = [pbr.metallic_factor.0, pbr.roughness_factor.0];
        let unit = |v: &f32| (0.0..=1.0).contains(v);
        if !pbr.base_color_factor.0.iter().chain(&factors).all(unit) {
            let got = format!("{:?} and {factors:?}", pbr.base_color_factor.0);
            return Err(document.error(field, "base colour, metallic and roughness factors from 0 to 1", got));
        }
        let normal = keys.normal_texture.as_ref();
        let normal_scale = normal.map_or(1.0, |n| n.scale);
        if !normal_scale.is_finite() {
            return Err(document.error(field, "a finite normal scale", normal_scale));
        }
        let mut image = |name: &str, info: Option<(Index<texture::Texture>, u32)>| {
            info.map(|(texture, set)| images.get(&format!("{field}.{name}"), texture, set)).transpose()
        };
        let of = |info: &Option<texture::Info>| info.as_ref().map(|info| (info.index, info.tex_coord));
        Ok(Material {
            name: keys.name.clone().unwrap_or_else(|| format!("material {i}")),
            base_color: pbr.base_color_factor.0,
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            base_color_texture: image("baseColorTexture", of(&pbr.base_color_texture))?,
            metallic_roughness_texture: image("metallicRoughnessTexture", of(&pbr.metallic_roughness_texture))?,
            normal_texture: image("normalTexture", normal.map(|n| (n.index, n.tex_coord)))?,
            normal_scale,
        })
    };
    document.root.materials.iter().enumerate().map(read).collect()
}

/// Encoded images, each kept once.
struct Images<'a> {
    document: &'a Document<'a>,
    files: HashMap<PathBuf, Arc<Vec<u8>>>,
    known: HashMap<usize, Arc<Vec<u8>>>,
}

impl Images<'_> {
    /// The image of a texture over the coordinates of the given `set`, which must be the first.
    fn get(&mut self, field: &str, texture: Index<texture::Texture>, set: u32) -> Result<Arc<Vec<u8>>> {
        let document = self.document;
        if set != 0 {
            let what = format!("{}: {field}.texCoord {set}", document.path.display());
            return Err(Error::NotSupportedYet { what });
        }
        let source = document.root.get(texture).and_then(|texture| Some((texture.source, document.root.get(texture.source)?)));
        let (index, image) = source.ok_or_else(|| document.error(field, "an existing texture and image", "none"))?;
        if let Some(bytes) = self.known.get(&index.value()) {
            return Ok(Arc::clone(bytes));
        }
        let field = format!("images[{}]", index.value());
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => document.resource(&format!("{field}.uri"), uri, &mut self.files)?,
            (None, Some(view)) => Arc::new(document.view(view)?.to_vec()),
            (None, None) => return Err(document.error(field, "a uri or a buffer view", "neither")),
        };
        if !bytes.starts_with(b"\x89PNG\r\n\x1a\n") && !bytes.starts_with(b"\xff\xd8\xff") {
            return Err(document.error(field, "PNG or JPEG data", "another format"));
        }
        self.known.insert(index.value(), Arc::clone(&bytes));
        Ok(bytes)
    }
}
