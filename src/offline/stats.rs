//! What a render reports about itself: the `--stats` file, schema 1.

use crate::gpu::timer::FrameTimings;
use crate::offline::bench::quality::Noise;
use crate::offline::headless::DeviceInfo;
use serde::Serialize;
use std::collections::BTreeMap;

/// Statistics of one render.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// Version of this layout.
    pub schema: u32,
    /// The device.
    pub device: DeviceInfo,
    /// Scene name.
    pub scene: String,
    /// Output pixels.
    pub extent: [u32; 2],
    /// Settings by name.
    pub settings: BTreeMap<&'static str, serde_json::Value>,
    /// Shading samples (pixels where `aa` is 1).
    pub pixels: Pixels,
    /// Directions.
    pub samples: Samples,
    /// Noise of the image itself, from its two halves; of a sequence the mean over its images. Of supersampled ones only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// Passes in recording order; of a supersampled image, of one of the renderer's frames that make it.
    pub passes: Vec<PassTime>,
    /// GPU span of the frame's passes in milliseconds.
    pub frame_ms: Quantiles,
    /// Work outside the frame in milliseconds, by name.
    pub setup_ms: BTreeMap<&'static str, f64>,
    /// Largest number of bytes of device memory allocated at once.
    pub memory_bytes: u64,
    /// Messages of the validation layer.
    pub validation_messages: Vec<String>,
}

/// Counts of finest samples.
#[derive(Clone, Debug, Serialize)]
pub struct Pixels {
    /// With a surface.
    pub covered: u64,
    /// Shaded by themselves.
    pub shaded: u64,
    /// Shaded by level: 0 is an output pixel, +1 is 2x2 coarser, -1 a quarter of a pixel.
    pub by_level: BTreeMap<i32, u64>,
}

/// Counts of directions.
#[derive(Clone, Debug, Serialize)]
pub struct Samples {
    /// Drawn in one frame.
    pub taken: u64,
    /// Allowed in one frame.
    pub budget: u64,
}

/// Time and traffic of one pass.
#[derive(Clone, Debug, Serialize)]
pub struct PassTime {
    /// Pass.
    pub name: &'static str,
    /// Median over frames.
    pub ms_median: f64,
    /// 10 % quantile.
    pub ms_p10: f64,
    /// 90 % quantile.
    pub ms_p90: f64,
    /// Bytes of the images and buffers that it declares.
    pub bytes: u64,
}

/// Order statistics of a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub median: f64,
    /// 10 % quantile.
    pub p10: f64,
    /// 90 % quantile.
    pub p90: f64,
}

impl Quantiles {
    /// Of `values`, linearly interpolated between order statistics; zero without values.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |q: f64| {
            let x = q * values.len().saturating_sub(1) as f64;
            let (low, high) = (values.get(x.floor() as usize), values.get(x.ceil() as usize));
            low.zip(high).map_or(0.0, |(a, b)| a + (b - a) * x.fract())
        };
        Self { median: at(0.5), p10: at(0.1), p90: at(0.9) }
    }
}

/// Rows of all passes over `frames`, with the bytes that they declare.
pub fn pass_times(frames: &[FrameTimings], bytes: &[(&'static str, u64)]) -> Vec<PassTime> {
    let time = |name: &str, frame: &FrameTimings| frame.passes.iter().find(|p| p.0 == name).map(|p| p.1);
    bytes
        .iter()
        .map(|&(name, bytes)| {
            let q = Quantiles::of(frames.iter().filter_map(|f| time(name, f)).collect());
            PassTime { name, ms_median: q.median, ms_p10: q.p10, ms_p90: q.p90, bytes }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate() {
        let q = Quantiles::of((0..=10).rev().map(f64::from).collect());
        assert_eq!(q, Quantiles { median: 5.0, p10: 1.0, p90: 9.0 });
        assert_eq!(Quantiles::of(vec![]), Quantiles::default());
        assert_eq!(Quantiles::of(vec![1.0, 2.0]).median, 1.5);
    }
}
