//! Lobe fits kept on disk by the content of the model. An entry's content is little-endian 64-bit floats: the number of lobes, then for
//! each node its lobes (tilt, log2 concentration, amplitude), its cosine part and its error.

use crate::distribution::fit::{FitLobe, FitNode, MOST_LOBES};
use crate::distribution::{Budget, LobeFit};
use crate::offline::{cache, model_key};
use crate::reflectance::Model;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Changes with whatever changes the result for one model and budget.
const VERSION: &[u8] = b"passband lobe fit 2";
/// Numbers of a lobe, and of a node beside its lobes.
const NUMBERS: [usize; 2] = [5, 4];

/// The folder of the user's cache in which lobe fits are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("fits")
}

/// The fit of `model` within `budget`, from `folder` if it is there; otherwise it is built and kept there, if that is possible.
pub fn lobe_fit(model: &Model, budget: Budget, folder: Option<&Path>) -> LobeFit {
    let entry = folder.map(|folder| folder.join(name(model, budget)));
    cache::kept(entry.as_deref(), from_bytes, to_bytes, || LobeFit::build(model, budget))
}

fn name(model: &Model, budget: Budget) -> String {
    format!("{}.fit", model_key::of(VERSION, &[budget.lobes as f64, budget.error], model))
}

fn to_bytes(fit: &LobeFit) -> Vec<u8> {
    let mut numbers = vec![fit.count() as f64];
    for node in fit.nodes() {
        for lobe in &node.lobes {
            numbers.extend([lobe.tilt, lobe.log2_kappa]);
            numbers.extend(lobe.amplitude.to_array());
        }
        numbers.extend(node.diffuse.to_array());
        numbers.push(node.error);
    }
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Nothing unless it is the nodes of a fit.
fn from_bytes(content: &[u8]) -> Option<LobeFit> {
    let numbers: Vec<f64> = content.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let (count, nodes) = numbers.split_first()?;
    // More would not be valid.
    let lobe_numbers = NUMBERS[0] * (*count as usize).min(MOST_LOBES + 1);
    let node = |numbers: &[f64]| {
        let (lobes, rest) = numbers.split_at_checked(lobe_numbers)?;
        let [red, green, blue, error] = rest.try_into().ok()?;
        let lobe = |l: &[f64; NUMBERS[0]]| FitLobe { tilt: l[0], log2_kappa: l[1], amplitude: DVec3::new(l[2], l[3], l[4]) };
        let lobes = lobes.as_chunks().0.iter().map(lobe).collect();
        Some(FitNode { lobes, diffuse: DVec3::new(red, green, blue), error })
    };
    LobeFit::new(nodes.chunks(lobe_numbers + NUMBERS[1]).map(node).collect::<Option<_>>()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::Ggx;

    #[test]
    fn entries_are_used_and_damaged_ones_replaced() {
        let model = Model::Ggx(Ggx { alpha: 0.3, f0: DVec3::new(0.9, 0.5, 0.1), albedo: DVec3::splat(0.1) });
        let budget = Budget { lobes: 4, error: 0.0 };
        let folder = tempfile::tempdir().unwrap();
        let fresh = lobe_fit(&model, budget, Some(folder.path()));
        assert!(fresh.count() > 1);
        let entry = folder.path().join(name(&model, budget));
        let kept = std::fs::read(&entry).unwrap();
        assert_eq!(from_bytes(&to_bytes(&fresh)), Some(fresh.clone()));
        // A valid entry of other content is believed: it is read, not computed.
        let nodes = fresh.nodes().iter().map(|n| FitNode { error: 0.5, ..n.clone() });
        let other = LobeFit::new(nodes.collect()).unwrap();
        cache::keep(&entry, &to_bytes(&other));
        assert_eq!(lobe_fit(&model, budget, Some(folder.path())), other);
        let whole = to_bytes(&fresh);
        let (short, mut huge) = (whole[..whole.len() - 8].to_vec(), whole);
        huge[..8].copy_from_slice(&1e300f64.to_le_bytes());
        for wrong in [vec![], short, huge] {
            assert_eq!(from_bytes(&wrong), None);
        }
        std::fs::write(&entry, &kept[..kept.len() / 2]).unwrap();
        assert_eq!(lobe_fit(&model, budget, Some(folder.path())), fresh);
        assert_eq!(std::fs::read(&entry).unwrap(), kept, "rewritten");
        assert_ne!(name(&model, budget), name(&model, Budget { lobes: 5, ..budget }));
        assert_ne!(name(&model, budget), name(&model, Budget { error: 0.1, ..budget }));
    }
}
