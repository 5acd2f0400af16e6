//! Whether a mesh is the border of a solid.

use crate::offline::mesh::Mesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

impl Mesh {
    /// Whether every edge is passed as often in one direction as in the other (vertices that are a millionth of the mesh's extent
    /// apart or less may count as one), and what is inside has a volume, so that triangles are counter-clockwise seen from outside. From
    /// there, a back face is always behind a front face.
    pub fn is_closed(&self) -> bool {
        let mut numbers = HashMap::with_capacity(self.positions.len());
        let number = |place| {
            let next = numbers.len() as u64;
            *numbers.entry(place).or_insert(next)
        };
        let place_of: Vec<u64> = self.places().into_iter().map(number).collect();
        let corner = |i: u32| Some((*place_of.get(i as usize)?, Vec3::from(*self.positions.get(i as usize)?).as_dvec3()));
        let (mut edges, mut volume) = (Vec::with_capacity(self.indices.len()), 0.0);
        for triangle in self.indices.as_chunks::<3>().0 {
            let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { return false };
            for ((from, _), (to, _)) in [(a, b), (b, c), (c, a)] {
                if from != to {
                    edges.push((from.min(to) << 32 | from.max(to), if from < to { 1 } else { -1 }));
                }
            }
            let [a, b, c]: [DVec3; 3] = [a.1, b.1, c.1];
            volume += a.dot(b.cross(c));
        }
        edges.sort_unstable();
        volume > 0.0 && edges.chunk_by(|a, b| a.0 == b.0).all(|same| same.iter().map(|edge| edge.1).sum::<i32>() == 0)
    }
}

#[cfg(test)]
mod tests {
    use crate::offline::builtin;

    #[test]
    fn solids_are_closed_and_sheets_are_not() {
        for (name, closed) in [("sphere", true), ("bumpy-sphere", true), ("torus-knot", true), ("plane", false), ("cloth", false)]
        {
            let mut mesh = builtin::mesh(name, 64).unwrap();
            assert_eq!(mesh.is_closed(), closed, "{name}");
            mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(0, 1));
            assert!(!mesh.is_closed(), "{name}, inside out");
            mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(0, 1));
            mesh.indices.truncate(mesh.indices.len() - 3);
            assert!(!mesh.is_closed(), "{name}, a triangle less");
        }
    }
}
