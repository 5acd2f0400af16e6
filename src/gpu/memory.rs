//! Device memory comes from the host through [`HostAllocator`].

use crate::error::Error;
use ash::vk;
use std::ptr::NonNull;

/// Where memory should live.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// Only the device reads and writes it.
    Device,
    /// The host writes, the device reads; must come back mapped and coherent.
    Upload,
    /// The device writes, the host reads; must come back mapped and coherent.
    Readback,
}

/// What is asked of the allocator.
#[derive(Clone, Copy, Debug)]
pub struct MemoryRequest<'a> {
    /// The image or buffer that it is for.
    pub name: &'a str,
    /// Size, alignment and memory types.
    pub requirements: vk::MemoryRequirements,
    /// Where it should live.
    pub location: Location,
    /// Buffers and linear images (`true`) may need distance from optimal images (`false`).
    pub linear: bool,
}

/// A piece of device memory.
#[derive(Clone, Debug)]
pub struct Block {
    /// The memory object; shared with other blocks if the allocator pools.
    pub memory: vk::DeviceMemory,
    /// Offset in bytes.
    pub offset: u64,
    /// Size in bytes.
    pub size: u64,
    /// Address of the block's first byte where the location asks for it.
    pub mapped: Option<NonNull<u8>>,
    /// The allocator's own mark, handed back unchanged.
    pub token: u64,
}

// SAFETY: `mapped` points to memory that the block owns alone; whoever holds the block may use it from any thread.
unsafe impl Send for Block {}

/// Why memory could not be had.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct AllocationError(pub String);

/// The host's allocator.
///
/// # Safety
/// A returned block must satisfy the request's requirements, stay valid and unshared until it is freed, and be mapped and
/// host-coherent for [`Location::Upload`] and [`Location::Readback`].
pub unsafe trait HostAllocator {
    /// Hands out a block.
    ///
    /// # Errors
    /// [`AllocationError`] with the allocator's reason; nothing is leaked by the caller then.
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<Block, AllocationError>;

    /// Takes a block back.
    ///
    /// # Safety
    /// The block came from this allocator, nothing is bound to it any more, and the device no longer uses it.
    unsafe fn free(&mut self, block: Block);
}

/// A block for `request`, or an [`Error::Allocation`] that names the resource; unmapped memory is refused where the location asks for a mapping.
pub(crate) fn allocate(memory: &mut dyn HostAllocator, request: &MemoryRequest<'_>) -> crate::Result<Block> {
    let fail = |reason| Error::Allocation { resource: request.name.into(), bytes: request.requirements.size, reason };
    let block = memory.allocate(request).map_err(|e| fail(e.to_string()))?;
    if request.location != Location::Device && block.mapped.is_none() {
        // SAFETY: the block was just handed out and nothing is bound to it.
        unsafe { memory.free(block) };
        return Err(fail("the allocator returned memory that is not mapped".into()));
    }
    Ok(block)
}

/// The plain allocator: one `vkAllocateMemory` a block. For tests and small hosts; drivers limit the number of blocks.
pub struct DedicatedAllocator {
    device: ash::Device,
    types: Vec<vk::MemoryType>,
}

impl DedicatedAllocator {
    /// An allocator on the host's device.
    ///
    /// # Safety
    /// The handles are alive and stay so until the last block is freed.
    pub unsafe fn new(instance: &ash::Instance, physical_device: vk::PhysicalDevice, device: &ash::Device) -> Self {
        // SAFETY: as the caller promises.
        let properties = unsafe { instance.get_physical_device_memory_properties(physical_device) };
        Self { device: device.clone(), types: properties.memory_types_as_slice().to_vec() }
    }

    fn memory_type(&self, bits: u32, location: Location) -> Option<u32> {
        let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let (needed, preferred) = match location {
            Location::Device => (vk::MemoryPropertyFlags::empty(), vk::MemoryPropertyFlags::DEVICE_LOCAL),
            Location::Upload => (visible, vk::MemoryPropertyFlags::empty()),
            Location::Readback => (visible, vk::MemoryPropertyFlags::HOST_CACHED),
        };
        let find = |flags| {
            (0u32..).zip(&self.types).find(|(i, t)| bits & (1 << i) != 0 && t.property_flags.contains(flags)).map(|(i, _)| i)
        };
        find(needed | preferred).or_else(|| find(needed))
    }
}

// SAFETY: each block is its own allocation of the requested type, mapped where the location asks for it.
unsafe impl HostAllocator for DedicatedAllocator {
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<Block, AllocationError> {
        let MemoryRequest { requirements, location, .. } = *request;
        let index = self
            .memory_type(requirements.memory_type_bits, location)
            .ok_or_else(|| AllocationError(format!("no memory type of {:#b} for {location:?}", requirements.memory_type_bits)))?;
        let info = vk::MemoryAllocateInfo::default().allocation_size(requirements.size).memory_type_index(index);
        // SAFETY: the device is alive; size and type come from its own requirements.
        let memory =
            unsafe { self.device.allocate_memory(&info, None) }.map_err(|e| AllocationError(format!("vkAllocateMemory: {e}")))?;
        let mapped = if location == Location::Device {
            None
        } else {
            // SAFETY: fresh host-visible memory that nobody else has mapped.
            match unsafe { self.device.map_memory(memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()) } {
                Ok(address) => NonNull::new(address.cast::<u8>()),
                Err(e) => {
                    // SAFETY: nothing is bound to it yet.
                    unsafe { self.device.free_memory(memory, None) };
                    return Err(AllocationError(format!("vkMapMemory: {e}")));
                }
            }
        };
        Ok(Block { memory, offset: 0, size: requirements.size, mapped, token: 0 })
    }

    unsafe fn free(&mut self, block: Block) {
        // SAFETY: the caller promises that nothing uses the block; freeing unmaps.
        unsafe { self.device.free_memory(block.memory, None) };
    }
}
