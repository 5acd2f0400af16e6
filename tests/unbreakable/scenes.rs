//! Scene files, and what they refer to.

use crate::run::Row;
use crate::seeds::{GREY, edited, made_of, seed, shows, under};
use crate::textures::mapped;

/// A scene with one thing changed.
fn scene(what: &str, from: &str, to: &str, says: &str) -> Row {
    text(what, edited("scene/plain.toml", from, to), says)
}

fn text(what: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    Row::new(format!("scene: {what}"), "render s.toml").file("s.toml", bytes).says(&["s.toml", says])
}

pub fn rows() -> Vec<Row> {
    let deep = |open: &str, close: &str| format!("a = {}1{}", open.repeat(100_000), close.repeat(100_000));
    let mut rows = vec![
        text("nothing", "", "0 bytes"),
        text("something else", seed("png/rgba8.png"), "UTF-8"),
        text("bytes that are no text", b"a = '\xff'".as_slice(), "UTF-8"),
        text("cut off in a table's head", "[camera", ":1: TOML"),
        text("cut off in a string", "[camera]\nname = 'x", ":2: TOML"),
        text("the same key twice", "[camera]\nposition = [0, 0, 1]\nposition = [0, 0, 1]\n", ":3: TOML"),
        text("a hundred thousand brackets", deep("[", "]"), ":1: TOML"),
        text("a hundred thousand braces", deep("{a=", "}"), ":1: TOML"),
        text("a megabyte of one key", "a".repeat(1 << 20), "s.toml"),
        text("an escape sequence as a key", "\"\\u001b[2J\" = 1\n", "\\u{1b}[2J"),
        text("no objects", format!("[camera]\nposition = [0, 0, 1]\n{GREY}"), "objects"),
        scene("an unknown key", "fov_y", "fov_z", ":5: "),
        scene("a number of another kind", "fov_y = 40", "fov_y = '40'", ":5: camera.fov_y"),
        scene("a position in four dimensions", "[0, 1, 5]", "[0, 1, 5, 9]", ":2: camera.position: expected 3 numbers"),
        scene("a colour of four channels", "[0.04, 0.5, 1]", "[0.04, 0.5, 1, 1]", "expected a number or three numbers"),
        scene("a size in three directions", "[32, 24]", "[32, 24, 1]", ":6: camera.size: expected 2 numbers"),
        scene("a matrix of 17", "5, 0, 0, 1]", "5, 0, 0, 1, 0]", ":17: objects.1.transform: expected 16 numbers"),
        scene("NaN", "fov_y = 40", "fov_y = nan", ":5: camera.fov_y: expected 0 < degrees < 180, got NaN"),
        scene("infinity", "[0, 1, 5]", "[0, inf, 5]", ":2: camera.position: expected three finite numbers"),
        scene("a position beyond single precision", "[0, 1, 5]", "[0, 1e300, 5]", ":2: camera.position"),
        scene("a move beyond single precision", "translate = [0, 0, 0]", "translate = [1e300, 0, 0]", ":10: objects.0.translate"),
        scene("a scale beyond single precision", "scale = 2", "scale = 1e300", ":12: objects.0.scale"),
        scene("a scale that vanishes in single precision", "scale = 2", "scale = 1e-300", ":12: objects.0.scale"),
        scene("a matrix beyond single precision", "[1, 0, 0, 0, 0, 1", "[1e300, 0, 0, 0, 0, 1", ":17: objects.1.transform"),
        scene("a light beyond single precision", "intensity = 5", "intensity = 1e300", ":21: lights.0.intensity"),
        scene("a size of terabytes", "[32, 24]", "[4000000000, 4000000000]", ":6: camera.size: expected 1 to 16384"),
        scene("a size of nothing", "[32, 24]", "[0, 24]", ":6: camera.size"),
        scene("an integer beyond 64 bits", "scale = 2", "scale = 99999999999999999999", ":12: "),
        scene("a camera in its target", "[0, 1, 5]", "[0, 0, 0]", "a target away from the position"),
        scene("a material that is not there", "material = 'grey'", "material = 'gold'", ":9: objects.0.material"),
        scene("a concentration beyond single precision", "kappa = 10", "kappa = 1e300", "materials.lobes.reflectance"),
        scene("a concentration below 0", "kappa = 10", "kappa = -1", "materials.lobes.reflectance"),
        Row::new("a scene that is not there", "render gone.toml").says(&["gone.toml: file: expected a readable file"]),
        Row::new("a name that is no scene", "render gone").says(&["scene: expected a scene file or one of", "`gone`"]),
        Row::new("a folder as the scene", "render s.toml")
            .folder("s.toml")
            .says(&["s.toml: file: expected a regular file, got a directory"]),
        Row::new("a scene of a terabyte", "render s.toml").hole("s.toml", 1 << 40).says(&["s.toml: file: expected at most"]),
        Row::new("a scene that links to itself", "render s.toml").link("s.toml", "s.toml").says(&["s.toml: file"]),
        Row::new("a scene whose reading fails", "render s.toml").link("s.toml", "/proc/self/mem").says(&["s.toml: file"]),
        Row::new("a line break in a scene's name", "render a\nb.toml").says(&["a\\nb.toml"]),
        Row::new("an override of nothing", "render s.toml --set objects.7.material=grey")
            .file("s.toml", seed("scene/plain.toml"))
            .says(&["--set objects.7"]),
        Row::new("an override that is no TOML", "render s.toml --set camera.position=[[[")
            .file("s.toml", seed("scene/plain.toml"))
            .says(&["--set camera.position"]),
    ];
    // Every kind of file that a scene or a command can name.
    let named: [(&str, &str, String); 13] = [
        ("m.obj", "render s.toml", shows("m.obj")),
        ("m.off.gz", "render s.toml", shows("m.off.gz")),
        ("m.glb", "render s.toml", shows("m.glb")),
        ("m.exr", "render s.toml", under("m.exr")),
        ("m.hdr", "render s.toml", under("m.hdr")),
        ("m.binary", "render s.toml", made_of("merl = 'm.binary'")),
        ("m.bsdf", "render s.toml", made_of("rgl = 'm.bsdf'")),
        ("m.csv", "render s.toml", made_of("sgd = { table = 'm.csv', name = 'x' }")),
        ("m.png", "compare m.png m.png", String::new()),
        ("t.png", "render s.toml", mapped("albedo_map", "t.png")),
        ("t.jpg", "render s.toml", mapped("roughness_map", "t.jpg")),
        ("t.exr", "render s.toml", mapped("normal_map", "t.exr")),
        ("t.hdr", "render s.toml", mapped("height_map", "t.hdr")),
    ];
    for (name, command, scene) in named {
        let row = |what: &str, says: &str| {
            let row = Row::new(format!("{name}: {what}"), command).file("s.toml", scene.clone());
            row.says(&[&format!("{name}: file: expected"), says])
        };
        rows.push(row("missing", "a readable file"));
        rows.push(row("a folder", "got a directory").folder(name));
        rows.push(row("a pipe", "got a special file").pipe(name));
        rows.push(row("a device", "got a special file").link(name, "/dev/zero"));
        rows.push(row("a link to itself", "a readable file").link(name, name));
        rows.push(row("a terabyte", "at most").hole(name, 1 << 40));
    }
    rows
}
