//! Environments by formula.

use crate::error::Result;
use crate::sampling::LatLong;
use crate::sampling::latlong::direction;
use glam::{DVec3, dvec2, dvec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Radiance of the sun's disc and its angular radius in radians: twice the real one, so that it covers a few texels at
/// 1024x512.
const SUN: f64 = 2.0e4;
const SUN_RADIUS: f64 = 0.0093;

/// A warm sun, 40 degrees up on the front right, over a sky from blue to white above a brown ground. The sun is
/// box-filtered to texels, then scaled to its exact power.
pub(crate) fn sun_sky(width: u32) -> Result<LatLong> {
    let colour = dvec3(1.0, 0.93, 0.82);
    let to_sun = dvec3(0.5, 0.64, 0.58).normalize();
    let covered: Vec<f64> = (0..width * (width / 2)).into_par_iter().map(|i| disc_coverage(i, width, to_sun)).collect();
    let sum: f64 = (0..).zip(&covered).map(|(i, c)| c * solid_angle(i, width)).sum();
    let scale = if sum > 0.0 { SUN * TAU * (1.0 - SUN_RADIUS.cos()) / sum } else { 0.0 };
    map(width, |i, d| {
        let sun = covered.get(i as usize).copied().unwrap_or_default();
        sky(d, to_sun) + colour * (scale * sun)
    })
}

/// A dark room with three soft boxes: a large warm-white key, a tall cool one on the other side, a strip behind.
pub(crate) fn studio(width: u32) -> Result<LatLong> {
    // Direction, half sizes (tangents of the half angles), radiance.
    let boxes = [
        (dvec3(0.75, 0.55, 0.6), [0.42, 0.32], dvec3(12.0, 11.0, 9.5)),
        (dvec3(-0.95, 0.15, 0.3), [0.18, 0.6], dvec3(3.2, 4.4, 6.0)),
        (dvec3(-0.15, 0.7, -0.8), [0.7, 0.1], dvec3(9.0, 9.0, 9.0)),
    ];
    map(width, |_, d| {
        let mut radiance = DVec3::splat(0.03).lerp(DVec3::splat(0.06), 0.5 + 0.5 * d.y);
        for (towards, half, colour) in boxes {
            let front = towards.normalize();
            let right = DVec3::Y.cross(front).normalize();
            let depth = d.dot(front);
            if depth > 0.0 {
                let [x, y] = [d.dot(right) / depth / half[0], d.dot(front.cross(right)) / depth / half[1]];
                radiance += colour * (smooth_edge(x) * smooth_edge(y));
            }
        }
        radiance
    })
}

/// Radiance 1 from everywhere: what every closed energy balance is tested under.
pub(crate) fn constant(width: u32) -> Result<LatLong> {
    map(width, |_, _| DVec3::ONE)
}

/// Radiance of one frequency: `1 + cos(K angle)`, the angle from +X in radians. Its bandwidth is K / 2 pi cycles/radian everywhere
/// but around +X and -X.
pub(crate) fn cosine(width: u32, k: f64) -> Result<LatLong> {
    map(width, |_, d| DVec3::splat(1.0 + (k * d.x.clamp(-1.0, 1.0).acos()).cos()))
}

fn sky(d: DVec3, to_sun: DVec3) -> DVec3 {
    let (zenith, horizon, ground) = (dvec3(0.14, 0.33, 0.85), dvec3(0.95, 1.0, 1.05), dvec3(0.17, 0.14, 0.11));
    let above = horizon.lerp(zenith, d.y.max(0.0).powf(0.45));
    // The haze around the sun, wide enough to stay smooth.
    let glow = dvec3(1.0, 0.85, 0.6) * (40.0 * (d.dot(to_sun) - 1.0)).exp();
    (above + glow).lerp(ground, smooth(0.02, -0.06, d.y))
}

/// 1 inside, 0 outside of -1..1, with an edge 0.15 wide on either side.
fn smooth_edge(x: f64) -> f64 {
    smooth(1.15, 0.85, x.abs())
}

/// Hermite step from 0 at `from` to 1 at `to`.
fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The part of texel `i` within the sun's disc, by 16 x 16 points.
fn disc_coverage(i: u32, width: u32, to_sun: DVec3) -> f64 {
    const POINTS: u32 = 16;
    let (centre, reach) = (at(i, width, 0.5, 0.5), SUN_RADIUS + 1.5 * TAU / f64::from(width));
    if centre.dot(to_sun) < reach.min(PI).cos() {
        return 0.0;
    }
    let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(POINTS);
    let inside =
        (0..POINTS * POINTS).filter(|k| at(i, width, offset(k % POINTS), offset(k / POINTS)).dot(to_sun) > SUN_RADIUS.cos());
    inside.count() as f64 / f64::from(POINTS * POINTS)
}

/// Direction at `(x, y)` within texel `i`.
fn at(i: u32, width: u32, x: f64, y: f64) -> DVec3 {
    let (column, row) = (f64::from(i % width) + x, f64::from(i / width) + y);
    direction(dvec2(column / f64::from(width), row / f64::from(width / 2)))
}

fn solid_angle(i: u32, width: u32) -> f64 {
    let edge = |row: u32| (PI * f64::from(row) / f64::from(width / 2)).cos();
    (edge(i / width) - edge(i / width + 1)) * TAU / f64::from(width)
}

fn map(width: u32, radiance: impl Fn(u32, DVec3) -> DVec3 + Sync) -> Result<LatLong> {
    let texel = |i| radiance(i, at(i, width, 0.5, 0.5)).as_vec3().to_array();
    LatLong::new(width, width / 2, (0..width * (width / 2)).into_par_iter().map(texel).collect())
}
