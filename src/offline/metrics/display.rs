//! Differences as displayed: exposed, clamped to [0, 1] and sRGB-encoded.

use crate::error::{Error, Result};
use crate::offline::metrics::{Pair, Picture};

/// The factor on both images before they are displayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// 0.3 over the reference's mean masked luminance (1 if that is not positive).
    Auto,
    /// A fixed factor.
    Factor(f64),
}

impl Exposure {
    /// The factor, given the reference's mean masked luminance.
    pub fn factor(self, mean_luminance: f64) -> f64 {
        match self {
            Self::Factor(factor) => factor,
            Self::Auto => Some(0.3 / mean_luminance).filter(|f| f.is_finite() && *f > 0.0).unwrap_or(1.0),
        }
    }
}

/// FLIP's error of every pixel, 0 to 1, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Errors.
    pub values: Vec<f32>,
}

impl FlipMap {
    /// The map in FLIP's magma colours: row-major RGB bytes, sRGB-encoded.
    pub fn magma(&self) -> Vec<u8> {
        let map = nv_flip::FlipImageFloat::with_data(self.width, self.height, &self.values);
        map.apply_color_lut(&nv_flip::magma_lut()).to_vec()
    }
}

/// Both display images of a pair: sRGB-encoded values in [0, 1].
pub struct Shown {
    pub a: Vec<[f32; 3]>,
    pub b: Vec<[f32; 3]>,
}

impl Shown {
    pub fn new(pair: &Pair, exposure: f64) -> Self {
        let show = |picture: &Picture| picture.rgb.iter().map(|p| p.map(|v| encode(f64::from(v) * exposure) as f32)).collect();
        Self { a: show(pair.a), b: show(pair.b) }
    }
}

/// The sRGB transfer curve (IEC 61966-2-1) of a linear value, clamped to [0, 1].
pub fn encode(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`encode`] for values in [0, 1].
pub fn decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// What [`measure`] finds; see [`crate::offline::metrics::Metrics`].
pub struct Display {
    pub psnr: f64,
    pub flip: f64,
    pub flip_p99: f64,
    pub color_error: f64,
    /// The error map with the largest masked mean.
    pub worst: FlipMap,
}

/// Over the `pixels` masked pixels of all frames. FLIP sees whole images; its map is averaged over the mask.
///
/// # Errors
/// [`Error::InvalidInput`] without frames.
pub fn measure(pairs: &[Pair], shown: &[Shown], pixels: usize) -> Result<Display> {
    let (mut error, mut distance) = (0.0, 0.0);
    let mut flips = Vec::with_capacity(pixels);
    let mut worst: Option<(f64, FlipMap)> = None;
    for (pair, shown) in pairs.iter().zip(shown) {
        let both = shown.a.iter().zip(&shown.b).zip(pair.mask).filter(|(_, masked)| **masked);
        for ((a, b), _) in both {
            let squared: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
            error += squared;
            distance += (squared / 3.0).sqrt();
        }
        let map = flip(pair.b, shown);
        let before = flips.len();
        flips.extend(map.values.iter().zip(pair.mask).filter(|(_, masked)| **masked).map(|(v, _)| *v));
        let of_frame = flips.get(before..).unwrap_or(&[]);
        let mean = of_frame.iter().map(|v| f64::from(*v)).sum::<f64>() / of_frame.len().max(1) as f64;
        if worst.as_ref().is_none_or(|(largest, _)| mean > *largest) {
            worst = Some((mean, map));
        }
    }
    let (_, worst) = worst.ok_or_else(|| Error::invalid("frames", "at least one", 0))?;
    let count = pixels as f64;
    let flip = flips.iter().map(|v| f64::from(*v)).sum::<f64>() / count;
    flips.sort_by(f32::total_cmp);
    // The smallest value that 99 % of the pixels do not exceed.
    let rank = (0.99 * count).ceil().max(1.0) as usize - 1;
    Ok(Display {
        psnr: -10.0 * (error / (3.0 * count)).log10(),
        flip,
        flip_p99: flips.get(rank).copied().unwrap_or(0.0).into(),
        color_error: distance / count,
        worst,
    })
}

fn flip(size: &Picture, shown: &Shown) -> FlipMap {
    let bytes = |image: &[[f32; 3]]| image.iter().flatten().map(|v| (v * 255.0).round() as u8).collect::<Vec<u8>>();
    let image = |rgb: &[[f32; 3]]| nv_flip::FlipImageRgb8::with_data(size.width, size.height, &bytes(rgb));
    let map = nv_flip::flip(image(&shown.b), image(&shown.a), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    FlipMap { width: size.width, height: size.height, values: map.to_vec() }
}
