//! Indexed triangle meshes.

use std::collections::HashMap;

mod obj;
pub(crate) mod shapes;

pub use obj::read_obj;

/// A triangle mesh in object space (right-handed, metres). All attributes are per vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one per position.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one per position; zero where `has_uvs` is false.
    pub uvs: Vec<[f32; 2]>,
    /// Whether the source carried texture coordinates.
    pub has_uvs: bool,
    /// Three indices a triangle.
    pub indices: Vec<u32>,
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
