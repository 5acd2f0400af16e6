//! The stereographic plane of directions, from -z: angles stay what they are in it, so that a round lobe is round. A direction at
//! the angle t from z is at `2 tan(t / 2)`. Twin of `glsl/include/stereographic.glsl`.

use glam::{DVec2, DVec3};

/// Directions of a smaller cosine to z count as having this: towards -z the plane grows without bound.
pub const LEAST_COSINE: f64 = -0.6;

/// Where unit `m` is.
pub fn of(m: DVec3) -> DVec2 {
    m.truncate() * (2.0 / (1.0 + m.z.max(LEAST_COSINE)))
}

/// The unit direction at `s`.
pub fn direction(s: DVec2) -> DVec3 {
    let p = 0.5 * s;
    let square = p.length_squared();
    (2.0 * p).extend(1.0 - square) / (1.0 + square)
}

/// Lengths in the plane at `s` over angles there.
pub fn scale(s: DVec2) -> f64 {
    1.0 + 0.25 * s.length_squared()
}

/// The unit tangent of the sphere, at the direction of `s`, along unit `along` in the plane.
pub fn tangent(s: DVec2, along: DVec2) -> DVec3 {
    let m = direction(s);
    let across = along.dot(m.truncate());
    (along - 0.5 * s * across).extend(-across)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plane_is_conformal() {
        for s in [DVec2::ZERO, DVec2::new(0.3, -0.2), DVec2::new(-1.4, 2.0)] {
            let m = direction(s);
            assert!((m.length() - 1.0).abs() < 1e-12 && (of(m) - s).length() < 1e-12);
            for along in [DVec2::X, DVec2::Y, DVec2::new(0.6, -0.8)] {
                let tangent = tangent(s, along);
                assert!((tangent.length() - 1.0).abs() < 1e-12 && tangent.dot(m).abs() < 1e-12);
                let step = (direction(s + 1e-6 * along) - m) * 1e6;
                assert!((step * scale(s) - tangent).length() < 1e-5, "{s} {along}");
            }
        }
        assert!(of(DVec3::NEG_Z).is_finite());
    }
}
