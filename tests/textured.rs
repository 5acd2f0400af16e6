//! Textured surfaces are right: full-rate frames against f64 quadrature, with every kind of map on every kind of reflectance.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod filters;
    pub mod frames;
}

use glam::{DVec3, Vec3};
use passband::offline::world::World;
use passband::reflectance::{BlinnPhong, Lobe, Model, Vmf};
use passband::{Estimator, Maps, Roughness, Texture};
use std::f32::consts::TAU;
use std::sync::Arc;
use support::filters::scene;
use support::frames::{Stage, config, expected, furthest, ggx, ratio, table, tiles};

/// As for plain surfaces (tests/right.rs).
const MEAN: f64 = 0.003;
const TILE: f64 = 0.01;

const SIDE: u32 = 64;

/// A texel for each place of the unit square, row by row.
fn texels<T>(f: impl Fn(f32, f32) -> T) -> Vec<T> {
    let unit = |i: u32| (i as f32 + 0.5) / SIDE as f32;
    (0..SIDE * SIDE).map(|i| f(unit(i % SIDE), unit(i / SIDE))).collect()
}

/// Soft coloured waves that repeat.
fn wave(u: f32, v: f32, channel: usize) -> f32 {
    0.5 + 0.4 * (TAU * ((channel + 1) as f32 * u + v)).sin() * (TAU * v).cos()
}

fn colour8() -> Option<Arc<Texture>> {
    let texel = |u, v| [0, 1, 2].map(|c| (255.0 * wave(u, v, c)) as u8);
    Some(Arc::new(Texture::colour8([SIDE; 2], &texels(texel)).unwrap()))
}

fn colour() -> Option<Arc<Texture>> {
    let texel = |u, v| [2, 0, 1].map(|c| wave(v, u, c));
    Some(Arc::new(Texture::colour([SIDE; 2], &texels(texel)).unwrap()))
}

/// Bumps whose slope differs along u and v, so that a swapped or mirrored frame shows.
fn normals() -> Option<Arc<Texture>> {
    let texel = |u: f32, v: f32| {
        Vec3::new(0.35 * (TAU * 2.0 * u).sin() + 0.1, 0.2 * (TAU * (v + u)).cos() - 0.15, 1.0).normalize().to_array()
    };
    Some(Arc::new(Texture::normals([SIDE; 2], &texels(texel)).unwrap()))
}

fn roughness(kind: Roughness, low: f32, high: f32) -> Option<(Arc<Texture>, Roughness)> {
    let texel = |u, v| low * (high / low).powf(wave(u, v, 0));
    Some((Arc::new(Texture::scalar([SIDE; 2], &texels(texel)).unwrap()), kind))
}

fn blinn_phong() -> Model {
    Model::BlinnPhong(BlinnPhong { exponent: 40.0, specular: DVec3::new(0.5, 0.6, 0.7), albedo: DVec3::splat(0.3) })
}

/// Threads in two directions: not isotropic.
fn cloth() -> Model {
    let lobe = |x, y, kappa| Lobe { mu: DVec3::new(x, y, 1.0), kappa, weight: 0.4 };
    Model::Vmf(Arc::new(Vmf::new(&[lobe(0.7, 0.0, 30.0), lobe(-0.2, 0.5, 60.0)]).unwrap()))
}

fn check(name: &str, world: &World) {
    let expected = expected(world, [64, 64], |interior| interior);
    let image = Stage::new(world, &config(expected.extent, Estimator::Mis, 4096)).frame([0, 0]);
    let radiance = |i: usize| image.radiance(i);
    let mean = ratio(&expected.pixels, radiance);
    let tiles = tiles(&expected, 32, radiance);
    let tile = furthest(tiles.iter().copied());
    println!("{name:24} mean {mean:.5}, worst of {} tiles {tile:.5}, {} pixels", tiles.len(), expected.pixels.len());
    assert!(expected.error <= 1e-3 && expected.pixels.len() > 800 && tiles.len() >= 8);
    assert!((mean - 1.0).abs() <= MEAN && (tile - 1.0).abs() <= TILE, "{name}: mean {mean:.5}, tile {tile:.5}");
}

#[test]
fn microfacets_with_every_map() {
    let base = || ggx(0.3, DVec3::splat(0.9), DVec3::splat(0.8));
    let maps = |tiling| Maps {
        albedo: colour8(),
        specular: colour(),
        normal: normals(),
        roughness: roughness(Roughness::Alpha, 0.1, 0.7),
        tiling,
    };
    check("ggx, sphere", &scene("sphere", base(), maps([4.0, 2.0])));
    check("ggx, torus knot", &scene("torus-knot", base(), maps([2.0, 1.0])));
    let kappa = Maps { roughness: roughness(Roughness::Kappa, 10.0, 400.0), ..Maps::default() };
    check("ggx, concentration", &scene("sphere", base(), kappa));
}

#[test]
fn cosine_powers_with_every_map() {
    let roughness = roughness(Roughness::Kappa, 8.0, 300.0);
    let maps = Maps { albedo: colour(), specular: colour8(), normal: normals(), roughness, ..Maps::default() };
    check("blinn-phong", &scene("sphere", blinn_phong(), maps));
    let alpha = Maps { roughness: self::roughness(Roughness::Alpha, 0.1, 0.5), ..Maps::default() };
    check("blinn-phong, alpha", &scene("sphere", blinn_phong(), alpha));
}

#[test]
fn lobes_lie_along_the_tangents() {
    check("vmf", &scene("sphere", cloth(), Maps::default()));
    check("vmf, torus knot", &scene("torus-knot", cloth(), Maps { normal: normals(), ..Maps::default() }));
    let maps =
        Maps { albedo: colour8(), specular: colour(), roughness: roughness(Roughness::Alpha, 0.15, 0.5), ..Maps::default() };
    check("vmf, all maps", &scene("sphere", cloth(), maps));
}

#[test]
fn tables_take_a_colour_and_normals() {
    let maps = Maps { albedo: colour8(), normal: normals(), tiling: [3.0, 1.0], ..Maps::default() };
    check("metallic-paint", &scene("sphere", table("metallic-paint"), maps));
}
