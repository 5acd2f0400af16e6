//! Von Mises-Fisher lobes over the sphere (Xu et al. 2017, "Real-time linear BRDF MIP-mapping", equation 6; Mardia and Jupp
//! 2000, "Directional Statistics", section 9.3.2). Twin of `glsl/include/vmf.glsl`.
//!
//! Where r is close to 1, its complement is what can be told: the *spread* `1 - r` is used wherever a concentration is meant.

use crate::reflectance::frame;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// The least spread that [`concentration`] tells from none, about that of neighbouring numbers of 32 bits.
pub const LEAST_SPREAD: f64 = 1e-7;

/// Concentrations below this take series, where closed forms would cancel.
const SERIES_BELOW: f64 = 0.05;

/// One lobe: `weight c(kappa) e^(kappa (mu.h - 1))` per steradian of h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Mean direction in the tangent frame.
    pub mu: DVec3,
    /// Concentration, at least 0.
    pub kappa: f64,
    /// Weight, at least 0.
    pub weight: f64,
}

impl Lobe {
    /// The density at unit `h`, per steradian; its integral over the sphere is the weight. From `|h - mu|^2`, not `1 - mu.h`,
    /// so that sharp lobes keep their precision.
    pub fn density(&self, h: DVec3) -> f64 {
        self.weight * normalisation(self.kappa) * (-0.5 * self.kappa * (h - self.mu).length_squared()).exp()
    }

    /// The integral of the direction over the lobe: its weight times Xu's characteristic vector r (equation 8, exact).
    pub fn mean(&self) -> DVec3 {
        self.weight * mean_cosine(self.kappa) * self.mu
    }

    /// A direction of the lobe for `u` uniform in the unit square, by the inverse of its distribution function.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        // 1 - cos; at concentration 0 the limit.
        let drop = if self.kappa < 1e-12 { 2.0 * u[0] } else { -(u[0] * (-2.0 * self.kappa).exp_m1()).ln_1p() / self.kappa };
        let sine = (drop * (2.0 - drop)).max(0.0).sqrt();
        let [x, y] = frame::basis(self.mu);
        let (sin, cos) = (TAU * u[1]).sin_cos();
        (x * (sine * cos) + y * (sine * sin) + self.mu * (1.0 - drop)).normalize()
    }
}

/// `kappa / (2 pi (1 - e^(-2 kappa)))`, the density of a lobe at its centre; `1 / (4 pi)` at 0.
pub fn normalisation(kappa: f64) -> f64 {
    if kappa < 1e-12 { 1.0 / (4.0 * PI) } else { kappa / (2.0 * PI * -(-2.0 * kappa).exp_m1()) }
}

/// `A3(kappa) = coth kappa - 1/kappa`, the length of a lobe's mean vector.
pub fn mean_cosine(kappa: f64) -> f64 {
    if kappa < SERIES_BELOW {
        let square = kappa * kappa;
        kappa * (1.0 / 3.0 - square * (1.0 / 45.0 - square * (2.0 / 945.0 - square / 4725.0)))
    } else {
        1.0 / kappa.tanh() - 1.0 / kappa
    }
}

/// `1 - A3(kappa)`, relatively precise for sharp lobes.
pub fn spread(kappa: f64) -> f64 {
    if kappa < SERIES_BELOW { 1.0 - mean_cosine(kappa) } else { 1.0 / kappa - 2.0 / (2.0 * kappa).exp_m1() }
}

/// The concentration of a given [`spread`], which is clamped to at least [`LEAST_SPREAD`] and at most 1: Banerjee's estimate
/// (within 5 %), then three Newton steps on A3, each of which squares the relative error.
pub fn concentration(spread_of_lobe: f64) -> f64 {
    let e = spread_of_lobe.clamp(LEAST_SPREAD, 1.0);
    let estimate = super::literal::concentration(e);
    (0..3).fold(estimate, |kappa, _| kappa - (e - spread(kappa)) / slope(kappa))
}

/// `A3'(kappa) = 1/kappa^2 - 1/sinh^2 kappa`.
fn slope(kappa: f64) -> f64 {
    let square = kappa * kappa;
    if kappa < SERIES_BELOW {
        1.0 / 3.0 - square * (1.0 / 15.0 - square * (2.0 / 189.0 - square / 675.0))
    } else {
        1.0 / square - kappa.sinh().powi(-2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Concentrations from `10^from` to `10^to`.
    fn decades(from: f64, to: f64) -> impl Iterator<Item = f64> {
        (0..=2000).map(move |i| 10f64.powf(from + (to - from) * f64::from(i) / 2000.0))
    }

    #[test]
    fn forms_meet_and_have_their_limits() {
        for f in [mean_cosine, spread, slope] {
            let (below, above) = (f(SERIES_BELOW * (1.0 - 1e-15)), f(SERIES_BELOW));
            assert!((below / above - 1.0).abs() < 1e-11, "{below} {above}");
        }
        assert_eq!([mean_cosine(0.0), spread(0.0), concentration(1.0)], [0.0, 1.0, 0.0]);
        assert!((mean_cosine(1e6) - (1.0 - 1e-6)).abs() < 1e-12);
        // coth 1 - 1.
        assert!((mean_cosine(1.0) - 0.313_035_285_499_331).abs() < 1e-14);
        assert!((normalisation(1e-9) * 4.0 * PI - 1.0).abs() < 1e-8);
        assert!((normalisation(1.0) - 0.184_065_5).abs() < 1e-7);
        // What is no spread stays finite.
        assert!((concentration(0.0) * LEAST_SPREAD - 1.0).abs() < 1e-9 && concentration(-1.0) == concentration(0.0));
    }

    #[test]
    fn concentration_inverts_the_spread() {
        let worst = decades(-3.0, 6.0).map(|k| (concentration(spread(k)) / k - 1.0).abs()).fold(0.0, f64::max);
        println!("relative error {worst:.1e}");
        assert!(worst < 1e-7, "{worst:e}");
        // The slope is the derivative.
        for kappa in [1e-3, 0.04, 0.06, 1.0, 30.0] {
            let step = 1e-4 * kappa;
            let difference = (mean_cosine(kappa + step) - mean_cosine(kappa - step)) / (2.0 * step);
            assert!((difference / slope(kappa) - 1.0).abs() < 1e-6, "{kappa}");
        }
    }

    #[test]
    fn samples_follow_the_density() {
        let mu = DVec3::new(0.3, -0.5, 0.7).normalize();
        for kappa in [0.0, 0.5, 7.0, 900.0, 3e6] {
            let lobe = Lobe { mu, kappa, weight: 2.5 };
            // Strata: the mean of directions and the share within a cone are integrals of the density.
            let side = 500;
            let unit = |i: i32| (f64::from(i) + 0.5) / f64::from(side);
            let all: Vec<_> = (0..side * side).map(|i| lobe.sample([unit(i % side), unit(i / side)])).collect();
            assert!(all.iter().all(|h| h.is_normalized()));
            let mean = all.iter().sum::<DVec3>() / all.len() as f64;
            assert!((mean - lobe.mean() / lobe.weight).length() < 1e-3 / kappa.max(1.0), "{kappa}: {mean}");
            // By the closed form, the cosine above which half of the lobe lies; half the samples are there.
            let drop = if kappa == 0.0 { 1.0 } else { -(0.5 * (1.0 + (-2.0 * kappa).exp())).ln() / kappa };
            let inside = all.iter().filter(|h| 0.5 * (**h - mu).length_squared() < drop).count() as f64 / all.len() as f64;
            assert!((inside - 0.5).abs() < 0.005, "{kappa}: {inside}");
            // The density is that of the distribution function: over the half's cone it integrates to half.
            let steps = 4000;
            let ring = |i: i32| {
                let t = drop * (f64::from(i) + 0.5) / f64::from(steps);
                let [x, _] = frame::basis(mu);
                TAU * lobe.density(mu * (1.0 - t) + x * (t * (2.0 - t)).sqrt()) * drop / f64::from(steps)
            };
            let half: f64 = (0..steps).map(ring).sum();
            assert!((half / (0.5 * lobe.weight) - 1.0).abs() < 1e-6, "{kappa}: {half}");
        }
    }
}
