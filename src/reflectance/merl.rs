//! MERL tables.
use crate::reflectance::Reflectance;
use glam::DVec3;

/// An isotropic table of 90 x 90 x 180 reflectances (theta_half, theta_diff, phi_diff).
#[derive(Clone, Debug)]
pub struct MerlTable {}
impl Reflectance for MerlTable {
    fn evaluate(&self, _wi: DVec3, _wo: DVec3) -> DVec3 {
        DVec3::ZERO
    }
}
