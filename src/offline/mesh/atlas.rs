//! Atlases through `uvunwrap`, kept on disk by the content of the mesh.
//!
//! A cache entry is: the SHA-256 of what follows; two little-endian 32-bit counts of vertices and indices; for every vertex
//! the index of the one that it copies and its two coordinates; the indices.

use crate::offline::error::{Error, Result};
use crate::offline::image_io::write_atomically;
use crate::offline::mesh::Mesh;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};
use uvunwrap::{Density, MeshInput, Options, Packing};

/// Changes with whatever changes the result for one mesh.
const VERSION: &[u8] = b"passband atlas 1, uvunwrap 0.3";

/// Pages that are tried in turn, until one holds every chart.
const PAGE_SIZES: [u32; 3] = [1024, 4096, 16_384];

/// The folder of the user's cache in which atlases are kept; `None` on systems that have none.
pub fn cache_folder() -> Option<PathBuf> {
    dirs::cache_dir().map(|folder| folder.join("passband").join("atlas"))
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
    let known = entry.as_ref().and_then(|entry| Unwrapped::from_bytes(&std::fs::read(entry).ok()?, mesh));
    let unwrapped = match known {
        Some(unwrapped) => unwrapped,
        None => {
            let unwrapped = compute(mesh)?;
            if let Some(entry) = &entry {
                keep(entry, &unwrapped);
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

/// Writes a cache entry if that is possible.
fn keep(entry: &Path, unwrapped: &Unwrapped) {
    let Some(folder) = entry.parent() else { return };
    let written = std::fs::create_dir_all(folder).map_err(|e| e.to_string());
    let written = written.and_then(|()| {
        let bytes = unwrapped.to_bytes();
        write_atomically(entry, |file| file.write_all(&bytes)).map_err(|e| e.to_string())
    });
    if let Err(e) = written {
        log::warn!("the atlas is not kept: {e}");
    }
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
        let content: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
        let mut bytes = Sha256::digest(&content).to_vec();
        bytes.extend(content);
        bytes
    }

    /// Nothing unless the entry is whole and fits `mesh`.
    fn from_bytes(bytes: &[u8], mesh: &Mesh) -> Option<Self> {
        let (sum, content) = bytes.split_at_checked(32)?;
        if Sha256::digest(content).as_slice() != sum {
            return None;
        }
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
