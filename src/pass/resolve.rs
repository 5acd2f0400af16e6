//! Pass 9: averages the shading samples of each output pixel; the background is black or the environment.

use crate::config::Config;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use crate::pass::environment::EnvironmentImages;
use ash::vk::DescriptorType as D;

/// Pass, shader, label and timer name.
pub const NAME: &str = "resolve";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: size_of::<f32>() as u32,
    gbuffer: true,
    materials: false,
    own: &[
        D::UNIFORM_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_IMAGE,
        D::COMBINED_IMAGE_SAMPLER,
    ],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    pub environment: &'a EnvironmentImages,
    pub radiance: &'a Image,
    /// What `radiance` is missing or a factor on, and the radiance on both sides of a factor.
    pub base: Option<(&'a Image, f32)>,
    /// Out: linear radiance; alpha is coverage.
    pub resolved: &'a Image,
}

pub(crate) struct Resolve(ComputePipeline);

impl Resolve {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config) -> Result<Self> {
        let [residual, ratio] = [config.estimator.has_residual(), config.residual_is_factor()].map(u32::from);
        let constants = [residual, ratio, config.samples_per_side];
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.environment.sampled(rec);
        rec.image(io.radiance, Access::COMPUTE_SAMPLED);
        if let Some((base, _)) = io.base {
            rec.image(base, Access::COMPUTE_SAMPLED);
        }
        rec.overwrite(io.resolved, Access::COMPUTE_WRITE);
        rec.flush();
        let resources = [
            Resource::Uniform(io.frame),
            Resource::Sampled(&io.environment.map, io.samplers.linear),
            Resource::Sampled(&io.environment.alias, io.samplers.nearest),
            Resource::Sampled(io.radiance, io.samplers.nearest),
            Resource::Storage(io.resolved.view),
            Resource::Sampled(io.base.map_or(io.radiance, |b| b.0), io.samplers.nearest),
        ];
        self.0.bind(rec, io.bridge, &resources, &io.base.map_or(0.0, |b| b.1));
        self.0.dispatch(rec, io.resolved.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
