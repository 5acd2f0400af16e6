//! What a new environment would cost in every frame: its upload, and the analysis of how fast it varies, or its convolution.

use crate::frequency::environment::EPS;
use crate::gpu::context::Context;
use crate::gpu::pipeline::{BridgeLayouts, Modules};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::timer::{FrameTimings, GpuTimer};
use crate::offline::bench::runner::WARM_UP;
use crate::offline::bench::statistics::Summary;
use crate::offline::error::Result;
use crate::offline::headless::Headless;
use crate::offline::render::Settings;
use crate::pass::PassContext;
use crate::pass::environment::{self, Analyses, EnvironmentUpload};
use crate::pass::environment_bandwidth::{self, EnvironmentBandwidth};
use crate::pass::prefilter::{self, Prefilter};
use crate::sampling::LatLong;
use crate::{Config, Estimator, Rate, Requirements};
use ash::vk;
use glam::DVec3;
use serde::Serialize;
use std::time::Instant;

/// Times of an environment that is replaced.
#[derive(Clone, Debug, Serialize)]
pub struct EnvironmentTimes {
    /// Columns and rows.
    pub extent: [u32; 2],
    /// CPU milliseconds: importance tables, and copies for the device.
    pub prepare_ms: Summary,
    /// GPU milliseconds of the upload.
    pub upload_ms: Summary,
    /// GPU milliseconds of the pass `environment_bandwidth`, if that is what is made.
    pub bandwidth_ms: Option<Summary>,
    /// GPU milliseconds of the pass `prefilter`, if that is what is made.
    pub prefilter_ms: Option<Summary>,
    /// Bytes of what that pass makes, which is looked up.
    pub prefiltered_bytes: Option<u64>,
}

/// What is made of an environment beside its tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rebuilt {
    /// What the prediction reads.
    Bandwidth,
    /// What `preconvolved` looks up.
    Prefilter,
}

/// What that needs on a device.
struct Made {
    timer: GpuTimer,
    samplers: Samplers,
    bandwidth: Option<EnvironmentBandwidth>,
    prefilter: Option<Prefilter>,
}

/// `map` with half as many columns and rows, each texel the mean of four; none where these are odd.
///
/// # Errors
/// None for a valid map.
pub fn halved(map: &LatLong) -> Result<Option<LatLong>> {
    let [width, height] = [map.width() / 2, map.height() / 2];
    if map.width() % 2 + map.height() % 2 > 0 {
        return Ok(None);
    }
    let texel = |i: u32| {
        let [x, y] = [2 * i64::from(i % width), 2 * i64::from(i / width)];
        let sum: DVec3 = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[a, b]| map.texel(x + a, y + b)).into_iter().sum();
        (0.25 * sum).as_vec3().to_array()
    };
    Ok(Some(LatLong::new(width, height, (0..width * height).map(texel).collect())?))
}

/// Replaces `map` by itself `rounds` times, after warming up.
///
/// # Errors
/// The device's.
pub fn times(map: &LatLong, base: &Settings, rounds: u32, what: Rebuilt) -> Result<EnvironmentTimes> {
    let (rate, estimator) = match what {
        Rebuilt::Bandwidth => (Rate::Bandwidth, Estimator::Mis),
        Rebuilt::Prefilter => (Rate::Full, Estimator::Preconvolved),
    };
    let config = Config { rate, estimator, ..base.config() };
    let mut headless = Headless::new(&base.device, &Requirements::of(&config))?;
    let (host, memory) = headless.parts()?;
    let cx = Context::new(&host)?;
    let mut made = Build::run(&cx, memory, |build| {
        let (timer, samplers) = (GpuTimer::new(build, 1)?, Samplers::new(build)?);
        let bridge = BridgeLayouts { gbuffer: vk::DescriptorSetLayout::null(), materials: vk::DescriptorSetLayout::null() };
        let p = &mut PassContext { build, modules: &Modules::default(), bridge, slots: 1 };
        let (bandwidth, prefilter) = match what {
            Rebuilt::Bandwidth => (Some(EnvironmentBandwidth::new(p, EPS)?), None),
            Rebuilt::Prefilter => (None, Some(Prefilter::new(p)?)),
        };
        Ok(Made { timer, samplers, bandwidth, prefilter })
    })?;
    let found = replace(&mut headless, &cx, &mut made, map, rounds);
    let mut bag = Retired::default();
    made.timer.retire(&mut bag);
    made.samplers.retire(&mut bag);
    made.bandwidth.into_iter().for_each(|pass| pass.retire(&mut bag));
    made.prefilter.into_iter().for_each(|pass| pass.retire(&mut bag));
    let (host, memory) = headless.parts()?;
    // SAFETY: every submission was waited for.
    unsafe { bag.free(host.device, memory) };
    let (prepared, timings) = found?;
    let of = |name: &str| {
        let times = timings.iter().flat_map(|t| &t.passes).filter(|p| p.0 == name).map(|p| p.1);
        Summary::of(&times.collect::<Vec<_>>())
    };
    Ok(EnvironmentTimes {
        extent: [map.width(), map.height()],
        prepare_ms: Summary::of(&prepared),
        upload_ms: of(environment::NAME),
        bandwidth_ms: (what == Rebuilt::Bandwidth).then(|| of(environment_bandwidth::NAME)),
        prefilter_ms: (what == Rebuilt::Prefilter).then(|| of(prefilter::NAME)),
        prefiltered_bytes: (what == Rebuilt::Prefilter).then(|| prefilter::bytes([map.width(), map.height()])),
    })
}

/// Milliseconds of preparation on the CPU, and the device's times.
type Times = (Vec<f64>, Vec<FrameTimings>);

fn replace(headless: &mut Headless, cx: &Context, made: &mut Made, map: &LatLong, rounds: u32) -> Result<Times> {
    let (mut prepared, mut timings) = (Vec::new(), Vec::new());
    // The device's times of a round are known in the next one.
    for round in 0..=WARM_UP + rounds {
        headless.submit(|cmd, memory| {
            let Made { timer, samplers, bandwidth, prefilter } = made;
            let analyses = Analyses { bandwidth: bandwidth.as_ref(), prefilter: prefilter.as_ref(), rest: false };
            let known = timer.begin_frame(cx, cmd, 0)?;
            timings.extend(known.filter(|_| round > WARM_UP));
            let clock = Instant::now();
            let upload = Build::run(cx, memory, |build| EnvironmentUpload::new(build, map, analyses, samplers))?;
            if (WARM_UP..WARM_UP + rounds).contains(&round) {
                prepared.push(clock.elapsed().as_secs_f64() * 1e3);
            }
            let (mut states, mut bag) = (States::default(), Retired::default());
            let mut rec = Recorder::new(cx, cmd, 0, &mut states, Some(timer));
            let images = upload.record(&mut rec, analyses, &mut bag);
            images.retire(&mut states, &mut bag);
            Ok(bag)
        })?;
    }
    Ok((prepared, timings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_map_is_the_mean_of_it() {
        let texels = (0..32).map(|i| [i as f32, 1.0, (i % 8) as f32]).collect();
        let half = halved(&LatLong::new(8, 4, texels).unwrap()).unwrap().unwrap();
        assert_eq!((half.width(), half.height()), (4, 2));
        // 2, 3, 10 and 11; 20, 21, 28 and 29.
        assert_eq!([half.texels()[1], half.texels()[6]], [[6.5, 1.0, 2.5], [24.5, 1.0, 4.5]]);
        assert!(halved(&LatLong::new(8, 3, vec![[0.0; 3]; 24]).unwrap()).unwrap().is_none());
    }
}
