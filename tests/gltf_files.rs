//! glTF and GLB files: what is read, and what is refused without a panic.
#![cfg(feature = "offline")]

use base64::Engine;
use glam::Vec3;
use passband::offline::error::Error;
use passband::offline::gltf::{self, Model};
use passband::offline::mesh::{self, Mesh};
use passband::offline::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;

#[path = "support/damage.rs"]
mod damage;

/// A right triangle in z = 0, facing +Z, `u` along x and glTF's `v` down, with tangents.
const POSITIONS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
const NORMALS: [f32; 9] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
const UVS: [f32; 6] = [0.0, 1.0, 1.0, 1.0, 0.0, 0.0];
const TANGENTS: [f32; 12] = [1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0];
const INDICES: [u16; 3] = [0, 1, 2];

/// The parts above one after the other: 36 + 36 + 24 + 48 + 6 bytes, and 2 to fill up.
fn buffer() -> Vec<u8> {
    let floats = [&POSITIONS[..], &NORMALS, &UVS, &TANGENTS].concat();
    let mut bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    bytes.extend(INDICES.iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([0, 0]);
    bytes
}

/// A whole document over [`buffer`], which is at `uri`, or in the GLB's own chunk.
fn document(uri: Option<&str>) -> Value {
    let mut buffer = json!({ "byteLength": 152 });
    if let Some(uri) = uri {
        buffer["uri"] = uri.into();
    }
    let accessor = |view, count: u32, kind, component| {
        json!({ "bufferView": view, "count": count, "type": kind, "componentType": component,
                "min": [0.0, 0.0, 0.0], "max": [1.0, 1.0, 0.0] })
    };
    let view = |offset, length| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": [0.0, 0.0, 2.0] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TANGENT": 3 }, "indices": 4 }] }],
        "accessors": [accessor(0, 3, "VEC3", 5126), accessor(1, 3, "VEC3", 5126), accessor(2, 3, "VEC2", 5126),
                      accessor(3, 3, "VEC4", 5126), accessor(4, 3, "SCALAR", 5123)],
        "bufferViews": [view(0, 36), view(36, 36), view(72, 24), view(96, 48), view(144, 6)],
        "buffers": [buffer]
    })
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

fn embedded() -> Value {
    document(Some(&data_uri(&buffer())))
}

fn glb(document: &Value, chunk: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + chunk.len() as u32).to_le_bytes());
    for (kind, content) in [(b"JSON", &json[..]), (b"BIN\0", chunk)] {
        bytes.extend((content.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(content);
    }
    bytes
}

fn read(name: &str, bytes: &[u8]) -> Result<Model, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let mesh = gltf::read_mesh(&path);
    let model = gltf::read(&path);
    // The mesh alone never fails where the whole model does not.
    assert!(model.is_err() || mesh.is_ok());
    model
}

fn read_json(document: &Value) -> Result<Model, Error> {
    read("m.gltf", document.to_string().as_bytes())
}

fn refused(document: &Value, words: &[&str]) {
    let e = read_json(document).unwrap_err();
    let message = e.to_string();
    assert!(matches!(e, Error::File { .. }) && !message.contains('\n') && message.len() < 700, "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

/// Winding, normals and tangents agree with positions and coordinates.
fn assert_sound(mesh: &Mesh) {
    assert!(mesh.is_consistent());
    for t in mesh.indices.chunks(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(mesh.positions[t[i] as usize]));
        let face = (b - a).cross(c - a).normalize();
        for i in t.iter().map(|i| *i as usize) {
            assert!(Vec3::from(mesh.normals[i]).dot(face) > 0.99, "{:?} {face}", mesh.normals[i]);
        }
        if mesh.has_uvs && !mesh.tangents.is_empty() {
            let [s, t, u] = [0, 1, 2].map(|i| glam::Vec2::from(mesh.uvs[t[i] as usize]));
            let (e, f) = (t - s, u - s);
            let (along_u, along_v) = ((b - a) * f.y - (c - a) * e.y, (c - a) * e.x - (b - a) * f.x);
            let sign = e.perp_dot(f).signum();
            let tangent = glam::Vec4::from(mesh.tangents[mesh.indices[0] as usize]);
            assert!(tangent.truncate().dot((along_u * sign).normalize()) > 0.99, "{tangent}");
            let bitangent = face.cross(tangent.truncate()) * tangent.w;
            assert!(bitangent.dot((along_v * sign).normalize()) > 0.99, "{tangent} {along_v}");
        }
    }
}

#[test]
fn embedded_external_and_binary_files_agree() {
    let expected = read_json(&embedded()).unwrap();
    let mesh = &expected.primitives[0].mesh;
    assert_eq!(mesh.positions, [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]]);
    assert_eq!((mesh.uvs.as_slice(), mesh.indices.as_slice()), (&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][..], &[0, 1, 2][..]));
    assert_eq!(mesh.tangents, [[1.0, 0.0, 0.0, 1.0]; 3]);
    assert_sound(mesh);
    assert_eq!((expected.materials.len(), expected.primitives[0].material), (1, 0), "the default material");

    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("sub/a b.bin"), buffer()).unwrap();
    std::fs::write(folder.path().join("m.gltf"), document(Some("./sub/a%20b.bin")).to_string()).unwrap();
    std::fs::write(folder.path().join("m.GLB"), glb(&document(None), &buffer())).unwrap();
    std::fs::write(folder.path().join("m.glb.gz"), damage::gzip(&glb(&document(None), &buffer()))).unwrap();
    for name in ["m.gltf", "m.GLB", "m.glb.gz"] {
        let path = folder.path().join(name);
        assert_eq!(gltf::read(&path).unwrap().primitives[0].mesh.positions, mesh.positions, "{name}");
        assert_eq!(mesh::read(&path).unwrap().tangents, mesh.tangents, "{name}");
    }
}

#[test]
fn transforms_are_flattened_and_mirrors_keep_the_outside_out() {
    let mut d = embedded();
    // Turned about X (z becomes -y), mirrored in x and stretched; the camera hangs on the child.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    d["nodes"] = json!([
        { "children": [1], "rotation": [half, 0.0, 0.0, half], "scale": [-2.0, 1.0, 3.0] },
        { "mesh": 0, "camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1] }
    ]);
    d["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    let model = read_json(&d).unwrap();
    let mesh = &model.primitives[0].mesh;
    for (got, want) in mesh.positions.iter().zip([[-10.0, 0.0, 0.0], [-12.0, 0.0, 0.0], [-10.0, 0.0, 1.0]]) {
        assert!(Vec3::from(*got).distance(want.into()) < 1e-5, "{got:?} {want:?}");
    }
    assert_sound(mesh);
    assert!(Vec3::from(mesh.normals[0]).distance(Vec3::NEG_Y) < 1e-6, "{:?}", mesh.normals[0]);
    let camera = model.camera.unwrap();
    assert!((camera.fov_y.to_radians() - 0.5).abs() < 1e-6);
    assert!(camera.position.distance(glam::DVec3::new(-10.0, 0.0, 0.0)) < 1e-6, "{camera:?}");
    assert!((camera.target - camera.position).distance(glam::DVec3::Y) < 1e-6, "{camera:?}");
}

#[test]
fn strips_fans_points_and_missing_attributes() {
    let mut d = embedded();
    d["meshes"][0]["primitives"] = json!([
        { "attributes": { "POSITION": 0 }, "mode": 0 },
        { "attributes": { "POSITION": 0, "_CUSTOM": 0 }, "mode": 5 },
        { "attributes": { "POSITION": 0, "TANGENT": 3 }, "mode": 6, "indices": 4 }
    ]);
    let model = read_json(&d).unwrap();
    assert_eq!(model.primitives.len(), 2, "points are left out");
    for primitive in &model.primitives {
        assert!(!primitive.mesh.has_uvs && primitive.mesh.tangents.is_empty(), "tangents without normals do not count");
        assert_sound(&primitive.mesh);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.gltf");
    std::fs::write(&path, d.to_string()).unwrap();
    let merged = gltf::read_mesh(&path).unwrap();
    assert_eq!((merged.positions.len(), merged.indices.as_slice()), (6, &[0, 1, 2, 3, 4, 5][..]));

    // A sparse accessor moves one corner of zeros; normalized bytes are coordinates.
    let mut d = embedded();
    let mut bytes = buffer();
    bytes[144..150].copy_from_slice(&[0, 0, 255, 0, 0, 255]);
    d["buffers"][0]["uri"] = data_uri(&bytes).into();
    d["accessors"][0] = json!({ "count": 3, "type": "VEC3", "componentType": 5126, "min": [0, 0, 0], "max": [1, 1, 0],
        "sparse": { "count": 2, "indices": { "bufferView": 5, "componentType": 5121 }, "values": { "bufferView": 0, "byteOffset": 12 } } });
    d["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": 0, "byteOffset": 146, "byteLength": 2 }));
    bytes[146..148].copy_from_slice(&[1, 2]);
    d["buffers"][0]["uri"] = data_uri(&bytes).into();
    d["accessors"][2] = json!({ "bufferView": 4, "count": 3, "type": "VEC2", "componentType": 5121, "normalized": true });
    d["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    let mesh = read_json(&d).unwrap().primitives.remove(0).mesh;
    assert_eq!(mesh.positions, [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]]);
    assert_eq!(mesh.uvs[0], [0.0, 1.0]);
    assert!((mesh.uvs[2][1] - 0.0).abs() < 1e-6 && mesh.uvs[1][0] < 0.01, "{:?}", mesh.uvs);
}

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nnot decoded here";

#[test]
fn materials_carry_factors_and_encoded_images() {
    let mut d = embedded();
    d["meshes"][0]["primitives"][0]["material"] = 0.into();
    d["images"] = json!([{ "uri": data_uri(PNG) }, { "uri": data_uri(b"\xff\xd8\xff") }]);
    d["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
    d["materials"] = json!([{
        "name": "brass",
        "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.6, 0.2, 1.0], "metallicFactor": 0.5, "roughnessFactor": 0.5,
                                  "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } },
        "normalTexture": { "index": 0, "scale": 0.7 }
    }]);
    let model = read_json(&d).unwrap();
    let m = &model.materials[0];
    assert_eq!((m.name.as_str(), m.normal_scale, model.materials.len()), ("brass", 0.7, 1));
    assert_eq!(m.base_color_texture.as_deref().map(Vec::as_slice), Some(PNG));
    assert!(std::sync::Arc::ptr_eq(m.base_color_texture.as_ref().unwrap(), m.normal_texture.as_ref().unwrap()));
    assert_eq!(m.metallic_roughness_texture.as_deref().map(Vec::len), Some(3));
    let ggx = m.ggx();
    assert!((ggx.alpha - 0.25).abs() < 1e-9 && ggx.validate().is_ok());
    assert!((ggx.f0 - glam::DVec3::new(0.42, 0.32, 0.12)).length() < 1e-6, "{}", ggx.f0);
    assert!((ggx.albedo - glam::DVec3::new(0.4, 0.3, 0.1)).length() < 1e-6, "{}", ggx.albedo);
    for (pointer, value, word) in [
        ("/materials/0/pbrMetallicRoughness/metallicFactor", json!(1.5), "0 to 1"),
        ("/materials/0/pbrMetallicRoughness/baseColorFactor/0", json!(-0.1), "0 to 1"),
        ("/materials/0/normalTexture/scale", json!(1e39), ""),
        ("/materials/0/normalTexture/index", json!(7), "materials[0]"),
        ("/textures/0/source", json!(9), "textures[0]"),
        ("/images/0/uri", json!("gone.png"), "gone.png"),
        ("/images/0/uri", json!("../x.png"), "same folder"),
        ("/images/0/uri", json!(data_uri(b"GIF89a")), "PNG or JPEG"),
        ("/images/0", json!({}), "images[0]"),
        ("/images/0", json!({ "bufferView": 99 }), ""),
    ] {
        let mut bad = d.clone();
        *bad.pointer_mut(pointer).unwrap() = value;
        refused(&bad, &[word]);
    }
}

#[test]
fn objects_without_a_material_have_the_files_own() {
    let folder = tempfile::tempdir().unwrap();
    let mut d = embedded();
    d["materials"] = json!([{ "name": "red", "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, 1], "metallicFactor": 0 } }]);
    d["nodes"] = json!([{ "mesh": 0, "camera": 0 }]);
    d["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    let primitive = d["meshes"][0]["primitives"][0].clone();
    d["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    d["meshes"][0]["primitives"][1]["material"] = 0.into();
    std::fs::write(folder.path().join("m.gltf"), d.to_string()).unwrap();
    let load = |text: &str| {
        let path = folder.path().join("s.toml");
        std::fs::write(&path, text).unwrap();
        Scene::load(path.to_str().unwrap(), &[]).and_then(|scene| scene.resolve())
    };
    let grey = "[materials.grey]\nreflectance = { ggx = { alpha = 0.5, f0 = 0.04, albedo = 0.2 } }\n";
    let world = load(&format!(
        "[[objects]]\nmesh = 'm.gltf'\ntranslate = [1, 0, 0]\n[[objects]]\nmesh = 'm.gltf'\n\
         [[objects]]\nmesh = 'm.gltf'\nmaterial = 'grey'\n{grey}"
    ))
    .unwrap();
    let names: Vec<_> = world.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["grey", "red", "default"], "the file's once, after the scene's");
    let materials: Vec<_> = world.objects.iter().map(|o| o.material).collect();
    assert_eq!(materials, [2, 1, 2, 1, 0]);
    assert_eq!(world.objects[4].mesh.indices.len(), 6, "merged");
    assert!(std::sync::Arc::ptr_eq(&world.objects[0].mesh, &world.objects[2].mesh));
    assert_eq!(world.camera.position.to_array(), [1.0, 0.0, 0.0], "the first object's camera, placed with it");
    // A scene's own camera stays; without any there is an error; and only glTF does without a material.
    let camera = "[camera]\nposition = [0, 0, 3]\n";
    let world = load(&format!("{camera}[[objects]]\nmesh = 'm.gltf'\n")).unwrap();
    assert_eq!((world.camera.position.z, world.objects.len()), (3.0, 2));
    std::fs::write(folder.path().join("m.gltf"), embedded().to_string()).unwrap();
    for (text, word) in [
        ("[[objects]]\nmesh = 'm.gltf'\n".to_string(), "camera"),
        (format!("{camera}[[objects]]\nbuiltin = 'plane'\n"), "material"),
        (format!("[[objects]]\nbuiltin = 'plane'\nmaterial = 'grey'\n{grey}"), "camera"),
    ] {
        let e = load(&text).unwrap_err();
        assert!(matches!(e, Error::File { .. }) && e.to_string().contains(word), "{e}");
    }
}

#[test]
fn contradictions_are_refused_by_name() {
    let huge = json!(18_000_000_000_000_000_000_u64);
    for (pointer, value, word) in [
        ("/asset/version", json!("9.0"), ""),
        ("/accessors/0/count", json!(4), "accessors[0]"),
        ("/accessors/0/count", huge.clone(), "accessors[0]"),
        ("/accessors/0/byteOffset", huge.clone(), ""),
        ("/accessors/0/type", json!("VEC2"), "accessors[0]"),
        ("/accessors/0/componentType", json!(5123), "accessors[0]"),
        ("/accessors/0/componentType", json!(1), "accessors[0]"),
        ("/accessors/1/count", json!(2), "3 elements"),
        ("/accessors/4/count", json!(2), "multiple of 3"),
        ("/accessors/4/count", json!(0), "triangle"),
        ("/accessors/4/componentType", json!(5126), "accessors[4]"),
        ("/bufferViews/0/byteOffset", json!(140), "bufferViews[0]"),
        ("/bufferViews/0/byteOffset", huge.clone(), "bufferViews[0]"),
        ("/bufferViews/0/byteLength", huge.clone(), "bufferViews[0]"),
        ("/bufferViews/0/buffer", json!(3), "bufferViews[0]"),
        ("/buffers/0/byteLength", json!(153), "buffers[0]"),
        ("/buffers/0/byteLength", huge.clone(), "buffers[0]"),
        ("/buffers/0/uri", Value::Null, "buffers[0]"),
        ("/buffers/0/uri", json!("data:x;base64,%%%"), "base64"),
        ("/buffers/0/uri", json!("data:x,abc"), "base64"),
        ("/buffers/0/uri", json!(""), "same folder"),
        ("/buffers/0/uri", json!("gone.bin"), "gone.bin"),
        ("/buffers/0/uri", json!("../m.gltf"), "same folder"),
        ("/buffers/0/uri", json!("a/../../m.gltf"), "same folder"),
        ("/buffers/0/uri", json!("%2e%2e/m.gltf"), "same folder"),
        ("/buffers/0/uri", json!("..\\m.gltf"), "same folder"),
        ("/buffers/0/uri", json!("/etc/hostname"), "same folder"),
        ("/buffers/0/uri", json!("file:///etc/hostname"), "same folder"),
        ("/buffers/0/uri", json!("https://example.com/a.bin"), "same folder"),
        ("/buffers/0/uri", json!("%ff%fe"), "same folder"),
        ("/buffers/0/uri", json!("a%00b"), "same folder"),
        ("/buffers/0/uri", json!("."), ""),
        ("/nodes/0/mesh", json!(5), "nodes[0]"),
        ("/nodes/0/translation/0", json!(1e300), ""),
        ("/nodes/0/children", json!([0]), "reached twice"),
        ("/nodes/0", json!({ "children": [0] }), "reached twice"),
        ("/nodes/0", json!({ "mesh": 0, "scale": [3e38, 1, 1], "translation": [3e38, 0, 0] }), "finite"),
        ("/scenes/0/nodes/0", json!(7), "scenes[0]"),
        ("/scenes/0/nodes", json!([0, 0]), "reached twice"),
        ("/scenes/0/nodes", json!([]), "triangle"),
        ("/scene", json!(4), "scene"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(77), "POSITION"),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(77), ""),
        ("/meshes/0/primitives/0/attributes", json!({}), "POSITION"),
        ("/meshes/0/primitives/0/indices", json!(77), ""),
        ("/meshes/0/primitives/0/mode", json!(1), "triangle"),
        ("/meshes/0/primitives/0/mode", json!(99), ""),
        ("/meshes/0/primitives", json!([]), "triangle"),
        ("/meshes", json!("x"), "JSON"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "extension"),
    ] {
        let mut d = embedded();
        // Keys that are not there yet are added.
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match d.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            table => table[key] = value,
        }
        refused(&d, &[word]);
    }
    // Zeros without a view that no file could hold, and an index and numbers that lie in the buffer.
    let mut d = embedded();
    d["accessors"][0] = json!({ "count": 1_000_000_000_000_u64, "type": "VEC3", "componentType": 5126, "min": [0, 0, 0], "max": [0, 0, 0],
        "sparse": { "count": 1, "indices": { "bufferView": 4, "componentType": 5123 }, "values": { "bufferView": 0 } } });
    refused(&d, &["without a view"]);
    for (at, bytes, word) in [(144, vec![9_u8, 0], "indices below 3"), (0, f32::NAN.to_le_bytes().to_vec(), "finite")] {
        let mut content = buffer();
        content[at..at + bytes.len()].copy_from_slice(&bytes);
        refused(&document(Some(&data_uri(&content))), &[word]);
    }
    // Instances without end: 24 levels of two children each have one parent only, but many nodes may share a mesh.
    let mut d = embedded();
    d["nodes"] = (0..1_000_000).map(|_| json!({ "mesh": 0 })).collect();
    d["scenes"][0]["nodes"] = (0..1_000_000).collect();
    refused(&d, &["instances"]);
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(folder.path().join("secret.bin"), buffer()).unwrap();
    std::os::unix::fs::symlink("../secret.bin", inner.join("a.bin")).unwrap();
    std::fs::write(inner.join("m.gltf"), document(Some("a.bin")).to_string()).unwrap();
    let e = gltf::read(&inner.join("m.gltf")).unwrap_err();
    assert!(e.to_string().contains("same folder"), "{e}");
}

#[test]
fn damaged_files_never_panic() {
    let whole = glb(&document(None), &buffer());
    for bytes in damage::variants(&whole, 400).into_iter().chain(damage::variants(embedded().to_string().as_bytes(), 400)) {
        match read("m.glb", &bytes) {
            Ok(model) => model.primitives.iter().for_each(|p| assert!(p.mesh.is_consistent() && p.mesh.indices.len() >= 3)),
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
    for length in [0_u32, 1, 11, 12, 20, u32::MAX] {
        let mut bytes = whole.clone();
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        assert!(read("m.glb", &bytes).is_err(), "{length}");
    }
    assert!(gltf::read(Path::new(".")).is_err());
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert!(read("m.gltf", deep.as_bytes()).is_err());
}
