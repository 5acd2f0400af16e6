//! What a session's last frame left on the device.

use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, texel_bytes};
use crate::gpu::memory::Location;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::offline::error::{Error, Result};
use crate::offline::session::{Session, closed};
use crate::pass::maps::MomentArrays;
use crate::renderer::Renderer;
use ash::vk;
use std::ops::Range;

/// Size and texels of each level.
pub type MomentLevels = Vec<([u32; 2], Vec<[f32; 4]>)>;

impl Session {
    /// The number of samples that the last frame shaded.
    ///
    /// # Errors
    /// The device's.
    pub fn shaded(&mut self) -> Result<u32> {
        Ok(self.words("arguments")?.get(3).copied().unwrap_or(0))
    }

    /// The words of one of the renderer's own buffers after the last frame.
    ///
    /// # Errors
    /// [`Error::Argument`] for a name that the configuration has no buffer of.
    pub fn words(&mut self, name: &'static str) -> Result<Vec<u32>> {
        let renderer = self.renderer.as_ref().ok_or_else(closed)?;
        let buffer = renderer.buffer(name).ok_or_else(|| Error::argument("buffer", "one that the frame writes", name))?;
        let bytes = self.read(buffer.size, |renderer, rec, target| {
            if let Some(buffer) = renderer.buffer(name) {
                copy_buffer(rec, buffer, target);
            }
        })?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// The texels of one of the renderer's own images after the last frame, layer by layer, in its own format and extent.
    ///
    /// # Errors
    /// [`Error::Argument`] for a name that the configuration has no image of.
    pub fn image(&mut self, name: &str) -> Result<(Vec<u8>, vk::Format, [u32; 2])> {
        let renderer = self.renderer.as_ref().ok_or_else(closed)?;
        let image = renderer.image(name).ok_or_else(|| Error::argument("image", "one that the frame writes", name))?;
        let (format, extent) = (image.desc.format, image.extent());
        let (name, size) = (image.desc.name, image.desc.bytes());
        let bytes = self.read(size, |renderer, rec, target| {
            if let Some(image) = renderer.image(name) {
                copy_image(rec, image, target);
            }
        })?;
        Ok((bytes, format, extent))
    }

    /// What the filter stores of a material, if it stores anything: moments and cells, layer by layer, as
    /// `glsl/include/moments.glsl` says.
    ///
    /// # Errors
    /// The device's.
    pub fn moments(&mut self, material: usize) -> Result<Option<[Vec<MomentLevels>; 2]>> {
        self.arrays(|renderer| renderer.moments(material))
    }

    /// What an object has in the last frame with [`crate::Bins::Camera`], if it has cells of its own: the frames of its texels in
    /// one layer, as `glsl/texture_space.frag` writes them, and its cells, layer by layer.
    ///
    /// # Errors
    /// The device's.
    pub fn object_cells(&mut self, object: u32) -> Result<Option<[Vec<MomentLevels>; 2]>> {
        self.arrays(|renderer| renderer.object_cells(object))
    }

    fn arrays(&mut self, of: impl Fn(&Renderer) -> Option<MomentArrays<'_>>) -> Result<Option<[Vec<MomentLevels>; 2]>> {
        let renderer = self.renderer.as_ref().ok_or_else(closed)?;
        let Some(arrays) = of(renderer) else { return Ok(None) };
        let layers = arrays.map(|array| array.map(|(image, layers)| (image.desc, layers)));
        let mut found = [Vec::new(), Vec::new()];
        for ((i, layers), found) in layers.into_iter().enumerate().zip(&mut found) {
            for (desc, layer) in layers.into_iter().flat_map(|(desc, layers)| layers.map(move |layer| (desc, layer))) {
                let level = |level| {
                    let [width, height, _] = desc.level_extent(level);
                    let texel = texel_bytes(desc.format);
                    let bytes = self.read(u64::from(width) * u64::from(height) * texel, |renderer, rec, target| {
                        if let Some((image, _)) = of(renderer).and_then(|arrays| arrays[i].clone()) {
                            copy_layers(rec, image, target, level, layer..layer + 1);
                        }
                    })?;
                    if desc.format != vk::Format::R16G16B16A16_SFLOAT {
                        return Ok(([width, height], bytemuck::pod_collect_to_vec(&bytes)));
                    }
                    let halves: Vec<[half::f16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                    Ok(([width, height], halves.iter().map(|texel| texel.map(half::f16::to_f32)).collect()))
                };
                found.push((0..desc.levels).map(level).collect::<Result<_>>()?);
            }
        }
        Ok(Some(found))
    }

    /// What `record` copies into a host-visible buffer of `size` bytes.
    pub(super) fn read(&mut self, size: u64, record: impl FnOnce(&Renderer, &mut Recorder<'_>, &Buffer)) -> Result<Vec<u8>> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let mut target = None;
        self.headless.submit(|cmd, memory| {
            let usage = vk::BufferUsageFlags::TRANSFER_DST;
            let buffer =
                Build::run(renderer.context(), memory, |b| Buffer::new(b, "read-back", size, usage, Location::Readback))?;
            renderer.copy_out(cmd, |renderer, rec| {
                record(renderer, rec, &buffer);
                rec.buffer(&buffer, Access::HOST_READ);
                rec.flush();
                rec.forget(buffer.handle);
            });
            target = Some(buffer);
            Ok(Retired::default())
        })?;
        let buffer = target.ok_or_else(closed)?;
        let bytes = buffer.bytes().to_vec();
        let (host, memory) = self.headless.parts()?;
        let mut bag = Retired::default();
        buffer.retire(&mut bag);
        // SAFETY: the submission was waited for.
        unsafe { bag.free(host.device, memory) };
        Ok(bytes)
    }
}

fn copy_image(rec: &mut Recorder<'_>, image: &Image, target: &Buffer) {
    copy_layers(rec, image, target, 0, 0..image.desc.layers.unwrap_or(1));
}

fn copy_layers(rec: &mut Recorder<'_>, image: &Image, target: &Buffer, level: u32, range: Range<u32>) {
    rec.image(image, Access::TRANSFER_READ);
    rec.buffer(target, Access::TRANSFER_WRITE);
    rec.flush();
    let [width, height, _] = image.desc.level_extent(level);
    let layers = vk::ImageSubresourceLayers {
        aspect_mask: image.desc.aspect(),
        mip_level: level,
        base_array_layer: range.start,
        layer_count: range.end - range.start,
    };
    let extent = vk::Extent3D { width, height, depth: 1 };
    let region = vk::BufferImageCopy { image_subresource: layers, image_extent: extent, ..Default::default() };
    let layout = Access::TRANSFER_READ.layout;
    // SAFETY: the command buffer is recording; the buffer holds the whole image.
    unsafe { rec.cx.device.cmd_copy_image_to_buffer(rec.cmd, image.handle, layout, target.handle, &[region]) };
}

pub(super) fn copy_buffer(rec: &mut Recorder<'_>, buffer: &Buffer, target: &Buffer) {
    rec.buffer(buffer, Access::TRANSFER_READ);
    rec.buffer(target, Access::TRANSFER_WRITE);
    rec.flush();
    let region = vk::BufferCopy { size: buffer.size, ..Default::default() };
    // SAFETY: the command buffer is recording; both buffers have the source's size.
    unsafe { rec.cx.device.cmd_copy_buffer(rec.cmd, buffer.handle, target.handle, &[region]) };
}
