//! What a fit by lobes leaves of a reflectance, over rows of half vectors as importance tables want it.

use crate::distribution::fit::FitNode;
use crate::distribution::vmf::normalisation;
use crate::reflectance::Reflectance;
use crate::reflectance::half_row::{HalfRow, Rows};
use glam::DVec3;
use std::f64::consts::PI;

/// Exponents below this count as no density: 1e-13 of a lobe's centre.
const FAINT: f64 = -30.0;

/// A reflectance by channel.
pub(super) struct Residual<'a> {
    channels: [Rows<'a>; 3],
}

impl<'a> Residual<'a> {
    pub fn of(reflectance: &'a dyn Reflectance) -> Self {
        Self { channels: DVec3::AXES.map(|axis| reflectance.rows(axis)) }
    }

    /// Writes the mean over channels of `|f - a|` for a row of which light comes from above the horizon in the first `lit` columns,
    /// and that of f, times the cosine both.
    pub fn row<const N: usize>(&self, fit: &FitNode, row: &HalfRow<'_>, lit: usize, [left, all]: [&mut [f64; N]; 2]) {
        let mut fitted = [[0.0; N]; 3];
        add(fit, row, &mut fitted);
        let above = row.first(lit);
        (*left, *all) = ([0.0; N], [0.0; N]);
        for (rows, a) in self.channels.iter().zip(&fitted) {
            let mut f = [0.0; N];
            if lit > 0 {
                rows(&above, &mut f[..lit]);
            }
            for (value, light) in f.iter_mut().zip(above.lights) {
                *value = if *value > 0.0 && *value < f64::INFINITY { *value * light } else { 0.0 };
            }
            for (((left, all), f), a) in left.iter_mut().zip(all.iter_mut()).zip(f).zip(a) {
                *left += (f - a).abs() / 3.0;
                *all += f / 3.0;
            }
        }
    }
}

/// Adds the fit's values by channel.
fn add<const N: usize>(fit: &FitNode, row: &HalfRow<'_>, fitted: &mut [[f64; N]; 3]) {
    let count = row.cosines.len().min(N);
    let mut across = [0.0; N];
    for ((x, azimuth), cosine) in across.iter_mut().zip(row.azimuths[0]).zip(row.cosines) {
        *x = 2.0 * cosine * row.polar[0] * azimuth - row.wo.x;
    }
    let used = fit.lobes.iter().filter(|lobe| lobe.amplitude != DVec3::ZERO);
    for lobe in used {
        let (kappa, (sin, cos)) = (lobe.log2_kappa.exp2(), lobe.tilt.sin_cos());
        let peak = lobe.amplitude * normalisation(kappa);
        for (i, (x, light)) in across[..count].iter().zip(row.lights).enumerate() {
            let exponent = kappa * (cos * light - sin * x - 1.0);
            if exponent > FAINT {
                let value = exponent.exp();
                fitted.iter_mut().zip(peak.to_array()).for_each(|(a, peak)| a[i] += peak * value);
            }
        }
    }
    for (a, diffuse) in fitted.iter_mut().zip(fit.diffuse.to_array()) {
        a.iter_mut().zip(row.lights).for_each(|(a, light)| *a += diffuse / PI * light.max(0.0));
    }
}
