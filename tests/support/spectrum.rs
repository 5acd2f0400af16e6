//! A mirror ball in the cosine environment, and the frequency that its image has in windows.

use glam::{DVec2, DVec3};
use passband::frequency::operators::{Operator, Surface, pixel_angle};
use passband::offline::bench::spectrum::{LEAST, WINDOW, bandwidth};
use passband::offline::world::Camera;
use std::f64::consts::TAU;

/// Cycles/pixel above which pixels alias.
const MOST: f64 = 0.45;

/// Radiance of each pixel that shows a unit ball in light `1 + cos(k angle from +X)`, and the bandwidth by the operator.
pub fn seen(k: f64, size: usize) -> Vec<Option<(f64, f64)>> {
    let camera = Camera { position: DVec3::new(0.0, 0.5, 3.6), target: DVec3::ZERO, up: DVec3::Y, fov_y: 36.0 };
    let extent = [size as u32; 2];
    let step = 2.0 * (camera.fov_y.to_radians() / 2.0).tan() / size as f64;
    // Radiance and prediction where the ball is.
    let seen = |i: usize| {
        let at = DVec2::new((i % size) as f64 + 0.5, (i / size) as f64 + 0.5);
        let ray = camera.ray(at, extent);
        let b = ray.dot(camera.position);
        let root = b * b - camera.position.length_squared() + 1.0;
        (root > 0.0).then(|| {
            let distance = -b - root.sqrt();
            let n = camera.position + ray * distance;
            let reflected = ray - 2.0 * ray.dot(n) * n;
            let plane = (at - 0.5 * size as f64) * step;
            let pixel = pixel_angle(plane.to_array(), [step; 2]);
            let surface = Surface { curvatures: [1.0; 2], distance, cosine: -ray.dot(n), pixel };
            let radiance = 1.0 + (k * reflected.x.clamp(-1.0, 1.0).acos()).cos();
            (radiance, Operator::default().image(k / TAU, 1e9, &surface))
        })
    };
    (0..size * size).map(seen).collect()
}

/// Predicted over measured bandwidth, sorted, of the windows that lie on the ball and whose measurement counts.
pub fn ratios(k: f64, size: usize) -> Vec<f64> {
    let image = seen(k, size);
    let mut ratios = Vec::new();
    for top in (0..=size - WINDOW).step_by(WINDOW / 2) {
        for left in (0..=size - WINDOW).step_by(WINDOW / 2) {
            let pixel = |i: usize| image[(top + i / WINDOW) * size + left + i % WINDOW];
            let window: Option<Vec<_>> = (0..WINDOW * WINDOW).map(pixel).collect();
            let Some(window) = window else { continue };
            // Its sharpest corner must not alias.
            if window.iter().any(|(_, b)| *b > MOST) {
                continue;
            }
            let measured = bandwidth(&window.iter().map(|w| Some(w.0)).collect::<Vec<_>>()).expect("the whole window has values");
            let (_, predicted) = window[WINDOW / 2 * WINDOW + WINDOW / 2];
            if measured >= LEAST {
                ratios.push(predicted / measured);
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    ratios
}
