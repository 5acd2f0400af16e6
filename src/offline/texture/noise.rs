//! Repeating noise for textures by formula.

/// Octaves of smooth noise on repeating grids of random values, minus one half each.
pub(super) struct Noise {
    /// Cells of the first octave; each other has twice as many.
    pub base: i64,
    pub octaves: i64,
    /// Weight of each octave as a share of the one before.
    pub gain: f64,
    pub seed: i64,
}

impl Noise {
    /// The sum at `(u, v)`, which repeats with period 1.
    pub fn at(&self, u: f64, v: f64) -> f64 {
        let (mut sum, mut weight, mut period) = (0.0, 1.0, self.base);
        for octave in 0..self.octaves {
            sum += weight * (value(u * period as f64, v * period as f64, period, self.seed + octave) - 0.5);
            (period, weight) = (period * 2, weight * self.gain);
        }
        sum
    }
}

fn value(x: f64, y: f64, period: i64, seed: i64) -> f64 {
    let smooth = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (fx, fy) = (smooth(x - x.floor()), smooth(y - y.floor()));
    let corner = |i: i64, j: i64| hash((x.floor() as i64 + i) % period, (y.floor() as i64 + j) % period, seed);
    let row = |j| corner(0, j) + (corner(1, j) - corner(0, j)) * fx;
    row(0) + (row(1) - row(0)) * fy
}

/// A number in [0, 1) for each cell, in steps of 2^-24.
pub(super) fn hash(x: i64, y: i64, seed: i64) -> f64 {
    let all = (x as u32).wrapping_mul(374_761_393).wrapping_add((y as u32).wrapping_mul(668_265_263));
    let mut h = all.wrapping_add((seed as u32).wrapping_mul(2_246_822_519));
    h = (h ^ h >> 13).wrapping_mul(1_274_126_177);
    h ^= h >> 16;
    h = h.wrapping_mul(2_246_822_519);
    h ^= h >> 13;
    f64::from(h >> 8) / 16_777_216.0
}
