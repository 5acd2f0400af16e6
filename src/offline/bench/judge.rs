//! Errors of variants against a converged image, and what they say of speed.

use crate::offline::bench::equal::{Rung, equal};
use crate::offline::bench::quality::{self, Frame};
use crate::offline::bench::reference::{self, Converged, Goal};
use crate::offline::bench::report::{Against, ReferenceReport, Row};
use crate::offline::bench::truths::Truths;
use crate::offline::error::{Error, Result};
use crate::offline::render::Settings;
use crate::offline::supersample;
use crate::offline::world::World;
use std::path::Path;

/// The smallest error is to be ten times the noise of a reference; it is only estimated before, from two frames.
const MARGIN: f64 = 12.0;
/// Directions a pixel after which a reference is not refined further.
const MOST_DIRECTIONS: u64 = 1 << 16;
/// An [agreement](ReferenceReport::agreement) above this is no chance: what the cache held is of another renderer.
const MOST_DISAGREEMENT: f64 = 1.4;
/// Sub-samples a pixel after which a truth is not refined further.
const MOST_SUB_SAMPLES: u64 = 4 * supersample::DEFAULT_SAMPLES as u64;
/// Estimators whose full rate is a ladder.
const LADDERS: [&str; 2] = ["mis", "brdf-random"];

/// Errors of all variants against a reference that is as good as that needs.
///
/// # Errors
/// The device's.
pub fn judge(
    world: &World,
    base: &Settings,
    folder: Option<&Path>,
    frames: &[Vec<Frame>],
    rows: &mut [Row],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(ReferenceReport, Converged)> {
    let spread = |frames: &Vec<Frame>| quality::spread(frames).filter(|s| *s > 0.0);
    // Estimates with a control variate would take references that nobody waits for; their errors hold the reference's own.
    let plain =
        rows.iter().zip(frames).filter(|(row, _)| row.setting("estimator") != "cv" && row.setting("estimator") != "residual");
    let smallest = plain.filter_map(|(_, frames)| spread(frames)).fold(f64::INFINITY, f64::min);
    let goal = Goal { noise: if smallest.is_finite() { smallest / MARGIN } else { 0.0 }, most: MOST_DIRECTIONS };
    let finest = rows.iter().zip(frames).filter(|(row, _)| row.setting("rate") == "full" && row.setting("estimator") == "mis");
    let finest = finest.max_by_key(|(row, _)| row.samples.taken).map(|(_, frames)| frames);
    let mut fresh = false;
    loop {
        let image = reference::converge(world, base, &goal, folder, progress)?;
        let (picture, mask) = (image.image().picture, image.mask());
        let of_finest = finest.map(|frames| Ok::<_, Error>((quality::error(frames, &picture, &mask)?.rmse, spread(frames))));
        let agreement = match of_finest.transpose()? {
            Some((error, Some(spread))) => error / spread,
            _ => 1.0,
        };
        if let (true, false, true, Some(cache)) = (agreement > MOST_DISAGREEMENT, fresh, image.cached > 0, folder) {
            log::warn!("{}: the kept reference is of something else: rendered anew", world.name);
            reference::forget(world, base, cache);
            fresh = true;
            continue;
        }
        for (row, frames) in rows.iter_mut().zip(frames) {
            row.error = Some(quality::error(frames, &picture, &mask)?);
        }
        let noise = image.noise()?;
        let smallest = rows.iter().filter_map(|r| r.error.as_ref()).map(|e| e.rmse).fold(f64::INFINITY, f64::min);
        let margin = smallest / noise.rmse;
        let report =
            ReferenceReport { directions: image.directions(), cached: image.cached, noise, margin, agreement: Some(agreement) };
        return Ok((report, image));
    }
}

/// Errors of all variants against the truth of filters, over what surfaces cover wholly.
///
/// # Errors
/// The device's.
pub fn judge_by_truth(
    world: &World,
    base: &Settings,
    folder: Option<&Path>,
    frames: &[Vec<Frame>],
    rows: &mut [Row],
    progress: &mut dyn FnMut(u64, u64),
) -> Result<(ReferenceReport, Converged)> {
    let first = supersample::DEFAULT_SAMPLES;
    let mut truths = Truths::new(world, &base.device, folder, first / 2);
    let image = truths.of(&world.camera, base.config.extent, &Goal { noise: 0.0, most: first.into() }, progress)?;
    let mut judge = |truth: &Converged| {
        let (picture, mask) = (truth.image().picture, truth.whole());
        let mut smallest = f64::INFINITY;
        for (row, frames) in rows.iter_mut().zip(frames) {
            let error = row.error.insert(quality::error(frames, &picture, &mask)?);
            smallest = smallest.min(error.rmse);
        }
        Ok(smallest)
    };
    let (image, smallest) = truths.judged(image, &world.camera, MOST_SUB_SAMPLES, &mut judge, progress)?;
    let noise = image.noise()?;
    let margin = smallest / noise.rmse;
    let report = ReferenceReport { directions: image.directions(), cached: image.cached, noise, margin, agreement: None };
    Ok((report, image))
}

/// Every variant against full rate with each estimator, but for the rungs of that ladder.
pub fn compare(rows: &mut [Row]) {
    // Both fall as a power of the directions: the root mean square of radiance, and that of what is displayed.
    let errors = |row: &Row| row.error.as_ref().map(|e| [e.rmse, 10_f64.powf(-e.psnr / 20.0)]);
    let ladder = |estimator: &str, measure: usize| -> Vec<Rung> {
        let full = rows.iter().filter(|row| row.setting("rate") == "full" && row.setting("estimator") == estimator);
        let rung = |row: &Row| {
            let directions = row.settings.get("samples")?.as_u64()? as u32;
            Some(Rung { directions, error: errors(row)?[measure], times: row.rounds_ms.clone() })
        };
        full.filter_map(rung).collect()
    };
    let ladders = LADDERS.map(|estimator| (estimator, [0, 1].map(|measure| ladder(estimator, measure))));
    for row in rows {
        let Some([linear, shown]) = errors(row) else { continue };
        let other =
            ladders.iter().filter(|(estimator, _)| !(row.setting("rate") == "full" && row.setting("estimator") == *estimator));
        let against = |(estimator, [rmse, psnr]): &(&'static str, [Vec<Rung>; 2])| Against {
            estimator,
            rmse: equal(rmse, linear, &row.rounds_ms),
            psnr: equal(psnr, shown, &row.rounds_ms),
        };
        row.against = other.map(against).collect();
    }
}
