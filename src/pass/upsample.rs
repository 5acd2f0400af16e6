//! Pass 8, continued: the cells that are not shaded, level by level from coarse to fine, from four parents each (Bagher 2011,
//! section 3.2).

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use crate::pass::pyramid::Cells;
use crate::plan::ARGUMENT_BYTES;
use ash::vk::DescriptorType as D;

/// Pass, shader, label and timer name.
pub const NAME: &str = "upsample";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [64, 1, 1],
    push_bytes: 0,
    gbuffer: false,
    materials: false,
    own: &[
        D::UNIFORM_BUFFER,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_IMAGE,
    ],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub samplers: &'a Samplers,
    pub cells: Cells<'a>,
    pub weights: &'a Buffer,
    /// In and out: linear radiance of even and of odd levels. Each level reads one and writes the other.
    pub values: [&'a Image; 2],
}

/// A pipeline for each level from 0, which it writes.
pub(crate) struct Upsample(Vec<ComputePipeline>);

impl Upsample {
    /// For levels below `top`.
    pub fn new(p: &mut PassContext<'_, '_>, top: u32) -> Result<Self> {
        let make = |level| ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &[level]);
        Ok(Self((0..top).map(make).collect::<Result<_>>()?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let Cells { blocks, arguments, .. } = io.cells;
        rec.begin(NAME);
        rec.buffer(blocks, Access::COMPUTE_READ);
        rec.buffer(arguments, Access::INDIRECT);
        rec.buffer(arguments, Access::COMPUTE_READ);
        rec.buffer(io.weights, Access::COMPUTE_READ);
        for (level, pipeline) in self.0.iter().enumerate().rev() {
            let (values, parents) = (io.values[level % 2], io.values[(level + 1) % 2]);
            rec.image(parents, Access::COMPUTE_SAMPLED);
            rec.image(values, Access::COMPUTE_WRITE);
            rec.flush();
            let resources = [
                Resource::Uniform(io.frame),
                Resource::Buffer(blocks),
                Resource::Buffer(arguments),
                Resource::Buffer(io.weights),
                Resource::Sampled(parents, io.samplers.nearest),
                Resource::Storage(values.view),
            ];
            pipeline.bind(rec, BridgeSets::NONE, &resources, &());
            pipeline.dispatch_indirect(rec, arguments, (level as u64 + 1) * ARGUMENT_BYTES);
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.into_iter().for_each(|p| p.retire(bag));
    }
}
