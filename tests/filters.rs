//! Filters that widen lobes: the kernel against its twin, the widened lobes against quadrature, and what it is good for.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::DVec3;
use passband::material::{MOST_KERNEL, geometric_kernel};
use passband::offline::aov::Aov;
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::reference::{Options as Quadrature, Reference};
use passband::offline::render::{Settings, render};
use passband::offline::session::Session;
use passband::offline::world::{Camera, World};
use passband::reflectance::{BlinnPhong, Lobe, Model, Vmf};
use passband::{Config, Estimator, Filter, Light, Maps, Requirements, Roughness, Texture};
use std::sync::Arc;
use support::frames::{Stage, config, ggx, world};

const EXTENT: [u32; 2] = [64, 64];

fn tk(directions: u32) -> Config {
    Config { filter: Filter::Tk, ..config(EXTENT, Estimator::Mis, directions) }
}

/// The kernel of each sample of a frame, and its interpolated normals and coverage.
fn kernels(world: &World, config: &Config) -> (Vec<f64>, Vec<Option<DVec3>>) {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    let mut session = Session::new(headless, world, config).unwrap();
    session.frame([0, 0]).unwrap();
    let words = |bytes: Vec<u8>| bytemuck::pod_collect_to_vec::<u8, [u32; 4]>(&bytes);
    let factors = words(session.image("factors").unwrap().0);
    let surface: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("surface").unwrap().0);
    let ids: Vec<u32> = bytemuck::pod_collect_to_vec(&session.image("ids").unwrap().0);
    assert_eq!(session.messages(), [""; 0]);
    let kernel = |f: &[u32; 4]| half::f16::from_bits((f[3] >> 16) as u16).to_f64();
    let normal = |(s, id): (&[f32; 4], &u32)| (*id != 0).then(|| DVec3::new(s[0].into(), s[1].into(), s[2].into()));
    (factors.iter().map(kernel).collect(), surface.iter().zip(&ids).map(normal).collect())
}

fn materials() -> [(&'static str, Model); 3] {
    let lobe = |x, kappa| Lobe { mu: DVec3::new(x, 0.0, 1.0), kappa, weight: 0.45 };
    [
        ("ggx", ggx(0.06, DVec3::new(0.9, 0.7, 0.5), DVec3::splat(0.2))),
        (
            "blinn-phong",
            Model::BlinnPhong(BlinnPhong { exponent: 500.0, specular: DVec3::splat(0.6), albedo: DVec3::splat(0.2) }),
        ),
        ("vmf", Model::Vmf(Arc::new(Vmf::new(&[lobe(0.0, 400.0), lobe(0.3, 60.0)]).unwrap()))),
    ]
}

#[test]
fn kernels_are_those_of_the_normals_differences() {
    let world = world("torus-knot", 128, ggx(0.1, DVec3::ONE, DVec3::ZERO), builtin::environment("constant", 16).unwrap());
    let (kernels, normals) = kernels(&world, &tk(2));
    let [w, h] = EXTENT.map(|e| e as usize);
    let (mut compared, mut clamped) = (0, 0);
    for i in 0..w * h {
        let (x, y) = (i % w, i / w);
        if x == 0 || y == 0 || x + 1 == w || y + 1 == h {
            continue;
        }
        let around = [i - 1, i + 1, i - w, i + w].map(|k| normals[k]);
        let ([Some(left), Some(right), Some(up), Some(down)], Some(_)) = (around, normals[i]) else { continue };
        let expected = geometric_kernel((right - left) / 2.0, (down - up) / 2.0);
        // Neighbours on another turn of the knot are left out: there the kernel follows one side alone.
        if expected < MOST_KERNEL && kernels[i] < MOST_KERNEL * 0.99 && (kernels[i] / expected - 1.0).abs() < 2e-3 {
            compared += 1;
        }
        clamped += usize::from((kernels[i] - MOST_KERNEL).abs() < 1e-4);
        assert!((0.0..=MOST_KERNEL + 1e-4).contains(&kernels[i]), "{x} {y}: {}", kernels[i]);
    }
    assert!(compared > 500, "{compared} pixels agree");
    assert!(clamped > 0, "a silhouette turns by more than the filter takes");
}

#[test]
fn widened_lobes_are_right() {
    for (name, model) in materials() {
        let mut scene = world("sphere", 128, model, builtin::environment("studio", 64).unwrap());
        Arc::make_mut(&mut scene.objects[0].mesh).compute_tangents();
        // A map in the place of the lobes' own roughness is widened, too.
        let texels = [0.05, 0.2, 0.1, 0.15];
        let map = Some((Arc::new(Texture::scalar([2, 2], &texels).unwrap()), Roughness::Alpha));
        for maps in [Maps::default(), Maps { roughness: map, ..Maps::default() }] {
            scene.materials[0].maps = maps;
            let image = Stage::new(&scene, &tk(4096)).frame([0, 0]);
            let (kernels, _) = kernels(&scene, &tk(2));
            let reference = Reference::new(&scene, EXTENT, Quadrature::default()).unwrap();
            let (mut sum, mut expected) = (DVec3::ZERO, DVec3::ZERO);
            for (i, hit) in reference.hits().iter().enumerate().filter(|(i, _)| i % 7 == 0) {
                let Some(hit) = hit.as_ref().filter(|h| h.normal.dot(h.view) > 0.3) else { continue };
                let mut hit = hit.clone();
                hit.point.kernel = kernels[i];
                assert!(kernels[i] > 1e-4);
                sum += image.radiance(i);
                expected += reference.shade(&hit).radiance;
            }
            let off = (sum / expected - 1.0).abs().max_element();
            println!("{name}: {off:.5}");
            assert!(off < 0.004, "{name}: {sum} for {expected}");
        }
    }
}

#[test]
fn sparkle_on_curved_metal_is_less() {
    let model = || ggx(0.03, DVec3::splat(0.9), DVec3::ZERO);
    // A small sun: its highlights fall between the samples, or on one and fill its pixel.
    let mut scene = world("bumpy-sphere", 256, model(), builtin::environment("constant", 16).unwrap());
    scene.environment = None;
    scene.lights = vec![Light::Directional { direction: [-0.4, -0.6, -0.7], irradiance: [1.0; 3] }];
    let frame = |config: &Config| Stage::new(&scene, config).frame([0, 0]);
    let small = |filter| Config { filter, ..config([32, 32], Estimator::Mis, 2) };
    let truth = frame(&Config { samples_per_side: 4, ..config([32, 32], Estimator::Mis, 2) });
    let (point, tk) = (frame(&small(Filter::Point)), frame(&small(Filter::Tk)));
    let geometric = frame(&Config { geometric: true, ..small(Filter::Point) });
    assert_eq!(geometric, tk, "folded into another filter it is the same kernel");
    // As a display clips: a highlight is as wrong where it is missing as where it is too much.
    let shown = |c: DVec3| (c * 0.3).min(DVec3::ONE);
    let error = |image: &support::frames::Image| {
        let interior = (0..32 * 32).filter(|&i| truth.coverage(i) == 1.0 && image.coverage(i) == 1.0);
        interior.map(|i| (shown(image.radiance(i)) - shown(truth.radiance(i))).length_squared()).sum::<f64>()
    };
    let (point, tk) = (error(&point), error(&tk));
    println!("squared error of point {point:.4}, of tk {tk:.4}");
    assert!(tk < 0.7 * point, "{tk} for {point}");
}

/// The levels that `--aov mip` tells of a plane seen straight on are those of its texels under a pixel, for maps that are read through
/// mips and no other.
#[test]
fn maps_are_looked_up_at_the_level_of_their_texels_under_a_pixel() {
    let height = 2.2;
    let mut scene = world("plane", 16, ggx(0.3, DVec3::ONE, DVec3::splat(0.5)), builtin::environment("constant", 16).unwrap());
    scene.camera = Camera { position: DVec3::Y * height, target: DVec3::ZERO, up: DVec3::Z, fov_y: 40.0 };
    // The plane is 2 m wide, as are its coordinates 1.
    let a_pixel = 0.5 * 2.0 * height * 20f64.to_radians().tan() / f64::from(EXTENT[1]);
    let flat = |size: [u32; 2]| Texture::normals(size, &vec![[0.0, 0.0, 1.0]; (size[0] * size[1]) as usize]).unwrap();
    let grey = |size: [u32; 2]| Texture::colour8(size, &vec![[128; 3]; (size[0] * size[1]) as usize]).unwrap();
    let mips = |maps: Maps, filter, lod_bias| {
        let mut scene = scene.clone();
        scene.materials[0].maps = maps;
        let device = Options { device: Some(DEVICE.into()), validate: true };
        let config = Config { filter, lod_bias, ..config(EXTENT, Estimator::Mis, 2) };
        let settings = Settings { aovs: vec![Aov::Mip], device, ..Settings::new(config) };
        let image = render(&scene, &settings, &mut |_, _, _| {}).unwrap().image;
        let covered = image.channel("mip.Y").unwrap().iter().zip(image.channel("A").unwrap()).filter(|(_, a)| **a == 1.0);
        let all: Vec<f32> = covered.map(|(mip, _)| *mip).collect();
        assert!(all.len() > 2000);
        let [low, high] = [f32::min, f32::max].map(|f| all.iter().copied().reduce(f).unwrap());
        assert!(high - low < 0.01, "{low} to {high}");
        f64::from(all[all.len() / 2])
    };
    let colours = |size, tiling| Maps { albedo: Some(Arc::new(grey(size))), tiling: [tiling; 2], ..Maps::default() };
    let near = |found: f64, texels: f64| assert!((found - texels.log2().max(0.0)).abs() < 0.02, "{found} for {texels} texels");
    near(mips(colours([256, 256], 1.0), Filter::Point, 0.0), 256.0 * a_pixel);
    // By the axis along which there are more, and the tiling.
    near(mips(colours([512, 64], 3.0), Filter::Point, 0.0), 512.0 * 3.0 * a_pixel);
    near(mips(colours([512, 512], 1.0), Filter::Point, 1.0), 2.0 * 512.0 * a_pixel);
    near(mips(colours([16, 16], 1.0), Filter::Point, 0.0), 1.0);
    let both = Maps { normal: Some(Arc::new(flat([512, 512]))), ..colours([128, 128], 2.0) };
    near(mips(both.clone(), Filter::Point, 0.0), 128.0 * 2.0 * a_pixel);
    near(mips(both, Filter::Vmf8, 0.0), 512.0 * 2.0 * a_pixel);
}
