//! Pass 5, continued: the level as a shading-rate attachment, for hosts that shade with the hardware's rate
//! (`VK_KHR_fragment_shading_rate`).

use crate::config::{Config, ShadingRate};
use crate::error::{Error, Result};
use crate::gpu::access::{Access, ImageRef};
use crate::gpu::buffer::Buffer;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::pass::PassContext;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "shading_rate";

/// Format of the host's image.
pub const FORMAT: vk::Format = vk::Format::R8_UINT;

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: true,
    materials: false,
    own: &[D::UNIFORM_BUFFER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_BUFFER],
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    texel: [i32; 2],
    words: i32,
    finer: i32,
    coarsest: i32,
}

/// Texels across and down an output of `extent` pixels.
pub(crate) fn texels(rate: ShadingRate, extent: [u32; 2]) -> [u32; 2] {
    [0, 1].map(|axis| extent[axis].div_ceil(rate.texel[axis].max(1)))
}

/// Words of a row of `texels` texels.
pub(crate) fn words(texels: u32) -> u32 {
    texels.div_ceil(4)
}

/// Bytes of the buffer for an output of `extent` pixels.
pub(crate) fn bytes(rate: ShadingRate, extent: [u32; 2]) -> u64 {
    let [across, down] = texels(rate, extent);
    4 * u64::from(words(across)) * u64::from(down)
}

/// Refuses an image that is not of `rate` over `extent` pixels.
pub(crate) fn check(image: &ImageRef, rate: Option<ShadingRate>, extent: [u32; 2]) -> Result<()> {
    let Some(rate) = rate else {
        return Err(Error::invalid("shading_rate", "none, as the configuration has none", "an image"));
    };
    let (expected, got) = ((FORMAT, texels(rate, extent)), (image.format, image.extent));
    if got == expected { Ok(()) } else { Err(Error::invalid("shading_rate", format!("{expected:?}"), format!("{got:?}"))) }
}

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    /// The level of each sample, readable by compute shaders, and a sampler for it.
    pub level: (vk::ImageView, vk::Sampler),
    /// Output pixels.
    pub extent: [u32; 2],
    /// Out: a byte a texel, in rows of whole words.
    pub rates: &'a Buffer,
    /// Out: the host's.
    pub target: Option<&'a ImageRef>,
}

pub(crate) struct RatePass {
    pipeline: ComputePipeline,
    rate: ShadingRate,
    side: u32,
}

impl RatePass {
    /// Rates as coarse as `rate` and the levels of `config` are.
    pub fn new(p: &mut PassContext<'_, '_>, rate: ShadingRate, config: &Config) -> Result<Self> {
        let side = config.samples_per_side;
        let rate = ShadingRate { coarsest: rate.coarsest.min(config.coarsest().saturating_sub(side.ilog2())), ..rate };
        let pipeline = ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &[])?;
        Ok(Self { pipeline, rate, side })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let [across, down] = texels(self.rate, io.extent);
        let row = words(across);
        rec.begin(NAME);
        rec.buffer(io.rates, Access::COMPUTE_WRITE);
        rec.flush();
        let (level, sampler) = io.level;
        let resources = [Resource::Uniform(io.frame), Resource::View(level, sampler), Resource::Buffer(io.rates)];
        let push = Push {
            texel: self.rate.texel.map(|e| (e * self.side) as i32),
            words: row as i32,
            finer: self.side.ilog2() as i32,
            coarsest: self.rate.coarsest as i32,
        };
        self.pipeline.bind(rec, io.bridge, &resources, &push);
        self.pipeline.dispatch_groups(rec, [row, down, 1]);
        if let Some(target) = io.target {
            rec.buffer(io.rates, Access::TRANSFER_READ);
            rec.host_image(target, Access::TRANSFER_WRITE);
            rec.flush();
            let image_subresource =
                vk::ImageSubresourceLayers { aspect_mask: vk::ImageAspectFlags::COLOR, layer_count: 1, ..Default::default() };
            let region = vk::BufferImageCopy {
                buffer_row_length: 4 * row,
                image_subresource,
                image_extent: vk::Extent3D { width: across, height: down, depth: 1 },
                ..Default::default()
            };
            let layout = Access::TRANSFER_WRITE.layout;
            // SAFETY: the command buffer is recording outside a render pass; both were made ready above, and the buffer holds as much.
            unsafe { rec.cx.device.cmd_copy_buffer_to_image(rec.cmd, io.rates.handle, target.image, layout, &[region]) };
        }
        rec.end();
        if let Some(target) = io.target {
            rec.release(target);
        }
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipeline.retire(bag);
    }
}
