//! Meshes and environments by formula, by name.

use crate::error::Error as LibraryError;
use crate::offline::environment::skies;
use crate::offline::error::{Error, Result};
use crate::offline::mesh::{Mesh, shapes};
use crate::sampling::LatLong;

/// Names of the built-in meshes.
pub const MESHES: [&str; 8] = ["sphere", "bumpy-sphere", "torus-knot", "plane", "disk", "cloth", "pillow", "cylinder"];

/// Names of the built-in environments. `cosine-K` holds one frequency, of K radians a radian.
pub const ENVIRONMENTS: [&str; 6] = ["sun-sky", "studio", "constant", "cosine-64", "cosine-128", "cosine-200"];

/// Segments around the sphere that scenes get: silhouettes and curvature are smooth at 512x512.
pub const DEFAULT_DETAIL: u32 = 256;

/// Columns of the environments that scenes get.
pub const DEFAULT_WIDTH: u32 = 1024;

/// The mesh `name`, with `detail` segments around the sphere and in proportion on the other shapes. All are centred, fit
/// the unit sphere (`plane`,
/// `disk` and `cloth` are 2x2 in y = 0, facing +Y; `cylinder` is an upright tube without ends), are wound counter-clockwise and
/// carry UVs.
///
/// # Errors
/// [`Error::Argument`] for an unknown name or a `detail` outside 8 to 4096.
pub fn mesh(name: &str, detail: u32) -> Result<Mesh> {
    if !(8..=4096).contains(&detail) {
        return Err(Error::argument("mesh detail", "8 to 4096", detail));
    }
    Ok(match name {
        "sphere" => shapes::sphere(detail),
        "bumpy-sphere" => shapes::bumpy_sphere(detail),
        "torus-knot" => shapes::torus_knot(detail),
        "plane" => shapes::plane(detail),
        "disk" => shapes::disk(detail),
        "cloth" => shapes::cloth(detail),
        "pillow" => shapes::pillow(detail),
        "cylinder" => shapes::cylinder(detail),
        _ => return Err(Error::argument("built-in mesh", MESHES.join(", "), name)),
    })
}

/// The environment `name`, `width` columns by half as many rows. The sun of `sun-sky` has the same power at every width.
///
/// # Errors
/// [`Error::Argument`] for an unknown name or a `width` that is odd or outside 4 to 16384.
pub fn environment(name: &str, width: u32) -> Result<LatLong> {
    if !(4..=16_384).contains(&width) || width % 2 == 1 {
        return Err(Error::argument("environment width", "an even number from 4 to 16384", width));
    }
    let map = match name {
        "sun-sky" => skies::sun_sky(width),
        "studio" => skies::studio(width),
        "constant" => skies::constant(width),
        "cosine-64" => skies::cosine(width, 64.0),
        "cosine-128" => skies::cosine(width, 128.0),
        "cosine-200" => skies::cosine(width, 200.0),
        _ => return Err(Error::argument("built-in environment", ENVIRONMENTS.join(", "), name)),
    };
    map.map_err(|e: LibraryError| e.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    #[test]
    fn meshes_are_sound() {
        for name in MESHES {
            for detail in [8, 50, DEFAULT_DETAIL] {
                let m = mesh(name, detail).unwrap();
                assert_eq!((m.normals.len(), m.uvs.len()), (m.positions.len(), m.positions.len()), "{name}");
                assert!(m.has_uvs && m.normals.iter().all(|n| (Vec3::from(*n).length() - 1.0).abs() < 1e-5), "{name}");
                assert!(m.uvs.iter().flatten().all(|c| (0.0..=1.0).contains(c)), "{name}");
                for t in m.indices.chunks(3) {
                    let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(m.positions[t[i] as usize]));
                    let face = (b - a).cross(c - a);
                    assert!(face.length() > 0.0, "{name} {detail}: degenerate triangle {t:?}");
                    // Coarse tessellations bend; fine ones must agree with their analytic normals closely.
                    let agree = t.iter().map(|i| Vec3::from(m.normals[*i as usize]).dot(face.normalize())).fold(1.0, f32::min);
                    let least = if detail == DEFAULT_DETAIL {
                        0.97
                    } else if detail == 50 {
                        0.5
                    } else {
                        -1.0
                    };
                    assert!(agree > least, "{name} {detail}: {agree}");
                }
            }
        }
    }

    #[test]
    fn solids_fit_the_unit_sphere_and_are_closed() {
        for (name, least) in [("sphere", 0.99999), ("bumpy-sphere", 0.9), ("torus-knot", 0.99), ("pillow", 0.99999)] {
            let m = mesh(name, 64).unwrap();
            let radius = m.positions.iter().map(|p| Vec3::from(*p).length()).fold(0.0, f32::max);
            assert!((least..=1.00001).contains(&radius), "{name}: {radius}");
            // A closed outward surface encloses a positive volume, and its area vectors cancel.
            let (mut volume, mut sum) = (0.0, DVec3::ZERO);
            for t in m.indices.chunks(3) {
                let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(m.positions[t[i] as usize]).as_dvec3());
                volume += a.dot(b.cross(c)) / 6.0;
                sum += (b - a).cross(c - a);
            }
            assert!(volume > 0.3 && sum.length() < 1e-4, "{name}: {volume} {sum}");
        }
    }

    #[test]
    fn sheets_face_up() {
        for name in ["plane", "disk", "cloth"] {
            let m = mesh(name, 64).unwrap();
            assert!(m.normals.iter().all(|n| n[1] > 0.5), "{name}");
            let [x, z] = [0, 2].map(|c| m.positions.iter().map(|p| p[c].abs()).fold(0.0, f32::max));
            assert_eq!([x, z], [1.0, 1.0], "{name}");
        }
    }

    fn power(map: &LatLong) -> DVec3 {
        let (w, h) = (map.width() as usize, map.height() as usize);
        let rows = (0..h).map(|y| {
            let edge = |y: usize| (std::f64::consts::PI * y as f64 / h as f64).cos();
            let solid = (edge(y) - edge(y + 1)) * std::f64::consts::TAU / w as f64;
            (0..w).map(|x| map.texel(x as i64, y as i64)).sum::<DVec3>() * solid
        });
        rows.sum()
    }

    #[test]
    fn suns_keep_their_power() {
        let full = power(&environment("sun-sky", 1024).unwrap());
        for width in [128, 300, 512, 2048] {
            let other = power(&environment("sun-sky", width).unwrap());
            assert!(((other - full) / full).abs().max_element() < 0.005, "{width}: {other} {full}");
        }
        let map = environment("sun-sky", DEFAULT_WIDTH).unwrap();
        let brightest = map.texels().iter().flatten().fold(0.0_f32, |a, b| a.max(*b));
        let sun = map.texels().iter().filter(|t| t[0] > 1e3).count();
        assert!((1.5e4..3e4).contains(&brightest), "{brightest}");
        assert!((3..=16).contains(&sun), "{sun} texels");
    }

    #[test]
    fn constant_is_one_and_studio_is_mostly_dark() {
        assert!(environment("constant", 64).unwrap().texels().iter().all(|t| *t == [1.0; 3]));
        let studio = environment("studio", 256).unwrap();
        let lit = studio.texels().iter().filter(|t| t[1] > 1.0).count() as f64 / studio.texels().len() as f64;
        assert!((0.01..0.3).contains(&lit), "{lit}");
    }

    #[test]
    fn unknown_names_and_sizes_are_refused() {
        for error in [mesh("cube", 64).unwrap_err(), mesh("sphere", 0).unwrap_err(), mesh("sphere", 5000).unwrap_err()] {
            assert!(matches!(error, Error::Argument { .. }), "{error}");
        }
        for (name, width) in [("fog", 64), ("studio", 0), ("studio", 33), ("studio", 16_386)] {
            assert!(matches!(environment(name, width), Err(Error::Argument { .. })), "{name} {width}");
        }
    }
}
