//! Tangents for normal maps, as MikkTSpace computes them (Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited").

use crate::offline::mesh::Mesh;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::Vec3;

impl Mesh {
    /// Fills `tangents` from positions, normals and texture coordinates; without coordinates it leaves them empty. Vertices
    /// whose triangles disagree (mirrored or degenerate coordinates) are split, and vertices that no triangle uses go.
    /// Where no triangle around a vertex has an area in texture space, its tangent is some vector across its normal.
    pub fn compute_tangents(&mut self) {
        self.tangents.clear();
        if !self.has_uvs || !self.is_consistent() {
            return;
        }
        let mut work = Work { mesh: self, tangents: vec![None; self.indices.len()] };
        // The crate's error has no value yet; if one comes, vertices keep the fallback below.
        if let Err(e) = generate_tangents(&mut work) {
            log::warn!("tangents could not be computed: {e}");
        }
        let tangents = work.tangents;
        let split = self.split(|corner, vertex| {
            let normal = Vec3::from(self.normals.get(vertex).copied().unwrap_or_default());
            let tangent = tangents.get(corner).copied().flatten().unwrap_or_else(|| across(normal));
            (tangent.map(f32::to_bits), tangent)
        });
        *self = split.mesh;
        self.tangents = split.values;
    }
}

/// Some unit vector across `normal`, right-handed.
fn across(normal: Vec3) -> [f32; 4] {
    let normal = normal.try_normalize().unwrap_or(Vec3::Z);
    normal.any_orthonormal_vector().extend(1.0).to_array()
}

struct Work<'a> {
    mesh: &'a Mesh,
    /// One a corner.
    tangents: Vec<Option<[f32; 4]>>,
}

impl Work<'_> {
    fn at<T: Copy + Default>(&self, attribute: &[T], face: usize, corner: usize) -> T {
        let index = self.mesh.indices.get(3 * face + corner);
        index.and_then(|i| attribute.get(*i as usize)).copied().unwrap_or_default()
    }
}

impl Geometry for Work<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.at(&self.mesh.positions, face, corner)
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.at(&self.mesh.normals, face, corner)
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.at(&self.mesh.uvs, face, corner)
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // Degenerate triangles may come without a direction, or with one along the normal.
        let normal = Vec3::from(self.normal(face, corner));
        let usable = space.and_then(|space| {
            let [x, y, z, sign] = space.tangent_encoded();
            let tangent = Vec3::new(x, y, z);
            let tangent = (tangent - normal * normal.dot(tangent)).try_normalize()?;
            Some(tangent.extend(sign).to_array())
        });
        if let Some(slot) = self.tangents.get_mut(3 * face + corner) {
            *slot = usable;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::builtin;
    use glam::{Vec2, Vec4};

    /// Each tangent is a unit vector across its normal; with the handedness it follows the gradients of `u` and `v`, averaged
    /// over the vertex's triangles, to within the cosine `least`; of `v`, which need not be across `u`, to within `least_v`.
    fn assert_follows(mesh: &Mesh, least: f32, least_v: f32) {
        assert!(mesh.is_consistent() && mesh.tangents.len() == mesh.positions.len());
        for t in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.positions[i as usize]));
            let [p, q, r] = t.map(|i| Vec2::from(mesh.uvs[i as usize]));
            let (e, f) = (q - p, r - p);
            let area = e.perp_dot(f);
            let (along_u, along_v) = (((b - a) * f.y - (c - a) * e.y) / area, ((c - a) * e.x - (b - a) * f.x) / area);
            for i in t.map(|i| i as usize) {
                let (tangent, normal) = (Vec4::from(mesh.tangents[i]), Vec3::from(mesh.normals[i]));
                let (direction, sign) = (tangent.truncate(), tangent.w);
                assert!((direction.length() - 1.0).abs() < 1e-4 && direction.dot(normal).abs() < 1e-4, "{tangent} {normal}");
                assert!(direction.dot(along_u.normalize()) > least, "{tangent} {along_u}");
                assert!((normal.cross(direction) * sign).dot(along_v.normalize()) > least_v, "{tangent} {along_v}");
                assert_eq!(sign, area.signum());
            }
        }
    }

    #[test]
    fn tangents_follow_the_coordinates() {
        // The knot's tube turns as it goes: there the coordinates are sheared.
        for (name, least, least_v) in [("plane", 0.9999, 0.9999), ("cloth", 0.99, 0.98), ("torus-knot", 0.95, 0.2)] {
            let mut mesh = builtin::mesh(name, 128).unwrap();
            mesh.compute_tangents();
            assert_follows(&mesh, least, least_v);
        }
    }

    #[test]
    fn mirrored_halves_split_the_vertices_between_them() {
        let mut mesh = builtin::mesh("plane", 64).unwrap();
        for uv in &mut mesh.uvs {
            uv[0] = (uv[0] - 0.5).abs();
        }
        let before = mesh.positions.len();
        mesh.compute_tangents();
        // 4 by 4 cells: the middle column of 5 vertices is there twice.
        assert_eq!((before, mesh.positions.len()), (25, 30));
        assert_follows(&mesh, 0.9999, 0.9999);
        assert!(mesh.tangents.iter().any(|t| t[3] < 0.0) && mesh.tangents.iter().any(|t| t[3] > 0.0));
    }

    #[test]
    fn without_coordinates_there_are_none_and_degenerate_ones_still_have_a_frame() {
        let mut mesh = builtin::mesh("plane", 32).unwrap();
        mesh.has_uvs = false;
        mesh.compute_tangents();
        assert!(mesh.tangents.is_empty());
        mesh.has_uvs = true;
        mesh.uvs.fill([0.5; 2]);
        mesh.compute_tangents();
        assert_eq!(mesh.tangents.len(), mesh.positions.len());
        for (t, n) in mesh.tangents.iter().zip(&mesh.normals) {
            let t = Vec4::from(*t);
            assert!((t.truncate().length() - 1.0).abs() < 1e-5 && t.truncate().dot(Vec3::from(*n)).abs() < 1e-5, "{t}");
        }
    }
}
