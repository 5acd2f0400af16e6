//! Textures from image files, and what their values mean: colours, normals, roughness, heights.

mod decode;
mod formulas;
mod heights;
mod noise;
mod reliefs;
mod surfaces;

use crate::offline::error::{At, Error, Result};
use crate::texture::{Texture, decode_byte, decode_srgb};
use glam::{DVec2, DVec3, Vec3};
use std::path::{Path, PathBuf};

pub use formulas::{COLOURS, CONCENTRATIONS, MAPS, NORMALS, Part};
pub use heights::Heights;

/// Extensions of the files that [`Image::read`] reads.
pub const EXTENSIONS: [&str; 5] = ["png", "jpg", "jpeg", "exr", "hdr"];

/// How a normal map stores components from -1 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// Integer images are [`Self::Unit`]; floating-point images [`Self::Signed`] if any x or y is negative, else `Unit`.
    Auto,
    /// From 0 to 1.
    Unit,
    /// As they are.
    Signed,
}

/// What stands in a file, red, green and blue for each texel; grey is in all three, opacity is dropped.
#[derive(Clone, Debug)]
enum Samples {
    Bits8(Vec<u8>),
    Bits16(Vec<u16>),
    Float(Vec<[f32; 3]>),
}

/// A decoded image of at most 16384 texels a side.
#[derive(Clone, Debug)]
pub struct Image {
    path: PathBuf,
    size: [u32; 2],
    samples: Samples,
}

impl Image {
    /// Width and height in texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The texel `i`, counted row by row from the top, as stored: integers over their greatest value.
    pub(crate) fn raw(&self, i: usize) -> Vec3 {
        match &self.samples {
            Samples::Bits8(all) => Vec3::from(triple(all, i).map(f32::from)) / 255.0,
            Samples::Bits16(all) => Vec3::from(triple(all, i).map(f32::from)) / 65_535.0,
            Samples::Float(all) => all.get(i).copied().unwrap_or_default().into(),
        }
    }

    /// The texel `i` as linear colour: integers are sRGB-encoded.
    pub(crate) fn linear(&self, i: usize) -> Vec3 {
        match &self.samples {
            Samples::Bits8(all) => triple(all, i).map(decode_byte).into(),
            Samples::Bits16(_) => self.raw(i).as_dvec3().map(decode_srgb).as_vec3(),
            Samples::Float(_) => self.raw(i),
        }
    }

    /// `texel` between texel centres at `uv`, bilinear, repeating; `v` grows upwards.
    pub(crate) fn bilinear(&self, uv: DVec2, texel: impl Fn(usize) -> Vec3) -> DVec3 {
        crate::texture::bilinear(self.size, uv, |i| texel(i).as_dvec3())
    }

    fn count(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// A colour texture: integer images are sRGB-encoded (8 bits stay so), floating-point ones are linear; below 0 counts as 0.
    ///
    /// # Errors
    /// [`Error::File`] names the texel that is not finite.
    pub fn colour(&self) -> Result<Texture> {
        let made = match &self.samples {
            Samples::Bits8(all) => Texture::colour8(self.size, all.as_chunks::<3>().0),
            Samples::Bits16(_) => {
                let texels: Vec<_> = (0..self.count()).map(|i| self.linear(i).to_array()).collect();
                Texture::colour(self.size, &texels)
            }
            Samples::Float(all) => {
                // Filters leave such values behind, and light below 0 is none. What is not finite stays, to be refused.
                let texels: Vec<_> =
                    all.iter().map(|texel| texel.map(|c| if c < 0.0 && c.is_finite() { 0.0 } else { c })).collect();
                Texture::colour(self.size, &texels)
            }
        };
        made.map_err(|e| self.refused(e))
    }

    /// A normal map: components decoded by `encoding`, y turned round unless `up` (green towards the image's top), x and y
    /// scaled, and the whole made a unit vector. What does not face up is laid flat into the surface's plane; what has no
    /// length is the surface's own normal.
    ///
    /// # Errors
    /// [`Error::File`] names the texel that is not finite.
    pub fn normals(&self, encoding: Encoding, up: bool, scale: f32) -> Result<Texture> {
        let negative = |all: &Vec<[f32; 3]>| all.iter().any(|[x, y, _]| *x < 0.0 || *y < 0.0);
        let signed = match (encoding, &self.samples) {
            (Encoding::Signed, _) => true,
            (Encoding::Auto, Samples::Float(all)) => negative(all),
            (Encoding::Auto | Encoding::Unit, _) => false,
        };
        let factor = Vec3::new(scale, if up { scale } else { -scale }, 1.0);
        let normal = |i| {
            let raw = self.raw(i);
            let n = factor * if signed { raw } else { 2.0 * raw - Vec3::ONE };
            if raw.is_finite() { unit(n.truncate().extend(n.z.max(0.0))) } else { raw.to_array() }
        };
        let texels: Vec<_> = (0..self.count()).map(normal).collect();
        Texture::normals(self.size, &texels).map_err(|e| self.refused(e))
    }

    /// A roughness map: the first channel as it is.
    ///
    /// # Errors
    /// [`Error::File`] names the texel that is not finite.
    pub fn roughness(&self) -> Result<Texture> {
        let texels: Vec<_> = (0..self.count()).map(|i| self.raw(i).x).collect();
        Texture::scalar(self.size, &texels).map_err(|e| self.refused(e))
    }

    /// A height map: the first channel as it is.
    ///
    /// # Errors
    /// [`Error::File`] names the texel that is not finite.
    pub fn heights(&self) -> Result<Heights> {
        let values = (0..self.count()).map(|i| self.raw(i).x).collect();
        Heights::new(self.size, values).map_err(|e| self.refused(e))
    }

    /// What the library refuses, as an error of the file.
    fn refused(&self, error: crate::Error) -> Error {
        refused(&self.path, error)
    }
}

/// What the library refuses of the image at `path`.
pub(crate) fn refused(path: &Path, error: crate::Error) -> Error {
    match error {
        crate::Error::InvalidInput { field, expected, got } => Error::file(path, At::File, field, expected, got),
        other => other.into(),
    }
}

fn triple<T: Copy + Default>(all: &[T], i: usize) -> [T; 3] {
    all.as_chunks::<3>().0.get(i).copied().unwrap_or_default()
}

fn unit(n: Vec3) -> [f32; 3] {
    n.as_dvec3().try_normalize().map_or([0.0, 0.0, 1.0], |n| n.as_vec3().to_array())
}
