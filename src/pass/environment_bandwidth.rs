//! Pass 0a, continued: how fast the environment varies around each direction, by wavelets (Bagher et al. 2011, section 2.4 and
//! appendix A; [`crate::frequency::environment`] is the f64 twin).
//!
//! Luminance on a grid, one dispatch a level of the transform, the details that cover each block, one frequency a 2x2 block.

use crate::error::Result;
use crate::frequency::environment::{analysed, scale};
use crate::frequency::wavelet::bias;
use crate::gpu::access::Access;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use crate::sampling::LatLong;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, label and timer name.
pub const NAME: &str = "environment_bandwidth";

const fn interface(name: &'static str, push_bytes: usize, own: &'static [D]) -> Interface {
    Interface { name, local_size: [8, 8, 1], push_bytes: push_bytes as u32, gbuffer: false, materials: false, own }
}

const LUMINANCE: Interface =
    interface("environment_bandwidth_luminance", size_of::<f32>(), &[D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE]);
const LEVEL: Interface = interface(
    "environment_bandwidth_level",
    size_of::<LevelPush>(),
    &[D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE, D::STORAGE_IMAGE],
);
const SPREAD: Interface =
    interface("environment_bandwidth_spread", size_of::<SpreadPush>(), &[D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE]);
const TEXEL: Interface = interface(
    "environment_bandwidth_texel",
    size_of::<TexelPush>(),
    &[D::COMBINED_IMAGE_SAMPLER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE],
);

/// Shader interfaces, in the order in which they run.
pub const INTERFACES: [Interface; 4] = [LUMINANCE, LEVEL, SPREAD, TEXEL];

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LevelPush {
    size: [i32; 2],
    place: [i32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SpreadPush {
    count: [i32; 2],
    place: [i32; 2],
    rows: i32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct TexelPush {
    size: [i32; 2],
    levels: i32,
    eps: f32,
    bias: f32,
}

pub(crate) struct Io<'a> {
    /// RGBA32F radiance.
    pub map: &'a Image,
}

/// The images and sets of one recording, which another may follow before it has run.
pub(crate) struct Work {
    scale: f32,
    same_size: bool,
    luminance: Image,
    averages: [Image; 2],
    details: Image,
    covering: Image,
    bandwidth: Image,
    /// Of the pipelines luminance, level (first, from one average to the other, back), spread, texel.
    sets: [Sets; 4],
}

pub(crate) struct EnvironmentBandwidth {
    /// For maps of another size than is analysed, and of the same.
    luminance: [ComputePipeline; 2],
    /// For further levels, and the first.
    level: [ComputePipeline; 2],
    spread: ComputePipeline,
    texel: ComputePipeline,
    eps: f64,
}

impl EnvironmentBandwidth {
    /// Details below `eps` of the largest do not count.
    pub fn new(p: &mut PassContext<'_, '_>, eps: f64) -> Result<Self> {
        let mut make = |interface, constants: &[u32]| ComputePipeline::new(p.build, p.modules, interface, p.bridge, 0, constants);
        Ok(Self {
            luminance: [make(&LUMINANCE, &[0])?, make(&LUMINANCE, &[1])?],
            level: [make(&LEVEL, &[0])?, make(&LEVEL, &[1])?],
            spread: make(&SPREAD, &[])?,
            texel: make(&TEXEL, &[])?,
            eps,
        })
    }

    /// What the recording over `map`, uploaded as `image`, needs.
    pub fn prepare(&self, build: &mut Build<'_>, samplers: &Samplers, map: &LatLong, image: &Image) -> Result<Work> {
        let [width, height] = analysed([map.width(), map.height()]);
        let mut make = |name, format, [width, height]: [u32; 2]| {
            let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
            Image::new(build, ImageDesc::new(name, format, [width.max(1), height.max(1), 1], usage))
        };
        let (float, pair) = (vk::Format::R32_SFLOAT, vk::Format::R16G16B16A16_SFLOAT);
        let luminance = make("environment luminance", float, [width, height])?;
        let averages = [make("averages", float, [width / 2, height])?, make("averages", float, [width / 4, height / 2])?];
        let atlas = [width / 2 + (width / 4).max(1), height];
        let details = make("details", pair, atlas)?;
        let covering = make("covering details", pair, atlas)?;
        let bandwidth = make("environment bandwidth", float, [width / 2, height / 2])?;

        let sets = [
            self.luminance[0].sets(build, 1)?,
            self.level[0].sets(build, 3)?,
            self.spread.sets(build, 1)?,
            self.texel.sets(build, 1)?,
        ];
        let read = |image| Resource::Sampled(image, samplers.nearest);
        let write = |image: &Image| Resource::Storage(image.view);
        let [a, b] = &averages;
        let device = &build.cx.device;
        write_set(device, sets[0].sets[0], &[read(image), write(&luminance)]);
        for (set, from, to) in [(0, &luminance, a), (1, a, b), (2, b, a)] {
            write_set(device, sets[1].sets[set], &[read(from), write(to), write(&details)]);
        }
        write_set(device, sets[2].sets[0], &[read(&details), write(&covering)]);
        write_set(device, sets[3].sets[0], &[read(&details), read(&covering), write(&bandwidth)]);
        let same_size = [width, height] == [map.width(), map.height()];
        Ok(Work { scale: scale(map) as f32, same_size, luminance, averages, details, covering, bandwidth, sets })
    }

    /// Records the analysis; all but the image of cycles/radian (R32F, a value a 2x2 block) goes into `bag`.
    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, work: Work, bag: &mut Retired) -> Image {
        let [width, height] = work.luminance.extent();
        // Of the torus.
        let size = |h: u32| [(width >> h) as i32, ((2 * height) >> h) as i32];
        let place = |h: u32| if h == 1 { [0, 0] } else { [(width / 2) as i32, height as i32 - size(h - 1)[1]] };
        let levels = width.min(2 * height).ilog2();
        let unsigned = |[x, y]: [i32; 2]| [x as u32, y as u32];

        rec.begin(NAME);
        rec.image(io.map, Access::COMPUTE_SAMPLED);
        rec.overwrite(&work.luminance, Access::COMPUTE_WRITE);
        rec.flush();
        let luminance = &self.luminance[usize::from(work.same_size)];
        luminance.bind_set(rec, work.sets[0].sets[0], &work.scale);
        luminance.dispatch(rec, [width, height]);

        for h in 1..=levels {
            let (from, to) = match h {
                1 => (&work.luminance, &work.averages[0]),
                h => (&work.averages[h as usize % 2], &work.averages[(h as usize + 1) % 2]),
            };
            rec.image(from, Access::COMPUTE_SAMPLED);
            rec.overwrite(to, Access::COMPUTE_WRITE);
            rec.image(&work.details, Access::COMPUTE_WRITE);
            rec.flush();
            let set = if h == 1 { 0 } else { 1 + h as usize % 2 };
            let pipeline = &self.level[usize::from(h == 1)];
            pipeline.bind_set(rec, work.sets[1].sets[set], &LevelPush { size: size(h - 1), place: place(h) });
            // An invocation does two columns and four rows.
            let [x, y] = unsigned(size(h));
            pipeline.dispatch(rec, [x.div_ceil(2), y.div_ceil(4)]);
        }

        rec.image(&work.details, Access::COMPUTE_SAMPLED);
        rec.overwrite(&work.covering, Access::COMPUTE_WRITE);
        rec.flush();
        for h in 2..=levels {
            let [columns, rows] = size(h);
            let push = SpreadPush { count: [columns, rows], place: place(h), rows: (rows / 2).max(1) };
            self.spread.bind_set(rec, work.sets[2].sets[0], &push);
            self.spread.dispatch(rec, unsigned([columns, push.rows]));
        }

        rec.image(&work.covering, Access::COMPUTE_SAMPLED);
        rec.overwrite(&work.bandwidth, Access::COMPUTE_WRITE);
        rec.flush();
        let size = [width as i32, height as i32];
        let push = TexelPush { size, levels: levels as i32, eps: self.eps as f32, bias: bias(self.eps) as f32 };
        self.texel.bind_set(rec, work.sets[3].sets[0], &push);
        self.texel.dispatch(rec, [width.div_ceil(4), height.div_ceil(4)]);
        rec.end();

        let [a, b] = work.averages;
        for image in [work.luminance, a, b, work.details, work.covering] {
            rec.forget(image.handle);
            image.retire(bag);
        }
        work.sets.into_iter().for_each(|sets| sets.retire(bag));
        work.bandwidth
    }

    pub fn retire(self, bag: &mut Retired) {
        let all = self.luminance.into_iter().chain(self.level).chain([self.spread, self.texel]);
        all.for_each(|pipeline| pipeline.retire(bag));
    }
}
