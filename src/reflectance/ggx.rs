//! GGX microfacets (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"). Twin of
//! `glsl/include/reflectance/ggx.glsl`.

use crate::error::{Error, Result};
use crate::reflectance::Reflectance;
use crate::reflectance::half_row::Rows;
use glam::DVec3;
use std::f64::consts::PI;

/// Separable Smith GGX with Schlick's Fresnel over a diffuse base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// Roughness alpha in (0, 1].
    pub alpha: f64,
    /// Specular reflectance at normal incidence.
    pub f0: DVec3,
    /// Diffuse albedo.
    pub albedo: DVec3,
}

impl Ggx {
    /// Refuses what is not a reflectance.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for `alpha` outside (0, 1], or a channel of `f0` or `albedo` outside [0, 1].
    pub fn validate(&self) -> Result<()> {
        if !(self.alpha > 0.0 && self.alpha <= 1.0) {
            return Err(Error::invalid("ggx.alpha", "a number in (0, 1]", self.alpha));
        }
        for (field, rgb) in [("ggx.f0", self.f0), ("ggx.albedo", self.albedo)] {
            if !rgb.to_array().iter().all(|c| (0.0..=1.0).contains(c)) {
                return Err(Error::invalid(field, "three numbers in [0, 1]", rgb));
            }
        }
        Ok(())
    }
}

impl Reflectance for Ggx {
    /// D F G1 G1 / (4 cos cos) + albedo (1 - F) / pi (Walter et al. 2007, equations 20, 33, 34; Schlick 1994).
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let h = (wi + wo).normalize();
        let fresnel = schlick(self.f0, wi.dot(h));
        let specular = distribution(self.alpha, h) * masking(self.alpha, wi.z) * masking(self.alpha, wo.z);
        fresnel * specular + self.albedo * (DVec3::ONE - fresnel) / PI
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        // Schlick's term and what it leaves to the base are linear in the power.
        let (normal, edge) = (weights.dot(self.f0), weights.dot(DVec3::ONE - self.f0));
        let base = weights.dot(self.albedo * (DVec3::ONE - self.f0)) / PI;
        Box::new(move |row, out| {
            let shape = distribution(self.alpha, row.half(0)) * masking(self.alpha, row.wo.z);
            for ((value, cosine), light) in out.iter_mut().zip(row.cosines).zip(row.lights) {
                let power = (1.0 - cosine).max(0.0).powi(5);
                *value = (normal + edge * power) * shape * masking(self.alpha, *light) + base * (1.0 - power);
            }
        })
    }
}

/// Density of microfacet normals at unit `h`, per steradian. Written in the squared sine, not 1 - cos^2, so that sharp lobes
/// keep their precision.
pub(crate) fn distribution(alpha: f64, h: DVec3) -> f64 {
    let a = alpha * alpha;
    let sine = h.x * h.x + h.y * h.y;
    a / (PI * (sine + a * h.z * h.z).powi(2))
}

/// Smith's G1 over twice the cosine: a product of two of these is G / (4 cos cos), finite down to the horizon.
pub(crate) fn masking(alpha: f64, cosine: f64) -> f64 {
    let a = alpha * alpha;
    1.0 / (cosine + (a + (1.0 - a) * cosine * cosine).sqrt())
}

/// Fresnel reflectance by Schlick's approximation.
pub(crate) fn schlick(f0: DVec3, cosine: f64) -> DVec3 {
    f0 + (DVec3::ONE - f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}
