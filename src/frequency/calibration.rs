//! What the wavelet estimate makes of light of one frequency: the measurements behind [`wavelet::bias`](super::wavelet::bias).

use super::AngularBandwidth;
use crate::error::Result;
use crate::sampling::LatLong;
use crate::sampling::latlong::direction;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Columns of the environments.
const WIDTH: u32 = 1024;
/// Axes of their waves, and radians/radian: from 10 to 32 cycles/radian, up to a fifth of a cycle a texel.
const WAVES: [(DVec3, f64); 6] =
    [(DVec3::X, 200.0), (DVec3::Y, 128.0), (SLANTED, 64.0), (DVec3::X, 64.0), (DVec3::Y, 200.0), (SLANTED, 128.0)];
const SLANTED: DVec3 = DVec3::new(0.5, 0.6, 0.62);

/// An environment of radiance `1 + cos(k angle)`, the angle from `axis`.
///
/// # Errors
/// [`crate::Error::InvalidInput`] for a width that no environment has.
pub fn cosine(width: u32, k: f64, axis: DVec3) -> Result<LatLong> {
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
        let w = direction(DVec2::new(x, 2.0 * y) / f64::from(width));
        [(1.0 + (k * w.dot(axis.normalize()).clamp(-1.0, 1.0).acos()).cos()) as f32; 3]
    };
    LatLong::new(width, width / 2, (0..width * (width / 2)).map(texel).collect())
}

/// Estimates of `map`, a [`cosine`], over the truth, sorted: of blocks away from the axis and at most `from_horizon` radians from
/// the horizon.
pub fn ratios(map: &LatLong, eps: f64, k: f64, axis: DVec3, from_horizon: f64) -> Vec<f64> {
    let bandwidth = AngularBandwidth::of(map, eps).map;
    let at = |i: usize| {
        let (x, y) = ((i % bandwidth.width) as f64 + 0.5, (i / bandwidth.width) as f64 + 0.5);
        direction(DVec2::new(x / bandwidth.width as f64, y / bandwidth.height() as f64))
    };
    let counts = |w: DVec3| w.dot(axis.normalize()).abs() < 0.95 && w.y.asin().abs() < from_horizon;
    let kept = (0..bandwidth.values.len()).filter(|&i| counts(at(i)));
    let mut ratios: Vec<f64> = kept.map(|i| bandwidth.values[i] * TAU / k).collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}

/// Estimates over the truth at one threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Of the medians of all waves, their geometric mean.
    pub median: f64,
    /// The least and the greatest median of a wave.
    pub medians: [f64; 2],
    /// The least 5 % and the greatest 95 % quantile over the places of a wave.
    pub spread: [f64; 2],
}

/// What the calibrated estimate reads at threshold `eps`, over waves of three frequencies and three directions.
///
/// # Errors
/// As [`cosine`].
pub fn reading(eps: f64) -> Result<Reading> {
    let mut found = Reading { median: 0.0, medians: [f64::INFINITY, 0.0], spread: [f64::INFINITY, 0.0] };
    for (axis, k) in WAVES {
        let ratios = ratios(&cosine(WIDTH, k, axis)?, eps, k, axis, 1.1);
        let quantile = |q: f64| ratios.get(((ratios.len() - 1) as f64 * q) as usize).copied().unwrap_or_default();
        let [low, median, high] = [0.05, 0.5, 0.95].map(quantile);
        found.median += median.ln() / WAVES.len() as f64;
        found.medians = [found.medians[0].min(median), found.medians[1].max(median)];
        found.spread = [found.spread[0].min(low), found.spread[1].max(high)];
    }
    Ok(Reading { median: found.median.exp(), ..found })
}
