//! Differences over time.

use crate::error::{Error, Result};
use crate::offline::metrics::display::Shown;
use crate::offline::metrics::{Pair, ratio};
use colorvideovdp::{Color, Cvvdp, DisplayModel, Image, Options};

/// Frames a second that a sequence is judged at.
const FRAME_RATE: f32 = 30.0;
/// The display that a sequence is judged on: 30 inches, 3840x2160, 200 cd/m2, 0.75 m away.
const DISPLAY: &str = "standard_4k";
/// Most bytes that the prediction may hold.
const MEMORY: usize = 8 << 30;

/// Mean `|e_k - e_(k-1)|`, with `e = A - B`, over pixels masked in either frame and their channels, divided by `mean`, the
/// mean of B; `None` for fewer than two frames.
pub fn flicker(pairs: &[Pair], mean: f64) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_u64);
    for (before, after) in pairs.iter().zip(pairs.get(1..)?) {
        let masked = before.mask.iter().zip(after.mask).map(|(x, y)| *x || *y);
        let rows = before.a.rgb.iter().zip(&before.b.rgb).zip(after.a.rgb.iter().zip(&after.b.rgb)).zip(masked);
        for (((a0, b0), (a1, b1)), _) in rows.filter(|(_, masked)| *masked) {
            let error = |a: &f32, b: &f32| f64::from(*a) - f64::from(*b);
            for ((a0, b0), (a1, b1)) in a0.iter().zip(b0).zip(a1.iter().zip(b1)) {
                sum += (error(a1, b1) - error(a0, b0)).abs();
                count += 1;
            }
        }
    }
    (pairs.len() > 1).then(|| ratio(sum / count.max(1) as f64, mean))
}

/// ColorVideoVDP of the display images; pixels outside the mask are taken from B, so that they do not differ. A single frame
/// is judged as a still image.
///
/// # Errors
/// [`Error::InvalidInput`] for images smaller than 4x4 or a sequence that does not fit the memory limit of 8 GiB.
pub fn jod(pairs: &[Pair], shown: &[Shown]) -> Result<f64> {
    let failed = |e: colorvideovdp::Error| Error::invalid("jod", "a sequence that ColorVideoVDP can judge", e);
    let (mut test, mut reference) = (Vec::new(), Vec::new());
    for (pair, shown) in pairs.iter().zip(shown) {
        let masked = shown.a.iter().zip(&shown.b).zip(pair.mask).flat_map(|((a, b), masked)| if *masked { *a } else { *b });
        let image = |data: Vec<f32>| Image::new(pair.b.width as usize, pair.b.height as usize, 3, data).map_err(failed);
        test.push(image(masked.collect())?);
        reference.push(image(shown.b.iter().flatten().copied().collect())?);
    }
    let display = DisplayModel::from_name(DISPLAY).map_err(failed)?;
    let metric = Cvvdp::new(display, Options::default().with_memory_limit_bytes(MEMORY)).map_err(failed)?;
    let prediction = metric.predict_video(&test, &reference, FRAME_RATE, Color::Srgb).map_err(failed)?;
    Ok(prediction.jod.into())
}
