//! Textures: PNG, JPEG, EXR and HDR as every kind of map, and inside glTF.

use crate::images::{black_png, exr, exr_named, hdr, png_of};
use crate::run::Row;
use crate::seeds::{GREY, edited, seed};
use base64::Engine;
use std::io::Write;

/// The keys that name a texture file.
pub const MAPS: [&str; 5] = ["albedo_map", "specular_map", "normal_map", "roughness_map", "height_map"];

/// A scene with a plane whose material has further keys.
pub fn with(keys: &str) -> String {
    format!("[camera]\nposition = [0, 0, 3]\n[[objects]]\nbuiltin = 'plane'\nmaterial = 'a'\n{GREY}{keys}\n")
}

/// A scene that names the file as a map.
pub fn mapped(map: &str, file: &str) -> String {
    with(&format!("{map} = '{file}'"))
}

/// A texture file as a map.
fn texture(what: &str, map: &str, name: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    let row = Row::new(format!("{name} as {map}: {what}"), "render s.toml").file("s.toml", mapped(map, name));
    row.file(name, bytes).says(&[name, says])
}

/// A file that every map takes.
fn good(what: &str, name: &str, bytes: &[u8]) -> Vec<Row> {
    MAPS.iter().map(|map| texture(what, map, name, bytes, "").good(3)).collect()
}

/// Keys of a material.
fn keys(what: &str, keys: &str, says: &str) -> Row {
    Row::new(format!("material: {what}"), "render s.toml").file("s.toml", with(keys)).says(&["s.toml", says])
}

/// A mesh file with a map.
fn mesh(what: &str, obj: &str, keys: &str, says: &str) -> Row {
    let scene = "[camera]\nposition = [0, 0, 3]\n[[objects]]\nmesh = 'm.obj'\nmaterial = 'a'\n";
    let row = Row::new(format!("a mesh with a map: {what}"), "render s.toml").file("s.toml", format!("{scene}{keys}"));
    row.file("m.obj", obj).file("t.png", seed("png/rgba8.png")).says(&["s.toml", says])
}

/// A PNG of 2x1 pixels in the given colour type and depth, out of its chunks.
fn png(colour: u8, depth: u8, palette: &[u8], row: &[u8]) -> Vec<u8> {
    let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    zlib.write_all(&[&[0], row].concat()).unwrap();
    let header = vec![0, 0, 0, 2, 0, 0, 0, 1, depth, colour, 0, 0, 0];
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let chunks = [(b"IHDR", header), (b"PLTE", palette.to_vec()), (b"IDAT", zlib.finish().unwrap()), (b"IEND", vec![])];
    for (name, content) in chunks.into_iter().filter(|(name, content)| *name != b"PLTE" || !content.is_empty()) {
        let body = [&name[..], &content].concat();
        let mut crc = flate2::Crc::new();
        crc.update(&body);
        file.extend([&(content.len() as u32).to_be_bytes()[..], &body, &crc.sum().to_be_bytes()].concat());
    }
    file
}

/// The embedded glTF with an image as its base colour.
pub fn gltf_with(image: &str) -> Vec<u8> {
    let text =
        String::from_utf8(edited("gltf/embedded.gltf", "Factor\":0.3}", "Factor\":0.3,\"baseColorTexture\":{\"index\":0}}"));
    let tables = format!(r#"{{"textures":[{{"source":0}}],"images":[{{{image}}}],"asset""#);
    text.unwrap().replacen("{\"asset\"", &tables, 1).into_bytes()
}

/// An image as a glTF file holds it.
pub fn uri(bytes: &[u8]) -> String {
    format!(r#""uri":"data:image/png;base64,{}""#, base64::engine::general_purpose::STANDARD.encode(bytes))
}

fn gltf(what: &str, image: &str, says: &str) -> Row {
    let row = Row::new(format!("glTF image: {what}"), "render s.toml").file("s.toml", crate::seeds::shows_whole("m.gltf"));
    row.file("m.gltf", gltf_with(image)).says(&[says])
}

pub fn rows() -> Vec<Row> {
    let [whole, jpeg] = ["png/rgba8.png", "jpg/rgb.jpg"].map(seed);
    let mut rows = vec![
        texture("half of it", "normal_map", "t.png", &whole[..160], "a well-formed PNG or JPEG image"),
        texture("something else", "height_map", "t.png", seed("exr/zip16.exr"), "a well-formed PNG or JPEG image"),
        texture("the largest size that there is", "albedo_map", "t.png", png_of([0x7fff_ffff; 2]), "t.png"),
        texture("16k by 16k in 300 bytes", "roughness_map", "t.png", png_of([16_384; 2]), "expected at least"),
        texture("no columns", "normal_map", "t.png", png_of([0, 7]), "t.png"),
        texture("wider than 16k", "height_map", "t.png", black_png(16_385, 1), "image size"),
        texture("half of it", "albedo_map", "t.jpg", &jpeg[..300], "a well-formed PNG or JPEG image"),
        texture("its mark alone", "albedo_map", "t.jpg", &jpeg[..2], "a well-formed PNG or JPEG image"),
        texture("something else", "normal_map", "t.jpeg", seed("hdr/runs.hdr"), "a well-formed PNG or JPEG image"),
        // Found by fuzzing: the decoder panics.
        texture(
            "tables that contradict",
            "albedo_map",
            "t.jpg",
            include_bytes!("../data/panicking.jpg"),
            "that cannot be decoded",
        ),
        texture("something else", "albedo_map", "t.exr", &whole[..], "EXR"),
        texture("half of it", "height_map", "t.exr", &seed("exr/zip16.exr")[..300], "EXR"),
        texture("no colours", "albedo_map", "t.exr", exr_named("X"), "EXR channels: expected R, G and B, or Y"),
        texture("wider than 16k", "roughness_map", "t.exr", exr(16_385, 1, 0.5), "image size"),
        texture("half as many rows as are claimed", "albedo_map", "t.hdr", [hdr("", "-Y 4 +X 1"), vec![1; 8]].concat(), "HDR"),
        texture("16k by 8k in 60 bytes", "roughness_map", "t.hdr", hdr("", "-Y 8192 +X 16384"), "HDR length: expected at least"),
        texture("another format", "albedo_map", "t.tga", &whole[..], "expected a file name that ends in"),
        keys("a map that is no text", "albedo_map = 3", ":8: "),
        keys("a built-in map that is not there", "normal_map = 'builtin:nope'", ":8: materials.a.normal_map: expected"),
        keys("built-in heights", "height_map = 'builtin:bumps'", ":8: materials.a.height_map"),
        keys("built-in concentrations as alphas", "roughness_map = 'builtin:bumps'\nroughness = 'alpha'", ":9: "),
        keys("an encoding that is not there", "normal_map = 'builtin:bumps'\nnormal_encoding = 'half'", ":9: "),
        keys("a direction that is not there", "normal_map = 'builtin:bumps'\nnormal_y = 'left'", ":9: "),
        keys("a roughness that is not there", "roughness_map = 'builtin:bumps'\nroughness = 'beta'", ":9: "),
        keys("an encoding of nothing", "normal_encoding = 'unit'", ":8: "),
        keys("a scale of nothing", "height_scale = 2", ":8: "),
        keys("displacement by nothing", "displace = true", ":8: "),
        keys("an infinite scale", "height_map = 't.png'\nheight_scale = inf", ":9: "),
        keys("displacement that is no truth", "height_map = 't.png'\ndisplace = 1", ":9: "),
        keys("normals twice", "normal_map = 'builtin:bumps'\nheight_map = 't.png'", "two maps of normals"),
        keys("a tiling of 0", "albedo_map = 'builtin:checker'\ntiling = [0, 1]", ":9: materials.a.tiling"),
        keys("a tiling of NaN", "albedo_map = 'builtin:checker'\ntiling = [1, nan]", ":9: materials.a.tiling"),
        keys("a tiling below 0", "albedo_map = 'builtin:checker'\ntiling = [1, -1]", ":9: materials.a.tiling"),
        keys("a tiling in three directions", "albedo_map = 'builtin:checker'\ntiling = [1, 1, 1]", ":9: "),
        gltf("nothing", &uri(b""), "images[0]: expected PNG or JPEG data"),
        gltf("something else", &uri(b"neither"), "images[0]: expected PNG or JPEG data"),
        gltf("half of it", &uri(&whole[..160]), "baseColorTexture: expected a well-formed PNG or JPEG image"),
        gltf("16k by 16k in 300 bytes", &uri(&png_of([16_384; 2])), "baseColorTexture: expected at least"),
        gltf("wider than 16k", &uri(&black_png(16_385, 1)), "image size"),
        gltf("no base64", r#""uri":"data:image/png;base64,????""#, "m.gltf"),
        gltf("a view that is not there", r#""bufferView":99,"mimeType":"image/png""#, "m.gltf"),
        gltf("a view that is no image", r#""bufferView":0,"mimeType":"image/png""#, "images[0]: expected PNG or JPEG data"),
        gltf("missing", r#""uri":"gone.png""#, "gone.png"),
        gltf("out of the folder", r#""uri":"../../../etc/passwd""#, "m.gltf"),
        gltf("from elsewhere", r#""uri":"https://example.org/a.png""#, "m.gltf"),
        gltf("a folder", r#""uri":"t.png""#, "t.png").folder("t.png"),
        gltf("as it should be", &uri(&whole), "").good(3),
        gltf("a JPEG that says that it is a PNG", &uri(&jpeg), "").good(3),
    ];
    for map in MAPS {
        for (what, value) in [("NaN", f32::NAN), ("infinity", f32::INFINITY)] {
            rows.push(texture(what, map, "t.exr", exr(4, 2, value), "texel (0, 0): expected finite values"));
        }
    }
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let grey = |keys: &str| format!("{GREY}{keys}\n");
    for map in MAPS {
        let key = grey(&format!("{map} = 't.png'"));
        rows.push(mesh("no coordinates", &format!("{triangle}f 1 2 3\n"), &key, "no texture coordinates"));
        rows.push(mesh("some", &format!("{triangle}vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"), &key, "").good(3));
        rows.push(mesh("coordinates of its own", &format!("{triangle}f 1 2 3\n"), &format!("uv = 'box'\n{key}"), "").good(3));
    }
    let displaced = grey("height_map = 't.png'\ndisplace = true");
    let flat = format!("{triangle}vt 0.5 0.5\nf 1/1 2/1 3/1\n");
    rows.push(mesh("displacement without an area", &flat, &displaced, "texture coordinates without an area"));
    rows.push(mesh("displacement without coordinates", &format!("{triangle}f 1 2 3\n"), &displaced, "no texture coordinates"));
    for map in ["specular_map", "roughness_map"] {
        let keys = format!("{map} = 't.png'");
        let scene = crate::seeds::made_of("builtin = 'rough'") + &keys;
        let row = Row::new(format!("a table with a {map}"), "render s.toml").file("s.toml", scene);
        rows.push(row.file("t.png", whole.clone()).says(&[":8: ", "none on a tabulated reflectance"]));
    }
    for (what, bytes) in [
        ("8 bits with alpha", whole.clone()),
        ("16 bits", seed("png/rgb16.png")),
        ("one grey texel", seed("png/grey8.png")),
        ("16 bits of grey with alpha", seed("png/grey-alpha16.png")),
        ("8 bits of grey with alpha", png(4, 8, &[], &[10, 255, 200, 0])),
        ("a palette", png(3, 8, &[255, 0, 0, 0, 0, 255], &[1, 0])),
        ("a palette of one bit", png(3, 1, &[255, 0, 0, 0, 0, 255], &[0x40])),
        ("one bit of grey", png(0, 1, &[], &[0x40])),
        ("16k wide", black_png(16_384, 1)),
        ("16k high", black_png(1, 16_384)),
        ("a JPEG", jpeg.clone()),
    ] {
        rows.extend(good(what, "t.png", &bytes));
    }
    rows.extend(good("colours", "t.jpg", &jpeg));
    rows.extend(good("grey", "t.jpg", &seed("jpg/grey.jpg")));
    rows.extend(good("a texel", "t.exr", &exr(1, 1, 0.5)));
    rows.extend(good("16k wide", "t.exr", &exr(16_384, 1, 0.5)));
    rows.extend(good("below 0", "t.exr", &exr(4, 2, -0.5)));
    rows.extend(good("a grey channel", "t.exr", &exr_named("Y")));
    rows.extend(good("runs", "t.hdr", &seed("hdr/runs.hdr")));
    rows.push(
        texture("a palette that is too short", "albedo_map", "t.png", png(3, 8, &[9, 9, 9], &[7, 0]), "t.png").codes(&[2, 3]),
    );
    rows
}
