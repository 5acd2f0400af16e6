//! Materials with maps for filters, and planes that show them minified.
#![allow(dead_code, reason = "each test file uses its part")]

use super::frames::{Stage, config, world};
use glam::{DVec3, Mat4, Vec3};
use passband::offline::builtin;
use passband::offline::texture::{Encoding, Image, Part};
use passband::offline::world::World;
use passband::reflectance::{BlinnPhong, Lobe, Model, Vmf};
use passband::{Config, Estimator, Filter, Light, Maps, Roughness, Texture};
use std::f32::consts::TAU;
use std::sync::Arc;

/// A texel for each place of the unit square, row by row.
pub fn texels<T>([w, h]: [u32; 2], f: impl Fn(f32, f32) -> T) -> Vec<T> {
    (0..w * h).map(|i| f(((i % w) as f32 + 0.5) / w as f32, ((i / w) as f32 + 0.5) / h as f32)).collect()
}

/// Bumps that differ along u and v.
pub fn normals(size: [u32; 2], height: f32) -> Option<Arc<Texture>> {
    let texel = |u: f32, v: f32| {
        Vec3::new(height * (TAU * 6.0 * u).sin() + 0.1, 0.7 * height * (TAU * (4.0 * v + u)).cos() - 0.15, 1.0).normalize()
    };
    Some(Arc::new(Texture::normals(size, &texels(size, |u, v| texel(u, v).to_array())).unwrap()))
}

pub fn roughness(size: [u32; 2], kind: Roughness, low: f32, high: f32) -> Option<(Arc<Texture>, Roughness)> {
    let texel = |u: f32, v: f32| low * (high / low).powf(0.5 + 0.5 * (TAU * (3.0 * u + 2.0 * v)).sin());
    Some((Arc::new(Texture::scalar(size, &texels(size, texel)).unwrap()), kind))
}

/// Gold where [`roughness`] is high, dark where it is low.
#[allow(dead_code, reason = "not all that use these have colours")]
pub fn sheen(size: [u32; 2]) -> Option<Arc<Texture>> {
    let texel = |u: f32, v: f32| {
        let high = 0.5 + 0.5 * (TAU * (3.0 * u + 2.0 * v)).sin();
        [0.1 + 0.8 * high, 0.1 + 0.5 * high, 0.15].map(|c| c.min(1.0))
    };
    Some(Arc::new(Texture::colour(size, &texels(size, texel)).unwrap()))
}

pub fn blinn_phong() -> Model {
    Model::BlinnPhong(BlinnPhong { exponent: 90.0, specular: DVec3::new(0.5, 0.6, 0.7), albedo: DVec3::splat(0.3) })
}

pub fn lobes(all: &[(f64, f64)]) -> Model {
    let lobe = |&(x, kappa)| Lobe { mu: DVec3::new(x, 0.0, 1.0), kappa, weight: 0.4 };
    Model::Vmf(Arc::new(Vmf::new(&all.iter().map(lobe).collect::<Vec<_>>()).unwrap()))
}

/// One mesh, mirrored and stretched, under a small sun.
pub fn scene(mesh: &str, model: Model, maps: Maps) -> World {
    let mut world = world(mesh, 128, model, builtin::environment("sun-sky", 128).unwrap());
    let object = &mut world.objects[0];
    Arc::make_mut(&mut object.mesh).compute_tangents();
    object.transform = Mat4::from_rotation_y(0.8) * Mat4::from_scale(Vec3::new(-1.0, 0.9, 1.0));
    world.materials[0].maps = maps;
    world
}

/// The built-in map `name` on a tilted plane under a light, minified.
pub fn plane(name: &str, model: Model, light: Light) -> World {
    let normal = Image::builtin(name, Part::Normal).unwrap().normals(Encoding::Signed, true, 1.0).unwrap();
    let kappa = Image::builtin(name, Part::Concentration).unwrap().roughness().unwrap();
    let mut world = world("plane", 16, model, builtin::environment("constant", 16).unwrap());
    Arc::make_mut(&mut world.objects[0].mesh).compute_tangents();
    world.objects[0].transform = Mat4::from_rotation_x(0.9);
    world.materials[0].maps =
        Maps { normal: Some(Arc::new(normal)), roughness: Some((Arc::new(kappa), Roughness::Kappa)), ..Maps::default() };
    world.environment = None;
    world.lights = vec![light];
    world
}

/// A scene at a few pixels a side, and what these are without any filter.
pub struct Minified {
    scene: World,
    side: usize,
    /// Pixels that are all covered, and the means of the finer ones below them.
    truth: Vec<(usize, DVec3)>,
}

impl Minified {
    /// Pixels a side of the finer image for one.
    const FINER: usize = 16;

    pub fn new(scene: World, side: usize) -> Self {
        let fine = frame(&scene, side * Self::FINER, Filter::Point);
        let below = |i: usize| {
            let (x, y) = (i % side * Self::FINER, i / side * Self::FINER);
            (0..Self::FINER * Self::FINER).map(move |k| (y + k / Self::FINER) * side * Self::FINER + x + k % Self::FINER)
        };
        let inside = (0..side * side).filter(|i| below(*i).all(|k| fine.coverage(k) == 1.0));
        let mean = |i: usize| below(i).map(|k| fine.radiance(k)).sum::<DVec3>() / (Self::FINER * Self::FINER) as f64;
        let truth = inside.map(|i| (i, mean(i))).collect();
        Self { scene, side, truth }
    }

    pub fn pixels(&self) -> usize {
        self.truth.len()
    }

    /// Relative L2 of `filter`.
    pub fn error(&self, filter: Filter) -> f64 {
        let image = frame(&self.scene, self.side, filter);
        let off: f64 = self.truth.iter().map(|(i, t)| (image.radiance(*i) - *t).length_squared()).sum();
        (off / self.truth.iter().map(|(_, t)| t.length_squared()).sum::<f64>()).sqrt()
    }
}

fn frame(scene: &World, side: usize, filter: Filter) -> super::frames::Image {
    let config = Config { filter, ..config([side as u32; 2], Estimator::Mis, 2) };
    Stage::new(scene, &config).frame([0, 0])
}
