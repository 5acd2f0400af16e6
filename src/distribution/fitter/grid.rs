//! The directions at which a reflectance and its fit are compared, close where a lobe is.

use crate::reflectance::Reflectance;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Steps of the half vector's tilt in the plane of incidence, but for those of [`Resolution::rows_in_core`].
const ROWS: f64 = 112.0;
/// Steps of its angle with that plane.
const COLUMNS: f64 = 28.0;
/// Far from the core, steps in the tilt do not grow beyond what this many radians would be divided into.
const BROAD: f64 = 0.6;
/// Core of a lobe of half vectors, in widths to either side.
const CORE: f64 = 3.0;
/// The most steps that are added in the core towards grazing angles.
const MOST_IN_CORE: f64 = 120.0;

/// Directions of light, one of each pair that mirrors the other at the plane of incidence, their solid angles, and a reflectance
/// times the cosine there.
///
/// A half vector is known by its tilt b from the normal in the plane of incidence, away from the viewer, and its angle g with that
/// plane. Under a view angle t, `o.h = cos g cos(t + b)`, so that all directions of the sphere are those of the box
/// `-pi/2 < t + b < pi/2, 0 <= g < pi/2`, of solid angle `4 cos(t + b) cos^2 g db dg`.
pub struct Grid {
    /// View angle in radians.
    pub view: f64,
    /// The directions, y at least 0.
    pub directions: Vec<DVec3>,
    /// Solid angle of a direction and its mirror image.
    pub solid_angles: Vec<f64>,
    /// The reflectance times the cosine, its mean over turns about the normal; 0 below the horizon.
    pub values: Vec<DVec3>,
    /// Integral of the values.
    pub albedo: DVec3,
}

impl Grid {
    /// For half vectors that vary over `width` radians about the normal; `finer` times as many rows and as many columns.
    pub fn new(reflectance: &dyn Reflectance, view: f64, width: f64, finer: f64) -> Self {
        let limits = [-FRAC_PI_2 - view, FRAC_PI_2 - view];
        let measure = |b: f64| (b / width).asinh() + b / BROAD;
        let step = (measure(limits[1]) - measure(limits[0])) / (ROWS * finer);
        // A lobe of light directions that is round covers a strip of half vectors, narrower by the view's cosine.
        let in_core = (10.0 / view.cos().max(1e-3) - 10.0).min(MOST_IN_CORE) * finer * step;
        let dense = |b: f64| measure(b) + in_core * (b / (CORE * width)).clamp(-1.0, 1.0) / 2.0;
        let rows = divide(dense, limits, step);
        let across = |g: f64| (g / width).asinh() + g / BROAD;
        let columns = divide(across, [0.0, FRAC_PI_2], across(FRAC_PI_2) / (COLUMNS * finer));

        let (sin_o, cos_o) = view.sin_cos();
        let wo = DVec3::new(sin_o, 0.0, cos_o);
        let mut grid = Self { view, directions: Vec::new(), solid_angles: Vec::new(), values: Vec::new(), albedo: DVec3::ZERO };
        for row in rows.windows(2) {
            let (sin_b, cos_b) = (0.5 * (row[0] + row[1])).sin_cos();
            // Exact along the tilt.
            let length = (view + row[1]).sin() - (view + row[0]).sin();
            for column in columns.windows(2) {
                let (sin_g, cos_g) = (0.5 * (column[0] + column[1])).sin_cos();
                // Of the squared cosine.
                let breadth = 0.5 * (column[1] - column[0]) + 0.25 * ((2.0 * column[1]).sin() - (2.0 * column[0]).sin());
                let h = DVec3::new(-sin_b * cos_g, sin_g, cos_b * cos_g);
                let wi = (2.0 * wo.dot(h) * h - wo).normalize();
                let value = if wi.z > 0.0 { reflectance.mean_over_turns(wi, wo) * wi.z } else { DVec3::ZERO };
                grid.directions.push(wi);
                grid.solid_angles.push(8.0 * length * breadth);
                grid.values.push(if value.is_finite() { value.max(DVec3::ZERO) } else { DVec3::ZERO });
            }
        }
        grid.albedo = grid.values.iter().zip(&grid.solid_angles).map(|(f, s)| *f * *s).sum();
        grid
    }
}

/// Borders between `limits` that divide the rising `measure` into parts of about `step`.
fn divide(measure: impl Fn(f64) -> f64, limits: [f64; 2], step: f64) -> Vec<f64> {
    let [low, high] = limits.map(&measure);
    let parts = ((high - low) / step).ceil().max(1.0) as usize;
    let border = |i: usize| {
        let wanted = low + (high - low) * i as f64 / parts as f64;
        let [mut a, mut b] = limits;
        for _ in 0..40 {
            let middle = 0.5 * (a + b);
            if measure(middle) < wanted {
                a = middle;
            } else {
                b = middle;
            }
        }
        0.5 * (a + b)
    };
    (0..=parts)
        .map(|i| {
            if i == 0 {
                limits[0]
            } else if i == parts {
                limits[1]
            } else {
                border(i)
            }
        })
        .collect()
}
