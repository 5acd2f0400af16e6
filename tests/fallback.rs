//! Where most samples would be shaded anyway, the prediction from one block in sixteen turns the rest of it off.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;
#[path = "support/levels.rs"]
mod support;

use common::assert_clean;
use common::rig::Rig;
use passband::offline::builtin;

use passband::offline::levels;
use passband::offline::session::Session;
use passband::{Config, Rate};
use support::{scene, session};

fn config(rate: Rate, samples_per_cycle: Option<f32>) -> Config {
    Config { frames_in_flight: 1, rate, samples_per_cycle, directions: 16, ..Config::new([203, 117]) }
}

fn frame(session: &mut Session) -> Vec<u8> {
    session.frame([0, 0]).unwrap();
    assert_eq!(session.messages(), [""; 0]);
    session.image("resolved").unwrap().0
}

fn mean(bytes: &[u8]) -> f64 {
    let texels: Vec<f32> = bytemuck::pod_collect_to_vec(bytes);
    texels.iter().map(|v| f64::from(*v)).sum::<f64>() / texels.len() as f64
}

#[test]
fn frames_that_fall_back_are_those_of_the_full_rate() {
    let world = scene("trio");
    let full = frame(&mut session(&world, &config(Rate::Full, None)));
    for side in [1, 2] {
        let config = |rate, spc| Config { samples_per_side: side, ..config(rate, spc) };
        let full = if side == 1 { full.clone() } else { frame(&mut session(&world, &config(Rate::Full, None))) };
        let mut session = session(&world, &config(Rate::Bandwidth, Some(1000.0)));
        // The second of them follows the first in the same buffers.
        for _ in 0..2 {
            let found = frame(&mut session);
            // The samples of a pixel share directions that are others at the full rate.
            let means = [&found, &full].map(|bytes| mean(bytes));
            assert!(if side == 1 { found == full } else { (means[0] / means[1] - 1.0).abs() < 5e-3 }, "{side}: {means:?}");
            let shaded = levels::shaded(&mut session).unwrap();
            let (ids, ..) = session.image("ids").unwrap();
            assert_eq!(shaded.len(), ids.chunks_exact(4).filter(|id| **id != [0; 4]).count());
            assert!(shaded.iter().all(|(_, level)| *level == 0));
            assert!(levels::coarsest(&mut session).unwrap().iter().all(|level| *level == 0));
            assert!(levels::weights(&mut session).unwrap().iter().all(|weight| *weight == 0.0));
            for image in ["level", "prediction"] {
                assert!(session.image(image).unwrap().0.iter().all(|byte| *byte == 0), "{image}");
            }
        }
    }
}

#[test]
fn the_forecast_is_close_to_the_prediction() {
    let world = scene("trio");
    let mut kinds = [0; 2];
    for rate in [0.5, 1.0, 2.0, 4.0, 8.0, 64.0, 512.0] {
        let mut session = session(&world, &config(Rate::Bandwidth, Some(rate)));
        frame(&mut session);
        let forecast = session.words("forecast").unwrap();
        let share = f64::from(forecast[3]) / 64.0 / f64::from(forecast[7]);
        let falls_back = share > 0.85;
        kinds[usize::from(falls_back)] += 1;
        let runs = [0, 4, 8].map(|first| forecast[first] > 0);
        assert_eq!(runs, [!falls_back, !falls_back, falls_back], "{rate}: {forecast:?}");
        if falls_back {
            continue;
        }
        let (levels, ..) = session.image("level").unwrap();
        let (ids, ..) = session.image("ids").unwrap();
        let covered = ids.chunks_exact(4).map(|id| id != [0; 4]);
        let levels: Vec<u32> = bytemuck::pod_collect_to_vec(&levels);
        let of: Vec<_> = levels.iter().zip(covered).filter(|(_, c)| *c).map(|(l, _)| 0.25f64.powi(*l as i32)).collect();
        let mean = of.iter().sum::<f64>() / of.len() as f64;
        assert!((share - mean).abs() < 0.06, "{rate}: {share} of {mean}");
    }
    assert!(kinds[0] > 1 && kinds[1] > 1, "{kinds:?}");
}

#[test]
fn a_resized_renderer_falls_back_over_its_new_extent() {
    let mut rig = Rig::new();
    let draws = [rig.draw(&builtin::mesh("sphere", 32).unwrap(), 0)];
    let images = [config(Rate::Full, None), config(Rate::Bandwidth, Some(1000.0))].map(|config| {
        let mut renderer = rig.renderer(&Config { extent: [24, 16], ..config });
        rig.frame(&mut renderer, &draws);
        let bag = renderer.resize([203, 117], &mut rig.memory).unwrap();
        // SAFETY: every submission is waited for.
        unsafe { bag.free(&rig.gpu.device, &mut rig.memory) };
        let image = rig.frame(&mut renderer, &draws);
        rig.destroy(renderer);
        image
    });
    assert!(images[0].iter().any(|texel| texel[0] > 0.0) && images[0] == images[1]);
    assert_clean(&rig.close());
}
