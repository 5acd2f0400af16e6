//! Estimators agree with closed forms, with the reference and with each other, and frames are what their settings say.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod filters;
    pub mod frames;
    pub mod statistics;
}

use chosen_device::DEVICE;
use glam::{DQuat, DVec2, DVec3, Mat4};
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::reference::Reference;
use passband::offline::scene::Scene;
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::reflectance::{Model, Reflectance};
use passband::sampling::LatLong;
use passband::{Config, Estimator, Filter, Light, Maps, Rate, Requirements};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use support::filters;
use support::frames::{Expected, Image, Stage, config, expected, furthest, ggx, ratio, table, tiles, world};
use support::statistics::Mean;

const EXTENT: [u32; 2] = [32, 32];

fn sky(name: &str) -> LatLong {
    builtin::environment(name, 128).unwrap()
}

/// The directional albedo towards cosine `c`, by midpoints over half vectors in `theta_h = atan(alpha tan(x))`, which spreads a
/// lobe of any alpha evenly.
fn albedo(model: &Model, alpha: f64, c: f64) -> DVec3 {
    const STEPS: u32 = 256;
    let wo = DVec3::new((1.0 - c * c).sqrt(), 0.0, c);
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    let mut sum = DVec3::ZERO;
    for i in 0..STEPS {
        let x = middle(i) * FRAC_PI_2;
        let theta = (alpha * x.tan()).atan();
        let step = alpha / (x.cos().powi(2) + (alpha * x.sin()).powi(2)) * FRAC_PI_2 / f64::from(STEPS);
        for j in 0..STEPS {
            let phi = middle(j) * PI;
            let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let wi = h * (2.0 * wo.dot(h)) - wo;
            if wi.z > 0.0 && wo.dot(h) > 0.0 {
                // Both signs of the azimuth; d(wi) = 4 (wo.h) d(h).
                sum += model.evaluate(wi, wo) * (wi.z * 4.0 * wo.dot(h) * theta.sin() * step * TAU / f64::from(STEPS));
            }
        }
    }
    sum
}

/// Rendered over expected, image or 16x16 tile, whichever is furthest off, for a lone object under constant light of `factor`.
fn furnace(world: &World, alpha: f64, factor: f64) -> f64 {
    let reference = Reference::new(world, EXTENT, Default::default()).unwrap();
    let mut stage = Stage::new(world, &config(EXTENT, Estimator::Mis, 16384));
    let image = stage.frame([3, 0]);
    let model = &world.materials[0].model;
    // The albedo is smooth in the cosine: tabulated once, interpolated linearly.
    const NODES: usize = 64;
    let node = |i: usize| albedo(model, alpha, (i as f64 / NODES as f64).max(0.01));
    let nodes: Vec<DVec3> = (0..=NODES).into_par_iter().map(node).collect();
    let mut pixels = Vec::new();
    for (i, hit) in reference.hits().iter().enumerate() {
        let Some(hit) = hit else { continue };
        let x = hit.normal.dot(hit.view).min(1.0) * NODES as f64;
        let k = (x as usize).min(NODES - 1);
        if x > 2.0 {
            pixels.push((i, nodes[k].lerp(nodes[k + 1], x - k as f64) * factor));
        }
    }
    let expected = Expected { extent: EXTENT, pixels, error: 0.0 };
    let radiance = |i: usize| image.radiance(i);
    furthest(tiles(&expected, 64, radiance).into_iter().chain([ratio(&expected.pixels, radiance)]))
}

#[test]
fn under_constant_light_an_object_shows_its_albedo() {
    let scene = Scene::load("furnace", &[]).unwrap().resolve().unwrap();
    let worst = furnace(&scene, 0.2, 1.0);
    println!("scene furnace: {worst:.6}");
    assert!((worst - 1.0).abs() < 1e-3, "{worst}");
    for (alpha, rotation, intensity) in [(0.05, 0.0, 1.0), (0.3, 37.0, 1.0), (0.6, -200.0, 2.5), (1.0, 0.0, 0.01)] {
        let model = ggx(alpha, DVec3::new(1.0, 0.5, 0.04), DVec3::new(0.0, 0.3, 0.8));
        let mut world = world("sphere", 64, model, sky("constant"));
        let light = world.environment.as_mut().unwrap();
        (light.rotation, light.intensity) = (rotation, intensity);
        let worst = furnace(&world, alpha, intensity);
        println!("alpha {alpha}, turned by {rotation}, times {intensity}: {worst:.6}");
        assert!((worst - 1.0).abs() < 1e-3, "alpha {alpha}: {worst}");
    }
}

/// For the packing of tables and for the quadrature.
const ROUNDING: f64 = 5e-4;

/// The mean over `frames` seeds of the interior pixels' sum over the reference's, in each channel, and its standard errors.
fn mean_ratios(label: &str, world: &World, config: &Config, frames: u32) -> [[f64; 3]; 2] {
    let expected = expected(world, EXTENT, |interior| interior);
    let truth: DVec3 = expected.pixels.iter().map(|(_, radiance)| *radiance).sum();
    let mut stage = Stage::new(world, config);
    let mut means: [Mean; 3] = Default::default();
    for frame in 0..frames {
        let image = stage.frame([11, frame]);
        let sum: DVec3 = expected.pixels.iter().map(|(i, _)| image.radiance(*i)).sum();
        means.iter_mut().zip((sum / truth).to_array()).for_each(|(mean, ratio)| mean.add(ratio));
    }
    let ratios = [0, 1, 2].map(|c| means[c].mean());
    let errors = [0, 1, 2].map(|c| means[c].error());
    println!("{label}: {ratios:.5?}, standard errors {errors:.5?}");
    [ratios, errors]
}

/// That it is the reference's: within 4 standard errors, which must be below `precision` of it, and `bias`.
fn assert_unbiased(label: &str, world: &World, config: &Config, frames: u32, [precision, bias]: [f64; 2]) {
    let [ratios, errors] = mean_ratios(label, world, config, frames);
    for (ratio, error) in ratios.into_iter().zip(errors) {
        assert!(error < precision, "{label}: a standard error of {error}");
        assert!((ratio - 1.0).abs() <= 4.0 * error + bias, "{label}: {ratio} +- {error}");
    }
}

#[test]
fn every_estimator_has_the_reference_as_its_mean() {
    let coated = ggx(0.3, DVec3::new(0.6, 0.3, 0.05), DVec3::new(0.1, 0.3, 0.6));
    for (mesh, model) in [("bumpy-sphere", table("metallic-paint")), ("torus-knot", coated)] {
        let world = world(mesh, 48, model, sky("studio"));
        for estimator in [Estimator::Mis, Estimator::Brdf, Estimator::BrdfRandom, Estimator::Cv] {
            let exact = Config { exact_lobes: true, residual_errors: [0.0; 3], ..config(EXTENT, estimator, 128) };
            // Beside looked-up light there is little noise.
            let frames = if estimator.looks_up() { 48 } else { 256 };
            assert_unbiased(&format!("{mesh}, {estimator:?}"), &world, &exact, frames, [2e-3, ROUNDING]);
        }
        // What looks light up is nearly what the estimate takes it for.
        assert_unbiased(&format!("{mesh}, look-ups"), &world, &config(EXTENT, Estimator::Cv, 128), 48, [2e-3, 2e-3]);
        assert_no_worse_than_lobes(mesh, &world);
    }
}

/// Where noise is larger than what the lobes lack a residual leaves them as they are, which is no estimate without bias; but it is
/// hardly further away than they are with few directions, and nearer with more.
fn assert_no_worse_than_lobes(mesh: &str, world: &World) {
    let expected = expected(world, EXTENT, |interior| interior);
    let error = |estimator, directions| {
        let (rate, lmax) = if estimator == Estimator::Residual { (Rate::Bandwidth, 0) } else { (Rate::Full, 0) };
        let config = Config { rate, lmax, residual_errors: [0.0; 3], ..config(EXTENT, estimator, directions) };
        let image = Stage::new(world, &config).frame([11, 0]);
        let squares = expected.pixels.iter().map(|(i, truth)| ((image.radiance(*i) - truth) / truth).length_squared());
        (squares.sum::<f64>() / expected.pixels.len() as f64).sqrt()
    };
    let lobes = error(Estimator::Preconvolved, 1);
    let [few, some, many] = [16, 128, 1024].map(|directions| error(Estimator::Residual, directions));
    println!(
        "{mesh}: relative error of lobes {lobes:.5}, with 16, 128, 1024 directions of what they lack {few:.5} {some:.5} {many:.5}"
    );
    assert!(few < 1.3 * lobes && some < 0.8 * lobes && many < 0.6 * lobes, "{mesh}: {lobes} {few} {some} {many}");
}

#[test]
fn few_directions_are_as_unbiased_as_many() {
    let world = world("sphere", 64, table("metallic-paint"), sky("studio"));
    for (directions, frames) in [(2, 2048), (3, 2048), (64, 128)] {
        let config = config(EXTENT, Estimator::Mis, directions);
        assert_unbiased(&format!("{directions} directions"), &world, &config, frames, [2e-3, ROUNDING]);
    }
}

/// Points that are well spread must stay so on their way to directions: a mirror-like lobe under a small sun tells.
#[test]
fn a_small_sun_in_a_mirror_is_not_noisy() {
    let world = world("sphere", 64, table("mirror-metal"), sky("sun-sky"));
    let expected = expected(&world, EXTENT, |interior| interior);
    let mut stage = Stage::new(&world, &config(EXTENT, Estimator::Mis, 1024));
    let mut mean = Mean::default();
    for frame in 0..32 {
        let image = stage.frame([5, frame]);
        mean.add(ratio(&expected.pixels, |i| image.radiance(i)));
    }
    println!("one frame deviates by {:.5}", mean.deviation());
    assert!(mean.deviation() < 2.5e-3, "{}", mean.deviation());
}

/// Frames of one estimator: each pixel's radiance in each, its mean and its variance summed over channels.
struct Frames {
    images: Vec<Vec<DVec3>>,
    mean: Vec<DVec3>,
    variance: Vec<f64>,
}

impl Frames {
    fn new(world: &World, config: &Config, seed: u32, count: u32) -> Self {
        let mut stage = Stage::new(world, config);
        let mut radiance = |frame| {
            let image = stage.frame([seed, frame]);
            (0..image.texels.len()).map(|i| image.radiance(i)).collect::<Vec<_>>()
        };
        let images: Vec<Vec<DVec3>> = (0..count).map(&mut radiance).collect();
        let n = f64::from(count);
        let pixel = |i: usize| {
            let mean = images.iter().map(|image| image[i]).sum::<DVec3>() / n;
            (mean, images.iter().map(|image| (image[i] - mean).length_squared()).sum::<f64>() / (n - 1.0))
        };
        let (mean, variance) = (0..images[0].len()).map(pixel).unzip();
        Self { images, mean, variance }
    }

    /// The mean of frames' sums, and the variance of that: a frame's pixels are not independent of each other.
    fn sum(&self) -> [f64; 2] {
        let sums: Vec<f64> = self.images.iter().map(|image| image.iter().sum::<DVec3>().element_sum()).collect();
        let n = sums.len() as f64;
        let mean = sums.iter().sum::<f64>() / n;
        [mean, sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))]
    }

    /// How far single frames are from those of `other` beyond what the noise of both says, in dB; the difference of the means over the
    /// mean; and the latter's standard error.
    fn beside(&self, other: &Self) -> [f64; 3] {
        let (mut difference, mut noise) = (0.0, 0.0);
        for i in (0..self.mean.len()).filter(|i| other.mean[*i].element_sum() > 0.0) {
            // Relative to the pixel, so that no few of them are all.
            let weight = 1.0 / other.mean[i].length_squared();
            let pairs = other.images.iter().zip(self.images.iter().cycle());
            let between = pairs.map(|(b, a)| (a[i] - b[i]).length_squared()).sum::<f64>();
            difference += weight * between / other.images.len() as f64;
            noise += weight * (self.variance[i] + other.variance[i]);
        }
        let ([a, of_a], [b, of_b]) = (self.sum(), other.sum());
        [10.0 * (difference / noise).log10(), (a - b) / b, (of_a + of_b).sqrt() / b]
    }
}

/// Taken to be what look-ups hold of them, lobes leave nothing that makes `cv` differ from plain sampling but its noise; as they are looked up
/// in frames they leave nearly nothing. Noise of single frames is far above the rounding to half floats, which would be taken for a difference.
#[test]
#[ignore = "minutes"]
fn looked_up_light_changes_no_mean_on_six_scenes() {
    let coated = ggx(0.3, DVec3::new(0.6, 0.3, 0.05), DVec3::new(0.1, 0.3, 0.6));
    let scenes = [
        ("sphere", "metallic paint", table("metallic-paint"), "sun-sky"),
        ("sphere", "rough", table("rough"), "studio"),
        ("bumpy-sphere", "coated", coated, "sun-sky"),
        ("bumpy-sphere", "satin", table("satin"), "sun-sky"),
        ("torus-knot", "satin", table("satin"), "studio"),
        ("torus-knot", "gloss plastic", table("gloss-plastic"), "sun-sky"),
    ];
    let mut worst = [0.0_f64; 3];
    for (mesh, name, model, light) in scenes {
        let world = world(mesh, 64, model, sky(light));
        let of = |estimator, exact_lobes, seed, count| {
            // As many directions as the exact mode has rounds for on lavapipe.
            Frames::new(&world, &Config { exact_lobes, ..config([128, 128], estimator, 192) }, seed, count)
        };
        let plain = of(Estimator::Mis, false, 1, 64);
        let [beyond, exact, error] = of(Estimator::Cv, true, 2, 16).beside(&plain);
        let [_, in_frames, _] = of(Estimator::Cv, false, 3, 16).beside(&plain);
        println!(
            "{mesh}, {name}, {light}: {beyond:+.3} dB, mean {exact:+.1e} (standard error {error:.1e}), in frames {in_frames:+.1e}"
        );
        worst = [worst[0].max(beyond.abs()), worst[1].max(exact.abs()), worst[2].max(in_frames.abs())];
    }
    let [beyond, exact, in_frames] = worst;
    assert!(beyond < 0.1 && exact < 5e-4 && in_frames < 2e-3, "{worst:?}");
}

/// Lobes about as narrow as the sun show its shape, which is that of its texels as they are looked up: as one point it is off by
/// several percent.
#[test]
fn a_sun_in_a_mirror_has_its_shape() {
    let mirror = ggx(0.015, DVec3::new(0.9, 0.8, 0.6), DVec3::ZERO);
    let world = world("sphere", 64, mirror, builtin::environment("sun-sky", 1024).unwrap());
    let frame = |estimator, directions| Stage::new(&world, &config(EXTENT, estimator, directions)).frame([3, 0]);
    let (plain, beside) = (frame(Estimator::Mis, 8192), frame(Estimator::Cv, 64));
    let covered = || (0..plain.texels.len()).filter(|i| plain.coverage(*i) > 0.0);
    let difference: f64 = covered().map(|i| plain.radiance(i).distance_squared(beside.radiance(i))).sum();
    let all: f64 = covered().map(|i| plain.radiance(i).length_squared()).sum();
    let error = (difference / all).sqrt();
    println!("relative to all light: {error:.5}");
    assert!(error < 5e-3, "{error}");
}

/// Some drivers end loops after so many rounds without a word: what would be cut short is refused, and the most that is not is whole.
#[test]
fn no_direction_is_left_out() {
    let mut bumps = filters::scene("sphere", filters::lobes(&[(0.0, 60.0), (0.2, 90.0), (-0.2, 20.0)]), Maps::default());
    bumps.materials[0].maps.normal = filters::normals([64; 2], 0.4);
    let mut ball = world("sphere", 32, table("satin"), sky("constant"));
    let light = |x: f32| Light::Directional { direction: [x, -1.0, -0.4], irradiance: [1.0, 2.0, 3.0] };
    ball.lights = [-0.4, 0.1, 0.5].map(light).into();
    for (world, filter) in [(&ball, Filter::Point), (&bumps, Filter::Point), (&bumps, Filter::Vmf8), (&bumps, Filter::Lean)] {
        let of = |directions| Config { filter, ..config([16, 12], Estimator::Mis, directions) };
        let mean = |directions| -> Result<f64, String> {
            let headless =
                Headless::new(&Options { device: Some(DEVICE.into()), validate: true }, &Requirements::of(&of(directions)));
            let mut session = Session::new(headless.unwrap(), world, &of(directions)).unwrap();
            session.frame([1, 0]).map_err(|e| e.to_string())?;
            let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
            Ok(texels.iter().flat_map(|t| &t[..3]).map(|c| f64::from(*c)).sum())
        };
        let said = match mean(65536) {
            Err(said) => said,
            // Another driver draws them all.
            Ok(all) => {
                let few = mean(8192).unwrap();
                assert!((all / few - 1.0).abs() < 0.01, "{filter:?}: {all} {few}");
                continue;
            }
        };
        let most: u32 = said.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(said.contains("Config::directions") && most > 1000 && mean(most + 1).is_err(), "{said}");
        let [whole, less] = [most, most / 8].map(|directions| mean(directions).unwrap());
        println!("{filter:?}: at most {most} directions, {:.1e} from what an eighth of them is", whole / less - 1.0);
        assert!((whole / less - 1.0).abs() < 0.01, "{filter:?}: {whole} {less}");
    }
}

#[test]
fn frames_depend_on_their_seeds_and_on_nothing_else() {
    let world = world("bumpy-sphere", 48, table("metallic-paint"), sky("sun-sky"));
    for estimator in [Estimator::Mis, Estimator::Brdf, Estimator::BrdfRandom, Estimator::Cv, Estimator::Residual] {
        let config = Config { residual_errors: [0.0; 3], ..config(EXTENT, estimator, 16) };
        let (mut one, mut other) = (Stage::new(&world, &config), Stage::new(&world, &config));
        let first = one.frame([1, 0]);
        let frames = [[1, 0], [2, 0], [1, 1], [1, 0]].map(|seed| other.frame(seed));
        assert!(first == frames[0] && first == frames[3], "{estimator:?}: two runs differ");
        for k in [1, 2] {
            let covered = (0..first.texels.len()).filter(|i| first.coverage(*i) > 0.0);
            let (mut same, mut count) = (0, 0);
            for i in covered {
                same += usize::from(first.texels[i] == frames[k].texels[i]);
                count += 1;
            }
            assert!(same * 100 < count, "{estimator:?}: {same} of {count} pixels are the same under another seed");
        }
    }
}

/// Everything but the environment turned about +Y.
fn turned(world: &World, degrees: f64) -> World {
    let turn = DQuat::from_rotation_y(degrees.to_radians());
    let mut world = world.clone();
    world.camera.position = turn * world.camera.position;
    for object in &mut world.objects {
        object.transform = Mat4::from_quat(turn.as_quat()) * object.transform;
    }
    world
}

/// `|a - b| / |b|` over all pixels.
fn distance(a: &Image, b: &Image) -> f64 {
    let square = |f: &dyn Fn(usize) -> DVec3| (0..b.texels.len()).map(|i| f(i).length_squared()).sum::<f64>();
    (square(&|i| a.radiance(i) - b.radiance(i)) / square(&|i| b.radiance(i))).sqrt()
}

#[test]
fn a_turned_environment_is_a_turned_world() {
    let mut plain = world("torus-knot", 48, table("metallic-paint"), sky("sun-sky"));
    plain.environment.as_mut().unwrap().visible = true;
    let image = |world: &World| Stage::new(world, &config(EXTENT, Estimator::Mis, 256)).frame([0, 0]);
    let expected = image(&plain);
    for degrees in [90.0, -30.0] {
        let mut world = turned(&plain, degrees);
        let wrong = distance(&image(&world), &expected);
        world.environment.as_mut().unwrap().rotation = degrees;
        let right = distance(&image(&world), &expected);
        println!("turned by {degrees}: {right:.2e}, without the environment {wrong:.2e}");
        assert!(right < 1e-3 && wrong > 0.1, "{degrees}: {right} {wrong}");
    }
}

#[test]
fn radiance_grows_with_intensity() {
    let mut world = world("bumpy-sphere", 48, table("rough"), sky("sun-sky"));
    world.environment.as_mut().unwrap().visible = true;
    let mut image = |intensity: f64| {
        world.environment.as_mut().unwrap().intensity = intensity;
        Stage::new(&world, &config(EXTENT, Estimator::Mis, 64)).frame([0, 0])
    };
    let plain = image(1.0);
    let scaled =
        |image: &Image, by: f32| Image { texels: image.texels.iter().map(|[r, g, b, a]| [r * by, g * by, b * by, *a]).collect() };
    // A power of two only changes exponents.
    assert!(image(4.0) == scaled(&plain, 4.0));
    assert!(distance(&image(3.0), &scaled(&plain, 3.0)) < 1e-6);
    assert!(image(0.0) == scaled(&plain, 0.0));
}

/// Seeds follow shading samples, so the samples of `--aa` are the pixels of a larger image, bit for bit.
#[test]
fn antialiasing_is_the_average_of_a_larger_image() {
    let mut world = world("torus-knot", 48, table("metallic-paint"), sky("sun-sky"));
    world.environment.as_mut().unwrap().visible = true;
    for side in [2, 4] {
        let small = Config { samples_per_side: side, ..config([16, 12], Estimator::Mis, 16) };
        let large = config([16 * side, 12 * side], Estimator::Mis, 16);
        let (small, large) = (Stage::new(&world, &small).frame([9, 0]), Stage::new(&world, &large).frame([9, 0]));
        let side = side as usize;
        for (i, texel) in small.texels.iter().enumerate() {
            let (x, y) = (i % 16 * side, i / 16 * side);
            // Those of surfaces first, as they are summed: for the last bit.
            let samples = (0..side * side).map(|k| large.texels[(y + k / side) * 16 * side + x + k % side]);
            let (surfaces, background): (Vec<_>, Vec<_>) = samples.partition(|sample| sample[3] > 0.0);
            let mut sum = [0.0; 4];
            for sample in surfaces.into_iter().chain(background) {
                sum.iter_mut().zip(sample).for_each(|(sum, v)| *sum += v);
            }
            assert_eq!(*texel, sum.map(|v| v / (side * side) as f32), "pixel {i} of {} samples", side * side);
        }
        assert!(small.texels.iter().any(|t| t[3] > 0.0 && t[3] < 1.0) && small.texels.iter().any(|t| t[3] == 1.0));
    }
}

#[test]
fn the_background_is_the_environment_or_nothing() {
    let mut world = world("sphere", 32, table("rough"), sky("sun-sky"));
    // From the object at the lower edge over the sun to the zenith.
    world.camera.target = world.camera.position + DVec3::new(0.0, 0.5, -0.6);
    world.camera.fov_y = 110.0;
    let image = |world: &World| Stage::new(world, &config(EXTENT, Estimator::Mis, 2)).frame([0, 0]);
    let dark = image(&world);
    let covered = dark.texels.iter().filter(|t| t[3] == 1.0).count();
    assert!(covered > 10 && covered < 900, "{covered} pixels are covered");
    assert!(dark.texels.iter().all(|t| t[3] == 1.0 || *t == [0.0; 4]));

    let light = world.environment.as_mut().unwrap();
    (light.visible, light.rotation, light.intensity) = (true, 150.0, 1.5);
    let bright = image(&world);
    let light = world.environment.as_ref().unwrap();
    let mut brightest: f64 = 0.0;
    for (i, texel) in bright.texels.iter().enumerate().filter(|(_, t)| t[3] == 0.0) {
        let w = world.camera.ray(DVec2::new((i % 32) as f64 + 0.5, (i / 32) as f64 + 0.5), EXTENT);
        let expected = light.radiance(w);
        // What a direction a hair off would show.
        let (s, t) = w.any_orthonormal_pair();
        let hair = |d: DVec3| (light.radiance((w + d * 2e-5).normalize()) - expected).abs();
        let bound = [s, -s, t, -t].map(hair).into_iter().fold(expected * 1e-5, DVec3::max);
        let off = (bright.radiance(i) - expected).abs();
        assert!(off.cmple(bound).all(), "pixel {i}: {texel:?} for {expected}, off by {off}, bound {bound}");
        brightest = brightest.max(expected.max_element());
    }
    assert!(brightest > 20.0, "the sun is not in view: {brightest}");
}

#[test]
fn without_an_environment_everything_is_black() {
    let mut world = world("sphere", 32, table("mirror-metal"), sky("studio"));
    world.environment = None;
    for estimator in [Estimator::Mis, Estimator::Brdf, Estimator::BrdfRandom, Estimator::Cv, Estimator::Residual] {
        let image = Stage::new(&world, &config(EXTENT, estimator, 8)).frame([0, 0]);
        assert!(image.texels.iter().all(|t| t[..3] == [0.0; 3]));
        assert!(image.texels.iter().any(|t| t[3] == 1.0) && image.texels.iter().any(|t| t[3] == 0.0));
    }
}
