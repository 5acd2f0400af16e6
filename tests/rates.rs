//! Image-based and best possible levels on scenes: what they shade and what it costs in error.

#[path = "support/chosen_device.rs"]
mod chosen_device;
#[path = "support/levels.rs"]
mod support;

use chosen_device::DEVICE;
use passband::frequency::luminance::{NOTICEABLE, levels as by_contrast};
use passband::offline::headless::Options;
use passband::offline::levels;
use passband::offline::rates::{self, oracle};
use passband::{Config, Rate};
use support::{scene, session};

fn config(rate: Rate) -> Config {
    Config { frames_in_flight: 1, rate, ..Config::new([160, 120]) }
}

#[test]
fn the_oracle_shades_less_than_bandwidth_at_no_more_error() {
    let device = Options { device: Some(DEVICE.into()), validate: true };
    for name in ["torus-knot", "trio"] {
        let world = scene(name);
        let config = config(Rate::Given);
        let bandwidth = oracle::predicted(&world, &config, &device, 0).unwrap();
        let oracle = oracle::converged(&world, &config, &device, 0).unwrap();
        let predicted = oracle.outcome(&bandwidth);
        let (best, expected) = oracle.cheapest(predicted.error);
        assert_eq!(oracle.outcome(&best), expected);
        assert!(expected.error <= predicted.error && expected.shaded < predicted.shaded * 9 / 10, "{name}");
        // Error that is free and error that is not allowed.
        let (coarse, fine) = (oracle.cheapest(f64::INFINITY).1, oracle.cheapest(0.0).1);
        assert!(coarse.shaded < expected.shaded && expected.shaded < fine.shaded && fine.error == 0.0, "{name}");

        // The device does the same with them, and every covered sample gets a value.
        let mut session = session(&world, &config);
        session.set_levels(&best).unwrap();
        session.frame([0, 0]).unwrap();
        assert!(session.shaded().unwrap().abs_diff(expected.shaded as u32) <= expected.shaded as u32 / 200, "{name}");
        let surface = support::surface(&mut session, &world, &config);
        let pyramid = passband::frequency::reconstruction::Pyramid::new(&surface, &best, 3);
        support::Frame::read(&mut session, &pyramid).checked_values(&surface);
        assert_eq!(session.messages(), [""; 0]);
    }
}

#[test]
fn contrast_of_the_frame_before_steers_luminance() {
    let world = scene("trio");
    let config = config(Rate::Luminance);
    let mut session = session(&world, &config);
    let device = Options { device: Some(DEVICE.into()), validate: true };
    rates::prepare(&mut session, &world, &config, false, &device, 0).unwrap();
    session.frame([0, 0]).unwrap();
    let shaded = levels::shaded(&mut session).unwrap();
    let surface = support::surface(&mut session, &world, &config);
    let covered = surface.samples.iter().flatten().count();
    let of = |level: u32| shaded.iter().filter(|(_, l)| *l == level).count();
    assert!([0, 1, 2].iter().all(|l| of(*l) > 20), "all three levels are used");
    assert_eq!(of(3), 0, "and no other");
    assert!(shaded.len() < covered * 4 / 5, "{} of {covered}", shaded.len());
    // Every covered sample has a value: light comes from everywhere.
    let (bytes, ..) = session.image("resolved").unwrap();
    let image: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    let value = |i: usize| image[i][0] + image[i][1] + image[i][2];
    assert!((0..image.len()).all(|i| surface.samples[i].is_none() || value(i) > 0.0));
    assert_eq!(session.messages(), [""; 0]);
}

/// The levels of a frame follow from what the frame before it resolved to, and those of the first from nothing.
#[test]
fn levels_by_contrast_are_the_twins() {
    for (extent, side) in [([160, 120], 1), ([93, 67], 1), ([61, 35], 2), ([8, 3], 4)] {
        let world = scene("trio");
        let config = Config { extent, samples_per_side: side, directions: 16, ..config(Rate::Luminance) };
        let mut session = session(&world, &config);
        session.frame([0, 0]).unwrap();
        let level = |session: &mut passband::offline::session::Session| -> Vec<u32> {
            bytemuck::pod_collect_to_vec(&session.image("level").unwrap().0)
        };
        assert!(level(&mut session).iter().all(|l| *l == 0), "nothing was there to look at");
        let (mut borders, mut coarse) = (0, 0);
        for frame in 1..4 {
            let previous: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&session.image("resolved").unwrap().0);
            session.frame([0, frame]).unwrap();
            // Sums are in 32 bits: tiles within 1e-4 of a threshold may have either level.
            let [least, most] = [1.0 - 1e-4, 1.0 + 1e-4].map(|f| by_contrast(&previous, extent, side, NOTICEABLE * f));
            for ((got, least), most) in level(&mut session).into_iter().zip(&least).zip(&most) {
                assert!((u32::from(*least)..=u32::from(*most)).contains(&got), "{extent:?} {side}: {least} {got} {most}");
                borders += usize::from(least != most);
                coarse += usize::from(got > 0);
            }
        }
        assert!((coarse > 0 || side == 4) && borders <= 2 * 64 * (side * side) as usize, "{extent:?} {side}: {coarse} {borders}");
        assert_eq!(session.messages(), [""; 0]);
    }
}
