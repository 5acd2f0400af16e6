//! Gaussian lobes of slopes: Beckmann's distribution with a mean and a covariance (Olano and Baker 2010, "LEAN Mapping"; Dupuy et
//! al. 2013, "Linear Efficient Antialiased Displacement and Reflectance Mapping").
//!
//! The slope of a direction m above the horizon is `-(m.x, m.y) / m.z`. The density P of slopes is over the macro surface's own
//! area, so that `D(m) = P / m.z^4` fills the projected area: the integral of `D cos` is 1. As a density over solid angle, which
//! counts each direction alike, the lobe is `P / m.z^3`, of integral 1, too.

use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// The least cosine at which a direction's slope is taken: towards the horizon slopes grow without bound.
pub const LEAST_COSINE: f64 = 0.08;

/// The least variance along an axis.
const LEAST_VARIANCE: f64 = 1e-7;

/// Lobes of less concentration count as this: the slopes of an even lobe have no variance.
const LEAST_CONCENTRATION: f64 = 1e-2;

/// One lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Mean slope.
    pub mean: DVec2,
    /// Covariance of slopes: xx, xy, yy.
    pub covariance: [f64; 3],
    /// Weight, at least 0.
    pub weight: f64,
}

/// The slope of unit `m`, whose cosine counts as at least [`LEAST_COSINE`].
pub fn of(m: DVec3) -> DVec2 {
    -m.truncate() / m.z.max(LEAST_COSINE)
}

/// The variance of slopes, each way, of a sharp lobe of concentration `kappa` about the normal.
pub fn variance(kappa: f64) -> f64 {
    1.0 / kappa.max(LEAST_CONCENTRATION)
}

/// The covariance of slopes of a sharp lobe of concentration `kappa` about slope `b`: its own, [`variance`] each way about its mean
/// direction, times the derivative of slopes by directions there: `(1 + b.b) (I + b b^T) / kappa`.
pub fn carried(b: DVec2, kappa: f64) -> [f64; 3] {
    let scale = (1.0 + b.length_squared()) * variance(kappa);
    [scale * (1.0 + b.x * b.x), scale * b.x * b.y, scale * (1.0 + b.y * b.y)]
}

impl Lobe {
    /// A lobe of given moments: the means of slopes and of their products xx, xy, yy. What rounding made of the covariance is
    /// brought back to one.
    pub fn from_moments(mean: DVec2, second: [f64; 3], weight: f64) -> Self {
        let xx = (second[0] - mean.x * mean.x).max(LEAST_VARIANCE);
        let yy = (second[2] - mean.y * mean.y).max(LEAST_VARIANCE);
        let most = 0.999_9 * (xx * yy).sqrt();
        let xy = (second[1] - mean.x * mean.y).clamp(-most, most);
        Self { mean, covariance: [xx, xy, yy], weight }
    }

    /// The mean of slopes and of their products xx, xy, yy.
    pub fn moments(&self) -> (DVec2, [f64; 3]) {
        let ([xx, xy, yy], b) = (self.covariance, self.mean);
        (b, [xx + b.x * b.x, xy + b.x * b.y, yy + b.y * b.y])
    }

    /// The density of slopes, of integral 1.
    fn slopes(&self, slope: DVec2) -> f64 {
        let ([xx, xy, yy], d) = (self.covariance, slope - self.mean);
        let determinant = xx * yy - xy * xy;
        let square = (yy * d.x * d.x - 2.0 * xy * d.x * d.y + xx * d.y * d.y) / determinant;
        (-0.5 * square).exp() / (TAU * determinant.sqrt())
    }

    /// The density at unit `h`, per steradian; its integral over the upper hemisphere is the weight.
    pub fn density(&self, h: DVec3) -> f64 {
        if h.z <= 0.0 { 0.0 } else { self.weight * self.slopes(-h.truncate() / h.z) / h.z.powi(3) }
    }

    /// A direction of the lobe for `u` uniform in the unit square.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let radius = (-2.0 * (1.0 - u[0]).max(f64::MIN_POSITIVE).ln()).sqrt();
        let normal = radius * DVec2::from_angle(TAU * u[1]);
        let [xx, xy, yy] = self.covariance;
        let x = xx.sqrt();
        let y = DVec2::new(xy / x, (yy - xy * xy / xx).max(0.0).sqrt());
        let slope = self.mean + DVec2::new(x * normal.x, y.dot(normal));
        (-slope).extend(1.0).normalize()
    }

    /// Smith's Lambda towards unit `w` (Dupuy et al. 2013, section 4.2; Heitz 2014, "Understanding the Masking-Shadowing
    /// Function", equation 86 about the mean slope), infinite where the mean surface faces away: the visible share of it is
    /// `1 / (1 + Lambda)`.
    pub fn lambda(&self, w: DVec3) -> f64 {
        let sine = w.truncate().length();
        let along = w.truncate() / sine.max(1e-12);
        let [xx, xy, yy] = self.covariance;
        let variance = xx * along.x * along.x + 2.0 * xy * along.x * along.y + yy * along.y * along.y;
        let x = (w.z - sine * self.mean.dot(along)) / (sine * variance.sqrt()).max(1e-12);
        if x <= 0.0 { f64::INFINITY } else { gaussian(x) / x - tail(x) }
    }

    /// The mean surface's area, seen from unit `w`, over the macro surface's own area.
    pub fn facing(&self, w: DVec3) -> f64 {
        w.dot((-self.mean).extend(1.0))
    }

    /// `G / (4 cos cos)` with Smith's height-correlated G about the mean surface (Dupuy et al. 2013, section 4.2); 0 where that
    /// faces away from either direction.
    pub fn masking(&self, wi: DVec3, wo: DVec3) -> f64 {
        let (i, o) = (self.facing(wi), self.facing(wo));
        if i <= 0.0 || o <= 0.0 { 0.0 } else { 1.0 / ((1.0 + self.lambda(wi) + self.lambda(wo)) * 4.0 * i * o) }
    }
}

/// The standard normal density.
fn gaussian(x: f64) -> f64 {
    (-0.5 * x * x).exp() / TAU.sqrt()
}

/// The probability that a standard normal number is above `x >= 0` (Abramowitz and Stegun 26.2.17, error below 7.5e-8).
fn tail(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * x);
    let series = [0.319_381_53, -0.356_563_782, 1.781_477_937, -1.821_255_978, 1.330_274_429];
    gaussian(x) * series.iter().rev().fold(0.0, |sum, c| (sum + c) * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::vmf;

    const LOBES: [Lobe; 3] = [
        Lobe { mean: DVec2::ZERO, covariance: [0.02, 0.0, 0.02], weight: 1.0 },
        Lobe { mean: DVec2::new(0.4, -0.2), covariance: [0.3, 0.1, 0.08], weight: 0.7 },
        Lobe { mean: DVec2::new(-1.0, 0.5), covariance: [0.01, -0.015, 0.04], weight: 2.0 },
    ];

    /// Sums `f` over a grid of slopes as wide as the lobe; of each slope its direction and the area of the grid's cells.
    fn over_slopes(lobe: &Lobe, mut f: impl FnMut(DVec3, f64)) {
        let deviations = DVec2::new(lobe.covariance[0], lobe.covariance[2]).map(f64::sqrt);
        let side = 400;
        let unit = |i: i32| 14.0 * ((f64::from(i) + 0.5) / f64::from(side) - 0.5);
        for i in 0..side * side {
            let slope = lobe.mean + DVec2::new(unit(i % side), unit(i / side)) * deviations;
            f((-slope).extend(1.0).normalize(), deviations.element_product() * (14.0 / f64::from(side)).powi(2));
        }
    }

    #[test]
    fn density_integrates_to_the_weight() {
        for lobe in LOBES {
            // d omega = cos^3 d slope.
            let mut sum = 0.0;
            over_slopes(&lobe, |h, area| sum += lobe.density(h) * h.z.powi(3) * area);
            assert!((sum / lobe.weight - 1.0).abs() < 1e-6, "{sum}");
            let (mean, second) = lobe.moments();
            let back = Lobe::from_moments(mean, second, lobe.weight);
            assert!(back.covariance.iter().zip(lobe.covariance).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        assert_eq!(LOBES[0].density(DVec3::X), 0.0);
    }

    #[test]
    fn samples_have_the_moments() {
        for lobe in LOBES {
            let side = 500;
            let unit = |i: i32| (f64::from(i) + 0.5) / f64::from(side);
            let (mut mean, mut second, count) = (DVec2::ZERO, [0.0; 3], f64::from(side * side));
            for i in 0..side * side {
                let h = lobe.sample([unit(i % side), unit(i / side)]);
                let slope = -h.truncate() / h.z;
                mean += slope / count;
                let products = [slope.x * slope.x, slope.x * slope.y, slope.y * slope.y];
                second.iter_mut().zip(products).for_each(|(s, p)| *s += p / count);
            }
            let found = Lobe::from_moments(mean, second, 1.0);
            assert!((found.mean - lobe.mean).length() < 1e-3);
            let off = found.covariance.iter().zip(lobe.covariance).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 2e-3 * (lobe.covariance[0] + lobe.covariance[2]), "{found:?}");
        }
    }

    /// The white furnace of what is visible: seen from any side the visible normals fill the mean surface's projected area.
    #[test]
    fn visible_normals_fill_the_mean_surface() {
        for lobe in LOBES.map(|l| Lobe { weight: 1.0, ..l }) {
            for w in [DVec3::Z, DVec3::new(0.5, 0.3, 0.6), DVec3::new(-0.8, 0.1, 0.3), DVec3::new(0.1, 0.9, 0.15)]
                .map(DVec3::normalize)
            {
                if lobe.facing(w) <= 0.0 {
                    assert_eq!((lobe.lambda(w), lobe.masking(w, DVec3::Z)), (f64::INFINITY, 0.0));
                    continue;
                }
                let mut seen = 0.0;
                // D = density / cos.
                over_slopes(&lobe, |h, area| seen += lobe.density(h) / h.z * w.dot(h).max(0.0) * h.z.powi(3) * area);
                let filled = seen / ((1.0 + lobe.lambda(w)) * lobe.facing(w));
                assert!((filled - 1.0).abs() < 1e-4, "{w}: {filled}");
            }
        }
    }

    #[test]
    fn a_sharp_lobe_carries_its_variance() {
        for (mu, kappa) in [(DVec3::Z, 2e3), (DVec3::new(0.5, -0.3, 0.7).normalize(), 4e4)] {
            let (slope, vmf) = (of(mu), vmf::Lobe { mu, kappa, weight: 1.0 });
            let lobe = Lobe { mean: slope, covariance: carried(slope, kappa), weight: 1.0 };
            for i in 0..50 {
                let h = vmf.sample([0.9 * f64::from(i) / 50.0, 0.37 * f64::from(i) % 1.0]);
                let ratio = lobe.density(h) / vmf.density(h);
                assert!((ratio - 1.0).abs() < 0.12, "{mu} {i}: {ratio}");
            }
        }
        assert_eq!(of(DVec3::X), DVec2::new(-1.0 / LEAST_COSINE, 0.0));
        assert!((tail(1.0) - 0.158_655_25).abs() < 1e-7 && (tail(0.0) - 0.5).abs() < 1e-7);
    }
}
