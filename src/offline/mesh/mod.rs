//! Indexed triangle meshes: files, formulas, texture coordinates and tangents.

use crate::offline::error::{At, Error, Result};
use crate::offline::{gltf, input};
use std::collections::HashMap;
use std::path::Path;

mod atlas;
mod closed;
mod displace;
mod gzip;
mod obj;
mod off;
mod ply;
pub(crate) mod shapes;
mod split;
mod tangents;
mod uv;
mod wave;

pub use atlas::cache_folder;
pub use obj::read_obj;
pub use uv::Projection;
pub use wave::Wave;

/// A triangle mesh in object space (right-handed, metres). All attributes are per vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one per position.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one per position, `v` upwards; zero where `has_uvs` is false.
    pub uvs: Vec<[f32; 2]>,
    /// Whether the source carried texture coordinates, or they were generated.
    pub has_uvs: bool,
    /// Unit tangents (direction of growing `u`, across the normal) and handedness: the direction of growing `v` is
    /// `w * cross(normal, tangent)`. One per position, or none at all until [`Mesh::compute_tangents`].
    pub tangents: Vec<[f32; 4]>,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
}

/// Reads a mesh in the format of `path`'s extension: `.obj`, `.ply`, `.off`, or `.glb` and `.gltf` with all their
/// primitives as one mesh. Each may end in `.gz`; files that a `.gltf` names are read as they are.
///
/// # Errors
/// [`Error::Argument`] for another extension, [`Error::File`] for a file that is not such a mesh: malformed, damaged, with
/// numbers that are not finite, indices out of range or no triangle, or compressed beyond what any mesh is.
pub fn read(path: &Path) -> Result<Mesh> {
    let (kind, _) = kind(path);
    match kind.as_str() {
        "obj" => obj::parse(path, &content(path)?),
        "ply" => ply::parse(path, &content(path)?),
        "off" => off::parse(path, &content(path)?),
        "glb" | "gltf" => gltf::read_mesh(path),
        other => {
            let expected = "a name that ends in .obj, .ply, .off, .glb or .gltf, or these with .gz";
            Err(Error::argument("mesh", expected, format!("`.{other}`")))
        }
    }
}

/// A mesh file's extension before any `.gz`, in lower case, and whether there is one.
fn kind(path: &Path) -> (String, bool) {
    match input::extension(path).as_str() {
        "gz" => (path.file_stem().map(|stem| input::extension(Path::new(stem))).unwrap_or_default(), true),
        other => (other.to_string(), false),
    }
}

/// A mesh file's bytes, decompressed if its name ends in `.gz`.
pub(crate) fn content(path: &Path) -> Result<Vec<u8>> {
    let bytes = input::read(path)?;
    if kind(path).1 { gzip::decompress(path, &bytes) } else { Ok(bytes) }
}

impl Mesh {
    /// Whether every index has a vertex, every vertex its attributes, and corners and vertices can be counted in 32 bits.
    pub fn is_consistent(&self) -> bool {
        let count = self.positions.len();
        let whole = self.indices.len().is_multiple_of(3) && self.indices.len() < u32::MAX as usize;
        whole
            && count < u32::MAX as usize
            && self.normals.len() == count
            && self.uvs.len() == count
            && (self.tangents.is_empty() || self.tangents.len() == count)
            && self.indices.iter().all(|i| (*i as usize) < count)
    }

    /// The place of each vertex, in millionths of the mesh's extent: those of vertices that stand together are equal.
    fn places(&self) -> Vec<[i64; 3]> {
        let [least, greatest] = self.bounds().map(glam::Vec3::from);
        let grid = f64::from((greatest - least).max_element()).max(f64::MIN_POSITIVE) * 1e-6;
        self.positions.iter().map(|position| position.map(|c| (f64::from(c) / grid).round() as i64)).collect()
    }

    fn require_consistent(&self) -> Result<()> {
        if self.is_consistent() {
            return Ok(());
        }
        let got = format!("{} vertices and {} indices that do not fit", self.positions.len(), self.indices.len());
        Err(Error::argument("mesh", "attributes for every vertex and a vertex for every index", got))
    }
}

/// What a file said, before it is a mesh.
#[derive(Default)]
struct Parts {
    positions: Vec<[f32; 3]>,
    /// One per position, or none; of any length.
    normals: Vec<[f32; 3]>,
    /// One per position, or none.
    uvs: Vec<[f32; 2]>,
    /// Within the positions.
    indices: Vec<u32>,
}

impl Parts {
    /// Adds a polygon as a fan about its first corner.
    fn fan(&mut self, corners: &[u32]) {
        if let Some((first, rest)) = corners.split_first() {
            self.indices.extend(rest.windows(2).flat_map(|pair| std::iter::once(*first).chain(pair.iter().copied())));
        }
    }

    /// The mesh, with unit normals: those without length, and all if there are none, are weighted by area.
    fn finish(self, path: &Path) -> Result<Mesh> {
        fn first_bad<const N: usize>(all: &[[f32; N]]) -> Option<usize> {
            all.iter().position(|v| !v.iter().all(|c| c.is_finite()))
        }
        let named = [
            ("position", first_bad(&self.positions)),
            ("normal", first_bad(&self.normals)),
            ("texture coordinate", first_bad(&self.uvs)),
        ];
        for (name, bad) in named {
            if let Some(bad) = bad {
                return Err(Error::file(path, At::File, format!("vertex {bad}: {name}"), "finite numbers", "another"));
            }
        }
        if self.indices.len() < 3 {
            return Err(Error::file(path, At::File, "faces", "at least one triangle", "none"));
        }
        let count = self.positions.len();
        if count >= u32::MAX as usize || self.indices.len() >= u32::MAX as usize {
            let got = format!("{count} vertices and {} corners", self.indices.len());
            return Err(Error::file(path, At::File, "size", "fewer than 2^32 vertices and corners", got));
        }
        let unit = |n: &[f32; 3]| glam::Vec3::from(*n).as_dvec3().try_normalize().map(|n| n.as_vec3().to_array());
        let own: Option<Vec<[f32; 3]>> = self.normals.iter().map(unit).collect();
        let normals = match own.filter(|own| own.len() == count) {
            Some(own) => own,
            None => {
                let mut normals = area_weighted_normals(&self.positions, &self.indices);
                for (normal, own) in normals.iter_mut().zip(&self.normals) {
                    *normal = unit(own).unwrap_or(*normal);
                }
                normals
            }
        };
        let has_uvs = self.uvs.len() == count;
        let uvs = if has_uvs { self.uvs } else { vec![[0.0; 2]; count] };
        Ok(Mesh { positions: self.positions, normals, uvs, has_uvs, tangents: Vec::new(), indices: self.indices })
    }
}

/// Unit normals from faces, weighted by their area: one per position, equal where positions are equal, so that a texture
/// seam or a group border does not show. Positions of no or only degenerate faces point up (+Y). Out-of-range
/// indices are ignored.
pub fn area_weighted_normals(positions: &[[f32; 3]], indices: &[u32]) -> Vec<[f32; 3]> {
    // Zero has two signs; adding 0.0 leaves one.
    let key = |p: &[f32; 3]| p.map(|c| (c + 0.0).to_bits());
    let mut places = HashMap::with_capacity(positions.len());
    let place: Vec<usize> = positions
        .iter()
        .map(|p| {
            let next = places.len();
            *places.entry(key(p)).or_insert(next)
        })
        .collect();
    let mut sums = vec![glam::DVec3::ZERO; places.len()];
    let corner = |i: u32| {
        let position = positions.get(i as usize)?;
        Some((*place.get(i as usize)?, glam::Vec3::from(*position).as_dvec3()))
    };
    for triangle in indices.as_chunks::<3>().0 {
        let [Some((i, a)), Some((j, b)), Some((k, c))] = triangle.map(corner) else { continue };
        let twice_area = (b - a).cross(c - a);
        for at in [i, j, k] {
            if let Some(sum) = sums.get_mut(at) {
                *sum += twice_area;
            }
        }
    }
    let unit = |at: &usize| {
        let sum = sums.get(*at).copied().unwrap_or_default();
        sum.try_normalize().unwrap_or(glam::DVec3::Y).as_vec3().to_array()
    };
    place.iter().map(unit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square in z = 0 as one triangle of area 0.5, folded along y with a wall of area 1 (two triangles).
    #[test]
    fn normals_weigh_by_area_and_ignore_seams() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0], // floor, normal +z
            [-0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 1.0, 1.0],
            [0.0, 0.0, 1.0], // wall, normal +x
        ];
        let normals = area_weighted_normals(&positions, &[0, 1, 2, 3, 4, 5, 3, 5, 6, 0, 1, 99]);
        // The origin belongs to the floor (0.5) and to both wall triangles (1.0 together).
        let expected = glam::Vec3::new(1.0, 0.0, 0.5).normalize().to_array();
        for (got, want) in normals[0].iter().zip(expected) {
            assert!((got - want).abs() < 1e-6, "{:?} {expected:?}", normals[0]);
        }
        assert_eq!(normals[0], normals[3], "the seam's copies agree, whatever the sign of zero");
        assert_eq!(normals[1], [0.0, 0.0, 1.0]);
        assert_eq!(normals[6], [1.0, 0.0, 0.0]);
    }

    #[test]
    fn degenerate_faces_give_unit_normals() {
        let normals = area_weighted_normals(&[[1.0; 3], [1.0; 3], [2.0; 3]], &[0, 1, 2]);
        assert_eq!(normals, [[0.0, 1.0, 0.0]; 3]);
    }
}
