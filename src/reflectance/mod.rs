//! Reflectance data and models, evaluated in f64: the twins of `glsl/include`.
//!
//! **Frames.** z is the normal. An isotropic reflectance does not tell how the frame is turned about it; one that is not
//! ([`Reflectance::isotropic`]) wants directions in the surface's tangent frame.

use glam::{DVec2, DVec3};
use half_row::Rows;
use std::sync::Arc;

pub mod analysis;
pub(crate) mod atlas;
pub mod bake;
pub mod bandwidth;
pub mod blinn_phong;
pub(crate) mod cavity;
mod fine_grid;
pub mod frame;
pub mod ggx;
pub mod half_row;
pub mod importance;
pub(crate) mod ladder;
pub mod merl;
pub mod packing;
mod residual;
pub mod rgl;
pub mod sgd;
#[cfg(feature = "offline")]
pub mod sgd_table;
pub mod stand_in;
pub mod turned;
pub mod vmf;

pub use crate::distribution::vmf::Lobe;
pub use bandwidth::LobeBandwidth;
pub use blinn_phong::BlinnPhong;
pub use ggx::Ggx;
pub use importance::ImportanceTable;
pub use merl::MerlTable;
pub use rgl::Rgl;
pub use sgd::Sgd;
pub use turned::TurnedTables;
pub use vmf::Vmf;

/// What is wrong with a binary reflectance file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} at byte {offset}: expected {expected}, got {got}")]
pub struct DataError {
    /// The part of the file.
    pub field: String,
    /// Where it begins, in bytes from the start.
    pub offset: u64,
    /// What would be right.
    pub expected: String,
    /// What was found.
    pub got: String,
}

pub use DataError as MerlError;

impl DataError {
    /// Shorthand.
    fn new(field: impl Into<String>, offset: usize, expected: impl Into<String>, got: impl ToString) -> Self {
        Self { field: field.into(), offset: offset as u64, expected: expected.into(), got: got.to_string() }
    }
}

/// A surface's reflectance in its local frame (z is the normal).
pub trait Reflectance: Send + Sync {
    /// The BRDF in 1/sr without the cosine, per Rec.709 channel; zero if either direction is at or below the horizon.
    /// `wi` points to the light, `wo` to the viewer; both are unit vectors.
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3;

    /// Whether turning both directions about the normal changes nothing.
    fn isotropic(&self) -> bool {
        true
    }

    /// [`Self::evaluate`] averaged over all turns of both directions about the normal.
    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.evaluate(wi, wo)
    }

    /// [`Self::mean_over_turns`] dotted with `weights`, prepared for many rows of half vectors; the same up to rounding.
    fn rows(&self, weights: DVec3) -> Rows<'_> {
        half_row::one_by_one(self, weights)
    }
}

/// The reflectances that the renderer shades.
#[derive(Clone, Debug)]
pub enum Model {
    /// A measured (or measured-like) isotropic table at MERL resolution.
    Table(Arc<MerlTable>),
    /// Tables at MERL resolution over the half vector's azimuth.
    Turned(Arc<TurnedTables>),
    /// Analytic microfacets over a diffuse base.
    Ggx(Ggx),
    /// A cosine-power distribution of normals over a diffuse base.
    BlinnPhong(BlinnPhong),
    /// A mixture of von Mises-Fisher lobes of normals.
    Vmf(Arc<Vmf>),
}

impl Model {
    fn inner(&self) -> &dyn Reflectance {
        match self {
            Self::Table(table) => table.as_ref(),
            Self::Turned(tables) => tables.as_ref(),
            Self::Ggx(ggx) => ggx,
            Self::BlinnPhong(blinn_phong) => blinn_phong,
            Self::Vmf(vmf) => vmf.as_ref(),
        }
    }
}

impl Reflectance for Model {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.inner().evaluate(wi, wo)
    }

    fn isotropic(&self) -> bool {
        self.inner().isotropic()
    }

    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.inner().mean_over_turns(wi, wo)
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        self.inner().rows(weights)
    }
}

/// `v` turned about the normal by the angle whose cosine and sine `turn` holds.
pub fn turned(turn: DVec2, v: DVec3) -> DVec3 {
    DVec3::new(turn.x * v.x - turn.y * v.y, turn.y * v.x + turn.x * v.y, v.z)
}

/// The neighbours and the weight of the second at `unit` of an axis of `bins` over [0, 1]: linear between bin centres.
fn clamped(unit: f64, bins: usize) -> (usize, usize, f64) {
    let x = (unit * bins as f64 - 0.5).clamp(0.0, (bins - 1) as f64);
    let first = x as usize;
    (first, (first + 1).min(bins - 1), x - first as f64)
}
