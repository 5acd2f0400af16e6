//! Metallic-roughness materials as GGX with maps.

use crate::Maps;
use crate::material::Roughness;
use crate::offline::error::Result;
use crate::offline::gltf::material::{DIELECTRIC, Material};
use crate::offline::texture::{Encoding, Image, refused};
use crate::offline::world;
use crate::reflectance::{Ggx, Model};
use crate::texture::Texture;
use glam::{DVec2, DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The materials of the file `path` as they are shaded: one GGX each, with `albedo = base (1 - metallic)`,
/// `f0 = mix(0.04, base, metallic)` and `alpha = roughness^2` (glTF 2.0 specification, appendix B.2), texel by texel where
/// there are textures.
///
/// # Errors
/// [`crate::offline::error::Error::File`] names the texture that is malformed.
pub(crate) fn shaded(path: &Path, materials: &[Material]) -> Result<Vec<world::Material>> {
    let mut decoder = Decoder { path, images: HashMap::new(), colours: HashMap::new() };
    materials.iter().map(|m| decoder.material(m)).collect()
}

/// The bytes of an encoded image, once in memory.
type Encoded = Arc<Vec<u8>>;

/// What has been decoded, by the address of the bytes, which the materials keep alive.
struct Decoder<'a> {
    path: &'a Path,
    images: HashMap<*const Vec<u8>, Arc<Image>>,
    colours: HashMap<*const Vec<u8>, Arc<Texture>>,
}

impl Decoder<'_> {
    fn material(&mut self, m: &Material) -> Result<world::Material> {
        let (path, mut ggx, mut maps) = (self.path, m.ggx(), Maps::default());
        if let Some(normal) = self.image(m, "normalTexture", &m.normal_texture)? {
            maps.normal = Some(Arc::new(normal.normals(Encoding::Unit, true, m.normal_scale)?));
        }
        let base = self.image(m, "baseColorTexture", &m.base_color_texture)?;
        let surface = self.image(m, "metallicRoughnessTexture", &m.metallic_roughness_texture)?;
        if let Some(surface) = &surface {
            let alpha: Vec<f32> = texels(surface.size()).map(|(i, _)| (m.roughness * surface.raw(i).y).powi(2)).collect();
            let map = Texture::scalar(surface.size(), &alpha).map_err(|e| refused(path, e))?;
            maps.roughness = Some((Arc::new(map), Roughness::Alpha));
        }
        let [r, g, b, _] = m.base_color;
        let factor = Vec3::new(r, g, b);
        let metallic = surface.as_deref().filter(|_| m.metallic > 0.0);
        match (base.as_deref(), metallic, &m.base_color_texture) {
            (None, None, _) => {}
            // The texture itself is the one map that is needed; the factor is in the model.
            (Some(base), None, Some(bytes)) if m.metallic == 0.0 => maps.albedo = Some(self.colour(base, bytes)?),
            (Some(base), None, Some(bytes)) if m.metallic == 1.0 => maps.specular = Some(self.colour(base, bytes)?),
            (base, metallic, _) => {
                let [albedo, f0] = split(base, metallic, factor, m.metallic);
                let size = union(base, metallic);
                let map = |texels: &[[f32; 3]]| Texture::colour(size, texels).map(Arc::new).map_err(|e| refused(path, e));
                (maps.albedo, maps.specular) = (Some(map(&albedo)?), Some(map(&f0)?));
                ggx = Ggx { f0: DVec3::ONE, albedo: DVec3::ONE, ..ggx };
            }
        }
        Ok(world::Material { name: m.name.clone(), model: Model::Ggx(ggx), maps })
    }

    fn image(&mut self, m: &Material, field: &str, bytes: &Option<Encoded>) -> Result<Option<Arc<Image>>> {
        let Some(bytes) = bytes else { return Ok(None) };
        if let Some(image) = self.images.get(&Arc::as_ptr(bytes)) {
            return Ok(Some(Arc::clone(image)));
        }
        let image = Arc::new(Image::decode(self.path, &format!("material `{}`: {field}", m.name), bytes)?);
        self.images.insert(Arc::as_ptr(bytes), Arc::clone(&image));
        Ok(Some(image))
    }

    fn colour(&mut self, image: &Image, bytes: &Encoded) -> Result<Arc<Texture>> {
        if let Some(texture) = self.colours.get(&Arc::as_ptr(bytes)) {
            return Ok(Arc::clone(texture));
        }
        let texture = Arc::new(image.colour()?);
        self.colours.insert(Arc::as_ptr(bytes), Arc::clone(&texture));
        Ok(texture)
    }
}

/// The size that holds both.
fn union(a: Option<&Image>, b: Option<&Image>) -> [u32; 2] {
    let [a, b] = [a, b].map(|image| image.map_or([1; 2], Image::size));
    [a[0].max(b[0]), a[1].max(b[1])]
}

/// Number and coordinates of each texel's centre.
fn texels(size: [u32; 2]) -> impl Iterator<Item = (usize, DVec2)> {
    let (w, h) = (size[0] as usize, size[1] as usize);
    let centre = move |i: usize| DVec2::new(((i % w) as f64 + 0.5) / w as f64, 1.0 - ((i / w) as f64 + 0.5) / h as f64);
    (0..w * h).map(move |i| (i, centre(i)))
}

/// Albedo and reflectance at normal incidence, texel by texel at the size that holds both images.
fn split(base: Option<&Image>, surface: Option<&Image>, factor: Vec3, metallic: f32) -> [Vec<[f32; 3]>; 2] {
    let size = union(base, surface);
    let at = |image: Option<&Image>, (i, uv): (usize, DVec2), texel: fn(&Image, usize) -> Vec3| match image {
        Some(image) if image.size() == size => texel(image, i),
        Some(image) => image.bilinear(uv, |i| texel(image, i)).as_vec3(),
        None => Vec3::ONE,
    };
    texels(size)
        .map(|place| {
            let base = factor * at(base, place, Image::linear);
            let metallic = metallic * at(surface, place, Image::raw).z;
            let f0 = Vec3::splat(DIELECTRIC as f32).lerp(base, metallic);
            ((base * (1.0 - metallic)).to_array(), f0.to_array())
        })
        .unzip::<_, _, Vec<_>, Vec<_>>()
        .into()
}
