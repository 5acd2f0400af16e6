//! The textures of glTF materials, as they are shaded.
#![cfg(feature = "offline")]

use base64::Engine;
use glam::{DVec2, DVec3, dvec2};
use image::RgbImage;
use passband::offline::error::Error;
use passband::offline::scene::Scene;
use passband::offline::world::World;
use passband::reflectance::{Ggx, Model};
use passband::{Material, Sampling};
use serde_json::json;

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// A PNG of 8-bit texels.
fn png(size: [u32; 2], texels: &[[u8; 3]]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = RgbImage::from_raw(size[0], size[1], texels.concat()).unwrap();
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The materials of a glTF triangle in world space, after its scene has been resolved.
fn gltf(material: serde_json::Value, images: &[Vec<u8>], uvs: bool) -> Result<World, Error> {
    let floats = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0];
    let bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    let attributes = if uvs { json!({ "POSITION": 0, "TEXCOORD_0": 1 }) } else { json!({ "POSITION": 0 }) };
    let document = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "material": 0 }] }],
        "accessors": [
            { "bufferView": 0, "count": 3, "type": "VEC3", "componentType": 5126, "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "count": 3, "type": "VEC2", "componentType": 5126 }
        ],
        "bufferViews": [{ "buffer": 0, "byteOffset": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 24 }],
        "buffers": [{ "byteLength": 60, "uri": data_uri(&bytes) }],
        "images": images.iter().map(|i| json!({ "uri": data_uri(i) })).collect::<Vec<_>>(),
        "textures": (0..images.len()).map(|i| json!({ "source": i })).collect::<Vec<_>>(),
        "materials": [material]
    });
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.gltf"), document.to_string()).unwrap();
    let path = folder.path().join("s.toml");
    std::fs::write(&path, "[camera]\nposition = [0, 0, 3]\n[[objects]]\nmesh = 'm.gltf'\n").unwrap();
    Scene::load(path.to_str().unwrap(), &[])?.resolve()
}

/// What is shaded at a texel's centre.
fn shaded(world: &World, uv: DVec2) -> Ggx {
    let m = &world.materials[0];
    let material = Material::new(m.model.clone(), m.maps.clone());
    material.validate().unwrap();
    let Model::Ggx(ggx) = material.model else { panic!("{:?}", material.model) };
    let point = material.at(uv, [DVec2::ZERO; 2], Sampling::default());
    Ggx { alpha: point.roughness.unwrap_or(ggx.alpha), f0: ggx.f0 * point.specular, albedo: ggx.albedo * point.albedo }
}

#[test]
fn gltf_textures_multiply_their_factors() {
    let base = [[255, 128, 0], [0, 255, 64], [30, 60, 90], [200, 200, 200]];
    let surface = [[0, 255, 0], [9, 128, 255], [9, 64, 128], [9, 0, 51]];
    let normal = [[128, 128, 255], [255, 128, 128], [128, 218, 218], [128, 128, 255]];
    let images = [png([2, 2], &base), png([2, 2], &surface), png([2, 2], &normal)];
    let pbr = |with: serde_json::Value| {
        let mut pbr = json!({ "baseColorFactor": [0.5, 1.0, 0.8, 1.0], "metallicFactor": 0.6, "roughnessFactor": 0.9 });
        pbr.as_object_mut().unwrap().extend(with.as_object().unwrap().clone());
        pbr
    };
    let factor = DVec3::new(0.5, 1.0, 0.8);
    let (with_base, with_surface) = (json!({ "index": 0 }), json!({ "index": 1 }));
    for (base_there, surface_there, metallic_factor) in [
        (true, true, 0.6),
        (true, false, 0.6),
        (false, true, 0.6),
        (true, false, 0.0),
        (true, false, 1.0),
        (true, true, 0.0),
        (false, false, 0.3),
    ] {
        let mut keys = json!({ "metallicFactor": metallic_factor });
        if base_there {
            keys["baseColorTexture"] = with_base.clone();
        }
        if surface_there {
            keys["metallicRoughnessTexture"] = with_surface.clone();
        }
        let world = gltf(json!({ "pbrMetallicRoughness": pbr(keys) }), &images, true).unwrap();
        for i in 0..4 {
            let uv = dvec2(0.25 + 0.5 * (i % 2) as f64, 0.75 - 0.5 * (i / 2) as f64);
            let colour = base[i].map(|c: u8| passband::texture::decode_srgb(f64::from(c) / 255.0));
            let colour = factor * if base_there { DVec3::from(colour) } else { DVec3::ONE };
            let [_, g, b] = if surface_there { surface[i].map(|c: u8| f64::from(c) / 255.0) } else { [1.0; 3] };
            let metallic = metallic_factor * b;
            let got = shaded(&world, uv);
            let want = Ggx {
                alpha: (0.9 * g).powi(2).max(1e-3),
                f0: DVec3::splat(0.04).lerp(colour, metallic),
                albedo: colour * (1.0 - metallic),
            };
            let off = (got.f0 - want.f0).abs().max((got.albedo - want.albedo).abs()).max_element();
            assert!(off < 1e-3 && (got.alpha - want.alpha).abs() < 1e-3, "{base_there} {surface_there} {i}: {got:?} {want:?}");
        }
    }
    let world = gltf(json!({ "normalTexture": { "index": 2, "scale": 0.5 } }), &images, true).unwrap();
    assert!(world.objects[0].mesh.tangents.len() == 3, "computed, as the file has none");
    let map = world.materials[0].maps.normal.clone().unwrap();
    // Green goes up in the picture: the texel at the bottom left.
    let found = map.sample(dvec2(0.25, 0.25), 0.0);
    let want = (DVec3::new(0.5, 0.5, 1.0) * DVec3::new(0.0, 0.71, 0.71)).normalize();
    assert!((found.truncate().truncate() - want.truncate()).length() < 0.01, "{}", found);
}

#[test]
fn gltf_textures_of_two_sizes_meet_at_the_larger() {
    let base = png([1, 2], &[[255; 3], [0; 3]]);
    let surface = png([4, 1], &[[0, 255, 0], [0, 255, 255], [0, 255, 0], [0, 255, 255]]);
    let pbr = json!({ "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } });
    let world = gltf(json!({ "pbrMetallicRoughness": pbr }), &[base, surface], true).unwrap();
    let maps = &world.materials[0].maps;
    assert_eq!([maps.albedo.as_ref().unwrap().size(), maps.roughness.as_ref().unwrap().0.size()], [[4, 2], [4, 1]]);
    let metal = shaded(&world, dvec2(0.375, 0.75));
    assert!((metal.f0 - DVec3::ONE).length() < 1e-3 && metal.albedo.length() < 1e-3, "{metal:?}");
}

#[test]
fn gltf_images_that_are_wrong_are_named() {
    let material = json!({ "name": "brick", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    let damaged = png([2, 2], &[[1; 3]; 4])[..40].to_vec();
    let e = gltf(material.clone(), &[damaged], true).unwrap_err();
    assert!(e.to_string().contains("m.gltf: material `brick`: baseColorTexture") && !e.to_string().contains('\n'), "{e}");
    let e = gltf(material, &[png([2, 2], &[[1; 3]; 4])], false).unwrap_err();
    assert!(e.to_string().contains("objects.0") && e.to_string().contains("`brick`"), "{e}");
}
