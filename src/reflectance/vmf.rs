//! Mixtures of von Mises-Fisher lobes of microfacet normals (Xu et al. 2017, "Real-time linear BRDF MIP-mapping",
//! equations 6 and 14).

use crate::distribution::vmf::{Lobe, mean_cosine, normalisation};
use crate::error::{Error, Result};
use crate::reflectance::half_row::Rows;
use crate::reflectance::{Reflectance, cavity};
use glam::DVec3;

/// Lobes that a mixture may have.
pub const MAX_LOBES: usize = 8;

/// The least projected area of a mixture, as a share of its weight: with less, the surface would face away from its normal.
pub(crate) const LEAST_PROJECTED_AREA: f64 = 0.05;

/// `f = D G / (4 cos cos)`: D is the lobes' mixture over the projected area that Xu's characteristic vectors give it,
/// `n . sum(w r) / sum(w)` with `r = (coth kappa - 1/kappa) mu`, so that the integral of D cos over the sphere is the sum of
/// the weights, which thus is the reflectance; G is that of V-cavities (Torrance and Sparrow 1967). Grey. In general not
/// isotropic. The part of a lobe below the horizon counts in the projected area: a lobe along the normal has 2 % too much
/// energy at a concentration of 3, 36 % at 1; and V-cavities keep energy for mixtures that are balanced about the normal, where
/// others send more than their weight towards the side they lean to.
#[derive(Clone, Debug, PartialEq)]
pub struct Vmf {
    lobes: Vec<Lobe>,
    /// Sum of the weights over the projected area times each lobe's weight and normalisation: D at the lobe's centre.
    peaks: Vec<f64>,
}

impl Vmf {
    /// A mixture; mean directions are normalised.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for none or more than [`MAX_LOBES`] lobes, a mean direction without length, a concentration
    /// or weight that is negative or not finite in single precision, weights of sum 0, or lobes that on the whole do not
    /// face along the normal.
    pub fn new(lobes: &[Lobe]) -> Result<Self> {
        if lobes.is_empty() || lobes.len() > MAX_LOBES {
            return Err(Error::invalid("vmf", format!("1 to {MAX_LOBES} lobes"), lobes.len()));
        }
        for (i, lobe) in lobes.iter().enumerate() {
            let length = lobe.mu.length();
            if !(length.is_finite() && length > 0.0) {
                return Err(Error::invalid(format!("vmf.{i}.mu"), "a finite vector that is not 0", lobe.mu));
            }
            for (field, value) in [("kappa", lobe.kappa), ("weight", lobe.weight)] {
                if !(value >= 0.0 && value <= f32::MAX.into()) {
                    return Err(Error::invalid(format!("vmf.{i}.{field}"), "a finite number >= 0", value));
                }
            }
        }
        let lobes: Vec<_> = lobes.iter().map(|l| Lobe { mu: l.mu.normalize(), ..*l }).collect();
        let weight: f64 = lobes.iter().map(|l| l.weight).sum();
        let facing: f64 = lobes.iter().map(|l| l.weight * mean_cosine(l.kappa) * l.mu.z).sum();
        if weight <= 0.0 {
            return Err(Error::invalid("vmf", "weights of a sum above 0", weight));
        }
        let area = facing / weight;
        if area < LEAST_PROJECTED_AREA {
            let expected = format!("lobes whose projected area is at least {LEAST_PROJECTED_AREA} of their weight");
            return Err(Error::invalid("vmf", expected, area));
        }
        Ok(Self::over(area, lobes))
    }

    fn over(area: f64, lobes: Vec<Lobe>) -> Self {
        let peaks = lobes.iter().map(|l| l.weight * normalisation(l.kappa) / area).collect();
        Self { lobes, peaks }
    }

    /// The mixture with every lobe's concentration replaced by `kappa`, at least 0. Where its projected area would be less
    /// than 0.05 of its weight, which [`Self::new`] refuses, it counts as that much.
    pub(crate) fn with_concentration(&self, kappa: f64) -> Self {
        let lobes: Vec<_> = self.lobes.iter().map(|l| Lobe { kappa, ..*l }).collect();
        let weight: f64 = lobes.iter().map(|l| l.weight).sum();
        let facing: f64 = lobes.iter().map(|l| l.weight * l.mu.z).sum();
        Self::over((mean_cosine(kappa) * facing / weight).max(LEAST_PROJECTED_AREA), lobes)
    }

    /// The mixture with `kernel` added to every lobe's 2 / concentration; its projected area as in [`Self::with_concentration`].
    pub(crate) fn widened(&self, kernel: f64) -> Self {
        let widen = |l: &Lobe| Lobe { kappa: l.kappa / (1.0 + 0.5 * l.kappa * kernel), ..*l };
        let lobes: Vec<_> = self.lobes.iter().map(widen).collect();
        let weight: f64 = lobes.iter().map(|l| l.weight).sum();
        let facing: f64 = lobes.iter().map(|l| l.weight * mean_cosine(l.kappa) * l.mu.z).sum();
        Self::over((facing / weight).max(LEAST_PROJECTED_AREA), lobes)
    }

    /// The lobes, mean directions of length one.
    pub fn lobes(&self) -> &[Lobe] {
        &self.lobes
    }

    /// What each lobe contributes to the density of normals at its own mean direction, per steradian.
    pub fn peaks(&self) -> &[f64] {
        &self.peaks
    }

    /// The density of microfacet normals at unit `h`, per steradian, times the sum of the weights. From `|h - mu|^2`, not
    /// `1 - mu.h`, so that sharp lobes keep their precision.
    pub fn distribution(&self, h: DVec3) -> f64 {
        let lobes = self.lobes.iter().zip(&self.peaks);
        lobes.map(|(l, peak)| peak * (-0.5 * l.kappa * (h - l.mu).length_squared()).exp()).sum()
    }

    /// [`Self::distribution`] averaged over the half vector's azimuth: each lobe becomes a ring,
    /// `e^(kappa (cos cos - 1)) I0(kappa sin sin)`.
    pub fn ring(&self, h: DVec3) -> f64 {
        let theta = h.x.hypot(h.y).atan2(h.z);
        let lobes = self.lobes.iter().zip(&self.peaks);
        lobes
            .map(|(l, peak)| {
                let sine = l.mu.x.hypot(l.mu.y);
                let nearest = (0.5 * (theta - sine.atan2(l.mu.z))).sin().powi(2);
                peak * (-2.0 * l.kappa * nearest).exp() * bessel_i0_scaled(l.kappa * sine * theta.sin())
            })
            .sum()
    }

    fn evaluate_with(&self, wi: DVec3, wo: DVec3, distribution: impl Fn(DVec3) -> f64) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let h = (wi + wo).normalize();
        DVec3::splat(distribution(h) * cavity::masking(wi, wo, h))
    }
}

impl Reflectance for Vmf {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.evaluate_with(wi, wo, |h| self.distribution(h))
    }

    fn isotropic(&self) -> bool {
        self.lobes.iter().all(|l| l.kappa == 0.0 || l.weight == 0.0 || (l.mu.x == 0.0 && l.mu.y == 0.0))
    }

    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.evaluate_with(wi, wo, |h| self.ring(h))
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        let weight = weights.element_sum();
        Box::new(move |row, out| cavity::mask(row, weight * self.ring(row.half(0)), out))
    }
}

/// `e^-x I0(x)` for x >= 0 (Abramowitz and Stegun 9.8.1 and 9.8.2, relative error below 3e-7).
fn bessel_i0_scaled(x: f64) -> f64 {
    let polynomial = |coefficients: &[f64], t: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        (-x).exp() * polynomial(&[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3], t)
    } else {
        const FAR: [f64; 9] = [
            0.398_942_28,
            0.013_285_92,
            0.002_253_19,
            -0.001_575_65,
            0.009_162_81,
            -0.020_577_06,
            0.026_355_37,
            -0.016_476_33,
            0.003_923_77,
        ];
        polynomial(&FAR, 3.75 / x) / x.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_functions() {
        // I0(1) = 1.2660658777520084, I0(5) = 27.239871823604442, I0(20) = 43558282.559553534.
        for (x, i0) in [(0.0, 1.0), (1.0, 1.266_065_877_752), (5.0, 27.239_871_823_6), (20.0f64, 43_558_282.559_553_5)] {
            let error = bessel_i0_scaled(x) / (i0 * (-x).exp()) - 1.0;
            assert!(error.abs() < 3e-7, "{x}: {error:e}");
        }
    }
}
