//! What residuals are said to do is what the device does, by the errors that fits have.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec2, DVec3};
use passband::distribution::reflected::{ReflectedLobe, reflected};
use passband::distribution::{Budget, LobeFit, vmf};
use passband::offline::aov::Aov;
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::image_io::LinearImage;
use passband::offline::rates::oracle;
use passband::offline::reference::MIN_COSINE;
use passband::offline::render::{Settings, render};
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::reflectance::{Model, Reflectance};
use passband::{Config, Estimator, Filter, Light, Rate, Requirements};
use std::sync::OnceLock;
use support::frames::{config, table, world};

const EXTENT: [u32; 2] = [96, 72];

fn scene() -> World {
    world("sphere", 64, table("metallic-paint"), builtin::environment("studio", 128).unwrap())
}

/// A fit by so few lobes that it misses something everywhere.
fn residual(rate: Rate) -> Config {
    Config { rate, fit_lobes: 8, lmax: 3, residual_errors: [0.0, 0.1, 0.25], ..config(EXTENT, Estimator::Residual, 16) }
}

fn fit() -> &'static LobeFit {
    static FIT: OnceLock<LobeFit> = OnceLock::new();
    FIT.get_or_init(|| LobeFit::build(&table("metallic-paint"), Budget { lobes: 8, ..Budget::default() }))
}

fn layers(world: &World, config: Config, aovs: &[Aov]) -> LinearImage {
    let device = Options { device: Some(DEVICE.into()), validate: true };
    let settings = Settings { aovs: aovs.to_vec(), device, ..Settings::new(config) };
    let rendered = render(world, &settings, &mut |_, _, _| {}).unwrap();
    assert_eq!(rendered.stats.validation_messages, [""; 0]);
    rendered.image
}

fn layer<'a>(image: &'a LinearImage, name: &str) -> &'a [f32] {
    image.channel(name).unwrap_or_else(|| panic!("no {name}"))
}

/// The `share` quantile of errors over covered pixels.
fn quantile(image: &LinearImage, share: f64) -> f32 {
    let pixels = layer(image, "fit-error.Y").iter().zip(layer(image, "A"));
    let mut errors: Vec<f32> = pixels.filter(|(_, a)| **a > 0.0).map(|(e, _)| *e).collect();
    errors.sort_by(f32::total_cmp);
    errors[(share * errors.len() as f64) as usize]
}

#[test]
fn errors_are_those_of_the_fit_at_the_view_angle() {
    let world = scene();
    for estimator in [Estimator::Preconvolved, Estimator::Cv, Estimator::Residual] {
        let config = Config { estimator, ..residual(Rate::Full) };
        let image = layers(&world, config, &[Aov::FitError, Aov::Normal]);
        let normal = ["X", "Y", "Z"].map(|c| layer(&image, &format!("normal.{c}")));
        let mut covered = 0;
        for (i, (found, alpha)) in layer(&image, "fit-error.Y").iter().zip(layer(&image, "A")).enumerate() {
            if *alpha == 0.0 {
                assert_eq!(*found, 0.0);
                continue;
            }
            let pixel = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
            let cosine = DVec3::from(normal.map(|n| n[i].into())).dot(-world.camera.ray(pixel, EXTENT));
            let expected = fit().at(cosine.max(MIN_COSINE)).error;
            // Angles of normals in 32 bits: errors rise by less than 10 a radian.
            assert!((f64::from(*found) - expected).abs() < 1e-4 * (1.0 + expected), "{i}: {found} for {expected}");
            covered += 1;
        }
        assert!(covered > 1000);
    }
    // What the filter finds stands for the material, and nobody knows how well.
    let mut normals = scene();
    normals.materials[0].model = support::frames::ggx(0.2, DVec3::ONE, DVec3::ZERO);
    let image = layers(&normals, Config { filter: Filter::Tk, ..residual(Rate::Full) }, &[Aov::FitError]);
    assert_eq!(layer(&image, "fit-error.Y"), layer(&image, "A"));
}

#[test]
fn what_is_left_out_has_a_factor_of_one() {
    let world = scene();
    // The rate is not full, but no sample is coarser than a pixel.
    let everywhere = Config { lmax: 0, ..residual(Rate::Bandwidth) };
    let plain = layers(&world, everywhere.clone(), &[Aov::FitError, Aov::Decision]);
    // Something is estimated at every sample, for itself.
    assert!(layer(&plain, "decision.Y").iter().zip(layer(&plain, "A")).all(|(d, a)| *d == if *a > 0.0 { 2.0 } else { -1.0 }));
    let negligible = quantile(&plain, 0.5);
    let errors = [negligible, 1.0, 2.0];
    let image = layers(&world, Config { residual_errors: errors, ..everywhere }, &[Aov::Decision, Aov::Residual]);
    let factor = ["R", "G", "B"].map(|c| layer(&image, &format!("residual.{c}")));
    let (mut left_out, mut estimated, mut noise) = (0, 0, 0);
    for (i, decision) in layer(&image, "decision.Y").iter().enumerate() {
        // Rounding decides where an error is that of the limit.
        if (layer(&plain, "fit-error.Y")[i] - negligible).abs() < 1e-4 {
            continue;
        }
        let one = factor.iter().all(|f| f[i] == 1.0);
        match decision {
            0.0 => assert!(one, "{i}"),
            // It may turn out to be noise.
            2.0 => noise += usize::from(one),
            _ => assert_eq!((*decision, layer(&image, "A")[i]), (-1.0, 0.0)),
        }
        left_out += usize::from(*decision == 0.0);
        estimated += usize::from(*decision == 2.0);
    }
    assert!(left_out > 500 && estimated > 500 && noise < estimated, "{left_out} {estimated} {noise}");
}

#[test]
fn levels_follow_from_errors() {
    let world = scene();
    let plain = layers(&world, residual(Rate::Full), &[Aov::FitError]);
    let errors = [0.1, 0.6, 0.8].map(|share| quantile(&plain, share));
    let config = Config { residual_errors: errors, ..residual(Rate::Bandwidth) };
    let image = layers(&world, config, &[Aov::FitError, Aov::Decision, Aov::Shaded, Aov::Level]);
    let mut counts = [0; 8];
    for (i, (decision, error)) in layer(&image, "decision.Y").iter().zip(layer(&image, "fit-error.Y")).enumerate() {
        let (shaded, level) = (layer(&image, "shaded.Y")[i], layer(&image, "level.Y")[i]);
        if *decision < 0.0 || errors.iter().any(|e| (e - error).abs() < 1e-4) {
            continue;
        }
        counts[*decision as usize] += 1;
        assert_eq!(*decision == 0.0, *error <= errors[0], "{i}");
        if *decision >= 1.0 {
            assert_eq!(*decision > 1.0, shaded == 1.0, "{i}");
        }
        // Beyond the last limit every sample is shaded for itself.
        if *error > errors[2] {
            assert_eq!((*decision, level), (2.0, 0.0), "{i}");
        } else if *error > errors[1] {
            assert!(*decision <= 3.0, "{i}: {decision}");
        }
    }
    let [nothing, up_sampled, full, half, coarser @ ..] = counts;
    let enough = nothing > 200 && up_sampled > 400 && full > 400 && half > 50 && coarser.iter().sum::<i32>() > 10;
    assert!(enough, "{counts:?}");

    let others = [(Estimator::Preconvolved, 0.0), (Estimator::Cv, 2.0)];
    for (estimator, expected) in others {
        let image = layers(&world, Config { estimator, ..residual(Rate::Full) }, &[Aov::Decision]);
        let pixels = layer(&image, "decision.Y").iter().zip(layer(&image, "A"));
        assert!(pixels.into_iter().all(|(d, a)| *d == if *a > 0.0 { expected } else { -1.0 }), "{estimator:?}");
    }
}

/// By how much the lobe that stands for a reflectance misses it, seen from `wo`: a share of the larger of both.
fn missed(model: &Model, wo: DVec3) -> f64 {
    let (lobes, _) = reflected(model, wo).unwrap();
    let (rings, spokes) = (90, 120);
    let (mut off, mut all) = (0.0, 0.0);
    for i in 0..rings {
        let theta = std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(rings);
        for k in 0..spokes {
            let (y, x) = (std::f64::consts::TAU * f64::from(k) / f64::from(spokes)).sin_cos();
            let wi = DVec3::new(theta.sin() * x, theta.sin() * y, theta.cos());
            let whole = if wi.z > 0.0 { model.evaluate(wi, wo).x * wi.z } else { 0.0 };
            let density = |l: &ReflectedLobe| vmf::Lobe { mu: l.direction, kappa: l.kappa, weight: l.weight.x }.density(wi);
            let looked_up: f64 = lobes.iter().map(density).sum();
            off += theta.sin() * (whole - looked_up).abs();
            all += theta.sin() * whole.max(looked_up);
        }
    }
    off / all
}

#[test]
fn levels_follow_from_what_found_lobes_miss() {
    let mut world = scene();
    let model = support::frames::ggx(0.3, DVec3::ONE, DVec3::ZERO);
    world.materials[0].model = model.clone();
    let found = Config { filter: Filter::Vmf8, fit_lobes: 24, ..residual(Rate::Bandwidth) };
    let image = layers(&world, Config { residual_errors: [0.0; 3], ..found.clone() }, &[Aov::Normal]);
    let normal = ["X", "Y", "Z"].map(|c| layer(&image, &format!("normal.{c}")));
    let exact: Vec<Option<f64>> = (0..normal[0].len())
        .map(|i| {
            let pixel = DVec2::new((i % 96) as f64 + 0.5, (i / 96) as f64 + 0.5);
            let cosine = DVec3::from(normal.map(|n| n[i].into())).dot(-world.camera.ray(pixel, EXTENT)).clamp(0.02, 1.0);
            (layer(&image, "A")[i] > 0.0).then(|| missed(&model, DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine)))
        })
        .collect();
    let mut all: Vec<f64> = exact.iter().flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    // Pixels on both sides.
    let limit = all[all.len() / 2];
    let image = layers(&world, Config { residual_errors: [0.0, 0.0, limit as f32], ..found }, &[Aov::Decision]);
    let (mut coarse, mut fine) = ([0; 2], [0; 2]);
    for (decision, exact) in layer(&image, "decision.Y").iter().zip(&exact) {
        let Some(exact) = exact else { continue };
        let count = match exact / limit {
            r if r < 0.9 => &mut coarse,
            r if r > 1.1 => &mut fine,
            _ => continue,
        };
        count[usize::from((*decision != 2.0) == (*exact < limit))] += 1;
    }
    println!("limit {limit:.3} of {:.3} to {:.3}: coarse {coarse:?}, fine {fine:?}", all[0], all[all.len() - 1]);
    for [wrong, right] in [coarse, fine] {
        assert!(right > 100 && wrong * 5 < right, "{wrong} wrong of {}", wrong + right);
    }
}

/// Of area lights the base knows nothing: they are in the residual alone, and are not up-sampled by a factor on what may be dark.
#[test]
fn area_lights_alone_are_shaded_everywhere() {
    let mut world = scene();
    world.environment = None;
    world.lights.push(Light::Sphere { position: [1.5, 2.5, 2.0], radius: 0.4, radiance: [30.0; 3] });
    world.lights.push(Light::Point { position: [-2.0, 2.0, 2.0], intensity: [20.0; 3] });
    for samples_per_side in [1, 2] {
        let config = |estimator, directions| Config { estimator, directions, samples_per_side, ..residual(Rate::Bandwidth) };
        let found = layers(&world, config(Estimator::Residual, 64), &[Aov::Decision]);
        let plain = Config { rate: Rate::Full, ..config(Estimator::Mis, 1024) };
        let truth = layers(&world, plain, &[]);
        let [mut difference, mut all] = [0.0; 2];
        for (a, b) in layer(&found, "G").iter().zip(layer(&truth, "G")) {
            difference += f64::from(a - b).powi(2);
            all += f64::from(*b).powi(2);
        }
        let error = (difference / all).sqrt();
        println!("{samples_per_side} samples a side: {error:.5}");
        assert!(error < 0.03, "{samples_per_side}: {error}");
    }
}

#[test]
fn area_lights_are_not_left_out() {
    let mut world = scene();
    world.environment.as_mut().unwrap().intensity = 0.2;
    world.lights.push(Light::Sphere { position: [1.5, 2.5, 2.0], radius: 0.4, radiance: [30.0; 3] });
    let all = Config { residual_errors: [2.0; 3], lmax: 0, ..residual(Rate::Bandwidth) };
    let image = layers(&world, all, &[Aov::Decision]);
    let alone = layers(&world, Config { estimator: Estimator::Mis, directions: 256, ..residual(Rate::Full) }, &[]);
    let sum = |image: &LinearImage| layer(image, "G").iter().map(|v| f64::from(*v)).sum::<f64>();
    let ratio = sum(&image) / sum(&alone);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    assert!(layer(&image, "decision.Y").iter().zip(layer(&image, "A")).all(|(d, a)| *d == if *a > 0.0 { 2.0 } else { -1.0 }));
}

/// Share of covered pixels that are shaded, and the error of display values relative to converged ones.
fn worth(session: &mut Session, converged: &[[f32; 4]]) -> [f64; 2] {
    session.frame([3, 0]).unwrap();
    let frame: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
    let covered: Vec<_> = converged.iter().zip(&frame).filter(|(c, _)| c[3] > 0.0).collect();
    let shown = |v: f32| f64::from(v.clamp(0.0, 1.0)).powf(1.0 / 2.2);
    let square = |(a, b): &(&[f32; 4], &[f32; 4])| (0..3).map(|c| (shown(a[c]) - shown(b[c])).powi(2)).sum::<f64>();
    let error = covered.iter().map(square).sum::<f64>() / (3.0 * covered.len() as f64);
    [f64::from(session.shaded().unwrap()) / covered.len() as f64, -10.0 * error.log10()]
}

/// Whether levels of residuals are better taken from the predicted bandwidth of the image than from the errors of fits: at as many
/// shaded samples they are not.
#[test]
#[ignore = "minutes"]
fn levels_by_errors_beside_levels_by_bandwidth() {
    let device = Options { device: Some(DEVICE.into()), validate: false };
    let mut gains = Vec::new();
    for (mesh, name, light) in [
        ("sphere", "metallic-paint", "sun-sky"),
        ("torus-knot", "satin", "studio"),
        ("torus-knot", "gloss-plastic", "sun-sky"),
        ("bumpy-sphere", "mirror-metal", "studio"),
        ("bumpy-sphere", "rough", "sun-sky"),
    ] {
        let world = world(mesh, 128, table(name), builtin::environment(light, 512).unwrap());
        let of =
            |config: &Config| Session::new(Headless::new(&device, &Requirements::of(config)).unwrap(), &world, config).unwrap();
        let extent = [192, 192];
        let mut full = of(&config(extent, Estimator::Mis, 8192));
        full.frame([1, 0]).unwrap();
        let converged: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&full.image("resolved").unwrap().0);
        let by_errors = Config { rate: Rate::Bandwidth, ..config(extent, Estimator::Residual, 64) };
        let [shaded, psnr] = worth(&mut of(&by_errors), &converged);
        let mut given = of(&Config { rate: Rate::Given, ..by_errors.clone() });
        // From few samples a cycle to many, until more are shaded.
        let mut found = vec![];
        for rate in [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0] {
            let predicted = Config { samples_per_cycle: Some(rate), ..config(extent, Estimator::Mis, 64) };
            given.set_levels(&oracle::predicted(&world, &predicted, &device, 3).unwrap()).unwrap();
            found.push(worth(&mut given, &converged));
        }
        // Between the two that shade about as many.
        let at = found.windows(2).find(|pair| pair[0][0] <= shaded && shaded <= pair[1][0]);
        let by_bandwidth = at.map(|pair| {
            let part = (shaded - pair[0][0]) / (pair[1][0] - pair[0][0]).max(1e-9);
            pair[0][1] + (pair[1][1] - pair[0][1]) * part
        });
        println!(
            "{mesh}, {name}, {light}: errors shade {shaded:.3} for {psnr:.1} dB; bandwidth {found:.3?}, as many {by_bandwidth:.1?}"
        );
        gains.extend(by_bandwidth.map(|other| psnr - other));
    }
    gains.sort_by(f64::total_cmp);
    println!("what errors gain over bandwidth, dB: {gains:.1?}");
    assert!(gains.len() > 1 && gains[0] > 0.0, "{gains:?}");
}
