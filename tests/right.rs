//! The image is right: full-rate frames against f64 quadrature that shares nothing with the GPU's path.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use glam::DVec3;
use passband::Estimator;
use passband::offline::builtin;
use passband::offline::scene::Scene;
use passband::reflectance::Model;
use passband::sampling::sobol;
use support::frames::{Stage, config, expected, furthest, ggx, ratio, table, tiles, world};

/// How far the sum over an image may be off, in each channel: what noise is left, the packing of tables to nine bits a channel
/// and 32-bit arithmetic are inside.
const MEAN: f64 = 0.003;
/// The same of a 16x16 tile.
const TILE: f64 = 0.01;
/// Tiles with fewer interior pixels are left to the mean.
const LEAST_PIXELS: usize = 32;
/// Quadrature is refined until halving its steps changes no pixel by more.
const QUADRATURE: f64 = 1e-3;

/// Three tables (synthetic stand-ins) and a microfacet model over a diffuse base.
fn reflectances() -> [(&'static str, Model); 4] {
    let ggx = ggx(0.2, DVec3::new(0.3, 0.2, 0.1), DVec3::new(0.2, 0.4, 0.6));
    let stand_in = |name| (name, table(name));
    [stand_in("mirror-metal"), stand_in("metallic-paint"), stand_in("rough"), ("ggx", ggx)]
}

/// Every reflectance on `mesh` under both environments: 64x64 pixels of 4096 directions each.
fn check(mesh: &str, detail: u32) {
    let mut failed = Vec::new();
    for environment in ["sun-sky", "studio"] {
        for (name, model) in reflectances() {
            let world = world(mesh, detail, model, builtin::environment(environment, 128).unwrap());
            let expected = expected(&world, [64, 64], |interior| interior);
            let image = Stage::new(&world, &config(expected.extent, Estimator::Mis, 4096)).frame([0, 0]);
            let radiance = |i: usize| image.radiance(i);
            let mean = ratio(&expected.pixels, radiance);
            let tiles = tiles(&expected, LEAST_PIXELS, radiance);
            let (tile, pixels) = (furthest(tiles.iter().copied()), expected.pixels.len());
            println!(
                "{mesh:12} {environment:7} {name:14} mean {mean:.5}, worst of {} tiles {tile:.5}, {pixels} pixels",
                tiles.len()
            );
            assert!(expected.error <= QUADRATURE && pixels > 1000 && tiles.len() >= 8);
            if (mean - 1.0).abs() > MEAN || (tile - 1.0).abs() > TILE {
                failed.push(format!("{name} under {environment}: mean {mean:.5}, tile {tile:.5}"));
            }
        }
    }
    assert!(failed.is_empty(), "{mesh}: {}", failed.join("; "));
}

#[test]
fn sphere() {
    check("sphere", 128);
}

#[test]
fn bumpy_sphere() {
    check("bumpy-sphere", 96);
}

#[test]
fn torus_knot() {
    check("torus-knot", 96);
}

/// 64 random pixels of each of three 512x512 images under built-in environments at their full 1024x512.
/// `cargo test --test right -- --ignored --nocapture full_size_pixels`
#[test]
#[ignore = "takes minutes"]
fn full_size_pixels() {
    const FRAMES: u32 = 16;
    let scenes: [(&str, &[(&str, &str)]); 3] = [
        ("trio", &[]),
        ("bumpy-sphere", &[("environment.builtin", "studio"), ("materials.paint.reflectance.builtin", "rough")]),
        ("torus-knot", &[("materials.paint.reflectance.builtin", "mirror-metal")]),
    ];
    let mut failed = Vec::new();
    for (seed, (name, overrides)) in scenes.into_iter().enumerate() {
        let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        let world = Scene::load(name, &overrides).unwrap().resolve().unwrap();
        let pick = |interior: Vec<usize>| {
            let draw = |i| interior[(sobol::to_unit(sobol::random(i, seed as u32)[0]) * interior.len() as f64) as usize];
            (0..64).map(draw).collect()
        };
        let expected = expected(&world, [512, 512], pick);
        assert!(expected.error <= QUADRATURE);
        let (radiance, variance) = Stage::new(&world, &config(expected.extent, Estimator::Mis, 512)).mean(1, FRAMES);
        let mean = ratio(&expected.pixels, |i| radiance[i]);
        println!("{name}: mean of 64 pixels {mean:.5}");
        if (mean - 1.0).abs() > MEAN {
            failed.push(format!("{name}: mean {mean:.5}"));
        }
        for (i, e) in &expected.pixels {
            let sigma = variance[*i].to_array().map(f64::sqrt);
            let off = (radiance[*i] - e).to_array();
            let bound = [0, 1, 2].map(|c| 3.0 * sigma[c] + 0.005 * e[c]);
            let share = furthest((0..3).map(|c| 1.0 + off[c] / bound[c])) - 1.0;
            let line = format!(
                "{name} ({:3}, {:3}): {:9.5} for {:9.5}, sigma {:.5}, {share:+.2} of the bound",
                i % 512,
                i / 512,
                radiance[*i].y,
                e.y,
                sigma[1]
            );
            println!("{line}");
            if share.abs() > 1.0 {
                failed.push(line);
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("; "));
}
