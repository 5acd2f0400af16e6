//! Differences in linear radiance.

use crate::offline::metrics::{Pair, masked, ratio};

/// The share of the mean's square that keeps `relmse` finite in the dark.
const RELMSE_EPSILON: f64 = 1e-2;
/// Rec.709 luminance.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// What [`measure`] finds; see [`crate::offline::metrics::Metrics`].
pub struct Linear {
    pub rmse: f64,
    pub rel_l2: f64,
    pub relmse: f64,
    pub max_abs: f64,
    /// Mean of B over masked pixels and channels.
    pub mean: f64,
    /// Mean luminance of B over masked pixels.
    pub mean_luminance: f64,
}

/// Over the `pixels` masked pixels of all frames.
pub fn measure(pairs: &[Pair], pixels: usize) -> Linear {
    let count = 3.0 * pixels as f64;
    let (mut error, mut energy, mut sum, mut luminance, mut max_abs) = (0.0, 0.0, 0.0, 0.0, 0.0_f64);
    for (a, b) in pairs.iter().flat_map(masked) {
        for ((a, b), weight) in a.into_iter().zip(b).zip(LUMINANCE) {
            error += (a - b).powi(2);
            energy += b * b;
            sum += b;
            luminance += weight * b;
            max_abs = max_abs.max((a - b).abs());
        }
    }
    let mean = sum / count;
    let epsilon = RELMSE_EPSILON * mean * mean;
    let relative = |(a, b): (f64, f64)| ratio((a - b).powi(2), b * b + epsilon);
    let relmse: f64 = pairs.iter().flat_map(masked).flat_map(|(a, b)| a.into_iter().zip(b)).map(relative).sum();
    Linear {
        rmse: (error / count).sqrt(),
        rel_l2: ratio(error.sqrt(), energy.sqrt()),
        relmse: relmse / count,
        max_abs,
        mean,
        mean_luminance: luminance / pixels as f64,
    }
}
