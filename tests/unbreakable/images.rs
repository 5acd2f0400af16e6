//! Environments and compared images: EXR, Radiance HDR, PNG.

use crate::run::Row;
use crate::seeds::{patched, place, seed, under};

/// An environment map.
fn map(what: &str, name: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    Row::new(format!("map {name}: {what}"), "render s.toml").file("s.toml", under(name)).file(name, bytes).says(&[name, says])
}

/// An image that is compared with itself.
fn image(what: &str, name: &str, bytes: impl Into<Vec<u8>>, says: &str) -> Row {
    Row::new(format!("image {name}: {what}"), &format!("compare {name} {name}")).file(name, bytes).says(&[name, says])
}

/// An HDR without its pixels.
pub fn hdr(header: &str, size: &str) -> Vec<u8> {
    format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes()
}

/// A PNG whose header claims a size.
pub fn png_of([width, height]: [u32; 2]) -> Vec<u8> {
    let mut bytes = patched("png/rgba8.png", 16, &[width.to_be_bytes(), height.to_be_bytes()].concat());
    let mut crc = flate2::Crc::new();
    crc.update(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    bytes
}

/// A whole PNG of black pixels.
pub fn black_png(width: u32, height: u32) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    image::DynamicImage::new_luma8(width, height).write_to(&mut file, image::ImageFormat::Png).unwrap();
    file.into_inner()
}

pub fn exr(width: usize, height: usize, value: f32) -> Vec<u8> {
    use exr::prelude::*;
    let mut file = std::io::Cursor::new(Vec::new());
    let channels = SpecificChannels::rgb(|_: Vec2<usize>| (value, value, value));
    Image::from_channels((width, height), channels).write().to_buffered(&mut file).unwrap();
    file.into_inner()
}

pub fn rows() -> Vec<Row> {
    // The data window's last column and row.
    let window = place("exr/zip16.exr", b"dataWindow\0box2i\0") + 17 + 4 + 8;
    let claims = |what, x: i32, y: i32, says| {
        map(what, "m.exr", patched("exr/zip16.exr", window, &[x.to_le_bytes(), y.to_le_bytes()].concat()), says)
    };
    vec![
        map("nothing", "m.exr", "", "0 bytes"),
        map("something else", "m.exr", seed("png/rgba8.png"), "EXR"),
        map("half of it", "m.exr", &seed("exr/zip16.exr")[..300], "EXR"),
        claims("the largest size that there is", i32::MAX, i32::MAX, "m.exr"),
        claims("16k by 8k in 600 bytes", 16_383, 8_191, "EXR length: expected at least"),
        claims("32k wide", 32_767, 0, "image size: expected 1x1 to 16384x8192 pixels"),
        claims("no columns", -1, 5, "m.exr"),
        claims("less than none", i32::MIN, i32::MIN, "m.exr"),
        map("NaN", "m.exr", exr(4, 2, f32::NAN), "texel (0, 0): expected finite radiance"),
        map("infinity", "m.exr", exr(4, 2, f32::INFINITY), "texel (0, 0): expected finite radiance"),
        map("darker than black", "m.exr", exr(4, 2, -1.0), "texel (0, 0): expected finite radiance"),
        map("no colours", "m.exr", exr_named("X"), "EXR channels: expected R, G and B, or Y"),
        map("one pixel", "m.exr", exr(1, 1, 1.0), "").good(3),
        map("16k wide", "m.exr", exr(16_384, 1, 1.0), "").good(3),
        map("wider than 16k", "m.exr", exr(16_385, 1, 1.0), "image size"),
        image("NaN", "m.exr", exr(4, 2, f32::NAN), "radiance: expected finite values"),
        image("nothing", "m.exr", "", "0 bytes"),
        map("nothing", "m.hdr", "", "0 bytes"),
        map("something else", "m.hdr", seed("exr/zip16.exr"), "HDR"),
        map("no pixels", "m.hdr", hdr("", "-Y 2 +X 2"), "HDR"),
        map("no size", "m.hdr", hdr("", ""), "HDR"),
        map("the largest size that there is", "m.hdr", hdr("", "-Y 4294967295 +X 4294967295"), "too large"),
        map("16k by 8k in 60 bytes", "m.hdr", hdr("", "-Y 8192 +X 16384"), "HDR length: expected at least"),
        map("half as many rows as are claimed", "m.hdr", [hdr("", "-Y 4 +X 1"), vec![1; 8]].concat(), "HDR"),
        map("an exposure of 0", "m.hdr", hdr("EXPOSURE=0\n", "-Y 1 +X 1"), "EXPOSURE"),
        map("an exposure that is no number", "m.hdr", hdr("EXPOSURE=nan\n", "-Y 1 +X 1"), "EXPOSURE"),
        map("an escape sequence as its format", "m.hdr", "#?RADIANCE\nFORMAT=\x1b[2J\n\n-Y 1 +X 1\n", "\\u{1b}[2J"),
        map(
            "brighter than anything",
            "m.hdr",
            [hdr("", "-Y 1 +X 1"), vec![255; 4]].concat(),
            "texel (0, 0): expected finite radiance",
        ),
        map("one pixel", "m.hdr", [hdr("", "-Y 1 +X 1"), vec![128, 128, 128, 129]].concat(), "").good(3),
        image("nothing", "m.png", "", "0 bytes"),
        image("something else", "m.png", seed("jpg/rgb.jpg"), "PNG"),
        image("half of it", "m.png", &seed("png/rgba8.png")[..160], "PNG"),
        image("a wrong checksum", "m.png", patched("png/rgba8.png", 29, &[0; 4]), "PNG"),
        image("the largest size that there is", "m.png", png_of([0x7fff_ffff; 2]), "m.png"),
        image("16k by 16k in 300 bytes", "m.png", png_of([16_384; 2]), "PNG length: expected at least"),
        image("no columns", "m.png", png_of([0, 7]), "m.png"),
        image("one pixel", "m.png", seed("png/grey8.png"), "").good(0),
        image("16k wide", "m.png", black_png(16_384, 1), "").good(0),
        image("wider than 16k", "m.png", black_png(16_385, 1), "image size"),
        image("a JPEG", "m.jpg", seed("jpg/rgb.jpg"), "format: expected .exr, .hdr or .png"),
        Row::new("images of different sizes", "compare a.png b.png")
            .file("a.png", black_png(2, 2))
            .file("b.png", black_png(3, 2))
            .says(&["a.png: expected 3x2 pixels"]),
    ]
}

pub fn exr_named(channel: &str) -> Vec<u8> {
    use exr::prelude::*;
    let mut file = std::io::Cursor::new(Vec::new());
    let list = AnyChannels::sort([AnyChannel::new(channel, FlatSamples::F32(vec![1.0; 8]))].into_iter().collect());
    Image::from_layer(Layer::new((4, 2), LayerAttributes::default(), Encoding::FAST_LOSSLESS, list))
        .write()
        .to_buffered(&mut file)
        .unwrap();
    file.into_inner()
}
