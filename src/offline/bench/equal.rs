//! Gains at equal error and at equal time: the other side of the comparison is full rate at whatever number of directions
//! brings it there.

use serde::Serialize;

/// Full rate at one number of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// Directions a pixel.
    pub directions: u32,
    /// Error, any measure that falls as a power of the directions.
    pub error: f64,
    /// Milliseconds a frame.
    pub ms: f64,
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
    /// The variant's error over full rate's at the variant's frame time: below 1 the variant gains.
    pub error_ratio: f64,
    /// What `error_ratio` is.
    pub error_ratio_is: Is,
}

/// Compares a variant of `error` and `ms` with full rate on `ladder`, interpolated between its rungs in logarithms. `None`
/// unless the ladder has two rungs and all numbers are above 0 and finite.
pub fn equal(ladder: &[Rung], error: f64, ms: f64) -> Option<Equal> {
    let of = |from: fn(&Rung) -> f64, to: fn(&Rung) -> f64| ladder.iter().map(|r| (from(r), to(r))).collect::<Vec<_>>();
    let (needed, side) = log_log(of(|r| r.error, |r| r.directions.into()), error)?;
    let (time, _) = log_log(of(|r| r.error, |r| r.ms), error)?;
    let (reached, end) = log_log(of(|r| r.ms, |r| r.error), ms)?;
    // Less error than the best rung: full rate would take longer than that. A longer time than the longest: it would be better.
    let speed_up_is = [Is::AtLeast, Is::Found, Is::AtMost][side];
    let error_ratio_is = [Is::AtMost, Is::Found, Is::AtLeast][end];
    Some(Equal { directions: needed, speed_up: time / ms, speed_up_is, error_ratio: error / reached, error_ratio_is })
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
        [64, 16, 1024, 256].map(|n| Rung { directions: n, error: 1.0 / f64::from(n).sqrt(), ms: n.into() }).to_vec()
    }

    #[test]
    fn power_laws_are_met_exactly() {
        // As good as 100 directions in the time of 25, and half as wrong as 25.
        let e = equal(&ladder(), 0.1, 25.0).unwrap();
        assert!((e.directions - 100.0).abs() < 1e-9 && (e.speed_up - 4.0).abs() < 1e-9 && (e.error_ratio - 0.5).abs() < 1e-9);
        assert_eq!((e.speed_up_is, e.error_ratio_is), (Is::Found, Is::Found));
        for rung in ladder() {
            let e = equal(&ladder(), rung.error, rung.ms).unwrap();
            assert!((e.speed_up - 1.0).abs() < 1e-9 && (e.error_ratio - 1.0).abs() < 1e-9, "{e:?}");
            assert_eq!((e.speed_up_is, e.error_ratio_is), (Is::Found, Is::Found));
        }
    }

    #[test]
    fn past_the_ends_gains_are_bounds() {
        let better = equal(&ladder(), 0.01, 100.0).unwrap();
        assert_eq!((better.directions, better.speed_up, better.speed_up_is), (1024.0, 10.24, Is::AtLeast));
        let worse = equal(&ladder(), 0.5, 8.0).unwrap();
        assert_eq!(
            (worse.speed_up, worse.speed_up_is, worse.error_ratio, worse.error_ratio_is),
            (2.0, Is::AtMost, 2.0, Is::AtMost)
        );
        let slow = equal(&ladder(), 0.1, 4096.0).unwrap();
        assert!((slow.error_ratio - 3.2).abs() < 1e-9);
        assert_eq!(slow.error_ratio_is, Is::AtLeast);
    }

    #[test]
    fn what_has_no_logarithm_is_not_compared() {
        assert_eq!(equal(&ladder()[..1], 0.1, 25.0), None);
        assert_eq!(equal(&ladder(), 0.0, 25.0), None);
        assert_eq!(equal(&ladder(), 0.1, f64::NAN), None);
    }
}
