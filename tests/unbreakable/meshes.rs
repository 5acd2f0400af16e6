//! Meshes: OBJ, PLY, OFF, glTF, gzip.

use crate::damage::gzip;
use crate::run::Row;
use crate::seeds::{edited, seed, shows, shows_whole};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A mesh file, with what must be said after its name.
fn mesh(what: &str, name: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    Row::new(format!("{name}: {what}"), "render s.toml").file("s.toml", shows(name)).file(name, bytes).says(&[name, says])
}

/// The embedded glTF with one thing changed.
fn gltf(what: &str, from: &str, to: &str, says: &str) -> Row {
    let bytes = edited("gltf/embedded.gltf", from, to);
    Row::new(format!("glTF: {what}"), "render s.toml")
        .file("s.toml", shows_whole("m.gltf"))
        .file("m.gltf", bytes)
        .says(&["m.gltf", says])
}

/// The glTF with the buffer somewhere else.
fn refers(what: &str, uri: &str, says: &str) -> Row {
    let text = String::from_utf8(seed("gltf/embedded.gltf")).unwrap();
    let start = text.find("data:").unwrap();
    let end = start + text[start..].find('"').unwrap();
    let text = text.replacen(&text[start..end], uri, 1);
    let row = Row::new(format!("glTF buffer: {what}"), "render s.toml").file("s.toml", shows_whole("m.gltf"));
    row.file("m.gltf", text).says(&[says])
}

pub fn rows() -> Vec<Row> {
    let ply = |what, from, to, says| mesh(what, "m.ply", edited("ply/ascii.ply", from, to), says);
    let off = |what, from, to, says| mesh(what, "m.off", edited("off/quad.off", from, to), says);
    let obj = |what, text: &str, says| mesh(what, "m.obj", TRIANGLE.to_string() + text, says);
    let glb = |what, at: usize, bytes: &[u8], says| {
        let bytes = crate::seeds::patched("gltf/binary.glb", at, bytes);
        Row::new(format!("GLB: {what}"), "render s.toml")
            .file("s.toml", shows_whole("m.glb"))
            .file("m.glb", bytes)
            .says(&["m.glb", says])
    };
    let deep = |open: &str, close: &str| open.repeat(100_000) + &close.repeat(100_000);
    let mut rows = vec![
        mesh("nothing", "m.obj", "", "0 bytes"),
        mesh("something else", "m.obj", seed("png/rgba8.png"), "triangle"),
        mesh("NaN vertex", "m.obj", "v 0 nan 0\nf 1 1 1\n", ":1: vertex position: expected 3 finite numbers"),
        mesh("infinite vertex", "m.obj", "v 0 0 0\nv 1e99 0 0\nf 1 1 2\n", ":2: vertex position: expected 3 finite numbers"),
        obj("infinite normal", "vn 0 inf 1\n", ":4: vertex normal"),
        obj("NaN coordinate", "vt nan 0\n", ":4: texture coordinate"),
        obj("no triangles", "", "at least one triangle"),
        obj("an index of 0", "f 0 1 2\n", ":4: index: expected 1 to 3"),
        obj("an index too large", "f 1 2 4\n", ":4: index: expected 1 to 3"),
        obj("an index before the start", "f -4 1 2\n", ":4: index"),
        obj("an index beyond 64 bits", "f 1 2 99999999999999999999\n", ":4: index"),
        obj("an escape sequence in the error", "f 1 2 \x1b[2J\n", "\\u{1b}[2J"),
        obj("a number without end", &format!("v {} 0 0\n", "9".repeat(1 << 20)), ":4: vertex position"),
        mesh("nothing", "m.ply", "", "0 bytes"),
        ply("no header", "ply\n", "plx\n", "header"),
        ply("NaN vertex", "1 1 0.5 1 1", "1 nan 0.5 1 1", "element vertex"),
        ply("infinite vertex", "1 1 0.5 1 1", "1e99 1 0.5 1 1", "vertex 2: position: expected finite numbers"),
        ply("no faces", "face 2", "face 0", "triangle"),
        ply("an index too large", "3 0 1 2", "3 0 1 4", "face 0: expected indices from 0 to below 4"),
        ply("a negative index", "3 0 1 2", "3 0 1 -1", "face 0"),
        ply("a trillion vertices", "vertex 4", "vertex 1000000000000", "element vertex: expected at most"),
        ply("a face of a billion corners", "4 0 1 2 3", "1000000000 0 1 2 3", "element face"),
        ply("2^64 faces", "face 2", "face 18446744073709551615", "element face: expected at most"),
        mesh("nothing", "m.off", "", "0 bytes"),
        off("another variant", "OFF", "NOFF", ":1: OFF"),
        off("NaN vertex", "1 1 0", "1 nan 0", ":5: vertex position"),
        off("infinite vertex", "1 1 0", "1 1e99 0", ":5: vertex position"),
        off("no faces", "4 2 0", "4 0 0", "triangle"),
        off("an index too large", "3 0 1 2", "3 0 1 4", ":7: index: expected below 4"),
        off("a trillion vertices", "4 2 0", "1000000000000 2 0", ":2: counts: expected what"),
        off("a face of 2^63 corners", "3 0 1 2", "9223372036854775807 0 1 2", ":7: face"),
        gltf("another version", "\"2.0\"", "\"3.0\"", "asset.version"),
        gltf("an index out of range", "\"mesh\":1", "\"mesh\":9", "mesh"),
        gltf("a trillion vertices", "\"count\":3", "\"count\":1000000000000", "accessors[0]"),
        gltf("a view beyond its buffer", "\"byteOffset\":144", "\"byteOffset\":1000000000000", "bufferViews[4]"),
        gltf("a buffer of terabytes", "\"byteLength\":152", "\"byteLength\":4000000000000", "buffers[0]"),
        gltf(
            "a node that is its own child",
            "\"children\":[2]",
            "\"children\":[0]",
            "nodes[0]: expected one parent, and no cycle",
        ),
        gltf(
            "a cycle of two nodes",
            "{\"mesh\":1,\"camera\":0}",
            "{\"children\":[0]}",
            "nodes[0]: expected one parent, and no cycle",
        ),
        gltf("an infinite scale", "[-1,1,2]", "[3e38,3e38,3e38],\"translation\":[3e38,0,0]", "finite"),
        gltf("a required extension", "\"scene\":0", "\"extensionsRequired\":[\"X\"],\"scene\":0", "extension"),
        mesh("nothing but brackets", "m.gltf", deep("[", "]"), ":1: glTF JSON"),
        refers(
            "a file above its folder",
            "../m.bin",
            "m.gltf: buffers[0].uri: expected a relative name of a file in the same folder",
        ),
        refers(
            "a file above its folder, in disguise",
            "a/%2e%2e/%2e%2e/m.bin",
            "m.gltf: buffers[0].uri: expected a relative name of a file in the same folder",
        ),
        refers(
            "an absolute path",
            "/etc/hostname",
            "m.gltf: buffers[0].uri: expected a relative name of a file in the same folder",
        ),
        refers(
            "another host",
            "https://example.org/m.bin",
            "m.gltf: buffers[0].uri: expected a relative name of a file in the same folder",
        ),
        refers("a missing file", "gone.bin", "gone.bin: file: expected a readable file"),
        refers("itself", "m.gltf", "m.gltf"),
        refers("a folder", "folder", "folder: file: expected a regular file, got a directory").folder("folder"),
        refers(
            "a link out of its folder",
            "link.bin",
            "m.gltf: buffers[0].uri: expected a relative name of a file in the same folder",
        )
        .link("link.bin", "/etc/hostname"),
        refers("a loop of links", "a.bin", "a.bin: file: expected a readable file").link("a.bin", "b.bin").link("b.bin", "a.bin"),
        refers("a pipe", "pipe.bin", "pipe.bin: file: expected a regular file, got a special file").pipe("pipe.bin"),
        refers("a device", "zero.bin", "m.gltf: buffers[0].uri: expected a relative name of a file in the same folder")
            .link("zero.bin", "/dev/zero"),
        glb("a length below its header", 8, &[3, 0, 0, 0], "GLB length"),
        glb("a length of gigabytes", 8, &[255; 4], "GLB length"),
        glb("a chunk of gigabytes", 12, &[252, 255, 255, 255], "m.glb"),
        instances(),
        mesh("a bomb of 64 MiB", "m.off.gz", gzip(&[b' '; 1 << 20]).repeat(64), "gzip: expected at most"),
        mesh("a bomb of 64 MiB", "m.glb.gz", gzip(&[0; 1 << 20]).repeat(64), "gzip: expected at most"),
        mesh("a stream that is cut off", "m.obj.gz", &gzip(TRIANGLE.as_bytes())[..30], "gzip"),
        mesh("not compressed", "m.obj.gz", TRIANGLE, "gzip"),
        mesh("nothing inside", "m.ply.gz", gzip(b""), "gzip: expected content"),
        mesh("compressed twice", "m.off.gz", gzip(&seed("gz/quad.off.gz")), "m.off.gz:1: OFF"),
    ];
    rows.extend(images_of_gltf());
    rows
}

/// Four thousand nodes that show one mesh of a hundred and fifty vertices, most of them zeros that no byte stands for.
fn instances() -> Row {
    let more: String = (3..4003).fold(String::new(), |all, i| all + &format!(",{i}"));
    let text = edited("gltf/embedded.gltf", "\"nodes\":[0,1]", &format!("\"nodes\":[0,1{more}]"));
    let text = String::from_utf8(text).unwrap();
    let text = text.replacen("5,0,0,1]}", &format!("5,0,0,1]}}{}", ",{\"mesh\":1}".repeat(4000)), 1);
    let text = text.replacen("{\"count\":3", "{\"count\":150", 1);
    let row = Row::new("glTF: instances without end", "render s.toml").file("s.toml", shows_whole("m.gltf"));
    row.file("m.gltf", text).says(&["m.gltf: nodes: expected at most", "more instances"])
}

/// Images are carried and not decoded yet; what is no image is refused.
fn images_of_gltf() -> Vec<Row> {
    let with = |what: &str, uri: &str, says: &str| {
        let images = format!("\"textures\":[{{\"source\":0}}],\"images\":[{{\"uri\":\"{uri}\"}}],\"materials\"");
        let text = String::from_utf8(edited("gltf/embedded.gltf", "\"materials\"", &images)).unwrap();
        let text = text.replacen("\"metallicFactor\"", "\"baseColorTexture\":{\"index\":0},\"metallicFactor\"", 1);
        let row = Row::new(format!("glTF image: {what}"), "render s.toml").file("s.toml", shows_whole("m.gltf"));
        row.file("m.gltf", text).says(&[says])
    };
    vec![
        with("a JPEG", "i.jpg", "").file("i.jpg", seed("jpg/rgb.jpg")).good(3),
        with("an empty JPEG", "i.jpg", "i.jpg: file: expected content").file("i.jpg", ""),
        with("no image", "i.jpg", "m.gltf: images[0]: expected PNG or JPEG data").file("i.jpg", "hello"),
        with("the start of a JPEG's mark", "i.jpg", "m.gltf: images[0]: expected PNG or JPEG data").file("i.jpg", [0xff, 0xd8]),
        with("a missing JPEG", "gone.jpg", "gone.jpg: file: expected a readable file"),
        with("a JPEG above its folder", "../i.jpg", "m.gltf: images[0].uri: expected a relative name"),
        with("a link to itself", "i.jpg", "i.jpg: file: expected a readable file").link("i.jpg", "i.jpg"),
        with("base64 that is none", "data:image/jpeg;base64,%%%", "m.gltf: images[0].uri: expected base64"),
    ]
}
