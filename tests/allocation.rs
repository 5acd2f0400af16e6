//! Directions by predicted variance: the passes against their twin in f64, the budget, what a rule gives to which material, and
//! that it does not change what the image converges to.

#[path = "support/chosen_device.rs"]
mod chosen_device;
#[path = "support/frames.rs"]
mod frames;
#[path = "support/prediction.rs"]
mod prediction;
#[path = "support/levels.rs"]
mod read_back;

use chosen_device::DEVICE;
use frames::{config, ggx, table, world};
use glam::DVec3;
use passband::frequency::Allocation;
use passband::frequency::allocation::{self as twin, NONE};
use passband::offline::aov::Aov;
use passband::offline::builtin;
use passband::offline::headless::Options;
use passband::offline::levels;
use passband::offline::render::{Settings, render};
use passband::offline::session::Session;
use passband::offline::world::World;
use passband::{Config, Estimator, Light, Rate};
use prediction::{Frame, Twin, texels};
use read_back::{scene, session};

const RULES: [Allocation; 3] = [Allocation::Equation8, Allocation::Deviation, Allocation::RelativeDeviation];

fn weighed(extent: [u32; 2], allocation: Allocation, budget: u32) -> Config {
    Config { rate: Rate::Bandwidth, allocation, ..config(extent, Estimator::Mis, budget) }
}

/// Something for each entry of the list.
type Entries<T> = Vec<(u32, T)>;

/// Entries of the list with their logarithmic weights, as the device has them, and what it gave to whom.
fn shared(session: &mut Session, config: &Config) -> (Entries<f64>, Entries<u32>) {
    let count = session.shaded().unwrap() as usize;
    let (weights, [columns, rows]) = texels(session, "prediction");
    let side = 2 * config.samples_per_side as usize;
    // The most of the blocks that the sample's cell reaches into.
    let weight = |entry: u32| {
        let level = entry >> 28;
        let reached = |p: u32, blocks: usize| {
            let first = (p >> level << level) as usize;
            first / side..=((first + (1 << level) - 1) / side).min(blocks - 1)
        };
        let (x, y) = (reached(entry & 0x3fff, columns), reached(entry >> 14 & 0x3fff, rows));
        let blocks = y.flat_map(|y| x.clone().map(move |x| y * columns + x));
        let predicted = blocks.map(|at| weights[at]).filter(|w| w[3] > 0.0);
        predicted.map(|w| w[2]).fold(NONE, f64::max) + config.allocation.by_level() * f64::from(level)
    };
    let mut list: Vec<_> = session.words("list").unwrap()[..count].iter().map(|e| (*e, weight(*e))).collect();
    let mut allocated: Vec<_> =
        session.words("allocated").unwrap().chunks_exact(2).take(count).map(|words| (words[0], words[1])).collect();
    list.sort_by_key(|(entry, _)| *entry);
    let bins: Vec<_> = allocated.iter().map(|(entry, _)| twin::bin(weight(*entry), *entry)).collect();
    assert!(bins.is_sorted_by(|a, b| a >= b), "most first");
    allocated.sort_by_key(|(entry, _)| *entry);
    (list, allocated)
}

/// A frame against the twin; `sources` beside the reflectance.
fn against_the_twin(world: &World, config: &Config, sources: u32) {
    let at = format!("{} {:?} {:?} {}", world.name, config.allocation, config.estimator, config.directions);
    let mut session = session(world, config);
    session.frame([3, 1]).unwrap();
    let (list, allocated) = shared(&mut session, config);
    let mut histogram = vec![0; twin::BINS];
    list.iter().for_each(|(entry, weight)| histogram[twin::bin(*weight, *entry)] += 1);
    assert_eq!(session.words("histogram").unwrap(), histogram, "{at}");
    let budget = f64::from(config.directions);
    let range = twin::range(config.directions, sources);
    let shares = twin::shares(&histogram, budget, range);
    let mut others = 0;
    for ((entry, weight), (same, directions)) in list.iter().zip(&allocated) {
        assert_eq!(entry, same, "{at}");
        let own = twin::directions(shares[twin::bin(*weight, *entry)], range, *entry);
        assert!((range[0]..=range[1]).contains(directions), "{at}");
        // The device's 32 bits may round otherwise between two powers of two.
        assert!(own.abs_diff(*directions) <= 1, "{at}: {own}, {directions}");
        others += usize::from(own != *directions);
    }
    assert!(others * 50 <= list.len(), "{at}: {others} of {}", list.len());
    let total: f64 = allocated.iter().map(|(_, n)| f64::from(*n)).sum();
    let ratio = total / (budget * list.len() as f64);
    println!("{at}: {} samples, {ratio:.4} of the budget, {others} otherwise", list.len());
    assert!((ratio - 1.0).abs() < 0.01, "{at}: {ratio}");
    assert_eq!(session.messages(), [""; 0], "{at}");
}

#[test]
fn the_budget_is_met_as_the_twin_meets_it() {
    let paint = world("bumpy-sphere", 96, table("metallic-paint"), builtin::environment("sun-sky", 256).unwrap());
    let worlds = [scene("trio"), scene("torus-knot"), scene("crowd"), scene("furnace"), paint];
    for world in &worlds {
        for (rule, budget) in RULES.into_iter().zip([8, 64].into_iter().cycle()) {
            against_the_twin(world, &weighed([203, 117], rule, budget), 1);
        }
    }
    // The whole prediction, and no pyramid, where all samples are shaded.
    let all = Config { samples_per_cycle: Some(1000.0), ..weighed([103, 67], Allocation::Deviation, 48) };
    against_the_twin(&worlds[0], &all, 1);
    // Without halves to share out, and with more samples a pixel.
    let alone = weighed([103, 67], Allocation::RelativeDeviation, 3);
    against_the_twin(&worlds[0], &Config { estimator: Estimator::Brdf, ..alone.clone() }, 0);
    against_the_twin(&worlds[0], &Config { samples_per_side: 2, directions: 90, ..alone }, 1);
}

#[test]
fn area_lights_get_their_directions_within_the_budget() {
    let mut lit = scene("trio");
    let light = |x| Light::Sphere { position: [x, 2.0, 1.0], radius: 0.3, radiance: [8.0; 3] };
    lit.lights = [-1.0, 0.0, 1.0].map(light).into();
    let config = weighed([103, 67], Allocation::Deviation, 64);
    against_the_twin(&lit, &config, 4);
    let mut session = session(&lit, &config);
    session.frame([3, 1]).unwrap();
    let (_, allocated) = shared(&mut session, &config);
    let (mut drawn, mut given) = (levels::directions(&mut session, &config).unwrap(), allocated);
    drawn.sort_by_key(|([x, y], _)| (*y, *x));
    given.sort_by_key(|(entry, _)| (entry >> 14 & 0x3fff, entry & 0x3fff));
    assert!(drawn.iter().zip(&given).all(|((_, a), (_, b))| a == b), "nothing beyond what was given");
}

#[test]
fn weights_are_those_of_the_rules() {
    let mut lit = scene("trio");
    lit.lights = vec![Light::Directional { direction: [0.3, -1.0, -0.4], irradiance: [1.0, 2.0, 3.0] }];
    let glossy = ggx(0.15, DVec3::new(0.5, 0.4, 0.3), DVec3::splat(0.4));
    let ball = world("bumpy-sphere", 96, glossy, builtin::environment("sun-sky", 256).unwrap());
    for world in [&lit, &ball] {
        let twin = Twin::new(world, passband::frequency::environment::EPS);
        for rule in RULES {
            let config = Config { curvature: true, probes: 8, ..weighed([96, 80], rule, 64) };
            let mut session = session(world, &config);
            session.frame([9, 3]).unwrap();
            let frame = Frame::read(&mut session);
            let (mut blocks, mut far) = (0, 0);
            let mut pairs = Vec::new();
            for (block, &[_, _, got, _]) in frame.prediction.iter().enumerate() {
                let Some(found) = twin.block(&frame, &config, block, 9) else { continue };
                // Where the probes agree, little is left of their variance but rounding.
                if found.spread < 0.05 {
                    continue;
                }
                blocks += 1;
                far += usize::from((got - found.log_weight).abs() > 0.05);
                pairs.push((found.log_weight, got));
            }
            // The device ranks blocks as the twin does.
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            let quarter = pairs.len() / 4;
            let mean = |part: &[(f64, f64)]| part.iter().map(|p| p.1).sum::<f64>() / part.len() as f64;
            let quarters: Vec<f64> = pairs.chunks(quarter).take(4).map(mean).collect();
            println!("{} {rule:?}: {far} of {blocks} differ, {quarters:.2?}", world.name);
            assert!(quarters.windows(2).all(|pair| pair[0] < pair[1]), "{quarters:?}");
            // Probes at borders between texels, as tests/bandwidth.rs has it.
            assert!(blocks > 200 && far * 50 <= blocks, "{} {rule:?}: {far} of {blocks}", world.name);
            assert_eq!(session.messages(), [""; 0]);
        }
    }
}

/// Mean logarithm of the weight over a ball of GGX that reflects white, for roughness after roughness.
fn along_roughness(rule: Allocation) -> [f64; 4] {
    [0.05, 0.1, 0.2, 0.4].map(|alpha| {
        let ball = world("sphere", 96, ggx(alpha, DVec3::ONE, DVec3::ZERO), builtin::environment("sun-sky", 256).unwrap());
        let config = Config { probes: 16, ..weighed([96, 80], rule, 64) };
        let mut session = session(&ball, &config);
        session.frame([0, 0]).unwrap();
        let (texels, _) = texels(&mut session, "prediction");
        let weights: Vec<f64> = texels.iter().map(|t| t[2]).filter(|w| *w != 0.0 && *w > NONE).collect();
        weights.iter().sum::<f64>() / weights.len() as f64
    })
}

#[test]
fn rougher_materials_get_more_by_variance_and_fewer_by_equation_8() {
    for rule in RULES {
        let along = along_roughness(rule);
        println!("{rule:?}: {along:.2?}");
        let rises = |pair: &[f64]| if rule == Allocation::Equation8 { pair[0] > pair[1] } else { pair[0] < pair[1] };
        assert!(along.windows(2).all(rises), "{rule:?}: {along:?}");
    }
}

/// Mean over `frames` frames, each of other points.
fn averaged(world: &World, config: &Config, frames: u32) -> Vec<[f64; 3]> {
    let mut session = session(world, config);
    let mut sum = Vec::new();
    for frame in 0..frames {
        session.frame([1, frame]).unwrap();
        let (texels, _) = texels(&mut session, "resolved");
        sum.resize(texels.len(), [0.0; 3]);
        sum.iter_mut().zip(&texels).for_each(|(s, t)| (0..3).for_each(|c| s[c] += t[c] / f64::from(frames)));
    }
    sum
}

#[test]
fn no_rule_changes_what_the_image_converges_to() {
    let world = scene("trio");
    let extent = [64, 48];
    let distance = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let sum =
            |f: &dyn Fn(f64, f64) -> f64| -> f64 { a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f(*a, *b)).sum() };
        let norm = sum(&|_, b| b * b).sqrt();
        (sum(&|a, b| (a - b).powi(2)).sqrt() / norm, sum(&|a, b| a - b) / sum(&|_, b| b))
    };
    let constant = |frames| averaged(&world, &weighed(extent, Allocation::Constant, 256), frames);
    let converged = constant(64);
    for rule in RULES {
        let [few, many] = [4, 64].map(|frames| distance(&averaged(&world, &weighed(extent, rule, 256), frames), &converged));
        println!("{rule:?}: {few:.4?} after 4 frames, {many:.4?} after 64");
        // Four times less noise after 16 times the frames, or nearly: what stays would be bias.
        assert!(many.0 < few.0 * 0.4 && many.1.abs() < 0.002, "{rule:?}");
    }
}

#[test]
fn reruns_are_bit_identical() {
    let world = scene("trio");
    let run = |_| {
        let mut session = session(&world, &weighed([203, 117], Allocation::RelativeDeviation, 16));
        session.frame([0, 0]).unwrap();
        session.frame([0, 0]).unwrap();
        let words: u64 = session.words("histogram").unwrap().iter().map(|n| u64::from(*n)).sum();
        assert_eq!(words, u64::from(session.shaded().unwrap()), "counted anew in every frame");
        session.image("resolved").unwrap().0
    };
    let images = [0, 1].map(run);
    assert!(images[0] == images[1]);
}

#[test]
fn statistics_and_layers_say_what_was_drawn() {
    let world = scene("trio");
    let device = Options { device: Some(DEVICE.into()), validate: true };
    for allocation in [Allocation::Constant, Allocation::Equation8, Allocation::Deviation] {
        let aovs = vec![Aov::Samples, Aov::Shaded];
        let config = Config { rate: Rate::Bandwidth, allocation, directions: 32, ..Config::new([160, 120]) };
        let base = Settings { aovs, ..Settings::new(config) };
        let rendered = render(&world, &Settings { device: device.clone(), ..base }, &mut |_, _, _| {}).unwrap();
        let layer = |name| rendered.image.channel(name).unwrap().iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
        let (drawn, shaded) = (layer("samples.Y"), layer("shaded.Y"));
        let samples = &rendered.stats.samples;
        assert_eq!(drawn.iter().sum::<f64>(), samples.taken as f64);
        assert_eq!(samples.budget, 32 * rendered.stats.pixels.shaded);
        assert!((samples.taken as f64 / samples.budget as f64 - 1.0).abs() < 0.01, "{samples:?}");
        assert!(drawn.iter().zip(&shaded).all(|(n, s)| (*n > 0.0) == (*s > 0.0)));
        let different: std::collections::BTreeSet<u32> = drawn.iter().map(|n| *n as u32).collect();
        // Some stand for cells of two levels, and so have twice as many.
        assert_eq!(different.len() > 4, allocation != Allocation::Constant, "{different:?}");
        assert_eq!(rendered.stats.settings["np_rule"], allocation.name());
        assert_eq!(rendered.stats.validation_messages, [""; 0]);
    }
}
