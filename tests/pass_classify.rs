//! `classify` lists every covered sample once, whatever the size, and nothing depends on the list's order.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::assert_clean;
use common::rig::{Rig, Target};
use passband::offline::builtin;
use passband::{Config, Draw, Renderer, Retired};
use std::collections::BTreeSet;

/// What the last frame listed, and the indirect arguments: groups in x, y, z and the count.
fn list(rig: &Rig, renderer: &Renderer) -> (Vec<[u32; 2]>, [u32; 4]) {
    let arguments: [u32; 4] = rig.memory.words("arguments", 4).try_into().unwrap();
    let config = renderer.config();
    let capacity: u32 = config.extent.iter().map(|e| e * config.samples_per_side).product();
    assert!(arguments[3] <= capacity, "{arguments:?}");
    let words = rig.memory.words("list", arguments[3] as usize);
    (words.into_iter().map(|w| [w & 0xffff, w >> 16]).collect(), arguments)
}

#[test]
fn every_covered_sample_is_listed_once() {
    let mut rig = Rig::new();
    let draws = [rig.draw(&builtin::mesh("torus-knot", 64).unwrap(), 0), rig.draw(&builtin::mesh("plane", 64).unwrap(), 1)];
    let ball = [rig.draw(&builtin::mesh("sphere", 64).unwrap(), 2)];
    for (extent, draws) in [([500, 333], &draws[..]), ([1, 1], &ball), ([7, 3], &ball), ([1, 64], &ball), ([8, 8], &draws)] {
        let mut renderer = rig.renderer(&Config { directions: 2, ..Config::new(extent) });
        let image = rig.frame(&mut renderer, draws);
        let (listed, arguments) = list(&rig, &renderer);
        let covered: BTreeSet<[u32; 2]> = (0u32..)
            .zip(&image)
            .filter(|(_, texel)| texel[3] > 0.0)
            .map(|(i, _)| [i / extent[0], i % extent[0]])
            .map(|[y, x]| [x, y])
            .collect();
        assert!(!covered.is_empty(), "{extent:?}");
        assert_eq!(listed.len(), covered.len(), "{extent:?}: as many as are covered");
        assert_eq!(BTreeSet::from_iter(listed), covered, "{extent:?}: the same, none twice");
        assert_eq!(arguments, [(covered.len() as u32).div_ceil(64), 1, 1, covered.len() as u32], "{extent:?}");
        rig.destroy(renderer);
    }
    assert_clean(&rig.close());
}

/// With several samples a pixel, coverage is the share of listed samples.
#[test]
fn coverage_is_the_share_of_listed_samples() {
    let mut rig = Rig::new();
    let draws = [rig.draw(&builtin::mesh("torus-knot", 64).unwrap(), 0)];
    let mut renderer = rig.renderer(&Config { directions: 2, samples_per_side: 4, ..Config::new([37, 23]) });
    let image = rig.frame(&mut renderer, &draws);
    let mut share = vec![0; image.len()];
    for [x, y] in list(&rig, &renderer).0 {
        share[(y / 4 * 37 + x / 4) as usize] += 1;
    }
    assert!(share.iter().any(|n| (1..16).contains(n)), "no pixel is partly covered");
    assert!(image.iter().zip(&share).all(|(texel, n)| texel[3] == *n as f32 / 16.0));
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

#[test]
fn runs_are_bit_identical() {
    let mut images = Vec::new();
    for _ in 0..2 {
        let mut rig = Rig::new();
        let draws = [rig.draw(&builtin::mesh("bumpy-sphere", 64).unwrap(), 0)];
        let mut renderer = rig.renderer(&Config { directions: 8, ..Config::new([123, 77]) });
        for _ in 0..3 {
            images.push(rig.frame(&mut renderer, &draws));
        }
        // Another seed is another image: equality above means something.
        let target = Target::new(&mut rig, [123, 77]);
        rig.submit(|cmd, _, _| {
            let inputs = passband::FrameInputs { seed: [8, 0], ..target.inputs(1, &draws) };
            // SAFETY: the command buffer is recording; every submission is waited for.
            unsafe { renderer.record(cmd, &inputs) }.unwrap();
            ((), Retired::default())
        });
        assert!(target.read(&mut rig) != images[0]);
        rig.destroy(renderer);
        assert_clean(&rig.close());
    }
    assert!(images.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn an_empty_view_is_black() {
    let mut rig = Rig::new();
    let ball = [rig.draw(&builtin::mesh("sphere", 32).unwrap(), 0)];
    let mut renderer = rig.renderer(&Config { directions: 2, curvature: true, ..Config::new([31, 17]) });
    let empty: &[Draw] = &[];
    // Fresh, and after a frame whose list and radiance must not shine through.
    for _ in 0..2 {
        let image = rig.frame(&mut renderer, empty);
        assert!(image.iter().all(|texel| *texel == [0.0; 4]));
        assert_eq!(list(&rig, &renderer).1, [0, 1, 1, 0]);
        assert!(rig.frame(&mut renderer, &ball).iter().any(|texel| texel[3] == 1.0));
    }
    rig.destroy(renderer);
    assert_clean(&rig.close());
}
