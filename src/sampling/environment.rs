//! Directions in proportion to an environment's light. The density is the *bilinear* interpolation of a weight per texel,
//! drawn exactly: a row, a texel of the row, then a tent-distributed offset of up to one texel around its centre, since a
//! bilinear surface is a sum of tents. Rows and texels are drawn by inversion, which keeps well-spread points well spread
//! within the sun; alias tables, over all texels or in each row, scatter them. Twin of `glsl/include/environment.glsl`.

use crate::error::Result;
use crate::sampling::latlong::{LatLong, direction, uv};
use crate::sampling::{InversionTable, luminance};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Every texel counts at least this fraction of the mean luminance, so that no direction is left out.
const FLOOR: f64 = 1e-3;
/// Keeps the density finite at the poles, where a whole row of the map is one direction.
const LEAST_SIN: f64 = 1e-9;

/// The sampling distribution of one [`LatLong`].
#[derive(Clone, Debug)]
pub struct EnvironmentImportance {
    rows: InversionTable,
    /// One table a row.
    columns: Vec<InversionTable>,
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

        let columns = weights.chunks_exact(width).map(InversionTable::build).collect::<Result<Vec<_>>>()?;
        let rows = InversionTable::build(&weights.chunks_exact(width).map(|row| row.iter().sum()).collect::<Vec<f64>>())?;
        let texels = (width * height) as f64;
        let row_density = columns.iter().enumerate().flat_map(|(row, table)| {
            let share = texels * rows.probability(row);
            (0..width).map(move |column| [(share * table.probability(column)) as f32; 3])
        });
        let density = row_density.collect();
        Ok(Self { rows, columns, density: LatLong::new(map.width(), map.height(), density)? })
    }

    /// The density over the unit square of map coordinates at each texel centre (mean 1), row-major: what the GPU stores
    /// beside the radiance and interpolates bilinearly.
    pub fn density_texels(&self) -> Vec<f32> {
        self.density.texels().iter().map(|t| t[0]).collect()
    }

    /// What the GPU draws from, as an image of words with its extent: in rows 0 to h - 1 where each texel's interval in its row
    /// begins, in rows h to 2h - 1 the row's guide, and in the last two rows the same for the rows themselves. A guide word
    /// is the first index in its part of the uniform numbers, and the last one shifted by 16.
    pub fn entries(&self) -> ([u32; 2], Vec<u32>) {
        let (width, height) = (self.density.width() as usize, self.density.height() as usize);
        let stride = width.max(height);
        let mut image = vec![0; stride * (2 * height + 2)];
        let tables = self.columns.iter().enumerate().map(|(row, table)| (table, row, height + row));
        for (table, starts, guides) in tables.chain([(&self.rows, 2 * height, 2 * height + 1)]) {
            let mut first = 0;
            for (i, interval) in table.intervals().iter().enumerate() {
                image[starts * stride + i] = interval.start;
                image[guides * stride + i] = first | interval.guide << 16;
                first = interval.guide;
            }
        }
        ([stride as u32, 2 * height as u32 + 2], image)
    }

    /// A direction and its density per steradian, from two uniforms as fractions of 2^32: the second picks the row and, by
    /// its place in the row's interval, the offset in v; the first likewise the texel and the offset in u. Offsets wrap in u
    /// and are reflected at the poles, which equals bilinear interpolation clamped there.
    pub fn sample(&self, u: [u32; 2]) -> (DVec3, f64) {
        let (row, down) = self.rows.draw(u[1]);
        let (column, across) = self.columns[row as usize].draw(u[0]);
        let x = (f64::from(column) + 0.5 + tent(across)) / f64::from(self.density.width());
        let y = ((f64::from(row) + 0.5 + tent(down)) / f64::from(self.density.height())).abs();
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
