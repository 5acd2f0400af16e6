//! How far one image, or one sequence, is from another: in linear radiance, as displayed, and over time.

mod display;
mod input;
mod linear;
mod temporal;

pub use display::{Exposure, FlipMap, encode};
pub use input::{Frames, Mask, read_frames};

use crate::error::{Error, Result};
use serde::Serialize;

/// A linear Rec.709 image; pixels are row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, `width * height` finite triples.
    pub rgb: Vec<[f32; 3]>,
}

/// One frame of the image under test with its reference.
#[derive(Clone, Debug)]
pub struct Pair<'a> {
    /// The image under test.
    pub a: &'a Picture,
    /// The reference.
    pub b: &'a Picture,
    /// The pixels that count, one per pixel.
    pub mask: &'a [bool],
}

/// Every metric of `passband compare`. Serialised, infinite values are null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Frames compared.
    pub frames: usize,
    /// Masked pixels over all frames.
    pub pixels: usize,
    /// Factor applied to both sides before display.
    pub exposure: f64,
    /// Root of the mean squared difference over masked pixels and channels, linear.
    pub rmse: f64,
    /// `|A - B| / |B|`, Euclidean over masked pixels and channels, linear.
    pub rel_l2: f64,
    /// Mean of `(a - b)^2 / (b^2 + 0.01 mean(B)^2)` over masked pixels and channels, linear.
    pub relmse: f64,
    /// Largest absolute difference of a channel, linear.
    pub max_abs: f64,
    /// Peak signal-to-noise ratio of the display image in dB; infinite for identical images.
    pub psnr: f64,
    /// Mean FLIP error at 67 pixels per degree, 0 to 1 (Andersson et al. 2020).
    pub flip: f64,
    /// 99th percentile of the FLIP error.
    pub flip_p99: f64,
    /// Mean Euclidean RGB distance of the display images over `sqrt(3)`, 0 to 1.
    pub color_error: f64,
    /// Sequences of at least two frames: mean `|e_k - e_(k-1)|` over mean B, with `e = A - B`, linear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flicker: Option<f64>,
    /// Sequences: ColorVideoVDP quality at 30 frames a second on a standard 4K display; 10 is indistinguishable
    /// (Mantiuk et al. 2024).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jod: Option<f64>,
}

/// Metrics with the error map of the worst frame.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The numbers.
    pub metrics: Metrics,
    /// FLIP's error map of the frame with the largest mean.
    pub map: FlipMap,
}

impl Metrics {
    /// Names that [`Metrics::get`] knows.
    pub const NAMES: [&'static str; 10] =
        ["rmse", "rel_l2", "relmse", "max_abs", "psnr", "flip", "flip_p99", "color_error", "flicker", "jod"];

    /// The metric called `name`; `None` for an unknown name and for what a still image does not have.
    pub fn get(&self, name: &str) -> Option<f64> {
        match name {
            "rmse" => Some(self.rmse),
            "rel_l2" => Some(self.rel_l2),
            "relmse" => Some(self.relmse),
            "max_abs" => Some(self.max_abs),
            "psnr" => Some(self.psnr),
            "flip" => Some(self.flip),
            "flip_p99" => Some(self.flip_p99),
            "color_error" => Some(self.color_error),
            "flicker" => self.flicker,
            "jod" => self.jod,
            _ => None,
        }
    }
}

/// Compares frame by frame; `sequence` adds [`Metrics::flicker`] and [`Metrics::jod`].
///
/// # Errors
/// [`Error::InvalidInput`] without frames, for sizes that differ, a mask without pixels, values that are not finite, or (in a
/// sequence) images smaller than 4x4.
pub fn compare(pairs: &[Pair], exposure: Exposure, sequence: bool) -> Result<Comparison> {
    let first = pairs.first().ok_or_else(|| Error::invalid("frames", "at least one", 0))?;
    for (k, pair) in pairs.iter().enumerate() {
        check(k, pair, first)?;
    }
    let pixels = pairs.iter().map(|p| p.mask.iter().filter(|m| **m).count()).sum();
    if pixels == 0 {
        return Err(Error::invalid("mask", "at least one pixel above 0", "none"));
    }
    let linear = linear::measure(pairs, pixels);
    let exposure = exposure.factor(linear.mean_luminance);
    let shown: Vec<display::Shown> = pairs.iter().map(|pair| display::Shown::new(pair, exposure)).collect();
    let display = display::measure(pairs, &shown, pixels)?;
    let metrics = Metrics {
        frames: pairs.len(),
        pixels,
        exposure,
        rmse: linear.rmse,
        rel_l2: linear.rel_l2,
        relmse: linear.relmse,
        max_abs: linear.max_abs,
        psnr: display.psnr,
        flip: display.flip,
        flip_p99: display.flip_p99,
        color_error: display.color_error,
        flicker: if sequence { temporal::flicker(pairs, linear.mean) } else { None },
        jod: if sequence { Some(temporal::jod(pairs, &shown)?) } else { None },
    };
    Ok(Comparison { metrics, map: display.worst })
}

/// [`Metrics::flicker`] alone; 0 for fewer than two frames.
///
/// # Errors
/// As [`compare`].
pub fn flicker(pairs: &[Pair]) -> Result<f64> {
    let first = pairs.first().ok_or_else(|| Error::invalid("frames", "at least one", 0))?;
    pairs.iter().enumerate().try_for_each(|(k, pair)| check(k, pair, first))?;
    let pixels: usize = pairs.iter().map(|p| p.mask.iter().filter(|m| **m).count()).sum();
    if pixels == 0 {
        return Err(Error::invalid("mask", "at least one pixel above 0", "none"));
    }
    Ok(temporal::flicker(pairs, linear::measure(pairs, pixels).mean).unwrap_or_default())
}

fn check(k: usize, pair: &Pair, first: &Pair) -> Result<()> {
    let size = |p: &Picture| format!("{}x{}", p.width, p.height);
    for picture in [pair.a, pair.b] {
        if (picture.width, picture.height) != (first.b.width, first.b.height) {
            return Err(Error::invalid(format!("size of frame {k}"), size(first.b), size(picture)));
        }
        let count = u64::from(picture.width) * u64::from(picture.height);
        if picture.rgb.len() as u64 != count || pair.mask.len() as u64 != count {
            return Err(Error::invalid(format!("pixels of frame {k}"), count.to_string(), picture.rgb.len()));
        }
        if let Some(at) = picture.rgb.iter().flatten().position(|v| !v.is_finite()) {
            return Err(Error::invalid(format!("pixel {} of frame {k}", at / 3), "finite radiance", "NaN or infinity"));
        }
    }
    Ok(())
}

/// The masked pixels of a pair as f64.
fn masked<'a>(pair: &'a Pair) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + 'a {
    let both = pair.a.rgb.iter().zip(&pair.b.rgb).zip(pair.mask);
    both.filter(|(_, masked)| **masked).map(|((a, b), _)| (a.map(f64::from), b.map(f64::from)))
}

/// `x / y`, with zero over zero counting as zero.
fn ratio(x: f64, y: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x / y }
}
