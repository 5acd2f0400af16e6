//! Worlds, frames on lavapipe under the validation layer, and their comparison with the f64 reference.
#![allow(dead_code, reason = "each test file uses its part")]

use crate::chosen_device::DEVICE;
use glam::{DVec3, Mat4};
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::reference::{self as quadrature, Reference, ReferenceImage};
use passband::offline::session::Session;
use passband::offline::world::{Camera, EnvironmentLight, Material, Object, World};
use passband::reflectance::{Ggx, Model, stand_in};
use passband::sampling::LatLong;
use passband::{Config, Estimator, Requirements};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex};

/// The stand-in (synthetic) table of that name, baked once a test binary.
pub fn table(name: &str) -> Model {
    static BAKED: LazyLock<Mutex<HashMap<String, Model>>> = LazyLock::new(Default::default);
    let mut baked = BAKED.lock().unwrap();
    let bake = || Model::Table(Arc::new(stand_in::table(name).unwrap()));
    baked.entry(name.into()).or_insert_with(bake).clone()
}

pub fn ggx(alpha: f64, f0: DVec3, albedo: DVec3) -> Model {
    Model::Ggx(Ggx { alpha, f0, albedo })
}

/// One built-in mesh in the middle of the image under a map, as the built-in scenes stand.
pub fn world(mesh: &str, detail: u32, model: Model, map: LatLong) -> World {
    let turn = match mesh {
        "torus-knot" => Mat4::from_rotation_y(25_f32.to_radians()) * Mat4::from_rotation_x(-15_f32.to_radians()),
        _ => Mat4::IDENTITY,
    };
    World {
        name: mesh.into(),
        camera: Camera { position: DVec3::new(0.0, 0.5, 3.6), target: DVec3::ZERO, up: DVec3::Y, fov_y: 36.0 },
        size: None,
        environment: Some(EnvironmentLight { map, intensity: 1.0, rotation: 0.0, visible: false }),
        lights: Vec::new(),
        shadows: None,
        objects: vec![Object { mesh: Arc::new(builtin::mesh(mesh, detail).unwrap()), transform: turn, material: 0 }],
        materials: vec![Material { name: "material".into(), model, maps: Default::default() }],
    }
}

/// One frame at a time with `directions` a sample.
pub fn config(extent: [u32; 2], estimator: Estimator, directions: u32) -> Config {
    Config { frames_in_flight: 1, estimator, directions, ..Config::new(extent) }
}

/// Linear radiance and coverage, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub texels: Vec<[f32; 4]>,
}

impl Image {
    pub fn radiance(&self, i: usize) -> DVec3 {
        let [r, g, b, _] = self.texels[i];
        DVec3::new(r.into(), g.into(), b.into())
    }
    pub fn coverage(&self, i: usize) -> f32 {
        self.texels[i][3]
    }
}

/// A session on lavapipe. Any validation message fails the test at the frame that brought it.
pub struct Stage {
    session: Session,
}

impl Stage {
    pub fn new(world: &World, config: &Config) -> Self {
        let options = Options { device: Some(DEVICE.into()), validate: true };
        let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
        Self { session: Session::new(headless, world, config).unwrap() }
    }

    pub fn frame(&mut self, seed: [u32; 2]) -> Image {
        self.session.frame(seed).unwrap();
        let (bytes, format, _) = self.session.image("resolved").unwrap();
        assert_eq!(format, passband::ash::vk::Format::R32G32B32A32_SFLOAT);
        assert_eq!(self.session.messages(), [""; 0]);
        Image { texels: bytemuck::pod_collect_to_vec(&bytes) }
    }

    /// The mean and the variance of the mean of `frames` independent frames.
    pub fn mean(&mut self, seed: u32, frames: u32) -> (Vec<DVec3>, Vec<DVec3>) {
        let mut sums: Vec<[DVec3; 2]> = Vec::new();
        for frame in 0..frames {
            let image = self.frame([seed, frame]);
            sums.resize(image.texels.len(), [DVec3::ZERO; 2]);
            for (i, [sum, squares]) in sums.iter_mut().enumerate() {
                let radiance = image.radiance(i);
                *sum += radiance;
                *squares += radiance * radiance;
            }
        }
        let n = f64::from(frames);
        sums.into_iter().map(|[s, q]| (s / n, (q / n - (s / n) * (s / n)).max(DVec3::ZERO) / (n - 1.0).max(1.0))).unzip()
    }
}

/// Interior pixels and the radiance that the reference finds there.
pub struct Expected {
    pub extent: [u32; 2],
    pub pixels: Vec<(usize, DVec3)>,
    /// The largest change by the last halving of the quadrature's steps, relative.
    pub error: f64,
}

/// The f64 reference at the interior pixels that `choose` picks, where a rasteriser and a ray caster see the same surface.
pub fn expected(world: &World, extent: [u32; 2], choose: impl Fn(Vec<usize>) -> Vec<usize>) -> Expected {
    expected_with(world, extent, quadrature::Options::default(), choose)
}

/// The same with other options.
pub fn expected_with(
    world: &World,
    extent: [u32; 2],
    options: quadrature::Options,
    choose: impl Fn(Vec<usize>) -> Vec<usize>,
) -> Expected {
    let reference = Reference::new(world, extent, options).unwrap();
    let hits = reference.hits().to_vec();
    let image = ReferenceImage { extent, hits, radiance: vec![], coverage: vec![], error: vec![], evaluations: 0 };
    let interior = image.interior();
    let chosen = choose((0..interior.len()).filter(|i| interior[*i]).collect());
    let shade = |i: &usize| (*i, reference.shade(image.hits[*i].as_ref().unwrap()));
    let estimates: Vec<_> = chosen.par_iter().map(shade).collect();
    Expected {
        extent,
        pixels: estimates.iter().map(|(i, e)| (*i, e.radiance)).collect(),
        error: estimates.iter().fold(0.0, |a: f64, (_, e)| a.max(e.error)),
    }
}

/// Sum of the rendered over sum of the expected radiance, of the channel that is furthest from 1.
pub fn ratio(pixels: &[(usize, DVec3)], rendered: impl Fn(usize) -> DVec3) -> f64 {
    let sum: DVec3 = pixels.iter().map(|(i, _)| rendered(*i)).sum();
    let expected: DVec3 = pixels.iter().map(|(_, radiance)| *radiance).sum();
    furthest((sum / expected).to_array())
}

/// The ratio of each 16x16 tile that has `least` expected pixels or more.
pub fn tiles(expected: &Expected, least: usize, rendered: impl Fn(usize) -> DVec3) -> Vec<f64> {
    let width = expected.extent[0] as usize;
    let mut tiles: HashMap<[usize; 2], Vec<(usize, DVec3)>> = HashMap::new();
    for pixel in &expected.pixels {
        tiles.entry([pixel.0 % width / 16, pixel.0 / width / 16]).or_default().push(*pixel);
    }
    tiles.values().filter(|pixels| pixels.len() >= least).map(|pixels| ratio(pixels, &rendered)).collect()
}

/// The ratio that is furthest from 1.
pub fn furthest(ratios: impl IntoIterator<Item = f64>) -> f64 {
    let off = |ratio: &f64| if ratio.is_nan() { f64::INFINITY } else { (ratio - 1.0).abs() };
    ratios.into_iter().max_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
}
