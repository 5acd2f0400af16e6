//! Anisotropic reflectance as tables at MERL resolution over the half vector's azimuth, linear between neighbours. In this
//! form swapping the directions turns phi_diff by half a circle and nothing else, so that a table is reciprocal whatever it
//! holds. Twin of `material_evaluate` in `glsl/bridge/materials.glsl`.

use crate::error::{Error, Result};
use crate::reflectance::half_row::Rows;
use crate::reflectance::{MerlTable, Reflectance};
use glam::DVec3;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Tables that one material may have; each takes 5.8 MB of device memory.
pub const MAX_NODES: usize = 64;

/// An anisotropic reflectance of period `TAU / symmetry` in the azimuth of the half vector.
#[derive(Clone, Debug, PartialEq)]
pub struct TurnedTables {
    nodes: Vec<Arc<MerlTable>>,
    symmetry: u32,
    mean: MerlTable,
}

impl TurnedTables {
    /// Tables for half vectors of azimuth `i TAU / (symmetry nodes.len())` from the tangent frame's x axis.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for none or more than [`MAX_NODES`] tables, or a symmetry of 0.
    pub fn new(nodes: Vec<Arc<MerlTable>>, symmetry: u32) -> Result<Self> {
        if nodes.is_empty() || nodes.len() > MAX_NODES {
            return Err(Error::invalid("turned tables", format!("1 to {MAX_NODES}"), nodes.len()));
        }
        if symmetry == 0 {
            return Err(Error::invalid("turned tables' symmetry", "at least 1", symmetry));
        }
        let mean = MerlTable::mean(&nodes);
        Ok(Self { nodes, symmetry, mean })
    }

    /// The tables in the order of azimuth.
    pub fn nodes(&self) -> &[Arc<MerlTable>] {
        &self.nodes
    }

    /// How many times the tables go round the circle.
    pub fn symmetry(&self) -> u32 {
        self.symmetry
    }

    /// Tables per radian of azimuth.
    pub fn nodes_per_radian(&self) -> f64 {
        self.nodes.len() as f64 * f64::from(self.symmetry) / TAU
    }
}

impl Reflectance for TurnedTables {
    fn evaluate(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = wi + wo;
        let x = h.y.atan2(h.x) * self.nodes_per_radian();
        let count = self.nodes.len() as i64;
        let at = |i: i64| self.nodes.get(i.rem_euclid(count) as usize).map_or(DVec3::ZERO, |t| t.evaluate(wi, wo));
        let first = x.floor() as i64;
        at(first).lerp(at(first + 1), x - x.floor())
    }

    fn isotropic(&self) -> bool {
        self.nodes.len() == 1
    }

    /// The mean of a piecewise linear function is that of its nodes.
    fn mean_over_turns(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.mean.evaluate(wi, wo)
    }

    fn rows(&self, weights: DVec3) -> Rows<'_> {
        self.mean.rows(weights)
    }
}
