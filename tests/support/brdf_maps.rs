//! Maps of lobes on which filters are compared.
#![allow(dead_code, reason = "each test file uses its part")]

use glam::{DVec3, Vec3};
use passband::distribution::BrdfMap;
use passband::distribution::effective::Rule;
use passband::distribution::vmf::Lobe;
use passband::material::{Maps, Material, Roughness};
use passband::offline::texture::{Encoding, Image, Part};
use passband::reflectance::{Ggx, Model, Vmf};
use passband::texture::Texture;
use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

/// The middle `side` x `side` texels of a texture, as vectors.
fn middle(texture: &Texture, side: u32) -> Vec<Vec3> {
    let [w, h] = texture.size().map(f64::from);
    let at = |i: u32| glam::DVec2::new(f64::from(i % side), f64::from(i / side)) + 0.5 - f64::from(side / 2);
    let uv = |i: u32| glam::DVec2::new(0.5 + at(i).x / w, 0.5 - at(i).y / h);
    (0..side * side).map(|i| texture.sample(uv(i), 0.0).truncate().as_vec3()).collect()
}

/// The middle of the built-in map `name`: one lobe of the mapped concentration about the mapped normal, of `cloth` two.
pub fn builtin(name: &str, side: u32) -> BrdfMap {
    BrdfMap::of(&material(name, side), [side; 2], Rule::Exact).unwrap()
}

/// A material with it.
pub fn material(name: &str, side: u32) -> Material {
    let normals = Image::builtin(name, Part::Normal).unwrap().normals(Encoding::Signed, true, 1.0).unwrap();
    let normals: Vec<_> = middle(&normals, side)
        .into_iter()
        .map(|n| n.truncate().extend((1.0 - n.truncate().length_squared()).max(0.0).sqrt()).normalize().to_array())
        .collect();
    let normal = Some(Arc::new(Texture::normals([side; 2], &normals).unwrap()));
    if name == "cloth" {
        let lobe = |x: f64| Lobe { mu: DVec3::new(x, 0.0, FRAC_1_SQRT_2), kappa: 128.0, weight: 1.0 };
        let model = Vmf::new(&[FRAC_1_SQRT_2, -FRAC_1_SQRT_2].map(lobe)).unwrap();
        Material::new(Model::Vmf(Arc::new(model)), Maps { normal, ..Maps::default() })
    } else {
        let kappa = middle(&Image::builtin(name, Part::Concentration).unwrap().roughness().unwrap(), side);
        let kappa: Vec<_> = kappa.into_iter().map(|k| k.x).collect();
        let roughness = Some((Arc::new(Texture::scalar([side; 2], &kappa).unwrap()), Roughness::Kappa));
        let model = Model::Ggx(Ggx { alpha: 0.5, f0: DVec3::ONE, albedo: DVec3::ZERO });
        Material::new(model, Maps { normal, roughness, ..Maps::default() })
    }
}
