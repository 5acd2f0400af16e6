//! The truth for filtered materials: supersampled images against finer ones, integrals and themselves.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec2, DVec3, Mat4, Vec3};
use passband::offline::animation::AnimatedWorld;
use passband::offline::builtin;
use passband::offline::headless::Options;
use passband::offline::image_io::LinearImage;
use passband::offline::render::{Rendered, Settings, render};
use passband::offline::scene::Scene;
use passband::offline::sequence::render_frames;
use passband::offline::world::World;
use passband::reflectance::{BlinnPhong, Model};
use passband::{Config, Estimator, Filter, Light, Maps, Rate, Roughness, Texture};
use std::sync::Arc;
use support::frames::{Stage, config, ggx, world};

/// A supersampled image without a word of the validation layer.
fn supersampled(world: &World, extent: [u32; 2], estimator: Estimator, samples: u32, seed: u32) -> Rendered {
    let device = Options { device: Some(DEVICE.into()), validate: true };
    let settings =
        Settings { supersample: Some(samples), seed, device, ..Settings::new(Config { estimator, ..Config::new(extent) }) };
    let rendered = render(world, &settings, &mut |_, _, _| ()).unwrap();
    assert_eq!((rendered.image.width, rendered.image.height), (extent[0], extent[1]));
    assert_eq!(rendered.stats.validation_messages, [""; 0]);
    rendered
}

/// Radiance and coverage, row-major.
fn texels(image: &LinearImage) -> Vec<[f64; 4]> {
    let channels = ["R", "G", "B", "A"].map(|name| image.channel(name).unwrap());
    (0..channels[0].len()).map(|i| channels.map(|c| f64::from(c[i]))).collect()
}

/// Root of the summed squares of what differs, over that of `b`.
fn distance(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    let sum =
        |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| f(*a, *b)).sum::<f64>();
    (sum(&|a, b| (a - b) * (a - b)) / sum(&|_, b| b * b)).sqrt()
}

fn map<T>(size: [u32; 2], f: impl Fn(u32, u32) -> T) -> Vec<T> {
    (0..size[0] * size[1]).map(|i| f(i % size[0], i / size[0])).collect()
}

/// Maps of every kind on a tilted plane whose edges are in the image.
fn plane() -> World {
    const SIZE: [u32; 2] = [64, 64];
    let mut world =
        world("plane", 16, ggx(0.3, DVec3::splat(0.6), DVec3::splat(0.5)), builtin::environment("studio", 64).unwrap());
    Arc::make_mut(&mut world.objects[0].mesh).compute_tangents();
    world.objects[0].transform = Mat4::from_rotation_x(0.9) * Mat4::from_rotation_y(0.4);
    let normal =
        map(SIZE, |x, y| Vec3::new(0.5 * (x as f32 * 0.6).sin(), 0.4 * (y as f32 * 0.9).cos(), 1.0).normalize().to_array());
    let colour = map(SIZE, |x, y| [if (x / 4 + y / 4) % 2 == 0 { 0.9 } else { 0.05 }, 0.4, x as f32 / 64.0]);
    let alpha = map(SIZE, |x, y| if (x + y) % 8 < 4 { 0.1 } else { 0.4 });
    let texture = |t: passband::Result<Texture>| Some(Arc::new(t.unwrap()));
    world.materials[0].maps = Maps {
        albedo: texture(Texture::colour(SIZE, &colour)),
        normal: texture(Texture::normals(SIZE, &normal)),
        roughness: texture(Texture::scalar(SIZE, &alpha)).map(|t| (t, Roughness::Alpha)),
        tiling: [4.0, 4.0],
        ..Maps::default()
    };
    world
}

/// The same under a sun.
fn lit_plane() -> World {
    let sun = Light::Directional { direction: [-0.2, -0.5, -0.8], irradiance: [1.0; 3] };
    World { environment: None, lights: vec![sun], ..plane() }
}

#[test]
fn pixels_are_the_means_of_much_finer_ones() {
    const FINER: usize = 64;
    // A frame of several parts, of which the last reach beyond the image.
    let (scene, [width, height]) = (lit_plane(), [131, 6]);
    let fine_extent = [width * FINER, height * FINER].map(|e| e as u32);
    let fine = Stage::new(&scene, &config(fine_extent, Estimator::Brdf, 1)).frame([0, 0]);
    let mean = |i: usize| {
        let (x, y) = (i % width * FINER, i / width * FINER);
        let each = (0..FINER * FINER).map(|k| fine.texels[(y + k / FINER) * width * FINER + x + k % FINER]);
        let sum = each.fold([0.0; 4], |sum, texel| [0, 1, 2, 3].map(|c| sum[c] + f64::from(texel[c])));
        sum.map(|s| s / (FINER * FINER) as f64)
    };
    let truth: Vec<_> = (0..width * height).map(mean).collect();
    let partly = truth.iter().filter(|t| t[3] > 0.05 && t[3] < 0.95).count();
    assert!(partly > 8 && truth.iter().any(|t| t[3] == 0.0) && truth.iter().any(|t| t[3] == 1.0), "{partly}");
    let rendered = supersampled(&scene, [width as u32, height as u32], Estimator::Mis, 4096, 0);
    let found = texels(&rendered.image);
    let off = distance(&found, &truth);
    let edges = found.iter().zip(&truth).map(|(a, b)| (a[3] - b[3]).abs()).fold(0.0, f64::max);
    println!("off by {off:.2e}, coverage by {edges:.2e}, noise {:?}", rendered.stats.noise);
    assert!(off < 1e-2 && edges < 6e-3, "{off:e} {edges:e}");
    // Nothing is drawn where only a sun shines: all that is off is where positions are, and halves are off by more.
    let noise = rendered.stats.noise.unwrap().rel_l2;
    assert!((off..0.03).contains(&noise), "{noise:e}");
    assert_eq!(rendered.stats.settings["filter"], "supersample");
    assert_eq!((rendered.stats.settings["samples"].as_u64(), rendered.stats.extent), (Some(4096), [width as u32, height as u32]));
    let covered: f64 = truth.iter().map(|t| t[3]).sum();
    assert!((rendered.stats.samples.taken as f64 / (4096.0 * covered) - 1.0).abs() < 1e-3);
}

#[test]
fn colours_are_those_of_the_base_level() {
    // Fifty texels a pixel of a matt map that faces the camera: a mip would blur what ends at pixels' borders.
    const SIDE: u32 = 5;
    let matt = Model::BlinnPhong(BlinnPhong { exponent: 8.0, specular: DVec3::ZERO, albedo: DVec3::ONE });
    let mut scene = world("plane", 8, matt, builtin::environment("constant", 16).unwrap());
    let colour =
        Texture::colour([256, 256], &map([256, 256], |x, y| [if x % 64 < 13 { 1.0 } else { 0.1 }, 0.5, y as f32 / 256.0]));
    let texture = Arc::new(colour.unwrap());
    scene.materials[0].maps.albedo = Some(Arc::clone(&texture));
    scene.objects[0].transform = Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2);
    scene.camera.position = DVec3::new(0.0, 0.0, 3.0);
    // Nearly all of the plane: its edges fall where the rasteriser puts them.
    const SEEN: f64 = 0.95;
    scene.camera.fov_y = 2.0 * (SEEN / 3.0).atan().to_degrees();
    scene.environment = None;
    scene.lights = vec![Light::Directional { direction: [0.0, 0.0, -1.0], irradiance: [std::f32::consts::PI; 3] }];
    let image = texels(&supersampled(&scene, [SIDE; 2], Estimator::Mis, 4096, 1).image);
    const STEPS: usize = 512;
    for (i, found) in image.iter().enumerate() {
        let corner = DVec2::new((i as u32 % SIDE).into(), (i as u32 / SIDE).into());
        let place = |k: usize| DVec2::new((k % STEPS) as f64 + 0.5, (k / STEPS) as f64 + 0.5) / STEPS as f64;
        let uv = |k: usize| {
            let at = 0.5 + SEEN * ((corner + place(k)) / f64::from(SIDE) - 0.5);
            DVec2::new(at.x, 1.0 - at.y)
        };
        let sum: DVec3 = (0..STEPS * STEPS).map(|k| texture.sample(uv(k), 0.0).truncate()).sum();
        let expected = sum / (STEPS * STEPS) as f64;
        let off = (DVec3::new(found[0], found[1], found[2]) - expected).abs();
        assert!(off.max_element() < 2e-3 && (found[3] - 1.0).abs() < 1e-6, "pixel {i}: {found:?} for {expected}");
    }
}

#[test]
fn noise_falls_with_samples_and_is_what_it_is_said_to_be() {
    const EXTENT: [u32; 2] = [24, 20];
    let scene = plane();
    let image = |samples, seed| supersampled(&scene, EXTENT, Estimator::Mis, samples, seed);
    let truth = texels(&image(1 << 17, 9).image);
    // Over radiance where something is seen, as noise is.
    let seen = |all: &[[f64; 4]]| -> Vec<[f64; 4]> {
        all.iter().zip(&truth).filter(|(_, t)| t[3] > 0.0).map(|(&[r, g, b, _], _)| [r, g, b, 0.0]).collect()
    };
    let mut last = f64::INFINITY;
    for samples in [64, 1024, 16384] {
        let rendered = image(samples, 3);
        let (noise, off) = (rendered.stats.noise.unwrap().rel_l2, distance(&seen(&texels(&rendered.image)), &seen(&truth)));
        println!("{samples}: {noise:.2e}, off by {off:.2e}");
        assert!((0.6..1.6).contains(&(off / noise)), "{samples}: off by {off:e}, said to be {noise:e}");
        // Sixteen times the samples: a fourth of the noise.
        assert!(noise < 0.35 * last, "{samples}: {noise:e} after {last:e}");
        last = noise;
    }
    let brdf = texels(&supersampled(&scene, EXTENT, Estimator::Brdf, 1 << 16, 5).image);
    let off = distance(&seen(&brdf), &seen(&truth));
    assert!(off < 0.05, "reflectance sampling converges elsewhere: {off:e}");
}

#[test]
fn backgrounds_are_averaged_with_what_is_before_them() {
    let mut scene = plane();
    scene.materials[0].maps = Maps::default();
    // In a furnace that can be seen a mirror that reflects all is invisible.
    scene.materials[0].model = ggx(0.2, DVec3::ONE, DVec3::ZERO);
    let light = scene.environment.as_mut().unwrap();
    (light.map, light.visible) = (builtin::environment("constant", 16).unwrap(), true);
    let whole = texels(&supersampled(&scene, [16, 16], Estimator::Mis, 4096, 0).image);
    assert!(whole.iter().any(|t| t[3] == 0.0) && whole.iter().any(|t| t[3] > 0.2 && t[3] < 0.8));
    for (i, t) in whole.iter().enumerate() {
        let lost = if t[3] > 0.0 { 0.2 } else { 1e-5 };
        assert!((1.0 - t[0]).abs() < lost, "pixel {i}: {t:?}");
    }
    // What is seen at an edge is the background and the surface in proportion.
    let surface =
        whole.iter().filter(|t| t[3] == 1.0).map(|t| t[0]).sum::<f64>() / whole.iter().filter(|t| t[3] == 1.0).count() as f64;
    for t in whole.iter().filter(|t| t[3] > 0.2 && t[3] < 0.8) {
        let expected = 1.0 - t[3] + t[3] * surface;
        assert!((t[0] / expected - 1.0).abs() < 0.03, "{t:?}, where surfaces are {surface}");
    }
}

#[test]
fn images_are_the_same_in_every_run_and_in_sequences() {
    let scene = plane();
    let image = |seed| supersampled(&scene, [20, 12], Estimator::Mis, 64, seed).image;
    assert_eq!(image(7), image(7));
    assert_ne!(image(7), image(8));
    let mut still: AnimatedWorld = Scene::load("maps", &[]).unwrap().animated().unwrap();
    let device = Options { device: Some(DEVICE.into()), validate: true };
    let settings = Settings { supersample: Some(64), device, timed: true, ..Settings::new(Config::new([20, 12])) };
    let mut frames = Vec::new();
    let mut keep = |_, image| {
        frames.push(image);
        Ok(())
    };
    let stats = render_frames(&mut still, &settings, 0..2, &mut |_, _, _| (), &mut keep).unwrap();
    assert_eq!(render(still.world(), &settings, &mut |_, _, _| ()).unwrap().image, frames[0]);
    assert_ne!(frames[0], frames[1], "each frame has samples of its own");
    assert!(stats.noise.unwrap().rel_l2 > 0.0 && stats.frame_ms.median > 0.0);
}

#[test]
fn what_has_no_meaning_is_refused() {
    let scene = plane();
    let plain = || Settings { supersample: Some(64), ..Settings::new(Config::new([8, 8])) };
    let of = |config: Config| Settings { config, ..plain() };
    let base = Config::new([8, 8]);
    let cases = [
        (of(Config { rate: Rate::Bandwidth, ..base.clone() }), "--rate: expected full"),
        (of(Config { samples_per_side: 2, ..base.clone() }), "--aa: expected 1"),
        (of(Config { estimator: Estimator::BrdfRandom, ..base.clone() }), "--estimator: expected mis or brdf"),
        (Settings { reference: Some(64), ..plain() }, "--reference: expected none"),
        (Settings { aovs: vec!["depth".parse().unwrap()], ..plain() }, "--aov: expected none"),
        (Settings { supersample: Some(1), ..plain() }, "--samples: expected 2 to"),
    ];
    for (settings, expected) in cases {
        let said = render(&scene, &settings, &mut |_, _, _| ()).map(|_| ()).unwrap_err();
        assert!(said.to_string().starts_with(expected) && said.exit_code() == 2, "{said}");
    }
    // Whatever filter there is beside it is not looked at.
    let filtered = of(Config { filter: Filter::Tk, geometric: true, ..base });
    let image = |settings: &Settings| render(&scene, settings, &mut |_, _, _| ()).unwrap().image;
    assert_eq!(image(&filtered), image(&plain()));
}
