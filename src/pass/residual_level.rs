//! Pass 4 of residuals: the level of each sample by the error of its material's fit as the viewer sees it
//! ([`crate::distribution::fit`]), or by that of the lobes that the filter found.

use crate::config::Config;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::kinds::Kinds;
use crate::pass::PassContext;
use crate::pass::surfaces::{Surfaces, lobe_constants};
use ash::vk::DescriptorType as D;
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "residual_level";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: true,
    materials: true,
    own: &[
        D::UNIFORM_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
        D::STORAGE_IMAGE,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
    ],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    errors: [f32; 2],
    coarsest: u32,
    half_rate: u32,
    finest: u32,
}

pub(crate) struct Io<'a> {
    pub surfaces: Surfaces<'a>,
    pub fits: &'a Buffer,
    /// Whether residuals hold area lights, of which fits know nothing: then each sample is shaded for itself.
    pub area_lights: bool,
    /// Out: the level of each sample, in levels over a sample.
    pub level: &'a Image,
}

pub(crate) struct ResidualLevel(ComputePipeline, Push);

impl ResidualLevel {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, kinds: Kinds) -> Result<Self> {
        let ([_, coarse, half], above) = (config.residual_errors, config.samples_per_side.ilog2());
        let coarsest = config.coarsest();
        let push = Push { errors: [coarse, half], coarsest, half_rate: coarsest.min(above + 1), finest: coarsest.min(above) };
        // Those of lobes are behind six.
        let own = [0, 0, u32::from(config.widened()), 0, 0, 0];
        let constants: Vec<_> = own.into_iter().chain(lobe_constants(config, kinds)).collect();
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)?, push))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let s = &io.surfaces;
        rec.begin(NAME);
        s.sampled(rec);
        rec.buffer(io.fits, Access::COMPUTE_READ);
        rec.overwrite(io.level, Access::COMPUTE_WRITE);
        rec.flush();
        let resources = [
            Resource::Uniform(s.frame),
            Resource::Sampled(s.normals, s.samplers.nearest),
            Resource::Buffer(io.fits),
            Resource::Storage(io.level.view),
            Resource::View(s.shadows, s.samplers.nearest),
            Resource::Sampled(s.factors, s.samplers.nearest),
            Resource::Sampled(s.lobes, s.samplers.nearest),
        ];
        let errors = if io.area_lights { [-1.0; 2] } else { self.1.errors };
        self.0.bind(rec, s.bridge, &resources, &Push { errors, ..self.1 });
        // 2x2 samples each.
        self.0.dispatch(rec, io.level.extent().map(|e| e.div_ceil(2)));
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
