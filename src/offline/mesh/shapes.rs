//! Meshes by formula: centred, in the unit sphere (the sheets are 2x2), counter-clockwise from outside, with analytic normals.
//! `v` grows upwards, and `u` to the right as seen from outside; seam vertices are duplicated.

use crate::offline::mesh::Mesh;
use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

/// Position and unit normal of a surface at `(u, v)` in the unit square.
type Point = (DVec3, DVec3);

/// Unit sphere of `detail` columns and half as many rows.
pub(crate) fn sphere(detail: u32) -> Mesh {
    grid(detail, detail / 2, |uv| {
        let d = around(uv);
        (d, d)
    })
}

/// A sphere whose radius varies by 12 % with the mean of three sines, scaled to fit the unit sphere; twice as fine as
/// [`sphere`].
pub(crate) fn bumpy_sphere(detail: u32) -> Mesh {
    const AMPLITUDE: f64 = 0.12;
    // Wave vectors and phases: a few bumps across, in no direction twice.
    let waves = [(dvec3(6.1, 1.3, -2.2), 0.4), (dvec3(-1.7, 6.8, 2.9), 1.9), (dvec3(2.4, -3.1, 7.3), 3.3)];
    grid(2 * detail, detail, |uv| {
        let d = around(uv);
        let (mut height, mut gradient) = (0.0, DVec3::ZERO);
        for (wave, phase) in waves {
            let (sin, cos) = (wave.dot(d) + phase).sin_cos();
            height += sin / waves.len() as f64;
            gradient += wave * cos / waves.len() as f64;
        }
        let radius = 1.0 + AMPLITUDE * height;
        // The surface is |x| = radius(x / |x|): its normal is the gradient of |x| - radius, tangential part over |x|.
        let tangential = gradient - d * d.dot(gradient);
        (d * radius / (1.0 + AMPLITUDE), (d - tangential * AMPLITUDE / radius).normalize())
    })
}

/// A tube along the (2,3) torus knot, its axis along z. `u` runs along the tube.
pub(crate) fn torus_knot(detail: u32) -> Mesh {
    grid(3 * detail, detail / 4, |uv| {
        let (sin, cos) = (uv.y * TAU).sin_cos();
        let (centre, outward, across) = knot_frame(uv.x * TAU);
        // The frame is orthogonal to the tangent, so the direction from the centre line is the normal.
        let normal = outward * cos + across * sin;
        (centre + normal * TUBE, normal)
    })
}

/// Radii of the knot's torus and of its tube: together they reach 1.
const TORUS: [f64; 2] = [0.56, 0.27];
const TUBE: f64 = 0.17;

/// Centre line at parameter `t` with two unit vectors across it: the torus' normal, which closes without a twist, and
/// the one that makes the tube face outwards.
fn knot_frame(t: f64) -> (DVec3, DVec3, DVec3) {
    let [major, minor] = TORUS;
    let ((s2, c2), (s3, c3)) = ((2.0 * t).sin_cos(), (3.0 * t).sin_cos());
    let radial = dvec3(c2, s2, 0.0);
    let along = dvec3(-s2, c2, 0.0);
    let outward = radial * c3 + DVec3::Z * s3;
    let centre = radial * major + outward * minor;
    let tangent = along * (2.0 * (major + minor * c3)) + (DVec3::Z * c3 - radial * s3) * (3.0 * minor);
    (centre, outward, outward.cross(tangent).normalize())
}

/// The square -1..1 in x and z at y = 0, facing +Y; a sixteenth of `detail` cells a side.
pub(crate) fn plane(detail: u32) -> Mesh {
    grid((detail / 16).max(1), (detail / 16).max(1), |uv| {
        let p = sheet(uv);
        (dvec3(p.x, 0.0, p.y), DVec3::Y)
    })
}

/// The circle in the square of [`plane`], with its texture coordinates: `detail` corners, an eighth as many rings.
pub(crate) fn disk(detail: u32) -> Mesh {
    let mut mesh = grid(detail, (detail / 8).max(1), |uv| {
        let (sin, cos) = (uv.x * TAU).sin_cos();
        (dvec3(cos, 0.0, -sin) * (1.0 - uv.y), DVec3::Y)
    });
    let coordinates = |[x, _, z]: &[f32; 3]| [0.5 + 0.5 * x, 0.5 - 0.5 * z];
    mesh.uvs = mesh.positions.iter().map(coordinates).collect();
    mesh
}

/// The square of [`plane`] in gentle waves of up to 0.1, `detail` cells a side.
pub(crate) fn cloth(detail: u32) -> Mesh {
    let waves = [(0.05, dvec2(4.1, 1.6), 0.3), (0.03, dvec2(-2.3, 5.2), 1.7), (0.02, dvec2(7.4, -3.9), 2.6)];
    grid(detail, detail, |uv| {
        let p = sheet(uv);
        let (mut height, mut slope) = (0.0, DVec2::ZERO);
        for (amplitude, wave, phase) in waves {
            let (sin, cos) = (wave.dot(p) + phase).sin_cos();
            height += amplitude * sin;
            slope += wave * (amplitude * cos);
        }
        (dvec3(p.x, height, p.y), dvec3(-slope.x, 1.0, -slope.y).normalize())
    })
}

/// Two sheets over the square of half side sqrt(1/2) in x and z that meet at its edges, up to 0.2 away from y = 0; each has all
/// of the texture, `detail` cells a side.
pub(crate) fn pillow(detail: u32) -> Mesh {
    const HEIGHT: f64 = 0.2;
    let side = |towards: f64| {
        grid(detail, detail, |uv| {
            let p = sheet(uv);
            let across = dvec2(1.0 - p.x.powi(4), 1.0 - p.y.powi(4));
            let slope = -4.0 * SQUARE.recip() * HEIGHT * dvec2(p.x.powi(3) * across.y, p.y.powi(3) * across.x);
            let position = dvec3(SQUARE * p.x, towards * HEIGHT * across.x * across.y, SQUARE * p.y);
            (position, dvec3(-slope.x, towards, -slope.y).normalize())
        })
    };
    let (mut mesh, below) = (side(1.0), side(-1.0));
    let first = mesh.positions.len() as u32;
    mesh.indices.extend(below.indices.as_chunks::<3>().0.iter().flat_map(|[a, b, c]| [a, c, b].map(|i| first + i)));
    mesh.positions.extend(below.positions);
    mesh.normals.extend(below.normals);
    mesh.uvs.extend(below.uvs);
    mesh
}

/// An upright tube without ends, sqrt(1/2) in radius and in half its height: `detail` columns and an eighth as many rows.
pub(crate) fn cylinder(detail: u32) -> Mesh {
    grid(detail, detail / 8, |uv| {
        let normal = around(dvec2(uv.x, 0.5));
        (dvec3(SQUARE * normal.x, SQUARE * (2.0 * uv.y - 1.0), SQUARE * normal.z), normal)
    })
}

/// Half a side of the square in the unit circle.
const SQUARE: f64 = FRAC_1_SQRT_2;

/// Direction at `(u, v)`: `v` = 1 is up (+Y), `u` = 0.5 the front (+Z).
fn around(uv: DVec2) -> DVec3 {
    let ((sin_phi, cos_phi), (sin, cos)) = (((uv.x - 0.5) * TAU).sin_cos(), ((1.0 - uv.y) * PI).sin_cos());
    dvec3(sin * sin_phi, cos, sin * cos_phi)
}

/// x and z at `(u, v)`: `v` = 1 is the far edge (-Z).
fn sheet(uv: DVec2) -> DVec2 {
    dvec2(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y)
}

/// Samples `surface` on `columns` x `rows` cells, two triangles each; triangles that collapse at a pole are left out.
fn grid(columns: u32, rows: u32, surface: impl Fn(DVec2) -> Point) -> Mesh {
    let mut mesh = Mesh { has_uvs: true, ..Default::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let uv = dvec2(f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
            // Both ends of a closed direction meet exactly: angles of 0 and 2 pi differ in the last bit.
            let (position, normal) = surface(uv);
            mesh.positions.push(position.as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            mesh.uvs.push(uv.as_vec2().to_array());
        }
    }
    let pole = |a: u32, b: u32| match (mesh.positions.get(a as usize), mesh.positions.get(b as usize)) {
        (Some(a), Some(b)) => glam::Vec3::from(*a).distance(glam::Vec3::from(*b)) < 1e-6,
        _ => false,
    };
    let mut indices = Vec::with_capacity(6 * columns as usize * rows as usize);
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
            if !pole(a, b) {
                indices.extend([a, b, c]);
            }
            if !pole(c, d) {
                indices.extend([a, c, d]);
            }
        }
    }
    mesh.indices = indices;
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strands of the knot must not touch, or the surface would not be a closed smooth one.
    #[test]
    fn knot_does_not_meet_itself() {
        let line: Vec<DVec3> = (0..600).map(|i| knot_frame(f64::from(i) / 600.0 * TAU).0).collect();
        let mut least = f64::MAX;
        for i in 0..600 {
            for j in i + 60..(i + 541).min(600) {
                least = least.min(line[i].distance(line[j]));
            }
        }
        assert!(least > 2.2 * TUBE, "{least}");
    }

    #[test]
    fn seams_close() {
        for mesh in [sphere(32), bumpy_sphere(16), torus_knot(32), cylinder(16)] {
            let columns = mesh.uvs.iter().position(|uv| uv[0] == 1.0).unwrap();
            for row in mesh.positions.chunks(columns + 1) {
                let gap = glam::Vec3::from(row[0]).distance(glam::Vec3::from(row[columns]));
                assert!(gap < 1e-6, "{gap}");
            }
        }
    }
}
