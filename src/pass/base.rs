//! Pass 7: noise-free radiance at every sample, from the environment pre-convolved by the lobes that stand for the material
//! ([`crate::distribution::fit`], [`crate::distribution::reflected`] and [`crate::distribution::prefilter`] are the f64 twins).

use crate::config::Config;
use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::kinds::Kinds;
use crate::light::Light;
use crate::pass::PassContext;
use crate::pass::prefilter::Prefiltered;
use crate::pass::surfaces::{Surfaces, lobe_constants};
use ash::vk::DescriptorType as D;

/// Pass, shader, label, timer and AOV name.
pub const NAME: &str = "base";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: true,
    materials: true,
    own: &[
        D::UNIFORM_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
        D::STORAGE_IMAGE,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
    ],
};

pub(crate) struct Io<'a> {
    /// Of which lights are exact ones, as [`check_lights`] says.
    pub surfaces: Surfaces<'a>,
    pub prefiltered: &'a Prefiltered,
    pub fits: &'a Buffer,
    /// Out: linear radiance where covered.
    pub radiance: &'a Image,
}

/// Pipelines for frames without suns and lights beside the environment, with suns alone, and with lights: what evaluates them takes time
/// where there are none, too, on devices that run a loop's body once, masked.
pub(crate) struct Base([ComputePipeline; 3]);

/// Refuses lights that would have to be sampled.
pub(crate) fn check_lights(lights: &[Light]) -> Result<()> {
    match lights.iter().position(Light::is_area) {
        Some(i) => Err(Error::invalid(format!("lights[{i}]"), "a point or a direction for pre-convolved light", "an area")),
        None => Ok(()),
    }
}

impl Base {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, kinds: Kinds) -> Result<Self> {
        let mut make = |lights, suns| {
            // Constants 3 to 5 are of no use here.
            let own = [u32::from(config.widened()), lights, suns, 0, 0, 0];
            let constants: Vec<_> = own
                .into_iter()
                .chain(lobe_constants(config, kinds))
                .chain([u32::from(config.exact_lobes), kinds.models])
                .collect();
            ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)
        };
        Ok(Self([make(0, 0)?, make(0, 1)?, make(1, 1)?]))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let s = &io.surfaces;
        rec.begin(NAME);
        io.prefiltered.sampled(rec);
        s.sampled(rec);
        rec.buffer(io.fits, Access::COMPUTE_READ);
        rec.overwrite(io.radiance, Access::COMPUTE_WRITE);
        rec.flush();
        let [first, second, irradiance, suns] = io.prefiltered.resources(s.samplers);
        let resources = [
            Resource::Uniform(s.frame),
            Resource::Sampled(s.normals, s.samplers.nearest),
            Resource::Sampled(s.factors, s.samplers.nearest),
            Resource::Buffer(s.lights),
            Resource::Storage(io.radiance.view),
            first,
            second,
            irradiance,
            suns,
            Resource::Sampled(s.lobes, s.samplers.nearest),
            Resource::Buffer(io.fits),
            Resource::View(s.shadows, s.samplers.nearest),
        ];
        let pipeline = &self.0[if s.light_count > 0 { 2 } else { usize::from(io.prefiltered.has_suns) }];
        pipeline.bind(rec, s.bridge, &resources, &());
        pipeline.dispatch(rec, s.normals.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.into_iter().for_each(|p| p.retire(bag));
    }
}
