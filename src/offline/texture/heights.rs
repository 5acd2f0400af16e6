//! Height maps: as normals, or sampled to move vertices.

use crate::error::Result;
use crate::texture::{self, Texture};
use glam::{DVec2, DVec3};

/// Heights over a repeating square of coordinates, row 0 at the top.
#[derive(Clone, Debug)]
pub struct Heights {
    size: [u32; 2],
    values: Vec<f32>,
}

impl Heights {
    /// `values` row by row from the top.
    ///
    /// # Errors
    /// [`crate::Error::InvalidInput`] for another number of values, or names the one that is not finite.
    pub fn new(size: [u32; 2], values: Vec<f32>) -> Result<Self> {
        texture::check(size, values.len())?;
        texture::finite(size, values.iter().map(std::slice::from_ref))?;
        Ok(Self { size, values })
    }

    /// The height at `uv`, bilinear, repeating.
    pub fn sample(&self, uv: DVec2) -> f64 {
        texture::bilinear(self.size, uv, |i| f64::from(self.values.get(i).copied().unwrap_or_default()))
    }

    /// The normals of the surface whose height is `scale` map widths where the map holds 1: central differences across the
    /// repeating map, whose texels are taken as square.
    ///
    /// # Errors
    /// [`crate::Error::InvalidInput`] if slopes are not finite.
    pub fn normals(&self, scale: f64) -> Result<Texture> {
        let [w, h] = self.size.map(|side| side as usize);
        let value = |x: usize, y: usize| f64::from(self.values.get(y * w + x).copied().unwrap_or_default());
        // Over the two texels between neighbours.
        let per_texel = scale * w as f64 / 2.0;
        let normal = |i: usize| {
            let (x, y) = (i % w, i / w);
            let along_u = value((x + 1) % w, y) - value((x + w - 1) % w, y);
            let along_v = value(x, (y + h - 1) % h) - value(x, (y + 1) % h);
            DVec3::new(-along_u * per_texel, -along_v * per_texel, 1.0).normalize().as_vec3().to_array()
        };
        let texels: Vec<_> = (0..w * h).map(normal).collect();
        Texture::normals(self.size, &texels)
    }
}
