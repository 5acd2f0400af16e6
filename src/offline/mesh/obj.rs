//! Wavefront OBJ, through `tobj`.

use crate::offline::error::{At, Error, Result};
use crate::offline::input;
use crate::offline::mesh::{Mesh, area_weighted_normals};
use glam::{Vec2, Vec3};
use std::path::Path;

/// Reads every face of an OBJ file as one mesh: polygons as fans, groups merged, materials, lines and points left out.
/// Normals come from the file; a group with any corner that has none gets area-weighted ones, as does a corner
/// whose normal has no length. Texture coordinates count only if every corner has them.
///
/// # Errors
/// [`Error::File`] with the line of a position, normal or coordinate that is not finite and of an index that is out of
/// range; without one if there are no triangles.
pub fn read_obj(path: &Path) -> Result<Mesh> {
    parse(path, &input::read(path)?)
}

/// [`read_obj`] of a file's content.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let text = String::from_utf8_lossy(bytes);
    check(path, &text)?;
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    let loaded = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default()));
    let (groups, _) = loaded.map_err(|e| Error::file(path, At::File, "OBJ", "a well-formed Wavefront OBJ", e))?;

    let mut mesh = Mesh { has_uvs: true, ..Default::default() };
    let mut unknown = Vec::new();
    for tobj::Model { mesh: group, .. } in groups {
        let first = mesh.positions.len();
        mesh.positions.extend_from_slice(group.positions.as_chunks().0);
        let count = mesh.positions.len() - first;
        let overflow = |_| Error::file(path, At::File, "vertices", "fewer than 2^32", mesh.positions.len());
        let offset = u32::try_from(first).map_err(overflow)?;
        u32::try_from(mesh.positions.len()).map_err(overflow)?;
        mesh.indices.extend(group.indices.iter().map(|i| i + offset));
        let normals: &[[f32; 3]] = group.normals.as_chunks().0;
        // A file may give normals to some corners only; then they cannot be told apart any more.
        let normals = if normals.len() == count { normals.to_vec() } else { vec![[0.0; 3]; count] };
        for (i, normal) in normals.into_iter().enumerate() {
            let unit = Vec3::from(normal).as_dvec3().try_normalize();
            if unit.is_none() {
                unknown.push(first + i);
            }
            mesh.normals.push(unit.unwrap_or_default().as_vec3().to_array());
        }
        let uvs: &[[f32; 2]] = group.texcoords.as_chunks().0;
        mesh.has_uvs &= uvs.len() == count;
        mesh.uvs.extend_from_slice(uvs);
    }
    if mesh.indices.len() < 3 {
        return Err(Error::file(path, At::File, "faces", "at least one triangle", "none"));
    }
    if !mesh.has_uvs {
        mesh.uvs = vec![Vec2::ZERO.to_array(); mesh.positions.len()];
    }
    if !unknown.is_empty() {
        let normals = area_weighted_normals(&mesh.positions, &mesh.indices);
        for at in unknown {
            if let (Some(normal), Some(known)) = (mesh.normals.get_mut(at), normals.get(at)) {
                *normal = *known;
            }
        }
    }
    Ok(mesh)
}

/// Checks numbers and indices line by line: the parser accepts `nan`, gives no line numbers, and computes with any index.
fn check(path: &Path, text: &str) -> Result<()> {
    let kind = |line: &str| match line.split_whitespace().next() {
        Some("v") => Some(0),
        Some("vt") => Some(1),
        Some("vn") => Some(2),
        _ => None,
    };
    let mut total = [0_i64; 3];
    for kind in text.lines().filter_map(kind) {
        total[kind] += 1;
    }
    let mut so_far = [0_i64; 3];
    for (line, at) in text.lines().zip(1..) {
        let fail = |field: &str, expected: &str, got: &str| Err(Error::file(path, At::Line(at), field, expected, got));
        if let Some(kind) = kind(line) {
            so_far[kind] += 1;
            let (name, count) = [("vertex position", 3), ("texture coordinate", 2), ("vertex normal", 3)][kind];
            let numbers = line.split_whitespace().skip(1).take(count);
            let finite = numbers.filter(|n| n.parse::<f32>().is_ok_and(f32::is_finite)).count();
            if finite != count {
                return fail(name, &format!("{count} finite numbers"), line);
            }
        }
        let mut words = line.split_whitespace();
        if !matches!(words.next(), Some("f" | "l")) {
            continue;
        }
        let mut corners = 0;
        for corner in words {
            corners += 1;
            let mut parts = 0;
            for (kind, index) in corner.split('/').enumerate() {
                parts += 1;
                if index.is_empty() && kind > 0 {
                    continue;
                }
                // Positive indices count from the file's start, negative ones back from here.
                let (Some(last), Some(here)) = (total.get(kind), so_far.get(kind)) else { break };
                let valid = index.parse::<i64>().is_ok_and(|i| (1..=*last).contains(&i) || (-*here..0).contains(&i));
                if !valid {
                    return fail("index", &format!("1 to {last}, or -{here} to -1"), index);
                }
            }
            if parts > 3 {
                return fail("face corner", "v, v/vt, v//vn or v/vt/vn", corner);
            }
        }
        if corners < 3 && line.trim_start().starts_with('f') {
            return fail("face", "at least 3 corners", &format!("{corners}"));
        }
    }
    Ok(())
}
