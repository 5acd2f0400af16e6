//! Local frequency by orthonormal Daubechies wavelets of four taps on a torus (Bagher et al. 2011, appendix A). Twin of
//! `glsl/environment_bandwidth/`.
//!
//! The criterion is the appendix's: the finest level at which the details, summed from the finest on, reach `eps` times the
//! largest. Three choices fill what it leaves open:
//! - Details count by their *amplitude* (orthonormal coefficients over 2^level, as the appendix's own basis has it), not by their
//!   energy, or a bright spot hides all that is within reach of the coarsest wavelet. Five photographed environments, taken as
//!   images, shaded at the levels that follow and interpolated, come out 2 to 13 dB nearer with four tenths of their samples.
//! - They are the *local* ones, whose support covers a place.
//! - The level is read *between* whole levels from the slope of the sums, and finer than the finest too. One frequency then has
//!   one bias (0.9 to 1.3 of it for K = 64, 128, 200 in every direction; whole levels spread over 4), and dividing by it does not
//!   cut off what lies above 1/bias of the sampling rate.

/// Taps of the orthonormal low-pass filter (Daubechies 1988, table 1, N = 2).
pub const LOW: [f64; 4] = [0.482_962_913_144_534_1, 0.836_516_303_737_807_9, 0.224_143_868_042_013_4, -0.129_409_522_551_260_4];
/// Taps of the high-pass filter.
pub const HIGH: [f64; 4] = [LOW[3], -LOW[2], LOW[1], -LOW[0]];

/// Details grow at most fourfold from one level to the next below a signal's frequency: the high-pass filter has two vanishing
/// moments.
const SLOPE: f64 = 4.0;

/// What the estimate of a pure cosine reads times too high at threshold `eps`: fitted within 5 % to measurements on cosine
/// environments ([`calibration`](super::calibration); `passband environment --calibrate` prints them). Leakage of four taps falls
/// with the square of frequency, so that the threshold is met at a frequency that grows with its inverse root.
///
/// | eps | 0.001 | 0.002 | 0.005 | 0.01 | 0.02 | 0.05 | 0.1 |
/// |--|--|--|--|--|--|--|--|
/// | measured | 66.7 | 47.2 | 29.8 | 21.1 | 15.0 | 9.6 | 7.0 |
/// | this | 63.6 | 45.4 | 29.0 | 20.7 | 14.8 | 9.5 | 6.8 |
pub fn bias(eps: f64) -> f64 {
    2.2 * eps.powf(-0.487)
}

/// Row-major numbers on a torus.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Columns.
    pub width: usize,
    /// Row-major.
    pub values: Vec<f64>,
}

impl Grid {
    /// `f(column, row)` everywhere.
    pub fn from_fn(width: usize, height: usize, f: impl Fn(usize, usize) -> f64) -> Self {
        Self { width, values: (0..width * height).map(|i| f(i % width, i / width)).collect() }
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.values.len() / self.width.max(1)
    }

    fn transposed(&self) -> Self {
        Self::from_fn(self.height(), self.width, |x, y| self.values[x * self.width + y])
    }

    /// The value at a place, wrapping both ways.
    pub fn wrapped(&self, x: i64, y: i64) -> f64 {
        let (x, y) = (x.rem_euclid((self.width as i64).max(1)), y.rem_euclid((self.height() as i64).max(1)));
        self.values.get(y as usize * self.width + x as usize).copied().unwrap_or_default()
    }
}

/// One level of the periodic transform of a signal of even length: averages and details, orthonormal, coefficient j of each over
/// samples 2j to 2j + 3.
pub fn forward(signal: &[f64]) -> [Vec<f64>; 2] {
    let n = signal.len();
    [LOW, HIGH].map(|taps| {
        let at = |j: usize| (0..4).map(|k| taps[k] * signal[(2 * j + k) % n]).sum();
        (0..n / 2).map(at).collect()
    })
}

/// Every row's [`forward`].
fn rows(grid: &Grid) -> [Grid; 2] {
    let mut out = [(); 2].map(|()| Grid { width: grid.width / 2, values: Vec::with_capacity(grid.values.len() / 2) });
    for row in grid.values.chunks_exact(grid.width) {
        for (grid, half) in out.iter_mut().zip(forward(row)) {
            grid.values.extend(half);
        }
    }
    out
}

/// One level of the transform of a torus of even sides.
struct Level {
    /// Low in both directions.
    low: Grid,
    /// Details across columns.
    x: Grid,
    /// Details across rows.
    y: Grid,
    /// Details across both.
    xy: Grid,
}

impl Level {
    /// The transform of `grid`.
    fn of(grid: &Grid) -> Self {
        let split = |g: &Grid| rows(&g.transposed()).map(|half| half.transposed());
        let [low, high] = rows(grid);
        let ([low, y], [x, xy]) = (split(&low), split(&high));
        Self { low, x, y, xy }
    }
}

/// Local frequencies of an image: for each 2x2 block of its samples, how fast it varies across columns and across rows.
pub struct LocalFrequency {
    /// Cycles per sample, across columns and across rows; each grid has half the image's sides.
    pub axes: [Grid; 2],
}

impl LocalFrequency {
    /// Analyses `image` (a torus whose sides are powers of two, at least 2) over all its levels at threshold `eps`.
    /// Variation of an amplitude below `eps * floor` does not count.
    ///
    /// A coefficient of level h covers 3 2^h - 2 samples from 2^h j on: the blocks of 2^h samples numbered j and j + 1, and, from
    /// the second level on, j + 2. (In that last block the last two samples lie outside; they count as covered.)
    pub(crate) fn of(image: &Grid, eps: f64, floor: f64) -> Self {
        let mut low = image.clone();
        let mut covering = Vec::new();
        while low.width.min(low.height()) > 1 {
            let level = Level::of(&low);
            let blocks = if covering.is_empty() { 2 } else { 3 };
            // Two orthonormal low-pass filters double amplitudes.
            let scale = 0.5f64.powi(covering.len() as i32 + 1);
            let both = |a: &Grid| {
                let values = a.values.iter().zip(&level.xy.values).map(|(a, d)| scale * a.abs().max(d.abs()));
                spread(&Grid { width: a.width, values: values.collect() }, blocks)
            };
            covering.push([both(&level.x), both(&level.y)]);
            low = level.low;
        }
        let (width, height) = ((image.width / 2).max(1), (image.height() / 2).max(1));
        let mut axes = [(); 2].map(|()| Grid { width, values: Vec::with_capacity(width * height) });
        let mut details = [vec![0.0; covering.len()], vec![0.0; covering.len()]];
        for (x, y) in (0..width * height).map(|i| (i % width, i / width)) {
            let mut largest = floor;
            for (h, grids) in covering.iter().enumerate() {
                for (axis, grid) in grids.iter().enumerate() {
                    let detail = grid.values[(y >> h) * grid.width + (x >> h)];
                    details[axis][h] = detail;
                    largest = largest.max(detail);
                }
            }
            for (grid, details) in axes.iter_mut().zip(&details) {
                grid.values.push(crossing(details, eps * largest) / bias(eps));
            }
        }
        Self { axes }
    }
}

/// The largest of the coefficients that cover each block: its own and those of the `blocks - 1` blocks before it, both ways.
fn spread(details: &Grid, blocks: usize) -> Grid {
    let across = |g: &Grid| {
        let mut values = Vec::with_capacity(g.values.len());
        for row in g.values.chunks_exact(g.width) {
            let before = |x: usize, k: usize| row[(x + g.width * blocks - k) % g.width];
            values.extend((0..g.width).map(|x| (0..blocks).map(|k| before(x, k)).fold(0.0, f64::max)));
        }
        Grid { width: g.width, values }
    };
    across(&across(details).transposed()).transposed()
}

/// The frequency in cycles per sample, before its bias is taken out, at which `details` (amplitudes from the finest level on)
/// sum up to `threshold`: 2^-h at level h = 1, 2, …, geometric in between; 0 if they never do.
pub fn crossing(details: &[f64], threshold: f64) -> f64 {
    let (mut sum, mut before) = (0.0, 0.0);
    for (h, detail) in (1..).zip(details) {
        sum += detail;
        if sum >= threshold && sum > 0.0 {
            let slope = (sum / f64::max(before, sum / SLOPE)).log2();
            let back = (sum / threshold).log2() / slope;
            let level = f64::from(h) - if h > 1 { back.min(1.0) } else { back };
            return (-level).exp2();
        }
        before = sum;
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sobol;

    fn noise(n: usize) -> Vec<f64> {
        (0..n as u32).map(|i| sobol::to_unit(sobol::random(i, 1)[0]) - 0.5).collect()
    }

    #[test]
    fn the_transform_keeps_energy_and_inverts() {
        for n in [2, 4, 6, 64] {
            let signal = noise(n);
            let [low, high] = forward(&signal);
            let energy = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
            assert!((energy(&signal) - energy(&low) - energy(&high)).abs() < 1e-12);
            // Orthonormal: the inverse is the transpose.
            let mut back = vec![0.0; n];
            for j in 0..n / 2 {
                for k in 0..4 {
                    back[(2 * j + k) % n] += LOW[k] * low[j] + HIGH[k] * high[j];
                }
            }
            assert!(signal.iter().zip(&back).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        let grid = Grid { width: 16, values: noise(16 * 8) };
        let level = Level::of(&grid);
        let energy = |g: &Grid| g.values.iter().map(|x| x * x).sum::<f64>();
        assert!((energy(&grid) - [&level.low, &level.x, &level.y, &level.xy].map(energy).iter().sum::<f64>()).abs() < 1e-12);
    }

    #[test]
    fn straight_lines_have_no_details() {
        let signal: Vec<f64> = (0..32).map(|i| 3.0 + 0.5 * f64::from(i)).collect();
        let [_, high] = forward(&signal);
        assert!(high[..15].iter().all(|d| d.abs() < 1e-12), "two vanishing moments: {high:?}");
        assert!(high[15].abs() > 1.0, "except across the seam");
    }

    #[test]
    fn details_tell_rows_from_columns() {
        let wave = |x: f64| (std::f64::consts::TAU * x / 8.0).sin();
        let across = LocalFrequency::of(&Grid::from_fn(64, 32, |x, _| wave(x as f64)), 0.01, 1e-3);
        let down = LocalFrequency::of(&Grid::from_fn(64, 32, |_, y| wave(y as f64)), 0.01, 1e-3);
        for (result, axis) in [(across, 0), (down, 1)] {
            assert!(result.axes[1 - axis].values.iter().all(|&f| f == 0.0));
            assert!(result.axes[axis].values.iter().all(|f| (0.06..0.25).contains(f)), "1/8 of a cycle a sample");
        }
    }

    #[test]
    fn the_crossing_is_continuous_and_falls_with_the_threshold() {
        let details = [0.001, 0.02, 0.05, 0.9, 0.3];
        let mut last = f64::INFINITY;
        for i in 0..4000 {
            let threshold = 1e-4 * 10f64.powf(f64::from(i) / 1000.0);
            let f = crossing(&details, threshold);
            assert!(f <= last && (i == 0 || f > 0.99 * last || f == 0.0), "{threshold}: {f} after {last}");
            last = f;
        }
        assert_eq!(crossing(&details, 0.001), 0.5);
        assert!((crossing(&details, 0.021) - 0.25).abs() < 1e-12);
        assert_eq!((crossing(&details, 2.0), crossing(&[0.0, 0.0], 0.0), crossing(&[], 1.0)), (0.0, 0.0, 0.0));
    }
}
