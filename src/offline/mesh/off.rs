//! Object File Format: `OFF`, counts, then a line for every vertex and every face (Geomview's format, without its
//! `ST`, `C`, `N`, `4` and `n` variants and without its binary form).

use crate::offline::error::{At, Error, Result};
use crate::offline::mesh::{Mesh, Parts};
use std::path::Path;

/// The shortest vertex is `0 0 0` with the end of its line.
const LEAST_VERTEX: u64 = 6;
/// The shortest face is `3 0 1 2` with the end of its line.
const LEAST_FACE: u64 = 8;

/// Reads an OFF text: polygons as fans, colours behind faces and comments left out; normals are weighted by area.
///
/// # Errors
/// [`Error::File`] with the line of what is missing, no number, not finite or out of range.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let text = String::from_utf8_lossy(bytes);
    let content = text.lines().zip(1..).map(|(line, at)| (line.split('#').next().unwrap_or_default().trim(), at));
    let mut lines = content.filter(|(line, _)| !line.is_empty());
    let last = text.lines().count() as u64;
    let fail = |at: u64, field: &str, expected: &str, got: &str| {
        let got: String = got.chars().take(80).collect();
        Err(Error::file(path, At::Line(at), field, expected, got))
    };

    let (first, at) = lines.next().unwrap_or_default();
    let Some(rest) = first.strip_prefix("OFF").filter(|rest| rest.is_empty() || rest.starts_with(char::is_whitespace)) else {
        return fail(at.max(1), "OFF", "the word OFF, and no other variant", first);
    };
    let (counts, at) = if rest.trim().is_empty() { lines.next().unwrap_or(("", last)) } else { (rest, at) };
    let numbers: Vec<Option<u64>> = counts.split_whitespace().map(|n| n.parse().ok()).collect();
    let (vertices, faces) = match numbers.as_slice() {
        [Some(vertices), Some(faces)] | [Some(vertices), Some(faces), Some(_)] => (*vertices, *faces),
        _ => return fail(at, "counts", "numbers of vertices, faces and edges", counts),
    };
    let needed = vertices.saturating_mul(LEAST_VERTEX).saturating_add(faces.saturating_mul(LEAST_FACE));
    if needed > bytes.len() as u64 + 1 || vertices > u64::from(u32::MAX) {
        return fail(at, "counts", &format!("what {} bytes can hold", bytes.len()), counts);
    }

    let mut parts = Parts::default();
    for _ in 0..vertices {
        let (line, at) = lines.next().unwrap_or(("", last));
        let mut position = [f32::NAN; 3];
        let mut words = line.split_whitespace();
        for (number, word) in position.iter_mut().zip(&mut words) {
            *number = word.parse().unwrap_or(f32::NAN);
        }
        if words.next().is_some() || !position.iter().all(|c| c.is_finite()) {
            return fail(at, "vertex position", "3 finite numbers", line);
        }
        parts.positions.push(position);
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        let (line, at) = lines.next().unwrap_or(("", last));
        let mut words = line.split_whitespace();
        let claimed = words.next().and_then(|n| n.parse::<usize>().ok());
        let Some(count) = claimed.filter(|count| *count >= 3) else {
            return fail(at, "face", "a number of corners, 3 or more", line);
        };
        corners.clear();
        corners.extend(words.take(count).map_while(|word| word.parse::<u32>().ok()));
        if corners.len() != count {
            return fail(at, "face", &format!("{count} indices"), line);
        }
        if let Some(bad) = corners.iter().find(|i| u64::from(**i) >= vertices) {
            return fail(at, "index", &format!("below {vertices}"), &bad.to_string());
        }
        parts.fan(&corners);
    }
    parts.finish(path)
}
