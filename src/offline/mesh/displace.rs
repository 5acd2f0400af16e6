//! Vertices moved along their normals.

use crate::offline::mesh::{Mesh, area_weighted_normals};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::collections::HashMap;

impl Mesh {
    /// The mean length, in metres, of a step of one in texture coordinates: the root of the ratio of areas. `None` without
    /// coordinates or where they have no area.
    pub fn metres_per_uv(&self) -> Option<f64> {
        let (mut surface, mut coordinates) = (0.0, 0.0);
        for triangle in self.indices.as_chunks::<3>().0 {
            let corner = |i: u32| Some((*self.positions.get(i as usize)?, *self.uvs.get(i as usize)?));
            let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { continue };
            let [p, q, r] = [a, b, c].map(|c| Vec3::from(c.0).as_dvec3());
            let [s, t, u] = [a, b, c].map(|c| Vec2::from(c.1).as_dvec2());
            surface += (q - p).cross(r - p).length();
            coordinates += (t - s).perp_dot(u - s).abs();
        }
        let metres = (surface / coordinates).sqrt();
        (self.has_uvs && metres.is_finite()).then_some(metres)
    }

    /// Moves every vertex along its normal by the metres that `height` gives for its texture coordinates, the mean of them
    /// where vertices share a place (to a millionth of the mesh's extent), so that smooth seams stay closed. Normals are
    /// computed anew from the faces; tangents are dropped.
    pub fn displace(&mut self, height: impl Fn(DVec2) -> f64) {
        let keys = self.places();
        let mut places: HashMap<[i64; 3], Place> = HashMap::with_capacity(self.positions.len());
        for (((position, normal), uv), key) in self.positions.iter().zip(&self.normals).zip(&self.uvs).zip(&keys) {
            let (position, normal) = (Vec3::from(*position).as_dvec3(), Vec3::from(*normal).as_dvec3());
            let place = places.entry(*key).or_insert(Place { position, normal, sum: 0.0, count: 0.0 });
            place.sum += height(Vec2::from(*uv).as_dvec2());
            place.count += 1.0;
        }
        for ((position, normal), key) in self.positions.iter_mut().zip(&self.normals).zip(&keys) {
            let Some(place) = places.get(key) else { continue };
            // Copies that differ in the last bit end at one point, or their normals would show a seam.
            let own = Vec3::from(*normal).as_dvec3();
            let along = if own.dot(place.normal) > 0.9999 { place.normal } else { own };
            *position = (place.position + along * (place.sum / place.count)).as_vec3().to_array();
        }
        self.normals = area_weighted_normals(&self.positions, &self.indices);
        self.tangents.clear();
    }
}

/// Where vertices stand together.
struct Place {
    /// Of the first of them.
    position: DVec3,
    normal: DVec3,
    /// Of their heights.
    sum: f64,
    count: f64,
}

#[cfg(test)]
mod tests {
    use crate::offline::builtin;
    use glam::Vec3;

    #[test]
    fn a_plane_becomes_a_wave_with_its_normals() {
        let mut mesh = builtin::mesh("plane", 256).unwrap();
        assert!((mesh.metres_per_uv().unwrap() - 2.0).abs() < 1e-6);
        mesh.displace(|uv| 0.05 * (std::f64::consts::TAU * uv.x).sin());
        for ((p, n), uv) in mesh.positions.iter().zip(&mesh.normals).zip(&mesh.uvs) {
            let phase = std::f32::consts::TAU * uv[0];
            assert!((p[1] - 0.05 * phase.sin()).abs() < 1e-6, "{p:?}");
            if (0.1..0.9).contains(&uv[0]) {
                let slope = 0.05 * std::f32::consts::PI * phase.cos();
                let expected = Vec3::new(-slope, 1.0, 0.0).normalize();
                assert!(Vec3::from(*n).dot(expected) > 0.999, "{n:?} {expected}");
            }
        }
    }

    #[test]
    fn seams_stay_closed() {
        let mut mesh = builtin::mesh("sphere", 64).unwrap();
        let before = mesh.positions.clone();
        mesh.displace(|uv| 0.1 * uv.x);
        let mut pairs = 0;
        for (i, p) in before.iter().enumerate() {
            let near = |q: &[f32; 3]| Vec3::from(*q).distance(Vec3::from(*p)) < 1e-6;
            for (j, _) in before.iter().enumerate().skip(i + 1).filter(|(_, q)| near(q)) {
                assert_eq!((mesh.positions[i], mesh.normals[i]), (mesh.positions[j], mesh.normals[j]));
                pairs += 1;
            }
        }
        // The seam, and all pairs of the 65 copies of each pole.
        assert_eq!(pairs, 31 + 2 * (65 * 64 / 2));
        assert!(mesh.positions.iter().all(|p| (0.9999..1.1001).contains(&Vec3::from(*p).length())));
    }
}
