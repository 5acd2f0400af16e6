//! PNG, through the `image` crate.

use crate::offline::error::{At, Error, Result};
use crate::offline::image_io::write_atomically;
use crate::offline::input;
use image::codecs::png::{PngDecoder, PngEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder};
use std::io::Cursor;
use std::path::Path;

/// A PNG's samples as stored: no colour conversion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Png {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Interleaved channels: 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA.
    pub channels: u8,
    /// Row-major interleaved samples.
    pub samples: PngSamples,
}

/// The two sample depths; shallower files and palettes are expanded to 8 bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PngSamples {
    /// 8 bits a sample.
    Bits8(Vec<u8>),
    /// 16 bits a sample.
    Bits16(Vec<u16>),
}

/// Reads a PNG of at most 16384 x 16384 pixels.
///
/// # Errors
/// [`Error::File`] if it is unreadable, malformed or larger.
pub fn read_png(path: &Path) -> Result<Png> {
    let bytes = input::read(path)?;
    let malformed = |e: image::ImageError| Error::file(path, At::File, "PNG", "a well-formed PNG image", e);
    let decoder = PngDecoder::new(Cursor::new(&bytes)).map_err(malformed)?;
    let (width, height) = decoder.dimensions();
    input::check_size(path, [width.into(), height.into()], [input::MAX_SIDE; 2])?;
    // A palette's index of one bit becomes four bytes.
    let least = decoder.total_bytes() / 32 / input::DEFLATE_RATIO;
    if (bytes.len() as u64) < least {
        let expected = format!("at least {least} bytes for {width}x{height}");
        return Err(Error::file(path, At::File, "PNG length", expected, format!("{} bytes", bytes.len())));
    }
    let pixels = DynamicImage::from_decoder(decoder).map_err(malformed)?;
    let channels = pixels.color().channel_count();
    let samples = match pixels {
        DynamicImage::ImageLuma16(p) => PngSamples::Bits16(p.into_raw()),
        DynamicImage::ImageLumaA16(p) => PngSamples::Bits16(p.into_raw()),
        DynamicImage::ImageRgb16(p) => PngSamples::Bits16(p.into_raw()),
        DynamicImage::ImageRgba16(p) => PngSamples::Bits16(p.into_raw()),
        other => PngSamples::Bits8(other.into_bytes()),
    };
    Ok(Png { width, height, channels, samples })
}

/// Writes `rgba`: `width * height` row-major RGBA bytes that are sRGB-encoded already.
///
/// # Errors
/// [`Error::Argument`] if `rgba` has another length, [`Error::Write`] if the file cannot be written.
pub fn write_png(path: &Path, width: u32, height: u32, rgba: &[u8]) -> Result<()> {
    let side = 1..=input::MAX_SIDE;
    if !side.contains(&width.into()) || !side.contains(&height.into()) {
        let expected = format!("1x1 to {0}x{0} pixels", input::MAX_SIDE);
        return Err(Error::argument("image size", expected, format!("{width}x{height}")));
    }
    let expected = u64::from(width) * u64::from(height) * 4;
    if rgba.len() as u64 != expected {
        return Err(Error::argument("PNG samples", format!("{expected} bytes"), format!("{} bytes", rgba.len())));
    }
    write_atomically(path, |file| PngEncoder::new(file).write_image(rgba, width, height, ExtendedColorType::Rgba8))
}
