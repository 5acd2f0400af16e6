//! Pre-convolved light on the device against dense quadrature in f64, and frames that look it up.
#![cfg(feature = "offline")]

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod support {
    pub mod frames;
}

use chosen_device::DEVICE;
use glam::{DVec2, DVec3};
use passband::Texture;
use passband::distribution::LobeFit;
use passband::distribution::fitter::Budget;
use passband::distribution::prefilter::{Chain, convolved, irradiance};
use passband::distribution::reflected::{ReflectedLobe, reflected};
use passband::distribution::suns::{Sun, Suns};
use passband::offline::builtin;
use passband::offline::headless::{Headless, Options};
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::reflectance::{BlinnPhong, Lobe, Model, Reflectance, Vmf};
use passband::sampling::{LatLong, luminance, sobol};
use passband::{Config, Estimator, Light, Rate, Requirements};
use passband_shader_compiler as compiler;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};
use support::frames::{config, ggx, table, world};

/// `tests/glsl/prefilter.comp`.
fn module() -> &'static [u32] {
    static MODULE: OnceLock<Vec<u32>> = OnceLock::new();
    MODULE.get_or_init(|| {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let extra = Some(root.join("tests/glsl"));
        let options = compiler::Options { extra, only: vec!["classify".into()], ..compiler::Options::new(root) };
        let modules = compiler::compile_all(&options).unwrap_or_else(|e| panic!("{e}"));
        modules.into_iter().find(|m| m.name == "prefilter.comp").unwrap().spirv
    })
}

/// A device that holds `map`, turned by `rotation` degrees.
struct Device(Session);

impl Device {
    fn new(map: &LatLong, intensity: f64, rotation: f64) -> Self {
        let mut world = world("sphere", 8, ggx(0.3, DVec3::ONE, DVec3::ONE), map.clone());
        let environment = world.environment.as_mut().unwrap();
        (environment.intensity, environment.rotation) = (intensity, rotation);
        let config = config([8, 8], Estimator::Preconvolved, 1);
        let options = Options { device: Some(DEVICE.into()), validate: true };
        let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
        Self(Session::new(headless, &world, &config).unwrap())
    }

    fn look_up(&mut self, entries: &[(DVec3, f64)]) -> Vec<[f32; 4]> {
        let words: Vec<_> = entries
            .iter()
            .map(|(w, kappa)| {
                let w = w.as_vec3();
                [w.x, w.y, w.z, *kappa as f32].map(f32::to_bits)
            })
            .collect();
        let output = self.0.probe(module(), &words).unwrap();
        assert_eq!(self.0.messages(), [""; 0]);
        output
    }
}

fn rgb([r, g, b, _]: [f32; 4]) -> DVec3 {
    DVec3::new(r.into(), g.into(), b.into())
}

fn direction(i: u32, seed: u32) -> DVec3 {
    let [a, b] = sobol::random(i, seed).map(sobol::to_unit);
    let (z, phi) = (1.0 - 2.0 * a, TAU * b);
    let s = (1.0 - z * z).sqrt();
    DVec3::new(s * phi.cos(), s * phi.sin(), z).as_vec3().as_dvec3().normalize()
}

/// Spread over the sphere, around both poles and along the seam.
fn directions(count: u32) -> Vec<DVec3> {
    let spread = (0..count).map(|i| direction(i, 1));
    let near = |axis: DVec3, seed| (0..count / 6).map(move |i| (axis + direction(i, seed) * 0.02).normalize());
    let seam = (0..count / 6).map(|i| {
        let t = PI * (f64::from(i) + 0.5) / f64::from(count / 6);
        DVec3::new(0.01 * direction(i, 4).x, t.cos(), t.sin()).normalize()
    });
    spread.chain(near(DVec3::Y, 2)).chain(near(DVec3::NEG_Y, 3)).chain(seam).chain([DVec3::Y, DVec3::NEG_Y]).collect()
}

/// Noise over three orders of magnitude, and texels above a hundred times the mean.
fn noise(width: u32, height: u32) -> LatLong {
    let texel = |i| {
        let ([a, b], [c, d]) = (sobol::random(i, 11).map(sobol::to_unit), sobol::random(i, 12).map(sobol::to_unit));
        [a, b, c].map(|v| if i % 997 == 13 { 2e3 } else { (v * 10f64.powf(3.0 * d * d)) as f32 })
    };
    LatLong::new(width, height, (0..width * height).map(texel).collect()).unwrap()
}

fn mean(map: &LatLong) -> f64 {
    let rows = map.texels().chunks_exact(map.width() as usize).enumerate();
    let (sum, total) = rows.fold((0.0, 0.0), |(sum, total), (y, row)| {
        let sine = ((y as f64 + 0.5) / f64::from(map.height()) * PI).sin();
        let row: f64 = row.iter().map(|&[r, g, b]| luminance(DVec3::new(r.into(), g.into(), b.into()))).sum();
        (sum + row * sine, total + f64::from(map.width()) * sine)
    });
    sum / total
}

/// Largest and root mean square difference from quadrature over the mean of the map.
fn errors(found: &[[f32; 4]], expected: &[DVec3], mean: f64) -> [f64; 2] {
    let errors: Vec<f64> = found.iter().zip(expected).map(|(f, e)| (rgb(*f) - e).abs().max_element() / mean).collect();
    let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
    [errors.iter().copied().fold(0.0, f64::max), square.sqrt()]
}

/// Prints the errors of each level, and holds those of a concentration up to 256 against `bounds`.
fn check(name: &str, map: &LatLong, refine: u32, bounds: [f64; 2]) -> Vec<String> {
    let chain = Chain::of([map.width(), map.height()]);
    let rest = Suns::of(map).removed(map);
    let (mean, directions) = (mean(&rest), directions(24));
    let mut device = Device::new(map, 1.0, 0.0);
    let mut failed = Vec::new();
    let mut run = |label: String, kappa: f64, scale: f64, twin: &(dyn Fn(DVec3) -> DVec3 + Sync), held: bool| {
        let found = device.look_up(&directions.iter().map(|w| (*w, kappa)).collect::<Vec<_>>());
        let expected: Vec<_> = directions.par_iter().map(|w| twin(*w)).collect();
        let errors = errors(&found, &expected, scale * mean);
        println!("{name:12} {label:24} largest {:.4}, rms {:.5}", errors[0], errors[1]);
        if held && (errors[0] > bounds[0] || errors[1] > bounds[1]) {
            failed.push(format!("{name} {label}: {errors:?}"));
        }
    };
    for level in (1..chain.levels()).rev() {
        let kappa = chain.kappa(level);
        for (kappa, between) in [(kappa, ""), (1.4 * kappa, " between"), (2.0 * kappa, "")] {
            let held = kappa <= 256.0;
            run(format!("kappa {kappa:.1}{between}"), kappa, 1.0, &|w| convolved(&rest, w, kappa, refine), held);
        }
    }
    run("irradiance".into(), -1.0, PI, &|w| irradiance(&rest, w, refine), true);
    failed
}

#[test]
fn levels_agree_with_quadrature() {
    let builtin = |name| builtin::environment(name, 512).unwrap();
    // Largest and root mean square error over the mean of the map, which the studio is 60 times of in places. A lobe's variance is two
    // squared texels: with one, errors are twice as large and estimates beside look-ups are biased by up to .5 %.
    let cases = [
        ("cosine-64", builtin("cosine-64"), 2, [0.008, 0.004]),
        ("sun-sky", builtin("sun-sky"), 2, [0.03, 0.02]),
        ("studio", builtin("studio"), 2, [0.11, 0.04]),
        ("noise", noise(256, 128), 3, [0.03, 0.01]),
        ("noise odd", noise(99, 51), 5, [0.09, 0.025]),
    ];
    let failed: Vec<_> = cases.iter().flat_map(|(name, map, refine, bounds)| check(name, map, *refine, *bounds)).collect();
    assert!(failed.is_empty(), "{}", failed.join("; "));
}

/// Light of no variation is exactly that, at any concentration, and black is black.
#[test]
fn constant_light_stays_constant() {
    for radiance in [0.0f32, 0.3, 1e4] {
        let map = LatLong::new(100, 50, vec![[radiance; 3]; 5000]).unwrap();
        let mut device = Device::new(&map, 1.0, 33.0);
        let kappas = [0.0, 0.5, 2.0, 31.0, 900.0, 4e4, 1e9, -1.0];
        let entries: Vec<_> = kappas.into_iter().flat_map(|k| directions(24).into_iter().map(move |w| (w, k))).collect();
        for ((w, kappa), found) in entries.iter().zip(device.look_up(&entries)) {
            let expected = if *kappa < 0.0 { PI } else { 1.0 } * f64::from(radiance);
            let error = (rgb(found) - expected).abs().max_element();
            assert!(error <= 2e-6 * expected, "{radiance} {kappa} {w}: {found:?}");
        }
    }
}

/// The mean over the sphere is that of the map at each level, and with its suns nothing is lost.
#[test]
fn energy_is_kept() {
    let map = builtin::environment("sun-sky", 512).unwrap();
    let suns = Suns::of(&map);
    assert_eq!(suns.suns.len(), 1);
    let rest = mean(&suns.removed(&map));
    let sun = luminance(suns.suns[0].irradiance) / (4.0 * PI);
    assert!(((rest + sun) / mean(&map) - 1.0).abs() < 1e-6);
    // Midpoints of a grid that is finer than any level but the first.
    let (columns, rows) = (256, 128);
    let at = |x: u32, y: u32| {
        let (theta, phi) = ((f64::from(y) + 0.5) / f64::from(rows) * PI, (f64::from(x) + 0.3) / f64::from(columns) * TAU);
        DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
    };
    let grid: Vec<_> = (0..rows).flat_map(|y| (0..columns).map(move |x| at(x, y))).collect();
    let mut device = Device::new(&map, 1.0, 0.0);
    for (kappa, scale) in [(0.8, 1.0), (3.3, 1.0), (13.0, 1.0), (100.0, 1.0), (830.0, 1.0), (-1.0, PI)] {
        let found = device.look_up(&grid.iter().map(|w| (*w, kappa)).collect::<Vec<_>>());
        let sine = |w: &DVec3| w.x.hypot(w.z);
        let sum: f64 = found.iter().zip(&grid).map(|(f, w)| luminance(rgb(*f)) * sine(w)).sum();
        let ratio = sum / grid.iter().map(sine).sum::<f64>() / (scale * rest);
        println!("kappa {kappa}: {ratio:.5}");
        assert!((ratio - 1.0).abs() < 2e-3, "{kappa}: {ratio}");
    }
}

/// A turn of the environment turns what is looked up, the suns too; intensity scales it; another recording gives the same bits.
#[test]
fn rotation_intensity_and_determinism() {
    let map = builtin::environment("sun-sky", 256).unwrap();
    let kappas = [1.0, 20.0, 700.0, 1e5, -1.0];
    let entries: Vec<_> = kappas.into_iter().flat_map(|k| directions(24).into_iter().map(move |w| (w, k))).collect();
    let plain = Device::new(&map, 1.0, 0.0).look_up(&entries);
    assert_eq!(plain, Device::new(&map, 1.0, 0.0).look_up(&entries));
    let turn = glam::DMat3::from_rotation_y(77f64.to_radians());
    let turned: Vec<_> = entries.iter().map(|(w, k)| (turn * *w, *k)).collect();
    let mut device = Device::new(&map, 2.0, 77.0);
    for (((w, kappa), p), t) in entries.iter().zip(&plain).zip(device.look_up(&turned)) {
        let (p, t) = (rgb(*p), rgb(t) / 2.0);
        // Coordinates are rounded, and steep light makes that visible.
        assert!((p - t).abs().max_element() <= 1e-3 * p.max_element().max(0.1), "{w} {kappa}: {p} {t}");
    }
    let sun = &Suns::of(&map).suns[0];
    let found = device.look_up(&[(DVec3::Y, -2.0), (DVec3::Y, -3.0)]);
    let expected = turn * sun.direction;
    assert!(rgb(found[0]).distance(expected) < 1e-5, "{found:?} {expected}");
    assert!((f64::from(found[0][3]) / (2.0 * sun.irradiance.x) - 1.0).abs() < 1e-6);
    assert_eq!(found[1], [-1.0; 4], "one sun");
}

/// Beyond the last lobe it is the map, which has the same texels.
#[test]
fn mirrors_see_the_map() {
    let map = builtin::environment("studio", 256).unwrap();
    let directions: Vec<_> = (0..500).map(|i| direction(i, 9)).filter(|w| w.y.abs() < 0.99).collect();
    let found = Device::new(&map, 1.0, 0.0).look_up(&directions.iter().map(|w| (*w, 1e9)).collect::<Vec<_>>());
    for (w, found) in directions.iter().zip(&found) {
        let expected = map.radiance(*w);
        assert!(
            (rgb(*found) - expected).abs().max_element() < 2e-4 * expected.max_element().max(1.0),
            "{w}: {found:?} {expected}"
        );
    }
}

/// Each covered pixel of a frame, from the twins: lobes, quadrature under them, irradiance, suns by the reflectance itself, in parts. Lobes are
/// those of a fit, or the model's own where a map may change it.
#[test]
fn frames_agree_with_the_twins() {
    let map = builtin::environment("sun-sky", 256).unwrap();
    let suns = Suns::of(&map);
    let rest = suns.removed(&map);
    let (grey, albedo) = (DVec3::new(0.9, 0.5, 0.2), DVec3::new(0.1, 0.3, 0.2));
    let lobe = |mu, kappa| Lobe { mu, kappa, weight: 0.4 };
    let models = [
        ggx(0.2, grey, albedo),
        Model::BlinnPhong(BlinnPhong { exponent: 60.0, specular: grey, albedo }),
        Model::Vmf(Arc::new(Vmf::new(&[lobe(DVec3::Z, 40.0), lobe(DVec3::new(0.3, 0.1, 1.0), 90.0)]).unwrap())),
    ];
    let white = Arc::new(Texture::colour8([1, 1], &[[255; 3]]).unwrap());
    let own = ["GGX", "Blinn-Phong", "vMF"].into_iter().zip(models).map(|(name, model)| (name, model, None));
    // The last is about as sharp as the sun is wide.
    let sharp = ggx(0.02, grey, albedo);
    let fitted = [("satin, fitted", table("satin")), ("GGX, fitted", ggx(0.2, grey, albedo)), ("sharp GGX, fitted", sharp)].map(
        |(name, model)| {
            let fit = LobeFit::build(&model, Budget { lobes: 8, error: 0.0 });
            (name, model, Some(fit))
        },
    );
    for (name, model, fit) in own.chain(fitted) {
        let is_sharp = name == "sharp GGX, fitted";
        let mut world = world("sphere", 96, model.clone(), map.clone());
        if fit.is_none() {
            world.materials[0].maps.specular = Some(Arc::clone(&white));
        }
        let extent = [48, 48];
        let config = Config { fit_lobes: 8, fit_error: 0.0, ..config(extent, Estimator::Preconvolved, 1) };
        let options = Options { device: Some(DEVICE.into()), validate: true };
        let headless = Headless::new(&options, &Requirements::of(&config)).unwrap();
        let mut session = Session::new(headless, &world, &config).unwrap();
        session.frame([0, 0]).unwrap();
        let texels = |image: (Vec<u8>, _, _)| bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(&image.0);
        let (normals, resolved) = (texels(session.image("normals").unwrap()), texels(session.image("resolved").unwrap()));
        assert_eq!(session.messages(), [""; 0]);
        let pixels: Vec<_> = (0..normals.len()).filter(|&i| resolved[i][3] == 1.0 && (is_sharp || i % 7 == 3)).collect();
        assert!(pixels.len() > 100);
        let compared: Vec<_> = pixels
            .par_iter()
            .filter_map(|&i| {
                assert_eq!(normals[i][3], 0.0, "no tangent: the local frame stands for it");
                let n = rgb(normals[i]).normalize();
                let o = -world.camera.ray(DVec2::new((i % 48) as f64 + 0.5, (i / 48) as f64 + 0.5), extent);
                let cosine = n.dot(o);
                let x = (o - n * cosine).normalize();
                let y = n.cross(x);
                let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                let (lobes, diffuse) = match &fit {
                    Some(fit) => fit.at(cosine).reflected(),
                    None => reflected(&model, wo).unwrap(),
                };
                let light = |l: &ReflectedLobe| {
                    l.weight * convolved(&rest, x * l.direction.x + y * l.direction.y + n * l.direction.z, l.kappa, 1)
                };
                let point = |&[w, irradiance]: &[DVec3; 2]| {
                    let wi = DVec3::new(x.dot(w), y.dot(w), n.dot(w));
                    model.evaluate(wi, wo) * irradiance * wi.z.max(0.0)
                };
                let sun = |s: &Sun| s.points.iter().map(point).sum::<DVec3>();
                let of_suns = suns.suns.iter().map(sun).sum::<DVec3>();
                // The sharp one's own lobes lie between the finest of this chain and the map: where it is the sun that is seen.
                if cosine <= 0.2 || is_sharp && of_suns.x < 1.0 {
                    return None;
                }
                let expected = lobes.iter().map(light).sum::<DVec3>() + diffuse * irradiance(&rest, n, 1) + of_suns;
                Some((rgb(resolved[i]), expected))
            })
            .collect();
        let error = |(found, expected): &(DVec3, DVec3)| ((*found - *expected).abs() / *expected).max_element();
        let largest = compared.iter().map(error).fold(0.0, f64::max);
        let mean = compared.iter().map(error).sum::<f64>() / compared.len() as f64;
        println!("{name}: mean {mean:.5}, largest {largest:.4} of {} pixels", compared.len());
        assert!(compared.len() > 10 && mean < 0.01 && largest < 0.05, "{name}: mean {mean}, largest {largest}");
    }
}

/// As where light changes in every frame: all that is made of it is made anew, and nothing is left of what was.
#[test]
fn another_environment_in_every_frame_is_as_good_as_a_fresh_one() {
    let maps = ["studio", "sun-sky", "constant"].map(|name| builtin::environment(name, 256).unwrap());
    let mut brighter = maps[1].clone();
    brighter = LatLong::new(256, 128, brighter.texels().iter().map(|t| t.map(|c| 1.5 * c)).collect()).unwrap();
    let smaller = builtin::environment("studio", 128).unwrap();
    for (estimator, rate) in
        [(Estimator::Preconvolved, Rate::Full), (Estimator::Cv, Rate::Full), (Estimator::Residual, Rate::Bandwidth)]
    {
        let config = Config { rate, fit_lobes: 8, ..config([48, 32], estimator, 8) };
        let open = |map: &LatLong| {
            let world = world("bumpy-sphere", 48, table("satin"), map.clone());
            let options = Options { device: Some(DEVICE.into()), validate: true };
            Session::new(Headless::new(&options, &Requirements::of(&config)).unwrap(), &world, &config).unwrap()
        };
        let frame = |session: &mut Session, number: u32| {
            session.frame([3, number]).unwrap();
            assert_eq!(session.messages(), [""; 0]);
            session.image("resolved").unwrap().0
        };
        let mut session = open(&maps[0]);
        let mut images = vec![frame(&mut session, 0)];
        let mut bytes = Vec::new();
        for (number, map) in (1..).zip([&maps[1], &brighter, &maps[2], &smaller, &maps[0]]) {
            session.renew_environment(map).unwrap();
            images.push(frame(&mut session, number));
            bytes.push(session.headless().live_bytes());
            assert!(images[number as usize] == frame(&mut open(map), number), "{estimator:?}, frame {number}");
        }
        assert!(images.windows(2).all(|pair| pair[0] != pair[1]));
        assert!(bytes[0] == bytes[1] && bytes[1] == bytes[4] && bytes[3] < bytes[4], "{bytes:?}: what was is freed");
    }
}

/// What has to be sampled or is not shaded everywhere is refused.
#[test]
fn what_it_cannot_express_is_refused() {
    let map = builtin::environment("constant", 64).unwrap();
    let open = |world: &World, config: &Config| {
        let options = Options { device: Some(DEVICE.into()), validate: true };
        let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
        Session::new(headless, world, config)
    };
    let plain = config([8, 8], Estimator::Preconvolved, 1);
    let mut lit = world("sphere", 8, ggx(0.3, DVec3::ONE, DVec3::ONE), map);
    for estimator in [Estimator::Preconvolved, Estimator::Cv] {
        let half = Config { rate: Rate::Uniform(1), ..config([8, 8], estimator, 2) };
        let error = open(&lit, &half).err().unwrap().to_string();
        assert!(error.contains("Config::rate") && error.contains(&format!("{estimator:?}")), "{error}");
    }
    lit.lights.push(Light::Sphere { position: [0.0, 3.0, 0.0], radius: 1.0, radiance: [1.0; 3] });
    let error = open(&lit, &plain).unwrap().frame([0, 0]).unwrap_err().to_string();
    assert!(error.contains("lights[0]"), "{error}");
}
