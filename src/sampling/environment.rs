//! Directions in proportion to an environment's light. The density is the *bilinear* interpolation of a weight per texel,
//! drawn exactly: a texel by an alias table in the order of the map's rows, then a tent-distributed offset of up to one texel
//! around its centre, since a bilinear surface is a sum of tents. Twin of `glsl/include/environment.glsl`.

use crate::error::Result;
use crate::sampling::latlong::{LatLong, direction, uv};
use crate::sampling::sobol::to_unit;
use crate::sampling::{AliasTable, luminance};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Every texel counts at least this fraction of the mean luminance, so that no direction is left out.
const FLOOR: f64 = 1e-3;
/// Keeps the density finite at the poles, where a whole row of the map is one direction.
const LEAST_SIN: f64 = 1e-9;

/// The sampling distribution of one [`LatLong`].
#[derive(Clone, Debug)]
pub struct EnvironmentImportance {
    alias: AliasTable,
    density: LatLong,
}

impl EnvironmentImportance {
    /// Weighs each texel by its luminance, at least a thousandth of the mean, times the sine of its row's polar angle.
    ///
    /// # Errors
    /// [`crate::Error::InvalidInput`] if the map has more texels than a 32-bit index reaches.
    pub fn build(map: &LatLong) -> Result<Self> {
        let (width, height) = (map.width() as usize, map.height() as usize);
        let sine = |i: usize| (((i / width) as f64 + 0.5) / height as f64 * PI).sin();
        let light = |[r, g, b]: [f32; 3]| luminance(DVec3::new(r.into(), g.into(), b.into()));
        let mean = map.texels().iter().map(|&t| light(t)).sum::<f64>() / map.texels().len() as f64;
        let floor = if mean > 0.0 { FLOOR * mean } else { 1.0 };
        let weights: Vec<f64> = map.texels().iter().enumerate().map(|(i, &t)| light(t).max(floor) * sine(i)).collect();

        let alias = AliasTable::build(&weights)?;
        let density = |i: usize| (width * height) as f64 * alias.probability(i);
        let density = (0..width * height).map(|i| [density(i) as f32; 3]).collect();
        Ok(Self { alias, density: LatLong::new(map.width(), map.height(), density)? })
    }

    /// The density over the unit square of map coordinates at each texel centre (mean 1), row-major: what the GPU stores
    /// beside the radiance and interpolates bilinearly.
    pub fn density_texels(&self) -> Vec<f32> {
        self.density.texels().iter().map(|t| t[0]).collect()
    }

    /// The table that texels (row-major) are drawn from.
    pub fn alias(&self) -> &AliasTable {
        &self.alias
    }

    /// A direction and its density per steradian, from two uniforms as fractions of 2^32: the first picks the texel and, by
    /// what the table leaves of it, the offset in u; the second the offset in v. Offsets wrap in u and are reflected at the
    /// poles, which equals bilinear interpolation clamped there.
    pub fn sample(&self, u: [u32; 2]) -> (DVec3, f64) {
        let (texel, rest) = self.alias.draw(u[0], u[1]);
        let (column, row) = (texel % self.density.width(), texel / self.density.width());
        let x = (f64::from(column) + 0.5 + tent(rest)) / f64::from(self.density.width());
        let y = ((f64::from(row) + 0.5 + tent(to_unit(u[1]))) / f64::from(self.density.height())).abs();
        let y = if y > 1.0 { 2.0 - y } else { y };
        let w = direction(DVec2::new(x.rem_euclid(1.0), y));
        (w, self.pdf(w))
    }

    /// The density per steradian of direction `w` (unit): the bilinear density over the map's `2 pi^2 sin(theta)`.
    pub fn pdf(&self, w: DVec3) -> f64 {
        let sine = (uv(w).y * PI).sin().max(LEAST_SIN);
        self.density.radiance(w).x / (2.0 * PI * PI * sine)
    }
}

/// The inverse cumulative distribution of a tent over [-1, 1].
fn tent(x: f64) -> f64 {
    if x < 0.5 { (2.0 * x).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * x).sqrt() }
}
