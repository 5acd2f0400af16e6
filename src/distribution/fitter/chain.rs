//! Lobes in a row in the plane of incidence, known by three numbers.

use crate::distribution::vmf::spread;
use std::f64::consts::LN_2;

/// log2 of the least and the greatest concentration of a lobe: what the pre-convolved light is there for.
pub const LOG2_KAPPA: [f64; 2] = [-1.0, 17.0];
/// The cosine of the half vector counts as at least this.
const LEAST_COSINE: f64 = 1e-3;

/// Numbers of a chain.
pub const NUMBERS: usize = 3;

/// A row of equally spaced lobes of half vectors. Reflected, a lobe of half vectors is narrowed across the plane of incidence
/// by `2 o.h`: that is the width of the lobe of light directions that stands for it, and along the plane, where it is stretched
/// against that by `1 / o.h`, there are several. In these terms a chain changes little with the view angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// Lobes.
    pub count: usize,
    /// Tilt of its middle from the normal in radians, away from the viewer; log2 of the half vectors' concentration; distance of
    /// neighbours in standard deviations of half vectors.
    pub numbers: [f64; NUMBERS],
}

impl Chain {
    /// Tilt and log2 concentration of its lobes of light directions under a view angle.
    pub fn lobes(&self, view: f64) -> impl Iterator<Item = [f64; 2]> + use<> {
        let Self { count, numbers: [middle, log2_kappa, spacing] } = *self;
        let step = spacing * (-0.5 * log2_kappa).exp2();
        (0..count).map(move |i| {
            let tilt = middle + (i as f64 - 0.5 * (count - 1) as f64) * step;
            let cosine = (view + tilt).cos().max(LEAST_COSINE);
            [view + 2.0 * tilt, (log2_kappa - 2.0 - 2.0 * cosine.log2()).clamp(LOG2_KAPPA[0], LOG2_KAPPA[1])]
        })
    }

    /// The derivatives of its lobes' numbers by its own, `[lobe][number]`.
    pub fn slopes(&self, view: f64) -> Vec<[[f64; 2]; NUMBERS]> {
        const STEP: f64 = 1e-5;
        let mut slopes = vec![[[0.0; 2]; NUMBERS]; self.count];
        for number in 0..NUMBERS {
            let moved = |by: f64| {
                let mut chain = *self;
                chain.numbers[number] += by;
                chain.lobes(view)
            };
            for ((slope, more), less) in slopes.iter_mut().zip(moved(STEP)).zip(moved(-STEP)) {
                slope[number] = std::array::from_fn(|i| (more[i] - less[i]) / (2.0 * STEP));
            }
        }
        slopes
    }

    /// What a change of its numbers is measured in.
    pub fn units(&self) -> [f64; NUMBERS] {
        [(-0.5 * self.numbers[1]).exp2(), 1.0, 1.0]
    }

    /// Moved, within what a chain may be.
    pub fn moved(&self, by: &[f64]) -> Self {
        const RANGES: [[f64; 2]; NUMBERS] = [[-1.2, 0.6], [-1.0, 21.0], [0.05, 4.0]];
        let numbers = std::array::from_fn(|i| (self.numbers[i] + by[i]).clamp(RANGES[i][0], RANGES[i][1]));
        Self { numbers, ..*self }
    }
}

/// Derivative of a lobe's logarithm by log2 of its concentration, where its exponent is `exponent`.
pub fn by_log2_kappa(kappa: f64, exponent: f64) -> f64 {
    LN_2 * (kappa * spread(kappa) + exponent)
}
