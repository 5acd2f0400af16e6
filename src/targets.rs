//! Images and buffers of the frame whose size follows from the extent.

use crate::config::Config;
use crate::error::Result;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::memory::Location;
use crate::gpu::recorder::States;
use crate::gpu::retire::{Build, Retired};
use crate::pass::gbuffer::GBufferImages;
use crate::plan::{ARGUMENT_BYTES, Plan};
use ash::vk;

pub(crate) struct Targets {
    pub plan: Plan,
    pub gbuffer: Option<GBufferImages>,
    pub normals: Image,
    pub factors: Image,
    pub curvature: Option<Image>,
    pub radiance: Image,
    pub resolved: Image,
    /// Groups in x, y, z; number of listed samples.
    pub arguments: Buffer,
    /// Samples to shade.
    pub list: Buffer,
}

impl Targets {
    pub fn new(build: &mut Build<'_>, config: &Config) -> Result<Self> {
        let plan = Plan::of(config);
        let limit = u64::from(build.cx.limits.max_storage_buffer_range);
        if plan.list_bytes() > limit {
            let expected = format!("at most {} shading samples", limit / 4);
            return Err(crate::Error::invalid("Config::extent", expected, plan.list_bytes() / 4));
        }
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let arguments = storage
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC;
        Ok(Self {
            gbuffer: plan.gbuffer.map(|images| GBufferImages::new(build, images)).transpose()?,
            normals: Image::new(build, plan.normals)?,
            factors: Image::new(build, plan.factors)?,
            curvature: plan.curvature.map(|desc| Image::new(build, desc)).transpose()?,
            radiance: Image::new(build, plan.radiance)?,
            resolved: Image::new(build, plan.resolved)?,
            arguments: Buffer::new(build, "arguments", ARGUMENT_BYTES, arguments, Location::Device)?,
            list: Buffer::new(build, "list", plan.list_bytes(), storage, Location::Device)?,
            plan,
        })
    }

    /// The renderer's own colour images by name.
    #[cfg(feature = "offline")]
    pub fn image(&self, name: &str) -> Option<&Image> {
        let gbuffer = self.gbuffer.as_ref().map(GBufferImages::colors);
        let all = gbuffer.into_iter().flatten().chain(&self.curvature).chain([
            &self.normals,
            &self.factors,
            &self.radiance,
            &self.resolved,
        ]);
        all.into_iter().find(|image| image.desc.name == name)
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        let images = self.gbuffer.into_iter().flat_map(GBufferImages::into_images);
        for image in images.chain(self.curvature).chain([self.normals, self.factors, self.radiance, self.resolved]) {
            states.forget(image.handle);
            image.retire(bag);
        }
        for buffer in [self.arguments, self.list] {
            states.forget(buffer.handle);
            buffer.retire(bag);
        }
    }
}
