//! Local angular bandwidth of a lat-long environment (Bagher et al. 2011, section 2.4 and appendix A). Twin of
//! `glsl/environment_bandwidth/`.

use super::wavelet::{Grid, LocalFrequency};
use crate::sampling::latlong::{LatLong, uv};
use crate::sampling::luminance;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Threshold of the paper's experiments.
pub const EPS: f64 = 0.01;
/// Luminance above this many times the mean counts as this: brighter than any display shows beside the rest. What a sun adds
/// must not hide the variation of everything around it.
pub const BRIGHTEST: f64 = 10.0;
/// Variation below `eps` times this share of the mean luminance does not count.
pub const FLOOR: f64 = 0.1;
/// Sides of the analysed map, which are powers of two, at most.
const LARGEST: [u32; 2] = [2048, 1024];

/// Frequency of an environment's radiance in cycles/radian around each direction.
#[derive(Clone, Debug, PartialEq)]
pub struct AngularBandwidth {
    /// One value a 2x2 block of analysed texels.
    pub map: Grid,
}

/// Sides of the map that is analysed: the next powers of two, from which and to which the environment is interpolated. Of
/// larger maps every so many texels are taken; what lies between shows as high frequency.
pub fn analysed([width, height]: [u32; 2]) -> [u32; 2] {
    let side = |n: u32, most: u32| n.clamp(2, most).next_power_of_two();
    [side(width, LARGEST[0]), side(height, LARGEST[1])]
}

/// One over the mean luminance of the map's texels (0 for a black map): what the analysis scales by.
pub fn scale(map: &LatLong) -> f64 {
    let light = |&[r, g, b]: &[f32; 3]| luminance(DVec3::new(r.into(), g.into(), b.into()));
    let sum: f64 = map.texels().iter().map(light).sum();
    if sum > 0.0 { map.texels().len() as f64 / sum } else { 0.0 }
}

impl AngularBandwidth {
    /// Analyses the luminance of `map` at threshold `eps`, on the torus of the map over its copy reflected at the pole.
    pub fn of(map: &LatLong, eps: f64) -> Self {
        let [width, height] = analysed([map.width(), map.height()]).map(|n| n as usize);
        let scale = scale(map);
        let light = |x, y| (luminance(map.texel(x, y)) * scale).min(BRIGHTEST);
        let resampled = Grid::from_fn(width, height, |x, y| {
            let at = |i: usize, n: usize, of: u32| (i as f64 + 0.5) * f64::from(of) / n as f64 - 0.5;
            let (x, y) = (at(x, width, map.width()), at(y, height, map.height()));
            let (fx, fy) = (x - x.floor(), y - y.floor());
            let (x, y) = (x.floor() as i64, y.floor() as i64);
            let row = |y| light(x, y) * (1.0 - fx) + light(x + 1, y) * fx;
            row(y) * (1.0 - fy) + row(y + 1) * fy
        });
        let torus = Grid::from_fn(width, 2 * height, |x, y| {
            let (x, y) = if y < height { (x, y) } else { ((x + width / 2) % width, 2 * height - 1 - y) };
            resampled.values[y * width + x]
        });
        let [across, down] = LocalFrequency::of(&torus, eps, FLOOR).axes;
        Self {
            map: Grid::from_fn(width / 2, height / 2, |x, y| {
                let i = y * (width / 2) + x;
                per_radian([across.values[i], down.values[i]], (y as f64 + 0.5) * 2.0 / height as f64, [width, height])
            }),
        }
    }

    /// The share of the blocks that another analysis of the same environment puts at another whole level (power of two).
    pub fn other_levels(&self, other: &Self) -> f64 {
        let level = |b: f64| if b > 0.0 { b.log2().floor() } else { f64::NEG_INFINITY };
        let changed = self.map.values.iter().zip(&other.map.values).filter(|(a, b)| level(**a) != level(**b)).count();
        changed as f64 / self.map.values.len().max(1) as f64
    }

    /// The bandwidth around direction `w` (unit), of the nearest block.
    pub fn towards(&self, w: DVec3) -> f64 {
        let uv = uv(w);
        let at = |x: f64, n: usize| (x * n as f64).floor();
        let row = at(uv.y, self.map.height()).min(self.map.height() as f64 - 1.0);
        self.map.wrapped(at(uv.x, self.map.width) as i64, row as i64)
    }
}

/// Cycles/texel across columns and rows as cycles/radian at `v` in [0, 1] from pole to pole: over the singular values of the map
/// from texels to the sphere, one an axis. Towards a pole columns draw together, but a wavelet that is several rows high does
/// not see it: it counts as lying a quarter of its cycle away from the pole at least.
fn per_radian([across, down]: [f64; 2], v: f64, [width, height]: [usize; 2]) -> f64 {
    let (column, row) = (TAU / width as f64, PI / height as f64);
    let pole = PI * v.min(1.0 - v);
    let from_pole = if across > 0.0 { pole.max(0.25 * row / across).min(PI / 2.0) } else { PI / 2.0 };
    (across / (column * from_pole.sin())).max(down / row)
}

#[cfg(test)]
#[path = "environment_tests.rs"]
mod tests;
