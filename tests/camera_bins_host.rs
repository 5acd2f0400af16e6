//! Cells of directions in camera space as a host has them: room is reserved, draws are held against it, and nothing stays behind.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::assert_clean;
use common::rig::{Rig, Target, grey};
use passband::offline::builtin;
use passband::{Bins, Config, Draw, Error, Filter, Maps, Material, Renderer, Retired, Texture};
use std::sync::Arc;

const EXTENT: [u32; 2] = [48, 40];

fn record_materials(rig: &mut Rig, renderer: &mut Renderer) {
    let normal = |i: i32| glam::Vec3::new(0.3 * (i % 3 - 1) as f32, 0.2 * (i % 5 - 2) as f32, 1.0).normalize().to_array();
    let normals = Texture::normals([64, 48], &(0..64 * 48).map(normal).collect::<Vec<_>>()).unwrap();
    let bumps = Material::new(grey(), Maps { normal: Some(Arc::new(normals)), ..Maps::default() });
    rig.submit(|cmd, _, memory| {
        // SAFETY: the command buffer is recording.
        ((), unsafe { renderer.record_materials(cmd, &[bumps, grey().into()], memory) }.unwrap())
    });
}

fn refused(rig: &mut Rig, renderer: &mut Renderer, draws: &[Draw]) -> Error {
    let target = Target::new(rig, EXTENT);
    // SAFETY: the command buffer is recording; every submission is waited for.
    let result =
        rig.try_submit(|cmd, _, _| unsafe { renderer.record(cmd, &target.inputs(0, draws)) }.map(|()| Retired::default()));
    target.free(rig);
    result.unwrap_err()
}

/// Whether it brought anything to free.
fn reserve(rig: &mut Rig, renderer: &mut Renderer, draws: &[Draw]) -> Result<bool, Error> {
    let bag = renderer.reserve_cells(draws, &mut rig.memory)?;
    let some = !bag.is_empty();
    // SAFETY: every submission is waited for.
    unsafe { bag.free(&rig.gpu.device, &mut rig.memory) };
    Ok(some)
}

#[test]
fn draws_are_held_against_the_room_that_was_reserved() {
    let config = Config { filter: Filter::Vmf8, bins: Bins::Camera, directions: 16, ..Config::new(EXTENT) };
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config);
    record_materials(&mut rig, &mut renderer);
    assert_eq!((renderer.cell_map(0), renderer.cell_map(1), renderer.cell_map(2)), (Some([64, 48]), None, None));
    let sphere = builtin::mesh("sphere", 32).unwrap();
    let [first, second, plain] = [0, 40, 0].map(|object| rig.draw(&sphere, object));
    let second = Draw { world_from_object: glam::Mat4::from_translation(glam::Vec3::X).to_cols_array(), ..second };
    let plain = Draw { material: 1, ..plain };

    let e = refused(&mut rig, &mut renderer, &[first]);
    assert!(matches!(e, Error::CallOrder { called: "record", before: "reserve_cells" }), "{e}");
    let e = reserve(&mut rig, &mut renderer, &[second, first, first]).unwrap_err().to_string();
    assert!(e.starts_with("draws[2].object: expected a number that no other draw has") && e.ends_with("got 0"), "{e}");
    let e = reserve(&mut rig, &mut renderer, &[Draw { material: 2, ..first }]).unwrap_err().to_string();
    assert!(e.starts_with("draws[0].material"), "{e}");
    // Whichever block is refused, nothing stays.
    let live = rig.memory.live.len();
    for request in 0..3 {
        rig.memory.fail_at = Some(rig.memory.requests + request);
        let e = reserve(&mut rig, &mut renderer, &[first]).unwrap_err();
        assert!(matches!(&e, Error::Allocation { .. }) && rig.memory.live.len() == live, "{e}");
    }
    rig.memory.fail_at = None;

    // An object without cells may share a number.
    assert!(!reserve(&mut rig, &mut renderer, &[first, plain]).unwrap(), "there was none before");
    assert_eq!(rig.memory.live.len(), live + 3);
    let alone = rig.frame(&mut renderer, &[first]);
    assert!(alone.iter().any(|texel| texel[0] > 0.1), "it is lit");
    let e = refused(&mut rig, &mut renderer, &[first, second]).to_string();
    assert!(e.starts_with("draws[1].object: expected an object that reserve_cells was given with material 0, got 40"), "{e}");
    let e = refused(&mut rig, &mut renderer, &[first, first]).to_string();
    assert!(e.starts_with("draws[1].object: expected a number that no other draw has"), "{e}");

    assert!(!reserve(&mut rig, &mut renderer, &[plain, first]).unwrap(), "there is just that room");
    assert!(reserve(&mut rig, &mut renderer, &[second, first]).unwrap());
    assert!(rig.frame(&mut renderer, &[first]) == alone, "where its cells are does not matter");
    assert!(rig.frame(&mut renderer, &[first, second]) != alone);
    assert!(rig.frame(&mut renderer, &[first]) == alone);

    // They were made of the former materials' lobes.
    record_materials(&mut rig, &mut renderer);
    let e = refused(&mut rig, &mut renderer, &[first]);
    assert!(matches!(e, Error::CallOrder { before: "reserve_cells", .. }), "{e}");
    reserve(&mut rig, &mut renderer, &[first]).unwrap();
    assert!(rig.frame(&mut renderer, &[first]) == alone);
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

#[test]
fn in_the_tangent_frame_there_is_nothing_to_reserve() {
    let config = Config { filter: Filter::Vmf8, directions: 16, ..Config::new(EXTENT) };
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config);
    record_materials(&mut rig, &mut renderer);
    let draw = rig.draw(&builtin::mesh("sphere", 32).unwrap(), 7);
    let live = rig.memory.live.len();
    assert!(!reserve(&mut rig, &mut renderer, &[draw, draw]).unwrap() && rig.memory.live.len() == live);
    assert_eq!(renderer.cell_map(0), None);
    rig.frame(&mut renderer, &[draw]);
    rig.destroy(renderer);
    assert_clean(&rig.close());
}
