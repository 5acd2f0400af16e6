//! Uploads: created and filled first, recorded afterwards into the host's command buffer.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use ash::vk;

fn staging(build: &mut Build<'_>, name: &'static str, contents: &[u8]) -> Result<Buffer> {
    let usage = vk::BufferUsageFlags::TRANSFER_SRC;
    let mut staging = Buffer::new(build, name, contents.len() as u64, usage, Location::Upload)?;
    staging.bytes_mut().copy_from_slice(contents);
    Ok(staging)
}

/// An image and the staging buffer that fills it.
pub(crate) struct ImageUpload {
    pub image: Image,
    staging: Buffer,
}

impl ImageUpload {
    /// `texels` are tightly packed rows (and slices) of `desc.format`; all layers of level 0, then of level 1, and so on.
    pub fn new(build: &mut Build<'_>, mut desc: ImageDesc, texels: &[u8]) -> Result<Self> {
        debug_assert_eq!(texels.len() as u64, desc.bytes(), "{}", desc.name);
        desc.usage |= vk::ImageUsageFlags::TRANSFER_DST;
        Ok(Self { image: Image::new(build, desc)?, staging: staging(build, desc.name, texels)? })
    }

    /// Records the copy; the staging buffer goes into `bag`.
    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> Image {
        rec.overwrite(&self.image, Access::TRANSFER_WRITE);
        rec.flush();
        let desc = self.image.desc;
        let layer_count = desc.layers.unwrap_or(1);
        let mut offset = 0;
        let regions: Vec<_> = (0..desc.levels)
            .map(|mip_level| {
                let [width, height, depth] = desc.level_extent(mip_level);
                let region = vk::BufferImageCopy {
                    buffer_offset: offset,
                    image_subresource: vk::ImageSubresourceLayers {
                        aspect_mask: desc.aspect(),
                        mip_level,
                        layer_count,
                        ..Default::default()
                    },
                    image_extent: vk::Extent3D { width, height, depth },
                    ..Default::default()
                };
                offset += ImageDesc { extent: [width, height, depth], levels: 1, ..desc }.bytes();
                region
            })
            .collect();
        // SAFETY: the command buffer is recording; the staging buffer holds the whole image; host writes before submission
        // are visible to it.
        unsafe {
            rec.cx.device.cmd_copy_buffer_to_image(
                rec.cmd,
                self.staging.handle,
                self.image.handle,
                vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                &regions,
            );
        }
        self.staging.retire(bag);
        self.image
    }
}

/// A device buffer and the staging buffer that fills it.
pub(crate) struct BufferUpload {
    pub buffer: Buffer,
    staging: Buffer,
}

impl BufferUpload {
    pub fn new(build: &mut Build<'_>, name: &'static str, usage: vk::BufferUsageFlags, contents: &[u8]) -> Result<Self> {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = Buffer::new(build, name, contents.len() as u64, usage, Location::Device)?;
        Ok(Self { buffer, staging: staging(build, name, contents)? })
    }

    /// Records the copy; the staging buffer goes into `bag`.
    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> Buffer {
        rec.buffer(&self.buffer, Access::TRANSFER_WRITE);
        rec.flush();
        let region = vk::BufferCopy { size: self.staging.size, ..Default::default() };
        // SAFETY: as for images.
        unsafe { rec.cx.device.cmd_copy_buffer(rec.cmd, self.staging.handle, self.buffer.handle, &[region]) };
        self.staging.retire(bag);
        self.buffer
    }
}
