//! Pass 9, continued: writes the host's output, linear or exposed and encoded as sRGB.

use crate::error::{Error, Result};
use crate::gpu::access::{Access, ImageRef};
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "tonemap";

const fn interface(name: &'static str) -> Interface {
    Interface {
        name,
        local_size: [8, 8, 1],
        push_bytes: size_of::<Push>() as u32,
        gbuffer: false,
        materials: false,
        own: &[D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE],
    }
}

/// Shader interfaces, one a format of [`FORMATS`].
pub const INTERFACES: [Interface; 3] = [interface("tonemap.rgba8"), interface("tonemap.rgba16f"), interface("tonemap.rgba32f")];

/// Formats that an output may have.
pub const FORMATS: [vk::Format; 3] =
    [vk::Format::R8G8B8A8_UNORM, vk::Format::R16G16B16A16_SFLOAT, vk::Format::R32G32B32A32_SFLOAT];

/// How radiance becomes output values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transfer {
    /// Linear radiance.
    Linear,
    /// `radiance * exposure`, clamped to [0, 1], sRGB transfer function.
    Srgb {
        /// Factor on radiance, finite and positive.
        exposure: f32,
    },
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    exposure: f32,
    srgb: u32,
}

pub(crate) struct Io<'a> {
    pub samplers: &'a Samplers,
    pub resolved: &'a Image,
    /// Out: the host's image, in one of [`FORMATS`].
    pub target: &'a ImageRef,
    pub transfer: Transfer,
}

pub(crate) struct Tonemap([ComputePipeline; 3]);

impl Tonemap {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        let mut make = |i: usize| ComputePipeline::new(p.build, p.modules, &INTERFACES[i], p.bridge, p.slots, &[]);
        Ok(Self([make(0)?, make(1)?, make(2)?]))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let Some(pipeline) = FORMATS.iter().position(|&f| f == io.target.format).map(|i| &self.0[i]) else { return };
        let push = match io.transfer {
            Transfer::Linear => Push { exposure: 1.0, srgb: 0 },
            Transfer::Srgb { exposure } => Push { exposure, srgb: 1 },
        };
        rec.begin(NAME);
        rec.image(io.resolved, Access::COMPUTE_SAMPLED);
        rec.host_image(io.target, Access::COMPUTE_WRITE);
        rec.flush();
        let resources = [Resource::Sampled(io.resolved, io.samplers.nearest), Resource::Storage(io.target.view)];
        pipeline.bind(rec, BridgeSets::NONE, &resources, &push);
        pipeline.dispatch(rec, io.target.extent);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.into_iter().for_each(|p| p.retire(bag));
    }
}

/// Refuses an output of the wrong format or extent, or an impossible exposure.
pub(crate) fn check(target: &ImageRef, transfer: Transfer, extent: [u32; 2]) -> Result<()> {
    if !FORMATS.contains(&target.format) {
        return Err(Error::invalid("output.image.format", format!("one of {FORMATS:?}"), format!("{:?}", target.format)));
    }
    if target.extent != extent {
        return Err(Error::invalid("output.image.extent", format!("{extent:?}"), format!("{:?}", target.extent)));
    }
    match transfer {
        Transfer::Srgb { exposure } if !(exposure.is_finite() && exposure > 0.0) => {
            Err(Error::invalid("output.transfer.exposure", "finite and positive", exposure))
        }
        _ => Ok(()),
    }
}
