//! The host's own memory, which it shares with the renderer, and its own images and buffers.

use super::device::Gpu;
use passband::ash::vk;
use passband::{AllocationError, Block, DedicatedAllocator, HostAllocator, Location, MemoryRequest};
use std::error::Error;

/// An engine would have its own allocator here. This one counts, over passband's plain one.
pub struct Memory {
    plain: DedicatedAllocator,
    /// Blocks that are out.
    pub live: usize,
}

impl Memory {
    pub fn new(gpu: &Gpu) -> Self {
        // SAFETY: `run` frees all blocks before it drops the device.
        Self { plain: unsafe { DedicatedAllocator::new(&gpu.instance, gpu.physical_device, &gpu.device) }, live: 0 }
    }
}

// SAFETY: the plain allocator keeps the trait's promises; counting changes nothing.
unsafe impl HostAllocator for Memory {
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<Block, AllocationError> {
        let block = self.plain.allocate(request)?;
        self.live += 1;
        Ok(block)
    }

    unsafe fn free(&mut self, block: Block) {
        self.live -= 1;
        // SAFETY: as the caller promises.
        unsafe { self.plain.free(block) };
    }
}

pub struct Image {
    pub image: vk::Image,
    pub view: vk::ImageView,
    pub format: vk::Format,
    block: Block,
}

impl Image {
    pub fn new(
        gpu: &Gpu,
        memory: &mut dyn HostAllocator,
        format: vk::Format,
        [width, height]: [u32; 2],
        usage: vk::ImageUsageFlags,
    ) -> Result<Self, Box<dyn Error>> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        let range = |aspect_mask| vk::ImageSubresourceRange { aspect_mask, level_count: 1, layer_count: 1, ..Default::default() };
        let view = vk::ImageViewCreateInfo::default()
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(range(aspect(format)));
        // SAFETY: the device is alive; the block fits the image.
        unsafe {
            let image = gpu.device.create_image(&info, None)?;
            let requirements = gpu.device.get_image_memory_requirements(image);
            let request = MemoryRequest { name: "host image", requirements, location: Location::Device, linear: false };
            let block = memory.allocate(&request)?;
            gpu.device.bind_image_memory(image, block.memory, block.offset)?;
            Ok(Self { image, view: gpu.device.create_image_view(&view.image(image), None)?, format, block })
        }
    }

    /// # Safety
    /// No submitted work uses the image any more.
    pub unsafe fn free(self, gpu: &Gpu, memory: &mut dyn HostAllocator) {
        // SAFETY: as the caller promises.
        unsafe {
            gpu.device.destroy_image_view(self.view, None);
            gpu.device.destroy_image(self.image, None);
            memory.free(self.block);
        }
    }
}

pub fn aspect(format: vk::Format) -> vk::ImageAspectFlags {
    if format == vk::Format::D32_SFLOAT { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
}

/// A buffer that the CPU can see.
pub struct Buffer {
    pub buffer: vk::Buffer,
    size: usize,
    block: Block,
}

impl Buffer {
    pub fn new(
        gpu: &Gpu,
        memory: &mut dyn HostAllocator,
        size: usize,
        usage: vk::BufferUsageFlags,
        location: Location,
    ) -> Result<Self, Box<dyn Error>> {
        let info = vk::BufferCreateInfo::default().size(size as u64).usage(usage);
        // SAFETY: the device is alive; the block fits the buffer.
        unsafe {
            let buffer = gpu.device.create_buffer(&info, None)?;
            let requirements = gpu.device.get_buffer_memory_requirements(buffer);
            let block = memory.allocate(&MemoryRequest { name: "host buffer", requirements, location, linear: true })?;
            gpu.device.bind_buffer_memory(buffer, block.memory, block.offset)?;
            Ok(Self { buffer, size, block })
        }
    }

    /// A buffer with contents.
    pub fn with(
        gpu: &Gpu,
        memory: &mut dyn HostAllocator,
        usage: vk::BufferUsageFlags,
        bytes: &[u8],
    ) -> Result<Self, Box<dyn Error>> {
        let mut buffer = Self::new(gpu, memory, bytes.len(), usage, Location::Upload)?;
        buffer.bytes().copy_from_slice(bytes);
        Ok(buffer)
    }

    pub fn bytes(&mut self) -> &mut [u8] {
        // SAFETY: an allocator maps memory of the locations that buffers are made with, all of it.
        self.block.mapped.map_or(&mut [], |p| unsafe { std::slice::from_raw_parts_mut(p.as_ptr(), self.size) })
    }

    /// # Safety
    /// No submitted work uses the buffer any more.
    pub unsafe fn free(self, gpu: &Gpu, memory: &mut dyn HostAllocator) {
        // SAFETY: as the caller promises.
        unsafe {
            gpu.device.destroy_buffer(self.buffer, None);
            memory.free(self.block);
        }
    }
}
