//! Reflectance over rows of half vectors, as tabulating it a million times wants it: what is the same in a row is computed
//! once, and the rest in loops that compilers vectorise.

use crate::reflectance::Reflectance;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Half vectors of one polar angle, at rising azimuths, under one viewer in the xz-plane. Both directions are above the
/// horizon, and on the same side of the half vector as it is of the surface.
pub struct HalfRow<'a> {
    /// To the viewer; its y is 0.
    pub wo: DVec3,
    /// Sine and cosine of the half vectors' polar angle.
    pub polar: [f64; 2],
    /// Cosine and sine of each one's azimuth from the viewer's, in [0, pi].
    pub azimuths: [&'a [f64]; 2],
    /// Its cosine with either direction.
    pub cosines: &'a [f64],
    /// The cosine of the light's direction with the normal.
    pub lights: &'a [f64],
}

impl HalfRow<'_> {
    /// The unit half vector of column `i`.
    pub fn half(&self, i: usize) -> DVec3 {
        let [sine, cosine] = self.polar;
        DVec3::new(sine * self.azimuths[0][i], sine * self.azimuths[1][i], cosine)
    }

    /// The first `count` columns, which are as many.
    pub(super) fn first(&self, count: usize) -> HalfRow<'_> {
        let azimuths = self.azimuths.map(|a| &a[..count]);
        HalfRow { azimuths, cosines: &self.cosines[..count], lights: &self.lights[..count], ..*self }
    }
}

/// Writes a row's values: `weights . mean_over_turns` for each of its half vectors.
pub type Rows<'a> = Box<dyn Fn(&HalfRow<'_>, &mut [f64]) + 'a>;

/// [`Rows`] of any reflectance, one after the other.
pub(super) fn one_by_one<'a>(reflectance: &'a (impl Reflectance + ?Sized), weights: DVec3) -> Rows<'a> {
    Box::new(move |row, out| {
        for (i, value) in out.iter_mut().enumerate() {
            let wi = 2.0 * row.cosines[i] * row.half(i) - row.wo;
            *value = weights.dot(reflectance.mean_over_turns(wi, row.wo));
        }
    })
}

/// `atan2(y, x)` for `y >= 0`, within 1e-9, without a branch.
pub(super) fn arc(y: f64, x: f64) -> f64 {
    let wide = x.abs();
    let steep = y > wide;
    let (least, most) = if steep { (wide, y) } else { (y, wide) };
    // tan(a - pi/4) from tan a brings the argument below tan(pi/8).
    let far = least > (std::f64::consts::SQRT_2 - 1.0) * most;
    let (above, below, base) = if far { (least - most, least + most, FRAC_PI_4) } else { (least, most, 0.0) };
    let t = above / if below > 0.0 { below } else { 1.0 };
    // The arc tangent's own series: the first term left out is below 1e-9.
    let square = t * t;
    let series = (0..10).rev().fold(0.0, |sum: f64, n: i32| 1.0 / f64::from(2 * n + 1) - square * sum);
    let angle = base + t * series;
    let angle = if steep { FRAC_PI_2 - angle } else { angle };
    if x < 0.0 { PI - angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_8;

    #[test]
    fn arcs_are_those_of_the_library() {
        for i in 0..=4000 {
            let (y, x) = (PI * f64::from(i) / 4000.0).sin_cos();
            for scale in [1e-9, 1.0, 3.0] {
                let error = arc(scale * y.abs(), scale * x) - y.abs().atan2(x);
                assert!(error.abs() < 1e-9, "{y} {x}: {error:e}");
            }
        }
        assert_eq!((arc(0.0, 0.0), arc(0.0, 1.0), arc(0.0, -1.0), arc(1.0, 0.0)), (0.0, 0.0, PI, FRAC_PI_2));
        assert!((arc(FRAC_PI_8.sin(), FRAC_PI_8.cos()) - FRAC_PI_8).abs() < 1e-9);
    }
}
