//! Pass 4: image bandwidth and level of every block of samples (Bagher 2011, sections 2.1 to 2.3, equations 3, 4 and 9, as
//! corrected in [`crate::frequency`]).

use crate::config::Config;
use crate::error::Result;
use crate::frequency::allocation::Allocation;
use crate::frequency::level::samples_per_cycle;
use crate::frequency::operators::{Combine, Operator};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::environment::EnvironmentImages;
use crate::pass::materials::MaterialImages;
use crate::pass::{PassContext, level, pyramid};
use ash::vk::DescriptorType as D;
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label, timer and AOV name.
pub const NAME: &str = "bandwidth";

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
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_IMAGE,
        D::STORAGE_IMAGE,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
    ],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    side: i32,
    probes: i32,
    samples_per_cycle: f32,
    coarsest: i32,
    stride: i32,
    /// Groups across of the list of all samples, which only the forecast writes: extents change without the pass.
    full: u32,
    /// Of this frame's environment.
    dark: f32,
}

/// One block in so many a side is looked at first.
const STRIDE: u32 = 4;

/// Bytes of the forecast: groups in x, y, z of this pass, of the pyramid and of the list of all samples, each with a count.
pub(crate) const FORECAST_BYTES: u64 = 48;
/// Where the groups of the pyramid begin.
pub(crate) const OF_CELLS: u64 = 16;
/// Where the groups of the list of all samples begin.
pub(crate) const OF_SAMPLES: u64 = 32;

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    pub environment: &'a EnvironmentImages,
    /// Its bandwidth in cycles/radian.
    pub environment_bandwidth: &'a Image,
    pub materials: &'a MaterialImages,
    /// Their lobes' bandwidths in cycles/radian.
    pub lobe_bandwidth: &'a Image,
    /// Of the `filter` pass.
    pub normals: &'a Image,
    pub factors: &'a Image,
    /// Exact lights first.
    pub lights: &'a Buffer,
    pub light_count: u32,
    /// Out: the level of each sample, in levels over a sample; 0 where all samples are shaded.
    pub level: &'a Image,
    /// Radiance that is added to the mean where directions are shared out by relative deviation.
    pub dark: f32,
    /// Out: of each block, bandwidth in cycles/sample, the integrand's relative standard deviation and the logarithm to base 2 of
    /// the weight by which directions are shared out; 0 where all samples are shaded alike.
    pub prediction: &'a Image,
    /// Out: which of the next passes run.
    pub forecast: &'a Buffer,
}

/// One pipeline for frames without lights beside the environment, one for frames with.
pub(crate) struct Bandwidth {
    pipelines: [ComputePipeline; 2],
    push: Push,
}

impl Bandwidth {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config) -> Result<Self> {
        let operator = match config.operator {
            Operator::Box => 0,
            Operator::Clipped => 1,
            Operator::Covariance => 2,
        };
        let combine = match config.combine {
            Combine::Mean => 0,
            Combine::Max => 1,
            Combine::Literal => 2,
        };
        let allocation = match config.allocation {
            Allocation::Constant => 0,
            Allocation::Equation8 => 1,
            Allocation::Deviation => 2,
            Allocation::RelativeDeviation => 3,
        };
        let mut make = |lights| {
            let constants = [operator, combine, u32::from(config.widened()), lights, allocation];
            ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)
        };
        let rate = config.samples_per_cycle.unwrap_or(samples_per_cycle(config.directions) as f32);
        let push = Push {
            side: config.block_side() as i32,
            probes: config.probes as i32,
            samples_per_cycle: rate,
            coarsest: config.coarsest() as i32,
            stride: 1,
            full: 0,
            dark: 0.0,
        };
        Ok(Self { pipelines: [make(0)?, make(1)?], push })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.environment.sampled(rec);
        io.materials.sampled(rec);
        rec.image(io.environment_bandwidth, Access::COMPUTE_SAMPLED);
        rec.image(io.lobe_bandwidth, Access::COMPUTE_SAMPLED);
        rec.image(io.normals, Access::COMPUTE_SAMPLED);
        rec.image(io.factors, Access::COMPUTE_SAMPLED);
        level::clear(rec, io.level, 0);
        level::clear(rec, io.prediction, 0);
        rec.image(io.level, Access::COMPUTE_WRITE);
        rec.image(io.prediction, Access::COMPUTE_WRITE);
        rec.buffer(io.forecast, Access::TRANSFER_WRITE);
        rec.flush();
        let groups = |extent: [u32; 2], of: u32| extent.map(|e| e.div_ceil(of));
        let [blocks, cells] = [groups(io.prediction.extent(), 8), groups(io.level.extent(), pyramid::TILE)];
        let all = [blocks[0], blocks[1], 1, 0, cells[0], cells[1], 1, 0, 0, io.level.extent()[1].div_ceil(8), 1, 0];
        let all: [u32; FORECAST_BYTES as usize / 4] = all;
        // SAFETY: the command buffer is recording outside a render pass; the buffer holds as much.
        unsafe { rec.cx.device.cmd_update_buffer(rec.cmd, io.forecast.handle, 0, bytemuck::bytes_of(&all)) };
        rec.buffer(io.forecast, Access::COMPUTE_ATOMIC);
        rec.flush();
        let resources = [
            Resource::Uniform(io.frame),
            Resource::Sampled(&io.environment.map, io.samplers.linear),
            Resource::Sampled(&io.environment.alias, io.samplers.nearest),
            Resource::Sampled(io.normals, io.samplers.nearest),
            Resource::Sampled(io.factors, io.samplers.nearest),
            Resource::Sampled(io.environment_bandwidth, io.samplers.nearest),
            Resource::Sampled(io.lobe_bandwidth, io.samplers.nearest),
            Resource::Storage(io.level.view),
            Resource::Storage(io.prediction.view),
            Resource::Buffer(io.lights),
            Resource::Buffer(io.forecast),
        ];
        let pipeline = &self.pipelines[usize::from(io.light_count > 0)];
        pipeline.bind(
            rec,
            io.bridge,
            &resources,
            &Push { stride: STRIDE as i32, full: groups(io.level.extent(), 8)[0], dark: io.dark, ..self.push },
        );
        pipeline.dispatch(rec, groups(io.prediction.extent(), STRIDE));
        // Where many samples are to be shaded, nothing follows: finding the others would take longer than they do.
        rec.buffer(io.forecast, Access::INDIRECT);
        rec.image(io.level, Access::COMPUTE_WRITE);
        rec.image(io.prediction, Access::COMPUTE_WRITE);
        rec.flush();
        // To the validation layer every dispatch of the module writes all that it binds.
        rec.buffer(io.forecast, Access::COMPUTE_ATOMIC);
        rec.flush();
        pipeline.push(rec, &Push { dark: io.dark, ..self.push });
        pipeline.dispatch_indirect(rec, io.forecast, 0);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipelines.into_iter().for_each(|p| p.retire(bag));
    }
}
