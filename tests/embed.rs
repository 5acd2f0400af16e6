//! The example host, as a test: a device, memory and G-buffer encoding of the host's own give the image that the
//! command's own path gives.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::embed_minimal::memory::Buffer;
use common::embed_minimal::raster::{Raster, Targets};
use common::embed_minimal::{Options, replace_modules, run, scene};
use common::rig::Rig;
use common::{DEVICE, assert_clean, headless};
use passband::ash::vk;
use passband::offline::mesh::Mesh;
use passband::offline::session::Session;
use passband::offline::world::{Camera, EnvironmentLight, Material, Object, World};
use passband::{Access, Config, EnvironmentUse, FrameInputs, GBufferInput, GBufferSource, Location, Output, Transfer};
use std::sync::Arc;

const EXTENT: [u32; 2] = [97, 64];
const DIRECTIONS: u32 = 64;

/// The example's scene as the command holds it.
fn world() -> World {
    let objects = scene::objects().into_iter().map(|o| Object {
        transform: o.world_from_object(),
        material: o.material as usize,
        mesh: Arc::new(Mesh {
            uvs: vec![[0.0; 2]; o.positions.len()],
            positions: o.positions,
            normals: o.normals,
            has_uvs: false,
            tangents: Vec::new(),
            indices: o.indices,
        }),
    });
    let material = |(i, m): (usize, passband::Material)| Material { name: format!("{i}"), model: m.model, maps: m.maps };
    World {
        name: "embed_minimal".into(),
        camera: Camera { position: scene::EYE, target: scene::TARGET, up: glam::DVec3::Y, fov_y: scene::FOV_Y },
        size: None,
        environment: Some(EnvironmentLight { map: scene::sky().unwrap(), intensity: 1.0, rotation: 0.0, visible: false }),
        lights: Vec::new(),
        shadows: None,
        objects: objects.collect(),
        materials: scene::materials().into_iter().enumerate().map(material).collect(),
    }
}

/// The same frame by the command's path, exposed and encoded like the example's output but not rounded: 0 to 255.
fn offline() -> Vec<[f64; 4]> {
    let config = Config { directions: DIRECTIONS, ..Config::new(EXTENT) };
    let mut session = Session::new(headless(&config), &world(), &config).unwrap();
    session.frame([0, 0]).unwrap();
    let (bytes, ..) = session.image("resolved").unwrap();
    assert_clean(&session.messages());
    let encode = |c: f64| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    let pixel = |t: [f32; 4]| {
        let [r, g, b, a] = t.map(f64::from);
        [r, g, b].map(|c| 255.0 * encode((0.5 * c).min(1.0))).into_iter().chain([255.0 * a]).collect::<Vec<_>>()
    };
    texels.into_iter().map(|t| pixel(t).try_into().unwrap()).collect()
}

#[test]
fn a_host_with_its_own_gbuffer_gets_the_same_image() {
    let options = Options { device: DEVICE, validate: true, frames: 5, extents: [[64, 48], EXTENT], directions: DIRECTIONS };
    let report = run(&options).unwrap();
    assert!(report.device.contains(DEVICE), "{}", report.device);
    assert_clean(&report.messages);
    assert_eq!(report.live_blocks, 0);

    let expected = offline();
    let got = report.image.as_chunks::<4>().0;
    assert_eq!(got.len(), expected.len());
    let covered = got.iter().filter(|p| p[3] == 255).count();
    assert!(covered * 2 > got.len() && covered < got.len(), "{covered} pixels covered");
    assert!(got.iter().filter(|p| p[3] == 255).all(|p| p[0].max(p[1]).max(p[2]) > 20), "a covered pixel is black");

    assert!(got.iter().zip(&expected).all(|(g, e)| f64::from(g[3]) == e[3]), "coverage differs");
    // Half a step is the output's rounding to 8 bits. The rest is what 16-bit octahedral normals, at most 4e-5 rad off,
    // do to the radiance: 0.0007 of a step measured; normals of 8 bits a coordinate would be some hundred times that.
    let distance = |(g, e): (&[u8; 4], &[f64; 4])| g.iter().zip(e).map(|(g, e)| (f64::from(*g) - e).abs()).fold(0.0, f64::max);
    let worst = got.iter().zip(&expected).map(distance).fold(0.0, f64::max);
    assert!(worst < 0.52, "{worst} steps of 255");
}

/// Another exit than the example's, put to use at once in the same command buffer, where the layer follows layouts and
/// accesses: a wrong layout or a missing wait is a message.
#[test]
fn host_images_are_left_as_their_exit_says() {
    let mut rig = Rig::new();
    let raster = Raster::new(&rig.gpu, &mut rig.memory, &scene::objects()).unwrap();
    let mut targets = Targets::new(&rig.gpu, &mut rig.memory, &raster, EXTENT).unwrap();
    let gbuffer = GBufferSource::Host { layout: raster.set_layout };
    let mut config = Config { directions: 2, curvature: true, gbuffer, ..Config::new(EXTENT) };
    replace_modules(&mut config).unwrap();
    let mut renderer = rig.renderer(&config);
    // SAFETY: the command buffer is recording.
    rig.try_submit(|cmd, _, memory| unsafe { renderer.record_materials(cmd, &scene::materials(), memory) }).unwrap();

    let pixels = (EXTENT[0] * EXTENT[1]) as usize;
    let mut copies = [4, 4, 2, 4].map(|bytes: usize| {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        Buffer::new(&rig.gpu, &mut rig.memory, bytes * pixels, usage, Location::Readback).unwrap()
    });
    rig.submit(|cmd, gpu, _| {
        let view = scene::view(EXTENT);
        let output = targets.output();
        // SAFETY: the command buffer is recording; every submission is waited for.
        unsafe { raster.record(gpu, cmd, &mut targets, &view) };
        let mut images = targets.gbuffer();
        images.iter_mut().for_each(|image| image.exit = Access::TRANSFER_READ);
        let inputs = FrameInputs {
            slot: 0,
            view,
            gbuffer: GBufferInput::Host { set: targets.set, images: &images },
            environment: EnvironmentUse::default(),
            lights: &[],
            shadows: None,
            levels: None,
            shading_rate: None,
            seed: [0, 0],
            output: Some(Output { image: output, transfer: Transfer::Linear }),
        };
        // SAFETY: as above; each buffer holds its whole image.
        unsafe {
            renderer.record(cmd, &inputs).unwrap();
            for (image, copy) in images.iter().chain([&output]).zip(&copies) {
                let image_subresource =
                    vk::ImageSubresourceLayers { aspect_mask: image.aspect, layer_count: 1, ..Default::default() };
                let image_extent = vk::Extent3D { width: EXTENT[0], height: EXTENT[1], depth: 1 };
                let region = [vk::BufferImageCopy { image_subresource, image_extent, ..Default::default() }];
                gpu.device.cmd_copy_image_to_buffer(cmd, image.image, image.exit.layout, copy.buffer, &region);
            }
        }
        ((), passband::Retired::default())
    });
    // The contents survived the transitions: the depth covers what the output covers.
    let depth: Vec<f32> = bytemuck::pod_collect_to_vec(copies[0].bytes());
    let output = copies[3].bytes().as_chunks::<4>().0;
    assert!(depth.iter().zip(output).all(|(depth, texel)| (*depth > 0.0) == (texel[3] == 255)));
    assert!(depth.iter().any(|depth| *depth > 0.0));
    // SAFETY: as above.
    copies.into_iter().for_each(|buffer| unsafe { buffer.free(&rig.gpu, &mut rig.memory) });
    rig.destroy(renderer);
    // SAFETY: as above.
    unsafe {
        targets.free(&rig.gpu, &mut rig.memory);
        raster.free(&rig.gpu, &mut rig.memory);
    }
    assert_clean(&rig.close());
}
