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
use passband::{Config, Division, Estimator, Filter, Maps, Requirements, Roughness, Rule};
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

/// Whether one map is fitted as the twin has it: how many of its texels are otherwise, beyond `bound`, and how many there are.
fn otherwise(session: &mut Session, scene: &World, number: usize, bound: f64) -> [usize; 2] {
    let material = &scene.materials[number];
    let twin = Moments::of(&material.surface(), Filter::Gmm, Division::default(), Rule::Exact).unwrap();
    let (twin, layers) = (twin.lobes().unwrap(), fitted(session, number));
    let mut offs = Vec::new();
    for level in 0..twin.levels() {
        assert_eq!(layers[0][level].0, twin.size(level), "{}", material.name);
        for i in 0..layers[0][level].1.len() {
            let expected = twin.texel(level, i).unwrap();
            let expected = expected.as_chunks::<6>().0;
            let moments = |k: usize| {
                let [q, x, y, square] = layers[k][level].1[i];
                let normal = layers.get(4 + k).map_or([0.0; 4], |layer| layer[level].1[i]);
                [q, x, y, square, normal[0], normal[1]].map(f64::from)
            };
            let found: Vec<[f64; 6]> = (0..4).map(moments).collect();
            // The sums over all Gaussians are those of all lobes, whatever is found.
            let all = |of: &[[f64; 6]]| [of.iter().fold([0.0; 6], |sum, m| std::array::from_fn(|k| sum[k] + m[k]))];
            let off = apart(&all(&found), &all(expected));
            assert!(off < 1e-5, "{} level {level} texel {i}: {off}", material.name);
            offs.push(apart(&found, expected));
        }
    }
    offs.sort_by(f64::total_cmp);
    let at = |share: f64| offs[((offs.len() - 1) as f64 * share) as usize];
    let far = offs.iter().filter(|off| **off > bound).count();
    let (median, most) = (at(0.5), at(0.99));
    println!("{:10} {} texels: median {median:.1e}, 99 % {most:.1e}; {far} otherwise", material.name, offs.len());
    [far, offs.len()]
}

#[test]
fn the_device_fits_as_the_twin_does() {
    let with = |normal, roughness| Maps { normal, roughness, ..Maps::default() };
    let odd = [67, 45];
    let small = vec![
        ("ggx", ggx(0.3, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.5), None)),
        ("rough", blinn_phong(), with(normals(odd, 0.2), roughness(odd, Roughness::Alpha, 0.1, 0.4))),
        ("sharp", ggx(0.02, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.3), None)),
        ("two lobes", lobes(&[(0.7, 30.0), (-0.5, 60.0)]), with(normals(odd, 0.4), None)),
    ];
    let lone = |size| vec![("few texels", blinn_phong(), with(normals(size, 0.5), None))];
    let of_maps = ["bumps", "disk", "dunes", "cloth", "flake"].map(|name| builtin(name, 128)).to_vec();
    for materials in [small, lone([1, 1]), lone([5, 1]), lone([3, 40]), of_maps] {
        let scene = of(materials);
        let mut session = session(&scene);
        for number in 0..scene.materials.len() {
            let [far, all] = otherwise(&mut session, &scene, number, 1e-3);
            // A component that is just worth its while in 64 bits may not be in 32: then all below differ.
            assert!(far * 50 <= all, "{}: {far} of {all}", scene.materials[number].name);
        }
        assert_eq!(session.messages(), [""; 0]);
    }
}

#[test]
fn maps_that_change_are_fitted_anew() {
    let maps = |height| Maps { normal: normals([64, 32], height), ..Maps::default() };
    let scenes = [0.3, 0.6].map(|height| of(vec![("ggx", ggx(0.2, DVec3::ONE, DVec3::ZERO), maps(height))]));
    let [first, second] = scenes.each_ref().map(|scene| fitted(&mut session(scene), 0));
    assert!(first != second);
    let mut session = session(&scenes[0]);
    // The same bits in every run.
    assert!(fitted(&mut session, 0) == first);
    let times = session.renew_materials(&scenes[1]).unwrap();
    assert!(times.iter().any(|(name, _)| *name == "mixtures"), "{times:?}");
    assert!(fitted(&mut session, 0) == second);
    session.renew_materials(&scenes[0]).unwrap();
    assert!(fitted(&mut session, 0) == first);
    assert_eq!(session.messages(), [""; 0]);
}

#[test]
fn fits_on_the_device_take_this_long() {
    let waves = |side: u32| {
        let maps = Maps {
            normal: normals([side; 2], 0.5),
            roughness: roughness([side; 2], Roughness::Alpha, 0.1, 0.4),
            ..Maps::default()
        };
        ("waves", blinn_phong(), maps)
    };
    // The first has the driver compile.
    for (material, side) in [(waves(16), 16), (builtin("disk", 256), 256), (waves(512), 512)] {
        let name = material.0;
        let clock = Instant::now();
        let session = session(&of(vec![material]));
        let seconds = clock.elapsed().as_secs_f64();
        let (_, ms) = session.setup().iter().find(|(name, _)| *name == "mixtures").unwrap();
        println!("{name} {side}x{side}: {ms:.0} ms of {seconds:.2} s");
        assert!(*ms > 0.0);
    }
}
