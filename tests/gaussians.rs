//! Mixtures of Gaussians that are alike in neighbouring texels: their fit, their averages, what is on the device and in frames.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod brdf_maps;
    pub mod filters;
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec2, DVec3};
use passband::distribution::alignment::{Fit, Order};
use passband::distribution::vmf::Lobe;
use passband::distribution::{BrdfMap, Filtered, Gaussians, Mixture};
use passband::moments::Moments;
use passband::offline::builtin as scenes;
use passband::offline::headless::{Headless, Options};
use passband::offline::reference::Options as Quadrature;
use passband::offline::session::Session;
use passband::sampling::sobol;
use passband::{Config, Division, Estimator, Filter, Light, Maps, Requirements, Roughness, Rule};
use std::time::Instant;
use support::brdf_maps::builtin;
use support::filters::{Minified, blinn_phong, lobes, normals, plane, roughness, scene};
use support::frames::{Stage, config, expected_with, furthest, ggx, ratio, tiles, world};

/// Texels a side of the part of a built-in map that is fitted.
const SIDE: u32 = 128;

const PRINTED: Fit = Fit { order: Order::Scanline, strength: 1.0 };
/// Labels of the texel above alone.
const WITHOUT_PRIOR: Fit = Fit { strength: 0.0, ..Fit::ALIGNED };

fn fitted(map: &BrdfMap, fit: Fit) -> Filtered<'_> {
    Filtered::of_gaussians(map, Gaussians::new(map, fit, 2)).unwrap()
}

fn unit(i: u32, seed: u32) -> [f64; 2] {
    sobol::random(i, seed).map(sobol::to_unit)
}

/// The mean density of the lobes of some texels of the map.
fn exact(map: &BrdfMap, texels: &[usize], h: DVec3) -> f64 {
    texels.iter().flat_map(|i| map.texel(*i)).map(|l| l.density(h)).sum::<f64>() / texels.len() as f64
}

/// The base texels below the four texels of a level about corner `x`, `y`.
fn about(level: usize, [x, y]: [u32; 2]) -> Vec<usize> {
    let side = 1 << level;
    let inside = |c: u32| (c + SIDE - side..c + SIDE + side).map(|c| c % SIDE);
    inside(y * side).flat_map(|row| inside(x * side).map(move |column| (row * SIDE + column) as usize)).collect()
}

/// Relative L2 of the density half-way between four texels, over corners of levels 1 to 5.
fn between_texels(map: &BrdfMap, filtered: &Filtered<'_>) -> f64 {
    let mut error = 0.0;
    for level in 1..=5usize {
        let across = SIDE >> level;
        let (mut off, mut all) = (0.0, 0.0);
        for k in 0..64 {
            let corner = unit(k, 40 + level as u32).map(|u| (u * f64::from(across)) as u32);
            let uv = corner.map(|c| f64::from(c) / f64::from(across));
            let found = filtered.decode(&filtered.sample(DVec2::new(uv[0], 1.0 - uv[1]), level as f64));
            let texels = about(level, corner);
            for j in 0..16 {
                let texel = texels[(unit(j, k)[0] * texels.len() as f64) as usize];
                let h = map.texel(texel)[0].sample(unit(j, k ^ 0x800));
                let truth = exact(map, &texels, h);
                off += (found.density(h) - truth).powi(2);
                all += truth * truth;
            }
        }
        error += f64::sqrt(off / all) / 5.0;
    }
    error
}

/// [`Gaussians::energy`], in the mean over levels 1 to 4.
fn energy(map: &BrdfMap, filtered: &Filtered<'_>) -> f64 {
    (1..=4).map(|level| filtered.gaussians().unwrap().energy(map, level) / 4.0).sum()
}

#[test]
fn aligned_mixtures_are_alike_and_average_well() {
    println!("{:10}{:>24}{:>24}{:>24}{:>24}", "", "levels, c = 1", "levels, c = 0", "scanline, c = 1", "alone");
    for name in ["bumps", "disk", "dunes", "cloth", "flake"] {
        let map = builtin(name, SIDE);
        let all = [Fit::ALIGNED, WITHOUT_PRIOR, PRINTED, Fit::ALONE].map(|fit| {
            let clock = Instant::now();
            let filtered = fitted(&map, fit);
            let seconds = clock.elapsed().as_secs_f64();
            (energy(&map, &filtered), between_texels(&map, &filtered), seconds)
        });
        let row: String = all.iter().map(|(energy, error, s)| format!("{energy:>9.5} {error:.3} {s:>6.2} s")).collect();
        println!("{name:10}{row}");
        let [aligned, without, printed, alone] = all;
        // The prior draws means together; labels from above do most of it.
        assert!(aligned.0 <= without.0 * 1.001, "{name}: {} for {} without", aligned.0, without.0);
        assert!(aligned.0 < 0.6 * alone.0, "{name}: {} for {} alone", aligned.0, alone.0);
        assert!(aligned.1 < 0.85 * alone.1, "{name}: {} for {} alone", aligned.1, alone.1);
        // All texels of a level at once lose nothing against the paper's order.
        assert!(aligned.1 < 1.1 * printed.1 + 0.01, "{name}: {} for {} one after another", aligned.1, printed.1);
    }
}

#[test]
fn an_average_is_the_fit_to_draws_from_what_is_averaged() {
    let map = builtin("bumps", SIDE);
    let filtered = fitted(&map, Fit::ALIGNED);
    let all = filtered.gaussians().unwrap();
    let level = 3;
    let mut compared = 0;
    for corner in [[3, 5], [8, 2], [11, 13]] {
        let across = SIDE >> level;
        let stored = |dx: u32, dy: u32| {
            let [x, y] = [corner[0] + dx, corner[1] + dy];
            filtered.texel(level as usize, (y * across + x) as usize).unwrap()
        };
        // Not half-way: weights that differ.
        let part = [0.3, 0.8];
        let texels = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
            let weight = |d: u32, part: f64| if d == 1 { part } else { 1.0 - part };
            (stored(dx, dy), weight(dx, part[0]) * weight(dy, part[1]))
        });
        let uv = [0, 1].map(|a| (f64::from(corner[a]) + 0.5 + part[a]) / f64::from(across));
        let average = filtered.sample(DVec2::new(uv[0], 1.0 - uv[1]), level as f64);
        for component in 0..4 {
            let only = |texel: &[f64]| {
                let mut only = vec![0.0; texel.len()];
                only[component * 6..component * 6 + 6].copy_from_slice(&texel[component * 6..component * 6 + 6]);
                all.gaussians(&only).first().copied()
            };
            let Some((mean, variance, mass)) = only(&average) else { continue };
            // Draws in the numbers that the masses ask for, from a plane's even sequence.
            let (mut count, mut sum, mut square) = (0.0, DVec2::ZERO, 0.0);
            for (texel, weight) in &texels {
                let Some((at, own, mass)) = only(texel) else { continue };
                let draws = (400_000.0 * weight * mass) as u32;
                for i in 0..draws {
                    let [u, v] = sobol::point(i, 77).map(sobol::to_unit);
                    let radius = (-2.0 * (1.0 - u).ln()).sqrt() * own.sqrt();
                    let drawn = at + radius * DVec2::from_angle(std::f64::consts::TAU * v);
                    sum += drawn;
                    square += drawn.length_squared();
                    count += 1.0;
                }
            }
            if mass < 0.02 {
                continue;
            }
            let drawn = sum / count;
            let spread = 0.5 * (square / count - drawn.length_squared());
            assert!((drawn - mean).length() < 4e-3 * variance.sqrt(), "{component}: {drawn} for {mean}");
            assert!((spread / variance - 1.0).abs() < 5e-3, "{component}: {spread} for {variance}");
            compared += 1;
        }
    }
    assert!(compared > 5, "{compared}");
}

#[test]
fn what_is_stored_sums_to_what_is_below() {
    for (name, size) in [("bumps", [45, 67]), ("cloth", [64, 64])] {
        let whole = builtin(name, 96);
        let each = whole.lobes_per_texel();
        let texel = |i: u32| (i / size[0] * 96 + i % size[0]) as usize;
        let lobes = (0..size[0] * size[1]).flat_map(|i| whole.texel(texel(i)).to_vec()).collect();
        let map = BrdfMap::new(size, each, lobes).unwrap();
        for fit in [Fit::ALIGNED, Fit::ALONE, PRINTED] {
            let filtered = fitted(&map, fit);
            // Of the moments of all components together, each level's average is that of the map.
            let sums = |level: usize| {
                let [w, h] = filtered.size(level);
                let mut sums = [0.0; 4];
                for i in 0..(w * h) as usize {
                    let texel = filtered.texel(level, i).unwrap();
                    for m in texel.as_chunks::<6>().0 {
                        (0..4).for_each(|k| sums[k] += m[k] / f64::from(w * h));
                    }
                }
                sums
            };
            let base = sums(0);
            for level in 1..filtered.levels() {
                for (found, expected) in sums(level).into_iter().zip(base) {
                    assert!((found - expected).abs() < 2e-6 * base[0], "{name} {fit:?} {level}: {found} for {expected}");
                }
            }
        }
    }
}

#[test]
fn components_without_mass_do_no_harm() {
    let lobe = |x: f64, kappa| Lobe { mu: DVec3::new(x, -0.1, 1.0).normalize(), kappa, weight: 1.0 };
    // One lobe everywhere, and two halves, of which each lacks what the other has.
    for sides in [[lobe(0.2, 90.0); 2], [lobe(0.3, 2000.0), lobe(-0.3, 40.0)]] {
        let lobes = (0..32 * 32).map(|i| sides[usize::from(i % 32 >= 16)]).collect();
        let map = BrdfMap::new([32; 2], 1, lobes).unwrap();
        for fit in [Fit::ALIGNED, Fit::ALONE, PRINTED] {
            let filtered = fitted(&map, fit);
            for level in 0..filtered.levels() - 1 {
                let [w, h] = filtered.size(level);
                for i in 0..w * h {
                    let Mixture::Elliptic(found) = filtered.mixture(level, i as usize) else { panic!("elliptic lobes") };
                    let side = sides[usize::from(i % w >= w / 2)];
                    assert_eq!(found.len(), 1, "{fit:?} {level} {i}: {found:?}");
                    let off = found[0].round.kappa / side.kappa - 1.0;
                    assert!((found[0].round.mu - side.mu).length() < 1e-5 && off.abs() < 0.01, "{level} {i}: {found:?}");
                }
            }
            // Between the halves both are there, each as it is, if they are aligned.
            let half = filtered.decode(&filtered.sample(DVec2::new(0.5, 0.3), 2.0));
            assert!(half.count() <= 2 && (half.weight() - 1.0).abs() < 1e-9);
            let same = [3.0, 5.5].map(|lod| filtered.decode(&filtered.sample(DVec2::new(0.5, 0.3), lod)).weight());
            assert!(same.iter().all(|weight| (weight - 1.0).abs() < 1e-9));
            if fit.order != Order::Alone && sides[0] != sides[1] {
                let mid = sides.map(|side| half.density(side.mu) / (0.5 * side.density(side.mu)));
                assert!(half.count() == 2 && (mid[0] - 1.0).abs() < 0.1, "{mid:?}");
            }
        }
    }
}

#[test]
fn mixtures_are_the_same_on_any_number_of_threads() {
    let whole = builtin("dunes", 67);
    let lobes = whole.lobes()[..67 * 45].to_vec();
    let map = BrdfMap::new([67, 45], 1, lobes).unwrap();
    for fit in [Fit::ALIGNED, Fit::ALONE] {
        let one = Gaussians::new(&map, fit, 1);
        for threads in [2, 3, 7, 64] {
            assert!(Gaussians::new(&map, fit, threads) == one, "{fit:?} on {threads}");
        }
    }
}

#[test]
fn fits_take_this_long() {
    for (name, side) in [("disk", 256), ("bumps", 256)] {
        let map = builtin(name, side);
        let clock = Instant::now();
        let levels = fitted(&map, Fit::ALIGNED).levels();
        println!("{name} {side}x{side}: {levels} levels in {:.2} s", clock.elapsed().as_secs_f64());
        assert_eq!(levels, 9);
    }
}

#[test]
fn the_device_has_mixtures_that_materials_bring() {
    let mut scene = world("sphere", 16, blinn_phong(), scenes::environment("constant", 16).unwrap());
    let first = scene.materials[0].clone();
    let with = |normal, roughness| Maps { normal, roughness, ..Maps::default() };
    let odd = [67, 45];
    let all = [
        ("ggx", ggx(0.3, DVec3::ONE, DVec3::ZERO), with(normals(odd, 0.5), None)),
        ("rough", blinn_phong(), with(normals(odd, 0.2), roughness(odd, Roughness::Alpha, 0.1, 0.4))),
        ("two lobes", lobes(&[(0.7, 30.0), (-0.5, 60.0)]), with(normals([32; 2], 0.4), None)),
        ("no map", blinn_phong(), Maps::default()),
    ];
    scene.materials = all
        .into_iter()
        .map(|(name, model, maps)| {
            let mut material = first.clone();
            (material.name, material.model, material.maps) = (name.into(), model, maps);
            material
        })
        .collect();
    // Of Gmm the device fits its own.
    let filter = Filter::GmmUnaligned;
    let config = Config { filter, ..config([8, 8], Estimator::Mis, 2) };
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
    let mut session = Session::new(headless, &scene, &config).unwrap();
    for (number, material) in scene.materials.iter().enumerate() {
        let name = &material.name;
        let Some(twin) = Moments::of(&material.surface(), filter, Division::default(), Rule::Exact) else {
            assert!(session.moments(number).unwrap().is_none() && name == "no map");
            continue;
        };
        let twin = twin.lobes().unwrap();
        let [_, layers] = session.moments(number).unwrap().unwrap();
        assert_eq!(layers.len(), if name == "two lobes" { 8 } else { 4 });
        let mut count = 0;
        for level in 0..twin.levels() {
            assert_eq!(layers[0][level].0, twin.size(level), "{name}");
            for i in 0..layers[0][level].1.len() {
                let expected = twin.texel(level, i).unwrap();
                for (k, e) in expected.as_chunks::<6>().0.iter().enumerate() {
                    let stored = layers[k][level].1[i];
                    let normal = layers.get(4 + k).map_or([0.0; 2], |layer| [layer[level].1[i][0], layer[level].1[i][1]]);
                    let stored = stored.into_iter().chain(normal);
                    for (a, b) in stored.zip(e) {
                        assert!((f64::from(a) - b).abs() <= 1e-6 * b.abs(), "{name} {level} {i} {k}: {a} for {b}");
                    }
                    count += 1;
                }
            }
        }
        assert!(count > 4000, "{count}");
    }
    assert_eq!(session.messages(), [""; 0]);
}

#[test]
fn frames_are_those_of_the_quadrature() {
    let tiled = |normal, roughness| Maps { normal, roughness, tiling: [3.0, 2.0], ..Maps::default() };
    let all = |size| tiled(normals(size, 0.3), roughness(size, Roughness::Alpha, 0.1, 0.4));
    let odd = [67, 45];
    let cases = [
        ("ggx", Filter::Gmm, ggx(0.15, DVec3::splat(0.9), DVec3::splat(0.3)), all(odd), 1),
        ("blinn-phong", Filter::Gmm, blinn_phong(), all(odd), 4),
        ("one lobe", Filter::GmmUnaligned, lobes(&[(0.0, 60.0)]), all(odd), 1),
        ("two lobes", Filter::Gmm, lobes(&[(0.6, 60.0), (-0.4, 30.0)]), tiled(normals([64; 2], 0.3), None), 1),
    ];
    let mut wrong = Vec::new();
    for (name, filter, model, maps, anisotropy) in cases {
        let world = scene("sphere", model, maps);
        let sampling = passband::material::Sampling { anisotropy, ..Default::default() };
        let options = Quadrature { filter, sampling, ..Quadrature::default() };
        let expected = expected_with(&world, [48, 48], options, |interior| {
            interior.into_iter().filter(|i| (i % 48 + i / 48) % 4 == 0).collect()
        });
        let config = Config { filter, anisotropy, ..config(expected.extent, Estimator::Mis, 2048) };
        let (mean, _) = Stage::new(&world, &config).mean(0, 1);
        let radiance = |i: usize| mean[i];
        let all = ratio(&expected.pixels, radiance);
        let tile = furthest(tiles(&expected, 24, radiance).iter().copied());
        println!("{name:12} {:14} mean {all:.5}, worst tile {tile:.5}, {} pixels", filter.name(), expected.pixels.len());
        assert!(expected.error <= 1e-3 && expected.pixels.len() > 150);
        if (all - 1.0).abs() > 0.004 || (tile - 1.0).abs() > 0.02 {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn mixtures_are_nearer_to_the_truth_than_one_lobe() {
    let lamp = Light::Point { position: [0.5, 1.0, 1.2], intensity: [1.0; 3] };
    let minified = Minified::new(plane("disk", lobes(&[(0.0, 100.0)]), lamp), 24);
    assert!(minified.pixels() > 80, "{}", minified.pixels());
    let all = [Filter::Gmm, Filter::GmmUnaligned, Filter::Toksvig, Filter::Fixed];
    let [gmm, unaligned, toksvig, fixed] = all.map(|filter| minified.error(filter));
    println!("disk: gmm {gmm:.3}, gmm-unaligned {unaligned:.3}, toksvig {toksvig:.3}, fixed {fixed:.3}");
    assert!(gmm < unaligned && gmm < 0.7 * toksvig && gmm < 0.5 * fixed);
}
