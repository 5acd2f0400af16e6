//! One small file of every format, cut off and with bits and bytes changed.

use crate::damage;
use crate::run::Row;
use crate::seeds::{made_of, seed, shows, shows_whole, under};
use crate::textures::{gltf_with, mapped, uri};

/// Damaged copies of each file.
const COPIES: usize = 24;

type Kind = (&'static str, &'static str, &'static str, fn(&str) -> String, i32);

/// How a file is handed in: its name, the command, the scene that names it, and the exit code where it is good (there is no
/// driver).
const KINDS: &[Kind] = &[
    ("obj/quad.obj", "m.obj", "render s.toml", shows, 3),
    ("ply/ascii.ply", "m.ply", "render s.toml", shows, 3),
    ("ply/little.ply", "m.ply", "render s.toml", shows, 3),
    ("off/quad.off", "m.off", "render s.toml", shows, 3),
    ("gz/quad.off.gz", "m.off.gz", "render s.toml", shows, 3),
    ("gltf/embedded.gltf", "m.gltf", "render s.toml", shows_whole, 3),
    ("gltf/binary.glb", "m.glb", "render s.toml", shows_whole, 3),
    ("exr/zip16.exr", "m.exr", "render s.toml", under, 3),
    ("exr/zip-tiles.exr", "m.exr", "render s.toml", under, 3),
    ("exr/piz.exr", "m.exr", "render s.toml", under, 3),
    ("exr/b44.exr", "m.exr", "compare m.exr m.exr", under, 0),
    ("hdr/runs.hdr", "m.hdr", "render s.toml", under, 3),
    ("hdr/runs.hdr", "m.hdr", "compare m.hdr m.hdr", under, 0),
    ("png/rgba8.png", "m.png", "compare m.png m.png", under, 0),
    ("png/rgba8.png", "m.png", "render s.toml", |file| mapped("albedo_map", file), 3),
    ("png/rgb16.png", "m.png", "render s.toml", |file| mapped("normal_map", file), 3),
    ("jpg/rgb.jpg", "m.jpg", "render s.toml", |file| mapped("roughness_map", file), 3),
    ("exr/b44a.exr", "m.exr", "render s.toml", |file| mapped("height_map", file), 3),
    ("hdr/old-runs.hdr", "m.hdr", "render s.toml", |file| mapped("albedo_map", file), 3),
    ("bsdf/isotropic.bsdf", "m.bsdf", "render s.toml", |_| made_of("rgl = 'm.bsdf'"), 3),
    ("sgd/table.csv", "m.csv", "render s.toml", |_| made_of("sgd = { table = 'm.csv', name = 'paint' }"), 3),
    ("scene/plain.toml", "m.toml", "render m.toml", |_| String::new(), 3),
];

/// For every kind: its name, the exit code where it is good, and rows of which the first is the file as it is.
pub fn tables() -> Vec<(String, i32, Vec<Row>)> {
    let plain = KINDS.iter().map(|(name, file, command, scene, good)| {
        let row = |what, bytes| Row::new(what, command).file("s.toml", scene(file)).file(file, bytes).says(&[file]);
        (format!("{name} by {}", command.split(' ').next().unwrap()), *good, copies(name, *good, row))
    });
    let embedded = ["png/rgb16.png", "jpg/rgb.jpg"].into_iter().map(|name| {
        let row = |what, bytes: Vec<u8>| {
            let row = Row::new(what, "render s.toml").file("s.toml", shows_whole("m.gltf"));
            row.file("m.gltf", gltf_with(&uri(&bytes))).says(&["m.gltf"])
        };
        (format!("{name} in glTF"), 3, copies(name, 3, row))
    });
    plain.chain(embedded).collect()
}

/// The rows of a file as it is and of its damaged copies.
fn copies(name: &str, good: i32, row: impl Fn(String, Vec<u8>) -> Row) -> Vec<Row> {
    let whole = seed(name);
    let first = row(format!("{name} as it is"), whole.clone()).good(good);
    let copies = damage::variants(&whole, COPIES).into_iter().enumerate();
    let copies = copies.map(|(i, bytes)| row(format!("{name}, copy {i}"), bytes).codes(&[2, good]));
    std::iter::once(first).chain(copies).collect()
}
