//! The bandwidth that an image has, measured: a Fourier transform in windows (Bagher et al. 2011, figure 14 d).

use glam::DVec2;
use std::f64::consts::{PI, TAU};

/// Pixels a side of a window.
pub const WINDOW: usize = 32;
/// Cycles/pixel below which the window's own spectrum is what is measured.
pub const LEAST: f64 = 0.07;
/// Pixels between windows.
const STEP: usize = 4;

/// The radius in cycles/pixel that holds 95 % of the power of a window without its mean, under a Hann window; 0 if there is no
/// power. `values` are [`WINDOW`] rows of as many pixels; those without a value are taken for the mean, and `None` is returned
/// where they have more than half of the weight.
pub fn bandwidth(values: &[Option<f64>]) -> Option<f64> {
    let hann = |i: usize| 0.5 - 0.5 * (TAU * (i as f64 + 0.5) / WINDOW as f64).cos();
    let weight = |i: usize| hann(i % WINDOW) * hann(i / WINDOW);
    let known = || values.iter().enumerate().filter_map(|(i, v)| Some((weight(i), (*v)?)));
    let (sum, weights) = known().fold((0.0, 0.0), |(s, w), (weight, v)| (s + v * weight, w + weight));
    let all: f64 = (0..WINDOW * WINDOW).map(weight).sum();
    if weights < 0.5 * all {
        return None;
    }
    let off = |(i, v): (usize, &Option<f64>)| DVec2::new(v.map_or(0.0, |v| (v - sum / weights) * weight(i)), 0.0);
    let plain: Vec<DVec2> = values.iter().enumerate().map(off).collect();
    // Rows, then columns.
    let spectrum = transposed_transform(&transposed_transform(&plain));
    let frequency = |i: usize| if i > WINDOW / 2 { i as f64 - WINDOW as f64 } else { i as f64 } / WINDOW as f64;
    let mut power: Vec<_> = (spectrum.iter().enumerate())
        .map(|(i, c)| (frequency(i % WINDOW).hypot(frequency(i / WINDOW)), c.length_squared()))
        .collect();
    power.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = power.iter().map(|p| p.1).sum();
    let mut below = 0.0;
    let reached = power.iter().find(|(_, p)| {
        below += p;
        below >= 0.95 * total
    });
    Some(reached.filter(|_| total > 0.0).map_or(0.0, |(f, _)| *f))
}

/// Of each pixel of an image of `width` columns, row by row, the [`bandwidth`] of the window around it, every few pixels anew;
/// `None` for pixels without a value, and where the window leaves the image.
pub fn map(values: &[Option<f64>], width: usize) -> Vec<Option<f64>> {
    let height = values.len() / width.max(1);
    let around = |x: usize, y: usize| {
        let (left, top) = (x.checked_sub(WINDOW / 2)?, y.checked_sub(WINDOW / 2)?);
        if left + WINDOW > width || top + WINDOW > height {
            return None;
        }
        let pixel = |i: usize| values.get((top + i / WINDOW) * width + left + i % WINDOW).copied().flatten();
        bandwidth(&(0..WINDOW * WINDOW).map(pixel).collect::<Vec<_>>())
    };
    let columns = width.div_ceil(STEP);
    let middle = |i: usize| i * STEP + STEP / 2;
    let found: Vec<_> = (0..columns * height.div_ceil(STEP)).map(|i| around(middle(i % columns), middle(i / columns))).collect();
    let of = |(i, value): (usize, &Option<f64>)| {
        value.and_then(|_| found.get(i / width / STEP * columns + i % width / STEP).copied().flatten())
    };
    values.iter().enumerate().map(of).collect()
}

/// The Fourier transform of each row, laid out as columns.
fn transposed_transform(values: &[DVec2]) -> Vec<DVec2> {
    let turns: Vec<DVec2> = (0..WINDOW).map(|i| DVec2::from_angle(-2.0 * PI * i as f64 / WINDOW as f64)).collect();
    let term = |row: usize, f: usize, x: usize| turns[f * x % WINDOW].rotate(values[row * WINDOW + x]);
    (0..WINDOW * WINDOW).map(|i| (0..WINDOW).map(|x| term(i % WINDOW, i / WINDOW, x)).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_have_their_frequency() {
        let wave = |f: [f64; 2]| move |i: usize| (TAU * ((i % 96) as f64 * f[0] + (i / 96) as f64 * f[1])).sin() + 3.0;
        for f in [[0.25, 0.0], [0.0, 0.125], [0.2, 0.2]] {
            let image: Vec<_> = (0..96 * 64).map(|i| (i % 96 < 90).then(|| wave(f)(i))).collect();
            let found = map(&image, 96);
            let expected = f[0].hypot(f[1]);
            // A Hann window widens a line by 1.5 bins or so.
            let middle = found[32 * 96 + 40].unwrap();
            assert!((middle - expected).abs() < 2.0 / WINDOW as f64, "{middle} for {f:?}");
            // Near the border and without a value nothing is known.
            assert!([3 * 96 + 40, 32 * 96 + 92, 32 * 96 + 4].iter().all(|i| found[*i].is_none()));
            // A window with a part missing has nearly the same.
            let cut: Vec<_> = image.iter().enumerate().map(|(i, v)| v.filter(|_| i % 96 < 46)).collect();
            let cut = map(&cut, 96)[32 * 96 + 40].unwrap();
            assert!((cut - expected).abs() < 0.1, "{cut} for {f:?}");
        }
        assert_eq!(bandwidth(&[Some(1.0); WINDOW * WINDOW]), Some(0.0));
        let half: Vec<_> = (0..WINDOW * WINDOW).map(|i| (i < 400).then_some(i as f64)).collect();
        assert_eq!(bandwidth(&half), None);
    }
}
