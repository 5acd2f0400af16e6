//! Pass 4: image bandwidth and level of every block of samples (Bagher 2011, sections 2.1 to 2.3, equations 3, 4 and 9, as
//! corrected in [`crate::frequency`]).

use crate::config::Config;
use crate::error::Result;
use crate::frequency::allocation::Allocation;
use crate::frequency::level::samples_per_cycle;
use crate::frequency::operators::{Combine, Operator};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::kinds::Kinds;
use crate::pass::environment::EnvironmentImages;
use crate::pass::materials::Bandwidths;
use crate::pass::surfaces::{Surfaces, lobe_constants};
use crate::pass::{PassContext, classify, level, pyramid};
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label, timer and AOV name.
pub const NAME: &str = "bandwidth";

/// Shader interface of the list of blocks.
pub const BLOCKS: Interface = Interface {
    name: "bandwidth.blocks",
    local_size: [8, 8, 1],
    push_bytes: size_of::<BlocksPush>() as u32,
    gbuffer: true,
    materials: false,
    own: &[D::UNIFORM_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER],
};

/// Shader interface of the prediction.
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
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_IMAGE,
        D::STORAGE_IMAGE,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
    ],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct BlocksPush {
    side: i32,
    stride: i32,
    all: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    side: i32,
    probes: i32,
    samples_per_cycle: f32,
    coarsest: i32,
    /// Whether only the blocks to look at first are predicted.
    early: u32,
    /// Where the list of all blocks begins.
    all: u32,
    /// Of this frame's environment.
    dark: f32,
}

/// One block in so many a side is looked at first, if it has a surface.
const STRIDE: u32 = 4;

/// Words of the forecast (`glsl/include/forecast.glsl`).
const FORECAST_WORDS: usize = 17;
/// Its bytes.
pub(crate) const FORECAST_BYTES: u64 = FORECAST_WORDS as u64 * 4;
/// Where the groups over the blocks to look at first begin.
const OF_FIRST: u64 = 48;
/// Where the groups of the pyramid begin.
pub(crate) const OF_CELLS: u64 = 16;
/// Where the groups of the list of all samples begin.
pub(crate) const OF_SAMPLES: u64 = 32;

/// Entries of the list of blocks before those of all blocks, of which there are `extent`: a block in [`STRIDE`] a side.
fn first_blocks(extent: [u32; 2]) -> u32 {
    extent[0].div_ceil(STRIDE) * extent[1].div_ceil(STRIDE)
}

/// Bytes of the list of blocks, of which there are `extent`.
pub(crate) fn list_bytes(extent: [u32; 2]) -> u64 {
    4 * (u64::from(first_blocks(extent)) + u64::from(extent[0]) * u64::from(extent[1]))
}

/// What the pass writes beside levels.
pub(crate) struct Prediction {
    /// Of each block: bandwidth in cycles/sample, the integrand's relative standard deviation and the logarithm to base 2 of the
    /// weight by which directions are shared out, 0 where all samples are shaded alike; 1. All 0 where nothing is predicted.
    pub image: Image,
    /// Which of the next passes run.
    pub forecast: Buffer,
    /// The blocks that are predicted.
    pub blocks: Buffer,
}

impl Prediction {
    pub fn new(build: &mut Build<'_>, desc: ImageDesc) -> Result<Self> {
        let list = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        let groups = list | vk::BufferUsageFlags::INDIRECT_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let [width, height, _] = desc.extent;
        Ok(Self {
            image: Image::new(build, desc)?,
            forecast: Buffer::new(build, "forecast", FORECAST_BYTES, groups, Location::Device)?,
            blocks: Buffer::new(build, "predicted", list_bytes([width, height]), list, Location::Device)?,
        })
    }
}

pub(crate) struct Io<'a> {
    pub surfaces: Surfaces<'a>,
    pub environment: &'a EnvironmentImages,
    /// Its bandwidth in cycles/radian.
    pub environment_bandwidth: &'a Image,
    /// How fast lobes of materials and textures vary.
    pub material_bandwidths: &'a Bandwidths,
    /// Out: the level of each sample, in levels over a sample; 0 where all samples are shaded.
    pub level: &'a Image,
    /// Radiance that is added to the mean where directions are shared out by relative deviation.
    pub dark: f32,
    /// Out.
    pub prediction: &'a Prediction,
}

/// The list of blocks; the prediction for frames without lights beside the environment and for frames with.
pub(crate) struct Bandwidth {
    blocks: ComputePipeline,
    pipelines: [ComputePipeline; 2],
    push: Push,
}

impl Bandwidth {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, kinds: Kinds) -> Result<Self> {
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
        let blocks = ComputePipeline::new(p.build, p.modules, &BLOCKS, p.bridge, p.slots, &[])?;
        let allocation = match config.allocation {
            Allocation::Constant => 0,
            Allocation::Equation8 => 1,
            Allocation::Deviation => 2,
            Allocation::RelativeDeviation => 3,
        };
        let mut make = |lights| {
            // One stands between these and those of lobes.
            let own = [operator, combine, u32::from(config.widened()), lights, allocation, 0];
            let constants: Vec<_> = own.into_iter().chain(lobe_constants(config, kinds)).collect();
            ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)
        };
        let rate = config.samples_per_cycle.unwrap_or(samples_per_cycle(config.directions_a_pixel()) as f32);
        let push = Push {
            side: config.block_side() as i32,
            probes: config.probes as i32,
            samples_per_cycle: rate,
            coarsest: config.coarsest() as i32,
            early: 0,
            all: 0,
            dark: 0.0,
        };
        Ok(Self { blocks, pipelines: [make(0)?, make(1)?], push })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let Prediction { image: prediction, forecast, blocks } = io.prediction;
        let s = &io.surfaces;
        rec.begin(NAME);
        io.environment.sampled(rec);
        s.sampled(rec);
        rec.image(io.environment_bandwidth, Access::COMPUTE_SAMPLED);
        rec.image(&io.material_bandwidths.lobes, Access::COMPUTE_SAMPLED);
        rec.buffer(&io.material_bandwidths.textures, Access::COMPUTE_READ);
        level::clear(rec, io.level, 0);
        level::clear(rec, prediction, 0);
        rec.image(io.level, Access::COMPUTE_WRITE);
        rec.image(prediction, Access::COMPUTE_WRITE);
        rec.buffer(forecast, Access::TRANSFER_WRITE);
        rec.flush();
        let cells = io.level.extent().map(|e| e.div_ceil(pyramid::TILE));
        let [_, across, stripes] = classify::groups_of_all(io.level.extent());
        let none = [0, 1, 1];
        let mut words = [0; FORECAST_WORDS];
        words[..3].copy_from_slice(&none);
        words[4..7].copy_from_slice(&[cells[0], cells[1], 1]);
        words[8..11].copy_from_slice(&[0, across, stripes]);
        words[12..15].copy_from_slice(&none);
        // SAFETY: the command buffer is recording outside a render pass; the buffer holds as much.
        unsafe { rec.cx.device.cmd_update_buffer(rec.cmd, forecast.handle, 0, bytemuck::bytes_of(&words)) };
        rec.buffer(forecast, Access::COMPUTE_ATOMIC);
        rec.buffer(blocks, Access::COMPUTE_WRITE);
        rec.flush();
        let all = first_blocks(prediction.extent());
        let found = [Resource::Uniform(s.frame), Resource::Buffer(forecast), Resource::Buffer(blocks)];
        self.blocks.bind(rec, s.bridge, &found, &BlocksPush { side: self.push.side, stride: STRIDE as i32, all });
        self.blocks.dispatch(rec, prediction.extent());
        rec.buffer(forecast, Access::INDIRECT);
        rec.flush();
        rec.buffer(forecast, Access::COMPUTE_ATOMIC);
        rec.buffer(blocks, Access::COMPUTE_READ);
        rec.flush();
        let resources = [
            Resource::Uniform(s.frame),
            Resource::Sampled(&io.environment.map, s.samplers.linear),
            Resource::Sampled(&io.environment.alias, s.samplers.nearest),
            Resource::Sampled(s.normals, s.samplers.nearest),
            Resource::Sampled(s.factors, s.samplers.nearest),
            Resource::Sampled(io.environment_bandwidth, s.samplers.nearest),
            Resource::Sampled(&io.material_bandwidths.lobes, s.samplers.nearest),
            Resource::Storage(io.level.view),
            Resource::Storage(prediction.view),
            Resource::Buffer(s.lights),
            Resource::Buffer(forecast),
            Resource::Buffer(blocks),
            Resource::Buffer(&io.material_bandwidths.textures),
            Resource::View(s.shadows, s.samplers.nearest),
            Resource::Sampled(s.lobes, s.samplers.nearest),
        ];
        let pipeline = &self.pipelines[usize::from(s.light_count > 0)];
        let push = Push { all, dark: io.dark, ..self.push };
        pipeline.bind(rec, s.bridge, &resources, &Push { early: 1, ..push });
        pipeline.dispatch_indirect(rec, forecast, OF_FIRST);
        // Where many samples are to be shaded, nothing follows: finding the others would take longer than they do.
        rec.buffer(forecast, Access::INDIRECT);
        rec.image(io.level, Access::COMPUTE_WRITE);
        rec.image(prediction, Access::COMPUTE_WRITE);
        rec.flush();
        // To the validation layer every dispatch of the module writes all that it binds.
        rec.buffer(forecast, Access::COMPUTE_ATOMIC);
        rec.flush();
        pipeline.push(rec, &push);
        pipeline.dispatch_indirect(rec, forecast, 0);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.blocks.retire(bag);
        self.pipelines.into_iter().for_each(|p| p.retire(bag));
    }
}
