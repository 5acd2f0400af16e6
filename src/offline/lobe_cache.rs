//! Lobe bandwidths kept on disk by the content of the model: an entry's content is their texels as little-endian 32-bit floats.

use crate::offline::cache;
use crate::reflectance::{LobeBandwidth, MerlTable, Model};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Changes with whatever changes the result for one model and threshold.
const VERSION: &[u8] = b"passband lobe bandwidth 1";

/// The folder of the user's cache in which lobe bandwidths are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("lobes")
}

/// The lobe bandwidth of `model` at threshold `eps`, from `folder` if it is there; otherwise it is built and kept there, if that is possible.
pub fn lobe_bandwidth(model: &Model, eps: f64, folder: Option<&Path>) -> LobeBandwidth {
    let entry = folder.map(|folder| folder.join(format!("{}.lobes", key(model, eps))));
    if let Some(known) = entry.as_ref().and_then(|entry| from_bytes(&cache::read(entry)?)) {
        return known;
    }
    let built = LobeBandwidth::build(model, eps);
    if let Some(entry) = &entry {
        cache::keep(entry, &to_bytes(&built));
    }
    built
}

/// The name of a model's content and a threshold.
fn key(model: &Model, eps: f64) -> String {
    let mut hash = Sha256::new();
    hash.update(VERSION);
    hash.update(eps.to_le_bytes());
    let mut table = |table: &MerlTable| {
        // What the device shades.
        let (scale, entries) = table.packed();
        hash.update(scale.to_le_bytes());
        hash.update(bytemuck::cast_slice(&entries));
    };
    match model {
        Model::Table(one) => table(one),
        Model::Turned(turned) => turned.nodes().iter().for_each(|node| table(node)),
        _ => {}
    }
    // Shortest decimals that read back as the same numbers, and the model's name.
    match model {
        Model::Table(_) => hash.update("table"),
        Model::Turned(turned) => hash.update(format!("turned {} {}", turned.symmetry(), turned.nodes().len())),
        Model::Ggx(ggx) => hash.update(format!("{ggx:?}")),
        Model::BlinnPhong(blinn_phong) => hash.update(format!("{blinn_phong:?}")),
        Model::Vmf(vmf) => hash.update(format!("{vmf:?}")),
    }
    format!("{:x}", hash.finalize())
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
    use crate::reflectance::{Ggx, stand_in};
    use glam::DVec3;
    use std::sync::Arc;

    fn ggx(alpha: f64) -> Model {
        Model::Ggx(Ggx { alpha, f0: DVec3::ONE, albedo: DVec3::ZERO })
    }

    #[test]
    fn entries_are_used_and_damaged_ones_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("deep").join("cache");
        let fresh = lobe_bandwidth(&ggx(0.3), EPS, Some(&place));
        let entry = place.join(format!("{}.lobes", key(&ggx(0.3), EPS)));
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

    #[test]
    fn other_models_have_other_names() {
        let table = |name| Model::Table(Arc::new(stand_in::table(name).unwrap()));
        let names = [ggx(0.3), ggx(0.3 + 1e-12), table("rough"), table("rubber")].map(|m| key(&m, EPS));
        let distinct: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(distinct.len(), names.len());
        assert_eq!(key(&table("rough"), EPS), names[2]);
        assert_ne!(key(&table("rough"), 2.0 * EPS), names[2], "nor do other thresholds");
    }
}
