//! What pre-convolved light is looked up with: a reflectance seen from one direction as von Mises-Fisher lobes of light
//! directions.
//! Twin of `glsl/include/reflected.glsl`.
//!
//! A lobe of half vectors about m of concentration k is one of light directions about reflect(-o, m) of concentration k / 4|o.m|
//! (Wang et al. 2009, "All-frequency rendering of dynamic, spatially-varying reflectance", section 3.2); Fresnel, masking and
//! cosine are taken at its centre. Grazing lobes are narrower across the plane of incidence than in it; this is the mean.

use crate::distribution::vmf::normalisation;
use crate::reflectance::{Model, cavity};
use glam::DVec3;
use std::f64::consts::PI;

/// A lobe of light directions, normalised over the sphere, and what it is multiplied by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectedLobe {
    /// Its centre in the local frame, unit.
    pub direction: DVec3,
    /// Its concentration.
    pub kappa: f64,
    /// Factor on the light under it, cosine included.
    pub weight: DVec3,
}

/// Lobes and diffuse reflectance (a factor on irradiance, in 1/sr) of a model seen from `wo` (unit, above the horizon, in the
/// frame that the model is evaluated in). `None` for tables, which have no lobes of their own.
pub fn reflected(model: &Model, wo: DVec3) -> Option<(Vec<ReflectedLobe>, DVec3)> {
    Some(match model {
        Model::Table(_) | Model::Turned(_) => return None,
        Model::Ggx(g) => {
            let square = g.alpha * g.alpha;
            let schlick = |cosine: f64| g.f0 + (DVec3::ONE - g.f0) * (1.0 - cosine).max(0.0).powi(5);
            let masking = |c: f64| c + (square + (1.0 - square) * c * c).sqrt();
            let value = schlick(wo.z) / (masking(wo.z) * masking(wo.z));
            // Of diffuse light, whose mean direction is the normal.
            let diffuse = g.albedo * (DVec3::ONE - schlick((0.5 + 0.5 * wo.z).sqrt())) / PI;
            (lobe(wo, DVec3::Z, 2.0 / square, 1.0 / (PI * square), |_| value).into_iter().collect(), diffuse)
        }
        Model::BlinnPhong(b) => {
            let kappa = b.exponent + 2.0;
            let value = |wi| b.specular * cavity::masking(wi, wo, DVec3::Z);
            (lobe(wo, DVec3::Z, kappa, kappa / (2.0 * PI), value).into_iter().collect(), b.albedo / PI)
        }
        Model::Vmf(vmf) => {
            let lobes = vmf.lobes().iter().zip(vmf.peaks());
            let reflected =
                lobes.filter_map(|(l, &peak)| lobe(wo, l.mu, l.kappa, peak, |wi| DVec3::splat(cavity::masking(wi, wo, l.mu))));
            (reflected.collect(), DVec3::ZERO)
        }
    })
}

/// The lobe of half vectors about `m` whose density at the centre is `peak`; `value` is the BRDF there over that density. None
/// where its centre is seen from behind or reflects below the horizon.
fn lobe(wo: DVec3, m: DVec3, kappa: f64, peak: f64, value: impl Fn(DVec3) -> DVec3) -> Option<ReflectedLobe> {
    let cosine = wo.dot(m);
    let direction = m * (2.0 * cosine) - wo;
    if cosine <= 0.0 || direction.z <= 0.0 {
        return None;
    }
    let kappa = kappa / (4.0 * cosine);
    Some(ReflectedLobe { direction, kappa, weight: value(direction) * (direction.z * peak / normalisation(kappa)) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::{BlinnPhong, Ggx, Lobe, Reflectance, Vmf};
    use std::sync::Arc;

    /// Reflectance by quadrature about the lobe's centre.
    fn reflectance(model: &Model, wo: DVec3, centre: DVec3, width: f64) -> DVec3 {
        let x = centre.any_orthonormal_vector();
        let y = centre.cross(x);
        let (rings, spokes) = (600, 96);
        let mut sum = DVec3::ZERO;
        for i in 0..rings {
            let t = (f64::from(i) + 0.5) / f64::from(rings);
            let (theta, step) = (width * t, width / f64::from(rings));
            for k in 0..spokes {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(spokes)).sin_cos();
                let wi = (centre * theta.cos() + (x * c + y * s) * theta.sin()).normalize();
                sum += model.evaluate(wi, wo) * (wi.z.max(0.0) * theta.sin() * step * std::f64::consts::TAU / f64::from(spokes));
            }
        }
        sum
    }

    #[test]
    fn sharp_lobes_hold_the_reflectance() {
        let f0 = DVec3::new(0.9, 0.5, 0.1);
        let vmf = |mu: DVec3| Model::Vmf(Arc::new(Vmf::new(&[Lobe { mu, kappa: 4e4, weight: 0.7 }]).unwrap()));
        let models = [
            Model::BlinnPhong(BlinnPhong { exponent: 2e4, specular: f0, albedo: DVec3::ZERO }),
            vmf(DVec3::Z),
            vmf(DVec3::new(0.1, 0.2, 1.0)),
        ];
        for model in models {
            for angle in [0.0f64, 0.5, 1.0, 1.3] {
                let wo = DVec3::new(angle.sin(), 0.0, angle.cos());
                let (lobes, _) = reflected(&model, wo).unwrap();
                let found = lobes[0].weight;
                let expected = reflectance(&model, wo, lobes[0].direction, 0.3);
                let error = ((found - expected) / expected).abs().max_element();
                assert!(error < 0.01, "{model:?} {angle}: {found} {expected}");
            }
        }
        // GGX has a tail outside: less than a hundredth here.
        let ggx = Model::Ggx(Ggx { alpha: 0.01, f0, albedo: DVec3::ZERO });
        let (lobes, diffuse) = reflected(&ggx, DVec3::new(0.6, 0.0, 0.8)).unwrap();
        let expected = reflectance(&ggx, DVec3::new(0.6, 0.0, 0.8), lobes[0].direction, 0.5);
        assert!(((lobes[0].weight - expected) / expected).abs().max_element() < 0.01, "{lobes:?} {expected}");
        assert_eq!(diffuse, DVec3::ZERO);
    }

    #[test]
    fn lobes_that_are_not_seen_are_none() {
        let lobe = Lobe { mu: DVec3::new(-1.0, 0.0, 0.3), kappa: 10.0, weight: 1.0 };
        let upright = Lobe { mu: DVec3::Z, ..lobe };
        let vmf = Model::Vmf(Arc::new(Vmf::new(&[lobe, upright]).unwrap()));
        assert_eq!(reflected(&vmf, DVec3::new(0.9, 0.0, 0.436).normalize()).unwrap().0.len(), 1);
    }
}
