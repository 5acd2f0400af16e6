//! Pass 4 of [`crate::Rate::Luminance`]: levels by the contrast of the frame before, as shipped image-based variable-rate shading
//! has them (Yang et al. 2019; [`crate::frequency::luminance`] is the f64 twin).
//!
//! Contrast of each tile, the mean over the image, the level of each sample.

use crate::error::Result;
use crate::frequency::luminance::TILE;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use ash::vk::DescriptorType as D;

/// Pass, label and timer name.
pub const NAME: &str = "luminance";

const fn interface(name: &'static str, local_size: [u32; 3], own: &'static [D]) -> Interface {
    Interface { name, local_size, push_bytes: 0, gbuffer: false, materials: false, own }
}

/// Shader interfaces, in the order in which they run.
pub const INTERFACES: [Interface; 3] = [
    interface("luminance_tiles", [8, 8, 1], &[D::UNIFORM_BUFFER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_BUFFER]),
    interface("luminance_mean", [64, 1, 1], &[D::UNIFORM_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER]),
    interface("luminance_levels", [8, 8, 1], &[D::UNIFORM_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER, D::STORAGE_IMAGE]),
];

/// Bytes of a tile: mean luminance, error, sum of luminance, coverage.
pub(crate) const TILE_BYTES: u64 = 16;
/// Bytes of the image's mean luminance.
pub(crate) const MEAN_BYTES: u64 = 4;

/// Tiles across and down an output of `extent` pixels.
pub(crate) fn tiles(extent: [u32; 2]) -> [u32; 2] {
    extent.map(|e| e.div_ceil(TILE as u32))
}

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub samplers: &'a Samplers,
    /// Output pixels of the frame before: linear radiance; alpha is coverage.
    pub previous: &'a Image,
    pub tiles: &'a Buffer,
    pub mean: &'a Buffer,
    /// Out: the level of each sample, in levels over a sample.
    pub level: &'a Image,
}

pub(crate) struct Luminance([ComputePipeline; 3]);

impl Luminance {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        let mut make = |i: usize| ComputePipeline::new(p.build, p.modules, &INTERFACES[i], p.bridge, p.slots, &[]);
        Ok(Self([make(0)?, make(1)?, make(2)?]))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let [tiles_of, mean_of, levels_of] = &self.0;
        let none = BridgeSets::NONE;
        rec.begin(NAME);
        rec.image(io.previous, Access::COMPUTE_SAMPLED);
        rec.buffer(io.tiles, Access::COMPUTE_WRITE);
        rec.flush();
        let previous = Resource::Sampled(io.previous, io.samplers.nearest);
        tiles_of.bind(rec, none, &[Resource::Uniform(io.frame), previous, Resource::Buffer(io.tiles)], &());
        tiles_of.dispatch(rec, tiles(io.previous.extent()));

        rec.buffer(io.tiles, Access::COMPUTE_READ);
        rec.buffer(io.mean, Access::COMPUTE_WRITE);
        rec.flush();
        let buffers = [Resource::Uniform(io.frame), Resource::Buffer(io.tiles), Resource::Buffer(io.mean)];
        mean_of.bind(rec, none, &buffers, &());
        mean_of.dispatch(rec, [1, 1]);

        rec.buffer(io.mean, Access::COMPUTE_READ);
        rec.overwrite(io.level, Access::COMPUTE_WRITE);
        rec.flush();
        let [frame, tiles, mean] = buffers;
        levels_of.bind(rec, none, &[frame, tiles, mean, Resource::Storage(io.level.view)], &());
        levels_of.dispatch(rec, io.level.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.into_iter().for_each(|p| p.retire(bag));
    }
}
