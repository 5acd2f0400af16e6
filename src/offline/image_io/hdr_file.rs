//! Radiance HDR, through the `image` crate.

use crate::offline::error::{At, Error, Result};
use crate::offline::image_io::{LinearImage, write_atomically};
use crate::offline::input;
use image::codecs::hdr::{HdrDecoder, HdrEncoder};
use image::{DynamicImage, Rgb};
use std::io::Cursor;
use std::path::Path;

/// Reads a Radiance HDR image (`-Y +X`, shared exponent) as channels `R G B`. An `EXPOSURE` in the header is undone, so
/// that the values are the scene's radiance.
///
/// # Errors
/// [`Error::File`] if it is unreadable, malformed, larger than 16384 x 16384 or larger than its bytes could hold.
pub fn read_hdr(path: &Path) -> Result<LinearImage> {
    let bytes = input::read(path)?;
    let malformed = |e: image::ImageError| Error::file(path, At::File, "HDR", "a well-formed Radiance HDR image", e);
    let decoder = HdrDecoder::new(Cursor::new(&bytes)).map_err(malformed)?;
    let header = decoder.metadata();
    input::check_size(path, [header.width.into(), header.height.into()], [input::MAX_SIDE; 2])?;
    // Every scan line holds at least one four-byte pixel. A byte of run lengths makes at most 16 pixels, one of the older kind,
    // whose runs can be chained without end, 64 as far as we go.
    let least = u64::from(header.height) * (u64::from(header.width) / 64).max(4);
    if (bytes.len() as u64) < least {
        let expected = format!("at least {least} bytes for {}x{}", header.width, header.height);
        return Err(Error::file(path, At::File, "HDR length", expected, format!("{} bytes", bytes.len())));
    }
    let exposure = header.exposure.unwrap_or(1.0);
    if !exposure.is_finite() || exposure <= 0.0 {
        return Err(Error::file(path, At::File, "EXPOSURE", "a number above 0", exposure));
    }
    let pixels = DynamicImage::from_decoder(decoder).map_err(malformed)?.into_rgb32f();
    let plane = |c: usize| pixels.pixels().map(|p| p.0[c] / exposure).collect::<Vec<_>>();
    let channels = [("R", 0), ("G", 1), ("B", 2)].map(|(name, c)| (name.to_string(), plane(c)));
    Ok(LinearImage { width: header.width, height: header.height, channels: channels.into() })
}

/// Writes channels `R G B` of `image` as Radiance HDR: 8 bits a channel with a shared exponent, negative values as 0.
///
/// # Errors
/// [`Error::Argument`] if a channel is missing or holds a value that the format cannot (NaN or above 1e38),
/// [`Error::Write`] if the file cannot be written.
pub fn write_hdr(path: &Path, image: &LinearImage) -> Result<()> {
    image.check()?;
    let rgb = image.rgb().ok_or_else(|| Error::argument("HDR channels", "R, G and B", names(image)))?;
    if let Some(bad) = rgb.iter().flatten().find(|v| v.is_nan() || **v > 1e38) {
        return Err(Error::argument("HDR sample", "a number of at most 1e38", bad));
    }
    // Below the smallest exponent of the format there is only black.
    let pixels: Vec<_> = rgb.iter().map(|p| Rgb(p.map(|v| if v < 1e-38 { 0.0 } else { v }))).collect();
    write_atomically(path, |file| HdrEncoder::new(file).encode(&pixels, image.width as usize, image.height as usize))
}

fn names(image: &LinearImage) -> String {
    image.channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
}
