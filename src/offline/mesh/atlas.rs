//! Atlases through `uvunwrap`, kept on disk by the content of the mesh.
//!
//! A cache entry's content: two little-endian 32-bit counts of vertices and indices; for every vertex
//! the index of the one that it copies and its two coordinates; the indices.

use crate::offline::cache;
use crate::offline::error::{Error, Result};
use crate::offline::mesh::Mesh;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use uvunwrap::{Density, MeshInput, Options, Packing};

/// Changes with whatever changes the result for one mesh.
const VERSION: &[u8] = b"passband atlas 1, uvunwrap 0.3";

/// Pages that are tried in turn, until one holds every chart.
const PAGE_SIZES: [u32; 3] = [1024, 4096, 16_384];

/// The folder of the user's cache in which atlases are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    cache::folder("atlas")
}

/// A mesh's new vertices and triangles.
#[derive(Debug, PartialEq)]
struct Unwrapped {
    sources: Vec<u32>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u32>,
}

/// `mesh` with the coordinates of an atlas.
pub(super) fn unwrap(mesh: &Mesh, cache: Option<&Path>) -> Result<Mesh> {
    let entry = cache.map(|folder| folder.join(format!("{}.atlas", key(mesh))));
    let known = entry.as_ref().and_then(|entry| Unwrapped::from_bytes(&cache::read(entry)?, mesh));
    let unwrapped = match known {
        Some(unwrapped) => unwrapped,
        None => {
            let unwrapped = compute(mesh)?;
            if let Some(entry) = &entry {
                cache::keep(entry, &unwrapped.to_bytes());
            }
            unwrapped
        }
    };
    let mut result = mesh.gather(&unwrapped.sources, unwrapped.indices);
    (result.uvs, result.has_uvs) = (unwrapped.uvs, true);
    Ok(result)
}

fn compute(mesh: &Mesh) -> Result<Unwrapped> {
    let input = MeshInput::new(&mesh.positions, &mesh.indices);
    for page_size in PAGE_SIZES {
        let options = Options { density: Density::Auto { page_size }, packing: Packing::Fast, ..Default::default() };
        let atlas = uvunwrap::generate(&[input], &options).map_err(|e| Error::argument("uv atlas", "a mesh that unwraps", e))?;
        // Charts that do not fit at any density go to further pages, which would lie over the first.
        if atlas.page_count > 1 {
            continue;
        }
        let [width, height] = [atlas.width, atlas.height].map(|side| side.max(1) as f32);
        let Some(result) = atlas.meshes.into_iter().next() else { break };
        // One scale for both axes, so that texels are square.
        let scale = [width / width.max(height), height / width.max(height)];
        let uv = |[u, v]: [f32; 2]| [(u * scale[0]).clamp(0.0, 1.0), (v * scale[1]).clamp(0.0, 1.0)];
        return Ok(Unwrapped {
            sources: result.vertices.iter().map(|v| v.xref).collect(),
            uvs: result.vertices.iter().map(|v| uv(v.uv)).collect(),
            indices: result.indices,
        });
    }
    Err(Error::argument("uv atlas", "charts that fit one page of 16384x16384", "more"))
}

/// The name of a mesh's content.
fn key(mesh: &Mesh) -> String {
    let mut hash = Sha256::new();
    hash.update(VERSION);
    hash.update((mesh.positions.len() as u64).to_le_bytes());
    hash.update(bytemuck::cast_slice(&mesh.positions));
    hash.update(bytemuck::cast_slice(&mesh.indices));
    format!("{:x}", hash.finalize())
}

impl Unwrapped {
    fn to_bytes(&self) -> Vec<u8> {
        let counts = [self.sources.len() as u32, self.indices.len() as u32];
        let uvs = self.uvs.iter().flatten().map(|c| c.to_bits());
        let words = counts.into_iter().chain(self.sources.iter().copied()).chain(uvs).chain(self.indices.iter().copied());
        words.flat_map(u32::to_le_bytes).collect()
    }

    /// Nothing unless the content fits `mesh`.
    fn from_bytes(content: &[u8], mesh: &Mesh) -> Option<Self> {
        let words: Vec<u32> = content.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let ([vertices, corners], rest) = words.split_first_chunk::<2>()?;
        let (sources, rest) = rest.split_at_checked(*vertices as usize)?;
        let (uvs, indices) = rest.split_at_checked(2 * *vertices as usize)?;
        let uvs: Vec<[f32; 2]> = uvs.as_chunks::<2>().0.iter().map(|uv| uv.map(f32::from_bits)).collect();
        let fits = indices.len() == *corners as usize
            && indices.len() == mesh.indices.len()
            && indices.iter().all(|i| i < vertices)
            && sources.iter().all(|i| (*i as usize) < mesh.positions.len())
            && uvs.iter().flatten().all(|c| (0.0..=1.0).contains(c));
        fits.then(|| Self { sources: sources.to_vec(), uvs, indices: indices.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::builtin;
    use crate::offline::mesh::Projection;
    use glam::{Vec2, Vec3};

    /// Pixels of a coarse raster whose centres two triangles cover (edges, with a margin, count for neither), and the part
    /// of the square that is covered at all.
    fn overlaps(mesh: &Mesh) -> (usize, f64) {
        const SIDE: usize = 512;
        let mut counts = vec![0_u8; SIDE * SIDE];
        for t in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = t.map(|i| Vec2::from(mesh.uvs[i as usize]) * SIDE as f32);
            let (low, high) = (a.min(b).min(c).floor(), a.max(b).max(c).ceil());
            for y in low.y as usize..(high.y as usize).min(SIDE) {
                for x in low.x as usize..(high.x as usize).min(SIDE) {
                    let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                    let inside = |a: Vec2, b: Vec2| (b - a).perp_dot(p - a) > 1e-3 * (b - a).length();
                    if inside(a, b) && inside(b, c) && inside(c, a) {
                        counts[y * SIDE + x] += 1;
                    }
                }
            }
        }
        let covered = counts.iter().filter(|n| **n > 0).count() as f64 / counts.len() as f64;
        (counts.iter().filter(|n| **n > 1).count(), covered)
    }

    #[test]
    fn charts_do_not_overlap_and_keep_triangles() {
        for name in ["torus-knot", "bumpy-sphere"] {
            let source = builtin::mesh(name, 32).unwrap();
            let mut mesh = source.clone();
            mesh.generate_uvs(Projection::Atlas, None).unwrap();
            assert!(mesh.is_consistent() && mesh.uvs.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
            let (twice, covered) = overlaps(&mesh);
            assert!(twice == 0 && covered > 0.3, "{name}: {twice} {covered}");
            let mut ratios = Vec::new();
            for (new, old) in mesh.indices.as_chunks::<3>().0.iter().zip(source.indices.as_chunks::<3>().0) {
                let [a, b, c] = new.map(|i| mesh.positions[i as usize]);
                assert_eq!([a, b, c], old.map(|i| source.positions[i as usize]), "{name}");
                let [p, q, r] = new.map(|i| Vec2::from(mesh.uvs[i as usize]));
                let area = (Vec3::from(b) - Vec3::from(a)).cross(Vec3::from(c) - Vec3::from(a)).length();
                ratios.push((q - p).perp_dot(r - p) / area);
            }
            // No triangle is mirrored, and areas are even but for what curvature asks.
            ratios.sort_by(f32::total_cmp);
            assert!(
                ratios[0] > 0.0 && ratios[ratios.len() - 1] / ratios[0] < 16.0,
                "{name} {} {}",
                ratios[0],
                ratios[ratios.len() - 1]
            );
        }
    }

    #[test]
    fn entries_are_used_and_damaged_ones_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("deep").join("cache");
        let source = builtin::mesh("bumpy-sphere", 8).unwrap();
        let fresh = unwrap(&source, Some(&place)).unwrap();
        let entry = place.join(format!("{}.atlas", key(&source)));
        let kept = std::fs::read(&entry).unwrap();
        // A valid entry of other content is believed: it is read, not computed.
        let mut other = Unwrapped::from_bytes(&cache::read(&entry).unwrap(), &source).unwrap();
        other.uvs[0] = [0.25, 0.75];
        cache::keep(&entry, &other.to_bytes());
        assert_eq!(unwrap(&source, Some(&place)).unwrap().uvs[0], [0.25, 0.75]);
        other.indices[0] = u32::MAX;
        cache::keep(&entry, &other.to_bytes());
        let unfit = std::fs::read(&entry).unwrap();
        let mut flipped = kept.clone();
        flipped[100] ^= 1;
        for damaged in [vec![], kept[..kept.len() / 2].to_vec(), flipped, unfit, vec![0; 40]] {
            std::fs::write(&entry, damaged).unwrap();
            assert_eq!(unwrap(&source, Some(&place)).unwrap().uvs, fresh.uvs);
            assert_eq!(std::fs::read(&entry).unwrap(), kept, "rewritten");
        }
        assert_eq!(std::fs::read_dir(&place).unwrap().count(), 1, "nothing else is left there");
        // Another mesh has another name; a folder that cannot be does not matter.
        let mut moved = source.clone();
        moved.positions[0][0] += 0.001;
        assert_ne!(key(&moved), key(&source));
        assert_eq!(unwrap(&source, Some(&entry)).unwrap().uvs, fresh.uvs);
    }
}
