//! Chi-square tests and running means.
#![allow(dead_code, reason = "each test file uses its part")]

/// The probability of a chi-square at least this large if `observed` counts come from `expected` ones (same total).
/// Bins that expect fewer than ten are pooled. Wilson and Hilferty's cube-root approximation; far tails need no more.
pub fn chi_square_p(observed: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len());
    let (mut chi, mut bins, mut pool) = (0.0, 0, (0.0, 0.0));
    let mut add = |o: f64, e: f64| {
        chi += (o - e).powi(2) / e;
        bins += 1;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if e >= 10.0 {
            add(o as f64, e);
        } else {
            pool = (pool.0 + o as f64, pool.1 + e);
        }
    }
    if pool.1 >= 1.0 {
        add(pool.0, pool.1);
    } else {
        assert!(pool.0 < 20.0, "{} samples where {} are expected", pool.0, pool.1);
    }
    let k = f64::from(bins - 1);
    let z = ((chi / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt();
    normal_tail(z)
}

/// The probability that a standard normal number is above `z` (Abramowitz and Stegun 26.2.17, error below 1e-7).
fn normal_tail(z: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * z.abs());
    let poly = t * (0.319_381_530 + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let tail = poly * (-z * z / 2.0).exp() / std::f64::consts::TAU.sqrt();
    if z >= 0.0 { tail } else { 1.0 - tail }
}

/// Sums for a mean and its standard error.
#[derive(Default)]
pub struct Mean {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    pub fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }
    pub fn mean(&self) -> f64 {
        self.sum / self.n
    }
    pub fn deviation(&self) -> f64 {
        (self.squares / self.n - self.mean().powi(2)).max(0.0).sqrt()
    }
    pub fn error(&self) -> f64 {
        self.deviation() / self.n.sqrt()
    }
}

#[test]
fn chi_square_p_is_uniform_for_right_and_zero_for_wrong_counts() {
    assert!((normal_tail(1.959_964) - 0.025).abs() < 1e-6);
    let expected = [1000.0; 20];
    assert!(chi_square_p(&[1000; 20], &expected) > 0.999);
    // 30.14 is the upper 5 % point of chi-square with 19 degrees of freedom.
    let off = (30.14f64 * 1000.0 / 20.0).sqrt();
    let observed: Vec<u64> = (0..20).map(|i| (1000.0 + if i % 2 == 0 { off } else { -off }).round() as u64).collect();
    assert!((chi_square_p(&observed, &expected) - 0.05).abs() < 0.01);
    assert!(chi_square_p(&[1100, 900, 1100, 900], &[1000.0; 4]) < 1e-6);
}
