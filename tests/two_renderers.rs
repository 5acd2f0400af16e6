//! Renderers do not know of each other, and a resized one is as good as new.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::assert_clean;
use common::rig::{Rig, Target};
use passband::offline::builtin;
use passband::{Config, Renderer, Retired};

fn assert_send<T: Send>() {}

#[test]
fn renderers_and_bags_may_move_between_threads() {
    assert_send::<Renderer>();
    assert_send::<Retired>();
}

#[test]
fn interleaved_frames_equal_each_alone() {
    let configs = [
        Config { directions: 8, curvature: true, ..Config::new([64, 48]) },
        Config { directions: 16, samples_per_side: 2, ..Config::new([33, 21]) },
    ];
    let mut rig = Rig::new();
    let draws = [[rig.draw(&builtin::mesh("sphere", 32).unwrap(), 0)], [rig.draw(&builtin::mesh("torus-knot", 32).unwrap(), 1)]];
    let alone: Vec<_> = (0..2)
        .map(|i| {
            let mut renderer = rig.renderer(&configs[i]);
            let image = rig.frame(&mut renderer, &draws[i]);
            rig.destroy(renderer);
            image
        })
        .collect();
    assert_ne!(alone[0].len(), alone[1].len());

    let mut renderers = [0, 1].map(|i: usize| rig.renderer(&configs[i]));
    for round in 0..3 {
        // Both in one command buffer, a b and b a in turn.
        let targets = [0, 1].map(|i: usize| Target::new(&mut rig, configs[i].extent));
        rig.submit(|cmd, _, _| {
            for i in if round % 2 == 0 { [0, 1] } else { [1, 0] } {
                // SAFETY: the command buffer is recording; every submission is waited for.
                unsafe { renderers[i].record(cmd, &targets[i].inputs(round % 2, &draws[i])) }.unwrap();
            }
            ((), Retired::default())
        });
        for (i, target) in targets.into_iter().enumerate() {
            assert!(target.read(&mut rig) == alone[i], "round {round}: renderer {i} differs from itself alone");
        }
    }
    // One goes, the other stays; and it records from another thread.
    let [first, mut second] = renderers;
    rig.destroy(first);
    let image = std::thread::scope(|s| s.spawn(|| rig.frame(&mut second, &draws[1])).join().unwrap());
    assert!(image == alone[1]);
    rig.destroy(second);
    assert_clean(&rig.close());
}

#[test]
fn a_resized_renderer_equals_a_fresh_one() {
    let mut rig = Rig::new();
    let config = |extent| Config { directions: 4, curvature: true, ..Config::new(extent) };
    let mut renderer = rig.renderer(&config([64, 64]));
    let draws = [rig.draw(&builtin::mesh("sphere", 64).unwrap(), 0)];
    for extent in [[1, 1], [3, 1], [500, 333], [64, 64], [1, 7], [65, 63], [64, 64], [64, 64]] {
        let bag = renderer.resize(extent, &mut rig.memory).unwrap();
        // SAFETY: every submission is waited for.
        unsafe { bag.free(&rig.gpu.device, &mut rig.memory) };
        let resized = rig.frame(&mut renderer, &draws);
        let mut fresh = rig.renderer(&config(extent));
        assert!(resized == rig.frame(&mut fresh, &draws), "{extent:?}");
        assert!(resized.iter().any(|p| p[3] == 1.0 && p[0] > 0.0), "{extent:?}: nothing to see");
        rig.destroy(fresh);
    }
    // Several resizes with no frame between, their bags kept and freed together.
    let mut bags = Retired::default();
    for extent in [[2, 2], [100, 3], [64, 64]] {
        bags.append(renderer.resize(extent, &mut rig.memory).unwrap());
    }
    rig.frame(&mut renderer, &draws);
    // SAFETY: every submission is waited for.
    unsafe { bags.free(&rig.gpu.device, &mut rig.memory) };
    rig.destroy(renderer);
    assert_clean(&rig.close());
}
