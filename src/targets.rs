//! Images and buffers of the frame whose size follows from the extent.

use crate::config::Config;
use crate::error::Result;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::memory::Location;
use crate::gpu::recorder::States;
use crate::gpu::retire::{Build, Retired};
use crate::pass::allocate::AllocationBuffers;
use crate::pass::bandwidth::Prediction;
use crate::pass::gbuffer::GBufferImages;
use crate::pass::pyramid::Cells;
use crate::plan::{ARGUMENT_BYTES, Plan};
use ash::vk;

pub(crate) struct Targets {
    pub plan: Plan,
    pub gbuffer: Option<GBufferImages>,
    pub normals: Image,
    pub factors: Image,
    /// Of each sample, as `glsl/include/lobes.glsl` reads them.
    pub lobes: Image,
    /// In the place of the host's masks of lights, where it gives none; never read.
    pub unshadowed: Image,
    pub curvature: Option<Image>,
    /// The level of each sample, where the renderer itself writes it.
    pub level: Option<Image>,
    pub prediction: Option<Prediction>,
    /// The frame before's tiles and mean luminance, where they decide.
    pub luminance: Option<[Buffer; 2]>,
    pub cells: Option<CellBuffers>,
    /// Texels of the shading-rate attachment.
    pub rates: Option<Buffer>,
    pub radiance: Image,
    /// What is looked up, where `radiance` is what is left.
    pub base: Option<Image>,
    /// Radiance of odd levels.
    pub odd: Option<Image>,
    pub resolved: Image,
    /// Groups in x, y, z; number of listed samples.
    pub arguments: Buffer,
    /// Samples to shade.
    pub list: Buffer,
    pub allocation: Option<AllocationBuffers>,
}

/// Buffers over the cells of levels above the samples.
pub(crate) struct CellBuffers {
    cells: Buffer,
    blocks: Buffer,
    /// Parents' weights of the blocks' children.
    pub weights: Buffer,
    arguments: Buffer,
}

impl CellBuffers {
    fn new(build: &mut Build<'_>, plan: &Plan) -> Result<Self> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_SRC;
        let indirect = usage | vk::BufferUsageFlags::INDIRECT_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let [cells, blocks, weights, arguments] = plan.cell_buffers();
        let mut buffer = |(name, bytes), usage| Buffer::new(build, name, bytes, usage, Location::Device);
        Ok(Self {
            cells: buffer(cells, usage)?,
            blocks: buffer(blocks, usage)?,
            weights: buffer(weights, usage)?,
            arguments: buffer(arguments, indirect)?,
        })
    }

    pub fn cells(&self) -> Cells<'_> {
        Cells { cells: &self.cells, blocks: &self.blocks, arguments: &self.arguments }
    }
}

impl Targets {
    pub fn new(build: &mut Build<'_>, config: &Config) -> Result<Self> {
        let plan = Plan::of(config);
        let limit = u64::from(build.cx.limits.max_storage_buffer_range);
        if plan.largest_buffer() > limit {
            let samples = plan.list_bytes() / 4;
            let expected = format!("at most {} shading samples", samples * limit / plan.largest_buffer());
            return Err(crate::Error::invalid("Config::extent", expected, samples));
        }
        let (storage, source) = (vk::BufferUsageFlags::STORAGE_BUFFER, vk::BufferUsageFlags::TRANSFER_SRC);
        let arguments = storage | source | vk::BufferUsageFlags::INDIRECT_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        Ok(Self {
            gbuffer: plan.gbuffer.map(|images| GBufferImages::new(build, images)).transpose()?,
            normals: Image::new(build, plan.normals)?,
            factors: Image::new(build, plan.factors)?,
            lobes: Image::new(build, plan.lobes)?,
            unshadowed: Image::new(build, plan.unshadowed)?,
            curvature: plan.curvature.map(|desc| Image::new(build, desc)).transpose()?,
            level: plan.level.map(|desc| Image::new(build, desc)).transpose()?,
            prediction: plan.prediction.map(|desc| Prediction::new(build, desc)).transpose()?,
            luminance: plan
                .luminance_buffers(config)
                .map(|[tiles, mean]| {
                    let mut buffer = |(name, bytes)| Buffer::new(build, name, bytes, storage | source, Location::Device);
                    Ok::<_, crate::Error>([buffer(tiles)?, buffer(mean)?])
                })
                .transpose()?,
            cells: (plan.levels.top > 0).then(|| CellBuffers::new(build, &plan)).transpose()?,
            rates: plan
                .rate_bytes
                .map(|bytes| Buffer::new(build, "rates", bytes, storage | source, Location::Device))
                .transpose()?,
            radiance: Image::new(build, plan.radiance)?,
            base: plan.base.map(|desc| Image::new(build, desc)).transpose()?,
            odd: plan.odd.map(|desc| Image::new(build, desc)).transpose()?,
            resolved: Image::new(build, plan.resolved)?,
            arguments: Buffer::new(build, "arguments", ARGUMENT_BYTES, arguments, Location::Device)?,
            allocation: plan.allocated.then(|| AllocationBuffers::new(build, plan.allocation_buffers())).transpose()?,
            list: Buffer::new(build, "list", plan.list_bytes(), storage | source, Location::Device)?,
            plan,
        })
    }

    /// The renderer's own colour images by name.
    #[cfg(feature = "offline")]
    pub fn image(&self, name: &str) -> Option<&Image> {
        let gbuffer = self.gbuffer.as_ref().map(GBufferImages::colors);
        let prediction = self.prediction.as_ref().map(|p| &p.image);
        let own = [&self.curvature, &self.level, &self.base, &self.odd].into_iter().flatten().chain(prediction);
        let always = [&self.normals, &self.factors, &self.lobes, &self.radiance, &self.resolved];
        let all = gbuffer.into_iter().flatten().chain(own).chain(always);
        all.into_iter().find(|image| image.desc.name == name)
    }

    /// The renderer's own buffers by name.
    #[cfg(feature = "offline")]
    pub fn buffer(&self, name: &str) -> Option<&Buffer> {
        let cells = self.cells.as_ref();
        match name {
            "arguments" => Some(&self.arguments),
            "list" => Some(&self.list),
            "rates" => self.rates.as_ref(),
            "forecast" => self.prediction.as_ref().map(|p| &p.forecast),
            "cells" => cells.map(|c| &c.cells),
            "blocks" => cells.map(|c| &c.blocks),
            "weights" => cells.map(|c| &c.weights),
            "block arguments" => cells.map(|c| &c.arguments),
            _ => self.allocation.as_ref().and_then(|a| a.buffer(name)),
        }
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        let images = self.gbuffer.into_iter().flat_map(GBufferImages::into_images);
        let (prediction, predicted) = self.prediction.map(|p| (p.image, vec![p.forecast, p.blocks])).unzip();
        let own = [self.curvature, self.level, prediction, self.base, self.odd].into_iter().flatten();
        let always = [self.normals, self.factors, self.lobes, self.unshadowed, self.radiance, self.resolved];
        for image in images.chain(own).chain(always) {
            states.forget(image.handle);
            image.retire(bag);
        }
        let cells = self.cells.map(|c| vec![c.cells, c.blocks, c.weights, c.arguments]);
        let allocation = self.allocation.map(|a| Vec::from(a.into_buffers()));
        let optional = [cells, predicted, self.luminance.map(Vec::from), allocation].into_iter().flatten().flatten();
        for buffer in optional.chain(self.rates).chain([self.arguments, self.list]) {
            states.forget(buffer.handle);
            buffer.retire(bag);
        }
    }
}
