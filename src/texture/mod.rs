//! Textures: texels as they are uploaded, with their mips, and the f64 twin of sampling them.
//!
//! Row 0 is the top row, at `v` = 1; coordinates repeat. Colours are linear Rec.709 once read; mips average in linear light.

mod chain;
pub mod classes;

use crate::error::{Error, Result};
use chain::{chain, encode_byte};
pub(crate) use chain::{decode_byte, for_each_cover, halved};
use glam::{DVec2, DVec4, dvec4};
use half::f16;

pub use chain::{decode_srgb, encode_srgb};
pub use classes::{Class, Classes, MAX_CLASSES, Slots};

/// The largest side of a texture, in texels.
pub const MAX_SIDE: u32 = 16_384;

/// How texels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// RGBA, 8 bits each: sRGB-encoded colour, linear opacity (always 1).
    Srgb8,
    /// RGBA, 16-bit floats: linear colour, opacity 1.
    Half4,
    /// Two 16-bit floats: x and y of a tangent-space normal.
    Half2,
    /// One 16-bit float: a roughness.
    Half1,
}

impl Format {
    /// Bytes of a texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Srgb8 | Self::Half2 => 4,
            Self::Half4 => 8,
            Self::Half1 => 2,
        }
    }

    /// Appends a texel; colours are linear.
    fn encode(self, texel: &[f32], out: &mut Vec<u8>) {
        match self {
            Self::Srgb8 => {
                out.extend(texel.iter().map(|c| encode_byte(*c)));
                out.push(255);
            }
            Self::Half4 | Self::Half2 | Self::Half1 => {
                out.extend(texel.iter().flat_map(|c| f16::from_f32(*c).to_le_bytes()));
                if self == Self::Half4 {
                    out.extend(f16::ONE.to_le_bytes());
                }
            }
        }
    }

    /// What the hardware reads, with 0 for components that are not stored and opacity 1; colours linear.
    fn decode(self, texel: &[u8]) -> DVec4 {
        if self == Self::Srgb8 {
            let channel = |i: usize| texel.get(i).map_or(0.0, |c| decode_srgb(f64::from(*c) / 255.0));
            return dvec4(channel(0), channel(1), channel(2), 1.0);
        }
        let channel = |i: usize| texel.get(2 * i..2 * i + 2).map_or(0.0, |b| f16::from_le_bytes([b[0], b[1]]).to_f64());
        dvec4(channel(0), channel(1), channel(2), 1.0)
    }
}

/// One level of a texture's mips.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    size: [u32; 2],
    texels: Vec<u8>,
}

/// A texture with its whole chain of mips.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    format: Format,
    levels: Vec<Level>,
}

impl Texture {
    /// A colour texture of sRGB-encoded texels, row by row from the top.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a side of 0 or above [`MAX_SIDE`], or another number of texels.
    pub fn colour8(size: [u32; 2], texels: &[[u8; 3]]) -> Result<Self> {
        check(size, texels.len())?;
        Ok(chain(Format::Srgb8, size, |i| texels[i].map(decode_byte)))
    }

    /// A colour texture of linear texels, row by row from the top; what a 16-bit float cannot hold, or is negative, is
    /// clamped.
    ///
    /// # Errors
    /// As [`Self::colour8`], and for values that are not finite.
    pub fn colour(size: [u32; 2], texels: &[[f32; 3]]) -> Result<Self> {
        check(size, texels.len())?;
        finite(size, texels)?;
        Ok(chain(Format::Half4, size, |i| texels[i].map(|c| c.clamp(0.0, f16::MAX.to_f32()))))
    }

    /// A texture of unit tangent-space normals, x towards growing `u` and y towards growing `v`, row by row from the top. Only
    /// x and y are kept, of which mips hold the averages.
    ///
    /// # Errors
    /// As [`Self::colour`], and for normals whose length is off by more than 1 %.
    pub fn normals(size: [u32; 2], texels: &[[f32; 3]]) -> Result<Self> {
        check(size, texels.len())?;
        finite(size, texels)?;
        let length = |n: &[f32; 3]| n.iter().map(|c| c * c).sum::<f32>().sqrt();
        if let Some(at) = texels.iter().position(|n| (length(n) - 1.0).abs() > 0.01) {
            return Err(Error::invalid(place(size, at), "a normal of length 1", length(&texels[at])));
        }
        Ok(chain(Format::Half2, size, |i| [texels[i][0], texels[i][1]]))
    }

    /// A texture of single values, row by row from the top; what a 16-bit float cannot hold is clamped.
    ///
    /// # Errors
    /// As [`Self::colour`].
    pub fn scalar(size: [u32; 2], texels: &[f32]) -> Result<Self> {
        check(size, texels.len())?;
        finite(size, texels.iter().map(std::slice::from_ref))?;
        Ok(chain(Format::Half1, size, |i| [texels[i].clamp(f16::MIN.to_f32(), f16::MAX.to_f32())]))
    }

    /// How texels are stored.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Width and height of level 0, in texels.
    pub fn size(&self) -> [u32; 2] {
        self.levels[0].size
    }

    /// The number of levels: down to 1x1, each side half of the one before, rounded down.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Size and texels of level `i`, or of the last if there are not that many, as uploaded: row 0 is the top, at `v` = 1.
    pub fn level(&self, i: usize) -> ([u32; 2], &[u8]) {
        let Level { size, texels } = &self.levels[i.min(self.levels.len() - 1)];
        (*size, texels)
    }

    /// Level 0 alone.
    #[cfg(feature = "offline")]
    pub(crate) fn base(&self) -> Self {
        Self { format: self.format, levels: self.levels.iter().take(1).cloned().collect() }
    }

    /// Bytes of all levels.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|l| l.texels.len() as u64).sum()
    }

    /// The f64 twin of a sampler with linear filters within and between levels and repeat addressing, at the stored texels.
    /// `v` grows upwards. Components that are not stored are 0; the last is 1.
    pub fn sample(&self, uv: DVec2, lod: f64) -> DVec4 {
        let last = self.levels.len() - 1;
        let lod = lod.clamp(0.0, last as f64);
        let level = lod as usize;
        let near = self.bilinear(level, uv);
        if lod.fract() > 0.0 { near.lerp(self.bilinear((level + 1).min(last), uv), lod.fract()) } else { near }
    }

    fn bilinear(&self, level: usize, uv: DVec2) -> DVec4 {
        let Level { size, texels } = &self.levels[level];
        let bytes = self.format.bytes();
        bilinear(*size, uv, |i| self.format.decode(&texels[i * bytes..(i + 1) * bytes]))
    }

    /// Its level 0 at another size, bilinear, with mips of its own.
    fn resampled(&self, size: [u32; 2]) -> Self {
        let texel = |i: usize| {
            let (x, y) = (i % size[0] as usize, i / size[0] as usize);
            let u = (x as f64 + 0.5) / f64::from(size[0]);
            let v = 1.0 - (y as f64 + 0.5) / f64::from(size[1]);
            self.bilinear(0, DVec2::new(u, v)).as_vec4().to_array()
        };
        match self.format {
            Format::Srgb8 | Format::Half4 => chain(self.format, size, |i| {
                let [r, g, b, _] = texel(i);
                [r, g, b]
            }),
            Format::Half2 => chain(self.format, size, |i| [texel(i)[0], texel(i)[1]]),
            Format::Half1 => chain(self.format, size, |i| [texel(i)[0]]),
        }
    }
}

/// Between the four of `size` texels, numbered row by row from the top, next to `uv`; `v` grows upwards.
pub(crate) fn bilinear<T>(size: [u32; 2], uv: DVec2, texel: impl Fn(usize) -> T) -> T
where
    T: std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let (x, along_x) = axis(uv.x, size[0]);
    let (y, along_y) = axis(1.0 - uv.y, size[1]);
    let at = |x: u32, y: u32| texel(y as usize * size[0] as usize + x as usize);
    let row = |y| at(x[0], y) * (1.0 - along_x) + at(x[1], y) * along_x;
    row(y[0]) * (1.0 - along_y) + row(y[1]) * along_y
}

/// The two texels next to `unit` on a repeating axis, and the weight of the second.
fn axis(unit: f64, side: u32) -> ([u32; 2], f64) {
    let side = f64::from(side);
    let at = (unit - unit.floor()) * side - 0.5;
    let first = at.floor();
    ([first, first + 1.0].map(|t| t.rem_euclid(side) as u32), at - first)
}

/// Sides within limits and a texel for each.
pub(crate) fn check([width, height]: [u32; 2], texels: usize) -> Result<()> {
    if !((1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height)) {
        let expected = format!("1x1 to {MAX_SIDE}x{MAX_SIDE}");
        return Err(Error::invalid("texture size", expected, format!("{width}x{height}")));
    }
    let expected = width as usize * height as usize;
    if texels == expected { Ok(()) } else { Err(Error::invalid("texture", format!("{expected} texels"), texels)) }
}

pub(crate) fn finite(size: [u32; 2], texels: impl IntoIterator<Item = impl AsRef<[f32]>>) -> Result<()> {
    for (at, texel) in texels.into_iter().enumerate() {
        if let Some(value) = texel.as_ref().iter().find(|c| !c.is_finite()) {
            return Err(Error::invalid(place(size, at), "finite values", value));
        }
    }
    Ok(())
}

/// Name of a texel, counted from the top left.
fn place(size: [u32; 2], at: usize) -> String {
    let width = size[0] as usize;
    format!("texel ({}, {})", at % width, at / width)
}
