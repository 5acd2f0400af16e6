//! What the suite found: the `--json` file, schema 1.

use crate::Filter;
use crate::offline::bench::quality::Noise;
use crate::offline::bench::report::{Head, Seconds, Skipped};
use crate::offline::bench::statistics::{Ratio, Summary};
use crate::offline::bench::table::Target;
use crate::offline::bench::xu::cases::Light;
use crate::offline::metrics::Metrics;
use serde::Serialize;

/// A whole run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was run.
    #[serde(flatten)]
    pub head: Head,
    /// Each scene under a point light, then under its environment.
    pub scenes: Vec<SceneReport>,
    /// Scenes whose camera moves, in the suite tan.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub zooms: Vec<Zoom>,
    /// Scenes that lack files.
    pub skipped: Vec<Skipped>,
    /// What was aimed at, as far as it was measured.
    pub targets: Vec<Target>,
    /// Bytes that the device copies a nanosecond, read and written; absent without timestamps.
    pub copy_gb_per_s: Option<Summary>,
    /// Wall times of the run; `references` are truths.
    pub seconds: Seconds,
}

/// One scene under one light.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// The scene file's stem or the built-in's name.
    pub scene: String,
    /// What shines.
    pub light: Light,
    /// Pixels of stills.
    pub extent: [u32; 2],
    /// What errors are against.
    pub truth: TruthReport,
    /// The flicker that the noise of truths alone would make, of the full preset.
    pub flicker_noise: Option<Flicker>,
    /// Of the base levels of all different pairs of a map of normals and one of roughness.
    pub texels: u64,
    /// With which frames are timed: `preconvolved`, or `mis` where a material refuses that.
    pub estimator: &'static str,
    /// One point-filtered frame of eight times as many pixels a side, which is 64 samples a pixel of the same shading.
    pub supersampling: Cost,
    /// Filters from the smallest error to the largest, by [`Errors::less_noise`].
    pub order: Vec<&'static str>,
    /// Every filter.
    pub rows: Vec<Row>,
}

/// A supersampled image.
#[derive(Clone, Debug, Serialize)]
pub struct TruthReport {
    /// Joint sub-samples a pixel.
    pub samples: u64,
    /// How many of them came from the cache.
    pub cached: u64,
    /// Its own noise, over all pixels in which something is seen.
    pub noise: Noise,
    /// Pixels that are judged: those that surfaces cover wholly.
    pub pixels: usize,
    /// The smallest error that was judged by it, over its noise (root mean squares): 10 or more is good.
    pub margin: f64,
}

/// One filter.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// As `--filter` names it.
    pub filter: &'static str,
    /// Why there is nothing, if the filter does not take a material.
    pub refused: Option<String>,
    /// Of a still whose own noise is a small part of them; under an environment by sampling.
    pub errors: Option<Errors>,
    /// Of a still with the estimator preconvolved, under an environment, where no material refuses that.
    pub preconvolved: Option<Errors>,
    /// In the full preset.
    pub flicker: Option<Flicker>,
    /// Lobes of a covered pixel in the mean, where the filter says it.
    pub lobes: Option<f64>,
    /// What it costs.
    pub cost: Option<Cost>,
}

/// How far a still is from the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// As [`Metrics::rmse`].
    pub rmse: f64,
    /// As [`Metrics::rel_l2`].
    pub rel_l2: f64,
    /// As [`Metrics::color_error`].
    pub color_error: f64,
    /// As [`Metrics::psnr`].
    pub psnr: f64,
    /// As [`Metrics::flip`].
    pub flip: f64,
    /// Mean radiance over the truth's, over all channels: 1 where no energy is lost or won.
    pub energy: f64,
    /// Directions a pixel; 0 where none are drawn.
    pub directions: u32,
    /// The still's own noise, as [`Metrics::rel_l2`].
    pub noise: f64,
    /// `rel_l2` without what the noise of still and truth adds to it in the mean: these are independent, so squares add up.
    pub less_noise: f64,
}

/// As [`Metrics::flicker`], over [`FRAMES`](super::motion::FRAMES) frames against as many truths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Flicker {
    /// The eye moves away from its target.
    pub zoom: f64,
    /// The eye turns about it.
    pub orbit: f64,
}

/// Consecutive frames of one scene under one light, beside as many truths.
#[derive(Clone, Debug, Serialize)]
pub struct Zoom {
    /// The scene file's stem or the built-in's name.
    pub scene: String,
    /// What shines.
    pub light: Light,
    /// Pixels of a frame.
    pub extent: [u32; 2],
    /// How many.
    pub frames: usize,
    /// Joint sub-samples a pixel of each truth.
    pub samples: u64,
    /// The flicker that the noise of truths alone makes.
    pub noise: f64,
    /// JOD of one half of the truths' sub-samples against the other: of twice their noise.
    pub noise_jod: f64,
    /// Every filter.
    pub rows: Vec<ZoomRow>,
}

/// One filter along a zoom.
#[derive(Clone, Debug, Serialize)]
pub struct ZoomRow {
    /// As `--filter` names it.
    pub filter: &'static str,
    /// Why there is nothing, if the filter does not take a material.
    pub refused: Option<String>,
    /// What was found.
    pub found: Option<Moving>,
}

/// How a sequence differs from its truths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Moving {
    /// As [`Metrics::flicker`].
    pub flicker: f64,
    /// The flicker of the sequence's own noise; 0 where nothing is drawn.
    pub noise: f64,
    /// `flicker` without what the noise of sequence and truths adds to it, as squares: independent normal differences add up so.
    pub less_noise: f64,
    /// As [`Metrics::jod`].
    pub jod: f64,
    /// As [`Metrics::color_error`], over all frames.
    pub color_error: f64,
}

/// Milliseconds on the device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cost {
    /// `brdf_map`, `vmf_mips`, `cluster_moments` and `mixtures`, on change; absent without maps of the filter's own.
    pub set_up_ms: Option<Summary>,
    /// How fast `vmf_mips` moves bytes; absent where it does nothing.
    pub mips: Option<Rate>,
    /// `filter` and `base` (or `shade`), in every frame.
    pub shade_ms: Summary,
    /// All passes of a frame.
    pub frame_ms: Summary,
    /// 64x supersampling's `shade_ms` over this.
    pub gain: Option<Ratio>,
    /// 64x supersampling's `shade_ms` over this and set-up.
    pub gain_with_set_up: Option<Ratio>,
    /// `shade_ms` over LEAN mapping's.
    pub over_lean: Option<Ratio>,
    /// Set-up a texel, in nanoseconds.
    pub ns_a_texel: Option<f64>,
    /// Device memory of the materials beyond that with the filter `point`, a texel: maps with their mips, and importance tables
    /// where filters need those of more roughnesses.
    pub bytes_a_texel: Option<f64>,
}

/// Bytes that a pass moves, and how fast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// Milliseconds of the pass.
    pub ms: Summary,
    /// Read and written.
    pub bytes: u64,
    /// By the median of the times.
    pub gb_per_s: f64,
    /// Over the rate at which the device copies.
    pub of_copy: Option<f64>,
}

impl Row {
    /// Of which nothing is known yet.
    pub(super) fn new(filter: Filter) -> Self {
        let filter = filter.name();
        Self { filter, refused: None, errors: None, preconvolved: None, flicker: None, lobes: None, cost: None }
    }
}

impl Errors {
    /// Of a still with this noise; `truth` is the truth's, over the same pixels.
    pub(super) fn new(metrics: &Metrics, energy: f64, directions: u32, [noise, truth]: [f64; 2]) -> Self {
        let Metrics { rmse, rel_l2, color_error, psnr, flip, .. } = *metrics;
        let less_noise = (rel_l2 * rel_l2 - noise * noise - truth * truth).max(0.0).sqrt();
        Self { rmse, rel_l2, color_error, psnr, flip, energy, directions, noise, less_noise }
    }
}

impl ZoomRow {
    /// With the flicker of a sequence, of its noise and of its truths'.
    pub(super) fn of(self, [flicker, noise, truth]: [f64; 3], jod: f64, color_error: f64) -> Self {
        let less_noise = (flicker * flicker - noise * noise - truth * truth).max(0.0).sqrt();
        Self { found: Some(Moving { flicker, noise, less_noise, jod, color_error }), ..self }
    }
}

impl Zoom {
    /// What was found of the filter of that name.
    pub fn found(&self, filter: &str) -> Option<Moving> {
        self.rows.iter().find(|row| row.filter == filter)?.found
    }
}

impl SceneReport {
    /// The filter of that name.
    pub fn row(&self, filter: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.filter == filter)
    }
}

/// Names of filters, the best first.
pub(super) fn order(rows: &[Row]) -> Vec<&'static str> {
    let mut known: Vec<_> = rows.iter().filter_map(|row| Some((row.errors.as_ref()?.less_noise, row.filter))).collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    known.into_iter().map(|(_, filter)| filter).collect()
}
