//! Lobe bandwidths kept on disk by the content of the model: an entry's content is their texels as little-endian 32-bit floats.

use crate::offline::{cache, model_key};
use crate::reflectance::{LobeBandwidth, Model};
use std::path::{Path, PathBuf};

/// Changes with whatever changes the result for one model and threshold.
const VERSION: &[u8] = b"passband lobe bandwidth 1";

/// The folder of the user's cache in which lobe bandwidths are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("lobes")
}

/// The lobe bandwidth of `model` at threshold `eps`, from `folder` if it is there; otherwise it is built and kept there, if that is possible.
pub fn lobe_bandwidth(model: &Model, eps: f64, folder: Option<&Path>) -> LobeBandwidth {
    let entry = folder.map(|folder| folder.join(name(model, eps)));
    cache::kept(entry.as_deref(), from_bytes, to_bytes, || LobeBandwidth::build(model, eps))
}

/// The entry of a model's content and a threshold.
fn name(model: &Model, eps: f64) -> String {
    format!("{}.lobes", model_key::of(VERSION, &[eps], model))
}

fn to_bytes(bandwidth: &LobeBandwidth) -> Vec<u8> {
    bandwidth.texels().iter().flat_map(|b| b.to_le_bytes()).collect()
}

/// Nothing unless it has as many texels as it should.
fn from_bytes(content: &[u8]) -> Option<LobeBandwidth> {
    LobeBandwidth::from_texels(content.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frequency::environment::EPS;
    use crate::reflectance::Ggx;
    use glam::DVec3;

    fn ggx(alpha: f64) -> Model {
        Model::Ggx(Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO })
    }

    #[test]
    fn entries_are_used_and_damaged_ones_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("deep").join("cache");
        let fresh = lobe_bandwidth(&ggx(0.3), EPS, Some(&place));
        let entry = place.join(name(&ggx(0.3), EPS));
        let kept = std::fs::read(&entry).unwrap();
        // A valid entry of other content is believed: it is read, not computed.
        let other = LobeBandwidth::from_texels(vec![1.0; fresh.texels().len()]).unwrap();
        cache::keep(&entry, &to_bytes(&other));
        assert_eq!(lobe_bandwidth(&ggx(0.3), EPS, Some(&place)), other);
        let mut flipped = kept.clone();
        flipped[100] ^= 1;
        for damaged in [vec![], kept[..kept.len() / 2].to_vec(), flipped] {
            std::fs::write(&entry, damaged).unwrap();
            assert_eq!(lobe_bandwidth(&ggx(0.3), EPS, Some(&place)), fresh);
            assert_eq!(std::fs::read(&entry).unwrap(), kept, "rewritten");
        }
        assert_eq!(std::fs::read_dir(&place).unwrap().count(), 1, "nothing else is left there");
        // A folder that cannot be does not matter.
        assert_eq!(lobe_bandwidth(&ggx(0.3), EPS, Some(&entry)), fresh);
    }
}
