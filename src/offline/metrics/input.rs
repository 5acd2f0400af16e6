//! Images and numbered sequences from files.

use crate::offline::error::{At, Error, Result};
use crate::offline::image_io::{LinearImage, Png, PngSamples, read_image, read_png};
use crate::offline::input;
use crate::offline::metrics::Picture;
use crate::offline::metrics::display::decode;
use std::path::{Path, PathBuf};

/// One image, or the frames of a sequence in the order of their numbers.
#[derive(Clone, Debug)]
pub struct Frames {
    /// Whether it was named by a pattern.
    pub sequence: bool,
    /// Number of each frame, 0 for a single image.
    pub numbers: Vec<u64>,
    /// The images.
    pub pictures: Vec<Picture>,
    /// The masks, as [`read_frames`] was asked for.
    pub masks: Vec<Vec<bool>>,
}

/// Which pixels count.
#[derive(Clone, Copy, Debug)]
pub enum Mask<'a> {
    /// All of them.
    All,
    /// Those with alpha above 0; all if there is no alpha.
    Alpha,
    /// Those where a channel of this EXR layer is above 0.
    Layer(&'a str),
}

/// Reads `.exr`, `.hdr` and `.png` (decoded from sRGB) as linear radiance. A run of `#` in the file name makes a sequence: it
/// stands for the frame number, padded with zeros to at least that many digits.
///
/// # Errors
/// [`Error::File`] for a file that is unreadable, malformed, of unknown format, without the mask's layer or with a value
/// that is not finite, and for a pattern that matches nothing.
pub fn read_frames(path: &Path, mask: Mask) -> Result<Frames> {
    // A file may have `#` in its name.
    let pattern = pattern(path).filter(|_| !path.exists());
    let sequence = pattern.is_some();
    let files = pattern.map_or_else(|| Ok(vec![(0, path.to_path_buf())]), |pattern| pattern.files(path))?;
    let mut frames = Frames { sequence, numbers: vec![], pictures: vec![], masks: vec![] };
    for (number, file) in files {
        let image = load(&file)?;
        frames.numbers.push(number);
        frames.masks.push(mask_of(&file, &image, mask)?);
        frames.pictures.push(picture(&file, &image)?);
    }
    Ok(frames)
}

/// What stands before and after a run of `#`.
struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

fn pattern(path: &Path) -> Option<Pattern> {
    let name = path.file_name()?.to_str()?;
    let (before, rest) = name.split_once('#')?;
    let after = rest.trim_start_matches('#');
    Some(Pattern { before: before.into(), digits: 1 + rest.len() - after.len(), after: after.into() })
}

impl Pattern {
    fn files(&self, path: &Path) -> Result<Vec<(u64, PathBuf)>> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let unreadable = |e| Error::file(folder, At::File, "folder", "a readable folder", e);
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(unreadable)? {
            let name = entry.map_err(unreadable)?.file_name();
            if let Some(number) = name.to_str().and_then(|name| self.number(name)) {
                files.push((number, folder.join(name)));
            }
        }
        if files.is_empty() {
            return Err(Error::file(path, At::File, "sequence", "at least one file that matches the pattern", "none"));
        }
        files.sort();
        Ok(files)
    }

    fn number(&self, name: &str) -> Option<u64> {
        let digits = name.strip_prefix(&self.before)?.strip_suffix(&self.after)?;
        // Longer numbers have outgrown their padding.
        let padded = digits.len() == self.digits || (digits.len() > self.digits && !digits.starts_with('0'));
        if padded && digits.bytes().all(|b| b.is_ascii_digit()) { digits.parse().ok() } else { None }
    }
}

/// Reads any of the formats; a PNG is decoded from sRGB.
fn load(path: &Path) -> Result<LinearImage> {
    match input::extension(path).as_str() {
        "exr" | "hdr" => read_image(path),
        "png" => Ok(linear(&read_png(path)?)),
        other => Err(Error::file(path, At::File, "format", ".exr, .hdr or .png", format!(".{other}"))),
    }
}

/// The PNG's linear `R G B`, and `A` if it has it.
fn linear(png: &Png) -> LinearImage {
    let samples: Vec<f64> = match &png.samples {
        PngSamples::Bits8(samples) => samples.iter().map(|v| f64::from(*v) / 255.0).collect(),
        PngSamples::Bits16(samples) => samples.iter().map(|v| f64::from(*v) / 65535.0).collect(),
    };
    let count = usize::from(png.channels);
    let (colours, alpha) = (if count < 3 { 1 } else { 3 }, count.is_multiple_of(2));
    let plane = |c: usize| samples.iter().skip(c).step_by(count.max(1)).copied();
    let colour = |c: usize| plane(c % colours).map(|v| decode(v) as f32).collect();
    let mut channels: Vec<_> = ["R", "G", "B"].iter().enumerate().map(|(c, name)| (name.to_string(), colour(c))).collect();
    channels.extend(alpha.then(|| ("A".to_string(), plane(colours).map(|v| v as f32).collect())));
    LinearImage { width: png.width, height: png.height, channels }
}

fn names(image: &LinearImage) -> String {
    image.channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
}

fn picture(path: &Path, image: &LinearImage) -> Result<Picture> {
    let missing = || Error::file(path, At::File, "channels", "R, G and B", names(image));
    let rgb = image.rgb().ok_or_else(missing)?;
    check(path, image, "radiance", |i| rgb.get(i).is_some_and(|p| p.iter().all(|v| v.is_finite())))?;
    Ok(Picture { width: image.width, height: image.height, rgb })
}

fn mask_of(path: &Path, image: &LinearImage, mask: Mask) -> Result<Vec<bool>> {
    let of_layer = |name: &str, layer: &str| {
        name == layer || name.strip_prefix(layer).is_some_and(|rest| rest.starts_with('.') && !rest[1..].contains('.'))
    };
    let count = image.width as usize * image.height as usize;
    let layer = match mask {
        Mask::All => return Ok(vec![true; count]),
        Mask::Alpha if image.channel("A").is_none() => return Ok(vec![true; count]),
        Mask::Alpha => "A",
        Mask::Layer(layer) => layer,
    };
    let planes: Vec<&Vec<f32>> = image.channels.iter().filter(|(name, _)| of_layer(name, layer)).map(|(_, s)| s).collect();
    if planes.is_empty() {
        return Err(Error::file(path, At::File, format!("layer {layer}"), "one of that name", names(image)));
    }
    let any = |i: usize, test: fn(&f32) -> bool| planes.iter().any(|samples| samples.get(i).is_some_and(test));
    check(path, image, layer, |i| !any(i, |v| v.is_nan()))?;
    Ok((0..count).map(|i| any(i, |v| *v > 0.0)).collect())
}

/// Counts the pixels that are not `good` and names the first.
fn check(path: &Path, image: &LinearImage, what: &str, good: impl Fn(usize) -> bool) -> Result<()> {
    let width = image.width as usize;
    let mut bad = (0..width * image.height as usize).filter(|i| !good(*i));
    match bad.next() {
        None => Ok(()),
        Some(first) => {
            let got = format!("NaN or infinity in {} pixels, first at ({}, {})", 1 + bad.count(), first % width, first / width);
            Err(Error::file(path, At::File, what, "finite values", got))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_samples_of_every_layout_become_linear() {
        let half = decode(0.5) as f32;
        let png = |channels, samples| linear(&Png { width: 1, height: 2, channels, samples });
        let grey = png(1, PngSamples::Bits8(vec![0, 255]));
        assert_eq!(grey.rgb(), Some(vec![[0.0; 3], [1.0; 3]]));
        assert_eq!(grey.channel("A"), None);
        let with_alpha = png(2, PngSamples::Bits16(vec![65535, 0, 0, 13107]));
        assert_eq!(with_alpha.rgb(), Some(vec![[1.0; 3], [0.0; 3]]));
        assert_eq!(with_alpha.channel("A"), Some([0.0, 0.2].as_slice()));
        let colour = png(3, PngSamples::Bits16(vec![65535, 0, 0, 0, 65535, 0]));
        assert_eq!(colour.rgb(), Some(vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
        let all = png(4, PngSamples::Bits8(vec![0, 0, 255, 51, 255, 0, 128, 255]));
        let rgb = all.rgb().unwrap();
        assert_eq!(rgb[0], [0.0, 0.0, 1.0]);
        assert!((rgb[1][2] - half).abs() < 2e-3 && all.channel("A") == Some([0.2, 1.0].as_slice()));
    }
}
