//! Vertices that stand for several, one for each value that their triangles give them.

use crate::offline::mesh::Mesh;
use std::collections::HashMap;
use std::hash::Hash;

/// The outcome of [`Mesh::split`].
pub(super) struct Split<V> {
    /// The mesh with a vertex for every pair of an old vertex and a key, in the order of first use; unused ones are gone.
    pub mesh: Mesh,
    /// The value of each of its vertices.
    pub values: Vec<V>,
}

impl Mesh {
    /// Splits vertices: `corner` says for each corner (three a triangle, in order; at an index of ours) by what key its
    /// vertex is told apart, and with what value.
    pub(super) fn split<K: Eq + Hash, V>(&self, mut corner: impl FnMut(usize, usize) -> (K, V)) -> Split<V> {
        let (mut sources, mut values) = (Vec::with_capacity(self.positions.len()), Vec::with_capacity(self.positions.len()));
        let mut known = HashMap::with_capacity(self.positions.len());
        let mut indices = Vec::with_capacity(self.indices.len());
        for (at, vertex) in self.indices.iter().enumerate() {
            let (key, value) = corner(at, *vertex as usize);
            let index = *known.entry((*vertex, key)).or_insert_with(|| {
                sources.push(*vertex);
                values.push(value);
                sources.len() as u32 - 1
            });
            indices.push(index);
        }
        Split { mesh: self.gather(&sources, indices), values }
    }

    /// The mesh whose vertices are those at `sources` of this one.
    pub(super) fn gather(&self, sources: &[u32], indices: Vec<u32>) -> Mesh {
        fn pick<T: Copy>(from: &[T], sources: &[u32]) -> Vec<T> {
            sources.iter().filter_map(|i| from.get(*i as usize).copied()).collect()
        }
        Mesh {
            positions: pick(&self.positions, sources),
            normals: pick(&self.normals, sources),
            uvs: pick(&self.uvs, sources),
            has_uvs: self.has_uvs,
            tangents: pick(&self.tangents, sources),
            indices,
        }
    }
}
