//! A glTF model by formula, with its textures inside: a vase of glazed porcelain with gilded bands. `scenes/vase.gltf` is what
//! this writes: `cargo run --example vase -- scenes/vase.gltf`.

use base64::Engine;
use glam::{Vec2, Vec3, vec2, vec3};
use image::{ExtendedColorType, ImageEncoder, codecs::png};
use serde_json::json;
use std::f32::consts::TAU;

/// Texels a side of all textures.
const TEXELS: u32 = 256;
/// Quads around and along the profile.
const QUADS: [u32; 2] = [72, 48];

/// Radius and height of the outline from the foot to the lip, at `v` from 0 to 1.
fn outline(v: f32) -> Vec2 {
    // Bezier segments of degree 3 that share their end points.
    const POINTS: [[f32; 2]; 10] = [
        [0.30, -1.00],
        [0.36, -0.96],
        [0.24, -0.90],
        [0.34, -0.80],
        [0.62, -0.55],
        [0.86, 0.25],
        [0.40, 0.52],
        [0.20, 0.64],
        [0.16, 0.84],
        [0.36, 1.00],
    ];
    let at = (v * 3.0).min(2.999_99);
    let (segment, t) = (at as usize, at.fract() + if v >= 1.0 { 1e-5 } else { 0.0 });
    let p: Vec<Vec2> = POINTS[3 * segment..3 * segment + 4].iter().map(|p| Vec2::from(*p)).collect();
    let s = 1.0 - t;
    p[0] * (s * s * s) + p[1] * (3.0 * s * s * t) + p[2] * (3.0 * s * t * t) + p[3] * (t * t * t)
}

fn step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// How gilded the surface is.
fn gold(v: f32) -> f32 {
    [0.03_f32, 0.245, 0.62, 0.975]
        .iter()
        .zip([0.03, 0.012, 0.014, 0.025])
        .fold(0.0, |sum: f32, (at, width)| sum.max(1.0 - step(width, width + 0.008, (v - at).abs())))
}

/// How blue the glaze is: rosettes between the bands, leaves around the neck.
fn cobalt(uv: Vec2) -> f32 {
    let cell = vec2((uv.x * 7.0).fract() - 0.5, (uv.y - 0.45) * 5.2);
    let (radius, angle) = (cell.length(), cell.y.atan2(cell.x));
    let petals = 0.33 + 0.11 * (6.0 * angle).cos();
    let rosette = step(0.03, 0.0, (radius - petals).abs() - 0.018).max(step(0.02, 0.0, radius - 0.09));
    let inner = step(0.03, 0.0, (radius - 0.6 * petals).abs() - 0.008) * 0.7;
    let wave = 0.70 + 0.035 * (uv.x * 12.0 * TAU).cos();
    let leaves = step(0.012, 0.0, (uv.y - wave).abs() - 0.006).max(step(0.012, 0.0, (uv.y - 0.86 + wave - 0.70).abs() - 0.004));
    let rings = step(0.006, 0.0, (uv.y - 0.285).abs() - 0.004).max(step(0.006, 0.0, (uv.y - 0.585).abs() - 0.004));
    rosette.max(inner).max(leaves).max(rings)
}

/// Relief: flutes below the belly's band, rims of the bands, the slightest of throwing marks.
fn height(uv: Vec2) -> f32 {
    let flutes = (uv.x * 24.0 * TAU).cos().abs().sqrt() * step(0.07, 0.10, uv.y) * step(0.23, 0.20, uv.y);
    0.006 * flutes + 0.004 * gold(uv.y) + 0.0006 * (uv.y * 40.0 * TAU).sin()
}

/// A PNG of 8-bit texels, whose row 0 is at v = 0.
fn image(texel: impl Fn(Vec2) -> Vec3) -> Result<String, image::ImageError> {
    let centre = |i: u32| (i as f32 + 0.5) / TEXELS as f32;
    let places = (0..TEXELS * TEXELS).map(|i| vec2(centre(i % TEXELS), centre(i / TEXELS)));
    let bytes: Vec<u8> = places.flat_map(|uv| (texel(uv) * 255.0 + 0.5).to_array().map(|c| c.clamp(0.0, 255.0) as u8)).collect();
    let mut file = Vec::new();
    let encoder = png::PngEncoder::new_with_quality(&mut file, png::CompressionType::Best, png::FilterType::Adaptive);
    encoder.write_image(&bytes, TEXELS, TEXELS, ExtendedColorType::Rgb8)?;
    Ok(format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(file)))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: vase FILE.gltf")?;
    let [around, along] = QUADS;
    let grid = || (0..=along).flat_map(|j| (0..=around).map(move |i| vec2(i as f32 / around as f32, j as f32 / along as f32)));
    let position = |uv: Vec2| {
        let p = outline(uv.y);
        let (sine, cosine) = (uv.x * TAU).sin_cos();
        vec3(p.x * sine, p.y, p.x * cosine)
    };
    let normal = |uv: Vec2| {
        let slope = outline((uv.y + 1e-3).min(1.0)) - outline((uv.y - 1e-3).max(0.0));
        let (sine, cosine) = (uv.x * TAU).sin_cos();
        vec3(slope.y * sine, -slope.x, slope.y * cosine).normalize()
    };
    let mut buffer: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut view = |bytes: Vec<u8>| {
        views.push(json!({ "buffer": 0, "byteOffset": buffer.len(), "byteLength": bytes.len() }));
        buffer.extend(bytes);
    };
    let floats = |values: Vec<f32>| values.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<_>>();
    view(floats(grid().flat_map(|uv| position(uv).to_array()).collect()));
    view(floats(grid().flat_map(|uv| normal(uv).to_array()).collect()));
    view(floats(grid().flat_map(|uv| uv.to_array()).collect()));
    let corner = |i, j| (j * (around + 1) + i) as u16;
    let quads = (0..along).flat_map(|j| (0..around).map(move |i| (i, j)));
    let indices: Vec<u16> = quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [a, b, c, a, c, d]
        })
        .collect();
    view(indices.iter().flat_map(|i| i.to_le_bytes()).collect());

    let encoded = |linear: Vec3| Vec3::from(linear.to_array().map(|c| c.powf(1.0 / 2.2)));
    let colour = image(|uv| {
        let glaze = vec3(0.78, 0.80, 0.76).lerp(vec3(0.01, 0.035, 0.28), cobalt(uv));
        encoded(glaze.lerp(vec3(1.0, 0.72, 0.30), gold(uv.y)))
    })?;
    let surface = image(|uv| {
        let g = gold(uv.y);
        let brushed = 0.03 * (uv.y * 900.0).sin();
        vec3(0.0, (0.20 + 0.06 * cobalt(uv)) * (1.0 - g) + (0.42 + brushed) * g, g)
    })?;
    let normals = image(|uv| {
        let d = 1.0 / TEXELS as f32;
        // Heights are in widths of the texture; green is towards v = 0, the image's top.
        let slope = |step: Vec2| (height(uv + step) - height(uv - step)) / (2.0 * d);
        let n = vec3(-slope(vec2(d, 0.0)), slope(vec2(0.0, d)), 1.0).normalize();
        n * 0.5 + 0.5
    })?;
    let accessor =
        |view: u32, count: usize, kind: &str| json!({ "bufferView": view, "count": count, "type": kind, "componentType": 5126 });
    let count = grid().count();
    let mut positions = accessor(0, count, "VEC3");
    let low = grid().map(position).reduce(Vec3::min).unwrap_or_default();
    let high = grid().map(position).reduce(Vec3::max).unwrap_or_default();
    (positions["min"], positions["max"]) = (json!(low.to_array()), json!(high.to_array()));
    let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
    let model = json!({
        "asset": { "version": "2.0", "generator": "cargo run --example vase" },
        "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0, "name": "vase" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0 }] }],
        "materials": [{
            "name": "porcelain", "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } },
            "normalTexture": { "index": 2 }
        }],
        "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }],
        "images": [{ "uri": colour }, { "uri": surface }, { "uri": normals }],
        "accessors": [
            positions, accessor(1, count, "VEC3"), accessor(2, count, "VEC2"),
            { "bufferView": 3, "count": indices.len(), "type": "SCALAR", "componentType": 5123 }
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": buffer.len(), "uri": format!("data:application/octet-stream;base64,{data}") }]
    });
    std::fs::write(path, model.to_string() + "\n")?;
    Ok(())
}
