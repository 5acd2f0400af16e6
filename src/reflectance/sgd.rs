//! The shifted-gamma microfacet model (Bagher, Soler and Holzschuch 2012, "Accurate fitting of measured reflectances using a
//! Shifted Gamma micro-facet distribution"), which that paper fits to the MERL materials. Every parameter is per channel.

use crate::error::{Error, Result};
use crate::reflectance::{MerlTable, Reflectance};
use glam::DVec3;
use std::f64::consts::PI;

/// Parameters by the names of the published table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sgd {
    /// Diffuse albedo.
    pub rhod: DVec3,
    /// Factor on the specular part.
    pub rhos: DVec3,
    /// Roughness, above 0.
    pub alpha: DVec3,
    /// Exponent of the distribution's tail.
    pub p: DVec3,
    /// Fresnel term at normal incidence; beyond 1 and beyond what is physical in published fits.
    pub f0: DVec3,
    /// Its correction, linear in the cosine.
    pub f1: DVec3,
    /// Normalisation of the distribution.
    pub kap: DVec3,
    /// Masking: amplitude.
    pub lambda: DVec3,
    /// Masking: factor in the exponent; up to 1e38 in published fits.
    pub c: DVec3,
    /// Masking: power in the exponent.
    pub k: DVec3,
    /// Masking: polar angle in radians up to which nothing is masked.
    pub theta0: DVec3,
}

/// Names of the parameters, in the order of [`Sgd::from_rows`].
pub const PARAMETERS: [&str; 11] = ["rhod", "rhos", "alpha", "p", "F0", "F1", "kap", "lambda", "c", "k", "theta0"];

impl Sgd {
    /// Parameters in the order of [`PARAMETERS`].
    pub fn from_rows(rows: [[f64; 3]; 11]) -> Self {
        let [rhod, rhos, alpha, p, f0, f1, kap, lambda, c, k, theta0] = rows.map(DVec3::from);
        Self { rhod, rhos, alpha, p, f0, f1, kap, lambda, c, k, theta0 }
    }

    /// Refuses what cannot be evaluated.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a parameter that is not finite, an `alpha` that is not above 0, or a negative `rhod`,
    /// `rhos`, `kap`, `lambda` or `c`.
    pub fn validate(&self) -> Result<()> {
        let all =
            [self.rhod, self.rhos, self.alpha, self.p, self.f0, self.f1, self.kap, self.lambda, self.c, self.k, self.theta0];
        for (name, value) in PARAMETERS.into_iter().zip(all) {
            let (expected, fits): (_, fn(f64) -> bool) = match name {
                "alpha" => ("finite numbers above 0", |v| v > 0.0),
                "rhod" | "rhos" | "kap" | "lambda" | "c" => ("finite numbers >= 0", |v| v >= 0.0),
                _ => ("finite numbers", |_| true),
            };
            if !value.to_array().into_iter().all(|v| v.is_finite() && fits(v)) {
                return Err(Error::invalid(format!("sgd.{name}"), expected, value));
            }
        }
        Ok(())
    }

    /// The table that stands for the model on the GPU, at MERL resolution.
    pub fn bake(&self) -> MerlTable {
        MerlTable::bake(|wi, wo| self.evaluate(wi, wo))
    }

    /// D (equations 9 and 10 of the paper) at the cosine of theta_h.
    fn distribution(&self, channel: usize, cosine: f64) -> f64 {
        let (alpha, p, kap) = (self.alpha[channel], self.p[channel], self.kap[channel]);
        let square = cosine * cosine;
        let x = (1.0 - square) / square;
        let a = alpha + x / alpha;
        // As one exponent: the power alone may overflow where the exponential has long vanished.
        let density = kap * (-a - p * a.ln()).exp() / (PI * square * square);
        if density.is_finite() { density } else { 0.0 }
    }

    /// F (equation 13), not clamped: fits leave [0, 1].
    fn fresnel(&self, channel: usize, cosine: f64) -> f64 {
        let (f0, f1) = (self.f0[channel], self.f1[channel]);
        f0 - cosine * f1 + (1.0 - cosine).powi(5) * (1.0 - f0)
    }

    /// G1 (equation 16) at the polar angle of a direction. Up to theta0 it is one whatever the power; beyond, the exponent
    /// may overflow and is then as good as its limit.
    fn masking(&self, channel: usize, theta: f64) -> f64 {
        let beyond = theta - self.theta0[channel];
        let lambda = self.lambda[channel];
        if beyond <= 0.0 || lambda == 0.0 || self.c[channel] == 0.0 {
            return 1.0;
        }
        let exponent = (self.c[channel] * beyond.powf(self.k[channel])).min(700.0);
        (1.0 - lambda * exponent.exp_m1()).clamp(0.0, 1.0)
    }
}

impl Reflectance for Sgd {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let h = (wi + wo).normalize();
        let cosine = wi.dot(h).clamp(0.0, 1.0);
        let polar = |w: DVec3| w.x.hypot(w.y).atan2(w.z);
        let (theta_i, theta_o) = (polar(wi), polar(wo));
        let channel = |c: usize| {
            let masking = self.masking(c, theta_i) * self.masking(c, theta_o);
            let specular = if masking > 0.0 {
                self.rhos[c] * self.distribution(c, h.z) * self.fresnel(c, cosine) * masking / (wi.z * wo.z)
            } else {
                0.0
            };
            ((self.rhod[c] + specular) / PI).max(0.0)
        };
        DVec3::new(channel(0), channel(1), channel(2))
    }
}
