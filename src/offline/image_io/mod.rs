//! Image files: layered EXR, Radiance HDR and PNG. What is written appears under its name only when it is complete.

use crate::offline::error::{Error, Result};
use crate::offline::input;
use std::path::Path;

mod atomic;
mod exr_file;
mod hdr_file;
mod png_file;

pub use atomic::{check_writable, write_atomically};
pub(crate) use exr_file::read_rgb as read_exr_rgb;
pub use exr_file::{read_exr, write_exr};
pub use hdr_file::{read_hdr, write_hdr};
pub use png_file::{Png, PngSamples, read_png, write_png};

/// Planar floating-point channels of one size.
///
/// Linear radiance and coverage are `R`, `G`, `B` and `A`; a channel of another layer is `layer.channel`, such as
/// `normal.X` or `depth.Z` (a layer's only scalar channel is `Y`), which is how EXR files name the channels of one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Name and row-major samples of each channel.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl LinearImage {
    /// The samples of channel `name`, if there is one.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, samples)| samples.as_slice())
    }

    /// `R`, `G` and `B` interleaved, or `None` if one is missing.
    pub fn rgb(&self) -> Option<Vec<[f32; 3]>> {
        let (r, g, b) = (self.channel("R")?, self.channel("G")?, self.channel("B")?);
        Some(r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect())
    }

    /// That every channel has a name of its own and `width * height` samples, and that both sides are in 1 to 16384.
    ///
    /// # Errors
    /// [`Error::Argument`] names the first channel that does not.
    pub fn check(&self) -> Result<()> {
        let side = 1..=input::MAX_SIDE;
        if !side.contains(&self.width.into()) || !side.contains(&self.height.into()) {
            let expected = format!("1x1 to {0}x{0} pixels", input::MAX_SIDE);
            return Err(Error::argument("image size", expected, format!("{}x{}", self.width, self.height)));
        }
        let pixels = u64::from(self.width) * u64::from(self.height);
        let mut names = std::collections::HashSet::new();
        for (name, samples) in &self.channels {
            if name.is_empty() || !names.insert(name) {
                return Err(Error::argument("image channel", "unique names", format!("`{name}`")));
            }
            if samples.len() as u64 != pixels {
                return Err(Error::argument(format!("image channel {name}"), format!("{pixels} samples"), samples.len()));
            }
        }
        if self.channels.is_empty() {
            return Err(Error::argument("image channels", "at least one", "none"));
        }
        Ok(())
    }
}

/// Writes an image in the format of `path`'s extension: `linear` with all its layers as `.exr`, its `R G B` as `.hdr`, or
/// `display` (row-major sRGB RGBA bytes of the same size) as `.png`.
///
/// # Errors
/// [`Error::Argument`] for another extension or channels that do not fit, [`Error::Write`] if the file cannot be written.
pub fn write_image(path: &Path, linear: &LinearImage, display: &[u8]) -> Result<()> {
    match input::extension(path).as_str() {
        "exr" => write_exr(path, linear),
        "hdr" => write_hdr(path, linear),
        "png" => write_png(path, linear.width, linear.height, display),
        other => Err(Error::argument("output", "a name that ends in .exr, .png or .hdr", format!("`.{other}`"))),
    }
}

/// Reads a linear image by extension: `.exr` with all its layers or `.hdr`.
///
/// # Errors
/// [`Error::Argument`] for another extension, [`Error::File`] for a file that is not such an image.
pub fn read_image(path: &Path) -> Result<LinearImage> {
    match input::extension(path).as_str() {
        "exr" => read_exr(path),
        "hdr" => read_hdr(path),
        other => Err(Error::argument("linear image", "a name that ends in .exr or .hdr", format!("`.{other}`"))),
    }
}
