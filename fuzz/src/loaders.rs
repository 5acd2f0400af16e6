//! One row a loader: the file that it reads, and what must hold of the result.

use passband::glam::{DVec2, DVec3};
use passband::offline::error::Result;
use passband::offline::image_io::{read_exr, read_hdr, read_png};
use passband::offline::mesh::{self, Mesh, Projection};
use passband::offline::scene::{Scene, read_rgl, read_sgd};
use passband::offline::texture::{Encoding, Image};
use passband::offline::{environment, gltf};
use passband::reflectance::{MerlTable, Reflectance};
use std::path::Path;
use std::sync::Mutex;

/// Something that reads files.
pub struct Loader {
    /// As `scripts/fuzz` and the corpus call it.
    pub name: &'static str,
    /// The input's name in the scratch folder.
    pub file: &'static str,
    /// Bytes of memory that a byte of the file may cost.
    pub growth: usize,
    /// Writes what else the file needs beside it.
    pub prepare: fn(&Path),
    /// Reads `data`, as the file at the path.
    pub run: fn(&Path, &[u8]),
}

/// What a number of text costs as a vertex with all its attributes, while it is parsed.
const MESH: usize = 1 << 10;
/// A bit of a PNG as a texel of three bytes, and beside it a float of each channel and the finished texture with its mips.
const TEXTURE: usize = 1032 * 8 * 24;
/// The most that gzip may unpack to, as a mesh.
const GZIP: usize = 64 * MESH;

const fn row(name: &'static str, file: &'static str, growth: usize, run: fn(&Path, &[u8])) -> Loader {
    Loader { name, file, growth, prepare: |_| (), run }
}

pub const LOADERS: [Loader; 13] = [
    Loader { prepare: |_| whole_table(), ..row("merl", "m.binary", 64, |_, data| merl(data)) },
    row("bsdf", "m.bsdf", 256, bsdf),
    row("sgd", "m.csv", 256, |path, data| {
        let _ = check(write(path, data).and_then(|()| read_sgd(path, "paint")));
    }),
    row("exr", "m.exr", TEXTURE, |path, data| {
        let _ = check(write(path, data).and_then(|()| read_exr(path)));
        let _ = check(environment::read(path));
        texture(path);
    }),
    row("hdr", "m.hdr", TEXTURE, |path, data| {
        let _ = check(write(path, data).and_then(|()| read_hdr(path)));
        let _ = check(environment::read(path));
        texture(path);
    }),
    row("png", "m.png", TEXTURE, |path, data| {
        let _ = check(write(path, data).and_then(|()| read_png(path)));
        texture(path);
    }),
    row("jpg", "m.jpg", TEXTURE, |path, data| {
        put(path, data);
        texture(path);
    }),
    row("obj", "m.obj", MESH, one_mesh),
    row("ply", "m.ply", MESH, one_mesh),
    row("off", "m.off", MESH, |path, data| {
        one_mesh(path, data);
        // The smallest format finds most meshes for the atlas, which takes its time on large ones.
        if let Some(mut mesh) = mesh::read(path).ok().filter(|mesh| mesh.indices.len() < 60) {
            let _ = mesh.generate_uvs(Projection::Atlas, None);
            assert!(mesh.is_consistent());
        }
    }),
    row("gltf", "m.gltf", MESH, |path, data| {
        let model = check(write(path, data).and_then(|()| gltf::read(path)));
        model.iter().flat_map(|m| &m.primitives).for_each(|p| usable(&p.mesh));
        let mesh = check(mesh::read(path));
        assert!(model.is_none() || mesh.is_some(), "the mesh alone never fails where the whole model does not");
    }),
    row("gz", "m.off.gz", GZIP, one_mesh),
    row("scene", "m.toml", 1 << 14, scene),
];

/// Texels of the largest image of which all textures are made: larger ones take the same path, and longer.
const MOST_TEXELS: u32 = 1 << 14;

/// The harness's own files must not fail.
fn put(path: &Path, data: &[u8]) {
    if let Err(e) = std::fs::write(path, data) {
        eprintln!("cannot write {}: {e}", path.display());
        std::process::exit(2);
    }
}

fn write(path: &Path, data: &[u8]) -> Result<()> {
    put(path, data);
    Ok(())
}

/// What was read, or an error that is one line.
fn check<T>(outcome: Result<T>) -> Option<T> {
    outcome
        .map_err(|e| {
            let text = e.to_string();
            assert!(!text.contains(['\n', '\r', '\x1b', '\0']) && text.len() < 2000, "no clear line: {text:?}");
            assert_eq!(e.exit_code(), 2, "{text}");
        })
        .ok()
}

fn usable(mesh: &Mesh) {
    assert!(mesh.is_consistent() && mesh.indices.len() >= 3);
    let finite = |v: &[f32]| v.iter().all(|c| c.is_finite());
    assert!(finite(mesh.positions.as_flattened()) && finite(mesh.normals.as_flattened()) && finite(mesh.uvs.as_flattened()));
    for projection in [Projection::Spherical, Projection::Box] {
        let mut copy = mesh.clone();
        assert!(copy.generate_uvs(projection, None).is_ok());
        copy.compute_tangents();
        assert!(copy.is_consistent());
    }
}

fn one_mesh(path: &Path, data: &[u8]) {
    if let Some(mesh) = check(write(path, data).and_then(|()| mesh::read(path))) {
        usable(&mesh);
    }
}

/// The file as every kind of map.
fn texture(path: &Path) {
    let Some(image) = check(Image::read(path)) else { return };
    let [width, height] = image.size();
    assert!((1..=16_384).contains(&width) && (1..=16_384).contains(&height));
    if width * height > MOST_TEXELS {
        return;
    }
    let textures = [Encoding::Auto, Encoding::Unit, Encoding::Signed].map(|encoding| image.normals(encoding, false, 2.0));
    for texture in textures.into_iter().chain([image.colour(), image.roughness()]) {
        let value = check(texture).map(|t| (t.size(), t.sample(DVec2::new(0.3, -7.1), 1.5)));
        assert!(value.is_none_or(|(size, v)| size == [width, height] && v.is_finite()), "{value:?}");
    }
    let _ = check(image.heights());
}

static TABLE: Mutex<Vec<u8>> = Mutex::new(Vec::new());

fn whole_table() {
    let grey = MerlTable::from_fn(|_, _, _| DVec3::splat(0.2));
    let written = TABLE.lock().map(|mut table| grey.write(&mut *table).is_ok());
    assert!(written.is_ok_and(|ok| ok));
}

/// A MERL table is 35 MB, too much to mutate as it is. The input says what differs from one that is valid: with the first bit of
/// the first byte set, the file is the bytes that follow. Otherwise they are a header of 12 bytes, then places (`u32`, in
/// entries) and numbers (`f64`); the second bit makes the file a byte too long.
fn merl(data: &[u8]) {
    let Some((&mode, rest)) = data.split_first() else { return };
    if mode & 1 != 0 {
        drop(MerlTable::from_bytes(rest));
        return;
    }
    let Ok(mut table) = TABLE.lock() else { return };
    let (header, patches) = rest.split_at(rest.len().min(12));
    let places = patches.as_chunks::<12>().0.iter().filter_map(|patch| {
        let (place, number) = patch.split_first_chunk::<4>()?;
        let at = 12 + u32::from_le_bytes(*place) as usize % (3 * 90 * 90 * 180) * 8;
        Some((at, number))
    });
    let old: Vec<(usize, Vec<u8>)> = std::iter::once((0, header))
        .chain(places)
        .map(|(at, new)| {
            let old = table[at..at + new.len()].to_vec();
            table[at..at + new.len()].copy_from_slice(new);
            (at, old)
        })
        .collect();
    let size = table.len();
    table.extend((mode & 2 != 0).then_some(0));
    if let Ok(read) = MerlTable::from_bytes(&table) {
        assert!(table.len() == size, "a table that is too long");
        let value = read.evaluate(DVec3::Z, DVec3::Z);
        assert!(value.is_finite() && value.min_element() >= 0.0, "{value}");
    }
    table.truncate(size);
    for (at, old) in old.into_iter().rev() {
        table[at..at + old.len()].copy_from_slice(&old);
    }
}

fn bsdf(path: &Path, data: &[u8]) {
    let Some(rgl) = check(write(path, data).and_then(|()| read_rgl(path))) else { return };
    for [x, y] in [[0.0, 0.0], [0.3, 0.1], [-0.6, 0.7], [0.0, 0.999]] {
        for [u, v] in [[0.0, 0.0], [-0.3, 0.2], [0.8, -0.5]] {
            let lift = |x: f64, y: f64| DVec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt());
            let value = rgl.evaluate(lift(x, y), lift(u, v));
            assert!(value.is_finite() && value.min_element() >= 0.0, "{value}");
        }
    }
}

/// Reads and checks the scene; resolves it too where that loads no file, bakes no table and makes no big mesh or map.
fn scene(path: &Path, data: &[u8]) {
    let scene = write(path, data).and_then(|()| Scene::load(&path.to_string_lossy(), &[]));
    // Keys that are not supported yet are a good answer.
    let Some(scene) = check(scene) else { return };
    let text = String::from_utf8_lossy(data).replace("builtin = 'plane'", "");
    if !["mesh", "map", "merl", "rgl", "sgd", "builtin"].iter().any(|slow| text.contains(slow)) {
        let _ = check(scene.resolve());
    }
}
