//! The host's masks of lights: each scales its own light, at every estimator, and levels are fine where one changes.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec3, Mat4};
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::image_io::write_png;
use passband::offline::session::Session;
use passband::offline::shadows::Shadows;
use passband::offline::world::World;
use passband::{Config, Estimator, Light, Rate, Requirements};
use std::path::Path;
use std::sync::Arc;
use support::frames::{Stage, config, table, world};

const EXTENT: [u32; 2] = [64, 48];

/// The paint under a studio's light and these.
fn lit(lights: &[Light], masks: &[Vec<f32>]) -> World {
    let map = builtin::environment("studio", 128).unwrap();
    let mut world = world("sphere", 64, table("metallic-paint"), map);
    world.objects[0].transform = Mat4::from_scale(glam::Vec3::splat(1.4));
    world.lights = lights.to_vec();
    world.shadows = (!masks.is_empty()).then(|| Arc::new(Shadows { extent: EXTENT, layers: masks.to_vec() }));
    world
}

/// A mask by its value at a pixel.
fn mask(value: impl Fn(u32, u32) -> f32) -> Vec<f32> {
    (0..EXTENT[0] * EXTENT[1]).map(|i| value(i % EXTENT[0], i / EXTENT[0])).collect()
}

const LAMP: Light = Light::Point { position: [2.0, 2.0, 2.0], intensity: [9.0, 8.0, 7.0] };
const SKY: Light = Light::Directional { direction: [1.0, -1.0, -1.0], irradiance: [1.0, 2.0, 3.0] };
const PANEL: Light = Light::Rectangle { position: [0.0, 3.0, 1.0], u: [1.0, 0.0, 0.0], v: [0.0, 0.0, 1.0], radiance: [4.0; 3] };

/// Radiance of one frame.
fn frame(world: &World, config: &Config) -> Vec<DVec3> {
    let image = Stage::new(world, config).frame([3, 0]);
    (0..image.texels.len()).map(|i| image.radiance(i)).collect()
}

#[test]
fn each_mask_scales_its_own_light() {
    let masks = [mask(|x, y| ((x * 7 + y * 13) % 11) as f32 / 10.0), mask(|x, _| if x < 30 { 0.0 } else { 1.5 })];
    for estimator in [Estimator::Mis, Estimator::Preconvolved, Estimator::Cv] {
        let config = config(EXTENT, estimator, 16);
        let of = |lights: &[Light], masks: &[Vec<f32>]| frame(&lit(lights, masks), &config);
        let none = of(&[], &[]);
        // The third has no mask. Points are summed exactly, so that what a light adds is known.
        let all = of(&[LAMP, SKY, LAMP], &masks);
        let [lamp, sky] = [LAMP, SKY].map(|light| of(&[light], &[]));
        let mut shadowed = 0;
        for i in 0..all.len() {
            let [of_lamp, of_sky] = [lamp[i] - none[i], sky[i] - none[i]];
            let expected = none[i] + of_lamp * f64::from(masks[0][i] + 1.0) + of_sky * f64::from(masks[1][i]);
            let off = (all[i] - expected).abs().max_element();
            assert!(off <= 2e-5 * (1.0 + expected.max_element()), "{estimator:?}, pixel {i}: {} for {expected}", all[i]);
            shadowed += usize::from(of_sky.max_element() > 0.01 && masks[1][i] == 0.0);
        }
        assert!(shadowed > 100, "{shadowed}");
    }
}

#[test]
fn masks_of_area_lights_scale_what_is_sampled() {
    // Without other light all directions are of the panel and of the reflectance, and the same with and without a mask.
    let panel = |masks: &[Vec<f32>], estimator| {
        let mut world = lit(&[PANEL], masks);
        world.environment = None;
        frame(&world, &config(EXTENT, estimator, 16))
    };
    let whole = panel(&[], Estimator::Mis);
    let quarter = panel(&[mask(|x, _| if x < 32 { 0.25 } else { 1.0 })], Estimator::Mis);
    assert!(whole.iter().any(|v| v.x > 0.1));
    for (i, (whole, quarter)) in whole.iter().zip(&quarter).enumerate() {
        let factor = if i % (EXTENT[0] as usize) < 32 { 0.25 } else { 1.0 };
        assert!((*whole * factor - *quarter).abs().max_element() <= 1e-5 * (1.0 + whole.max_element()), "{i}: {whole} {quarter}");
    }
}

/// The level of each pixel, and its radiance.
fn levelled(world: &World, config: &Config) -> (Vec<u32>, Vec<[f32; 4]>) {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    let mut session = Session::new(headless, world, config).unwrap();
    session.frame([1, 0]).unwrap();
    let level = session.image("level").unwrap().0;
    let radiance = session.image("resolved").unwrap().0;
    assert_eq!(session.messages(), [""; 0]);
    (bytemuck::pod_collect_to_vec(&level), bytemuck::pod_collect_to_vec(&radiance))
}

#[test]
fn levels_are_fine_where_a_mask_changes() {
    // A hard edge, a steep and a gentle ramp.
    let edge = mask(|x, _| if x < 20 { 1.0 } else { 0.0 });
    let ramps = mask(|x, _| if x < 44 { 1.0 - (x.saturating_sub(40)) as f32 / 5.0 } else { 0.2 - (x - 44) as f32 / 400.0 });
    for estimator in [Estimator::Mis, Estimator::Residual] {
        let config = Config { rate: Rate::Bandwidth, samples_per_cycle: Some(0.25), ..config(EXTENT, estimator, 64) };
        let (free, _) = levelled(&lit(&[SKY, LAMP], &[]), &config);
        let (bound, image) = levelled(&lit(&[SKY, LAMP], &[edge.clone(), ramps.clone()]), &config);
        let covered: Vec<_> = image.iter().map(|t| t[3] > 0.0).collect();
        let (mut fine, mut coarse) = (0, 0);
        for i in (0..bound.len()).filter(|i| covered[*i]) {
            match i as u32 % EXTENT[0] {
                19 | 20 | 40..=44 => {
                    assert_eq!(bound[i], 0, "{estimator:?}, pixel {i}");
                    fine += u32::from(free[i] > 0);
                }
                // A step of 1/400 a pixel may be shaded in cells of 16.
                1..=18 | 21..=38 | 46.. => {
                    // What a mask takes from a light changes the prediction, too.
                    assert!(bound[i] == free[i] || estimator == Estimator::Mis, "pixel {i}: {} for {}", bound[i], free[i]);
                    coarse += u32::from(bound[i] > 0);
                }
                _ => {}
            }
        }
        assert!(fine > 50 && coarse > 50, "{estimator:?}: {fine} {coarse}");
    }
}

/// Eight bits a channel, all the same.
fn grey_file(folder: &Path, name: &str, [width, height]: [u32; 2], value: u8) -> std::path::PathBuf {
    let path = folder.join(name);
    write_png(&path, width, height, &[value, value, value, 255].repeat((width * height) as usize)).unwrap();
    path
}

#[test]
fn files_of_masks_are_checked() {
    let folder = tempfile::tempdir().unwrap();
    let [full, half, small] = [("full.png", [4, 3], 255), ("half.png", [4, 3], 51), ("small.png", [3, 3], 9)]
        .map(|(n, s, v)| grey_file(folder.path(), n, s, v));
    let found = Shadows::read([None, Some(full.as_path()), None, Some(&half), None]).unwrap().unwrap();
    assert_eq!(found.extent, [4, 3]);
    assert_eq!(found.layers.iter().map(|l| (l.len(), l[11])).collect::<Vec<_>>(), [(12, 1.0), (12, 1.0), (12, 1.0), (12, 0.2)]);
    assert_eq!(Shadows::read([None, None]).unwrap(), None);
    let wrong = Shadows::read([Some(full.as_path()), Some(&small)]).unwrap_err().to_string();
    assert!(
        wrong.contains("small.png") && wrong.contains("[4, 3], as the masks of other lights") && wrong.contains("[3, 3]"),
        "{wrong}"
    );
    let none = Shadows::read([Some(folder.path().join("none.png").as_path())]).unwrap_err().to_string();
    assert!(none.contains("none.png"), "{none}");
    // Of another size than the image.
    let mut world = lit(&[LAMP], &[]);
    world.shadows = Some(Arc::new(Shadows { extent: [9, 9], layers: vec![vec![1.0; 81]] }));
    let config = config(EXTENT, Estimator::Mis, 4);
    let headless = Headless::new(&Options { device: Some(DEVICE.into()), validate: true }, &Requirements::of(&config)).unwrap();
    let refused = Session::new(headless, &world, &config).unwrap().frame([0, 0]).unwrap_err().to_string();
    assert!(refused.contains("shadows.image.extent") && refused.contains("[64, 48]") && refused.contains("[9, 9]"), "{refused}");
}
