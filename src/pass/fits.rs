//! The lobe fits of materials, and how `glsl/include/fit.glsl` reads them.

use crate::distribution::fit::{FitLobe, LobeFit};
use crate::distribution::fitter::Budget;
use crate::material::Material;
use crate::reflectance::Model;
use crate::reflectance::atlas::same_table;
use glam::DVec3;
use std::sync::Arc;

/// The fits of materials that one stands for: not where maps, the filter (`found`) or the mesh's curvature (`widened`) change their
/// lobes. Those that materials do not bring are built, one for all that share a table.
pub(crate) fn of(materials: &[Material], found: &[bool], widened: bool, budget: Budget) -> Vec<Option<Arc<LobeFit>>> {
    let mut built: Vec<(&Model, Arc<LobeFit>)> = Vec::new();
    let mut all = Vec::with_capacity(materials.len());
    for (material, found) in materials.iter().zip(found) {
        let model = &material.model;
        let table = matches!(model, Model::Table(_) | Model::Turned(_));
        let changed = *found || widened || !material.keeps_model();
        if changed && !table {
            all.push(None);
            continue;
        }
        let shared = built.iter().find(|(known, _)| same_table(known, model)).map(|(_, fit)| Arc::clone(fit));
        let fit = material.lobe_fit.clone().or(shared).unwrap_or_else(|| Arc::new(LobeFit::build(model, budget)));
        built.push((model, Arc::clone(&fit)));
        all.push(Some(fit));
    }
    all
}

/// Fits of all materials, packed.
pub(crate) struct Packed {
    /// In words of four. First 0s, for materials without. Then of each fit the spaces between two nodes of the view angle: index of
    /// the first of its lobes and their number, error at both; diffuse reflectance at the first, at the second. And then the lobes
    /// of each space that have an amplitude at either of its nodes: tilt and log2 of the concentration at the first, at the second;
    /// amplitudes at both, in 16 bits each of the greatest, and that.
    pub words: Vec<[u32; 4]>,
    /// Where each material's fit begins.
    pub firsts: Vec<u32>,
    /// The most lobes between two nodes.
    pub most: usize,
}

/// Words of what is known of a space between nodes beside its lobes.
const HEAD: usize = 3;

fn bits(v: DVec3) -> [u32; 4] {
    let [x, y, z] = v.as_vec3().to_array().map(f32::to_bits);
    [x, y, z, 0]
}

/// A lobe at both ends of a space.
fn lobe([a, b]: [&FitLobe; 2]) -> [[u32; 4]; 2] {
    let shape = [a.tilt, a.log2_kappa, b.tilt, b.log2_kappa].map(|v| (v as f32).to_bits());
    let greatest = a.amplitude.abs().max(b.amplitude.abs()).max_element() as f32;
    let step = |v: f64| match greatest > 0.0 {
        true => u32::from(((v / f64::from(greatest)).clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16),
        false => 0,
    };
    let [a, b] = [a.amplitude, b.amplitude].map(|v| v.to_array().map(step));
    [shape, [a[0] | a[1] << 16, a[2] | b[0] << 16, b[1] | b[2] << 16, greatest.to_bits()]]
}

impl Packed {
    /// Of `fits`, of which shared ones are packed once.
    pub fn of(fits: &[Option<Arc<LobeFit>>]) -> Self {
        let mut packed = Self { words: vec![[0; 4]; HEAD], firsts: Vec::new(), most: 0 };
        let mut known: Vec<(*const LobeFit, u32)> = Vec::new();
        for fit in fits {
            let Some(fit) = fit else {
                packed.firsts.push(0);
                continue;
            };
            let place = Arc::as_ptr(fit);
            let first = known.iter().find(|k| k.0 == place).map_or(packed.words.len() as u32, |k| k.1);
            packed.firsts.push(first);
            if first as usize == packed.words.len() {
                known.push((place, first));
                packed.add(fit);
            }
        }
        packed
    }

    fn add(&mut self, fit: &LobeFit) {
        let spaces: Vec<_> = fit.nodes().windows(2).collect();
        let mut first = self.words.len() + HEAD * spaces.len();
        let mut lobes = Vec::new();
        for nodes in spaces {
            let [a, b] = [&nodes[0], &nodes[1]];
            let both = || a.lobes.iter().zip(&b.lobes).map(|(a, b)| [a, b]);
            let before = lobes.len();
            lobes.extend(both().filter(|l| l.iter().any(|l| l.amplitude != DVec3::ZERO)).flat_map(lobe));
            if lobes.len() == before {
                // None at all would be no fit.
                lobes.extend(lobe([&FitLobe::default(); 2]));
            }
            let count = (lobes.len() - before) / 2;
            let [error, next] = [a.error, b.error].map(|e| (e as f32).to_bits());
            self.words.extend([[first as u32, count as u32, error, next], bits(a.diffuse), bits(b.diffuse)]);
            self.most = self.most.max(count);
            first += 2 * count;
        }
        self.words.append(&mut lobes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::fit::{FitNode, NODES};

    fn fit(amplitudes: &[DVec3]) -> Option<Arc<LobeFit>> {
        let lobe = |&amplitude| FitLobe { tilt: 0.5, log2_kappa: 3.0, amplitude };
        let node = FitNode { lobes: amplitudes.iter().map(lobe).collect(), diffuse: DVec3::splat(0.4), error: 0.1 };
        Some(Arc::new(LobeFit::new(vec![node; NODES]).unwrap()))
    }

    #[test]
    fn fits_lie_one_behind_the_other() {
        let grey = DVec3::new(0.1, 0.2, 0.3);
        let (two, three) = (fit(&[grey; 2]), fit(&[grey; 3]));
        let packed = Packed::of(&[None, two.clone(), three, two]);
        let size = |count: usize| (NODES - 1) * (HEAD + 2 * count);
        let starts = [HEAD, HEAD + size(2)];
        assert_eq!(packed.firsts, [0, starts[0] as u32, starts[1] as u32, starts[0] as u32]);
        assert_eq!((packed.words.len(), packed.most), (starts[1] + size(3), 3));
        assert!(packed.words[..HEAD].iter().all(|w| *w == [0; 4]));
        for (start, count) in starts.into_iter().zip([2u32, 3]) {
            let head = packed.words[start + HEAD * 7];
            let lobes = (start + HEAD * (NODES - 1)) as u32;
            assert_eq!(head, [lobes + 2 * count * 7, count, 0.1f32.to_bits(), 0.1f32.to_bits()]);
            assert_eq!(packed.words[start + HEAD * 7 + 1][..3], [0.4f32.to_bits(); 3]);
            assert_eq!(packed.words[head[0] as usize], [0.5f32, 3.0, 0.5, 3.0].map(f32::to_bits));
            let [x, y, z, greatest] = packed.words[head[0] as usize + 1];
            let steps = [x, x >> 16, y, y >> 16, z, z >> 16].map(|v| f64::from(v as u16 as i16) / 32767.0);
            for (step, expected) in steps.into_iter().zip([0.1, 0.2, 0.3, 0.1, 0.2, 0.3]) {
                let found = step * f64::from(f32::from_bits(greatest));
                assert!((found - expected).abs() < 0.3 / 65534.0 + 1e-7, "{found} for {expected}");
            }
        }
    }

    #[test]
    fn lobes_without_amplitude_are_left_out() {
        let packed = Packed::of(&[fit(&[DVec3::ZERO, DVec3::ONE, DVec3::ZERO]), fit(&[DVec3::ZERO]), fit(&[])]);
        assert_eq!(packed.most, 1);
        for first in packed.firsts {
            assert_eq!(packed.words[first as usize][1], 1);
        }
    }
}
