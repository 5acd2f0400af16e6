//! Elliptic lobes: a von Mises-Fisher lobe whose concentration depends on the direction about its centre, so that in the
//! equal-area plane about it the lobe is a Gaussian with two widths.

use crate::distribution::vmf;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Directions about a centre over which a mean is taken.
const STEPS: i32 = 32;

/// One lobe. Where the half vector is off the centre by a unit tangent at the cosine c to the axis and s across it, the
/// concentration is `kappa (c^2 / ratio + s^2 ratio)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Its mean direction, its weight, and the geometric mean of the concentrations along the axis and across.
    pub round: vmf::Lobe,
    /// Unit, perpendicular to the mean direction: along it the lobe is the widest.
    pub axis: DVec3,
    /// At least 1.
    pub ratio: f64,
}

impl From<vmf::Lobe> for Lobe {
    fn from(round: vmf::Lobe) -> Self {
        Self { round, axis: round.mu.any_orthonormal_vector(), ratio: 1.0 }
    }
}

impl Lobe {
    /// Factor on the concentration in the direction of unit `h` from the centre. Over all directions the mean of its inverse is 1.
    pub fn factor(&self, h: DVec3) -> f64 {
        let off = h - self.round.mu;
        let along = off.dot(self.axis).powi(2);
        let across = off.dot(self.round.mu.cross(self.axis)).powi(2);
        let both = along + across;
        if both > 0.0 { (along / self.ratio + across * self.ratio) / both } else { 1.0 }
    }

    /// The density at unit `h`, per steradian; its integral over the sphere is the weight.
    pub fn density(&self, h: DVec3) -> f64 {
        self.round.weight * height(self.round.kappa, self.factor(h), (h - self.round.mu).length_squared())
    }

    /// The integral of the direction over the lobe: along its mean direction. Where the concentration depends on the direction
    /// about it, so does the mean cosine; its mean over directions by their share in the lobe.
    pub fn mean(&self) -> DVec3 {
        let cosine = |i: i32| {
            let (sin, cos) = (TAU * (f64::from(i) + 0.5) / f64::from(STEPS)).sin_cos();
            vmf::mean_cosine(self.round.kappa / (cos * cos * self.ratio + sin * sin / self.ratio))
        };
        let cosine = if self.ratio > 1.0 { (0..STEPS).map(cosine).sum::<f64>() / f64::from(STEPS) } else { cosine(0) };
        self.round.weight * cosine * self.round.mu
    }

    /// A direction of the lobe for `u` uniform in the unit square.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        let (sin, cos) = (TAU * u[1]).sin_cos();
        let (along, across) = (cos * self.ratio.sqrt(), sin / self.ratio.sqrt());
        let square = along * along + across * across;
        let kappa = self.round.kappa / square;
        let drop = if kappa < 1e-12 { 2.0 * u[0] } else { -(u[0] * (-2.0 * kappa).exp_m1()).ln_1p() / kappa };
        let off = (drop * (2.0 - drop)).max(0.0).sqrt() / square.sqrt();
        let mu = self.round.mu;
        (self.axis * (off * along) + mu.cross(self.axis) * (off * across) + mu * (1.0 - drop)).normalize()
    }

    /// The same with `kernel` added to 2 / concentration, along the axis and across.
    pub fn widened(self, kernel: f64) -> Self {
        let wider = |kappa: f64| kappa / (1.0 + 0.5 * kappa * kernel);
        let (along, across) = (wider(self.round.kappa / self.ratio), wider(self.round.kappa * self.ratio));
        let round = vmf::Lobe { kappa: (along * across).sqrt(), ..self.round };
        Self { round, ratio: if along > 0.0 { (across / along).sqrt() } else { 1.0 }, ..self }
    }
}

/// The density of a lobe of weight 1 at the squared distance `square` from its centre, where the concentration is `kappa` times
/// `factor`.
pub(crate) fn height(kappa: f64, factor: f64, square: f64) -> f64 {
    let here = kappa * factor;
    if here < 1e-12 { 1.0 / (4.0 * PI) } else { kappa / (TAU * -(-2.0 * here).exp_m1()) * (-0.5 * here * square).exp() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_integrate_to_the_weight_and_samples_have_them() {
        for (kappa, ratio) in [(0.5, 1.5), (6.0, 1.0), (40.0, 3.0), (300.0, 8.0)] {
            let round = vmf::Lobe { mu: DVec3::new(0.3, -0.2, 0.9).normalize(), kappa, weight: 0.7 };
            let lobe = Lobe { ratio, ..Lobe::from(round) };
            // The mean over samples of weight / density, in a cap, is its area.
            let drop = (3.0 / (kappa * ratio)).min(1.0);
            let side = 400;
            let unit = |i: i32| (f64::from(i) + 0.5) / f64::from(side);
            let (mut area, mut off) = (0.0, [0.0; 2]);
            let other = round.mu.cross(lobe.axis);
            for i in 0..side * side {
                let h = lobe.sample([unit(i % side), unit(i / side)]);
                if h.dot(round.mu) > 1.0 - drop {
                    area += lobe.round.weight / lobe.density(h) / f64::from(side * side);
                }
                off[0] += h.dot(lobe.axis).powi(2);
                off[1] += h.dot(other).powi(2);
            }
            let expected = TAU * drop;
            assert!((area / expected - 1.0).abs() < 0.02, "{kappa} {ratio}: {area} for {expected}");
            if kappa > 30.0 {
                assert!((off[0] / off[1] / ratio.powi(2) - 1.0).abs() < 0.15, "{kappa} {ratio}: {off:?}");
            }
            if ratio == 1.0 {
                let h = DVec3::new(0.1, 0.4, 0.8).normalize();
                assert!((lobe.density(h) / round.density(h) - 1.0).abs() < 1e-12);
            }
            let wide = lobe.widened(0.02);
            let along = |l: &Lobe| 2.0 * l.ratio / l.round.kappa;
            assert!((along(&wide) - along(&lobe) - 0.02).abs() < 1e-12);
        }
    }
}
