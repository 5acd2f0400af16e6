//! Gains at equal error and at equal time: the other side of the comparison is full rate at whatever number of directions
//! brings it there.

use crate::offline::bench::statistics::{bootstrap, median, pick};
use serde::Serialize;

/// Full rate at one number of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// Directions a pixel.
    pub directions: u32,
    /// Error, any measure that falls as a power of the directions.
    pub error: f64,
    /// Milliseconds of the frame of each round.
    pub times: Vec<f64>,
}

/// Whether a number is what was found, or bounds what lies beyond the ladder's ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Is {
    /// Between two rungs.
    Found,
    /// Full rate is slower, or worse, than the ladder shows.
    AtLeast,
    /// Full rate is faster, or better, than the ladder shows.
    AtMost,
}

/// How a variant compares with full rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Equal {
    /// Directions that full rate needs for the variant's error.
    pub directions: f64,
    /// Full rate's frame time at the variant's error, over the variant's: above 1 the variant gains.
    pub speed_up: f64,
    /// What `directions` and `speed_up` are.
    pub speed_up_is: Is,
    /// 95 % interval of `speed_up` by bootstrap over the rounds, in which all that it is made of was measured together. The
    /// errors' own uncertainty is not in it.
    pub interval: [f64; 2],
    /// The variant's error over full rate's at the variant's frame time: below 1 the variant gains.
    pub error_ratio: f64,
    /// What `error_ratio` is.
    pub error_ratio_is: Is,
    /// Directions that full rate takes in the variant's frame time; of the nearest rung beyond the ladder's ends.
    pub directions_in_time: f64,
}

/// Compares a variant of `error` with full rate on `ladder`, at median times, interpolated between its rungs in logarithms.
/// `None` unless the ladder has two rungs and all numbers are above 0 and finite.
pub fn equal(ladder: &[Rung], error: f64, times: &[f64]) -> Option<Equal> {
    let at = |ms: &dyn Fn(&[f64]) -> f64| {
        let of_error = ladder.iter().map(|r| (r.error, ms(&r.times))).collect();
        let (time, side) = log_log(of_error, error)?;
        Some((time / ms(times), side))
    };
    let (speed_up, side) = at(&|times| median(times.to_vec()))?;
    let (directions, _) = log_log(ladder.iter().map(|r| (r.error, r.directions.into())).collect(), error)?;
    let of_time = ladder.iter().map(|r| (median(r.times.clone()), r.error)).collect();
    let of_rate = ladder.iter().map(|r| (median(r.times.clone()), r.directions.into())).collect();
    let (directions_in_time, _) = log_log(of_rate, median(times.to_vec()))?;
    let (reached, end) = log_log(of_time, median(times.to_vec()))?;
    let resampled = |rounds: &[usize]| at(&|times| median(pick(times, rounds))).map_or(speed_up, |found| found.0);
    Some(Equal {
        directions,
        speed_up,
        // Less error than the best rung: full rate would take longer than that.
        speed_up_is: [Is::AtLeast, Is::Found, Is::AtMost][side],
        interval: bootstrap(times.len(), resampled),
        error_ratio: error / reached,
        // A longer time than the longest: full rate would be better than that.
        error_ratio_is: [Is::AtMost, Is::Found, Is::AtLeast][end],
        directions_in_time,
    })
}

/// The value at `x` of the curve through `points`, straight in logarithms; past the ends the end's. The second number says where:
/// 0 below, 1 between, 2 above.
fn log_log(mut points: Vec<(f64, f64)>, x: f64) -> Option<(f64, usize)> {
    let usable = |v: f64| v > 0.0 && v.is_finite();
    if points.len() < 2 || !usable(x) || !points.iter().all(|(x, y)| usable(*x) && usable(*y)) {
        return None;
    }
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (*points.first()?, *points.last()?);
    // The rungs themselves may be asked for, through a rounding of their own.
    let near = 1.0 + 1e-9;
    if x * near < first.0 {
        return Some((first.1, 0));
    }
    if x > last.0 * near {
        return Some((last.1, 2));
    }
    let x = x.clamp(first.0, last.0);
    let (a, b) = points.iter().zip(points.iter().skip(1)).find(|(_, b)| x <= b.0)?;
    let width = (b.0 / a.0).ln();
    let t = if width > 0.0 { (x / a.0).ln() / width } else { 0.0 };
    Some((a.1 * (b.1 / a.1).powf(t), 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error 1 / sqrt(N), time N milliseconds.
    fn ladder() -> Vec<Rung> {
        [64, 16, 1024, 256].map(|n| Rung { directions: n, error: 1.0 / f64::from(n).sqrt(), times: vec![n.into(); 3] }).to_vec()
    }

    #[test]
    fn power_laws_are_met_exactly() {
        // As good as 100 directions in the time of 25, and half as wrong as 25.
        let e = equal(&ladder(), 0.1, &[25.0; 3]).unwrap();
        assert!((e.directions - 100.0).abs() < 1e-9 && (e.speed_up - 4.0).abs() < 1e-9 && (e.error_ratio - 0.5).abs() < 1e-9);
        assert_eq!((e.speed_up_is, e.error_ratio_is), (Is::Found, Is::Found));
        assert!((e.directions_in_time - 25.0).abs() < 1e-9, "{e:?}");
        for rung in ladder() {
            let e = equal(&ladder(), rung.error, &rung.times).unwrap();
            assert!((e.speed_up - 1.0).abs() < 1e-9 && (e.error_ratio - 1.0).abs() < 1e-9, "{e:?}");
            assert_eq!((e.speed_up_is, e.error_ratio_is), (Is::Found, Is::Found));
        }
    }

    #[test]
    fn past_the_ends_gains_are_bounds() {
        let better = equal(&ladder(), 0.01, &[100.0; 3]).unwrap();
        assert_eq!((better.directions, better.speed_up, better.speed_up_is), (1024.0, 10.24, Is::AtLeast));
        let worse = equal(&ladder(), 0.5, &[8.0; 3]).unwrap();
        assert_eq!(
            (worse.speed_up, worse.speed_up_is, worse.error_ratio, worse.error_ratio_is),
            (2.0, Is::AtMost, 2.0, Is::AtMost)
        );
        let slow = equal(&ladder(), 0.1, &[4096.0; 3]).unwrap();
        assert!((slow.error_ratio - 3.2).abs() < 1e-9);
        assert_eq!(slow.error_ratio_is, Is::AtLeast);
    }

    #[test]
    fn what_has_no_logarithm_is_not_compared() {
        assert_eq!(equal(&ladder()[..1], 0.1, &[25.0]), None);
        assert_eq!(equal(&ladder(), 0.0, &[25.0]), None);
        assert_eq!(equal(&ladder(), 0.1, &[]), None);
    }

    #[test]
    fn what_slows_whole_rounds_down_is_in_no_interval() {
        let slower = [1.0, 1.5, 3.0, 1.1, 2.0];
        let rung = |r: &Rung| Rung { times: slower.map(|s| s * r.times[0]).to_vec(), ..r.clone() };
        let ladder: Vec<Rung> = ladder().iter().map(rung).collect();
        let together = equal(&ladder, 0.1, &slower.map(|s| 25.0 * s)).unwrap();
        assert!(together.interval.iter().all(|v| (v - 4.0).abs() < 1e-9), "{together:?}");
        let apart = equal(&ladder, 0.1, &[25.0, 50.0, 25.0, 40.0, 30.0]).unwrap();
        assert!(apart.interval[0] < apart.speed_up && apart.speed_up < apart.interval[1], "{apart:?}");
    }
}
