//! Spatial bandwidth of texture maps (Bagher et al. 2011, section 2.4).

use super::wavelet::{Grid, LocalFrequency};

/// Local bandwidth of a tiling image.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureBandwidth {
    /// Cycles per texture unit along u and v, one value a 2x2 block of samples. Times texture units per metre on the surface
    /// they are in 1/m.
    pub axes: [Grid; 2],
}

impl TextureBandwidth {
    /// Analyses an image of `width` columns (row-major, at least one value, which tiles the plane) at threshold `eps`. Images
    /// whose sides are no powers of two are interpolated to the next.
    pub fn of(image: &Grid, eps: f64) -> Self {
        let [width, height] = [image.width, image.height()].map(|n| n.clamp(2, 4096).next_power_of_two());
        let resampled = Grid::from_fn(width, height, |x, y| {
            let at = |i: usize, n: usize, of: usize| (i as f64 + 0.5) * of as f64 / n as f64 - 0.5;
            let (x, y) = (at(x, width, image.width), at(y, height, image.height()));
            let (fx, fy) = (x - x.floor(), y - y.floor());
            let (x, y) = (x.floor() as i64, y.floor() as i64);
            let row = |y| image.wrapped(x, y) * (1.0 - fx) + image.wrapped(x + 1, y) * fx;
            row(y) * (1.0 - fy) + row(y + 1) * fy
        });
        let mean = resampled.values.iter().sum::<f64>() / resampled.values.len() as f64;
        let [mut u, mut v] = LocalFrequency::of(&resampled, eps, super::environment::FLOOR * mean.abs()).axes;
        u.values.iter_mut().for_each(|f| *f *= width as f64);
        v.values.iter_mut().for_each(|f| *f *= height as f64);
        Self { axes: [u, v] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn stripes(size: usize, cycles: f64) -> f64 {
        let wave = Grid::from_fn(size, size, |x, _| 1.0 + (TAU * cycles * (x as f64 + 0.5) / size as f64).cos());
        let mut u = TextureBandwidth::of(&wave, 0.01).axes[0].values.clone();
        u.sort_by(f64::total_cmp);
        u[u.len() / 2] / cycles
    }

    #[test]
    fn stripes_read_true_and_do_not_depend_on_size() {
        for size in [256, 300, 512] {
            for cycles in [8.0, 16.0, 20.0, 32.0] {
                let ratio = stripes(size, cycles);
                assert!((0.6..1.6).contains(&ratio), "{size} {cycles}: {ratio}");
            }
        }
    }

    #[test]
    fn a_finer_checker_has_more_bandwidth_and_a_flat_map_none() {
        let checker = |cells: usize| {
            let image =
                Grid::from_fn(256, 256, |x, y| f64::from(u8::from((x * cells / 256 + y * cells / 256).is_multiple_of(2))));
            let axes = TextureBandwidth::of(&image, 0.01).axes;
            axes[0].values.iter().sum::<f64>() / axes[0].values.len() as f64
        };
        let means = [4, 8, 16].map(checker);
        assert!(means.windows(2).all(|w| w[1] > 1.2 * w[0]), "{means:?}");
        let flat = TextureBandwidth::of(&Grid::from_fn(30, 20, |_, _| 0.25), 0.01);
        assert!(flat.axes.iter().flat_map(|a| &a.values).all(|&f| f == 0.0));
    }
}
