//! Pass 8: reflected radiance of the listed samples (Bagher 2011, equations 1 and 2, section 3.3).

use crate::config::{Config, Estimator};
use crate::distribution::Filter;
use crate::error::Result;
use crate::frequency::allocation::Allocation;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use crate::pass::environment::EnvironmentImages;
use crate::pass::materials::MaterialImages;
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
    ],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    /// Of a sample that stands for a pixel or more.
    brdf_samples: u32,
    environment_samples: u32,
    light_samples: u32,
}

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    /// Of the `filter` pass.
    pub normals: &'a Image,
    pub factors: &'a Image,
    pub lobes: &'a Image,
    pub environment: &'a EnvironmentImages,
    pub materials: &'a MaterialImages,
    pub arguments: &'a Buffer,
    /// Of `classify`, or of `allocate` where samples have numbers of directions of their own.
    pub list: &'a Buffer,
    /// Exact lights first.
    pub lights: &'a Buffer,
    pub light_count: u32,
    pub directions: Directions,
    /// Out: linear radiance where listed.
    pub radiance: &'a Image,
    /// Out, where samples stand for cells: that of odd levels.
    pub odd: Option<&'a Image>,
}

/// One pipeline for frames without lights beside the environment, one for frames with.
pub(crate) struct Shade {
    /// For materials of which the filter finds all lobes.
    all: Option<[ComputePipeline; 2]>,
    others: [ComputePipeline; 2],
}

/// Constants of `glsl/include/lobes.glsl`, and whether there are materials whose lobes the filter does not find.
pub(crate) fn lobe_constants(config: &Config, unfiltered: bool) -> [u32; 6] {
    let layers = config.filter.lobe_layers();
    let slopes = config.filter.has_slopes();
    let smith = config.filter == Filter::Leadr;
    let elliptic = config.filter.is_elliptic();
    [layers.max(1), u32::from(layers > 0), u32::from(slopes), u32::from(smith), u32::from(unfiltered), u32::from(elliptic)]
}

impl Shade {
    /// `levelled` says whether entries of the list stand for cells of levels.
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, levelled: bool) -> Result<Self> {
        let constant = match config.estimator {
            Estimator::Mis | Estimator::Preconvolved => 0,
            Estimator::Brdf => 1,
            Estimator::BrdfRandom => 2,
            Estimator::Lookup => 3,
        };
        let mut make = |lights, unfiltered| {
            let allocated = u32::from(config.allocation != Allocation::Constant);
            let (levelled, widened) = (u32::from(levelled), u32::from(config.widened()));
            let own = [constant, lights, levelled, widened, config.sharing_levels(), allocated];
            let constants: Vec<_> = own.into_iter().chain(lobe_constants(config, unfiltered)).collect();
            ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)
        };
        let mut both = |unfiltered| -> Result<_> { Ok([make(0, unfiltered)?, make(1, unfiltered)?]) };
        let others = both(true)?;
        Ok(Self { others, all: if config.filter.lobe_layers() > 0 { Some(both(false)?) } else { None } })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.environment.sampled(rec);
        io.materials.sampled(rec);
        rec.image(io.normals, Access::COMPUTE_SAMPLED);
        rec.image(io.factors, Access::COMPUTE_SAMPLED);
        rec.image(io.lobes, Access::COMPUTE_SAMPLED);
        rec.buffer(io.arguments, Access::INDIRECT);
        rec.buffer(io.arguments, Access::COMPUTE_READ);
        rec.buffer(io.list, Access::COMPUTE_READ);
        rec.overwrite(io.radiance, Access::COMPUTE_WRITE);
        if let Some(odd) = io.odd {
            rec.overwrite(odd, Access::COMPUTE_WRITE);
        }
        rec.flush();
        let resources = [
            Resource::Uniform(io.frame),
            Resource::Sampled(&io.environment.map, io.samplers.linear),
            Resource::Sampled(&io.environment.alias, io.samplers.nearest),
            Resource::Buffer(io.arguments),
            Resource::Buffer(io.list),
            Resource::Storage(io.radiance.view),
            Resource::Buffer(io.lights),
            Resource::Storage(io.odd.unwrap_or(io.radiance).view),
            Resource::Sampled(io.normals, io.samplers.nearest),
            Resource::Sampled(io.factors, io.samplers.nearest),
            Resource::Sampled(io.lobes, io.samplers.nearest),
        ];
        let Directions { brdf, environment, light } = io.directions;
        let push = Push { brdf_samples: brdf, environment_samples: environment, light_samples: light };
        let pipelines = self.all.as_ref().filter(|_| !io.materials.maps.unfiltered).unwrap_or(&self.others);
        let pipeline = &pipelines[usize::from(io.light_count > 0)];
        pipeline.bind(rec, io.bridge, &resources, &push);
        pipeline.dispatch_indirect(rec, io.arguments, 0);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.all.into_iter().chain([self.others]).flatten().for_each(|p| p.retire(bag));
    }
}
