//! Directions in proportion to an environment's light. The density is the *bilinear* interpolation of a weight per texel,
//! drawn exactly: a row by inversion, a texel of the row by an alias table, then a tent-distributed offset of up to one texel
//! around its centre, since a bilinear surface is a sum of tents. Rows by inversion keep the sun's share of well-spread
//! points: one alias table over all texels scatters it, and left 17x the error on a mirror-like sphere under a small sun. Twin of `glsl/include/environment.glsl`.

use crate::error::Result;
use crate::sampling::inversion::Interval;
use crate::sampling::latlong::{LatLong, direction, uv};
use crate::sampling::{AliasTable, InversionTable, luminance};
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
    columns: Vec<AliasTable>,
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

        let columns = weights.chunks_exact(width).map(AliasTable::build).collect::<Result<Vec<_>>>()?;
        let rows = InversionTable::build(&weights.chunks_exact(width).map(|row| row.iter().sum()).collect::<Vec<f64>>())?;
        let texels = (width * height) as f64;
        let row_density = |(row, table): (usize, &AliasTable)| {
            let share = texels * rows.probability(row);
            table.probabilities().into_iter().map(move |p| [(share * p) as f32; 3])
        };
        let density = columns.iter().enumerate().flat_map(row_density).collect();
        Ok(Self { rows, columns, density: LatLong::new(map.width(), map.height(), density)? })
    }

    /// The density over the unit square of map coordinates at each texel centre (mean 1), row-major: what the GPU stores
    /// beside the radiance and interpolates bilinearly.
    pub fn density_texels(&self) -> Vec<f32> {
        self.density.texels().iter().map(|t| t[0]).collect()
    }

    /// What the GPU draws from, as an image of word pairs with its extent: each texel's alias entry (threshold as float bits,
    /// alias) in its row; the rows' intervals (start, guide) in one more row below, or in one more column where the map is
    /// taller than wide.
    pub fn entries(&self) -> ([u32; 2], Vec<[u32; 2]>) {
        let (width, height) = (self.density.width(), self.density.height());
        let tall = height > width;
        let interval = |i: &Interval| [i.start, i.guide];
        let mut image = Vec::new();
        for (columns, row) in self.columns.iter().zip(self.rows.intervals()) {
            image.extend(columns.entries().iter().map(|e| [e.threshold.to_bits(), e.alias]));
            image.extend(tall.then_some(interval(row)));
        }
        if tall {
            return ([width + 1, height], image);
        }
        image.extend(self.rows.intervals().iter().map(interval));
        image.resize(width as usize * (height as usize + 1), [0; 2]);
        ([width, height + 1], image)
    }

    /// A direction and its density per steradian, from two uniforms as fractions of 2^32: the second picks the row and, by
    /// its place in the row's interval, the offset in v; the first the texel and, by what
    /// the alias table leaves of it, the offset in u. Offsets wrap in u
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
