//! Quadrature over half vectors.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Midpoint quadrature over half vectors above the plane, fine near the normal (theta = (pi/2) x^2).
pub fn over_half_vectors(n: [usize; 2], mut f: impl FnMut(DVec3, f64)) {
    for i in 0..n[0] {
        let x = (i as f64 + 0.5) / n[0] as f64;
        let theta = FRAC_PI_2 * x * x;
        for j in 0..n[1] {
            let phi = 2.0 * PI * (j as f64 + 0.5) / n[1] as f64;
            let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            f(h, theta.sin() * PI * x / n[0] as f64 * 2.0 * PI / n[1] as f64);
        }
    }
}
