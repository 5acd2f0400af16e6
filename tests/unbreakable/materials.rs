//! Reflectances: MERL, RGL, SGD tables.

use crate::run::Row;
use crate::seeds::{edited, made_of, patched, place, seed};
use passband::glam::DVec3;
use passband::reflectance::MerlTable;
use std::sync::OnceLock;

fn material(what: &str, name: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    Row::new(format!("{name}: {what}"), &format!("material {name}")).file(name, bytes).says(&[name, says])
}

fn sgd(what: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    Row::new(format!("SGD: {what}"), "material m.csv:paint").file("m.csv", bytes).says(&["m.csv", says])
}

/// A valid table.
fn merl() -> &'static [u8] {
    static TABLE: OnceLock<Vec<u8>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut bytes = Vec::new();
        MerlTable::from_fn(|_, _, _| DVec3::splat(0.2)).write(&mut bytes).unwrap();
        bytes
    })
}

/// The table with the bytes at `at` replaced.
fn changed(at: usize, bytes: &[u8]) -> Vec<u8> {
    [&merl()[..at], bytes, &merl()[at + bytes.len()..]].concat()
}

pub fn rows() -> Vec<Row> {
    let entry = 12 + 8 * 1_000_000;
    // Behind a name: its number of dimensions, its type, its offset, its shape.
    let shape = place("bsdf/isotropic.bsdf", b"rgb") + 3 + 2 + 1 + 8;
    let bsdf = |what, at: usize, bytes: &[u8], says| material(what, "m.bsdf", patched("bsdf/isotropic.bsdf", at, bytes), says);
    let data = seed("bsdf/isotropic.bsdf").len() - 4;
    vec![
        material("nothing", "m.binary", "", "0 bytes"),
        material("something else", "m.binary", seed("png/rgba8.png"), "dimensions"),
        material("its header alone", "m.binary", &merl()[..12], "at byte 12: size: expected 34992012 bytes, got 12 bytes"),
        material("half of it", "m.binary", &merl()[..17_000_000], "at byte 17000000: size"),
        material("a byte too few", "m.binary", &merl()[..merl().len() - 1], "size"),
        material("a byte too many", "m.binary", [merl(), &[0]].concat(), "at byte 34992012: size"),
        material("a bit of its header", "m.binary", changed(0, &[91]), "at byte 0: dimensions: expected 90 90 180"),
        material("dimensions of terabytes", "m.binary", changed(0, &[255, 255, 255, 127]), "at byte 0: dimensions"),
        material("dimensions below 0", "m.binary", changed(8, &[255; 4]), "at byte 0: dimensions"),
        material(
            "NaN",
            "m.binary",
            changed(entry, &f64::NAN.to_le_bytes()),
            "at byte 8000012: red entry 1000000: expected a finite number",
        ),
        material(
            "infinity",
            "m.binary",
            changed(entry, &f64::INFINITY.to_le_bytes()),
            "at byte 8000012: red entry 1000000: expected a finite number",
        ),
        material("beyond single precision", "m.binary", changed(entry, &1e300_f64.to_le_bytes()), "red entry 1000000"),
        Row::new("a good table", "render s.toml").file("s.toml", made_of("merl = 'm.binary'")).file("m.binary", merl()).good(3),
        material("nothing", "m.bsdf", "", "0 bytes"),
        material("something else", "m.bsdf", seed("png/rgba8.png"), "at byte 0: identifier"),
        material("its start", "m.bsdf", &seed("bsdf/isotropic.bsdf")[..40], "m.bsdf"),
        bsdf("another version", 12, &[9], "at byte 12: version: expected 1.0, got 9.0"),
        bsdf("four billion fields", 14, &[255; 4], "at byte 14: number of fields"),
        bsdf("a side of 2^64", shape, &[255; 8], "rgb shape"),
        bsdf("sides whose product wraps", shape, &[0, 0, 0, 0, 0, 0, 0, 128].repeat(2), "rgb shape"),
        bsdf("data beyond its end", shape - 8, &[255; 8], "rgb offset"),
        bsdf("another type", shape - 9, &[99], "rgb type"),
        bsdf("NaN", data, &f32::NAN.to_le_bytes(), "expected a finite number, got NaN"),
        bsdf("infinity", data, &f32::INFINITY.to_le_bytes(), "expected a finite number, got inf"),
        bsdf("a control character in a name", place("bsdf/isotropic.bsdf", b"phi_i"), &[0x1b], "m.bsdf"),
        sgd("nothing", "", "0 bytes"),
        sgd("something else", seed("png/rgba8.png"), "m.csv"),
        sgd("a header alone", "material\n", "rhod_R: expected a column of that name"),
        sgd("a column too few", edited("sgd/table.csv", "theta0_B", "theta0_X"), ":1: theta0_B: expected a column"),
        sgd("a field too few", edited("sgd/table.csv", "paint,p,", "paint,"), ":3: row: expected 35 fields, got 34"),
        sgd("no number", edited("sgd/table.csv", "paint,p,0.05", "paint,p,five"), ":3: rhod_R: expected a number, got `five`"),
        sgd("NaN", edited("sgd/table.csv", "paint,p,0.05", "paint,p,nan"), ":3: "),
        sgd("infinity", edited("sgd/table.csv", "paint,p,0.05", "paint,p,inf"), ":3: "),
        sgd(
            "no roughness",
            edited("sgd/table.csv", "paint,p,0.05,0.05,0.05,0.3,0.3,0.3,0.2", "paint,p,0.05,0.05,0.05,0.3,0.3,0.3,0"),
            "alpha",
        ),
        sgd("a row that is not there", edited("sgd/table.csv", "paint", "other"), ":1: name: expected other"),
        sgd("a quote that never ends", edited("sgd/table.csv", "\"a, b\"", "\"a, b"), "m.csv"),
        sgd("bytes that are no text", b"material,\xff\n".as_slice(), "UTF-8"),
    ]
}
