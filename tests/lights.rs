//! Lights beside the environment, against sums and midpoint quadrature in f64.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use glam::{DVec3, Mat4};
use passband::offline::builtin;
use passband::offline::reference::{Hit, Options, Reference};
use passband::offline::world::{Camera, Material, Object, World};
use passband::reflectance::{Model, Reflectance};
use passband::{Estimator, Light};
use std::f64::consts::TAU;
use std::sync::Arc;
use support::frames::{Stage, config, furthest, ggx, ratio, table};

const EXTENT: [u32; 2] = [48, 48];

fn world(model: Model, lights: &[Light]) -> World {
    World {
        name: "lights".into(),
        camera: Camera { position: DVec3::new(0.0, 1.6, 4.0), target: DVec3::ZERO, up: DVec3::Y, fov_y: 36.0 },
        size: None,
        environment: None,
        lights: lights.to_vec(),
        shadows: None,
        objects: vec![Object {
            mesh: Arc::new(builtin::mesh("bumpy-sphere", 64).unwrap()),
            transform: Mat4::IDENTITY,
            material: 0,
        }],
        materials: vec![Material { name: "material".into(), model, maps: Default::default() }],
    }
}

fn vec(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// Directions towards a light from `p`, each with the radiant power that it stands for (irradiance at normal incidence).
fn directions(light: &Light, p: DVec3) -> Vec<(DVec3, DVec3)> {
    const STEPS: u32 = 96;
    let grid = || (0..STEPS * STEPS).map(|i| [i % STEPS, i / STEPS].map(|k| (f64::from(k) + 0.5) / f64::from(STEPS)));
    let share = 1.0 / f64::from(STEPS * STEPS);
    match *light {
        Light::Point { position, intensity } => {
            let d = vec(position) - p;
            vec![(d.normalize(), vec(intensity) / d.length_squared())]
        }
        Light::Directional { direction, irradiance } => vec![(-vec(direction).normalize(), vec(irradiance))],
        Light::Sphere { position, radius, radiance } => {
            let d = vec(position) - p;
            let cap = 1.0 - (1.0 - (f64::from(radius) / d.length()).powi(2)).sqrt();
            let (x, y) = d.normalize().any_orthonormal_pair();
            let one = |[u, v]: [f64; 2]| {
                let (c, phi) = (1.0 - u * cap, v * TAU);
                let s = (1.0 - c * c).sqrt();
                ((x * phi.cos() + y * phi.sin()) * s + d.normalize() * c, vec(radiance) * (TAU * cap * share))
            };
            grid().map(one).collect()
        }
        Light::Rectangle { position, u, v, radiance } => {
            let n = vec(u).cross(vec(v));
            let one = |[a, b]: [f64; 2]| {
                let d = vec(position) + vec(u) * (2.0 * a - 1.0) + vec(v) * (2.0 * b - 1.0) - p;
                let w = d.normalize();
                (w, vec(radiance) * ((-w.dot(n)).max(0.0) * 4.0 * share / d.length_squared()))
            };
            grid().map(one).collect()
        }
    }
}

/// What a hit reflects of all lights.
fn reflected(world: &World, hit: &Hit) -> DVec3 {
    let p = world.camera.position - hit.view * (hit.depth / (-hit.view).dot(-world.camera.world_from_view().z_axis));
    let x = (hit.view - hit.normal * hit.view.dot(hit.normal)).normalize();
    let local = |w: DVec3| DVec3::new(w.dot(x), w.dot(hit.normal.cross(x)), w.dot(hit.normal));
    let wo = local(hit.view);
    let model = &world.materials[hit.material].model;
    let one = |(w, power): (DVec3, DVec3)| {
        let wi = local(w);
        if wi.z > 0.0 { model.evaluate(wi, wo) * power * wi.z } else { DVec3::ZERO }
    };
    world.lights.iter().flat_map(|light| directions(light, p)).map(one).sum()
}

#[test]
fn every_light_is_what_quadrature_finds() {
    let lights = [
        Light::Point { position: [0.5, 1.8, 1.5], intensity: [2.0, 1.0, 0.5] },
        Light::Directional { direction: [1.0, -1.0, -1.0], irradiance: [0.5, 1.0, 2.0] },
        Light::Sphere { position: [-1.5, 1.4, 1.2], radius: 0.5, radiance: [6.0, 5.0, 4.0] },
        Light::Rectangle { position: [1.6, 1.0, 1.0], u: [0.0, 0.0, 0.6], v: [-0.3, 0.5, 0.0], radiance: [4.0, 5.0, 6.0] },
    ];
    let cases: [(&str, &[Light]); 5] = [
        ("point", &lights[..1]),
        ("directional", &lights[1..2]),
        ("sphere", &lights[2..3]),
        ("rectangle", &lights[3..]),
        ("all", &lights),
    ];
    for (material, model) in [("ggx", ggx(0.4, DVec3::splat(0.3), DVec3::splat(0.4))), ("paint", table("metallic-paint"))] {
        for (name, lights) in cases {
            let world = world(model.clone(), lights);
            let reference = Reference::new(&world, EXTENT, Options::default()).unwrap();
            let hits = reference.hits().to_vec();
            // Away from silhouettes, where a rasteriser and a ray caster may see different surfaces.
            let inside = |i: &usize| hits[*i].as_ref().is_some_and(|h| h.normal.dot(h.view) > 0.2);
            let pixels: Vec<_> =
                (0..hits.len()).filter(inside).filter_map(|i| Some((i, reflected(&world, hits[i].as_ref()?)))).collect();
            assert!(pixels.len() > 500);
            for (estimator, bound) in [(Estimator::Mis, 3e-3), (Estimator::Brdf, 1e-2)] {
                let mut stage = Stage::new(&world, &config(EXTENT, estimator, 2048));
                let image = stage.frame([0, 0]);
                let found = ratio(&pixels, |i| image.radiance(i));
                println!("{material}, {name}, {estimator:?}: {found:.5}");
                assert!((found - 1.0).abs() < bound, "{material}, {name}, {estimator:?}: {found}");
                if name == "point" || name == "directional" {
                    // No sampling at all: every pixel is right by itself.
                    let each = pixels
                        .iter()
                        .filter(|(_, e)| e.min_element() > 1e-3)
                        .map(|(i, e)| furthest((image.radiance(*i) / e).to_array()));
                    let worst = furthest(each);
                    assert!((worst - 1.0).abs() < 2e-2, "{material}, {name}: a pixel is off by {worst}");
                }
            }
        }
    }
}

#[test]
fn a_light_from_behind_or_inside_adds_nothing() {
    let away = Light::Rectangle { position: [0.0, 0.0, 3.0], u: [0.5, 0.0, 0.0], v: [0.0, 0.5, 0.0], radiance: [9.0; 3] };
    let around = Light::Sphere { position: [0.0; 3], radius: 20.0, radiance: [9.0; 3] };
    for light in [away, around] {
        let world = world(ggx(0.4, DVec3::ONE, DVec3::ZERO), &[light]);
        let image = Stage::new(&world, &config(EXTENT, Estimator::Mis, 64)).frame([0, 0]);
        assert!((0..image.texels.len()).all(|i| image.radiance(i) == DVec3::ZERO), "{light:?}");
    }
}
