//! Spatial bandwidth of texture maps (Bagher et al. 2011, section 2.4).

use super::wavelet::{Grid, LocalFrequency};
use glam::DVec2;

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

/// Cells a side of the finest grid of [`TextureCells`].
pub const SIDE: usize = 64;
/// Numbers of [`TextureCells`]: grids of 64 cells a side, 32, … 1.
pub const CELLS: usize = (4 * SIDE * SIDE - 1) / 3;
/// Of the frequencies in a cell, this share is at most its own.
const QUANTILE: f64 = 0.95;

/// How fast the maps of a material vary, place by place and at several scales. Twin of `glsl/include/texture_bandwidth.glsl`.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureCells {
    values: Vec<f32>,
}

impl TextureCells {
    /// Of maps that repeat `tiling` times in a unit of the surface's coordinates.
    pub fn of(maps: &[TextureBandwidth], tiling: [f64; 2]) -> Self {
        let mut values = Vec::with_capacity(CELLS);
        let mut within = Vec::new();
        for side in (0..=SIDE.ilog2()).map(|level| SIDE >> level) {
            for [x, y] in (0..side * side).map(|i| [i % side, i / side]) {
                let mut largest: f64 = 0.0;
                for (axis, tiling) in maps.iter().flat_map(|map| map.axes.iter().zip(tiling)) {
                    // At least one value, of grids that are coarser.
                    let range = |i: usize, n: usize| i * n / side..((i + 1) * n / side).max(i * n / side + 1);
                    within.clear();
                    for row in range(y, axis.height()).map(|y| y * axis.width) {
                        within.extend(range(x, axis.width).filter_map(|x| axis.values.get(row + x)));
                    }
                    let at = (within.len() as f64 * QUANTILE) as usize;
                    if at < within.len() {
                        largest = largest.max(*within.select_nth_unstable_by(at, f64::total_cmp).1 * tiling);
                    }
                }
                values.push(largest as f32);
            }
        }
        Self { values }
    }

    /// [`CELLS`] numbers in cycles per unit of the surface's coordinates, finest grid first, row by row from the top.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Around the place `uv` of the maps (the surface's coordinates times tiling), of a footprint of `units` of their sides.
    pub fn at(&self, uv: DVec2, units: f64) -> f64 {
        let level = (units * SIDE as f64).log2().ceil().clamp(0.0, f64::from(SIDE.ilog2())) as u32;
        let side = SIDE >> level;
        let cell = |c: f64| ((c - c.floor()) * side as f64).min(side as f64 - 1.0) as usize;
        let first = (4 * SIDE * SIDE - ((4 * SIDE * SIDE) >> (2 * level))) / 3;
        self.values.get(first + cell(-uv.y) * side + cell(uv.x)).copied().unwrap_or_default().into()
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

    /// Flat in the left half, checks in the right one.
    fn half_checks() -> TextureBandwidth {
        let checks = |x: usize, y: usize| f64::from(u8::from(x >= 128 && (x / 4 + y / 4).is_multiple_of(2)));
        TextureBandwidth::of(&Grid::from_fn(256, 256, checks), 0.01)
    }

    #[test]
    fn cells_are_local_and_coarser_ones_hold_95_of_100() {
        let map = half_checks();
        let cells = TextureCells::of(std::slice::from_ref(&map), [3.0, 1.0]);
        assert_eq!(cells.values().len(), CELLS);
        let at = |u: f64, v: f64, units: f64| cells.at(DVec2::new(u, v), units);
        assert!(at(0.25, 0.4, 0.001) < 3.0, "the halves are one cycle");
        assert!(at(0.75, 0.4, 0.001) > 3.0 * 20.0, "checks of 8 texels a cycle are 32 cycles a map");
        for units in [0.001, 0.02, 0.1, 0.3] {
            assert!(at(0.75, 0.6, units) >= at(0.25, 0.6, units), "{units}");
            assert_eq!(at(0.75, 0.6, units), at(-4.25, 7.6, units), "it repeats");
        }
        // The whole map is one cell, of which half is flat.
        let mut all = map.axes[0].values.clone();
        all.sort_by(f64::total_cmp);
        let quantile = 3.0 * all[(all.len() as f64 * 0.95) as usize];
        for units in [0.6, 1.0, 100.0] {
            assert!((at(0.1, 0.1, units) - quantile).abs() < 1e-5 * quantile, "{units}: {} {quantile}", at(0.1, 0.1, units));
        }
        assert_eq!(at(0.1, 0.1, f64::INFINITY), at(0.1, 0.1, 1.0));
    }

    #[test]
    fn maps_smaller_than_the_cells_and_none_at_all_have_cells_too() {
        let small = TextureBandwidth::of(&Grid::from_fn(4, 2, |x, _| (x % 2) as f64), 0.01);
        let cells = TextureCells::of(&[small, half_checks()], [1.0, 1.0]);
        assert!(cells.values().iter().all(|c| c.is_finite() && *c > 0.0), "the stripes are everywhere");
        assert!(TextureCells::of(&[], [1.0, 1.0]).values().iter().all(|c| *c == 0.0));
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
