//! Image files to texels.

use crate::offline::error::{At, Error, Result};
use crate::offline::texture::{EXTENSIONS, Image, Samples};
use crate::offline::{image_io, input};
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::{ColorType, DynamicImage, ImageDecoder, ImageError};
use std::io::Cursor;
use std::path::Path;

/// What deflate makes of a byte at most.
const DEFLATE: u64 = 1032;

/// Pixels that a byte of JPEG can stand for: a block of 64 takes a bit at least.
const JPEG: u64 = 512;

/// What PNG files begin with.
const PNG_MARK: &[u8] = b"\x89PNG\r\n\x1a\n";

impl Image {
    /// Reads a PNG or JPEG (whichever it is), EXR (`R G B` or `Y`) or Radiance HDR file.
    ///
    /// # Errors
    /// [`Error::File`] if it is unreadable, malformed, larger than 16384 x 16384 or than its bytes could hold;
    /// [`Error::Argument`] for another extension.
    pub fn read(path: &Path) -> Result<Self> {
        match input::extension(path).as_str() {
            "exr" => {
                let (width, height, texels) = image_io::read_exr_rgb(path, [input::MAX_SIDE; 2])?;
                Ok(Self { path: path.into(), size: [width, height], samples: Samples::Float(texels) })
            }
            "hdr" => {
                let image = image_io::read_hdr(path)?;
                let texels = image.rgb().unwrap_or_default();
                Ok(Self { path: path.into(), size: [image.width, image.height], samples: Samples::Float(texels) })
            }
            "png" | "jpg" | "jpeg" => Self::decode(path, "image", &input::read(path)?),
            other => {
                let expected = format!("a name that ends in .{}", EXTENSIONS.join(", ."));
                Err(Error::argument("texture", expected, format!("`.{other}`")))
            }
        }
    }

    /// Decodes the PNG or JPEG `bytes`, which are the entry `field` of the file `path`.
    ///
    /// # Errors
    /// [`Error::File`] as for [`Self::read`].
    pub(crate) fn decode(path: &Path, field: &str, bytes: &[u8]) -> Result<Self> {
        let malformed =
            |e: ImageError| Error::file(path, At::File, field, "a well-formed PNG or JPEG image", format!("{e:.200}"));
        if bytes.starts_with(PNG_MARK) {
            let decoder = PngDecoder::new(Cursor::new(bytes)).map_err(malformed)?;
            let bits = u64::from(decoder.original_color_type().bits_per_pixel());
            pixels(path, field, bytes, decoder, |count| count.saturating_mul(bits) / 8 / DEFLATE)
        } else {
            let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(malformed)?;
            pixels(path, field, bytes, decoder, |count| count / JPEG)
        }
    }
}

/// Decodes what is not larger than `least` says that the file must be for a number of pixels.
fn pixels(path: &Path, field: &str, bytes: &[u8], decoder: impl ImageDecoder, least: impl Fn(u64) -> u64) -> Result<Image> {
    let (width, height) = decoder.dimensions();
    input::check_size(path, [width.into(), height.into()], [input::MAX_SIDE; 2])?;
    let least = least(u64::from(width) * u64::from(height));
    if (bytes.len() as u64) < least {
        let expected = format!("at least {least} bytes for {width}x{height}");
        return Err(Error::file(path, At::File, field, expected, format!("{} bytes", bytes.len())));
    }
    let deep = matches!(decoder.color_type(), ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16);
    let malformed = |e: ImageError| Error::file(path, At::File, field, "a well-formed PNG or JPEG image", format!("{e:.200}"));
    // The JPEG decoder panics on some malformed files.
    let decoded = input::caught(|| DynamicImage::from_decoder(decoder));
    let panicked = || Error::file(path, At::File, field, "a well-formed PNG or JPEG image", "one that cannot be decoded");
    let decoded = decoded.ok_or_else(panicked)?.map_err(malformed)?;
    let samples =
        if deep { Samples::Bits16(decoded.into_rgb16().into_raw()) } else { Samples::Bits8(decoded.into_rgb8().into_raw()) };
    Ok(Image { path: path.into(), size: [width, height], samples })
}
