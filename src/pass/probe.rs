//! A compute module of the caller's own over the renderer's materials and environment: what a formula gives on the device.
//! Not part of the frame.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use crate::pass::environment::EnvironmentImages;
use crate::pass::materials::MaterialImages;
use ash::vk::DescriptorType as D;

/// Module and label name.
pub const NAME: &str = "probe";

/// Shader interface: set 1 the material bridge; set 2 the frame, the environment's two images, input and output, and what
/// `glsl/include/prefilter.glsl` reads.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [64, 1, 1],
    push_bytes: 4,
    gbuffer: false,
    materials: true,
    own: &[
        D::UNIFORM_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
    ],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    pub environment: &'a EnvironmentImages,
    pub materials: &'a MaterialImages,
    /// `count` entries of four words.
    pub input: &'a Buffer,
    pub count: u32,
    /// Out: `count` entries of four words.
    pub output: &'a Buffer,
}

pub(crate) struct Probe(ComputePipeline);

impl Probe {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &[])?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.environment.sampled(rec);
        io.materials.sampled(rec);
        if let Some(prefiltered) = &io.environment.prefiltered {
            prefiltered.sampled(rec);
        }
        rec.buffer(io.input, Access::COMPUTE_READ);
        rec.buffer(io.output, Access::COMPUTE_WRITE);
        rec.flush();
        // Without pre-convolved light others stand in, unread.
        let map = Resource::Sampled(&io.environment.map, io.samplers.linear);
        let [first, second, irradiance, suns] = match &io.environment.prefiltered {
            Some(prefiltered) => prefiltered.resources(io.samplers),
            None => [map, map, map, Resource::Buffer(io.input)],
        };
        let resources = [
            Resource::Uniform(io.frame),
            Resource::Sampled(&io.environment.map, io.samplers.linear),
            Resource::Sampled(&io.environment.alias, io.samplers.nearest),
            Resource::Buffer(io.input),
            Resource::Buffer(io.output),
            first,
            second,
            irradiance,
            suns,
        ];
        self.0.bind(rec, io.bridge, &resources, &io.count);
        self.0.dispatch(rec, [io.count, 1]);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
