//! Images and numbered sequences from files.

use crate::offline::error::{At, Error, Result};
use crate::offline::metrics::Picture;
use crate::offline::metrics::display::decode;
use exr::prelude::{ReadChannels, ReadLayers};
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
        frames.masks.push(image.mask(&file, mask)?);
        frames.pictures.push(image.picture(&file)?);
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

/// Planar channels; those of other layers than the image itself are called `layer.channel`.
struct Planes {
    width: u32,
    height: u32,
    channels: Vec<(String, Vec<f32>)>,
}

impl Planes {
    fn channel(&self, path: &Path, name: &str) -> Result<&[f32]> {
        let found = self.channels.iter().find(|(n, _)| n == name).map(|(_, samples)| samples.as_slice());
        found.ok_or_else(|| Error::file(path, At::File, format!("channel {name}"), "one of that name", self.names()))
    }

    fn names(&self) -> String {
        self.channels.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
    }

    fn picture(&self, path: &Path) -> Result<Picture> {
        let [r, g, b] = [self.channel(path, "R")?, self.channel(path, "G")?, self.channel(path, "B")?];
        let rgb: Vec<[f32; 3]> = r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect();
        self.check(path, "radiance", |i| rgb.get(i).is_some_and(|p| p.iter().all(|v| v.is_finite())))?;
        Ok(Picture { width: self.width, height: self.height, rgb })
    }

    fn mask(&self, path: &Path, mask: Mask) -> Result<Vec<bool>> {
        let of_layer = |name: &str, layer: &str| {
            name == layer || name.strip_prefix(layer).is_some_and(|rest| rest.starts_with('.') && !rest[1..].contains('.'))
        };
        let count = self.width as usize * self.height as usize;
        let layer = match mask {
            Mask::All => return Ok(vec![true; count]),
            Mask::Alpha if !self.channels.iter().any(|(name, _)| name == "A") => return Ok(vec![true; count]),
            Mask::Alpha => "A",
            Mask::Layer(layer) => layer,
        };
        let planes: Vec<&Vec<f32>> = self.channels.iter().filter(|(name, _)| of_layer(name, layer)).map(|(_, s)| s).collect();
        if planes.is_empty() {
            return Err(Error::file(path, At::File, format!("layer {layer}"), "one of that name", self.names()));
        }
        let any = |i: usize, test: fn(&f32) -> bool| planes.iter().any(|samples| samples.get(i).is_some_and(test));
        self.check(path, layer, |i| !any(i, |v| v.is_nan()))?;
        Ok((0..count).map(|i| any(i, |v| *v > 0.0)).collect())
    }

    /// Counts the pixels that are not `good` and names the first.
    fn check(&self, path: &Path, what: &str, good: impl Fn(usize) -> bool) -> Result<()> {
        let width = self.width as usize;
        let mut bad = (0..width * self.height as usize).filter(|i| !good(*i));
        match bad.next() {
            None => Ok(()),
            Some(first) => {
                let got =
                    format!("NaN or infinity in {} pixels, first at ({}, {})", 1 + bad.count(), first % width, first / width);
                Err(Error::file(path, At::File, what, "finite values", got))
            }
        }
    }
}

/// The one place that reads image files.
fn load(path: &Path) -> Result<Planes> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "exr" => load_exr(path),
        "png" | "hdr" => load_image(path, extension == "png"),
        _ => Err(Error::file(path, At::File, "format", ".exr, .hdr or .png", format!(".{extension}"))),
    }
}

fn load_exr(path: &Path) -> Result<Planes> {
    let malformed = |got: String| Error::file(path, At::File, "EXR", "a readable OpenEXR image", got);
    let file = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let file = file.from_file(path).map_err(|e| malformed(e.to_string()))?;
    let size = file.layer_data.first().map(|layer| layer.size).ok_or_else(|| malformed("no part".into()))?;
    let mut channels = Vec::new();
    for layer in &file.layer_data {
        if layer.size != size {
            return Err(malformed("parts of different sizes".into()));
        }
        for channel in &layer.channel_data.list {
            // The parts of a layered file are named; a lone part is the image itself.
            let layer_name = layer.attributes.layer_name.as_ref().filter(|_| file.layer_data.len() > 1);
            let name = layer_name.map_or(channel.name.to_string(), |layer| format!("{layer}.{}", channel.name));
            let samples: Vec<f32> = channel.sample_data.values_as_f32().collect();
            if samples.len() != size.area() {
                return Err(malformed(format!("sub-sampled channel {name}")));
            }
            channels.push((name, samples));
        }
    }
    let [width, height] = [size.width(), size.height()].map(|n| u32::try_from(n).map_err(|e| malformed(e.to_string())));
    Ok(Planes { width: width?, height: height?, channels })
}

fn load_image(path: &Path, encoded: bool) -> Result<Planes> {
    let malformed =
        |e: &dyn ToString| Error::file(path, At::File, "image", "a readable PNG or Radiance HDR image", e.to_string());
    let reader = image::ImageReader::open(path).map_err(|e| malformed(&e))?.with_guessed_format().map_err(|e| malformed(&e))?;
    let file = reader.decode().map_err(|e| malformed(&e))?;
    let has_alpha = file.color().has_alpha();
    let (width, height) = (file.width(), file.height());
    let pixels = file.into_rgba32f();
    let colour = |v: f32| if encoded { decode(v.into()) as f32 } else { v };
    let plane = |c: usize| pixels.pixels().filter_map(move |p| p.0.get(c).copied());
    let mut channels: Vec<(String, Vec<f32>)> =
        [("R", 0), ("G", 1), ("B", 2)].map(|(name, c)| (name.into(), plane(c).map(colour).collect())).into();
    if has_alpha {
        channels.push(("A".into(), plane(3).collect()));
    }
    Ok(Planes { width, height, channels })
}
