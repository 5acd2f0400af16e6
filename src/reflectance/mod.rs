//! Reflectance data and models, evaluated in f64: the twins of `glsl/include/reflectance`.

use glam::DVec3;

pub mod ggx;
pub mod importance;
pub mod merl;
pub mod packing;
pub mod stand_in;

pub use ggx::Ggx;
pub use importance::ImportanceTable;
pub use merl::{MerlError, MerlTable};

/// A surface's reflectance in its local frame (z is the normal).
pub trait Reflectance: Send + Sync {
    /// The BRDF in 1/sr without the cosine, per Rec.709 channel; zero if either direction is at or below the horizon.
    /// `wi` points to the light, `wo` to the viewer; both are unit vectors.
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3;
}

/// The reflectances that the renderer shades.
#[derive(Clone, Debug)]
pub enum Model {
    /// A measured (or measured-like) isotropic table at MERL resolution.
    Table(std::sync::Arc<MerlTable>),
    /// Analytic microfacets over a diffuse base.
    Ggx(Ggx),
}

impl Reflectance for Model {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        match self {
            Self::Table(table) => table.evaluate(wi, wo),
            Self::Ggx(ggx) => ggx.evaluate(wi, wo),
        }
    }
}

/// The neighbours and the weight of the second at `unit` of an axis of `bins` over [0, 1]: linear between bin centres.
fn clamped(unit: f64, bins: usize) -> (usize, usize, f64) {
    let x = (unit * bins as f64 - 0.5).clamp(0.0, (bins - 1) as f64);
    (x as usize, (x as usize + 1).min(bins - 1), x.fract())
}
