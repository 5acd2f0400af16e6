//! Pass 7: noise-free radiance at every sample, from the environment pre-convolved by the lobes that stand for the material
//! ([`crate::distribution::fit`], [`crate::distribution::reflected`] and [`crate::distribution::prefilter`] are the f64 twins).

use crate::config::Config;
use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::kinds::Kinds;
use crate::light::Light;
use crate::pass::materials::MaterialImages;
use crate::pass::prefilter::Prefiltered;
use crate::pass::{PassContext, shade};
use ash::vk::{self, DescriptorType as D};

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
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    /// Of the `filter` pass.
    pub normals: &'a Image,
    pub factors: &'a Image,
    pub lobes: &'a Image,
    pub prefiltered: &'a Prefiltered,
    pub materials: &'a MaterialImages,
    pub fits: &'a Buffer,
    /// Exact ones, as [`check_lights`] says.
    pub lights: &'a Buffer,
    pub light_count: u32,
    /// Masks of them, in an array.
    pub shadows: vk::ImageView,
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
                .chain(shade::lobe_constants(config, kinds))
                .chain([u32::from(config.exact_lobes), kinds.models])
                .collect();
            ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)
        };
        Ok(Self([make(0, 0)?, make(0, 1)?, make(1, 1)?]))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.prefiltered.sampled(rec);
        io.materials.sampled(rec);
        rec.image(io.normals, Access::COMPUTE_SAMPLED);
        rec.image(io.factors, Access::COMPUTE_SAMPLED);
        rec.image(io.lobes, Access::COMPUTE_SAMPLED);
        rec.buffer(io.fits, Access::COMPUTE_READ);
        rec.overwrite(io.radiance, Access::COMPUTE_WRITE);
        rec.flush();
        let [first, second, irradiance, suns] = io.prefiltered.resources(io.samplers);
        let resources = [
            Resource::Uniform(io.frame),
            Resource::Sampled(io.normals, io.samplers.nearest),
            Resource::Sampled(io.factors, io.samplers.nearest),
            Resource::Buffer(io.lights),
            Resource::Storage(io.radiance.view),
            first,
            second,
            irradiance,
            suns,
            Resource::Sampled(io.lobes, io.samplers.nearest),
            Resource::Buffer(io.fits),
            Resource::View(io.shadows, io.samplers.nearest),
        ];
        let pipeline = &self.0[if io.light_count > 0 { 2 } else { usize::from(io.prefiltered.has_suns) }];
        pipeline.bind(rec, io.bridge, &resources, &());
        pipeline.dispatch(rec, io.normals.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.into_iter().for_each(|p| p.retire(bag));
    }
}
