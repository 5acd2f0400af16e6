//! Order statistics of times, and how sure they are.

use crate::offline::stats::Quantiles;
use serde::Serialize;

/// Resamples of a bootstrap.
const RESAMPLES: usize = 2000;
/// Quantiles of the resampled statistic that bound a 95 % interval.
const INTERVAL: [f64; 2] = [0.025, 0.975];

/// Times of one thing over all rounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Median.
    pub median: f64,
    /// 10 % quantile.
    pub p10: f64,
    /// 90 % quantile.
    pub p90: f64,
    /// Median absolute deviation from the median, unscaled.
    pub mad: f64,
    /// 95 % interval of the median by bootstrap over rounds.
    pub interval: [f64; 2],
}

impl Summary {
    /// Of `values`; zero without values.
    pub fn of(values: &[f64]) -> Self {
        let Quantiles { median, p10, p90 } = Quantiles::of(values.to_vec());
        let mad = self::median(values.iter().map(|v| (v - median).abs()).collect());
        let interval = bootstrap(values.len(), |rounds| self::median(pick(values, rounds)));
        Self { median, p10, p90, mad, interval }
    }
}

/// How one median compares with another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// The quotient of the medians.
    pub ratio: f64,
    /// 95 % interval by bootstrap over rounds.
    pub interval: [f64; 2],
}

/// The median of `a` over that of `b`, which were measured in the same rounds: these are resampled together, so that what
/// slows a whole round down cancels. `None` without rounds or where `b` takes no time.
pub fn ratio_of_medians(a: &[f64], b: &[f64]) -> Option<Ratio> {
    let rounds = a.len().min(b.len());
    let (a, b) = (a.get(..rounds)?, b.get(..rounds)?);
    if rounds == 0 || b.iter().any(|v| *v <= 0.0) {
        return None;
    }
    let ratio = |rounds: &[usize]| median(pick(a, rounds)) / median(pick(b, rounds));
    Some(Ratio { ratio: median(a.to_vec()) / median(b.to_vec()), interval: bootstrap(rounds, ratio) })
}

/// The median of `values`; 0 without any.
pub(super) fn median(values: Vec<f64>) -> f64 {
    Quantiles::of(values).median
}

/// Those of `values` at `indices`.
pub(super) fn pick(values: &[f64], indices: &[usize]) -> Vec<f64> {
    indices.iter().filter_map(|i| values.get(*i).copied()).collect()
}

/// Percentile bootstrap (Efron 1979): the interval of `statistic` over `count` indices drawn with replacement, the same in
/// every run.
pub(super) fn bootstrap(count: usize, statistic: impl Fn(&[usize]) -> f64) -> [f64; 2] {
    if count == 0 {
        return [0.0; 2];
    }
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut indices = vec![0; count];
    let mut found: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            indices.fill_with(|| (split_mix(&mut state) % count as u64) as usize);
            statistic(&indices)
        })
        .collect();
    found.sort_by(f64::total_cmp);
    INTERVAL.map(|q| found.get((q * (RESAMPLES - 1) as f64).round() as usize).copied().unwrap_or_default())
}

/// SplitMix64 (Steele et al. 2014).
fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_numbers() {
        let s = Summary::of(&[3.0, 1.0, 100.0, 2.0, 4.0]);
        assert_eq!((s.median, s.mad), (3.0, 1.0));
        assert!((s.p10 - 1.4).abs() < 1e-12 && (s.p90 - 61.6).abs() < 1e-12, "{s:?}");
        // Five rounds: a resampled median is the smallest of them with probability 5.8 %, the second or less with 31.7 %.
        assert_eq!(s.interval, [1.0, 100.0]);
        let flat = Summary::of(&[7.0; 9]);
        assert_eq!(flat, Summary { median: 7.0, p10: 7.0, p90: 7.0, mad: 0.0, interval: [7.0; 2] });
        assert_eq!(Summary::of(&[]), Summary::default());
    }

    #[test]
    fn intervals_of_medians_cover_what_they_say() {
        // Medians of 25 numbers uniform in 0 to 1; the true one is 0.5.
        let mut state = 5;
        let mut uniform = || (split_mix(&mut state) >> 11) as f64 / (1_u64 << 53) as f64;
        let covered = (0..400).filter(|_| {
            let values: Vec<f64> = (0..25).map(|_| uniform()).collect();
            let [low, high] = Summary::of(&values).interval;
            (low..=high).contains(&0.5)
        });
        let covered = covered.count();
        assert!((360..=396).contains(&covered), "{covered} of 400");
    }

    #[test]
    fn rounds_are_resampled_together() {
        // A machine that slows down by ten from round to round says nothing of the ratio.
        let b: Vec<f64> = (0..8).map(|i| 10_f64.powi(i)).collect();
        let a: Vec<f64> = b.iter().map(|v| 2.0 * v).collect();
        let r = ratio_of_medians(&a, &b).unwrap();
        assert!((r.ratio - 2.0).abs() < 1e-12 && r.interval.iter().all(|v| (v - 2.0).abs() < 1e-12), "{r:?}");
        let noisy = ratio_of_medians(&[1.0, 2.0, 3.0, 2.0, 2.5], &[1.0; 5]).unwrap();
        assert_eq!(noisy.ratio, 2.0);
        assert!(noisy.interval[0] < 2.0 && noisy.interval[1] > 2.0, "{noisy:?}");
        assert_eq!(ratio_of_medians(&[], &[1.0]), None);
        assert_eq!(ratio_of_medians(&[1.0], &[0.0]), None);
    }
}
