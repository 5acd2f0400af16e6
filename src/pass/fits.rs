//! The lobe fits of materials as `glsl/include/fit.glsl` reads them.

use crate::distribution::fit::LobeFit;
use std::sync::Arc;

/// Fits of all materials, packed.
pub(crate) struct Packed {
    /// A 0 for materials without; of each fit its number of lobes, then its nodes: diffuse reflectance, error, lobes.
    pub floats: Vec<f32>,
    /// Where each material's fit begins.
    pub firsts: Vec<u32>,
    /// The most lobes of a fit.
    pub most: usize,
}

impl Packed {
    /// Of `fits`, of which shared ones are packed once.
    pub fn of(fits: &[Option<Arc<LobeFit>>]) -> Self {
        let mut packed = Self { floats: vec![0.0], firsts: Vec::new(), most: 0 };
        let mut known: Vec<(*const LobeFit, u32)> = Vec::new();
        for fit in fits {
            let Some(fit) = fit else {
                packed.firsts.push(0);
                continue;
            };
            let place = Arc::as_ptr(fit);
            let first = known.iter().find(|k| k.0 == place).map_or(packed.floats.len() as u32, |k| k.1);
            packed.firsts.push(first);
            if first as usize == packed.floats.len() {
                known.push((place, first));
                packed.add(fit);
            }
        }
        packed
    }

    fn add(&mut self, fit: &LobeFit) {
        self.most = self.most.max(fit.count());
        self.floats.push(fit.count() as f32);
        for node in fit.nodes() {
            self.floats.extend(node.diffuse.as_vec3().to_array());
            self.floats.push(node.error as f32);
            for lobe in &node.lobes {
                self.floats.extend([lobe.tilt as f32, lobe.log2_kappa as f32]);
                self.floats.extend(lobe.amplitude.as_vec3().to_array());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::fit::{FitLobe, FitNode, NODES};
    use glam::DVec3;

    #[test]
    fn fits_lie_one_behind_the_other() {
        let fit = |count: usize, error: f64| {
            let lobe = FitLobe { tilt: 0.5, log2_kappa: 3.0, amplitude: DVec3::new(0.1, 0.2, 0.3) };
            let node = FitNode { lobes: vec![lobe; count], diffuse: DVec3::splat(0.4), error };
            Some(Arc::new(LobeFit::new(vec![node; NODES]).unwrap()))
        };
        let (two, three) = (fit(2, 0.1), fit(3, 0.2));
        let packed = Packed::of(&[None, two.clone(), three, two]);
        let size = |count: usize| 1 + NODES * (4 + 5 * count);
        assert_eq!(packed.firsts, [0, 1, 1 + size(2) as u32, 1]);
        assert_eq!((packed.floats.len(), packed.most), (1 + size(2) + size(3), 3));
        assert_eq!(packed.floats[1..11], [2.0, 0.4, 0.4, 0.4, 0.1, 0.5, 3.0, 0.1, 0.2, 0.3]);
        assert_eq!(packed.floats[1 + size(2)..][..5], [3.0, 0.4, 0.4, 0.4, 0.2]);
    }
}
