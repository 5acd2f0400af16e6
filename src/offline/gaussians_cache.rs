//! Mixtures of Gaussians kept on disk by the content of the maps that they are fitted to. An entry's content is the label of each lobe, one
//! byte each, then the texels from level 1 on as little-endian 32-bit floats.

use crate::distribution::alignment::{Fit, Order};
use crate::distribution::effective::Rule;
use crate::distribution::filtered::Area;
use crate::distribution::gaussians::TEXEL;
use crate::distribution::{BrdfMap, Filter, Gaussians};
use crate::material::Material;
use crate::moments::{Base, Parameter};
use crate::offline::cache;
use crate::texture::halved;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Changes with whatever changes the result for one map.
const VERSION: &[u8] = b"passband gaussians 2";

/// The folder of the user's cache in which mixtures are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("gaussians")
}

/// The mixtures of a material's maps that `filter` needs, if it needs some: from `folder` if they are there; otherwise they are fitted and
/// kept there, if that is possible.
pub fn gaussians(material: &Material, filter: Filter, folder: Option<&Path>) -> Option<Arc<Gaussians>> {
    let fit = filter.gaussians()?;
    let base = Base::of(material, Rule::Exact).filter(|base| !base.lobes().is_empty())?;
    let map = BrdfMap::of(material, base.size(material), Rule::Exact).ok()?;
    Some(Arc::new(of_map(&map, Parameter::of(&material.model), fit, folder)))
}

fn of_map(map: &BrdfMap, parameter: Parameter, fit: Fit, folder: Option<&Path>) -> Gaussians {
    let area: Area = parameter.area();
    let entry = folder.map(|folder| folder.join(name(map, parameter, fit)));
    cache::kept(entry.as_deref(), |content| from_bytes(map, fit, content), to_bytes, || Gaussians::of(map, area, fit))
}

fn name(map: &BrdfMap, parameter: Parameter, fit: Fit) -> String {
    let mut hash = Sha256::new();
    hash.update(VERSION);
    let order = match fit.order {
        Order::Levels => 0u8,
        Order::Scanline => 1,
        Order::Alone => 2,
    };
    hash.update([order, parameter as u8]);
    hash.update(fit.strength.to_le_bytes());
    map.size().iter().for_each(|side| hash.update(side.to_le_bytes()));
    let mut numbers = Vec::new();
    for texel in 0..map.size()[0] as usize * map.size()[1] as usize {
        let lobes = map.texel(texel).iter().flat_map(|l| [l.mu.x, l.mu.y, l.mu.z, l.kappa, l.weight]);
        let normal = map.normal(texel).map(|n| n.to_array());
        numbers.extend(lobes.chain(normal.into_iter().flatten()));
        if numbers.len() > 1 << 16 {
            hash.update(bytes(&numbers));
            numbers.clear();
        }
    }
    hash.update(bytes(&numbers));
    format!("{:x}.gaussians", hash.finalize())
}

fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn to_bytes(all: &Gaussians) -> Vec<u8> {
    let numbers = all.levels().iter().flatten().flatten();
    all.labels().iter().copied().chain(numbers.flat_map(|v| v.to_le_bytes())).collect()
}

/// Nothing unless it is of such a map.
fn from_bytes(map: &BrdfMap, fit: Fit, content: &[u8]) -> Option<Gaussians> {
    let (labels, rest) = content.split_at_checked(map.lobes().len())?;
    let (numbers, []) = rest.as_chunks::<4>() else { return None };
    let numbers: Vec<f32> = numbers.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let (mut texels, []) = numbers.as_chunks::<TEXEL>() else { return None };
    let (mut size, mut levels) = (map.size(), Vec::new());
    while size != [1, 1] {
        size = halved(size);
        let (level, rest) = texels.split_at_checked(size[0] as usize * size[1] as usize)?;
        levels.push(level.to_vec());
        texels = rest;
    }
    Gaussians::known(map, fit, labels.to_vec(), levels).filter(|_| texels.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reflectance::Lobe;
    use glam::DVec3;

    #[test]
    fn entries_are_used_and_damaged_ones_replaced() {
        let lobe = |i: u32| {
            let at = 0.4 * f64::from(i * 7919 % 101) / 101.0;
            Lobe { mu: DVec3::new(at, 0.3 - at * at, 1.0).normalize(), kappa: 90.0, weight: 1.0 }
        };
        let map = |from: u32| BrdfMap::new([13, 9], 1, (from..from + 13 * 9).map(lobe).collect()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let of = |map: &BrdfMap| of_map(map, Parameter::Alpha, Fit::ALIGNED, Some(folder.path()));
        let fresh = of(&map(0));
        let entry = folder.path().join(name(&map(0), Parameter::Alpha, Fit::ALIGNED));
        let kept = std::fs::read(&entry).unwrap();
        assert_eq!(from_bytes(&map(0), Fit::ALIGNED, &to_bytes(&fresh)).as_ref(), Some(&fresh));
        // A valid entry of other content is believed: it is read, not computed.
        let mut other = to_bytes(&fresh);
        other[0] = (other[0] + 1) % 4;
        cache::keep(&entry, &other);
        assert_ne!(of(&map(0)), fresh);
        std::fs::write(&entry, &kept[..kept.len() / 2]).unwrap();
        assert_eq!(of(&map(0)), fresh);
        assert_eq!(std::fs::read(&entry).unwrap(), kept, "rewritten");
        let whole = to_bytes(&fresh);
        let (short, mut nan, mut label) = (whole[..whole.len() - 4].to_vec(), whole.clone(), whole);
        label[3] = 4;
        let end = nan.len() - 4;
        nan[end..].copy_from_slice(&f32::NAN.to_le_bytes());
        for wrong in [vec![], short, nan, label] {
            assert!(from_bytes(&map(0), Fit::ALIGNED, &wrong).is_none());
        }
        // Other maps and other fits have other names.
        let names = [(0, Parameter::Alpha, Fit::ALIGNED), (1, Parameter::Alpha, Fit::ALIGNED), (0, Parameter::Ggx, Fit::ALIGNED)];
        let names = names
            .into_iter()
            .chain([(0, Parameter::Alpha, Fit::ALONE), (0, Parameter::Alpha, Fit { strength: 0.0, ..Fit::ALIGNED })]);
        let names: std::collections::BTreeSet<_> = names.map(|(from, parameter, fit)| name(&map(from), parameter, fit)).collect();
        assert_eq!(names.len(), 5);
    }
}
