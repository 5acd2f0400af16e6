//! Filters that read normals and roughness through mips: what the passes store against the f64 twin, frames against quadrature, and
//! what they are good for.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod filters;
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec3, Vec3};
use passband::distribution::Filtered;
use passband::moments::Moments;
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::reference::Options as Quadrature;
use passband::offline::session::{MomentLevels, Session};
use passband::offline::world::World;
use passband::reflectance::Model;
use passband::{Config, Division, Estimator, Filter, Light, Maps, Requirements, Roughness, Rule, Sampling, Texture};
use std::sync::Arc;
use support::filters::{Minified, blinn_phong, lobes, normals, plane, roughness, scene, texels};
use support::frames::{Stage, config, expected_with, furthest, ggx, ratio, table, tiles, world};

/// Those that store moments.
fn filters() -> impl Iterator<Item = Filter> {
    Filter::stored()
}

/// Materials with maps of odd and of different sizes, few enough that none is resampled.
fn materials() -> Vec<(&'static str, Model, Maps)> {
    let odd = [67, 45];
    let with = |normal, roughness| Maps { normal, roughness, ..Maps::default() };
    vec![
        ("ggx", ggx(0.3, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.5), None)),
        (
            "rough ggx",
            ggx(0.3, DVec3::ONE, DVec3::ZERO),
            with(normals(odd, 0.3), roughness([32, 64], Roughness::Alpha, 0.02, 0.6)),
        ),
        ("sharp ggx", ggx(0.3, DVec3::ONE, DVec3::ZERO), with(None, roughness(odd, Roughness::Kappa, 1e3, 6e4))),
        ("blinn-phong", blinn_phong(), with(normals(odd, 0.5), None)),
        ("rough blinn-phong", blinn_phong(), with(normals(odd, 0.2), roughness(odd, Roughness::Kappa, 10.0, 900.0))),
        ("one lobe", lobes(&[(0.0, 50.0)]), with(normals(odd, 0.4), roughness(odd, Roughness::Alpha, 0.1, 0.8))),
        ("two lobes", lobes(&[(0.7, 30.0), (-0.5, 60.0)]), with(normals(odd, 0.4), roughness(odd, Roughness::Alpha, 0.1, 0.8))),
        ("table", table("metallic-paint"), with(normals(odd, 0.4), None)),
        ("no map", blinn_phong(), Maps::default()),
    ]
}

fn session(world: &World, config: &Config) -> Session {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    Session::new(headless, world, config).unwrap()
}

/// What is stored and what the twin has, texel by texel of the levels of one layer.
fn each(layer: &MomentLevels, twin: &Filtered<'_>, see: &mut dyn FnMut([f32; 4], Vec<f64>)) {
    for (level, (size, texels)) in layer.iter().enumerate() {
        assert_eq!(*size, twin.size(level));
        texels.iter().enumerate().for_each(|(i, texel)| see(*texel, twin.texel(level, i).unwrap()));
    }
}

#[test]
fn passes_store_what_the_twin_does() {
    let mut scene = world("sphere", 16, blinn_phong(), builtin::environment("constant", 16).unwrap());
    let first = scene.materials[0].clone();
    let named = |(name, model, maps): (&str, Model, Maps)| {
        let mut material = first.clone();
        (material.name, material.model, material.maps) = (name.into(), model, maps);
        material
    };
    scene.materials = materials().into_iter().map(named).collect();
    // tests/clusters.rs and tests/gaussians.rs have the others.
    let others = [Filter::Clusters, Filter::Fournier4, Filter::Fournier7, Filter::BruteForce, Filter::Gmm, Filter::GmmUnaligned];
    for filter in filters().filter(|filter| !others.contains(filter)) {
        let mut session = session(&scene, &Config { filter, ..config([8, 8], Estimator::Mis, 2) });
        let names: Vec<_> = session.setup().iter().map(|(name, _)| *name).collect();
        assert!(names.contains(&"brdf_map") && names.contains(&"vmf_mips"), "{names:?}");
        for (number, material) in scene.materials.iter().enumerate() {
            let case = format!("{} {}", filter.name(), material.name);
            let stored = session.moments(number).unwrap();
            let Some(twin) = Moments::of(&material.surface(), filter, Division::default(), Rule::Exact) else {
                assert!(stored.is_none() && material.maps.is_empty(), "{case}");
                continue;
            };
            let [moments, cells] = stored.unwrap();
            let mut moments = moments.iter();
            let mut worst = [0.0f64; 2];
            let mut note = |off: DVec3, known: f64, w: f64| {
                worst = [worst[0].max(off.length()), worst[1].max((w / known - 1.0).abs())];
            };
            let vector = |[x, y, z, w]: [f32; 4], weight: f64| ([x, y].map(f64::from), weight - f64::from(z), f64::from(w));
            if let Some(normals) = twin.normals() {
                each(moments.next().unwrap(), normals, &mut |stored, expected| {
                    let ([x, y], z, _) = vector(stored, 1.0);
                    note(DVec3::new(x, y, z) - DVec3::from_slice(&expected[..3]), 1.0, 1.0);
                });
            }
            let twin_normals = twin.normals().is_some();
            let Some(twin) = twin.lobes() else {
                assert!(moments.next().is_none() && cells.is_empty(), "{case}");
                continue;
            };
            let slots = |stride: usize| move |expected: &[f64], k: usize| expected[k * stride..(k + 1) * stride].to_vec();
            match filter {
                Filter::Lean | Filter::LeanLobe | Filter::Leadr => {
                    for (k, layer) in moments.enumerate() {
                        each(layer, twin, &mut |stored, expected| {
                            let e = slots(6)(&expected, k / 2);
                            let e: Vec<f64> = e.iter().map(|m| m / e[5]).collect();
                            let expected = if k % 2 == 0 { [e[0], e[1], e[2], e[4]] } else { [e[3], 0.0, 0.0, 0.0] };
                            let scale = 1e-6 / 2e-6 * (1.0 + e[2] + e[4]);
                            let off = stored.iter().zip(expected).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
                            note(DVec3::X * off / scale * 0.1, 1.0, 1.0);
                        });
                    }
                }
                Filter::Vmf4 | Filter::Vmf8 | Filter::Vmf => {
                    let count = if filter == Filter::Vmf4 { 4 } else { 8 };
                    let normals = count + count / 4;
                    assert_eq!(cells.len(), normals + if twin_normals { count } else { 0 }, "{case}");
                    for (k, layer) in cells.iter().enumerate() {
                        for (level, (size, texels)) in layer.iter().enumerate() {
                            assert_eq!(*size, twin.size(level + 1), "{case}");
                            for (i, texel) in texels.iter().enumerate() {
                                let expected = twin.texel(level + 1, i).unwrap();
                                let e = |cell: usize| slots(8)(&expected, cell);
                                if (count..normals).contains(&k) {
                                    let spread = |j: usize| e(4 * (k - count) + j);
                                    let off = (0..4).map(|j| f64::from(texel[j]) - (spread(j)[3] - spread(j)[4]));
                                    note(DVec3::X * off.map(f64::abs).fold(0.0, f64::max), 1.0, 1.0);
                                    continue;
                                }
                                let (e, first) = if k < count { (e(k), 0) } else { (e(k - normals), 5) };
                                let ([x, y], z, w) = vector(*texel, e[3]);
                                note(DVec3::new(x, y, z) - DVec3::from_slice(&e[first..first + 3]), 1.0, 1.0 + w - e[3]);
                            }
                        }
                    }
                }
                _ => {
                    for (k, layer) in moments.enumerate() {
                        each(layer, twin, &mut |stored, expected| {
                            let e = slots(if filter == Filter::Vmf1 { 8 } else { 5 })(&expected, k);
                            let weight = if filter == Filter::Vmf1 { e[3] } else { e[4] };
                            let ([x, y], z, w) = vector(stored, 1.0);
                            let known = if filter == Filter::Vmf1 { 1.0 - e[4] } else { e[3] / weight };
                            note(DVec3::new(x, y, z) - DVec3::from_slice(&e[..3]) / weight, known, w);
                        });
                    }
                }
            }
            println!("{case}: vector {:.1e}, spread or concentration {:.1e}", worst[0], worst[1]);
            // Under sharp lobes, normals that spread by less than 2e-7 count as one.
            assert!(worst[0] < 2e-6 && worst[1] < 1.5e-3, "{case}: {worst:?}");
        }
        assert_eq!(session.messages(), [""; 0]);
    }
}

#[test]
fn frames_are_those_of_the_quadrature() {
    let tiled = |normal, roughness| Maps { normal, roughness, tiling: [3.0, 2.0], ..Maps::default() };
    let all = |low, high| roughness([67, 45], Roughness::Alpha, low, high);
    let metal = || ggx(0.15, DVec3::splat(0.9), DVec3::splat(0.3));
    let bumps = || tiled(normals([67, 45], 0.3), all(0.1, 0.4));
    let rough = || Maps { albedo: None, ..bumps() };
    let two = || lobes(&[(0.6, 60.0), (-0.4, 30.0)]);
    let cases = [
        ("ggx", Filter::Vmf1, scene("sphere", metal(), bumps())),
        ("ggx", Filter::Vmf8, scene("sphere", metal(), bumps())),
        ("ggx", Filter::Vmf, scene("torus-knot", metal(), tiled(normals([64; 2], 0.3), None))),
        ("ggx, no roughness", Filter::Toksvig, scene("torus-knot", metal(), tiled(normals([64; 2], 0.3), None))),
        ("ggx", Filter::Fixed, scene("sphere", metal(), bumps())),
        ("ggx", Filter::Lean, scene("sphere", metal(), bumps())),
        ("ggx", Filter::Leadr, scene("sphere", metal(), bumps())),
        ("blinn-phong", Filter::Vmf4, scene("sphere", blinn_phong(), rough())),
        ("blinn-phong", Filter::Naive, scene("sphere", blinn_phong(), rough())),
        ("one lobe", Filter::Vmf, scene("sphere", lobes(&[(0.0, 60.0)]), rough())),
        ("one lobe, no maps", Filter::Vmf8, scene("sphere", lobes(&[(0.0, 60.0)]), Maps::default())),
        ("two lobes", Filter::Vmf1, scene("sphere", two(), tiled(normals([64; 2], 0.3), None))),
        ("two lobes", Filter::ToksvigLobe, scene("sphere", two(), tiled(normals([64; 2], 0.3), None))),
        ("two lobes", Filter::LeanLobe, scene("sphere", two(), tiled(normals([64; 2], 0.3), None))),
        ("two lobes", Filter::Vmf8, scene("sphere", two(), rough())),
        ("table", Filter::Vmf4, scene("sphere", table("metallic-paint"), tiled(normals([64; 2], 0.3), None))),
    ];
    for (name, filter, world) in cases {
        agrees(name, &world, Quadrature { filter, ..Quadrature::default() });
    }
}

/// Frames with many directions against the quadrature, whose options it shares.
fn agrees(name: &str, world: &World, options: Quadrature) {
    let expected =
        expected_with(world, [64, 64], options, |interior| interior.into_iter().filter(|i| (i % 64 + i / 64) % 2 == 0).collect());
    let Quadrature { filter, sampling, division, lobe_rule, .. } = options;
    let (anisotropy, lod_bias) = (sampling.anisotropy, sampling.lod_bias as f32);
    let base = config(expected.extent, Estimator::Mis, 2048);
    let config = Config { filter, anisotropy, lod_bias, division, lobe_rule, ..base };
    let (image, _) = Stage::new(world, &config).mean(0, 2);
    let radiance = |i: usize| image[i];
    let mean = ratio(&expected.pixels, radiance);
    let tiles = tiles(&expected, 24, radiance);
    let tile = furthest(tiles.iter().copied());
    let name = format!("{name}, {}", filter.name());
    println!("{name:24} mean {mean:.5}, worst of {} tiles {tile:.5}, {} pixels", tiles.len(), expected.pixels.len());
    assert!(expected.error <= 1e-3 && expected.pixels.len() > 400 && tiles.len() >= 6);
    assert!((mean - 1.0).abs() <= 0.003 && (tile - 1.0).abs() <= 0.01, "{name}: mean {mean:.5}, tile {tile:.5}");
}

#[test]
fn other_ways_to_read_maps_are_those_of_the_quadrature() {
    let maps = |tiling| Maps {
        normal: normals([67, 45], 0.3),
        roughness: roughness([67, 45], Roughness::Alpha, 0.1, 0.4),
        tiling,
        ..Maps::default()
    };
    let metal = || ggx(0.15, DVec3::splat(0.9), DVec3::splat(0.3));
    let stretched = scene("sphere", metal(), maps([12.0, 2.0]));
    let plain = Quadrature { filter: Filter::Vmf, ..Quadrature::default() };
    let along = Sampling { anisotropy: 8, lod_bias: 0.0 };
    agrees("look-ups along", &stretched, Quadrature { sampling: along, ..plain });
    let sharper = Sampling { anisotropy: 2, lod_bias: -0.7 };
    agrees("sharper", &stretched, Quadrature { filter: Filter::Lean, sampling: sharper, ..plain });
    let even = scene("sphere", lobes(&[(0.0, 60.0)]), maps([3.0, 2.0]));
    agrees("as printed", &even, Quadrature { division: Division::PRINTED, lobe_rule: Rule::Literal, ..plain });
    agrees("as printed", &even, Quadrature { filter: Filter::Vmf1, lobe_rule: Rule::Literal, ..plain });
    agrees("by the table", &even, Quadrature { filter: Filter::Vmf8, lobe_rule: Rule::Tabulated, ..plain });
    agrees("by length", &even, Quadrature { division: Division::Lengths([0.99, 0.97]), ..plain });
}

#[test]
fn constant_maps_change_nothing() {
    let tilted = |size| {
        let normal = Vec3::new(0.3, -0.2, 0.9).normalize().to_array();
        Some(Arc::new(Texture::normals(size, &texels(size, |_, _| normal)).unwrap()))
    };
    let even = |size, value| Some((Arc::new(Texture::scalar(size, &texels(size, |_, _| value)).unwrap()), Roughness::Alpha));
    let cases = [
        ("ggx", ggx(0.2, DVec3::ONE, DVec3::ZERO), tilted([67, 45]), None),
        // A concentration of 80 000.
        ("sharp ggx", ggx(0.2, DVec3::ONE, DVec3::ZERO), tilted([67, 45]), even([67, 45], 0.005)),
        ("blinn-phong", blinn_phong(), tilted([16; 2]), even([8; 2], 0.1)),
        ("one lobe", lobes(&[(0.0, 40.0)]), tilted([33, 64]), None),
        ("two lobes", lobes(&[(0.5, 40.0), (0.0, 9.0)]), tilted([33, 64]), even([8; 2], 0.3)),
        ("table", table("metallic-paint"), tilted([33, 64]), None),
    ];
    for (name, model, normal, roughness) in cases {
        let mut scene = scene("sphere", model, Maps { normal, roughness, tiling: [9.0, 9.0], ..Maps::default() });
        // Exact, without noise.
        scene.environment = None;
        scene.lights = vec![Light::Directional { direction: [-0.4, -0.6, -0.7], irradiance: [1.0; 3] }];
        let frame = |filter| Stage::new(&scene, &Config { filter, ..config([48, 48], Estimator::Mis, 2) }).frame([0, 0]);
        let point = frame(Filter::Point);
        let total: DVec3 = (0..48 * 48).map(|i| point.radiance(i)).sum();
        // Gaussians of slopes are lobes of another shape, and masked about another normal.
        let slopes = [Filter::Lean, Filter::LeanLobe, Filter::Leadr];
        // These keep lobes of one place apart.
        let apart = [
            Filter::Naive,
            Filter::Fixed,
            Filter::ToksvigLobe,
            Filter::Clusters,
            Filter::Fournier4,
            Filter::Fournier7,
            Filter::BruteForce,
            Filter::Gmm,
        ];
        for filter in filters().filter(|filter| !slopes.contains(filter) && (name != "two lobes" || apart.contains(filter))) {
            let image = frame(filter);
            let off: DVec3 = (0..48 * 48).map(|i| (image.radiance(i) - point.radiance(i)).abs()).sum();
            let off = (off / total).max_element();
            println!("{name} {}: {off:.1e}", filter.name());
            // The roughness is stored in 16 bits, of which one is 5e-4.
            assert!(off < 4e-3, "{name} {}: {off:e}", filter.name());
        }
    }
}

#[test]
fn errors_fall_in_the_order_of_the_study() {
    let sun = Light::Directional { direction: [-0.2, -0.5, -0.8], irradiance: [1.0; 3] };
    let lamp = Light::Point { position: [0.5, 1.0, 1.2], intensity: [1.0; 3] };
    for (name, light) in [("bumps", sun), ("dunes", lamp)] {
        let model = ggx(0.3, DVec3::splat(0.9), DVec3::ZERO);
        let minified = Minified::new(plane(name, model, light), 48);
        assert!(minified.pixels() > 400, "{}", minified.pixels());
        let [point, naive, fixed, toksvig, vmf1] =
            [Filter::Point, Filter::Naive, Filter::Fixed, Filter::Toksvig, Filter::Vmf1].map(|filter| minified.error(filter));
        println!("{name}: point {point:.3}, naive {naive:.3}, fixed {fixed:.3}, toksvig {toksvig:.3}, vmf1 {vmf1:.3}");
        assert!((vmf1 / toksvig - 1.0).abs() < 0.3, "{name}: toksvig {toksvig:.3}, vmf1 {vmf1:.3}");
        for worse in [point, naive, fixed] {
            assert!(vmf1.max(toksvig) < 0.6 * worse, "{name}: {vmf1:.3} and {toksvig:.3} for {worse:.3}");
        }
    }
}
