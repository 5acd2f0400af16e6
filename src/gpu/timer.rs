//! GPU time by pass name, from timestamp queries: one pool a frame slot, read when the slot comes round again.

use crate::error::Result;
use crate::gpu::context::{Context, VkResultExt};
use crate::gpu::retire::{Build, Handle, Retired};
use ash::vk;

/// Passes that one frame can time.
const MAX_SCOPES: u32 = 32;

/// GPU milliseconds of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimings {
    /// Pass name and time, in recording order.
    pub passes: Vec<(&'static str, f64)>,
    /// From the first pass's begin to the last one's end.
    pub span_ms: f64,
}

struct Slot {
    pool: vk::QueryPool,
    names: Vec<&'static str>,
}

/// Timestamp pools of all frame slots; empty on a queue family without timestamps.
pub(crate) struct GpuTimer {
    slots: Vec<Slot>,
    bits: u32,
    period_ns: f64,
}

impl GpuTimer {
    pub fn new(build: &mut Build<'_>, slots: usize) -> Result<Self> {
        let (bits, period_ns) = (build.cx.timestamp_bits, f64::from(build.cx.limits.timestamp_period));
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2 * MAX_SCOPES);
        let slots = (0..if bits == 0 { 0 } else { slots })
            .map(|_| {
                // SAFETY: the device is alive.
                let pool = unsafe { build.cx.device.create_query_pool(&info, None) }.named("vkCreateQueryPool")?;
                build.cx.name(pool, "timer");
                Ok(Slot { pool: build.track(pool, Handle::QueryPool), names: Vec::new() })
            })
            .collect::<Result<_>>()?;
        Ok(Self { slots, bits, period_ns })
    }

    /// Results of the last frame in `slot`, which the host says has finished; then resets the slot's queries.
    pub fn begin_frame(&mut self, cx: &Context, cmd: vk::CommandBuffer, slot: usize) -> Result<Option<FrameTimings>> {
        let timings = self.results(cx, slot)?;
        self.restart(cx, cmd, slot);
        Ok(timings)
    }

    /// Results of the last work in `slot`, which has finished.
    pub fn results(&self, cx: &Context, slot: usize) -> Result<Option<FrameTimings>> {
        let Some(Slot { pool, names }) = self.slots.get(slot) else { return Ok(None) };
        let mut ticks = vec![[0u64; 2]; names.len()];
        let mut timings = None;
        if !names.is_empty() {
            // SAFETY: the pool is ours; two 64-bit results a scope fit `ticks`.
            let result =
                unsafe { cx.device.get_query_pool_results(*pool, 0, ticks.as_flattened_mut(), vk::QueryResultFlags::TYPE_64) };
            match result {
                Ok(()) => timings = Some(frame_timings(names, &ticks, self.bits, self.period_ns)),
                Err(vk::Result::NOT_READY) => log::warn!("slot {slot} was recorded again before its frame finished"),
                Err(result) => return Err(crate::Error::Vulkan { call: "vkGetQueryPoolResults", result }),
            }
        }
        Ok(timings)
    }

    /// Resets the slot's queries, whether they were read or not.
    pub fn restart(&mut self, cx: &Context, cmd: vk::CommandBuffer, slot: usize) {
        let Some(Slot { pool, names }) = self.slots.get_mut(slot) else { return };
        names.clear();
        // SAFETY: the command buffer is recording outside a render pass.
        unsafe { cx.device.cmd_reset_query_pool(cmd, *pool, 0, 2 * MAX_SCOPES) };
    }

    /// Opens a scope; [`Self::end`] closes the last one.
    pub fn begin(&mut self, cx: &Context, cmd: vk::CommandBuffer, slot: usize, name: &'static str) {
        if let Some(s) = self.slots.get_mut(slot).filter(|s| s.names.len() < MAX_SCOPES as usize) {
            stamp(cx, cmd, s.pool, 2 * s.names.len() as u32);
            s.names.push(name);
        }
    }

    pub fn end(&mut self, cx: &Context, cmd: vk::CommandBuffer, slot: usize) {
        if let Some(s) = self.slots.get(slot).filter(|s| !s.names.is_empty()) {
            stamp(cx, cmd, s.pool, 2 * s.names.len() as u32 - 1);
        }
    }

    pub fn retire(self, bag: &mut Retired) {
        self.slots.into_iter().for_each(|s| bag.push(Handle::QueryPool(s.pool)));
    }
}

fn stamp(cx: &Context, cmd: vk::CommandBuffer, pool: vk::QueryPool, query: u32) {
    // SAFETY: the query was reset at the frame's begin and is written once.
    unsafe { cx.device.cmd_write_timestamp2(cmd, vk::PipelineStageFlags2::ALL_COMMANDS, pool, query) };
}

/// Ticks count modulo 2^bits: differences are taken there.
fn frame_timings(names: &[&'static str], ticks: &[[u64; 2]], bits: u32, period_ns: f64) -> FrameTimings {
    let mask = if bits >= 64 { u64::MAX } else { (1 << bits) - 1 };
    let ms = |from: u64, to: u64| (to.wrapping_sub(from) & mask) as f64 * period_ns * 1e-6;
    let passes = names.iter().zip(ticks).map(|(name, [a, b])| (*name, ms(*a, *b))).collect();
    let span_ms = match (ticks.first(), ticks.last()) {
        (Some([a, _]), Some([_, b])) => ms(*a, *b),
        _ => 0.0,
    };
    FrameTimings { passes, span_ms }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_wrap_at_the_valid_bits() {
        let t = frame_timings(&["a", "b"], &[[250, 4], [4, 10]], 8, 1e6);
        assert_eq!(t.passes, [("a", 10.0), ("b", 6.0)]);
        assert_eq!(t.span_ms, 16.0);
    }
}
