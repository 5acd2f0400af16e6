//! The frame's samplers: no anisotropy, which is an optional feature and unreliable in compute on the reference driver.

use crate::error::Result;
use crate::gpu::context::VkResultExt;
use crate::gpu::retire::{Build, Handle, Retired};
use ash::vk;

/// Nearest for fetches, linear with wrapping in the first coordinate for look-ups.
pub(crate) struct Samplers {
    pub nearest: vk::Sampler,
    pub linear: vk::Sampler,
    /// Linear within and between levels, wrapping in both coordinates.
    pub tiled: vk::Sampler,
}

impl Samplers {
    pub fn new(build: &mut Build<'_>) -> Result<Self> {
        let mut make = |filter, vertical, mipmap, name: &str| -> Result<vk::Sampler> {
            let info = vk::SamplerCreateInfo::default()
                .mag_filter(filter)
                .min_filter(filter)
                .mipmap_mode(mipmap)
                .address_mode_u(vk::SamplerAddressMode::REPEAT)
                .address_mode_v(vertical)
                .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
                .max_lod(vk::LOD_CLAMP_NONE);
            // SAFETY: the device is alive.
            let sampler = unsafe { build.cx.device.create_sampler(&info, None) }.named("vkCreateSampler")?;
            build.cx.name(sampler, name);
            Ok(build.track(sampler, Handle::Sampler))
        };
        let (clamp, repeat) = (vk::SamplerAddressMode::CLAMP_TO_EDGE, vk::SamplerAddressMode::REPEAT);
        let (one, between) = (vk::SamplerMipmapMode::NEAREST, vk::SamplerMipmapMode::LINEAR);
        Ok(Self {
            nearest: make(vk::Filter::NEAREST, clamp, one, "nearest")?,
            linear: make(vk::Filter::LINEAR, clamp, one, "linear")?,
            tiled: make(vk::Filter::LINEAR, repeat, between, "tiled")?,
        })
    }

    pub fn retire(self, bag: &mut Retired) {
        bag.push(Handle::Sampler(self.nearest));
        bag.push(Handle::Sampler(self.linear));
        bag.push(Handle::Sampler(self.tiled));
    }
}
