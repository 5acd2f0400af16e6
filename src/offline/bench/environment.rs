//! What a new environment would cost in every frame: its upload, and the analysis of how fast it varies.

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
use crate::sampling::LatLong;
use crate::{Config, Rate, Requirements};
use ash::vk;
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
    /// GPU milliseconds of the pass `environment_bandwidth`.
    pub bandwidth_ms: Summary,
}

/// What the analysis needs on a device.
struct Made {
    timer: GpuTimer,
    samplers: Samplers,
    pass: EnvironmentBandwidth,
}

/// Replaces `map` by itself `rounds` times, after warming up.
///
/// # Errors
/// The device's.
pub fn times(map: &LatLong, base: &Settings, rounds: u32) -> Result<EnvironmentTimes> {
    let config = Config { rate: Rate::Bandwidth, ..base.config() };
    let mut headless = Headless::new(&base.device, &Requirements::of(&config))?;
    let (host, memory) = headless.parts()?;
    let cx = Context::new(&host)?;
    let mut made = Build::run(&cx, memory, |build| {
        let (timer, samplers) = (GpuTimer::new(build, 1)?, Samplers::new(build)?);
        let bridge = BridgeLayouts { gbuffer: vk::DescriptorSetLayout::null(), materials: vk::DescriptorSetLayout::null() };
        let pass = EnvironmentBandwidth::new(&mut PassContext { build, modules: &Modules::default(), bridge, slots: 1 }, EPS)?;
        Ok(Made { timer, samplers, pass })
    })?;
    let found = replace(&mut headless, &cx, &mut made, map, rounds);
    let mut bag = Retired::default();
    made.timer.retire(&mut bag);
    made.samplers.retire(&mut bag);
    made.pass.retire(&mut bag);
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
        bandwidth_ms: of(environment_bandwidth::NAME),
    })
}

/// Milliseconds of preparation on the CPU, and the device's times.
type Times = (Vec<f64>, Vec<FrameTimings>);

fn replace(headless: &mut Headless, cx: &Context, made: &mut Made, map: &LatLong, rounds: u32) -> Result<Times> {
    let (mut prepared, mut timings) = (Vec::new(), Vec::new());
    // The device's times of a round are known in the next one.
    for round in 0..=WARM_UP + rounds {
        headless.submit(|cmd, memory| {
            let Made { timer, samplers, pass } = made;
            let analyses = Analyses { bandwidth: Some(pass), prefilter: None, rest: false };
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
