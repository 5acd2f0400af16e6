//! The prediction of bandwidth: the pass against its twin in f64, its units against measured spectra, and what the images shaded
//! at its levels are worth.

#[path = "support/chosen_device.rs"]
mod chosen_device;
#[path = "support/filters.rs"]
mod filters;
#[path = "support/frames.rs"]
mod frames;
#[path = "support/prediction.rs"]
mod prediction;
#[path = "support/levels.rs"]
mod read_back;
#[path = "support/spectrum.rs"]
mod spectrum;

use frames::{config, ggx, table, world};
use glam::{DVec3, Mat4};
use passband::frequency::level::{level, samples_per_cycle};
use passband::frequency::operators::{Combine, Operator};
use passband::frequency::reconstruction::{self as twin, Pyramid};
use passband::offline::builtin;
use passband::offline::metrics::{Exposure, Pair, Picture, compare};
use passband::offline::world::World;
use passband::reflectance::{BlinnPhong, Model};
use passband::sampling::LatLong;
use passband::{Config, Estimator, Filter, Light, Maps, Rate, Texture};
use prediction::{Frame, Twin};
use read_back::{session, surface};
use std::sync::Arc;

/// Frames that predict, with `directions` a shaded sample.
fn predicted(extent: [u32; 2], directions: u32) -> Config {
    Config { rate: Rate::Bandwidth, ..config(extent, Estimator::Mis, directions) }
}

fn sky(name: &str) -> LatLong {
    builtin::environment(name, 256).unwrap()
}

/// Squares of `side` texels, dark and light, in a map of 64.
fn checks(side: usize) -> Maps {
    let texel = |i: usize| [if (i % 64 / side + i / 64 / side).is_multiple_of(2) { 0.9 } else { 0.1 }; 3];
    let albedo = Texture::colour([64; 2], &(0..64 * 64).map(texel).collect::<Vec<_>>()).unwrap();
    Maps { albedo: Some(Arc::new(albedo)), ..Maps::default() }
}

/// Flat in the left half, checks in the right one.
fn half_checks() -> Maps {
    let texel = |i: usize| [if i % 64 >= 32 && (i % 64 / 4 + i / 64 / 4).is_multiple_of(2) { 0.9 } else { 0.1 }; 3];
    let albedo = Texture::colour([64; 2], &(0..64 * 64).map(texel).collect::<Vec<_>>()).unwrap();
    Maps { albedo: Some(Arc::new(albedo)), ..Maps::default() }
}

fn plane(model: passband::reflectance::Model, map: LatLong) -> World {
    let mut plane = world("plane", 16, model, map);
    plane.camera.position = DVec3::new(0.0, 2.4, 2.4);
    plane
}

/// Of what the bandwidth would be if nothing cancelled. Curvature and the result travel as 16-bit floats (2^-11 each), the
/// environment's bandwidth is within 0.3 % of its twin (tests/environment_bandwidth.rs), tables are 9-bit (2^-10).
/// Measured: 1.1e-3, and 2e-3 to 6e-3 in fewer than one block of a hundred.
const BANDWIDTH: f64 = 6e-3;
/// Blocks of which a probe falls on the border between two texels of a bandwidth map, or between two view angles, may have any
/// value up to their largest probe's: no more than this share.
const BORDERS: f64 = 0.005;

/// Every block of a frame against the twin.
fn against_the_twin(world: &World, base: &Config, variants: &[(Operator, Combine)]) {
    let twin = Twin::new(world, base.eps);
    for &(operator, combine) in variants {
        let config = Config { operator, combine, curvature: true, ..base.clone() };
        let side = 2 * config.samples_per_side as usize;
        let mut session = session(world, &config);
        session.frame([9, 3]).unwrap();
        assert_eq!(session.messages(), [""; 0]);
        let frame = Frame::read(&mut session);
        let a_pixel = config.directions * config.samples_per_side;
        let rate = config.samples_per_cycle.map_or(samples_per_cycle(a_pixel), f64::from);
        let top = (config.lmax + config.samples_per_side.ilog2()).min(5) as i32;
        let (mut blocks, mut borders, mut worst, mut by_level) = (0.0, 0.0, 0.0f64, [0; 6]);
        for (block, &[got, spread, ..]) in frame.prediction.iter().enumerate() {
            let Some(found) = twin.block(&frame, &config, block, 9) else { continue };
            blocks += 1.0;
            let at = || format!("{} {operator:?} {combine:?}, block {block}: {got} {spread}, {found:?}", world.name);
            // The largest that the pass writes.
            let error = (got - found.bandwidth.min(6e4)).abs() / found.terms;
            let spread_error = (spread - found.spread).abs() / (found.spread + 0.2);
            let near = error <= BANDWIDTH && spread_error <= BANDWIDTH;
            worst = worst.max(if near { error } else { 0.0 });
            borders += if near { 0.0 } else { 1.0 };
            assert!(near || got <= found.greatest * (1.0 + BANDWIDTH), "{}", at());
            // Of the exact value and of what is written of it: they differ where rounding crosses a border.
            let half = got * 1e-3 + 1e-7;
            let range = [got + half, got - half].map(|b| level(b, rate, [0, top]) as u32);
            // Of another object, at most a pixel's.
            let others = range.map(|l| l.min(config.samples_per_side.ilog2()));
            let own = level(found.bandwidth, rate, [0, top]) as u32;
            for (p, _) in frame.samples(block, side) {
                let same = frame.ids[p] == 0 || (frame.ids[p] - 1) >> 16 == (frame.ids[found.at] - 1) >> 16;
                let expected = if same { range } else { others };
                assert!((expected[0]..=expected[1]).contains(&frame.levels[p]), "{}: {}", at(), frame.levels[p]);
                let within = |f: f64| level(found.bandwidth + f * BANDWIDTH * found.terms, rate, [0, top]) as u32;
                assert!(!near || !same || within(1.0) != within(-1.0) || frame.levels[p] == own, "{}: {own}", at());
                by_level[frame.levels[p] as usize] += 1;
            }
        }
        println!(
            "{} {operator:?} {combine:?}: worst of {blocks} blocks {worst:.1e}, {borders} at borders, samples by level {by_level:?}",
            world.name
        );
        assert!(blocks > 100.0 && borders <= BORDERS * blocks, "{borders} of {blocks}");
    }
}

const OPERATORS: [(Operator, Combine); 3] =
    [(Operator::Box, Combine::Mean), (Operator::Clipped, Combine::Mean), (Operator::Covariance, Combine::Mean)];

#[test]
fn the_pass_is_as_its_twin() {
    let clipped = |combine| (Operator::Clipped, combine);
    let glossy = || ggx(0.15, DVec3::new(0.5, 0.4, 0.3), DVec3::splat(0.4));
    let mut ball = world("sphere", 128, glossy(), sky("sun-sky"));
    ball.environment.as_mut().unwrap().rotation = 77.0;
    let with_max = [&OPERATORS[..], &[clipped(Combine::Max), clipped(Combine::Literal)]].concat();
    against_the_twin(&ball, &predicted([96, 80], 64), &with_max);
    let paint = world("sphere", 128, table("metallic-paint"), sky("studio"));
    against_the_twin(&paint, &Config { probes: 7, lmax: 5, ..predicted([95, 71], 64) }, &OPERATORS);
    let bumpy = world("bumpy-sphere", 128, table("metallic-paint"), sky("sun-sky"));
    against_the_twin(&bumpy, &predicted([96, 80], 256), &[clipped(Combine::Mean), clipped(Combine::Max)]);
    let mut lit = world("bumpy-sphere", 128, glossy(), sky("studio"));
    lit.materials[0].maps = checks(4);
    lit.lights = vec![
        Light::Point { position: [1.0, 1.5, 1.2], intensity: [3.0, 2.0, 1.0] },
        Light::Directional { direction: [0.3, -1.0, -0.4], irradiance: [1.0, 2.0, 3.0] },
        Light::Sphere { position: [-1.5, 0.5, 1.0], radius: 0.2, radiance: [20.0; 3] },
    ];
    lit.materials[0].maps = Maps { tiling: [3.0, 0.7], ..half_checks() };
    let finer = Config { eps: 0.03, samples_per_side: 4, probes: 4, ..predicted([33, 29], 64) };
    against_the_twin(&lit, &finer, &[clipped(Combine::Mean), clipped(Combine::Literal)]);
    // Few enough that the frame does not fall back.
    let pixels = Config { samples_per_side: 2, samples_per_cycle: Some(1.0), ..predicted([41, 35], 64) };
    against_the_twin(&lit, &pixels, &[(Operator::Covariance, Combine::Max)]);
}

/// Where the filter finds lobes, these are the reflectance.
#[test]
fn the_lobes_of_a_pixel_are_what_is_predicted_from() {
    let glossy = ggx(0.03, DVec3::new(0.5, 0.4, 0.3), DVec3::splat(0.4));
    let maps = Maps { normal: filters::normals([128; 2], 0.5), ..Maps::default() };
    let mut bumps = filters::scene("sphere", glossy, maps);
    let mean = |config: &Config| {
        let mut session = session(&bumps, config);
        session.frame([9, 3]).unwrap();
        let frame = Frame::read(&mut session);
        let of: Vec<f64> = frame.prediction.iter().filter(|p| p[3] > 0.0).map(|p| p[0]).collect();
        of.iter().sum::<f64>() / of.len() as f64
    };
    let shaded = |filter| mean(&Config { filter, curvature: true, samples_per_cycle: Some(0.5), ..predicted([48, 40], 64) });
    let [kept, widened] = [Filter::Fixed, Filter::Toksvig].map(shaded);
    println!("cycles/pixel of lobes that stay as they are {kept:.3}, as wide as what they stand for {widened:.3}");
    assert!(widened < 0.9 * kept, "{widened} {kept}");
    bumps.lights = vec![Light::Directional { direction: [0.3, -1.0, -0.4], irradiance: [1.0, 2.0, 3.0] }];
    for filter in [Filter::Vmf1, Filter::Vmf8] {
        let config = Config { filter, samples_per_cycle: Some(0.5), ..predicted([96, 80], 64) };
        against_the_twin(&bumps, &config, &[(Operator::Clipped, Combine::Mean)]);
    }
    // Metals of every kind of lobes, of which some directions have no density at all: hardly a block goes without a prediction.
    let metals = [
        ggx(0.1, DVec3::new(0.9, 0.5, 0.4), DVec3::ZERO),
        Model::BlinnPhong(BlinnPhong { exponent: 900.0, specular: DVec3::ONE, albedo: DVec3::ZERO }),
        filters::lobes(&[(0.0, 800.0), (0.3, 500.0)]),
    ];
    for model in metals {
        bumps.materials[0].model = model;
        for filter in [Filter::Lean, Filter::Leadr, Filter::Vmf8, Filter::Clusters] {
            let config = Config { filter, samples_per_cycle: Some(0.5), curvature: true, ..predicted([64, 48], 64) };
            let mut session = session(&bumps, &config);
            session.frame([9, 3]).unwrap();
            let frame = Frame::read(&mut session);
            let seen: Vec<_> = frame.prediction.iter().filter(|p| p[3] > 0.0).collect();
            let varies = seen.iter().filter(|p| p[0] > 0.0 && p[0].is_finite() && p[1].is_finite()).count();
            assert!(seen.len() > 100 && varies * 100 > seen.len() * 85, "{filter:?}: {varies} of {}", seen.len());
        }
    }
}

/// A mirror ball in light of one frequency: the spectrum of the image's windows against what the operator says of their middle.
#[test]
fn predicted_cycles_are_measured_cycles() {
    for k in [64.0, 128.0, 200.0] {
        let ratios = spectrum::ratios(k, 512);
        let median = ratios[ratios.len() / 2];
        println!("K {k}: {median:.3}, 5 to 95 % {:.2} to {:.2}", ratios[ratios.len() / 20], ratios[ratios.len() * 19 / 20]);
        assert!(ratios.len() > 30 && (0.85..1.15).contains(&median), "{} windows, {median}", ratios.len());
    }
}

/// The pass on a ball of GGX too sharp to blur what it mirrors: the light's bandwidth is estimated there.
#[test]
fn a_sharp_lobe_is_predicted_as_a_mirror() {
    for k in [64, 128] {
        let map = builtin::environment(&format!("cosine-{k}"), 1024).unwrap();
        let ball = world("sphere", 256, ggx(0.003, DVec3::ONE, DVec3::ZERO), map);
        let mut session = session(&ball, &Config { curvature: true, ..predicted([512, 512], 2) });
        session.frame([0, 0]).unwrap();
        let frame = Frame::read(&mut session);
        let exact = spectrum::seen(f64::from(k), 512);
        let mut ratios: Vec<f64> = (0..frame.blocks[0] * frame.blocks[1])
            .filter_map(|block| {
                let (_, b) = exact[frame.samples(block, 2).next()?.0]?;
                (b < 0.4).then(|| frame.prediction[block][0] / b)
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        let [low, median, high] = [0.05, 0.5, 0.95].map(|q| ratios[(ratios.len() as f64 * q) as usize]);
        println!("K {k}: {low:.2} {median:.2} {high:.2} of {} blocks", ratios.len());
        assert!(ratios.len() > 5000 && (0.85..1.15).contains(&median) && low > 0.5 && high < 2.0);
    }
}

/// What a frame shows: radiance, covered pixels, the share of covered samples that was shaded.
struct Shot {
    picture: Picture,
    mask: Vec<bool>,
    shaded: f64,
}

fn shot(world: &World, config: &Config) -> Shot {
    let mut session = session(world, config);
    session.frame([5, 0]).unwrap();
    let (texels, _) = prediction::texels(&mut session, "resolved");
    let ids: Vec<u32> = bytemuck::pod_collect_to_vec(&session.image("ids").unwrap().0);
    let covered = ids.iter().filter(|id| **id != 0).count() as f64;
    let shaded = f64::from(session.shaded().unwrap()) / covered;
    assert_eq!(session.messages(), [""; 0]);
    let [width, height] = config.extent;
    let rgb = texels.iter().map(|t| [t[0] as f32, t[1] as f32, t[2] as f32]).collect();
    Shot { picture: Picture { width, height, rgb }, mask: texels.iter().map(|t| t[3] > 0.0).collect(), shaded }
}

fn psnr(a: &Shot, b: &Shot) -> f64 {
    let pair = Pair { a: &a.picture, b: &b.picture, mask: &b.mask };
    compare(&[pair], Exposure::Auto, false).unwrap().metrics.psnr
}

/// Same points at the same samples: what differs is up-sampling alone.
fn reconstructed(material: &str, bounds: &[(u32, f32, [f64; 2])]) {
    let extent = [512, 512];
    let knot = world("torus-knot", 256, table(material), builtin::environment("sun-sky", 1024).unwrap());
    let full = shot(&knot, &config(extent, Estimator::Mis, 1024));
    // At two samples a cycle and with four probes comes first.
    let mut four = None;
    for &(probes, spc, [least, most]) in bounds {
        let adaptive = shot(&knot, &Config { probes, samples_per_cycle: Some(spc), ..predicted(extent, 1024) });
        let found = psnr(&adaptive, &full);
        println!("{material}, {probes} probes, {spc} samples a cycle: {:.3} of covered pixels, {found:.1} dB", adaptive.shaded);
        assert!(found > least && adaptive.shaded < most, "{material}: {found} dB, {}", adaptive.shaded);
        let (four, share) = *four.get_or_insert((found, adaptive.shaded));
        if probes == 64 {
            // With as many samples at least.
            assert!(share < 1.05 * adaptive.shaded && four > found - 0.5, "{material}: {four} dB with 4 probes, {found} with 64");
        }
    }
}

#[test]
fn mirrors_are_near_the_full_rate() {
    reconstructed("mirror-metal", &[(4, 2.0, [39.5, 0.18]), (64, 2.0, [39.5, 0.18]), (4, 4.0, [48.5, 0.27])]);
}

/// More probes find less to shade where few see the sun by chance (0.092 for 0.101 at two samples a cycle): samples, and the
/// error with them, are as few probes' at 2.3.
#[test]
fn paint_is_near_the_full_rate() {
    reconstructed("metallic-paint", &[(4, 2.0, [41.5, 0.11]), (64, 2.3, [41.0, 0.11]), (4, 4.0, [47.5, 0.21])]);
}

#[test]
fn runs_are_bit_identical_and_level_zero_is_the_full_rate() {
    let knot = world("torus-knot", 128, table("metallic-paint"), sky("sun-sky"));
    let run = |config: &Config| {
        let mut session = session(&knot, config);
        let mut image = |seed| {
            session.frame([seed, 0]).unwrap();
            ["resolved", "prediction", "level"].map(|name| session.image(name).map(|found| found.0).unwrap_or_default())
        };
        [image(1), image(1), image(2)]
    };
    let base = predicted([150, 101], 16);
    let [first, again, other] = run(&base);
    assert!(first == again && [first.clone(), again, other.clone()] == run(&base));
    assert!(first[1] != other[1], "another seed has other probes");
    let flat = run(&Config { lmax: 0, ..base.clone() });
    let full = run(&Config { rate: Rate::Full, ..base });
    assert!(flat[0][0] == full[0][0] && flat[0][0] != first[0], "level 0 is the full rate");
}

/// Mean level of the covered samples.
fn mean_level(world: &World, config: &Config) -> f64 {
    let mut session = session(world, &Config { curvature: true, ..config.clone() });
    session.frame([1, 0]).unwrap();
    let frame = Frame::read(&mut session);
    let covered: Vec<_> = frame.levels.iter().zip(&frame.ids).filter(|(_, id)| **id != 0).map(|(l, _)| f64::from(*l)).collect();
    covered.iter().sum::<f64>() / covered.len() as f64
}

/// Half and twice the threshold of the analyses, calibrated as they are: the share of samples that get another level.
#[test]
fn the_threshold_matters_little() {
    for material in ["mirror-metal", "metallic-paint", "rough"] {
        let knot = world("torus-knot", 256, table(material), builtin::environment("sun-sky", 1024).unwrap());
        let [base, half, twice] = [0.01, 0.005, 0.02].map(|eps| {
            let mut session = session(&knot, &Config { curvature: true, eps, ..predicted([256, 256], 16) });
            session.frame([1, 0]).unwrap();
            Frame::read(&mut session)
        });
        let covered = base.ids.iter().filter(|id| **id != 0).count() as f64;
        let changed =
            [&half, &twice].map(|other| base.levels.iter().zip(&other.levels).filter(|(a, b)| a != b).count() as f64 / covered);
        println!("{material}: another level at half the threshold {:.3}, at twice {:.3}", changed[0], changed[1]);
        assert!(changed.iter().all(|c| *c < 0.12), "{material}: {changed:?}");
    }
}

/// Of the share of samples that get another level where lobes' bandwidths are kept as so many principal components.
#[test]
fn a_few_components_of_the_lobes_are_enough() {
    for material in ["metallic-paint", "rough"] {
        let knot = world("torus-knot", 256, table(material), sky("sun-sky"));
        let [whole, all, some, none] = [None, Some(16), Some(4), Some(0)].map(|lobe_components| {
            let mut session = session(&knot, &Config { curvature: true, lobe_components, ..predicted([160, 160], 16) });
            session.frame([1, 0]).unwrap();
            Frame::read(&mut session)
        });
        let covered = whole.ids.iter().filter(|id| **id != 0).count() as f64;
        let changed = [&all, &some, &none]
            .map(|other| whole.levels.iter().zip(&other.levels).filter(|(a, b)| a != b).count() as f64 / covered);
        println!("{material}: another level with all, 4, 0 components: {changed:.4?}");
        let [all, some, none] = changed;
        assert!(all < 1e-3 && some < 0.02 && some < none, "{material}: {changed:?}");
    }
}

#[test]
fn textures_ask_for_finer_levels() {
    let config = Config { lmax: 5, ..predicted([160, 120], 64) };
    let mut floor = plane(ggx(0.6, DVec3::splat(0.04), DVec3::splat(0.9)), sky("studio"));
    let plain = mean_level(&floor, &config);
    // An image that the floor shows a tenth of asks for a tenth. Inside their squares, checks are flat.
    let textured = [0.1, 1.0].map(|tiling| {
        floor.materials[0].maps = Maps { tiling: [tiling; 2], ..checks(8) };
        mean_level(&floor, &config)
    });
    println!("mean level: {plain} plain, {textured:?} with checks shown large and small");
    assert!(plain > 4.5 && textured[0] < plain - 0.5 && textured[1] < textured[0] - 2.0 && textured[1] < 2.0);
}

/// Of a map that is flat on one side and checked on the other, only the checks are shaded finely.
#[test]
fn textures_are_read_where_they_are_seen() {
    let config = Config { lmax: 5, curvature: true, ..predicted([160, 120], 64) };
    let mut floor = plane(ggx(0.6, DVec3::splat(0.04), DVec3::splat(0.9)), sky("studio"));
    floor.materials[0].maps = half_checks();
    let mut session = session(&floor, &config);
    session.frame([1, 0]).unwrap();
    let frame = Frame::read(&mut session);
    let (coordinates, _) = prediction::texels(&mut session, "coordinate");
    // Away from the seams, where wavelets reach over.
    let within = |least: f64| {
        let seen = coordinates.iter().zip(&frame.levels).zip(&frame.ids);
        let kept = seen.filter(|((uv, _), id)| **id != 0 && (least..least + 0.3).contains(&uv[0].rem_euclid(1.0)));
        let levels: Vec<_> = kept.map(|((_, level), _)| f64::from(*level)).collect();
        assert!(levels.len() > 500);
        levels.iter().sum::<f64>() / levels.len() as f64
    };
    let (flat, checks) = (within(0.1), within(0.6));
    println!("mean level {flat} where the map is flat, {checks} where it is checked");
    assert!(flat > checks + 3.0 && checks < 1.5, "{flat} {checks}");
}

#[test]
fn a_point_light_asks_for_fine_levels_in_its_highlight() {
    let mut floor = plane(ggx(0.05, DVec3::splat(0.3), DVec3::splat(0.3)), LatLong::new(1, 1, vec![[0.0; 3]]).unwrap());
    floor.environment = None;
    floor.lights = vec![Light::Point { position: [0.0, 0.8, -0.8], intensity: [5.0; 3] }];
    let config = Config { lmax: 5, curvature: true, samples_per_cycle: Some(4.0), ..predicted([200, 160], 16) };
    let mut session = session(&floor, &config);
    session.frame([0, 0]).unwrap();
    let frame = Frame::read(&mut session);
    // Mirrored, the light is below the plane: where the ray to it meets it.
    let highlight = floor.camera.position.lerp(DVec3::new(0.0, -0.8, -0.8), 0.75);
    let (mut near, mut far) = (Vec::new(), Vec::new());
    for (i, level) in frame.levels.iter().enumerate().filter(|(i, _)| frame.ids[*i] != 0) {
        let at = glam::dvec2((i % 200) as f64 + 0.5, (i / 200) as f64 + 0.5);
        let ray = floor.camera.ray(at, config.extent);
        let point = floor.camera.position - ray * (floor.camera.position.y / ray.y);
        let off = point.distance(highlight);
        if off < 0.05 {
            near.push(*level);
        } else if off > 0.5 {
            far.push(*level);
        }
    }
    let mean = |v: &[u32]| f64::from(v.iter().sum::<u32>()) / v.len() as f64;
    println!("mean level {} of {} in the highlight, {} of {} away from it", mean(&near), near.len(), mean(&far), far.len());
    assert!(near.len() > 20 && far.len() > 1000 && mean(&near) < 2.0 && mean(&far) > 4.5);
}

#[test]
fn antialiased_frames_have_no_hole() {
    for (mesh, side) in [("torus-knot", 2), ("bumpy-sphere", 4)] {
        let mut world = world(mesh, 128, table("metallic-paint"), sky("sun-sky"));
        world.objects.push(passband::offline::world::Object {
            mesh: Arc::new(builtin::mesh("plane", 16).unwrap()),
            transform: Mat4::from_translation(glam::vec3(0.0, -0.7, 0.0)),
            material: 0,
        });
        let config = Config { samples_per_side: side, ..predicted([97, 63], 16) };
        let mut session = session(&world, &config);
        session.frame([2, 0]).unwrap();
        let map: Vec<u32> = bytemuck::pod_collect_to_vec(&session.image("level").unwrap().0);
        let map: Vec<u8> = map.into_iter().map(|l| l as u8).collect();
        let surface = surface(&mut session, &world, &config);
        let pyramid = Pyramid::new(&surface, &map, (config.lmax + side.ilog2()).min(5));
        let frame = read_back::Frame::read(&mut session, &pyramid);
        assert_eq!(frame.pyramid, pyramid);
        frame.agrees(&twin::classify(&surface, &pyramid));
        frame.checked_values(&surface);
        let covered = surface.samples.iter().flatten().count() as f64;
        let shaded = f64::from(session.shaded().unwrap()) / covered;
        let (texels, _) = prediction::texels(&mut session, "resolved");
        let lit = texels.iter().filter(|t| t[3] > 0.0);
        assert!(lit.clone().count() > 1000 && lit.clone().all(|t| t[..3].iter().all(|c| c.is_finite() && *c > 0.0)));
        println!("{mesh}, {} samples a pixel: {shaded:.3} shaded", side * side);
        assert!(shaded < 0.6, "{shaded}");
        assert_eq!(session.messages(), [""; 0]);
    }
}
