//! Filters that keep clusters, peaks or base texels: what is stored against the f64 twin, frames against quadrature, and what clusters
//! are good for.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod filters;
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec2, DVec3};
use passband::distribution::clusters::{Layout, MOMENTS};
use passband::moments::Moments;
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::reference::Options as Quadrature;
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::{Config, Division, Estimator, Filter, Light, Maps, Requirements, Roughness, Rule, Texture};
use std::sync::Arc;
use support::filters::{Minified, blinn_phong, lobes, normals, plane, roughness, scene, sheen};
use support::frames::{Stage, config, expected_with, furthest, ggx, ratio, tiles, world};

fn session(world: &World, config: &Config) -> Session {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    Session::new(headless, world, config).unwrap()
}

type Named = (&'static str, passband::reflectance::Model, Maps);

fn plain() -> Vec<Named> {
    let odd = [67, 45];
    vec![
        ("ggx", ggx(0.3, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.5), None)),
        (
            "rough ggx",
            ggx(0.3, DVec3::ONE, DVec3::ZERO),
            with(normals(odd, 0.3), roughness([32, 64], Roughness::Alpha, 0.02, 0.6)),
        ),
        ("rough blinn-phong", blinn_phong(), with(normals(odd, 0.2), roughness(odd, Roughness::Alpha, 0.1, 0.4))),
        ("two lobes", lobes(&[(0.7, 30.0), (-0.5, 60.0)]), with(normals(odd, 0.4), roughness(odd, Roughness::Alpha, 0.1, 0.8))),
        ("no map", blinn_phong(), Maps::default()),
    ]
}

/// Whose colours go together with their roughness. Classes of maps are few, so that all are of few sizes.
fn coloured() -> Vec<Named> {
    let odd = [67, 45];
    vec![
        (
            "coloured",
            ggx(0.3, DVec3::ONE, DVec3::ZERO),
            Maps { specular: sheen([32, 64]), ..with(normals(odd, 0.02), roughness(odd, Roughness::Alpha, 0.05, 0.6)) },
        ),
        (
            "two coloured lobes",
            lobes(&[(0.5, 30.0), (-0.5, 60.0)]),
            Maps { specular: sheen([32, 64]), ..with(normals(odd, 0.02), roughness(odd, Roughness::Alpha, 0.05, 0.6)) },
        ),
    ]
}

fn with(normal: Option<Arc<Texture>>, roughness: Option<(Arc<Texture>, Roughness)>) -> Maps {
    Maps { normal, roughness, ..Maps::default() }
}

fn materials(all: Vec<Named>) -> World {
    let mut scene = world("sphere", 16, blinn_phong(), builtin::environment("constant", 16).unwrap());
    let first = scene.materials[0].clone();
    scene.materials = all
        .into_iter()
        .map(|(name, model, maps)| {
            let mut material = first.clone();
            (material.name, material.model, material.maps) = (name.into(), model, maps);
            material
        })
        .collect();
    scene
}

#[test]
fn passes_store_the_moments_of_the_twin() {
    for all in [plain(), coloured()] {
        moments_are_those_of_the_twin(&materials(all));
    }
}

fn moments_are_those_of_the_twin(scene: &World) {
    let config = Config { filter: Filter::Clusters, ..config([8, 8], Estimator::Mis, 2) };
    let [mut one, mut other] = [session(scene, &config), session(scene, &config)];
    assert!(one.setup().iter().any(|(name, _)| *name == "cluster_moments"));
    for (number, material) in scene.materials.iter().enumerate() {
        let name = &material.name;
        let stored = one.moments(number).unwrap();
        assert!(stored == other.moments(number).unwrap(), "{name}: the same in every run");
        let Some(twin) = Moments::of(&material.surface(), Filter::Clusters, Division::default(), Rule::Exact) else {
            assert!(stored.is_none() && material.maps.is_empty(), "{name}");
            continue;
        };
        let [moments, layers] = stored.unwrap();
        let twin = twin.lobes().unwrap();
        let clusters = twin.clusters_of_map().unwrap();
        let all = clusters.all().len();
        let (normals, coloured) = (name.starts_with("two"), name.contains("coloured"));
        assert_eq!(clusters.layout(), Layout { normals, colours: coloured }, "{name}");
        // Of 8 bytes each.
        assert!(layers.len() * 8 == clusters.bytes() && clusters.bytes() <= 96, "{name}: {} layers", layers.len());
        assert_eq!(
            moments.len(),
            match name.as_str() {
                "two coloured lobes" => 4,
                "two lobes" => 3,
                "coloured" => 2,
                _ => 1,
            }
        );
        let (mut worst, mut apart, mut count) = (0.0f64, 0, 0);
        for level in 1..twin.levels() {
            for i in 0..layers[0][level - 1].1.len() {
                let expected = twin.texel(level, i).unwrap();
                let stored = |layer: usize| layers[layer][level - 1].1[i].map(f64::from);
                let mut off = 0.0f64;
                for k in 0..all {
                    let [q, x, y, xx] = stored(k);
                    let two = stored(all + if normals { k } else { k / 2 });
                    let (xy, yy) = if normals { (two[0], two[1]) } else { (two[2 * (k % 2)], two[2 * (k % 2) + 1]) };
                    let e: &[f64] = &expected[MOMENTS * k..][..MOMENTS];
                    // Lengths are stored 16 times as long; numbers of 16 bits have errors in proportion.
                    let scale = 1e-3 * e[0] + 1e-6;
                    if normals {
                        off = off.max((two[2] - e[6]).abs().max((two[3] - e[7]).abs()) / scale);
                    }
                    if coloured {
                        let colour = stored(all + if normals { all } else { all.div_ceil(2) } + k);
                        off = (0..3).map(|c| (colour[c] - e[8 + c]).abs() / scale).fold(off, f64::max);
                    }
                    let far = (e[3] + e[5]).max(1e-3 * e[0]) * 256.0;
                    off = off.max((q - e[0]).abs() / scale);
                    off =
                        [x - 16.0 * e[1], y - 16.0 * e[2]].map(f64::abs).into_iter().fold(off, |m, d| m.max(d / (16.0 * scale)));
                    let seconds = [xx - 256.0 * e[3], xy - 256.0 * e[4], yy - 256.0 * e[5]];
                    off = seconds.map(f64::abs).into_iter().fold(off, |m, d| m.max(d / (2e-3 * far + 1e-4)));
                }
                count += 1;
                // A lobe on the border of two clusters may fall into the other in 32 bits.
                if off > 3.0 { apart += 1 } else { worst = worst.max(off) }
            }
        }
        println!("{name}: {all} clusters, worst {worst:.2}, {apart} of {count} apart");
        assert!(apart * 200 <= count, "{name}: {apart} of {count}");
    }
}

#[test]
fn peaks_are_stored_as_they_are() {
    let scene = materials(plain());
    let config = Config { filter: Filter::Fournier4, ..config([8, 8], Estimator::Mis, 2) };
    let mut session = session(&scene, &config);
    for (number, material) in scene.materials.iter().enumerate() {
        let Some(twin) = Moments::of(&material.surface(), Filter::Fournier4, Division::default(), Rule::Exact) else { continue };
        let [_, layers] = session.moments(number).unwrap().unwrap();
        let twin = twin.lobes().unwrap();
        assert_eq!(layers.len(), if material.name == "two lobes" { 8 } else { 4 });
        let mut compared = 0;
        for level in 1..twin.levels() {
            for i in 0..layers[0][level - 1].1.len() {
                let expected = twin.texel(level, i).unwrap();
                let stored: Vec<_> = layers[..4].iter().map(|layer| layer[level - 1].1[i]).filter(|t| t[3] > 0.0).collect();
                assert_eq!(stored.len() * 8, expected.len(), "{} {level} {i}", material.name);
                for (s, e) in stored.iter().zip(expected.as_chunks::<8>().0) {
                    let [_, _, kappa, mass] = s.map(f64::from);
                    assert!((mass - e[4]).abs() < 1e-6 && (kappa * mass / e[3] - 1.0).abs() < 1e-5, "{s:?} {e:?}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 1000, "{compared}");
    }
}

#[test]
fn frames_are_those_of_the_quadrature() {
    let tiled = |normal, roughness| Maps { normal, roughness, tiling: [3.0, 2.0], ..Maps::default() };
    let all = |size| tiled(normals(size, 0.3), roughness(size, Roughness::Alpha, 0.1, 0.4));
    let metal = || ggx(0.15, DVec3::splat(0.9), DVec3::splat(0.3));
    let two = || lobes(&[(0.6, 60.0), (-0.4, 30.0)]);
    let (odd, few) = ([67, 45], [13, 9]);
    let mut wrong = Vec::new();
    // Directions and frames: of those that draw lobes each frame has others, and the reference driver ends a shader's loops after 65 535
    // rounds in all.
    let cases = [
        ("ggx", Filter::Clusters, metal(), all(odd), [2048, 1]),
        ("blinn-phong", Filter::Clusters, blinn_phong(), all(odd), [2048, 1]),
        ("one lobe", Filter::Clusters, lobes(&[(0.0, 60.0)]), all(odd), [2048, 1]),
        ("two lobes", Filter::Clusters, two(), tiled(normals([64; 2], 0.3), None), [2048, 1]),
        ("coloured ggx", Filter::Clusters, metal(), Maps { specular: sheen(odd), ..all(odd) }, [2048, 1]),
        ("coloured lobes", Filter::Clusters, two(), Maps { specular: sheen(few), ..all(few) }, [2048, 1]),
        ("ggx", Filter::Fournier4, metal(), all(few), [256, 6]),
        ("two lobes", Filter::Fournier7, two(), all(few), [256, 6]),
        ("one lobe", Filter::BruteForce, lobes(&[(0.0, 60.0)]), all(few), [64, 40]),
    ];
    for (name, filter, model, maps, [directions, frames]) in cases {
        let world = scene("sphere", model, maps);
        let options = Quadrature { filter, ..Quadrature::default() };
        let expected = expected_with(&world, [48, 48], options, |interior| {
            interior.into_iter().filter(|i| (i % 48 + i / 48) % 4 == 0).collect()
        });
        let config = Config { filter, ..config(expected.extent, Estimator::Mis, directions) };
        let (mean, _) = Stage::new(&world, &config).mean(0, frames);
        let radiance = |i: usize| mean[i];
        let all = ratio(&expected.pixels, radiance);
        let tiles = tiles(&expected, 24, radiance);
        let tile = furthest(tiles.iter().copied());
        let name = format!("{name}, {}", filter.name());
        println!("{name:24} mean {all:.5}, worst of {} tiles {tile:.5}, {} pixels", tiles.len(), expected.pixels.len());
        assert!(expected.error <= 1e-3 && expected.pixels.len() > 150);
        if (all - 1.0).abs() > 0.004 || (tile - 1.0).abs() > 0.02 {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn clusters_are_nearer_to_the_truth_than_cells() {
    let lamp = Light::Point { position: [0.5, 1.0, 1.2], intensity: [1.0; 3] };
    let minified = Minified::new(plane("bumps", lobes(&[(0.0, 100.0)]), lamp), 24);
    assert!(minified.pixels() > 80, "{}", minified.pixels());
    let all = [Filter::Clusters, Filter::Vmf8, Filter::ToksvigLobe, Filter::Fournier7];
    let [clusters, vmf8, toksvig, fournier] = all.map(|filter| minified.error(filter));
    println!("bumps: clusters {clusters:.3}, vmf8 {vmf8:.3}, toksvig-lobe {toksvig:.3}, fournier7 {fournier:.3}");
    assert!(clusters < 0.7 * vmf8 && clusters < 0.5 * toksvig && clusters < 1.4 * fournier);
}

#[test]
fn lobes_keep_the_colours_that_go_together_with_them() {
    let lamp = Light::Point { position: [0.5, 1.0, 1.2], intensity: [1.0; 3] };
    let mut scene = plane("checker", lobes(&[(0.0, 100.0)]), lamp);
    let (kappa, _) = scene.materials[0].maps.roughness.clone().unwrap();
    let [w, h] = kappa.size();
    // Rough places are dark, sharp ones gold.
    let at = |i: u32| DVec2::new((f64::from(i % w) + 0.5) / f64::from(w), 1.0 - (f64::from(i / w) + 0.5) / f64::from(h));
    let colour = |i: u32| if kappa.sample(at(i), 0.0).x > 200.0 { [0.9, 0.7, 0.2] } else { [0.1; 3] };
    let colours = Texture::colour([w, h], &(0..w * h).map(colour).collect::<Vec<_>>()).unwrap();
    scene.materials[0].maps.specular = Some(Arc::new(colours));
    let minified = Minified::new(scene, 24);
    // Every lobe, under the mean colour.
    let all = [Filter::Clusters, Filter::BruteForce, Filter::Vmf8, Filter::Naive];
    let [clusters, bruteforce, vmf8, naive] = all.map(|filter| minified.error(filter));
    println!("gold and dark: clusters {clusters:.3}, bruteforce {bruteforce:.3}, vmf8 {vmf8:.3}, naive {naive:.3}");
    assert!(clusters < 0.2 && clusters < 0.7 * bruteforce && clusters < 0.7 * naive && clusters < 0.3 * vmf8);
}

#[test]
fn what_a_filter_cannot_do_is_refused() {
    let scene = materials(plain());
    for filter in [Filter::Fournier4, Filter::Fournier7] {
        let refused = Config { filter, anisotropy: 4, ..config([8, 8], Estimator::Mis, 2) };
        let options = Options { device: Some(DEVICE.into()), validate: false };
        let headless = Headless::new(&options, &Requirements::of(&refused)).unwrap();
        let error = Session::new(headless, &scene, &refused).err().unwrap().to_string();
        assert!(error.contains("anisotropy") && error.contains("fournier"), "{error}");
    }
}
