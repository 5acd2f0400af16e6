//! What a reflectance does, in numbers: energy, reciprocity, the highlight's height and width.

use crate::reflectance::Reflectance;
use crate::reflectance::merl::Angles;
use crate::sampling::{luminance, sobol};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Steps of the energy's quadrature over half vectors: polar angle, finer towards the normal, and azimuth.
const STEPS: [usize; 2] = [400, 180];
/// Pairs for the reciprocity error.
const PAIRS: u32 = 20_000;
/// The difference angle of the highlight that is measured: light and viewer 20 degrees from the half vector.
pub const HIGHLIGHT: f64 = 20.0;

/// The highlight at [`HIGHLIGHT`] degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Highlight {
    /// Largest luminance over the half vector's angle, in 1/sr.
    pub peak: f64,
    /// Where it is, in degrees from the normal.
    pub at: f64,
    /// From there to half the peak, in degrees; `None` if the luminance never falls so far.
    pub half_width: Option<f64>,
}

/// The reflected share of light from all sides towards a view `degrees` from the normal, per channel, averaged over turns
/// about the normal. A midpoint rule over half vectors; relative error below 1e-3 for lobes wider than a tenth of a degree.
pub fn albedo(reflectance: &dyn Reflectance, degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let view = DVec3::new(sin, 0.0, cos);
    let mut sum = DVec3::ZERO;
    for i in 0..STEPS[0] {
        let x = (i as f64 + 0.5) / STEPS[0] as f64;
        let theta = FRAC_PI_2 * x.powi(3);
        let ring = theta.sin() * 3.0 * FRAC_PI_2 * x * x / STEPS[0] as f64 * TAU / STEPS[1] as f64;
        for j in 0..STEPS[1] {
            let phi = TAU * (j as f64 + 0.5) / STEPS[1] as f64;
            let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let cosine = view.dot(h);
            let light = 2.0 * cosine * h - view;
            if cosine > 0.0 && light.z > 0.0 {
                sum += reflectance.mean_over_turns(light, view) * (light.z * 4.0 * cosine * ring);
            }
        }
    }
    sum
}

/// The largest difference between both orders of directions at random pairs, as a share of the larger of the two values.
pub fn reciprocity_error(reflectance: &dyn Reflectance) -> f64 {
    let above = |i, seed| {
        let [z, v] = sobol::random(i, seed).map(sobol::to_unit);
        let sine = (1.0 - z * z).sqrt();
        DVec3::new(sine * (TAU * v).cos(), sine * (TAU * v).sin(), z)
    };
    let error = |i| {
        let (wi, wo) = (above(i, 21), above(i, 22));
        let (a, b) = (reflectance.evaluate(wi, wo), reflectance.evaluate(wo, wi));
        let larger = a.max(b).max_element();
        if larger > 0.0 { (a - b).abs().max_element() / larger } else { 0.0 }
    };
    (0..PAIRS).map(error).fold(0.0, f64::max)
}

/// The value at angles of half and difference vector in degrees, the azimuth of the difference across the plane of incidence.
pub fn at(reflectance: &dyn Reflectance, theta_half: f64, theta_diff: f64) -> DVec3 {
    let angles = Angles { theta_half: theta_half.to_radians(), theta_diff: theta_diff.to_radians(), phi_diff: PI / 2.0 };
    let (wi, wo) = angles.directions();
    reflectance.mean_over_turns(wi, wo)
}

/// Finds the highlight on a scan of the half vector's angle that is finer towards the normal.
pub fn highlight(reflectance: &dyn Reflectance) -> Highlight {
    const SCAN: usize = 4000;
    let angle = |i: usize| 70.0 * (i as f64 / SCAN as f64).powi(3);
    let value = |i: usize| luminance(at(reflectance, angle(i), HIGHLIGHT));
    let mut best = (0, 0.0);
    for i in 0..=SCAN {
        let v = value(i);
        if v > best.1 {
            best = (i, v);
        }
    }
    let (i, peak) = best;
    let half = (i..=SCAN).find(|&j| value(j) < 0.5 * peak);
    Highlight { peak, at: angle(i), half_width: half.map(|j| angle(j) - angle(i)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::{BlinnPhong, Ggx};

    #[test]
    fn energies_and_widths_are_the_analytic_ones() {
        let diffuse = Ggx { alpha: 1.0, f0: DVec3::ZERO, albedo: DVec3::splat(0.8) };
        // Schlick's term takes some light from the base of an f0 of 0 away from the normal only.
        assert!((albedo(&diffuse, 0.0).x - 0.8).abs() < 0.04);
        let lambert = BlinnPhong { exponent: 1.0, specular: DVec3::ZERO, albedo: DVec3::new(0.5, 0.25, 1.0) };
        for degrees in [0.0, 45.0, 80.0] {
            let error = (albedo(&lambert, degrees) / lambert.albedo - 1.0).abs().max_element();
            assert!(error < 1e-3, "{degrees}: {error}");
        }
        assert_eq!(highlight(&lambert).half_width, None);
        // cos^e(theta) = 1/2 at the half width; masking plays no part here.
        let sharp = BlinnPhong { exponent: 500.0, specular: DVec3::ONE, albedo: DVec3::ZERO };
        let width = (0.5f64.powf(1.0 / 500.0)).acos().to_degrees();
        let found = highlight(&sharp);
        assert!((found.half_width.unwrap() / width - 1.0).abs() < 0.02 && found.at < 0.1, "{found:?} for {width}");
        assert!(reciprocity_error(&sharp) < 1e-12);
    }

    #[test]
    fn what_is_not_reciprocal_is_found() {
        struct OneSided;
        impl Reflectance for OneSided {
            fn evaluate(&self, wi: DVec3, _: DVec3) -> DVec3 {
                DVec3::splat(wi.z)
            }
        }
        assert!(reciprocity_error(&OneSided) > 0.9);
    }
}
