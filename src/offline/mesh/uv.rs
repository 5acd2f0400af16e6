//! Texture coordinates for meshes that have none. `v` grows upwards and `u` to the right as seen from outside, as on the
//! built-in shapes.

use crate::offline::error::Result;
use crate::offline::mesh::{Mesh, atlas};
use glam::{DVec2, DVec3, dvec2};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// How texture coordinates are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Projection {
    /// Longitude and latitude about the centre of the bounding box, +Y up, the front (+Z) at u = 0.5. Triangles across the
    /// seam go on past u = 1; a vertex on the axis has in each of its triangles the mean u of the others.
    Spherical,
    /// Along the axis that each triangle faces most, one texture over the longest side of the bounding box. The six sides
    /// overlap: for textures that repeat.
    Box,
    /// Charts that do not overlap, packed into the unit square (the `uvunwrap` crate).
    Atlas,
}

impl Projection {
    /// Its name in scene files.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "spherical" => Some(Self::Spherical),
            "box" => Some(Self::Box),
            "atlas" => Some(Self::Atlas),
            _ => None,
        }
    }
}

impl Mesh {
    /// Gives the mesh texture coordinates in the place of those it has. Vertices where triangles disagree are split, and
    /// tangents are dropped. An atlas, which takes seconds to minutes on large meshes, is kept in the folder
    /// `cache` if there is one, by the content of the mesh; entries that cannot be read or written do not matter.
    ///
    /// # Errors
    /// [`crate::offline::error::Error::Argument`] if indices are out of range or the mesh cannot be unwrapped.
    pub fn generate_uvs(&mut self, projection: Projection, cache: Option<&Path>) -> Result<()> {
        self.require_consistent()?;
        self.tangents.clear();
        let corners = match projection {
            Projection::Spherical => self.per_triangle(spherical(self)),
            Projection::Box => self.per_triangle(boxed(self)),
            Projection::Atlas => {
                *self = atlas::unwrap(self, cache)?;
                return Ok(());
            }
        };
        let split = self.split(|corner, _| {
            let uv = corners.get(corner).copied().unwrap_or_default();
            (uv.map(f32::to_bits), uv)
        });
        *self = split.mesh;
        (self.uvs, self.has_uvs) = (split.values, true);
        Ok(())
    }

    /// What `project` gives to the corners of each triangle: positions and normals in, coordinates out.
    fn per_triangle(&self, project: impl Fn([DVec3; 3], [DVec3; 3]) -> [DVec2; 3]) -> Vec<[f32; 2]> {
        let get = |from: &[[f32; 3]], i: u32| from.get(i as usize).map_or(DVec3::ZERO, |v| DVec3::from(v.map(f64::from)));
        let triangles = self.indices.as_chunks::<3>().0.iter();
        let projected = triangles.map(|t| project(t.map(|i| get(&self.positions, i)), t.map(|i| get(&self.normals, i))));
        projected.flatten().map(|uv| uv.as_vec2().to_array()).collect()
    }

    /// Least and greatest corner of the bounding box.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let all = || self.positions.iter().map(|p| glam::Vec3::from(*p));
        let least = all().reduce(glam::Vec3::min).unwrap_or_default();
        [least.to_array(), all().reduce(glam::Vec3::max).unwrap_or_default().to_array()]
    }
}

fn spherical(mesh: &Mesh) -> impl Fn([DVec3; 3], [DVec3; 3]) -> [DVec2; 3] {
    let [least, greatest] = mesh.bounds().map(|p| DVec3::from(p.map(f64::from)));
    let centre = (least + greatest) / 2.0;
    // Nearer to the axis than this, rounding decides the longitude.
    let axis = (greatest - least).max_element() * 1e-6;
    move |positions, _| {
        let longitude = |d: DVec3| (d.x.hypot(d.z) > axis).then(|| 0.5 + d.x.atan2(d.z) / TAU);
        let directions = positions.map(|p| p - centre);
        let mut u = directions.map(longitude);
        let known = u.iter().flatten().copied().next().unwrap_or(0.5);
        // Each as near to the first as whole turns allow.
        for value in u.iter_mut().flatten() {
            *value = known + (*value - known) - (*value - known).round();
        }
        let count = u.iter().flatten().count().max(1) as f64;
        let mean = if u == [None; 3] { known } else { u.iter().flatten().sum::<f64>() / count };
        let u = u.map(|value| value.unwrap_or(mean));
        let turns = u.iter().copied().fold(f64::INFINITY, f64::min).floor();
        let v = directions.map(|d| 1.0 - (d.y / d.length()).clamp(-1.0, 1.0).acos() / PI);
        [0, 1, 2].map(|i| dvec2(u[i] - turns, if v[i].is_finite() { v[i] } else { 0.5 }))
    }
}

fn boxed(mesh: &Mesh) -> impl Fn([DVec3; 3], [DVec3; 3]) -> [DVec2; 3] {
    let [least, greatest] = mesh.bounds().map(|p| DVec3::from(p.map(f64::from)));
    let side = Some((greatest - least).max_element()).filter(|side| *side > 0.0).unwrap_or(1.0);
    move |[a, b, c], normals| {
        let face = (b - a).cross(c - a);
        let facing = if face.length() > 0.0 { face } else { normals.iter().sum() };
        [a, b, c].map(|p| {
            let (from, to) = ((p - least) / side, (greatest - p) / side);
            let size = facing.abs();
            // Right and up as seen from outside; the sides facing +Y and -Y have the back and the front on top.
            if size.x >= size.y && size.x >= size.z {
                dvec2(if facing.x > 0.0 { to.z } else { from.z }, from.y)
            } else if size.y >= size.z {
                dvec2(from.x, if facing.y > 0.0 { to.z } else { from.z })
            } else {
                dvec2(if facing.z >= 0.0 { from.x } else { to.x }, from.y)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::builtin;
    use glam::{Vec2, Vec3};

    /// Twice the signed areas in texture space, and the triangles' normals.
    fn areas(mesh: &Mesh) -> Vec<(f32, Vec3)> {
        let triangle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| Vec2::from(mesh.uvs[i as usize]));
            let [p, q, r] = t.map(|i| Vec3::from(mesh.positions[i as usize]));
            ((b - a).perp_dot(c - a), (q - p).cross(r - p))
        };
        mesh.indices.as_chunks::<3>().0.iter().map(triangle).collect()
    }

    /// A sphere without the seam and pole vertices of the built-in one.
    fn welded() -> Mesh {
        let mut mesh = builtin::mesh("sphere", 64).unwrap();
        let mut first = std::collections::HashMap::new();
        let key = |p: &[f32; 3]| p.map(|c| (c * 1e4).round() as i32);
        let indices = mesh.indices.iter().map(|i| *first.entry(key(&mesh.positions[*i as usize])).or_insert(*i)).collect();
        mesh.indices = indices;
        (mesh.has_uvs, mesh.uvs) = (false, vec![[0.0; 2]; mesh.positions.len()]);
        mesh
    }

    #[test]
    fn spherical_coordinates_are_the_built_in_ones_without_a_smear_at_the_seam() {
        let mut mesh = welded();
        mesh.generate_uvs(Projection::Spherical, None).unwrap();
        assert!(mesh.has_uvs && mesh.is_consistent());
        for (area, _) in areas(&mesh) {
            assert!(area > 0.0 && area < 2.0 / 64.0 * 2.0 / 32.0, "{area}");
        }
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            let [x, y, z] = p.map(f64::from);
            assert!((f64::from(uv[1]) - (1.0 - y.clamp(-1.0, 1.0).acos() / PI)).abs() < 1e-3, "{p:?} {uv:?}");
            if x.hypot(z) > 0.01 {
                let off = f64::from(uv[0]) - (0.5 + x.atan2(z) / TAU);
                assert!((off - off.round()).abs() < 1e-5, "{p:?} {uv:?}");
            }
            assert!((0.0..=1.04).contains(&uv[0]) && (0.0..=1.0).contains(&uv[1]), "{uv:?}");
        }
        // Together the triangles cover the square once, but for half a triangle in every column at both poles.
        let covered: f32 = areas(&mesh).iter().map(|(area, _)| area / 2.0).sum();
        assert!((covered - (1.0 - 1.0 / 32.0)).abs() < 1e-3, "{covered}");
    }

    #[test]
    fn box_coordinates_have_one_scale_and_split_where_the_axis_changes() {
        let mut mesh = welded();
        let before = mesh.positions.len();
        mesh.generate_uvs(Projection::Box, None).unwrap();
        assert!(mesh.is_consistent() && mesh.positions.len() != before);
        assert!(mesh.uvs.iter().flatten().all(|c| (-1e-6..=1.000001).contains(c)));
        for (area, normal) in areas(&mesh) {
            // The projection along the greatest component, over a side of 2, never mirrored.
            let expected = normal.abs().max_element() / 4.0;
            assert!((area - expected).abs() < 1e-3 * expected + 1e-7, "{area} {expected} {normal}");
        }
    }

    #[test]
    fn what_has_no_extent_still_gets_finite_coordinates() {
        for projection in [Projection::Spherical, Projection::Box, Projection::Atlas] {
            for positions in [vec![[1.0; 3]; 3], vec![[0.0; 3], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]]] {
                let attributes = (vec![[0.0, 1.0, 0.0]; 3], vec![[0.0; 2]; 3]);
                let indices = vec![0, 1, 2];
                let mut mesh = Mesh { positions, normals: attributes.0, uvs: attributes.1, indices, ..Default::default() };
                match mesh.generate_uvs(projection, None) {
                    Ok(()) => assert!(mesh.uvs.iter().flatten().all(|c| c.is_finite()), "{projection:?} {:?}", mesh.uvs),
                    Err(e) => assert_eq!(projection, Projection::Atlas, "{e}"),
                }
                mesh.compute_tangents();
                assert!(mesh.tangents.iter().flatten().all(|c| c.is_finite()));
            }
        }
        let mut broken = Mesh { indices: vec![0, 1, 2], ..Default::default() };
        assert!(broken.generate_uvs(Projection::Box, None).is_err());
    }
}
