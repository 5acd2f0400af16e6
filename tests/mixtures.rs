//! Mixtures that the device fits, all texels of a level at once: they are the f64 twin's.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod brdf_maps;
    pub mod filters;
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::DVec3;
use passband::moments::Moments;
use passband::offline::builtin as scenes;
use passband::offline::headless::{Headless, Options};
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::{Config, Division, Estimator, Filter, Maps, Requirements, Roughness};
use std::time::Instant;
use support::brdf_maps::material;
use support::filters::{blinn_phong, lobes, normals, roughness};
use support::frames::{config, ggx, world};

/// Levels of each layer, and texels of each level.
type Layers = Vec<Vec<([u32; 2], Vec<[f32; 4]>)>>;

/// A world of materials by name.
fn of(materials: Vec<(&str, passband::reflectance::Model, Maps)>) -> World {
    let mut scene = world("sphere", 16, blinn_phong(), scenes::environment("constant", 16).unwrap());
    let first = scene.materials[0].clone();
    let named = |(name, model, maps): (&str, _, _)| {
        let mut material = first.clone();
        (material.name, material.model, material.maps) = (name.into(), model, maps);
        material
    };
    scene.materials = materials.into_iter().map(named).collect();
    scene
}

fn builtin(name: &'static str, side: u32) -> (&'static str, passband::reflectance::Model, Maps) {
    let material = material(name, side);
    (name, material.model, material.maps)
}

fn session(scene: &World) -> Session {
    let config = Config { filter: Filter::Gmm, ..config([8, 8], Estimator::Mis, 2) };
    let headless = Headless::new(&Options { device: Some(DEVICE.into()), validate: true }, &Requirements::of(&config)).unwrap();
    Session::new(headless, scene, &config).unwrap()
}

fn fitted(session: &mut Session, material: usize) -> Layers {
    let [_, layers] = session.moments(material).unwrap().unwrap();
    layers
}

/// How far the moments of a texel are from others: the greatest difference of one, of all that the texel has of it.
fn apart(found: &[[f64; 6]], expected: &[[f64; 6]]) -> f64 {
    let differ = |k: usize| found.iter().zip(expected).map(|(a, b)| (a[k] - b[k]).abs()).sum::<f64>();
    let scale = |k: usize| expected.iter().map(|m| m[k].abs()).sum::<f64>();
    let mass = scale(0);
    (0..6).map(|k| differ(k) / scale(k).max(0.05 * mass)).fold(0.0, f64::max)
}

#[test]
fn the_device_fits_as_the_twin_does() {
    let with = |normal, roughness| Maps { normal, roughness, ..Maps::default() };
    let odd = [67, 45];
    let scene = of(vec![
        ("ggx", ggx(0.3, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.5), None)),
        ("rough", blinn_phong(), with(normals(odd, 0.2), roughness(odd, Roughness::Alpha, 0.1, 0.4))),
        ("sharp", ggx(0.02, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.3), None)),
        ("two lobes", lobes(&[(0.7, 30.0), (-0.5, 60.0)]), with(normals([32; 2], 0.4), None)),
        builtin("bumps", 128),
        builtin("disk", 128),
        builtin("cloth", 128),
    ]);
    let mut session = session(&scene);
    for (number, material) in scene.materials.iter().enumerate() {
        let twin = Moments::of(&material.surface(), Filter::Gmm, Division::default(), false).unwrap();
        let twin = twin.lobes().unwrap();
        let layers = fitted(&mut session, number);
        let mut offs = Vec::new();
        for level in 0..twin.levels() {
            assert_eq!(layers[0][level].0, twin.size(level), "{}", material.name);
            for i in 0..layers[0][level].1.len() {
                let expected = twin.texel(level, i).unwrap();
                let expected = expected.as_chunks::<6>().0;
                let found: Vec<[f64; 6]> = (0..4)
                    .map(|k| {
                        let [q, x, y, square] = layers[k][level].1[i];
                        let normal = layers.get(4 + k).map_or([0.0; 4], |layer| layer[level].1[i]);
                        [q, x, y, square, normal[0], normal[1]].map(f64::from)
                    })
                    .collect();
                // The sums over all Gaussians are those of all lobes, whatever is found.
                let all = |of: &[[f64; 6]]| [of.iter().fold([0.0; 6], |sum, m| std::array::from_fn(|k| sum[k] + m[k]))];
                let off = apart(&all(&found), &all(expected));
                assert!(off < 1e-4, "{} level {level} texel {i}: {off}", material.name);
                offs.push((apart(&found, expected), level));
            }
        }
        let count = offs.len();
        offs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |share: f64| offs[((count - 1) as f64 * share) as usize].0;
        let far = offs.iter().filter(|off| off.0 > 1e-2).count();
        println!(
            "{:10} {count} texels: median {:.1e}, 99 % {:.1e}, most {:.1e}; {far} otherwise",
            material.name,
            at(0.5),
            at(0.99),
            at(1.0)
        );
    }
    assert_eq!(session.messages(), [""; 0]);
}

#[test]
fn fits_on_the_device_take_this_long() {
    for (name, side) in [("disk", 256), ("bumps", 256), ("bumps", 512), ("disk", 512), ("disk", 1024)] {
        let (_, model, maps) = builtin(name, side.min(512));
        let tiled = |texture: &std::sync::Arc<passband::Texture>| texture.clone();
        let _ = tiled;
        let scene = of(vec![(name, model, maps)]);
        let clock = Instant::now();
        let session = session(&scene);
        let all = clock.elapsed().as_secs_f64();
        let times: Vec<_> = session.setup().iter().map(|(name, ms)| format!("{name} {ms:.0}")).collect();
        println!("{name} {side}x{side}: {all:.2} s, of these in ms {}", times.join(", "));
    }
}
