//! Memory that cannot be had: whichever request fails, everything made so far is given back, the error names the
//! resource, and what there was before still works. The validation layer reports objects that outlive the device.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::assert_clean;
use common::rig::{Rig, grey, sky};
use passband::offline::builtin;
use passband::reflectance::Model;
use passband::reflectance::stand_in;
use passband::{Config, Error, Filter, Maps, Material, Rate, Renderer, Texture, memory_footprint};
use std::sync::Arc;

fn config() -> Config {
    Config { curvature: true, rate: Rate::Uniform(2), directions: 4, filter: Filter::Vmf1, ..Config::new([24, 16]) }
}

/// With a map that the filter makes moments of.
fn bumpy() -> Material {
    let normals = Texture::normals([2, 1], &[[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]]).unwrap();
    Material::new(grey(), Maps { normal: Some(Arc::new(normals)), ..Maps::default() })
}

/// Runs `call` with request 0, 1, … failing until it succeeds; the number of requests that it makes.
fn until_it_succeeds<T>(rig: &mut Rig, mut call: impl FnMut(&mut Rig) -> Result<T, Error>) -> (T, usize) {
    for k in 0..1000 {
        let before = rig.memory.live.len();
        rig.memory.fail_at = Some(rig.memory.requests + k);
        let result = call(rig);
        rig.memory.fail_at = None;
        match result {
            Ok(value) => return (value, k),
            Err(Error::Allocation { resource, bytes, reason }) => {
                assert_eq!(Some(&resource), rig.memory.refused.as_ref());
                assert!(bytes > 0 && reason.contains("refused by the test"), "{resource}: {bytes} {reason}");
                assert_eq!(rig.memory.live.len(), before, "{resource}: blocks were kept");
            }
            Err(other) => panic!("{other}"),
        }
    }
    panic!("no success after 1000 requests");
}

#[test]
fn whichever_request_fails_nothing_is_kept() {
    let mut rig = Rig::new();
    let config = config();
    let (mut renderer, requests) = until_it_succeeds(&mut rig, |rig| {
        // SAFETY: the device outlives the renderer.
        unsafe { Renderer::new(&rig.gpu.host(), &config, &mut rig.memory) }
    });
    // One block a row of the footprint, and one buffer a slot where the footprint sums them: frame and lights.
    assert_eq!(requests, memory_footprint(&config).rows.len() + 2 * (config.frames_in_flight - 1));

    let table = Model::Table(Arc::new(stand_in::table("metallic-paint").unwrap()));
    let ((), requests) = until_it_succeeds(&mut rig, |rig| {
        // SAFETY: the command buffer is recording.
        rig.try_submit(|cmd, _, memory| unsafe { renderer.record_environment(cmd, &sky(), memory) })
    });
    assert_eq!(requests, 4, "two images, two staging buffers");
    let models = [bumpy(), table.into()];
    let ((), requests) = until_it_succeeds(&mut rig, |rig| {
        // SAFETY: the command buffer is recording.
        rig.try_submit(|cmd, _, memory| unsafe { renderer.record_materials(cmd, &models, memory) })
    });
    assert_eq!(requests, 16, "four images and three buffers, each with staging, the moments, and the table of their lengths");

    let draws = [rig.draw(&builtin::mesh("sphere", 16).unwrap(), 0)];
    let image = rig.frame(&mut renderer, &draws);
    let (bag, requests) = until_it_succeeds(&mut rig, |rig| {
        let result = renderer.resize([30, 20], &mut rig.memory);
        if result.is_err() {
            assert_eq!(renderer.config().extent, config.extent);
        }
        result
    });
    assert_eq!(requests, memory_footprint(&config).rows.len() - 3, "all but the frame, the lights and the stand-in for tangents");
    // SAFETY: every submission is waited for.
    unsafe { bag.free(&rig.gpu.device, &mut rig.memory) };

    // After all that: back to the first extent, and the same image.
    let bag = renderer.resize(config.extent, &mut rig.memory).unwrap();
    // SAFETY: as above.
    unsafe { bag.free(&rig.gpu.device, &mut rig.memory) };
    assert_eq!(rig.frame(&mut renderer, &draws), image);
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

/// A failed replacement leaves the former environment, materials and extent in place.
#[test]
fn a_failed_replacement_changes_nothing() {
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config());
    let draws = [rig.draw(&builtin::mesh("sphere", 16).unwrap(), 0)];
    let image = rig.frame(&mut renderer, &draws);
    let white = passband::sampling::LatLong::new(1, 1, vec![[1.0; 3]]).unwrap();
    for k in 0..2 {
        rig.memory.fail_at = Some(rig.memory.requests + k);
        // SAFETY: the command buffer is recording.
        let result = rig.try_submit(|cmd, _, memory| unsafe { renderer.record_environment(cmd, &white, memory) });
        assert!(matches!(result, Err(Error::Allocation { .. })), "{result:?}");
        rig.memory.fail_at = Some(rig.memory.requests + k);
        // SAFETY: as above.
        let result =
            rig.try_submit(|cmd, _, memory| unsafe { renderer.record_materials(cmd, &[grey().into(), grey().into()], memory) });
        assert!(matches!(result, Err(Error::Allocation { .. })), "{result:?}");
        rig.memory.fail_at = Some(rig.memory.requests + k);
        assert!(renderer.resize([5, 5], &mut rig.memory).is_err());
        rig.memory.fail_at = None;
    }
    assert_eq!(rig.frame(&mut renderer, &draws), image);
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

/// Environments and materials are replaced while frames go on; at the end no block is out (`close` asserts it).
#[test]
fn a_whole_life_gives_everything_back() {
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config());
    let draws = [rig.draw(&builtin::mesh("torus-knot", 16).unwrap(), 3)];
    for side in [24, 9, 24] {
        rig.frame(&mut renderer, &draws);
        rig.submit(|cmd, _, memory| {
            // SAFETY: the command buffer is recording.
            let mut bag = unsafe { renderer.record_environment(cmd, &sky(), memory) }.unwrap();
            // SAFETY: as above.
            bag.append(unsafe { renderer.record_materials(cmd, &[grey().into(), bumpy()], memory) }.unwrap());
            ((), bag)
        });
        rig.frame(&mut renderer, &draws);
        let bag = renderer.resize([side, side], &mut rig.memory).unwrap();
        // SAFETY: every submission is waited for.
        unsafe { bag.free(&rig.gpu.device, &mut rig.memory) };
    }
    rig.destroy(renderer);
    assert_clean(&rig.close());
}
