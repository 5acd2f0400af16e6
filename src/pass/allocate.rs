//! Pass 6, continued: how many directions each listed sample gets (Bagher 2011, section 2.3), where they are not the same for all
//! ([`crate::frequency::allocation`] has the rules): a histogram of weights, a share for each of its bins, and the list again with
//! everyone's number, most first.

use crate::config::Config;
use crate::error::Result;
use crate::frequency::allocation::range;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, label and timer name.
pub const NAME: &str = "allocate";

const fn interface(name: &'static str, lanes: u32, push_bytes: usize, own: &'static [D]) -> Interface {
    Interface { name, local_size: [lanes, 1, 1], push_bytes: push_bytes as u32, gbuffer: false, materials: false, own }
}

/// Shader interfaces, in the order in which they run.
pub const INTERFACES: [Interface; 3] = [
    interface(
        "allocate_count",
        64,
        size_of::<CountPush>(),
        &[D::STORAGE_BUFFER, D::STORAGE_BUFFER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_BUFFER],
    ),
    interface("allocate_share", 128, size_of::<SharePush>(), &[D::STORAGE_BUFFER, D::STORAGE_BUFFER]),
    interface(
        "allocate_sort",
        64,
        size_of::<SortPush>(),
        &[
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
            D::COMBINED_IMAGE_SAMPLER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
        ],
    ),
];

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct CountPush {
    side: i32,
    by_level: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SharePush {
    range: [f32; 2],
    budget: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SortPush {
    range: [f32; 2],
    side: i32,
    by_level: f32,
}

/// The pass's buffers; `glsl/allocate` says what they hold.
pub(crate) struct AllocationBuffers {
    histogram: Buffer,
    shares: Buffer,
    cursors: Buffer,
    /// Samples to shade, each with its directions.
    pub list: Buffer,
}

impl AllocationBuffers {
    /// Of names and bytes as `Plan` has them.
    pub fn new(build: &mut Build<'_>, [histogram, shares, cursors, list]: [(&'static str, u64); 4]) -> Result<Self> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        let cleared = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let mut buffer = |(name, bytes), usage| Buffer::new(build, name, bytes, usage, Location::Device);
        Ok(Self {
            histogram: buffer(histogram, cleared)?,
            shares: buffer(shares, usage)?,
            cursors: buffer(cursors, cleared)?,
            list: buffer(list, usage)?,
        })
    }

    /// One of them by name.
    #[cfg(feature = "offline")]
    pub fn buffer(&self, name: &str) -> Option<&Buffer> {
        match name {
            "histogram" => Some(&self.histogram),
            "shares" => Some(&self.shares),
            "allocated" => Some(&self.list),
            _ => None,
        }
    }

    pub fn into_buffers(self) -> [Buffer; 4] {
        [self.histogram, self.shares, self.cursors, self.list]
    }
}

pub(crate) struct Io<'a> {
    pub samplers: &'a Samplers,
    /// Of the `bandwidth` pass.
    pub prediction: &'a Image,
    /// Of the `classify` pass.
    pub arguments: &'a Buffer,
    pub list: &'a Buffer,
    /// Lights and environment from which directions are drawn beside the reflectance.
    pub sources: u32,
    /// Out: the list with directions, and what it was made from.
    pub buffers: &'a AllocationBuffers,
}

pub(crate) struct Allocate {
    pipelines: [ComputePipeline; 3],
    side: i32,
    by_level: f32,
    budget: u32,
    halves: bool,
}

impl Allocate {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config) -> Result<Self> {
        let mut make = |interface| ComputePipeline::new(p.build, p.modules, interface, p.bridge, p.slots, &[]);
        let [count, share, sort] = &INTERFACES;
        Ok(Self {
            pipelines: [make(count)?, make(share)?, make(sort)?],
            side: config.block_side() as i32,
            by_level: config.allocation.by_level() as f32,
            budget: config.directions,
            halves: config.estimator.combines(),
        })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let AllocationBuffers { histogram, shares, cursors, list: allocated } = io.buffers;
        let [count, share, sort] = &self.pipelines;
        let prediction = Resource::Sampled(io.prediction, io.samplers.nearest);
        let [arguments, list] = [io.arguments, io.list].map(Resource::Buffer);
        rec.begin(NAME);
        for buffer in [histogram, cursors] {
            rec.buffer(buffer, Access::TRANSFER_WRITE);
        }
        rec.flush();
        for buffer in [histogram, cursors] {
            // SAFETY: the command buffer is recording outside a render pass; the buffer is a transfer's target.
            unsafe { rec.cx.device.cmd_fill_buffer(rec.cmd, buffer.handle, 0, vk::WHOLE_SIZE, 0) };
        }
        rec.image(io.prediction, Access::COMPUTE_SAMPLED);
        rec.buffer(io.arguments, Access::INDIRECT);
        rec.buffer(io.arguments, Access::COMPUTE_READ);
        rec.buffer(io.list, Access::COMPUTE_READ);
        rec.buffer(histogram, Access::COMPUTE_ATOMIC);
        rec.flush();
        let resources = [arguments, list, prediction, Resource::Buffer(histogram)];
        count.bind(rec, BridgeSets::NONE, &resources, &CountPush { side: self.side, by_level: self.by_level });
        count.dispatch_indirect(rec, io.arguments, 0);

        rec.buffer(histogram, Access::COMPUTE_READ);
        rec.buffer(shares, Access::COMPUTE_WRITE);
        rec.flush();
        let range = range(self.budget, if self.halves { io.sources } else { 0 }).map(|n| n as f32);
        let push = SharePush { range, budget: self.budget as f32 };
        share.bind(rec, BridgeSets::NONE, &[Resource::Buffer(histogram), Resource::Buffer(shares)], &push);
        share.dispatch(rec, [1, 1]);

        rec.buffer(shares, Access::COMPUTE_READ);
        rec.buffer(cursors, Access::COMPUTE_ATOMIC);
        rec.buffer(allocated, Access::COMPUTE_WRITE);
        rec.flush();
        let [shares, cursors, allocated] = [shares, cursors, allocated].map(Resource::Buffer);
        let resources = [arguments, list, prediction, shares, cursors, allocated];
        sort.bind(rec, BridgeSets::NONE, &resources, &SortPush { range, side: self.side, by_level: self.by_level });
        sort.dispatch_indirect(rec, io.arguments, 0);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipelines.into_iter().for_each(|p| p.retire(bag));
    }
}
