//! Buffers that the renderer owns.

use crate::error::Result;
use crate::gpu::context::VkResultExt;
use crate::gpu::memory::{Block, Location, MemoryRequest, allocate};
use crate::gpu::retire::{Build, Handle, Retired};
use ash::vk;

/// A buffer and its memory.
#[derive(Debug)]
pub struct Buffer {
    pub(crate) handle: vk::Buffer,
    pub(crate) size: u64,
    block: Block,
}

impl Buffer {
    pub(crate) fn new(
        build: &mut Build<'_>,
        name: &'static str,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: Location,
    ) -> Result<Self> {
        let device = &build.cx.device;
        let info = vk::BufferCreateInfo::default().size(size.max(1)).usage(usage);
        // SAFETY: the device is alive.
        let handle = build.track(unsafe { device.create_buffer(&info, None) }.named("vkCreateBuffer")?, Handle::Buffer);
        build.cx.name(handle, name);
        // SAFETY: the buffer is alive and unbound.
        let requirements = unsafe { device.get_buffer_memory_requirements(handle) };
        let block = allocate(build.memory, &MemoryRequest { name, requirements, location, linear: true })?;
        build.track_block(&block);
        // SAFETY: the block satisfies the buffer's requirements and is unshared.
        unsafe { device.bind_buffer_memory(handle, block.memory, block.offset) }.named("vkBindBufferMemory")?;
        Ok(Self { handle, size, block })
    }

    /// The host's view of an upload or read-back buffer; empty for device memory.
    #[cfg(feature = "offline")]
    pub(crate) fn bytes(&self) -> &[u8] {
        match self.block.mapped {
            // SAFETY: the mapping covers `size` bytes and lives as long as the block.
            Some(address) => unsafe { std::slice::from_raw_parts(address.as_ptr(), self.size as usize) },
            None => &[],
        }
    }

    /// As [`Self::bytes`], to write.
    pub(crate) fn bytes_mut(&mut self) -> &mut [u8] {
        match self.block.mapped {
            // SAFETY: as in `bytes`; `&mut self` makes the view unique on the host's side.
            Some(address) => unsafe { std::slice::from_raw_parts_mut(address.as_ptr(), self.size as usize) },
            None => &mut [],
        }
    }

    pub(crate) fn retire(self, bag: &mut Retired) {
        bag.push(Handle::Buffer(self.handle));
        bag.push(Handle::Memory(self.block));
    }
}
