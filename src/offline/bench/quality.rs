//! How far rendered frames are from a converged image, and how far that is from the truth.

use crate::offline::error::Result;
use crate::offline::metrics::{Exposure, Metrics, Pair, Picture, compare};
use crate::offline::session::Session;
use serde::Serialize;

/// One rendered image.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Linear radiance.
    pub picture: Picture,
    /// Coverage, one a pixel.
    pub coverage: Vec<f32>,
}

impl Frame {
    /// The last frame of `session`.
    ///
    /// # Errors
    /// The device's, on read-back.
    pub fn read(session: &mut Session) -> Result<Self> {
        let (bytes, _, extent) = session.image("resolved")?;
        Ok(Self::of(extent, &bytemuck::pod_collect_to_vec(&bytes)))
    }

    /// Of row-major `R G B A`.
    pub fn of([width, height]: [u32; 2], rgba: &[f32]) -> Self {
        let (texels, _) = rgba.as_chunks::<4>();
        let picture = Picture { width, height, rgb: texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect() };
        Self { picture, coverage: texels.iter().map(|t| t[3]).collect() }
    }
}

impl Frame {
    /// The means over `side` x `side` pixels.
    #[must_use]
    pub fn averaged(self, side: u32) -> Self {
        if side <= 1 {
            return self;
        }
        let [width, height] = [self.picture.width, self.picture.height].map(|e| (e / side) as usize);
        let side = side as usize;
        let share = 1.0 / (side * side) as f64;
        let mean = |i: usize, of: &dyn Fn(usize) -> f64| {
            let (x, y) = (i % width * side, i / width * side);
            let inside = (0..side * side).map(|k| (y + k / side) * width * side + x + k % side);
            (inside.map(of).sum::<f64>() * share) as f32
        };
        let rgb = |i| [0, 1, 2].map(|c| mean(i, &|k| f64::from(self.picture.rgb[k][c])));
        Self {
            picture: Picture { width: width as u32, height: height as u32, rgb: (0..width * height).map(rgb).collect() },
            coverage: (0..width * height).map(|i| mean(i, &|k| f64::from(self.coverage[k]))).collect(),
        }
    }
}

/// What of a converged image is noise, as the error that it would have against the truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// As [`Metrics::rmse`].
    pub rmse: f64,
    /// As [`Metrics::rel_l2`].
    pub rel_l2: f64,
    /// As [`Metrics::relmse`].
    pub relmse: f64,
    /// As [`Metrics::psnr`].
    pub psnr: f64,
}

impl Noise {
    /// Over some images; `None` of none.
    pub fn mean(all: &[Self]) -> Option<Self> {
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        (!all.is_empty()).then(|| Self {
            rmse: mean(|n| n.rmse),
            rel_l2: mean(|n| n.rel_l2),
            relmse: mean(|n| n.relmse),
            psnr: mean(|n| n.psnr),
        })
    }
}

/// The error of `frames`, pooled, against `reference` over the pixels of `mask`.
///
/// # Errors
/// Without frames or masked pixels, and for values that are not finite.
pub fn error(frames: &[Frame], reference: &Picture, mask: &[bool]) -> Result<Metrics> {
    let pairs: Vec<Pair> = frames.iter().map(|f| Pair { a: &f.picture, b: reference, mask }).collect();
    Ok(compare(&pairs, Exposure::Auto, false)?.metrics)
}

/// The noise of the mean of two independent halves: their difference has four times its variance.
///
/// # Errors
/// As [`error`].
pub fn noise(halves: [&Picture; 2], mask: &[bool]) -> Result<Noise> {
    let [a, b] = halves;
    let Metrics { rmse, rel_l2, relmse, psnr, .. } = compare(&[Pair { a, b, mask }], Exposure::Auto, false)?.metrics;
    Ok(Noise { rmse: rmse / 2.0, rel_l2: rel_l2 / 2.0, relmse: relmse / 4.0, psnr: psnr + 20.0 * 2_f64.log10() })
}

/// The root mean squared distance of single frames from their own expectation, from pairs of them: what [`Metrics::rmse`] of
/// an unbiased estimator must be against any good reference. `None` below two frames.
pub fn spread(frames: &[Frame]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_u64);
    for [a, b] in frames.as_chunks::<2>().0 {
        for ((a, b), covered) in a.picture.rgb.iter().zip(&b.picture.rgb).zip(&a.coverage) {
            if *covered > 0.0 {
                sum += a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum::<f64>();
                count += 3;
            }
        }
    }
    (count > 0).then(|| (sum / count as f64 / 2.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grey frame of 64x64 pixels with an alternating error.
    fn frame(error: f32) -> Frame {
        let rgba: Vec<f32> =
            (0..4096).flat_map(|i| [0.5 + if i % 2 == 0 { error } else { -error }; 3].into_iter().chain([1.0])).collect();
        Frame::of([64, 64], &rgba)
    }

    #[test]
    fn errors_are_pooled_and_noise_is_that_of_the_mean() {
        let truth = frame(0.0);
        let mask = vec![true; 4096];
        let pooled = error(&[frame(0.03), frame(-0.01)], &truth.picture, &mask).unwrap();
        assert!((pooled.rmse - (0.0005_f64).sqrt()).abs() < 1e-6, "{pooled:?}");
        // Halves that are off by 0.04 and -0.04 leave nothing in their mean; that is luck, and the estimate does not know it.
        let (a, b) = (frame(0.04), frame(-0.04));
        let found = noise([&a.picture, &b.picture], &mask).unwrap();
        assert!((found.rmse - 0.04).abs() < 1e-6, "{found:?}");
        let halved = error(&[frame(0.04)], &truth.picture, &mask).unwrap();
        assert!((found.relmse / halved.relmse - 1.0).abs() < 0.05, "{found:?} {halved:?}");
        assert!(error(&[], &truth.picture, &mask).is_err());
    }

    #[test]
    fn finer_frames_are_averaged() {
        let fine = frame(0.25);
        let expected = frame(0.0).picture.rgb[0];
        let coarse = fine.averaged(4);
        assert_eq!((coarse.picture.width, coarse.picture.height, coarse.coverage.len()), (16, 16, 256));
        assert!(coarse.picture.rgb.iter().all(|c| *c == expected) && coarse.coverage.iter().all(|c| *c == 1.0));
    }

    #[test]
    fn spread_is_the_distance_from_the_expectation() {
        assert_eq!(spread(&[frame(0.1)]), None);
        // Two frames 0.2 apart are each 0.1 from their mean, and sqrt(2) times that from their expectation, on average.
        let found = spread(&[frame(0.1), frame(-0.1)]).unwrap();
        assert!((found - 0.1 * 2_f64.sqrt()).abs() < 1e-6, "{found}");
    }
}
