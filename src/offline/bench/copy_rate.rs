//! What the device can do at most with bytes: copy them.

use crate::gpu::buffer::Buffer;
use crate::gpu::context::Context;
use crate::gpu::memory::Location;
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::timer::GpuTimer;
use crate::offline::bench::runner::WARM_UP;
use crate::offline::bench::statistics::Summary;
use crate::offline::error::Result;
use crate::offline::headless::{Headless, Options};
use crate::offline::read_back::copy_buffer;
use crate::{Config, Requirements};
use ash::vk;

/// Bytes of a copy: more than caches hold, as are maps.
const BYTES: u64 = 64 << 20;
/// Scope of the timer.
const NAME: &str = "copy";

/// Bytes that are read and written a nanosecond (GB/s) by copies from one buffer to another in the device's memory, after warming up;
/// `None` without timestamps.
///
/// # Errors
/// The device's.
pub fn measure(device: &Options, rounds: u32) -> Result<Option<Summary>> {
    let mut headless = Headless::new(device, &Requirements::of(&Config::new([1, 1])))?;
    let (host, memory) = headless.parts()?;
    let cx = Context::new(&host)?;
    let (from, to, mut timer) = Build::run(&cx, memory, |build| {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let mut buffer = |name| Buffer::new(build, name, BYTES, usage, Location::Device);
        Ok((buffer("copied")?, buffer("copy")?, GpuTimer::new(build, 1)?))
    })?;
    let mut times = Vec::new();
    let mut states = States::default();
    // The times of a round are known in the next one.
    let found = (0..=WARM_UP + rounds).try_for_each(|round| {
        headless.submit(|cmd, _| {
            let known = timer.begin_frame(&cx, cmd, 0)?;
            times.extend(known.filter(|_| round > WARM_UP).map(|t| t.span_ms));
            let mut rec = Recorder::new(&cx, cmd, 0, &mut states, Some(&mut timer));
            rec.begin(NAME);
            copy_buffer(&mut rec, &from, &to);
            rec.end();
            Ok(Retired::default())
        })
    });
    let mut bag = Retired::default();
    timer.retire(&mut bag);
    from.retire(&mut bag);
    to.retire(&mut bag);
    let (host, memory) = headless.parts()?;
    // SAFETY: every submission was waited for.
    unsafe { bag.free(host.device, memory) };
    found?;
    let rates: Vec<f64> = times.iter().filter(|ms| **ms > 0.0).map(|ms| 2.0 * BYTES as f64 / (ms * 1e6)).collect();
    Ok((!rates.is_empty()).then(|| Summary::of(&rates)))
}
