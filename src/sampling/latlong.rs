//! The lat-long sphere: `u = 0.5 + atan2(x, -z)/2pi`, `v = acos(y)/pi`, texel centres at +0.5, bilinear, wrapping in u and
//! clamped in v. Twin of `glsl/include/latlong.glsl`.

use crate::error::{Error, Result};
use crate::sampling::luminance;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A distant environment: linear Rec.709 radiance over the sphere, +Y up.
#[derive(Clone, Debug)]
pub struct LatLong {
    width: u32,
    height: u32,
    texels: Vec<[f32; 3]>,
}

impl LatLong {
    /// Wraps `texels` (row-major, `width * height`, finite and not negative).
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for an empty or mis-sized map, or a texel that is negative, infinite or NaN.
    pub fn new(width: u32, height: u32, texels: Vec<[f32; 3]>) -> Result<Self> {
        if width == 0 || height == 0 || texels.len() as u64 != u64::from(width) * u64::from(height) {
            let expected = format!("{width}x{height} texels, at least 1x1");
            return Err(Error::invalid("environment", expected, format!("{} texels", texels.len())));
        }
        let bad = |t: &[f32; 3]| t.iter().any(|c| !c.is_finite() || *c < 0.0);
        if let Some(at) = texels.iter().position(bad) {
            let field = format!("environment texel ({}, {})", at % width as usize, at / width as usize);
            return Err(Error::invalid(field, "finite radiance >= 0", format!("{:?}", texels[at])));
        }
        Ok(Self { width, height, texels })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Row-major texels.
    pub fn texels(&self) -> &[[f32; 3]] {
        &self.texels
    }

    /// Replaces the texel in a column and row of the map, by a finite radiance that is not negative.
    pub(crate) fn set(&mut self, [x, y]: [u32; 2], radiance: [f32; 3]) {
        self.texels[(y * self.width + x) as usize] = radiance;
    }

    /// The texel in column `x` (wrapped) and row `y` (clamped).
    pub fn texel(&self, x: i64, y: i64) -> DVec3 {
        let x = x.rem_euclid(i64::from(self.width)) as usize;
        let y = y.clamp(0, i64::from(self.height) - 1) as usize;
        let [r, g, b] = self.texels[y * self.width as usize + x];
        DVec3::new(r.into(), g.into(), b.into())
    }

    /// Bilinear radiance in direction `w` (unit).
    pub fn radiance(&self, w: DVec3) -> DVec3 {
        let uv = uv(w);
        let (x, y) = (uv.x * f64::from(self.width) - 0.5, uv.y * f64::from(self.height) - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        let row = |y| self.texel(x, y).lerp(self.texel(x + 1, y), fx);
        row(y).lerp(row(y + 1), fy)
    }

    /// Mean luminance over the sphere, each texel by its solid angle.
    pub fn mean_luminance(&self) -> f64 {
        let rows = self.texels.chunks_exact(self.width as usize).enumerate().map(|(y, row)| {
            let band = |y: usize| (y as f64 / f64::from(self.height) * PI).cos();
            let sum: f64 = row.iter().map(|t| luminance(DVec3::from(t.map(f64::from)))).sum();
            0.5 * (band(y) - band(y + 1)) * sum / f64::from(self.width)
        });
        rows.sum()
    }
}

/// The unit direction of map coordinates `(u, v)`.
pub fn direction(uv: DVec2) -> DVec3 {
    let (phi, theta) = ((uv.x - 0.5) * TAU, uv.y * PI);
    DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

/// The map coordinates of unit direction `w`.
pub fn uv(w: DVec3) -> DVec2 {
    DVec2::new(0.5 + w.x.atan2(-w.z) / TAU, w.y.clamp(-1.0, 1.0).acos() / PI)
}
