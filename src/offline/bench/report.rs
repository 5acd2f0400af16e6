//! What a bench found: the `--json` file, schema 1.

use crate::gpu::timer::FrameTimings;
use crate::offline::bench::cases::{Case, Half};
use crate::offline::bench::curves::Curve;
use crate::offline::bench::environment::EnvironmentTimes;
use crate::offline::bench::equal::{Equal, Is};
use crate::offline::bench::joined;
use crate::offline::bench::quality::Noise;
use crate::offline::bench::reached::Reached;
use crate::offline::bench::runner::{Measured, Part};
use crate::offline::bench::statistics::{Ratio, Summary, ratio_of_medians};
use crate::offline::bench::table::{Line, Target};
use crate::offline::headless::DeviceInfo;
use crate::offline::metrics::Metrics;
use crate::offline::stats::{Pixels, Samples};
use serde::Serialize;
use std::collections::BTreeMap;

/// What was run, and on what.
#[derive(Clone, Debug, Serialize)]
pub struct Head {
    /// Version of this layout.
    pub schema: u32,
    /// Version of the program.
    pub passband: &'static str,
    /// Name of the suite.
    pub suite: &'static str,
    /// Name of the preset.
    pub preset: &'static str,
    /// Timed frames of each variant.
    pub rounds: u32,
    /// Whether it holds all scenes: not while the run goes on, and not after an interruption.
    pub complete: bool,
    /// The device; absent if every scene was skipped.
    pub device: Option<DeviceInfo>,
}

impl Head {
    /// Of a run whose device is not known yet.
    pub fn new(suite: &'static str, preset: &'static str, rounds: u32) -> Self {
        Self { schema: 1, passband: env!("CARGO_PKG_VERSION"), suite, preset, rounds, complete: false, device: None }
    }
}

/// A whole run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was run.
    #[serde(flatten)]
    pub head: Head,
    /// Scenes in the order of the run.
    pub scenes: Vec<SceneReport>,
    /// Scenes that lack files.
    pub skipped: Vec<Skipped>,
    /// Gains over all scenes of a half.
    pub summary: Vec<Gain>,
    /// The suite bagher: full rate beside the predicted one, for each number of directions that both have.
    pub table: Vec<Line>,
    /// The suite residual: what is as good as full rate, and how much sooner.
    pub reached: Vec<Reached>,
    /// The suite joined: what supersampling and each method alone take for as small an error.
    pub joined: Vec<joined::Line>,
    /// What was aimed at.
    pub targets: Vec<Target>,
    /// Wall times of the run.
    pub seconds: Seconds,
}

/// Wall times in seconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Of the run.
    pub total: f64,
    /// For references, where the cache did not hold them, and errors.
    pub references: f64,
}

/// A scene that was not measured.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    /// Its name.
    pub scene: String,
    /// What `scripts/fetch-assets` fetches for it.
    pub needs: Vec<&'static str>,
}

/// One scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// Its name.
    pub name: String,
    /// Whether defaults were chosen or are judged on it; absent for scenes of the user's.
    pub half: Option<Half>,
    /// What it consists of; absent for scenes of the user's.
    pub case: Option<Case>,
    /// Output pixels.
    pub extent: [u32; 2],
    /// What a new environment costs; absent in suites without errors and in scenes without one.
    pub environment: Option<EnvironmentTimes>,
    /// What an environment costs that is pre-convolved in every frame, at its size and at half of that; of the suite residual, at the
    /// first scene with a map of that size.
    pub rebuilt: Vec<EnvironmentTimes>,
    /// Error of reconstruction alone over shaded samples; empty unless it is asked for, in suites with errors.
    pub curves: Vec<Curve>,
    /// What errors are against; absent in suites without errors.
    pub reference: Option<ReferenceReport>,
    /// Variants; the last is the control.
    pub variants: Vec<Row>,
}

/// A converged image.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceReport {
    /// Directions a pixel.
    pub directions: u64,
    /// How many of them came from the cache.
    pub cached: u64,
    /// Its own noise.
    pub noise: Noise,
    /// The smallest error that was judged by it, over its noise (root mean squares): 10 or more is good.
    pub margin: f64,
    /// Error of full rate at most directions against it, over what two frames of that say of each other: 1 unless the
    /// reference is of something else. Absent for truths of filters, from which full rate differs by more than noise.
    pub agreement: Option<f64>,
}

/// One variant in one scene.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// What it is for.
    pub part: Part,
    /// As `passband render --stats` has them.
    pub settings: BTreeMap<&'static str, serde_json::Value>,
    /// Counts of finest samples.
    pub pixels: Pixels,
    /// Counts of directions.
    pub samples: Samples,
    /// Shaded over covered samples.
    pub shaded_fraction: f64,
    /// GPU milliseconds from the first pass's begin to the last one's end.
    pub frame_ms: Summary,
    /// The same of each round.
    pub rounds_ms: Vec<f64>,
    /// GPU milliseconds of all passes added.
    pub passes_ms: Summary,
    /// CPU milliseconds that recording a frame takes.
    pub record_ms: Summary,
    /// Frame time over the first variant's.
    pub over_first: Option<Ratio>,
    /// Passes in recording order.
    pub passes: Vec<PassRow>,
    /// Largest number of bytes of device memory allocated at once.
    pub memory_bytes: u64,
    /// Error against the reference, over some frames; infinite values are null.
    pub error: Option<Metrics>,
    /// Comparison with full rate of each estimator that is measured there; not with itself.
    pub against: Vec<Against>,
}

/// One pass of one variant.
#[derive(Clone, Debug, Serialize)]
pub struct PassRow {
    /// Its name.
    pub name: &'static str,
    /// GPU milliseconds.
    pub ms: Summary,
    /// Bytes of the images and buffers that it declares.
    pub bytes: u64,
    /// Those bytes over the median, in 10^9 bytes a second.
    pub gb_per_s: f64,
}

/// A variant against full rate.
#[derive(Clone, Debug, Serialize)]
pub struct Against {
    /// The estimator of full rate.
    pub estimator: &'static str,
    /// At equal [`Metrics::rmse`].
    pub rmse: Option<Equal>,
    /// At equal [`Metrics::psnr`].
    pub psnr: Option<Equal>,
}

/// What a variant gains over the scenes of a half.
#[derive(Clone, Debug, Serialize)]
pub struct Gain {
    /// The variant.
    pub variant: String,
    /// The half; absent for scenes of the user's.
    pub half: Option<Half>,
    /// The estimator of full rate.
    pub estimator: &'static str,
    /// The measure at which errors are equal: rmse or psnr.
    pub measure: &'static str,
    /// Scenes that are counted.
    pub scenes: usize,
    /// Median of the speed-ups; where some are bounds, it is one if they are in the middle.
    pub median: SpeedUp,
    /// The least.
    pub least: SpeedUp,
    /// Its scene.
    pub least_scene: String,
    /// The most.
    pub most: SpeedUp,
    /// Its scene.
    pub most_scene: String,
}

/// A gain, or a bound on it, because full rate was not measured far enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedUp {
    /// The factor.
    pub factor: f64,
    /// What it is.
    pub is: Is,
}

impl SceneReport {
    /// The variant of that name.
    pub fn row(&self, name: &str) -> Option<&Row> {
        self.variants.iter().find(|row| row.name == name)
    }
}

impl Row {
    /// Of a variant; `first` are the times of the first one.
    pub fn new(measured: Measured, first: &[FrameTimings]) -> Self {
        let Measured { variant, stats, times, record_ms } = measured;
        let spans = |times: &[FrameTimings]| times.iter().map(|t| t.span_ms).collect::<Vec<_>>();
        let rounds_ms = spans(&times);
        let sums: Vec<f64> = times.iter().map(|t| t.passes.iter().map(|p| p.1).sum()).collect();
        let pass = |name: &'static str, bytes: u64| {
            let of = times.iter().filter_map(|t| t.passes.iter().find(|p| p.0 == name)).map(|p| p.1);
            let ms = Summary::of(&of.collect::<Vec<_>>());
            let gb_per_s = if ms.median > 0.0 { bytes as f64 * 1e-6 / ms.median } else { 0.0 };
            PassRow { name, ms, bytes, gb_per_s }
        };
        Self {
            name: variant.name,
            part: variant.part,
            record_ms: Summary::of(&record_ms),
            shaded_fraction: stats.pixels.shaded as f64 / stats.pixels.covered.max(1) as f64,
            frame_ms: Summary::of(&rounds_ms),
            over_first: ratio_of_medians(&rounds_ms, &spans(first)),
            rounds_ms,
            passes_ms: Summary::of(&sums),
            passes: stats.passes.iter().map(|p| pass(p.name, p.bytes)).collect(),
            settings: stats.settings,
            pixels: stats.pixels,
            samples: stats.samples,
            memory_bytes: stats.memory_bytes,
            error: None,
            against: Vec::new(),
        }
    }

    /// Against full rate of that estimator at equal root mean squared error.
    pub fn against(&self, estimator: &str) -> Option<Equal> {
        self.against.iter().find(|a| a.estimator == estimator)?.rmse
    }

    /// One of its settings; empty for numbers and for what there is not.
    pub fn setting(&self, name: &str) -> &str {
        self.settings.get(name).and_then(|value| value.as_str()).unwrap_or_default()
    }

    /// Directions a covered sample.
    pub fn directions(&self) -> f64 {
        self.samples.taken as f64 / self.pixels.covered.max(1) as f64
    }
}

/// Gains of every variant over the scenes of each half, in the order in which they first appear; of other settings than the
/// default those by which it is chosen: with the same estimator on both sides, at equal root mean squared error.
pub fn gains(scenes: &[SceneReport]) -> Vec<Gain> {
    type Key<'a> = (Option<Half>, &'a str, &'static str, &'static str);
    let mut found: Vec<(Key<'_>, Vec<(&str, SpeedUp)>)> = Vec::new();
    for scene in scenes {
        for (row, against) in scene.variants.iter().flat_map(|row| row.against.iter().map(move |a| (row, a))) {
            for (measure, equal) in [("rmse", against.rmse), ("psnr", against.psnr)] {
                let counts = match row.part {
                    Part::Compared => true,
                    Part::Setting => against.estimator == "mis" && measure == "rmse",
                    Part::FallBack | Part::Supersampled | Part::Control => false,
                };
                let Some(equal) = equal.filter(|_| counts) else { continue };
                let entry = (scene.name.as_str(), SpeedUp { factor: equal.speed_up, is: equal.speed_up_is });
                let key = (scene.half, row.name.as_str(), against.estimator, measure);
                match found.iter_mut().find(|(known, _)| *known == key) {
                    Some((_, all)) => all.push(entry),
                    None => found.push((key, vec![entry])),
                }
            }
        }
    }
    found.sort_by_key(|(key, _)| key.0);
    let gain = |((half, variant, estimator, measure), mut all): (Key<'_>, Vec<(&str, SpeedUp)>)| {
        all.sort_by(|a, b| a.1.factor.total_cmp(&b.1.factor));
        let ((least_scene, least), (most_scene, most)) = (*all.first()?, *all.last()?);
        Some(Gain {
            variant: variant.to_string(),
            half,
            estimator,
            measure,
            scenes: all.len(),
            median: middle(&all)?,
            least,
            least_scene: least_scene.to_string(),
            most,
            most_scene: most_scene.to_string(),
        })
    };
    found.into_iter().filter_map(gain).collect()
}

/// The median of sorted gains: of an even number the mean of the middle two, a bound if one of them is.
pub(super) fn middle(sorted: &[(&str, SpeedUp)]) -> Option<SpeedUp> {
    let (low, high) = (sorted.get((sorted.len().checked_sub(1)?) / 2)?.1, sorted.get(sorted.len() / 2)?.1);
    let is = if low.is == Is::Found { high.is } else { low.is };
    Some(SpeedUp { factor: (low.factor + high.factor) / 2.0, is })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_bounds_is_a_bound() {
        let of = |all: &[(f64, Is)]| middle(&all.iter().map(|&(factor, is)| ("", SpeedUp { factor, is })).collect::<Vec<_>>());
        let gain = |factor, is| Some(SpeedUp { factor, is });
        assert_eq!(of(&[]), None);
        // What is at most 0.9 is on the low side whatever it is.
        assert_eq!(of(&[(0.9, Is::AtMost), (2.0, Is::Found), (3.0, Is::AtLeast)]), gain(2.0, Is::Found));
        assert_eq!(of(&[(1.0, Is::Found), (2.0, Is::AtLeast)]), gain(1.5, Is::AtLeast));
        assert_eq!(of(&[(1.0, Is::AtMost), (2.0, Is::Found)]), gain(1.5, Is::AtMost));
    }
}
