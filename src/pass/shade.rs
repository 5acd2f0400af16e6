//! Pass 8: reflected radiance of the listed samples (Bagher 2011, equations 1 and 2, section 3.3).

use crate::config::{Config, Estimator};
use crate::error::Result;
use crate::frequency::allocation::Allocation;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::kinds::Kinds;
use crate::light::Light;
use crate::pass::PassContext;
use crate::pass::environment::EnvironmentImages;
use crate::pass::surfaces::{Surfaces, lobe_constants};
use crate::plan::Directions;
use ash::vk::DescriptorType as D;
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "shade";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [64, 1, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: true,
    materials: true,
    own: &[
        D::UNIFORM_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::STORAGE_IMAGE,
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

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    /// Of a sample that stands for a pixel or more.
    brdf_samples: u32,
    environment_samples: u32,
    light_samples: u32,
    offset: f32,
    negligible: f32,
}

pub(crate) struct Io<'a> {
    pub surfaces: Surfaces<'a>,
    pub environment: &'a EnvironmentImages,
    pub arguments: &'a Buffer,
    /// Of `classify`, or of `allocate` where samples have numbers of directions of their own.
    pub list: &'a Buffer,
    pub directions: Directions,
    pub residual: Option<Residual<'a>>,
    /// Out: linear radiance where listed.
    pub radiance: &'a Image,
    /// Out, where samples stand for cells: that of odd levels.
    pub odd: Option<&'a Image>,
}

/// What a residual is found against.
#[derive(Clone, Copy)]
pub(crate) struct Residual<'a> {
    /// Of the `base` pass.
    pub base: &'a Image,
    pub fits: &'a Buffer,
    /// Of the pre-convolved light.
    pub suns: &'a Buffer,
    /// On both sides of a factor on it, in radiance.
    pub offset: f32,
}

/// One pipeline for frames without lights beside the environment, one for frames with.
pub(crate) struct Shade {
    pipelines: [ComputePipeline; 2],
    /// Error of a fit up to which nothing is estimated.
    negligible: f32,
}

/// What is added on both sides of a factor on light that is looked up, so that factors stay small where there is little of it beside
/// what is not: of the environment, of mean luminance `mean`, a little, as the base has most of it; of area lights all.
pub(crate) fn offset(mean: f64, lights: &[Light]) -> f32 {
    const LITTLE: f64 = 0.02;
    lights.iter().map(Light::sampled_radiance).sum::<f32>() + (LITTLE * mean).max(1e-6) as f32
}

impl Shade {
    /// `levelled` says whether entries of the list stand for cells of levels.
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, levelled: bool, kinds: Kinds) -> Result<Self> {
        let constant = match config.estimator {
            Estimator::Mis | Estimator::Preconvolved => 0,
            Estimator::Brdf => 1,
            Estimator::BrdfRandom => 2,
            Estimator::Lookup => 3,
            Estimator::Cv | Estimator::Residual => 4,
        };
        let ratio = config.residual_is_factor();
        let mut make = |lights| {
            let allocated = u32::from(config.allocation != Allocation::Constant);
            let (levelled, widened) = (u32::from(levelled), u32::from(config.widened()));
            let own = [constant, lights, levelled, widened, config.sharing_levels(), allocated];
            let constants: Vec<_> = own
                .into_iter()
                .chain(lobe_constants(config, kinds))
                .chain([
                    kinds.most_lobes,
                    u32::from(ratio),
                    u32::from(config.exact_lobes),
                    u32::from(!config.estimator.combines()),
                    (1.0 - config.reflectance_share).to_bits(),
                ])
                .collect();
            ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)
        };
        // Unbiased with all of it.
        let negligible = if ratio { config.residual_errors[0] } else { -1.0 };
        Ok(Self { pipelines: [make(0)?, make(1)?], negligible })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let s = &io.surfaces;
        rec.begin(NAME);
        io.environment.sampled(rec);
        s.sampled(rec);
        rec.buffer(io.arguments, Access::INDIRECT);
        rec.buffer(io.arguments, Access::COMPUTE_READ);
        rec.buffer(io.list, Access::COMPUTE_READ);
        rec.overwrite(io.radiance, Access::COMPUTE_WRITE);
        if let Some(Residual { base, fits, suns, .. }) = io.residual {
            rec.image(base, Access::COMPUTE_SAMPLED);
            [fits, suns].into_iter().for_each(|buffer| rec.buffer(buffer, Access::COMPUTE_READ));
        }
        if let Some(odd) = io.odd {
            rec.overwrite(odd, Access::COMPUTE_WRITE);
        }
        rec.flush();
        let resources = [
            Resource::Uniform(s.frame),
            Resource::Sampled(io.environment.drawn(), s.samplers.linear),
            Resource::Sampled(&io.environment.alias, s.samplers.nearest),
            Resource::Buffer(io.arguments),
            Resource::Buffer(io.list),
            Resource::Storage(io.radiance.view),
            Resource::Buffer(s.lights),
            Resource::Storage(io.odd.unwrap_or(io.radiance).view),
            Resource::Sampled(s.normals, s.samplers.nearest),
            Resource::Sampled(s.factors, s.samplers.nearest),
            Resource::Sampled(s.lobes, s.samplers.nearest),
            // Bound to something where there are none.
            Resource::Buffer(io.residual.map_or(s.lights, |r| r.fits)),
            Resource::Sampled(io.residual.map_or(s.normals, |r| r.base), s.samplers.nearest),
            Resource::Buffer(io.residual.map_or(s.lights, |r| r.suns)),
            Resource::View(s.shadows, s.samplers.nearest),
        ];
        let Directions { brdf, environment, light } = io.directions;
        let offset = io.residual.map_or(0.0, |r| r.offset);
        let push = Push {
            brdf_samples: brdf,
            environment_samples: environment,
            light_samples: light,
            offset,
            // What area lights shine is in no fit.
            negligible: if light > 0 { -1.0 } else { self.negligible },
        };
        let pipeline = &self.pipelines[usize::from(s.light_count > 0)];
        pipeline.bind(rec, s.bridge, &resources, &push);
        pipeline.dispatch_indirect(rec, io.arguments, 0);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipelines.into_iter().for_each(|p| p.retire(bag));
    }
}
