//! Blinn's highlight (Blinn 1977, "Models of Light Reflection for Computer Synthesized Pictures") as a distribution of
//! microfacet normals. Twin of `glsl/include/blinn_phong.glsl`.

use crate::error::{Error, Result};
use crate::reflectance::half_row::Rows;
use crate::reflectance::{Reflectance, cavity};
use glam::DVec3;
use std::f64::consts::PI;

/// `f = specular D G / (4 cos cos) + albedo / pi` with `D = (e + 2) / (2 pi) cos^e(theta_h)`, which fills the projected area
/// (the integral of D cos is one), and the masking of V-cavities (Torrance and Sparrow 1967). `specular` stands in place of a
/// Fresnel term and does not depend on the angle; where it and the albedo add up to more than one, so does the energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnPhong {
    /// Exponent e, at least 0.
    pub exponent: f64,
    /// Reflectance of a microfacet.
    pub specular: DVec3,
    /// Diffuse albedo.
    pub albedo: DVec3,
}

impl BlinnPhong {
    /// Refuses what is not a reflectance.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for an exponent that is negative or not finite in single precision, or a channel of `specular`
    /// or `albedo` outside [0, 1].
    pub fn validate(&self) -> Result<()> {
        if !(self.exponent >= 0.0 && self.exponent <= f32::MAX.into()) {
            return Err(Error::invalid("blinn_phong.exponent", "a finite number >= 0", self.exponent));
        }
        for (field, rgb) in [("blinn_phong.specular", self.specular), ("blinn_phong.albedo", self.albedo)] {
            if !rgb.to_array().iter().all(|c| (0.0..=1.0).contains(c)) {
                return Err(Error::invalid(field, "three numbers in [0, 1]", rgb));
            }
        }
        Ok(())
    }

    /// Density of microfacet normals at unit `h` above the horizon, per steradian. In the squared sine, so that high
    /// exponents keep their precision.
    pub fn distribution(&self, h: DVec3) -> f64 {
        let sine = (h.x * h.x + h.y * h.y).min(1.0);
        let power = if self.exponent == 0.0 { 1.0 } else { (self.exponent / 2.0 * (-sine).ln_1p()).exp() };
        (self.exponent + 2.0) / (2.0 * PI) * power
    }
}

impl Reflectance for BlinnPhong {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let h = (wi + wo).normalize();
        self.specular * (self.distribution(h) * cavity::masking(wi, wo, h)) + self.albedo / PI
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        let (specular, base) = (weights.dot(self.specular), weights.dot(self.albedo) / PI);
        Box::new(move |row, out| {
            cavity::mask(row, specular * self.distribution(row.half(0)), out);
            out.iter_mut().for_each(|value| *value += base);
        })
    }
}
