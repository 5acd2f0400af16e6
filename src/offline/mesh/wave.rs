//! A displacement wave that travels over a mesh (the deforming object of Bagher 2011, figure 16).

use crate::offline::mesh::Mesh;
use glam::{DMat2, DVec2, DVec3, Vec3, Vec4};
use std::f64::consts::TAU;

/// A plane sine wave by which vertices move along their normals, in the mesh's own space and units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Metres.
    pub amplitude: f64,
    /// Metres from crest to crest.
    pub length: f64,
    /// Metres a frame.
    pub speed: f64,
    /// The way that it travels; its length does not matter.
    pub direction: DVec3,
}

impl Wave {
    /// Metres above the surface at `position` in `frame`, `amplitude sin(2 pi (position . direction - speed frame) / length)`,
    /// and their gradient.
    pub fn height(&self, position: DVec3, frame: u32) -> (f64, DVec3) {
        let direction = self.direction.normalize_or_zero();
        let number = TAU / self.length;
        let (sin, cos) = (number * (position.dot(direction) - self.speed * f64::from(frame))).sin_cos();
        (self.amplitude * sin, direction * (self.amplitude * number * cos))
    }

    /// `mesh` in `frame`. Normals and tangents are those of the displaced surface: where a step `t` over the surface turned the
    /// normal `n` by `W t`, it is now one of `t + n (gradient . t) + height W t`. Vertices are told apart by their normals, so
    /// that hard edges open. Where the surface folds over itself, normals point inwards.
    pub fn displaced(&self, mesh: &Mesh, frame: u32) -> Mesh {
        let mut moved = mesh.clone();
        let bases = bases(mesh);
        for (i, (basis, turn)) in bases.iter().zip(turns(mesh, &bases)).enumerate() {
            let Some(position) = moved.positions.get_mut(i) else { continue };
            let Basis { normal, along, across } = *basis;
            let place = Vec3::from(*position).as_dvec3();
            let (height, gradient) = self.height(place, frame);
            let step = |t: DVec2| {
                let turned = turn * t;
                let before = along * t.x + across * t.y;
                before + normal * gradient.dot(before) + (along * turned.x + across * turned.y) * height
            };
            *position = (place + normal * height).as_vec3().to_array();
            let now = step(DVec2::X).cross(step(DVec2::Y)).try_normalize().unwrap_or(normal);
            if let Some(normal) = moved.normals.get_mut(i) {
                *normal = now.as_vec3().to_array();
            }
            if let Some(tangent) = moved.tangents.get_mut(i) {
                let before = Vec4::from(*tangent).truncate().as_dvec3();
                let after = step(DVec2::new(before.dot(along), before.dot(across)));
                let after = (after - now * now.dot(after)).try_normalize().unwrap_or(now.any_orthonormal_vector());
                *tangent = after.as_vec3().extend(tangent[3]).to_array();
            }
        }
        moved
    }
}

/// A vertex's normal and two unit vectors across it, right-handed.
struct Basis {
    normal: DVec3,
    along: DVec3,
    across: DVec3,
}

fn bases(mesh: &Mesh) -> Vec<Basis> {
    let basis = |normal: &[f32; 3]| {
        let normal = Vec3::from(*normal).as_dvec3().try_normalize().unwrap_or(DVec3::Y);
        let along = normal.any_orthonormal_vector();
        Basis { normal, along, across: normal.cross(along) }
    };
    mesh.normals.iter().map(basis).collect()
}

/// How a step over the surface turns the normal at each vertex, in its basis: fitted to the edges from it by least squares, each
/// edge weighted alike.
fn turns(mesh: &Mesh, bases: &[Basis]) -> Vec<DMat2> {
    let outer = |a: DVec2, b: DVec2| DMat2::from_cols(a * b.x, a * b.y);
    let mut sums = vec![[DMat2::ZERO; 2]; bases.len()];
    let place = |i: usize| mesh.positions.get(i).map(|p| Vec3::from(*p).as_dvec3());
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = triangle.map(|i| i as usize);
        for (from, to) in [(a, b), (a, c), (b, a), (b, c), (c, a), (c, b)] {
            let (Some(p), Some(q), Some(sum)) = (place(from), place(to), sums.get_mut(from)) else { continue };
            let (Some(basis), Some(other)) = (bases.get(from), bases.get(to)) else { continue };
            let flat = |v: DVec3| DVec2::new(v.dot(basis.along), v.dot(basis.across));
            let (step, turn) = (flat(q - p), flat(other.normal - basis.normal));
            let length = step.length();
            if length > 0.0 {
                *sum = [sum[0] + outer(step, step) * length.powi(-2), sum[1] + outer(turn, step) * length.powi(-2)];
            }
        }
    }
    let solve = |[steps, turns]: [DMat2; 2]| {
        let trace = steps.x_axis.x + steps.y_axis.y;
        // Edges all of one direction say nothing of the other.
        if steps.determinant() > 1e-6 * trace * trace { turns * steps.inverse() } else { DMat2::ZERO }
    };
    sums.into_iter().map(solve).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::builtin;
    use crate::offline::mesh::area_weighted_normals;

    const WAVE: Wave = Wave { amplitude: 0.06, length: 0.7, speed: 0.05, direction: DVec3::new(0.6, 2.0, -0.4) };

    /// The wave on the unit sphere by its formula: the sphere is its own normal.
    fn on_the_sphere(d: DVec3, frame: u32) -> DVec3 {
        d * (1.0 + WAVE.height(d, frame).0)
    }

    /// Whether a triangle uses each vertex: at a pole one copy is left over.
    fn used(mesh: &Mesh) -> Vec<bool> {
        let mut used = vec![false; mesh.positions.len()];
        mesh.indices.iter().for_each(|i| used[*i as usize] = true);
        used
    }

    #[test]
    fn normals_on_a_sphere_are_those_of_finite_differences() {
        let mesh = builtin::mesh("sphere", 256).unwrap();
        let moved = WAVE.displaced(&mesh, 3);
        let mut turned = 0.0_f64;
        let used = used(&mesh);
        for (i, d) in mesh.positions.iter().enumerate().filter(|(i, _)| used[*i]) {
            let d = Vec3::from(*d).as_dvec3().normalize();
            let (along, across) = d.any_orthonormal_pair();
            let difference = |t: DVec3| {
                let at = |s: f64| on_the_sphere((d + t * s).normalize(), 3);
                at(1e-5) - at(-1e-5)
            };
            let expected = difference(along).cross(difference(across)).normalize();
            let expected = expected * expected.dot(d).signum();
            let got = Vec3::from(moved.normals[i]).as_dvec3();
            assert!(got.distance(expected) < 1e-4, "{d}: {got} {expected}");
            let at = Vec3::from(moved.positions[i]).as_dvec3();
            assert!(at.distance(on_the_sphere(d, 3)) < 1e-6);
            turned = turned.max(got.distance(d));
        }
        assert!(turned > 0.3, "the wave is steep: {turned}");
    }

    #[test]
    fn normals_are_those_of_the_faces_and_seams_stay_closed() {
        for name in ["torus-knot", "bumpy-sphere", "cloth"] {
            let mesh = builtin::mesh(name, 256).unwrap();
            let moved = WAVE.displaced(&mesh, 7);
            let faces = area_weighted_normals(&moved.positions, &moved.indices);
            let apart = |a: &[f32; 3], b: &[f32; 3]| f64::from(Vec3::from(*a).distance(Vec3::from(*b)));
            let mean = moved.normals.iter().zip(&faces).map(|(a, b)| apart(a, b)).sum::<f64>() / faces.len() as f64;
            assert!(mean < 2e-3, "{name}: {mean}");
            // Copies of the first and last column of each row.
            let columns = mesh.uvs.iter().position(|uv| uv[0] == 1.0).unwrap();
            let (rows, used) = (moved.positions.chunks(columns + 1).zip(moved.normals.chunks(columns + 1)), used(&mesh));
            for ((row, normals), used) in rows.zip(used.chunks(columns + 1)) {
                if name != "cloth" && used[0] && used[columns] {
                    assert!(apart(&row[0], &row[columns]) < 1e-6, "{name}");
                    assert!(apart(&normals[0], &normals[columns]) < 5e-3, "{name}: {:?} {:?}", normals[0], normals[columns]);
                }
            }
        }
    }

    #[test]
    fn tangents_stay_across_normals_and_follow_the_surface() {
        let mut mesh = builtin::mesh("cloth", 128).unwrap();
        mesh.compute_tangents();
        let moved = WAVE.displaced(&mesh, 2);
        let mut anew = moved.clone();
        anew.compute_tangents();
        assert_eq!(anew.positions, moved.positions, "nothing was split");
        for ((a, b), n) in moved.tangents.iter().zip(&anew.tangents).zip(&moved.normals) {
            let (a, b) = (Vec4::from(*a), Vec4::from(*b));
            let along = a.truncate();
            assert!((along.length() - 1.0).abs() < 1e-5 && along.dot(Vec3::from(*n)).abs() < 1e-5);
            assert!(along.dot(b.truncate()) > 0.999 && a.w == b.w, "{a} {b}");
        }
    }

    #[test]
    fn without_amplitude_nothing_changes_and_a_period_repeats() {
        let mesh = builtin::mesh("torus-knot", 64).unwrap();
        let still = Wave { amplitude: 0.0, ..WAVE }.displaced(&mesh, 5);
        let near = |a: &[f32; 3], b: &[f32; 3]| Vec3::from(*a).distance(Vec3::from(*b)) < 1e-6;
        assert_eq!(still.positions, mesh.positions);
        assert!(still.normals.iter().zip(&mesh.normals).all(|(a, b)| near(a, b)));
        let [first, later] = [0, 14].map(|frame| WAVE.displaced(&mesh, frame));
        assert!(first.positions.iter().zip(&later.positions).all(|(a, b)| near(a, b)), "14 frames of 0.05 are one length");
        assert_ne!(first.positions, WAVE.displaced(&mesh, 7).positions);
    }

    #[test]
    fn vertices_without_faces_and_flat_ones_stay_finite() {
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [5.0; 3]],
            normals: vec![[0.0, 0.0, 1.0], [0.0; 3], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
            uvs: vec![[0.0; 2]; 4],
            tangents: vec![[0.0; 4]; 4],
            indices: vec![0, 1, 2, 0, 0, 9],
            has_uvs: true,
        };
        let moved = WAVE.displaced(&mesh, 1);
        let all = moved.positions.iter().chain(&moved.normals).flatten().chain(moved.tangents.iter().flatten());
        assert!(all.clone().all(|c| c.is_finite()), "{moved:?}");
    }
}
