//! An environment under von Mises-Fisher lobes: the chain of maps that holds it by concentration, and what it holds, by dense
//! quadrature. Twin of `glsl/include/prefilter.glsl` and `glsl/prefilter`.
//!
//! The chain is two lat-long images with mips. Level 0 of the first is the environment itself without its suns
//! ([`crate::distribution::suns`]); level l above is its convolution with a lobe whose variance is two of that
//! level's squared texels, so that the concentration falls by 4 a level. Level l of the second has twice the concentration of the first's
//! level l + 1, and half its texels: a look-up lies between a level of one and a level of the other, a factor of 2 apart. (One image with a factor of 4 is off by several times as much half-way between its levels.) Rows go on beyond the
//! poles by a tenth of the image each: the rows there are those of the meridian across, and bilinear look-ups need no case of
//! their own.

use crate::sampling::LatLong;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Square of a lobe's standard deviation in texels at the equator, in the first image; twice as much in the second.
pub const VARIANCE_IN_TEXELS: f64 = 2.0;
/// Columns of the coarsest level.
pub const LEAST_WIDTH: u32 = 8;
/// Columns of the finest: larger environments are averaged to it.
pub const MOST_WIDTH: u32 = 2048;
/// Columns of the least chain, of whose light all coarse levels are made.
pub const SOURCE_WIDTH: u32 = 64;
/// Factors of 2 between the concentration of the finest lobe and that of the map itself, whose bilinear look-ups are lobes of a
/// variance of a quarter of a texel.
pub const STEPS_TO_MAP: f64 = 4.0;

/// Shape of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chain {
    /// Columns of level 0, a power of two.
    pub width: u32,
}

impl Chain {
    /// For an environment of `size`: no coarser than it, up to [`MOST_WIDTH`].
    pub fn of([width, height]: [u32; 2]) -> Self {
        let finest = width.max(height.saturating_mul(2)).min(MOST_WIDTH);
        Self { width: finest.next_power_of_two().max(SOURCE_WIDTH) }
    }

    /// Levels.
    pub fn levels(self) -> u32 {
        (self.width / LEAST_WIDTH).ilog2() + 1
    }

    /// Columns and rows of a level, with those beyond the poles.
    pub fn extent(self, level: u32) -> [u32; 2] {
        let width = self.width >> level;
        [width, width * 5 / 8]
    }

    /// Rows of a level beyond each pole, in halves at the coarsest.
    pub fn beyond(self, level: u32) -> f64 {
        f64::from(self.width >> level) / 16.0
    }

    /// Concentration of the lobes of `level` of the first image, from level 1 on; level - 1 of the second has twice as much.
    pub fn kappa(self, level: u32) -> f64 {
        let texel = TAU / f64::from(self.width >> level);
        1.0 / (VARIANCE_IN_TEXELS * texel * texel)
    }

    /// What a look-up of concentration `kappa` reads: the level of the first image, that of the second, the first's weight.
    pub fn levels_of(self, kappa: f64) -> (u32, u32, f64) {
        // Steps down from the second image's level 0.
        let steps = (2.0 * self.kappa(1) / kappa).log2().min(f64::from(2 * self.levels() - 3));
        if steps < 0.0 {
            return (0, 0, (-steps / STEPS_TO_MAP).min(1.0));
        }
        let (first, second) = ((steps / 2.0).floor() + 1.0, ((steps + 1.0) / 2.0).floor());
        (first as u32, second.min(f64::from(self.levels() - 2)) as u32, 1.0 - (steps - (2.0 * first - 1.0)).abs())
    }
}

/// `map` under a lobe of concentration `kappa` about `towards` (unit), by `refine`^2 points a texel.
pub fn convolved(map: &LatLong, towards: DVec3, kappa: f64, refine: u32) -> DVec3 {
    // Beyond this a lobe holds less than e^-16 of its light.
    let least = 1.0 - 16.0 / kappa;
    weighted(map, towards, refine, |cosine| if cosine < least { 0.0 } else { (kappa * (cosine - 1.0)).exp() })
}

/// Irradiance from `map` on a surface with normal `n` (unit), by `refine`^2 points a texel.
pub fn irradiance(map: &LatLong, n: DVec3, refine: u32) -> DVec3 {
    weighted(map, n, refine, |cosine| cosine.max(0.0)) * PI
}

/// Mean of `map` with a weight of the cosine to `towards`.
fn weighted(map: &LatLong, towards: DVec3, refine: u32, weight: impl Fn(f64) -> f64) -> DVec3 {
    let size = [map.width() * refine, map.height() * refine];
    let columns: Vec<_> =
        (0..size[0]).map(|x| ((f64::from(x) + 0.5) / f64::from(size[0]) - 0.5) * TAU).map(f64::sin_cos).collect();
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for y in 0..size[1] {
        let v = (f64::from(y) + 0.5) / f64::from(size[1]);
        let (sine, cosine) = (v * PI).sin_cos();
        for (x, (sin_phi, cos_phi)) in (0..).zip(&columns) {
            let w = weight(towards.dot(DVec3::new(sine * sin_phi, cosine, -sine * cos_phi))) * sine;
            if w > 0.0 {
                sum += bilinear(map, DVec2::new((f64::from(x) + 0.5) / f64::from(size[0]), v)) * w;
                total += w;
            }
        }
    }
    sum / total
}

fn bilinear(map: &LatLong, uv: DVec2) -> DVec3 {
    let at = uv * DVec2::new(map.width().into(), map.height().into()) - 0.5;
    let (f, at) = (at - at.floor(), at.floor());
    let (x, y) = (at.x as i64, at.y as i64);
    let row = |y| map.texel(x, y).lerp(map.texel(x + 1, y), f.x);
    row(y).lerp(row(y + 1), f.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_quarter_the_concentration_and_meet() {
        for size in [[1024, 512], [1, 1], [100, 50], [32, 64], [8192, 4096], [3, 1500]] {
            let chain = Chain::of(size);
            assert!(chain.width.is_power_of_two() && (64..=2048).contains(&chain.width), "{size:?}");
            assert!(chain.width >= size[0].min(2048) && chain.width >= (2 * size[1]).min(2048));
            for level in 1..chain.levels() {
                let (first, _, weight) = chain.levels_of(chain.kappa(level));
                assert!(first == level && (weight - 1.0).abs() < 1e-9, "{size:?} {level}");
                let (_, second, weight) = chain.levels_of(2.0 * chain.kappa(level));
                assert!(second == level - 1 && weight.abs() < 1e-9, "{size:?} {level}");
                assert_eq!(chain.extent(level).map(|e| e << level), chain.extent(0), "{size:?} {level}");
            }
            assert_eq!(chain.extent(chain.levels() - 1), [8, 5]);
            assert_eq!(chain.levels_of(0.0), (chain.levels() - 1, chain.levels() - 2, 1.0));
            assert_eq!(chain.levels_of(f64::INFINITY), (0, 0, 1.0));
        }
        let chain = Chain::of([1024, 512]);
        assert!((chain.kappa(chain.levels() - 1) - 0.81).abs() < 0.01 && chain.kappa(1) > 3000.0);
    }

    /// A cosine about an axis is an eigenfunction: a lobe scales it by its mean cosine.
    #[test]
    fn quadrature_agrees_with_closed_forms() {
        let (width, height) = (256, 128);
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        let texel = |i: u32| {
            let at = DVec2::new(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5) / DVec2::new(width.into(), height.into());
            [(1.0 + crate::sampling::latlong::direction(at).dot(axis)) as f32; 3]
        };
        let map = LatLong::new(width, height, (0..width * height).map(texel).collect()).unwrap();
        let towards = DVec3::new(-0.2, 0.9, 0.1).normalize();
        for kappa in [0.5, 3.0, 40.0, 300.0] {
            let mean = crate::distribution::vmf::mean_cosine(kappa);
            let expected = 1.0 + mean * towards.dot(axis);
            assert!((convolved(&map, towards, kappa, 2).x - expected).abs() < 3e-4, "{kappa}");
        }
        let expected = PI * (1.0 + 2.0 / 3.0 * towards.dot(axis));
        assert!((irradiance(&map, towards, 2).x - expected).abs() < 1e-3);
    }
}
