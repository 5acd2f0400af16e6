//! Whether a mesh's texture coordinates give each texel of a map one place on it, as cells in camera space need
//! ([`crate::Bins::Camera`]): a texel has one frame.

use crate::error::{Error, Result};
use glam::DVec2;

/// How far, in texels, coordinates may reach beyond the map, and triangles into each other's texels: less than what a rasteriser
/// tells apart.
const SLACK: f64 = 1e-3;

/// Points of a texel that no two triangles may share: its centre, which is what a rasteriser looks at, and one that is on no side
/// of triangles whose corners are on the centres of a grid, as those of two sheets may be.
const POINTS: [DVec2; 2] = [DVec2::new(0.5, 0.5), DVec2::new(0.6234, 0.5789)];

/// Refuses meshes whose texture coordinates leave the unit square, or with two triangles over the centre of one texel of a map of
/// `size`, both sides above 0, or over one other point of it. `field` says in the error whose mesh it is. Triangles without area
/// have no texels.
///
/// # Errors
/// [`Error::InvalidInput`] with the triangle and what is wrong with it.
pub fn check(field: &str, coordinates: &[[f32; 2]], indices: &[u32], size: [u32; 2]) -> Result<()> {
    let [width, height] = size.map(|side| side.max(1));
    let scale = DVec2::new(width.into(), height.into());
    let mut owners = POINTS.map(|point| (point, vec![u32::MAX; width as usize * height as usize]));
    for (number, triangle) in (0u32..).zip(indices.as_chunks::<3>().0) {
        let named = || format!("{field} texture coordinates of triangle {number}");
        let mut corners = [DVec2::ZERO; 3];
        for (corner, index) in corners.iter_mut().zip(triangle) {
            let Some([u, v]) = coordinates.get(*index as usize) else {
                return Err(Error::invalid(named(), format!("vertices below {}", coordinates.len()), index));
            };
            // Rows are counted from the top, coordinates upwards.
            *corner = DVec2::new(f64::from(*u), 1.0 - f64::from(*v)) * scale;
            let inside = corner.cmpge(DVec2::splat(-SLACK)).all() && corner.cmple(scale + SLACK).all();
            if !inside {
                let expected = "0 to 1, as bins are camera (tangent bins take any)";
                return Err(Error::invalid(named(), expected, format!("({u}, {v})")));
            }
        }
        let claimed = owners.iter_mut().find_map(|(point, owners)| claim(owners, width, corners, *point, number));
        if let Some([x, y, other]) = claimed {
            let expected = "texels that no other triangle has, as bins are camera (tangent bins take any)";
            let got = format!("texel ({x}, {y}) of {width}x{height}, which triangle {other} has too");
            return Err(Error::invalid(named(), expected, got));
        }
    }
    Ok(())
}

/// Marks the texels of which `point` is in a triangle; the first that has an owner already, and who that is.
fn claim(owners: &mut [u32], width: u32, [a, b, c]: [DVec2; 3], point: DVec2, number: u32) -> Option<[u32; 3]> {
    let area = (b - a).perp_dot(c - a);
    let longest = [b - a, c - b, a - c].map(DVec2::length).into_iter().fold(0.0, f64::max);
    // Less wide than the slack on both sides.
    if area.abs() <= 2.0 * SLACK * longest {
        return None;
    }
    // Distances of a point from the sides, inwards.
    let side = |from: DVec2, to: DVec2, p: DVec2| (to - from).perp_dot(p - from) * area.signum() / (to - from).length();
    let (least, most) = (a.min(b).min(c), a.max(b).max(c));
    // Texels within the triangle's box; casts to whole numbers stop at 0.
    let (first, end) = ((least - point).ceil(), (most - point).floor() + 1.0);
    for y in first.y as u32..end.y as u32 {
        for x in first.x as u32..end.x as u32 {
            let p = DVec2::new(x.into(), y.into()) + point;
            if [side(a, b, p), side(b, c, p), side(c, a, p)].into_iter().all(|distance| distance > SLACK)
                && let Some(owner) = owners.get_mut(y as usize * width as usize + x as usize).filter(|_| x < width)
            {
                if *owner != u32::MAX {
                    return Some([x, y, *owner]);
                }
                *owner = number;
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: [u32; 6] = [0, 1, 2, 0, 2, 3];
    const SQUARE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    fn refusal(coordinates: &[[f32; 2]], indices: &[u32], size: [u32; 2]) -> String {
        check("objects[3]", coordinates, indices, size).unwrap_err().to_string()
    }

    #[test]
    fn one_place_a_texel_passes() {
        for size in [[1, 1], [16, 16], [67, 45], [512, 3]] {
            check("", &SQUARE, &QUAD, size).unwrap();
            // Either winding, and sides that meet on centres of texels.
            check("", &SQUARE.map(|[u, v]| [1.0 - u, v]), &QUAD, size).unwrap();
            let halves = [SQUARE.map(|[u, v]| [0.5 * u, v]), SQUARE.map(|[u, v]| [0.5 + 0.5 * u, v])].concat();
            let both: Vec<u32> = QUAD.into_iter().chain(QUAD.map(|i| i + 4)).collect();
            check("", &halves, &both, size).unwrap();
        }
        // No area, no texels: as of a mesh without coordinates.
        check("", &[[0.5; 2]; 4], &[QUAD, QUAD].concat(), [64, 64]).unwrap();
    }

    #[test]
    fn what_has_no_or_two_places_is_refused_with_field_and_what_is_wrong() {
        for (far, got) in [([1.5, 0.0], "(1.5, 0)"), ([0.0, -0.01], "(0, -0.01)"), ([f32::NAN, 0.0], "(NaN, 0)")] {
            let e = refusal(&[SQUARE[0], far, SQUARE[2], SQUARE[3]], &QUAD, [64, 64]);
            assert!(e.contains("objects[3] texture coordinates of triangle 0: expected 0 to 1") && e.contains(got), "{e}");
        }
        // Twice the same, and a triangle that reaches over a diagonal.
        let e = refusal(&SQUARE, &[QUAD, QUAD].concat(), [64, 64]);
        assert!(e.contains("triangle 2: expected texels that no other") && e.contains("which triangle 0 has too"), "{e}");
        let e = refusal(&[SQUARE.as_slice(), &[[0.6, 0.4]]].concat(), &[0, 1, 2, 0, 4, 3], [64, 64]);
        assert!(e.contains("triangle 1") && e.contains("64x64"), "{e}");
        // Two sheets of cells as large as texels whose corners are on the texels' centres.
        let corner = |i: u16| [f32::from(i % 4) / 4.0 + 0.125, f32::from(i / 4) / 4.0 + 0.125];
        let corners: Vec<_> = (0..16).map(corner).collect();
        let sheet: Vec<u32> = [0, 1, 2, 4, 5, 6, 8, 9, 10].into_iter().flat_map(|i| [i, i + 1, i + 5, i, i + 5, i + 4]).collect();
        check("", &corners, &sheet, [4, 4]).unwrap();
        let e = refusal(&corners, &[sheet.as_slice(), sheet.as_slice()].concat(), [4, 4]);
        assert!(e.contains("triangle 19: expected texels") && e.contains("which triangle 1 has too"), "{e}");
        let e = refusal(&SQUARE, &[0, 1, 9], [4, 4]);
        assert!(e.contains("vertices below 4, got 9"), "{e}");
    }
}
