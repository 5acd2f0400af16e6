//! Shading at levels: the passes against their twin in f64, no sample without a value, and what up-sampling does to images.

#[path = "support/frames.rs"]
mod frames;

use frames::{Stage, config, ggx, world};
use glam::{DMat3, DVec3};
use passband::frequency::reconstruction::{self as twin, Pyramid, Sample, Source, Surface};
use passband::offline::headless::{Headless, Options};
use passband::offline::scene::Scene;
use passband::offline::session::Session;
use passband::offline::world::{Material, World};
use passband::offline::{builtin, levels};
use passband::reflectance::{BlinnPhong, Model};
use passband::sampling::{LatLong, sobol};
use passband::{Config, Error, Estimator, Light, Rate, Requirements};
use rayon::prelude::*;
use std::collections::BTreeSet;

const SIZES: [[u32; 2]; 3] = [[512, 512], [500, 333], [1, 1]];

/// A number in [0, 1) for each `i` of stream `seed`.
fn unit(i: usize, seed: u32) -> f64 {
    sobol::to_unit(sobol::random(i as u32, seed)[0])
}

/// Levels 0 to 6 in patches of 1 to 32 samples, with single samples of any level strewn in.
fn random_levels([width, height]: [usize; 2], seed: u32) -> Vec<u8> {
    let patch = (unit(0, seed) * 6.0) as usize;
    let noise = unit(1, seed).powi(3);
    let level = |i: usize| (unit(i, seed ^ 0x5bd1) * 7.0) as u8;
    let at = |i: usize| {
        let (x, y) = (i % width, i / width);
        let own = unit(i + 2, seed ^ 0x77aa) < noise;
        if own { level(i) } else { level(((y >> patch) * width + (x >> patch)) ^ 0x00ff_0000) }
    };
    (0..width * height).map(at).collect()
}

/// Balls before a tilted floor, seen by a camera that is nowhere special.
fn random_surface(extent: [usize; 2], seed: u32) -> Surface {
    let [width, height] = extent.map(|e| e as f64);
    let tan = 0.3 + 0.5 * unit(0, seed);
    let ray = [tan * width / height, -tan, 0.1 * unit(1, seed), -0.1 * unit(2, seed)];
    let axes = DMat3::from_rotation_y(6.0 * unit(3, seed)) * DMat3::from_rotation_x(unit(4, seed) - 0.5);
    let ball = |k: usize| {
        let [x, y, z] = [5, 6, 7].map(|j| unit(10 * k + j, seed));
        (DVec3::new(2.0 * x - 1.0, 2.0 * y - 1.0, -2.0 - 2.0 * z), 0.2 + 0.5 * unit(10 * k + 8, seed))
    };
    let balls: Vec<_> = (0..1 + (unit(9, seed) * 4.0) as usize).map(ball).collect();
    let tilt = DVec3::new(0.0, 1.0, 0.3 * unit(8, seed)).normalize();
    let seen = |i: usize| {
        let (x, y) = ((i % extent[0]) as f64, (i / extent[0]) as f64);
        let v = DVec3::new(
            ((x + 0.5) / width * 2.0 - 1.0) * ray[0] + ray[2],
            ((y + 0.5) / height * 2.0 - 1.0) * ray[1] + ray[3],
            -1.0,
        );
        let floor = -0.8 / tilt.dot(v);
        let mut nearest = (floor > 0.0 && floor < 8.0).then_some((floor, tilt, 9));
        for (k, (centre, radius)) in balls.iter().enumerate() {
            let (a, b) = (v.length_squared(), v.dot(*centre));
            let root = b * b - a * (centre.length_squared() - radius * radius);
            let depth = (b - root.max(0.0).sqrt()) / a;
            if root > 0.0 && nearest.is_none_or(|(d, ..)| depth < d) {
                nearest = Some((depth, (v * depth - *centre) / *radius, k as u32));
            }
        }
        nearest.map(|(depth, n, object)| Sample { object, depth, normal: axes * n })
    };
    Surface { extent, samples: (0..extent[0] * extent[1]).map(seen).collect(), axes, ray }
}

/// The sources and values of a map: panics where a covered sample has no value, or another than the constant.
fn holes(surface: &Surface, map: &[u8], top: u32) -> usize {
    let pyramid = Pyramid::new(surface, map, top);
    let sources = twin::classify(surface, &pyramid);
    let constant = DVec3::new(0.1, 3e4, 0.7);
    let values = twin::upsample(&pyramid, &sources, |_, _| constant);
    for (i, (sample, value)) in surface.samples.iter().zip(&values[0]).enumerate() {
        assert_eq!(sample.map(|_| constant), *value, "sample {i} of {:?}", surface.extent);
    }
    sources.iter().flatten().filter(|source| source.is_shaded()).count()
}

#[test]
fn ten_thousand_random_maps_leave_no_hole_and_keep_a_constant() {
    let shaded: usize = (0..10_000u32)
        .into_par_iter()
        .map(|seed| {
            let extent = match SIZES.get(seed as usize / 8) {
                Some(size) => size.map(|e| e as usize),
                None => [0, 1].map(|k| 1 + (unit(k, seed ^ 0x1234) * 40.0) as usize),
            };
            let surface = random_surface(extent, seed);
            holes(&surface, &random_levels(extent, seed), seed % 6)
        })
        .sum();
    assert!(shaded > 100_000, "{shaded}");
}

#[test]
fn cells_are_what_all_their_samples_say() {
    for (seed, extent) in (0..).zip([[64, 64], [61, 33], [1, 1], [3, 50]]) {
        let surface = random_surface(extent, seed);
        let map = random_levels(extent, seed);
        let pyramid = Pyramid::new(&surface, &map, 5);
        for level in 0..=5u32 {
            let [width, height] = pyramid.extents[level as usize];
            assert_eq!([width, height], extent.map(|e| e.div_ceil(1 << level)));
            for i in 0..width * height {
                let [x, y] = [i % width, i / width];
                let inside = |s: &usize| (s % extent[0]) >> level == x && (s / extent[0]) >> level == y;
                let covered: Vec<_> =
                    (0..extent[0] * extent[1]).filter(inside).filter(|s| surface.samples[*s].is_some()).collect();
                let least = covered.iter().map(|s| u32::from(map[*s]).min(5)).min();
                let cell = pyramid.cell(level, [x, y]);
                assert_eq!(cell.map(|c| c.level), least, "level {level} at {x}, {y}");
                if let Some(cell) = cell {
                    let at = cell.sample[1] * extent[0] + cell.sample[0];
                    let seen = surface.samples[at].unwrap();
                    assert!(covered.contains(&at));
                    assert_eq!((cell.object, cell.depth), (seen.object, seen.depth));
                    if level == 1 {
                        let off = |s: usize| (s % extent[0]).abs_diff(2 * x + 1) + (s / extent[0]).abs_diff(2 * y + 1);
                        assert_eq!(Some(off(at)), covered.iter().map(|s| off(*s)).min());
                    }
                }
            }
        }
    }
}

fn session(world: &World, config: &Config) -> Session {
    let options = Options { device: Some("llvmpipe".into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    Session::new(headless, world, config).unwrap()
}

fn scene(name: &str) -> World {
    Scene::load(name, &[]).unwrap().resolve().unwrap()
}

/// What the last frame saw.
fn surface(session: &mut Session, world: &World, config: &Config) -> Surface {
    let (texels, _, extent) = session.image("surface").unwrap();
    let (ids, ..) = session.image("ids").unwrap();
    let (texels, ids): (Vec<[f32; 4]>, Vec<u32>) = (bytemuck::pod_collect_to_vec(&texels), bytemuck::pod_collect_to_vec(&ids));
    let sample = |([x, y, z, depth], id): (&[f32; 4], &u32)| {
        let object = id.checked_sub(1)? >> 16;
        let normal = DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
        Some(Sample { object, depth: f64::from(*depth), normal })
    };
    let tan = (world.camera.fov_y.to_radians() / 2.0).tan();
    let aspect = f64::from(config.extent[0]) / f64::from(config.extent[1]);
    let samples = texels.iter().zip(&ids).map(sample).collect();
    let extent = extent.map(|e| e as usize);
    Surface { extent, samples, axes: world.camera.world_from_view(), ray: [tan * aspect, -tan, 0.0, 0.0] }
}

/// The device's pyramid, sources and values of the last frame.
struct Frame {
    pyramid: Pyramid,
    sources: Vec<Vec<Source>>,
    values: Vec<Vec<DVec3>>,
}

impl Frame {
    /// `of` gives extents and depths of the samples, `top` the coarsest level.
    fn read(session: &mut Session, of: &Pyramid) -> Self {
        let top = of.extents.len() - 1;
        let (words, blocks) = (session.words("cells").unwrap(), session.words("blocks").unwrap());
        let (weights, counts) = (session.words("weights").unwrap(), session.words("block arguments").unwrap());
        let mut cells = vec![of.cells[0].clone()];
        let mut sources: Vec<_> = of.extents.iter().map(|[w, h]| vec![Source::None; w * h]).collect();
        let mut first = 0;
        for level in 1..=top {
            let [width, height] = of.extents[level];
            let cell = |i: usize| {
                let word = words[2 * (first + i)];
                let place = [i % width, i / width].map(|p| p << level);
                let sample = [place[0] + (word >> 3 & 31) as usize, place[1] + (word >> 8 & 31) as usize];
                let depth = f64::from(f32::from_bits(words[2 * (first + i) + 1]));
                (word & 7 != 7).then_some(twin::Cell { level: word & 7, sample, object: word >> 16, depth })
            };
            cells.push((0..width * height).map(cell).collect());
            for slot in first..first + counts[4 * level + 3] as usize {
                let [x, y] = [blocks[2 * slot] & 0xffff, blocks[2 * slot] >> 16].map(|p| 2 * p as usize);
                let below = of.extents[level - 1];
                for k in 0..4 {
                    let word = weights[4 * slot + k];
                    let [x, y] = [x + k % 2, y + k / 2];
                    let steps = [0, 8, 16].map(|shift| f64::from(word >> shift & 255) / 255.0);
                    let found = twin::Weights { steps, valid: f64::from(word >> 24 & 63) / 63.0 };
                    if word >> 30 == 0 {
                        continue;
                    }
                    let source = &mut sources[level - 1][y * below[0] + x];
                    assert_eq!(*source, Source::None, "decided twice");
                    *source = match (word >> 30, word & 0x3fff_ffff) {
                        (1, 0) => Source::Shading,
                        (1, _) => Source::Refused(found),
                        _ => Source::Parents(found),
                    };
                }
            }
            first += width * height;
        }
        let mut listed = BTreeSet::new();
        for ([x, y], level) in levels::shaded(session).unwrap() {
            assert!(listed.insert((level, x, y)), "{x}, {y} is listed twice at level {level}");
            let at = [x, y].map(|p| p as usize >> level);
            if level as usize == top {
                sources[top][at[1] * of.extents[top][0] + at[0]] = Source::Shading;
            }
        }
        let pyramid = Pyramid { extents: of.extents.clone(), cells };
        let mut shaded = BTreeSet::new();
        for (level, sources) in (0u32..).zip(&sources) {
            let width = of.extents[level as usize][0];
            for (i, _) in sources.iter().enumerate().filter(|(_, source)| source.is_shaded()) {
                let [x, y] = pyramid.cell(level, [i % width, i / width]).unwrap().sample.map(|p| p as u32);
                shaded.insert((level, x, y));
            }
        }
        assert_eq!(listed, shaded, "the list and the sources");
        let images = ["radiance", "odd"].map(|name| {
            let (bytes, _, [width, _]) = session.image(name).unwrap();
            (bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&bytes), width as usize)
        });
        let value = |(level, &[width, height]): (usize, &[usize; 2])| {
            let (texels, stride) = &images[level % 2];
            let row: usize = (level % 2..level).step_by(2).map(|l| of.extents[l][1]).sum();
            let at = |i: usize| texels[(row + i / width) * stride + i % width].map(f64::from);
            (0..width * height).map(|i| DVec3::from_slice(&at(i)[..3])).collect()
        };
        let values = of.extents.iter().enumerate().map(value).collect();
        Self { pyramid, sources, values }
    }

    /// Whether the device decided as the twin did: borderline shares may fall either way.
    fn agrees(&self, expected: &[Vec<Source>]) {
        let parts = |w: &twin::Weights| {
            let [top, bottom, down] = w.steps;
            [(1.0 - top) * (1.0 - down), top * (1.0 - down), (1.0 - bottom) * down, bottom * down]
        };
        let close = |a: &twin::Weights, b: &twin::Weights| {
            let near = parts(a).into_iter().zip(parts(b)).all(|(a, b)| (a - b).abs() < 2.02 / 255.0);
            near && (a.valid - b.valid).abs() < 0.51 / 63.0
        };
        for (level, (got, expected)) in self.sources.iter().zip(expected).enumerate() {
            for (i, pair) in got.iter().zip(expected).enumerate() {
                let fits = match pair {
                    (Source::Parents(a), Source::Parents(b)) => close(a, b),
                    // Of parents without weight nothing is left but their share; without that it looks like never asked.
                    (Source::Refused(a), Source::Refused(b)) => (a.valid - b.valid).abs() < 0.51 / 63.0,
                    (Source::Shading, Source::Refused(b)) => b.valid < 0.51 / 63.0,
                    (Source::Parents(a), Source::Refused(b)) | (Source::Refused(a), Source::Parents(b)) => {
                        close(a, b) && (b.valid - twin::ACCEPT).abs() < 1e-4
                    }
                    (a, b) => a == b,
                };
                assert!(fits, "level {level}, cell {i}: {pair:?}");
            }
        }
    }

    /// Up-samples the device's own shaded values as the device decided.
    fn checked_values(&self, surface: &Surface) {
        let width = |level: u32| self.pyramid.extents[level as usize][0];
        let shade = |sample: [usize; 2], level: u32| {
            let [x, y] = sample.map(|p| p >> level);
            self.values[level as usize][y * width(level) + x]
        };
        let values = twin::upsample(&self.pyramid, &self.sources, shade);
        for (i, sample) in surface.samples.iter().enumerate() {
            assert_eq!(sample.is_some(), values[0][i].is_some(), "sample {i}");
        }
        let largest = values.iter().flatten().flatten().fold(0.0, |m: f64, v| m.max(v.max_element()));
        for (level, (got, expected)) in self.values.iter().zip(&values).enumerate() {
            for (i, (got, expected)) in got.iter().zip(expected).enumerate() {
                if let Some(expected) = expected {
                    let error = (*got - *expected).abs().max_element();
                    assert!(
                        error <= 1e-6 * expected.max_element() + 1e-7 * largest,
                        "level {level}, cell {i}: {got} for {expected}"
                    );
                }
            }
        }
    }
}

/// Frames of random levels, and what the twin makes of the same surface.
fn against_the_twin(world: &World, config: &Config, maps: u32) {
    let mut session = session(world, config);
    let [width, height] = config.extent.map(|e| (e * config.samples_per_side) as usize);
    let top = config.lmax + config.samples_per_side.ilog2();
    for seed in 0..maps {
        let map = random_levels([width, height], 100 + seed);
        session.set_levels(&map).unwrap();
        session.frame([seed, 0]).unwrap();
        let surface = surface(&mut session, world, config);
        let pyramid = Pyramid::new(&surface, &map, top);
        let frame = Frame::read(&mut session, &pyramid);
        assert_eq!(frame.pyramid, pyramid, "{:?}, map {seed}", config.extent);
        frame.agrees(&twin::classify(&surface, &pyramid));
        frame.checked_values(&surface);
        // The layers: levels as the pyramid has them, and a share of weight wherever parents gave the value.
        let levels = levels::coarsest(&mut session).unwrap();
        let weights = levels::weights(&mut session).unwrap();
        for (i, level) in levels.iter().enumerate() {
            let at = [i % width, i / width];
            let has = |l: &u32| pyramid.cell(*l, at.map(|p| p >> l)).is_some_and(|cell| cell.level >= *l);
            assert_eq!(*level, (1..=top).filter(has).max().unwrap_or(0));
            let source = frame.sources[0][i];
            assert!(!matches!(source, Source::Parents(_)) || weights[i] > 0.49, "{source:?}: {}", weights[i]);
        }
        assert_eq!(session.messages(), [""; 0]);
    }
}

#[test]
fn passes_are_as_their_twin() {
    let given = |extent, lmax| Config { rate: Rate::Given, lmax, ..config(extent, Estimator::Mis, 2) };
    let trio = scene("trio");
    against_the_twin(&trio, &given([192, 128], 3), 6);
    against_the_twin(&trio, &given([99, 77], 5), 4);
    against_the_twin(&trio, &given([50, 131], 1), 3);
    against_the_twin(&trio, &Config { samples_per_side: 2, ..given([61, 43], 3) }, 3);
    against_the_twin(&scene("sphere"), &given([1, 1], 5), 6);
}

#[test]
fn built_in_scenes_have_no_hole() {
    for (name, _) in Scene::builtin_names() {
        let world = scene(name);
        for size in SIZES {
            against_the_twin(&world, &Config { rate: Rate::Given, ..config(size, Estimator::Brdf, 1) }, 1);
        }
    }
}

/// Of two images where the first is covered, over its mean.
fn nrmse(a: &frames::Image, b: &frames::Image) -> f64 {
    let covered = (0..a.texels.len()).filter(|i| a.coverage(*i) > 0.0);
    let (error, sum, n) = covered.fold((0.0, 0.0, 0.0), |(error, sum, n), i| {
        (error + (a.radiance(i) - b.radiance(i)).length_squared(), sum + a.radiance(i).length(), n + 1.0)
    });
    (error / n).sqrt() / (sum / n)
}

#[test]
fn uniform_rates_come_near_the_full_image() {
    let model = ggx(0.3, DVec3::splat(0.4), DVec3::new(0.3, 0.2, 0.1));
    let world = world("torus-knot", 128, model, builtin::environment("studio", 128).unwrap());
    let size = [192, 160];
    let frame = |rate| {
        let config = Config { rate, ..config(size, Estimator::Mis, 512) };
        let mut stage = Stage::new(&world, &config);
        let image = stage.frame([3, 0]);
        assert!(stage.frame([3, 0]) == image, "two runs differ");
        image
    };
    let full = frame(Rate::Full);
    assert!(frame(Rate::Uniform(0)) == full, "level 0 is the full rate");
    let errors = [1, 2, 3].map(|level| nrmse(&full, &frame(Rate::Uniform(level))));
    println!("normalised RMSE at levels 1, 2, 3: {errors:?}");
    for (error, bound) in errors.into_iter().zip([0.055, 0.16, 0.36]) {
        assert!(error > 1e-4 && error < bound, "{errors:?}");
    }
}

#[test]
fn shading_is_saved_and_counted() {
    let world = scene("torus-knot");
    let shaded = |rate, side| {
        let config = Config { rate, samples_per_side: side, ..config([256, 256], Estimator::Brdf, 1) };
        let mut session = session(&world, &config);
        session.frame([0, 0]).unwrap();
        let passes: Vec<_> = session.pass_bytes().iter().map(|(name, _)| *name).collect();
        (f64::from(session.shaded().unwrap()), passes)
    };
    let (full, passes) = shaded(Rate::Full, 1);
    assert_eq!(passes, ["gbuffer", "classify", "shade", "resolve"], "nothing else at the full rate");
    let (half, passes) = shaded(Rate::Uniform(1), 1);
    assert_eq!(passes, ["gbuffer", "level", "pyramid", "classify", "shade", "upsample", "resolve"]);
    let (quarter, _) = shaded(Rate::Uniform(2), 1);
    assert!((0.25..0.30).contains(&(half / full)), "{half} of {full}");
    assert!((0.0625..0.10).contains(&(quarter / full)), "{quarter} of {full}");
    // Once an output pixel and less than once more at the edges, of four samples each.
    let (pixels, _) = shaded(Rate::Uniform(0), 2);
    assert!((1.0..1.2).contains(&(pixels / full)), "{pixels} of {full}");
}

/// A wall under a light from its front: the same radiance everywhere, but for rounding.
#[test]
fn a_constant_stays() {
    let matte = Model::BlinnPhong(BlinnPhong { exponent: 1.0, specular: DVec3::ZERO, albedo: DVec3::new(0.8, 0.4, 0.1) });
    let dark = LatLong::new(4, 2, vec![[0.0; 3]; 8]).unwrap();
    let mut wall = world("plane", 16, matte, dark);
    wall.camera.position = DVec3::new(0.0, 3.6, 0.0);
    wall.camera.up = DVec3::Z;
    wall.lights = vec![Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [3.0; 3] }];
    wall.environment = None;
    let config = Config { rate: Rate::Given, lmax: 5, ..config([130, 90], Estimator::Mis, 2) };
    let mut session = session(&wall, &config);
    for seed in 0..4 {
        session.set_levels(&random_levels([130, 90], seed)).unwrap();
        session.frame([seed, 0]).unwrap();
        let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
        let covered: Vec<_> = texels.iter().filter(|t| t[3] == 1.0).collect();
        assert!(covered.len() > 3000);
        for texel in covered {
            for (value, albedo) in texel.iter().zip([0.8, 0.4, 0.1]) {
                let expected = 3.0 * albedo / std::f64::consts::PI;
                assert!((f64::from(*value) - expected).abs() < 2e-6 * expected, "{texel:?}");
            }
        }
    }
}

#[test]
fn objects_do_not_bleed_into_each_other() {
    let black = Model::BlinnPhong(BlinnPhong { exponent: 1.0, specular: DVec3::ZERO, albedo: DVec3::ZERO });
    let mut pair = world("torus-knot", 128, black, builtin::environment("constant", 16).unwrap());
    let mut wall = world("plane", 16, ggx(0.8, DVec3::splat(0.04), DVec3::ONE), LatLong::new(1, 1, vec![[0.0; 3]]).unwrap());
    wall.objects[0].transform = glam::Mat4::from_translation(glam::vec3(0.0, -0.2, -1.5))
        * glam::Mat4::from_rotation_x(1.5)
        * glam::Mat4::from_scale(glam::Vec3::splat(1.4));
    wall.objects[0].material = 1;
    pair.objects.append(&mut wall.objects);
    pair.materials.push(Material { name: "white".into(), ..wall.materials.remove(0) });
    for level in 1..=4 {
        let config = Config { rate: Rate::Uniform(level), ..config([200, 150], Estimator::Mis, 64) };
        let mut session = session(&pair, &config);
        session.frame([1, 0]).unwrap();
        let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
        let ids: Vec<u32> = bytemuck::pod_collect_to_vec(&session.image("ids").unwrap().0);
        let mut seen = [0; 2];
        for (texel, id) in texels.iter().zip(ids).filter(|(_, id)| *id != 0) {
            let object = ((id - 1) >> 16) as usize;
            seen[object] += 1;
            let fits = if object == 0 { texel[1] == 0.0 } else { texel[1] > 0.7 };
            assert!(fits, "level {level}, object {object}: {texel:?}");
        }
        assert!(seen.iter().all(|n| *n > 1500), "{seen:?}");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let ball = scene("sphere");
    let base = config([24, 16], Estimator::Mis, 2);
    for (changed, field) in [
        (Config { rate: Rate::Uniform(6), ..base.clone() }, "Config::rate"),
        (Config { rate: Rate::Uniform(u32::MAX), ..base.clone() }, "Config::rate"),
        (Config { rate: Rate::Uniform(5), samples_per_side: 2, ..base.clone() }, "Config::rate"),
        (Config { lmax: 6, ..base.clone() }, "Config::lmax"),
        (Config { rate: Rate::Given, extent: [16384, 1], samples_per_side: 2, ..base.clone() }, "Config::extent"),
    ] {
        let options = Options { device: Some("llvmpipe".into()), validate: true };
        let headless = Headless::new(&options, &Requirements::of(&base)).unwrap();
        let error = Session::new(headless, &ball, &changed).err().unwrap().to_string();
        assert!(error.contains(field), "{error}");
    }
    let mut none = session(&ball, &Config { rate: Rate::Given, ..base.clone() });
    let error = none.frame([0, 0]).unwrap_err();
    let passband::offline::error::Error::Library(Error::InvalidInput { field, .. }) = &error else { panic!("{error:?}") };
    assert_eq!(field, "levels");
    assert!(none.set_levels(&[0; 23]).is_err());
    none.set_levels(&[0; 24 * 16]).unwrap();
    none.frame([0, 0]).unwrap();
    let mut full = session(&ball, &base);
    full.set_levels(&[0; 24 * 16]).unwrap();
    assert!(full.frame([0, 0]).unwrap_err().to_string().contains("levels"));
}
