//! Reflectances baked into tables at MERL resolution, and how far the tables are off.

use crate::reflectance::merl::{Angles, MerlTable};
use crate::reflectance::{Reflectance, turned};
use crate::sampling::{luminance, sobol};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// The cosine at which directions at and below the horizon are evaluated: half a bin of angle above it.
const HORIZON: f64 = 0.01;
/// Bins with a direction of a cosine below this are never interpolated into one above the horizon.
const DEEP: f64 = -0.1;

impl MerlTable {
    /// Tabulates an isotropic `f(wi, wo)` in 1/sr. Bins that straddle the horizon get what `f` says just above it.
    pub fn bake(f: impl Fn(DVec3, DVec3) -> DVec3 + Sync) -> Self {
        Self::bake_turned(0.0, f)
    }

    /// Tabulates `f` for half vectors of `azimuth` radians from the x axis.
    pub fn bake_turned(azimuth: f64, f: impl Fn(DVec3, DVec3) -> DVec3 + Sync) -> Self {
        let turn = DVec2::from_angle(azimuth);
        Self::from_fn_parallel(|theta_half, theta_diff, phi_diff| {
            let (wi, wo) = Angles { theta_half, theta_diff, phi_diff }.directions();
            if wi.z.min(wo.z) < DEEP { DVec3::ZERO } else { f(turned(turn, lifted(wi)), turned(turn, lifted(wo))) }
        })
    }
}

/// A direction at least [`HORIZON`] above the plane.
fn lifted(w: DVec3) -> DVec3 {
    if w.z >= HORIZON {
        return w;
    }
    let across = w.truncate().normalize_or(DVec2::X) * (1.0 - HORIZON * HORIZON).sqrt();
    across.extend(HORIZON)
}

/// How far a table is from what it was baked of, over pairs of directions whose cosines are both above 0.05.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeError {
    /// Root mean square of the difference over that of the value, both in luminance times the cosines, over directions that
    /// crowd at the highlight.
    pub rms: f64,
    /// The median of the relative difference in luminance.
    pub median: f64,
    /// Its 99th percentile.
    pub p99: f64,
}

/// Compares `baked` with `exact` at `count` pairs: even half vectors in the table's own warp, even differences.
pub fn error(exact: &dyn Reflectance, baked: &dyn Reflectance, count: u32) -> BakeError {
    let (mut squares, mut total) = (0.0, 0.0);
    let mut relative = Vec::new();
    for i in 0..count {
        let [a, b] = sobol::random(i, 11).map(sobol::to_unit);
        let [c, d] = sobol::random(i, 12).map(sobol::to_unit);
        let half = std::f64::consts::FRAC_PI_2;
        let angles = Angles { theta_half: half * a * a, theta_diff: half * b, phi_diff: TAU * c };
        let (wi, wo) = angles.directions();
        if wi.z.min(wo.z) < 0.05 {
            continue;
        }
        let turn = DVec2::from_angle(TAU * d);
        let (wi, wo) = (turned(turn, wi), turned(turn, wo));
        let (exact, baked) = (luminance(exact.evaluate(wi, wo)), luminance(baked.evaluate(wi, wo)));
        let weight = wi.z * wo.z;
        squares += ((exact - baked) * weight).powi(2);
        total += (exact * weight).powi(2);
        relative.push((exact - baked).abs() / exact.max(1e-6));
    }
    relative.sort_by(f64::total_cmp);
    let quantile = |q: f64| relative.get((relative.len() as f64 * q) as usize).copied().unwrap_or(0.0);
    let rms = if total > 0.0 { (squares / total).sqrt() } else { squares.sqrt() };
    BakeError { rms, median: quantile(0.5), p99: quantile(0.99) }
}
