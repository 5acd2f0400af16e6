//! Textures of a scene's materials: what their keys may be, and the files.

use crate::Maps;
use crate::material::Roughness;
use crate::offline::error::{Error, Result};
use crate::offline::mesh::Mesh;
use crate::offline::scene::Scene;
use crate::offline::scene::check::{Check, span};
use crate::offline::scene::format::{Key, Material as Keys};
use crate::offline::scene::source::Span;
use crate::offline::texture::{self, Encoding, Heights, Image, Part};
use crate::offline::world::Material;
use crate::reflectance::{Model, Reflectance};
use crate::texture::Texture;
use glam::DVec2;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use toml::Spanned;

/// What the names of textures by formula begin with.
const BUILTIN: &str = "builtin:";

impl Check<'_> {
    pub(super) fn maps(&mut self, m: &Keys) -> Result<()> {
        let maps = [
            (&m.albedo_map, &texture::COLOURS[..]),
            (&m.specular_map, &texture::COLOURS),
            (&m.normal_map, &texture::NORMALS),
            (&m.height_map, &[]),
            (&m.roughness_map, &texture::CONCENTRATIONS),
        ];
        for (map, builtins) in maps {
            self.each(map, |c, v| match v.get_ref().strip_prefix(BUILTIN) {
                Some(name) if !builtins.is_empty() => c.name(&Spanned::new(v.span(), name.to_string()), builtins),
                _ => c.extension(v, &texture::EXTENSIONS).map(drop),
            })?;
        }
        let concentrations = m.roughness_map.as_ref().is_some_and(|v| v.get_ref().starts_with(BUILTIN));
        self.each(&m.roughness, |c, v| {
            let fits = !concentrations || v.get_ref() != "alpha";
            c.require(fits, &v.span(), "kappa, as built-in maps hold concentrations", "alpha")
        })?;
        self.each(&m.height_scale, |c, v| c.number(v, "a finite number", |_| true))?;
        self.each(&m.roughness, |c, v| c.name(v, &["alpha", "kappa"]))?;
        self.each(&m.normal_encoding, |c, v| c.name(v, &["auto", "unit", "signed"]))?;
        self.each(&m.normal_y, |c, v| c.name(v, &["up", "down"]))?;
        self.each(&m.tiling, |c, v| {
            let fits = v.get_ref().iter().all(|c| (1e-6..=1e6).contains(c));
            c.require(fits, &v.span(), "two numbers from 1e-6 to 1e6", format!("{:?}", v.get_ref()))
        })?;
        let needs: [(Option<Span>, &str, bool); 5] = [
            (span(&m.height_scale), "height_map", m.height_map.is_some()),
            (span(&m.displace), "height_map", m.height_map.is_some()),
            (span(&m.roughness), "roughness_map", m.roughness_map.is_some()),
            (span(&m.normal_encoding), "normal_map", m.normal_map.is_some()),
            (span(&m.normal_y), "normal_map", m.normal_map.is_some()),
        ];
        for (at, map, there) in needs {
            at.map_or(Ok(()), |at| self.require(there, &at, &format!("a {map} beside it"), "none"))?;
        }
        self.each(&m.height_map, |c, v| {
            let one = m.normal_map.is_none() || displaces(m);
            c.require(one, &v.span(), "displace = true beside a normal_map", "two maps of normals")
        })
    }
}

fn displaces(keys: &Keys) -> bool {
    keys.displace.as_ref().is_some_and(|v| *v.get_ref())
}

/// How a material moves the vertices of its objects.
pub(super) struct Displacement {
    heights: Heights,
    /// Of a height of 1, in widths of the map.
    scale: f64,
    tiling: DVec2,
}

impl Displacement {
    fn apply(&self, mesh: &mut Mesh) {
        let metres = self.scale * mesh.metres_per_uv().unwrap_or(0.0) / self.tiling.x;
        mesh.displace(|uv| self.heights.sample(uv * self.tiling) * metres);
    }
}

/// What has been read so far: each file is decoded once, and textures that are the same are shared.
#[derive(Default)]
pub(super) struct Textures {
    images: HashMap<PathBuf, Arc<Image>>,
    made: HashMap<String, Arc<Texture>>,
}

impl Textures {
    /// The maps of a checked material, and how it displaces.
    pub fn of(&mut self, scene: &Scene, keys: &Keys, model: &Model) -> Result<(Maps, Option<Displacement>)> {
        let tiling = keys.tiling.as_ref().map_or([1.0; 2], |v| *v.get_ref());
        let mut maps = Maps { tiling: tiling.map(|t| t as f32), ..Maps::default() };
        maps.albedo = self.optional(scene, &keys.albedo_map, Part::Colour, "colour", Image::colour)?;
        maps.specular = self.optional(scene, &keys.specular_map, Part::Colour, "colour", Image::colour)?;
        let roughness = self.optional(scene, &keys.roughness_map, Part::Concentration, "roughness", Image::roughness)?;
        let builtin = keys.roughness_map.as_ref().is_some_and(|v| v.get_ref().starts_with(BUILTIN));
        let kind = if builtin || is(&keys.roughness, "kappa") { Roughness::Kappa } else { Roughness::Alpha };
        maps.roughness = roughness.map(|map| (map, kind));
        let encoding = match &keys.normal_encoding {
            Some(name) if name.get_ref() == "unit" => Encoding::Unit,
            Some(name) if name.get_ref() == "signed" => Encoding::Signed,
            _ => Encoding::Auto,
        };
        let up = !is(&keys.normal_y, "down");
        let use_ = format!("normals {encoding:?} {up}");
        maps.normal = self.optional(scene, &keys.normal_map, Part::Normal, &use_, |image| image.normals(encoding, up, 1.0))?;
        let mut displacement = None;
        if let Some(file) = &keys.height_map {
            let scale = keys.height_scale.as_ref().map_or(1.0, |v| *v.get_ref());
            if displaces(keys) {
                let heights = self.image(scene, file, Part::Colour)?.heights()?;
                displacement = Some(Displacement { heights, scale, tiling: DVec2::from(tiling) });
            } else {
                let path = scene.folder.join(file.get_ref());
                let normals = |image: &Image| image.heights()?.normals(scale).map_err(|e| texture::refused(&path, e));
                maps.normal = Some(self.texture(scene, file, Part::Colour, &format!("heights {scale}"), normals)?);
            }
        }
        let material = crate::Material::new(model.clone(), maps);
        material.validate().map_err(|e| invalid(scene, keys, e))?;
        Ok((material.maps, displacement))
    }

    fn optional(
        &mut self,
        scene: &Scene,
        file: &Key<String>,
        part: Part,
        use_: &str,
        make: impl FnOnce(&Image) -> Result<Texture>,
    ) -> Result<Option<Arc<Texture>>> {
        file.as_ref().map(|file| self.texture(scene, file, part, use_, make)).transpose()
    }

    fn texture(
        &mut self,
        scene: &Scene,
        file: &Spanned<String>,
        part: Part,
        use_: &str,
        make: impl FnOnce(&Image) -> Result<Texture>,
    ) -> Result<Arc<Texture>> {
        let key = format!("{use_} {}", file.get_ref());
        if let Some(texture) = self.made.get(&key) {
            return Ok(Arc::clone(texture));
        }
        let texture = Arc::new(make(self.image(scene, file, part)?.as_ref())?);
        self.made.insert(key, Arc::clone(&texture));
        Ok(texture)
    }

    fn image(&mut self, scene: &Scene, file: &Spanned<String>, part: Part) -> Result<Arc<Image>> {
        if let Some(name) = file.get_ref().strip_prefix(BUILTIN) {
            return Image::builtin(name, part).map(Arc::new);
        }
        let path = scene.folder.join(file.get_ref());
        if let Some(image) = self.images.get(&path) {
            return Ok(Arc::clone(image));
        }
        let image = Arc::new(Image::read(&path)?);
        self.images.insert(path, Arc::clone(&image));
        Ok(image)
    }
}

fn is(key: &Key<String>, name: &str) -> bool {
    key.as_ref().is_some_and(|v| v.get_ref() == name)
}

/// What a material refuses, as an error of the key that brought it.
fn invalid(scene: &Scene, keys: &Keys, error: crate::Error) -> Error {
    let crate::Error::InvalidInput { field, expected, got } = error else { return error.into() };
    let key = match field.as_str() {
        "maps.albedo" => span(&keys.albedo_map),
        "maps.specular" => span(&keys.specular_map),
        "maps.roughness" => span(&keys.roughness_map),
        "maps.normal" => span(&keys.normal_map),
        _ => span(&keys.tiling),
    };
    scene.source.error(&key.unwrap_or(keys.reflectance.span()), expected, got)
}

/// Refuses a mesh without the texture coordinates that a material's maps need; `Err` says what it lacks.
pub(super) fn fits(
    mesh: &Mesh,
    material: &Material,
    displacement: Option<&Displacement>,
) -> std::result::Result<(), &'static str> {
    if !mesh.has_uvs && (!material.maps.is_empty() || displacement.is_some()) {
        return Err("no texture coordinates");
    }
    if displacement.is_some() && mesh.metres_per_uv().is_none() {
        return Err("texture coordinates without an area");
    }
    Ok(())
}

/// Moves the vertices of a mesh that fits, and computes the tangents that its material wants unless there are some.
pub(super) fn prepare(mesh: &mut Mesh, material: &Material, displacement: Option<&Displacement>) {
    if let Some(displacement) = displacement {
        displacement.apply(mesh);
    }
    if mesh.tangents.is_empty() && wants_tangents(material) {
        mesh.compute_tangents();
    }
}

/// Whether what is shaded depends on the way that the surface is turned.
pub(super) fn wants_tangents(material: &Material) -> bool {
    material.maps.normal.is_some() || !material.model.isotropic()
}
