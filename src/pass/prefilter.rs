//! Pass 0a, continued: the environment under lobes by concentration, its irradiance and its suns (Xu et al. 2017, section 4,
//! looks them up; [`crate::distribution::prefilter`] and [`crate::distribution::suns`] are the f64 twins).
//!
//! Level 0 is the map without its suns. Of it come grids of nearly square texels, each a mean of the finer one's; every further
//! level gathers the light under its lobe from the grid whose texels are half of its standard deviation or less, and none from
//! another level, so that no error adds up. All of it lies in one buffer, which is copied into an image with mips at the end.

use crate::distribution::prefilter::{Chain, SOURCE_WIDTH};
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::upload::BufferUpload;
use crate::pass::PassContext;
use crate::pass::suns::SunList;
use crate::sampling::LatLong;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, label and timer name.
pub const NAME: &str = "prefilter";

const fn interface(name: &'static str, push_bytes: usize, own: &'static [D]) -> Interface {
    Interface { name, local_size: [64, 1, 1], push_bytes: push_bytes as u32, gbuffer: false, materials: false, own }
}

const MAP: Interface =
    interface("prefilter_map", size_of::<MapPush>(), &[D::COMBINED_IMAGE_SAMPLER, D::STORAGE_BUFFER, D::STORAGE_BUFFER]);
const RINGS: Interface = interface("prefilter_rings", size_of::<RingsPush>(), &[D::STORAGE_BUFFER, D::STORAGE_BUFFER]);
const CONVOLVE: Interface = interface("prefilter_convolve", size_of::<ConvolvePush>(), &[D::STORAGE_BUFFER, D::STORAGE_BUFFER]);

/// Shader interfaces, in the order in which they run.
pub const INTERFACES: [Interface; 3] = [MAP, RINGS, CONVOLVE];

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct MapPush {
    width: i32,
    refine: i32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RingsPush {
    width: i32,
    from: i32,
    to: i32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ConvolvePush {
    width: i32,
    to: i32,
    source_width: i32,
    from: i32,
    kappa: f32,
    blurred: f32,
}

/// Columns of the irradiance, which is as smooth as a lobe of concentration 1.
const IRRADIANCE: Chain = Chain { width: 128 };
const TEXEL: u64 = 16;

/// What the shaders look up (`glsl/include/prefilter.glsl`).
pub(crate) struct Prefiltered {
    /// RGBA32F with mips: light by concentration, in two images.
    pub chain: [Image; 2],
    /// RGBA32F: irradiance.
    pub irradiance: Image,
    /// A `SunList`.
    pub suns: Buffer,
    /// Whether it holds any.
    pub has_suns: bool,
}

/// What one recording needs.
pub(crate) struct Work {
    chain: Chain,
    same_size: bool,
    refine: i32,
    /// Both of the chain, irradiance.
    images: [Image; 3],
    suns: BufferUpload,
    has_suns: bool,
    /// Texels of all levels of each, one after another.
    texels: Buffer,
    /// Grids of even and of odd levels.
    grids: [Buffer; 2],
    /// Of the pipelines map, rings (to even from the map; to odd, to even), convolve (from even, from odd).
    sets: [Sets; 3],
}

pub(crate) struct Io<'a> {
    /// RGBA32F radiance.
    pub map: &'a Image,
}

pub(crate) struct Prefilter {
    /// For maps of another size than level 0, and of the same.
    map: [ComputePipeline; 2],
    /// From grids, and from level 0.
    rings: [ComputePipeline; 2],
    /// Under a lobe, and a cosine.
    convolve: [ComputePipeline; 2],
}

/// Texels of the levels below `level`.
fn texels_below(chain: Chain, level: u32) -> u64 {
    (0..level).map(|l| chain.extent(l).map(u64::from).iter().product::<u64>()).sum()
}

/// The first texel of both images of the chain and of the irradiance, and the number of all texels.
fn starts(chain: Chain) -> [u64; 4] {
    let second = texels_below(chain, chain.levels());
    let irradiance = second + texels_below(chain, chain.levels() - 1);
    [0, second, irradiance, irradiance + texels_below(IRRADIANCE, 1)]
}

/// Bytes of what is looked up of an environment of `size`.
#[cfg(feature = "offline")]
pub(crate) fn bytes(size: [u32; 2]) -> u64 {
    let [.., end] = starts(Chain::of(size));
    end * TEXEL
}

/// The finest level of [`SOURCE_WIDTH`] columns, the last of which there is a grid.
fn grid_levels(chain: Chain) -> u32 {
    (chain.width / SOURCE_WIDTH).ilog2()
}

/// Texels of the grids of the levels below `level` in the same buffer: even levels share one, odd ones the other.
fn grids_below(chain: Chain, level: u32) -> u64 {
    let texels = |l: u32| u64::from(chain.width >> l).pow(2) / 2;
    (0..level).filter(|l| l % 2 == level % 2).map(texels).sum()
}

/// Variance of the tents through which the grid of level `level` was made, in its squared texels: 3/16 of each level's.
fn blurred(level: u32) -> f64 {
    0.25 * (1.0 - 0.25f64.powi(level as i32))
}

impl Prefilter {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        let mut make = |interface, constant| ComputePipeline::new(p.build, p.modules, interface, p.bridge, 0, &[constant]);
        Ok(Self {
            map: [make(&MAP, 0)?, make(&MAP, 1)?],
            rings: [make(&RINGS, 0)?, make(&RINGS, 1)?],
            convolve: [make(&CONVOLVE, 0)?, make(&CONVOLVE, 1)?],
        })
    }

    /// What the recording over `map`, uploaded as `image`, needs.
    pub fn prepare(&self, build: &mut Build<'_>, samplers: &Samplers, map: &LatLong, image: &Image) -> Result<Work> {
        let size = [map.width(), map.height()];
        let chain = Chain::of(size);
        let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
        let mut make = |name, [width, height]: [u32; 2], levels| {
            let desc = ImageDesc::new(name, vk::Format::R32G32B32A32_SFLOAT, [width, height, 1], usage);
            Image::new(build, ImageDesc { levels, ..desc })
        };
        let images = [
            make("environment prefiltered", chain.extent(0), chain.levels())?,
            make("environment prefiltered 2", chain.extent(0), chain.levels() - 1)?,
            make("environment irradiance", IRRADIANCE.extent(0), 1)?,
        ];
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let list = SunList::of(map, chain);
        let has_suns = list.has_suns();
        let suns = BufferUpload::new(build, "suns", storage, bytemuck::bytes_of(&list))?;
        let mut buffer = |name, texels, usage| Buffer::new(build, name, texels * TEXEL, usage, Location::Device);
        let [.., end] = starts(chain);
        let texels = buffer("prefiltered texels", end, storage | vk::BufferUsageFlags::TRANSFER_SRC)?;
        let last = grid_levels(chain);
        let even = buffer("even grids", grids_below(chain, (last / 2 + 1) * 2), storage)?;
        let odd = buffer("odd grids", grids_below(chain, last.div_ceil(2) * 2 + 1).max(1), storage)?;

        let sets = [self.map[0].sets(build, 1)?, self.rings[0].sets(build, 3)?, self.convolve[0].sets(build, 2)?];
        let device = &build.cx.device;
        let map_sources = [Resource::Sampled(image, samplers.nearest), Resource::Buffer(&suns.buffer), Resource::Buffer(&texels)];
        write_set(device, sets[0].sets[0], &map_sources);
        for (set, from, to) in [(0, &texels, &even), (1, &even, &odd), (2, &odd, &even)] {
            write_set(device, sets[1].sets[set], &[Resource::Buffer(from), Resource::Buffer(to)]);
        }
        for (set, from) in [&even, &odd].into_iter().enumerate() {
            write_set(device, sets[2].sets[set], &[Resource::Buffer(from), Resource::Buffer(&texels)]);
        }
        // Two points for each texel of the map that is finer, so that none is missed.
        let refine = 2 * size[0].div_ceil(chain.width).max(size[1].div_ceil(chain.width / 2)) as i32;
        let same_size = size == [chain.width, chain.width / 2];
        Ok(Work { chain, same_size, refine, images, suns, has_suns, texels, grids: [even, odd], sets })
    }

    /// Records it; what is not looked up goes into `bag`.
    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, work: Work, bag: &mut Retired) -> Prefiltered {
        let Work { chain, same_size, refine, images, suns, has_suns, texels, grids, sets } = work;
        rec.begin(NAME);
        let suns = suns.record(rec, bag);
        rec.image(io.map, Access::COMPUTE_SAMPLED);
        rec.buffer(&suns, Access::COMPUTE_READ);
        rec.buffer(&texels, Access::COMPUTE_WRITE);
        rec.flush();
        let map = &self.map[usize::from(same_size)];
        map.bind_set(rec, sets[0].sets[0], &MapPush { width: chain.width as i32, refine });
        map.dispatch(rec, chain.extent(0));

        let last = grid_levels(chain);
        for level in 0..=last {
            let width = chain.width >> level;
            let (from, to) = match level {
                0 => (&texels, &grids[0]),
                l => (&grids[(l as usize + 1) % 2], &grids[l as usize % 2]),
            };
            rec.buffer(from, Access::COMPUTE_READ);
            rec.buffer(to, Access::COMPUTE_WRITE);
            rec.flush();
            let set = if level == 0 { 0 } else { 2 - level as usize % 2 };
            let first = |level| grids_below(chain, level) as i32;
            let from = if level == 0 { 0 } else { first(level - 1) };
            let rings = &self.rings[usize::from(level == 0)];
            rings.bind_set(rec, sets[1].sets[set], &RingsPush { width: width as i32, from, to: first(level) });
            rings.dispatch(rec, [width, width / 2]);
        }

        // Levels are of different texels: nothing waits in between.
        grids.iter().for_each(|grid| rec.buffer(grid, Access::COMPUTE_READ));
        rec.buffer(&texels, Access::COMPUTE_WRITE);
        rec.flush();
        let convolve = |level: u32, to: u64, shape: Chain, kappa: Option<f64>, source: u32| {
            let [width, height] = shape.extent(level);
            let source = source.min(last);
            let push = ConvolvePush {
                width: width as i32,
                to: to as i32,
                source_width: (chain.width >> source) as i32,
                from: grids_below(chain, source) as i32,
                kappa: kappa.unwrap_or_default() as f32,
                blurred: blurred(source) as f32,
            };
            let pipeline = &self.convolve[usize::from(kappa.is_none())];
            pipeline.bind_set(rec, sets[2].sets[source as usize % 2], &push);
            pipeline.dispatch(rec, [width, height]);
        };
        let [first, second, irradiance, _] = starts(chain);
        for level in 1..chain.levels() {
            let kappa = chain.kappa(level);
            convolve(level, first + texels_below(chain, level), chain, Some(kappa), level - 1);
            convolve(level - 1, second + texels_below(chain, level - 1), chain, Some(2.0 * kappa), level - 1);
        }
        convolve(0, irradiance, IRRADIANCE, None, last);

        rec.buffer(&texels, Access::TRANSFER_READ);
        images.iter().for_each(|image| rec.overwrite(image, Access::TRANSFER_WRITE));
        rec.flush();
        for (image, first) in images.iter().zip([first, second, irradiance]) {
            copy(rec, &texels, first, image);
        }
        rec.end();

        for buffer in grids.into_iter().chain([texels]) {
            rec.forget(buffer.handle);
            buffer.retire(bag);
        }
        sets.into_iter().for_each(|sets| sets.retire(bag));
        let [first, second, irradiance] = images;
        Prefiltered { chain: [first, second], irradiance, suns, has_suns }
    }

    pub fn retire(self, bag: &mut Retired) {
        let Self { map, rings, convolve } = self;
        map.into_iter().chain(rings).chain(convolve).for_each(|pipeline| pipeline.retire(bag));
    }
}

/// Copies the levels of `image`, one behind another from texel `first` of `texels` on.
fn copy(rec: &Recorder<'_>, texels: &Buffer, first: u64, image: &Image) {
    let mut offset = first * TEXEL;
    let region = |mip_level| {
        let [width, height, depth] = image.desc.level_extent(mip_level);
        let region = vk::BufferImageCopy {
            buffer_offset: offset,
            image_subresource: vk::ImageSubresourceLayers {
                aspect_mask: image.desc.aspect(),
                mip_level,
                layer_count: 1,
                ..Default::default()
            },
            image_extent: vk::Extent3D { width, height, depth },
            ..Default::default()
        };
        offset += u64::from(width) * u64::from(height) * TEXEL;
        region
    };
    let regions: Vec<_> = (0..image.desc.levels).map(region).collect();
    let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    // SAFETY: the command buffer is recording; the buffer holds all levels.
    unsafe { rec.cx.device.cmd_copy_buffer_to_image(rec.cmd, texels.handle, image.handle, layout, &regions) };
}

impl Prefiltered {
    /// Declares all of it read by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        self.chain.iter().for_each(|image| rec.image(image, Access::COMPUTE_SAMPLED));
        rec.image(&self.irradiance, Access::COMPUTE_SAMPLED);
        rec.buffer(&self.suns, Access::COMPUTE_READ);
    }

    /// For the four bindings of `glsl/include/prefilter.glsl`.
    pub fn resources<'a>(&'a self, samplers: &Samplers) -> [Resource<'a>; 4] {
        let image = |image| Resource::Sampled(image, samplers.tiled);
        [image(&self.chain[0]), image(&self.chain[1]), image(&self.irradiance), Resource::Buffer(&self.suns)]
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        for image in self.chain.into_iter().chain([self.irradiance]) {
            states.forget(image.handle);
            image.retire(bag);
        }
        states.forget(self.suns.handle);
        self.suns.retire(bag);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_do_not_overlap() {
        for width in [64, 128, 1024, 2048] {
            let chain = Chain { width };
            let last = grid_levels(chain);
            assert_eq!(width >> last, SOURCE_WIDTH);
            for level in 2..=last {
                let finer = u64::from(width >> (level - 2)).pow(2) / 2;
                assert_eq!(grids_below(chain, level), grids_below(chain, level - 2) + finer);
            }
        }
    }
}
