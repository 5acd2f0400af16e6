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
