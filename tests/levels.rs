//! Shading at levels: the passes against their twin in f64, no sample without a value, and what up-sampling does to images.

#[path = "support/chosen_device.rs"]
mod chosen_device;
#[path = "support/frames.rs"]
mod frames;
#[path = "support/levels.rs"]
mod read_back;

use chosen_device::DEVICE;
use frames::{Stage, config, ggx, world};
use glam::DVec3;
use passband::frequency::reconstruction::{self as twin, Pyramid, Source, Surface};
use passband::offline::headless::{Headless, Options};
use passband::offline::scene::Scene;
use passband::offline::session::Session;
use passband::offline::world::{Material, World};
use passband::offline::{builtin, levels};
use passband::reflectance::{BlinnPhong, Model};
use passband::sampling::LatLong;
use passband::{Config, Error, Estimator, Light, Rate, Requirements};
use rayon::prelude::*;
use read_back::{Frame, random_levels, random_surface, scene, session, surface, unit};

const SIZES: [[u32; 2]; 3] = [[512, 512], [500, 333], [1, 1]];

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
    // The tilted planes are one picture of eight materials.
    let alike = |name: &str| name == "microgeometry" || name.ends_with("-plane") && name != "checker-plane";
    for (name, _) in Scene::builtin_names().into_iter().filter(|(name, _)| !alike(name)) {
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
fn runs_are_bit_identical() {
    let world = scene("trio");
    let config = Config { rate: Rate::Given, ..config([150, 101], Estimator::Mis, 4) };
    let run = |seed| {
        let mut session = session(&world, &config);
        session.set_levels(&random_levels([150, 101], 5)).unwrap();
        let mut image = || {
            session.frame([seed, 0]).unwrap();
            session.image("resolved").unwrap().0
        };
        [image(), image()]
    };
    let [first, again] = run(1);
    assert!(first == again && [first.clone(), again] == run(1));
    assert!(first != run(2)[0], "another seed is another image");
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
    assert_eq!(passes, ["gbuffer", "filter", "classify", "shade", "resolve"], "nothing else at the full rate");
    let (half, passes) = shaded(Rate::Uniform(1), 1);
    assert_eq!(passes, ["gbuffer", "filter", "level", "pyramid", "classify", "shade", "upsample", "resolve"]);
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
        let options = Options { device: Some(DEVICE.into()), validate: true };
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
