//! [`HostAllocator`] over `gpu_allocator` (feature `gpu-allocator`).
#![cfg(feature = "gpu-allocator")]

use crate::gpu::memory::{AllocationError, Block, HostAllocator, Location, MemoryRequest};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator};
use std::collections::HashMap;
use std::ptr::NonNull;
use std::sync::{Arc, Mutex, PoisonError};

/// Hands out blocks of a `gpu_allocator::vulkan::Allocator` that the host shares.
pub struct PooledAllocator {
    allocator: Arc<Mutex<Allocator>>,
    blocks: HashMap<u64, Allocation>,
    next: u64,
    live: u64,
    peak: u64,
}

impl PooledAllocator {
    /// Wraps the host's allocator, which must belong to the renderer's device.
    pub fn new(allocator: Arc<Mutex<Allocator>>) -> Self {
        Self { allocator, blocks: HashMap::new(), next: 0, live: 0, peak: 0 }
    }

    /// Largest number of bytes that were live at once.
    pub fn peak_bytes(&self) -> u64 {
        self.peak
    }

    /// Bytes that are live.
    pub fn live_bytes(&self) -> u64 {
        self.live
    }

    /// Blocks that are out.
    pub fn live_blocks(&self) -> usize {
        self.blocks.len()
    }
}

// SAFETY: blocks are gpu_allocator's own, kept alive in `blocks` until they are freed.
unsafe impl HostAllocator for PooledAllocator {
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<Block, AllocationError> {
        let location = match request.location {
            Location::Device => MemoryLocation::GpuOnly,
            Location::Upload => MemoryLocation::CpuToGpu,
            Location::Readback => MemoryLocation::GpuToCpu,
        };
        let description = AllocationCreateDesc {
            name: request.name,
            requirements: request.requirements,
            location,
            linear: request.linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let mut allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        let allocation = allocator.allocate(&description).map_err(|e| AllocationError(e.to_string()))?;
        // SAFETY: the memory is only read here; it is freed through gpu_allocator alone.
        let memory = unsafe { allocation.memory() };
        let block = Block {
            memory,
            offset: allocation.offset(),
            size: allocation.size(),
            mapped: if request.location == Location::Device { None } else { allocation.mapped_ptr().map(NonNull::cast) },
            token: self.next,
        };
        self.live += block.size;
        self.peak = self.peak.max(self.live);
        self.blocks.insert(self.next, allocation);
        self.next += 1;
        Ok(block)
    }

    unsafe fn free(&mut self, block: Block) {
        let Some(allocation) = self.blocks.remove(&block.token) else {
            log::error!("block {} was freed twice or came from another allocator", block.token);
            return;
        };
        self.live -= block.size;
        let mut allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        if let Err(error) = allocator.free(allocation) {
            log::error!("gpu_allocator refused to free a block: {error}");
        }
    }
}
