//! The environment's bandwidth on the device against its f64 twin, and the commands that show bandwidths.

#[path = "support/chosen_device.rs"]
mod chosen_device;

use chosen_device::DEVICE;
use glam::DVec3;
use passband::frequency::AngularBandwidth;
use passband::frequency::environment::EPS;
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::session::Session;
use passband::offline::world::{Camera, EnvironmentLight, Material, World};
use passband::reflectance::{Ggx, Model};
use passband::sampling::{LatLong, sobol};
use passband::{Config, Rate, Requirements, glam};

/// The device's bandwidth of `map` at threshold `eps`, row-major, and its columns.
fn on_device(map: &LatLong, eps: f64) -> (Vec<f32>, usize) {
    let config = Config { rate: Rate::Bandwidth, eps, ..Config::new([8, 8]) };
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
    let camera = Camera { position: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, fov_y: 40.0 };
    let model = Model::Ggx(Ggx { alpha: 0.5, f0: DVec3::ONE, albedo: DVec3::ZERO });
    let materials = vec![Material { name: "any".into(), model, maps: Default::default() }];
    let environment = Some(EnvironmentLight { map: map.clone(), intensity: 1.0, rotation: 0.0, visible: false });
    let world = World { environment, materials, ..World::empty("bandwidth", camera) };
    let mut session = Session::new(headless, &world, &config).unwrap();
    let (bytes, _, [width, _]) = session.image("environment bandwidth").unwrap();
    assert_eq!(session.messages(), Vec::<String>::new());
    (bytemuck::pod_collect_to_vec(&bytes), width as usize)
}

/// Noise over five orders of magnitude, with black texels.
fn noise(width: u32, height: u32) -> LatLong {
    let texel = |i| {
        let ([a, b], [c, d]) = (sobol::random(i, 1).map(sobol::to_unit), sobol::random(i, 2).map(sobol::to_unit));
        [a, b, c].map(|v| if d < 0.2 { 0.0 } else { (v * 10f64.powf(5.0 * d * d)) as f32 })
    };
    LatLong::new(width, height, (0..width * height).map(texel).collect()).unwrap()
}

/// Largest relative difference from the twin, of blocks whose bandwidth is above a hundredth of the largest.
fn compare(name: &str, map: &LatLong, eps: f64, bound: f64) {
    let (got, width) = on_device(map, eps);
    let twin = AngularBandwidth::of(map, eps).map;
    assert_eq!((twin.width, twin.values.len()), (width, got.len()), "{name}");
    let largest = twin.values.iter().copied().fold(0.0, f64::max);
    let mut errors: Vec<f64> =
        (got.iter().zip(&twin.values)).map(|(&g, &t)| (f64::from(g) - t).abs() / t.max(0.01 * largest).max(1e-9)).collect();
    errors.sort_by(f64::total_cmp);
    let worst = errors[errors.len() - 1];
    println!("{name}: worst {worst:.1e}, 99 % {:.1e}", errors[errors.len() * 99 / 100]);
    assert!(worst < bound, "{name}: {worst}");
}

/// Details travel as 16-bit floats: 2^-11 of each, which the slope of the sums between levels can raise.
#[test]
fn the_device_agrees_with_its_twin() {
    compare("cosine-64", &builtin::environment("cosine-64", 1024).unwrap(), EPS, 3e-3);
    compare("cosine-200", &builtin::environment("cosine-200", 512).unwrap(), EPS, 3e-3);
    compare("sun-sky", &builtin::environment("sun-sky", 1024).unwrap(), EPS, 3e-3);
    compare("studio", &builtin::environment("studio", 512).unwrap(), EPS, 3e-3);
    for eps in [0.001, 0.1] {
        compare(&format!("sun-sky at {eps}"), &builtin::environment("sun-sky", 256).unwrap(), eps, 3e-3);
    }
    for size in [[64, 32], [128, 128], [32, 64], [100, 50], [33, 17], [2, 1], [3, 3], [1, 1], [4100, 6], [3, 1500]] {
        compare(&format!("noise {size:?}"), &noise(size[0], size[1]), EPS, 3e-3);
    }
}

#[test]
fn flat_and_dark_light_have_none() {
    for radiance in [0.0, 1.0, 1e4] {
        let (got, _) = on_device(&LatLong::new(64, 32, vec![[radiance; 3]; 64 * 32]).unwrap(), EPS);
        assert!(got.iter().all(|&b| b == 0.0), "{radiance}");
    }
}

/// Runs the command and returns its exit code and what it printed.
fn passband(args: &[&str]) -> (Option<i32>, String) {
    let cache = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("bandwidth-cache");
    let out =
        std::process::Command::new(env!("CARGO_BIN_EXE_passband")).args(args).env("XDG_CACHE_HOME", cache).output().unwrap();
    (out.status.code(), String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned())
}

#[test]
fn the_command_reports_and_plots_an_environment() {
    let plot = format!("{}/bandwidth.png", env!("CARGO_TARGET_TMPDIR"));
    let (code, text) = passband(&["environment", "cosine-64", "-o", &plot]);
    assert_eq!(code, Some(0), "{text}");
    let median = text.split("median ").nth(1).and_then(|t| t.split(',').next()).unwrap().parse::<f64>().unwrap();
    assert!((median * std::f64::consts::TAU / 64.0 - 1.0).abs() < 0.25, "{text}");
    assert_eq!(image::image_dimensions(&plot).unwrap(), (2048, 512));
    let (code, text) = passband(&["environment", "nothing.exr"]);
    assert!(code == Some(2) && text.contains("nothing.exr"), "{text}");
    let (code, text) = passband(&["environment", "studio", "--eps", "2"]);
    assert!(code == Some(2) && text.contains("--eps"), "{text}");
    let (code, text) = passband(&["environment", "studio", "--calibrate"]);
    assert!(code == Some(2) && text.contains("--calibrate"), "{text}");
    let (code, text) = passband(&["environment"]);
    assert!(code == Some(2) && text.contains("FILE|NAME"), "{text}");
    let (code, text) = passband(&["environment", "studio", "-o", "plot.jpg"]);
    assert!(code == Some(2) && text.contains(".png"), "{text}");
}

#[test]
fn the_command_reports_a_materials_bandwidth() {
    let at = |name: &str| -> f64 {
        let (code, text) = passband(&["material", name]);
        assert_eq!(code, Some(0), "{text}");
        let table = text.split("cycles/radian").nth(1).unwrap();
        let row = table.lines().map(|l| l.split_whitespace().collect::<Vec<_>>()).find(|l| l.first() == Some(&"30"));
        row.unwrap()[1].parse().unwrap()
    };
    let values = ["mirror-metal", "metallic-paint", "rough"].map(at);
    assert!(values[0] > 3.0 * values[1] && values[1] > 2.0 * values[2], "{values:?}");
    // From the cache.
    assert_eq!(values[0], at("mirror-metal"));
}
