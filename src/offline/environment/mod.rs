//! Environment maps from files.

use crate::offline::error::{At, Error, Result};
use crate::offline::{image_io, input};
use crate::sampling::LatLong;
use std::path::Path;

pub(crate) mod skies;

/// The largest map that is accepted.
const MAX: [u64; 2] = [16_384, 8_192];

/// As the renderer's `record_environment`, which knows no texel.
const MAX_RADIANCE: f32 = 1e30;

/// Reads a lat-long map: EXR (channels `R G B`, or `Y` as grey, of the first part that has them; half, float or integer)
/// or Radiance HDR, chosen by extension.
///
/// Filters with negative lobes and lossy codecs leave small negative values next to bright texels in real files; negative
/// values of at most 1 % of the map's brightest value are read as 0.
///
/// # Errors
/// [`Error::File`] if the file is unreadable, malformed or larger than 16384x8192, or names the texel that is NaN,
/// infinite, above 1e30 or more negative than that; [`Error::Argument`] for another extension.
pub fn read(path: &Path) -> Result<LatLong> {
    let (width, height, mut texels) = match input::extension(path).as_str() {
        "exr" => image_io::read_exr_rgb(path, MAX)?,
        "hdr" => {
            let image = image_io::read_hdr(path)?;
            input::check_size(path, [image.width.into(), image.height.into()], MAX)?;
            let names = "R, G and B";
            let rgb = image.rgb().ok_or_else(|| Error::file(path, At::File, "HDR channels", names, "others"))?;
            (image.width, image.height, rgb)
        }
        other => return Err(Error::argument("environment map", "a name that ends in .exr or .hdr", format!("`.{other}`"))),
    };
    let brightest = texels.iter().flatten().copied().filter(|c| c.is_finite()).fold(0.0, f32::max);
    let bad = |c: &f32| !c.is_finite() || *c > MAX_RADIANCE || *c < -0.01 * brightest;
    if let Some((i, texel)) = texels.iter().enumerate().find(|(_, t)| t.iter().any(bad)) {
        let field = format!("texel ({}, {})", i % width.max(1) as usize, i / width.max(1) as usize);
        return Err(Error::file(path, At::File, field, "finite radiance from 0 to 1e30", format!("{texel:?}")));
    }
    for channel in texels.iter_mut().flatten() {
        *channel = channel.max(0.0);
    }
    LatLong::new(width, height, texels).map_err(|e| Error::file(path, At::File, "environment map", "a lat-long map", e))
}
