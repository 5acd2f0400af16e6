//! The example host, as a test: a device, memory and G-buffer encoding of the host's own give the image that the
//! command's own path gives.

mod common;

use common::embed_minimal::{Options, run, scene};
use common::{DEVICE, assert_clean, headless};
use passband::Config;
use passband::offline::mesh::Mesh;
use passband::offline::session::Session;
use passband::offline::world::{Camera, EnvironmentLight, Material, Object, World};
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
            indices: o.indices,
        }),
    });
    let material = |(i, model)| Material { name: format!("{i}"), model };
    World {
        name: "embed_minimal".into(),
        camera: Camera { position: scene::EYE, target: scene::TARGET, up: glam::DVec3::Y, fov_y: scene::FOV_Y },
        size: None,
        environment: Some(EnvironmentLight { map: scene::sky().unwrap(), intensity: 1.0, rotation: 0.0, visible: false }),
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
