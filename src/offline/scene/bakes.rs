//! The tables of anisotropic RGL files, which take half a minute to bake, kept on disk by the content of the file.
//!
//! An entry's content: three little-endian 32-bit words, the symmetry, the number of tables and the factor of their entries;
//! then the entries as the GPU reads them.

use crate::offline::cache;
use crate::offline::error::Result;
use crate::reflectance::merl::{MerlTable, PHI_DIFF, THETA_DIFF, THETA_HALF};
use crate::reflectance::turned::{MAX_NODES, TurnedTables};
use sha2::{Digest, Sha256};
use std::path::Path;
use std::sync::Arc;

/// Changes with whatever changes the tables of one file.
const VERSION: &[u8] = b"passband turned tables 1";

const ENTRIES: usize = THETA_HALF * THETA_DIFF * PHI_DIFF;

/// What `bake` makes of `file`, to the precision of the GPU's tables, or what is known of it.
///
/// # Errors
/// Those of `bake`.
pub(super) fn turned(
    file: &[u8],
    cache: Option<&Path>,
    bake: impl FnOnce() -> crate::Result<TurnedTables>,
) -> Result<TurnedTables> {
    let name = || format!("{:x}.turned", Sha256::new().chain_update(VERSION).chain_update(file).finalize());
    let entry = cache.map(|folder| folder.join(name()));
    if let Some(known) = entry.as_ref().and_then(|entry| from_bytes(&cache::read(entry)?)) {
        return Ok(known);
    }
    let baked = bake()?;
    let bytes = to_bytes(&baked);
    if let Some(entry) = &entry {
        cache::keep(entry, &bytes);
    }
    // The same whether they were known or not.
    Ok(from_bytes(&bytes).unwrap_or(baked))
}

fn to_bytes(tables: &TurnedTables) -> Vec<u8> {
    let scale = tables.nodes().iter().map(|table| table.packing_scale()).fold(1.0, f32::max);
    let mut bytes = Vec::with_capacity(12 + 4 * ENTRIES * tables.nodes().len());
    for word in [tables.symmetry(), tables.nodes().len() as u32, scale.to_bits()] {
        bytes.extend(word.to_le_bytes());
    }
    for table in tables.nodes() {
        bytes.extend(table.packed_at(scale).into_iter().flat_map(u32::to_le_bytes));
    }
    bytes
}

/// Nothing unless the entry is what it should be.
fn from_bytes(bytes: &[u8]) -> Option<TurnedTables> {
    let (&[symmetry, count, scale], entries) = bytes.as_chunks::<4>().0.split_first_chunk::<3>()?;
    let [symmetry, count, scale] = [symmetry, count, scale].map(u32::from_le_bytes);
    let (count, scale) = (count as usize, f32::from_bits(scale));
    if count > MAX_NODES || entries.len() != count * ENTRIES || !(scale >= 1.0 && scale.is_finite()) {
        return None;
    }
    let table = |entries: &[[u8; 4]]| {
        let entries: Vec<_> = entries.iter().map(|e| u32::from_le_bytes(*e)).collect();
        Arc::new(MerlTable::unpacked(scale, &entries))
    };
    TurnedTables::new(entries.chunks_exact(ENTRIES).map(table).collect(), symmetry).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn entries_are_used_and_damaged_ones_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let cache = folder.path().join("deep").join("cache");
        let node = |value: f64| Arc::new(MerlTable::from_fn(|h, d, p| DVec3::new(value, h + d, p)));
        let tables = |value| TurnedTables::new(vec![node(value), node(0.3)], 2);
        let get = |file: &[u8], value| turned(file, Some(&cache), || tables(value)).unwrap();
        let fresh = get(b"a", 0.1);
        assert_eq!((fresh.nodes().len(), fresh.symmetry()), (2, 2));
        assert_eq!(get(b"a", 9.0), fresh, "known");
        assert_ne!(get(b"b", 9.0), fresh, "another file");
        assert_eq!(turned(b"a", None, || tables(0.1)).unwrap(), fresh, "the same without a cache");
        let exact = tables(0.1).unwrap();
        let off = |a: &MerlTable, b: &MerlTable| crate::reflectance::bake::error(a, b, 1000).rms;
        assert!(off(&exact.nodes()[0], &fresh.nodes()[0]) < 4e-3);

        assert_eq!(std::fs::read_dir(&cache).unwrap().count(), 2, "nothing else is left there");
        let name = format!("{:x}.turned", Sha256::new().chain_update(VERSION).chain_update(b"a").finalize());
        let kept = std::fs::read(cache.join(&name)).unwrap();
        assert_eq!(kept[32..], to_bytes(&fresh), "packing loses nothing the second time");
        let mut flipped = kept.clone();
        flipped[100] ^= 1;
        let wrong = |words: [u32; 3]| {
            cache::keep(&cache.join(&name), &words.map(u32::to_le_bytes).concat());
            std::fs::read(cache.join(&name)).unwrap()
        };
        let claims = [[1, u32::MAX, 0x3f80_0000], [0, 0, 0x3f80_0000], [1, 1, 0x7f80_0000]].map(wrong);
        for damaged in [vec![], kept[..kept.len() / 2].to_vec(), flipped].into_iter().chain(claims) {
            std::fs::write(cache.join(&name), damaged).unwrap();
            assert_eq!(get(b"a", 0.1), fresh);
            assert_eq!(std::fs::read(cache.join(&name)).unwrap(), kept, "rewritten");
        }
        // A folder that cannot be does not matter.
        assert_eq!(turned(b"a", Some(&cache.join(&name)), || tables(0.1)).unwrap(), fresh);
    }
}
