//! Deferred destruction: nothing is destroyed while the device may still use it.

use crate::error::Result;
use crate::gpu::context::Context;
use crate::gpu::memory::{Block, HostAllocator};
use ash::vk;

/// One thing to destroy.
#[derive(Clone)]
pub(crate) enum Handle {
    Image(vk::Image),
    View(vk::ImageView),
    Buffer(vk::Buffer),
    Memory(Block),
    Sampler(vk::Sampler),
    Pipeline(vk::Pipeline),
    PipelineLayout(vk::PipelineLayout),
    SetLayout(vk::DescriptorSetLayout),
    DescriptorPool(vk::DescriptorPool),
    QueryPool(vk::QueryPool),
}

/// Handles that the renderer no longer uses but that submitted work may still touch. The host frees the bag after the
/// fence of the last submission that was recorded before it got the bag.
#[must_use = "a dropped bag leaks its handles: free it after the fence of the last submission"]
#[derive(Default)]
pub struct Retired {
    handles: Vec<Handle>,
}

impl Retired {
    pub(crate) fn push(&mut self, handle: Handle) {
        self.handles.push(handle);
    }

    /// Puts everything of `other` into this bag.
    pub fn append(&mut self, mut other: Retired) {
        self.handles.append(&mut other.handles);
    }

    /// Whether there is nothing to free.
    pub fn is_empty(&self) -> bool {
        self.handles.is_empty()
    }

    /// Destroys everything in the bag, in the order in which it was retired.
    ///
    /// # Safety
    /// `device` and `memory` are those of the renderer; no submitted work uses the handles any more.
    pub unsafe fn free(mut self, device: &ash::Device, memory: &mut dyn HostAllocator) {
        for handle in self.handles.drain(..) {
            // SAFETY: as the caller promises; each handle is in one bag only.
            unsafe {
                match handle {
                    Handle::Image(h) => device.destroy_image(h, None),
                    Handle::View(h) => device.destroy_image_view(h, None),
                    Handle::Buffer(h) => device.destroy_buffer(h, None),
                    Handle::Memory(block) => memory.free(block),
                    Handle::Sampler(h) => device.destroy_sampler(h, None),
                    Handle::Pipeline(h) => device.destroy_pipeline(h, None),
                    Handle::PipelineLayout(h) => device.destroy_pipeline_layout(h, None),
                    Handle::SetLayout(h) => device.destroy_descriptor_set_layout(h, None),
                    Handle::DescriptorPool(h) => device.destroy_descriptor_pool(h, None),
                    Handle::QueryPool(h) => device.destroy_query_pool(h, None),
                }
            }
        }
    }
}

impl Drop for Retired {
    fn drop(&mut self) {
        if !self.handles.is_empty() {
            log::error!("{} retired handles were dropped without being freed and leak", self.handles.len());
        }
    }
}

/// Construction in progress: what has been created so far is destroyed if a later step fails.
pub(crate) struct Build<'a> {
    pub cx: &'a Context,
    pub memory: &'a mut dyn HostAllocator,
    created: Retired,
}

impl Build<'_> {
    /// Runs `construct`; on an error everything that it created is destroyed.
    pub fn run<T>(
        cx: &Context,
        memory: &mut dyn HostAllocator,
        construct: impl FnOnce(&mut Build<'_>) -> Result<T>,
    ) -> Result<T> {
        let mut build = Build { cx, memory, created: Retired::default() };
        let result = construct(&mut build);
        let mut created = build.created;
        match &result {
            Ok(_) => created.handles.clear(),
            Err(_) => {
                created.handles.reverse();
                // The host's allocator is promised that nothing is bound to a block any more.
                created.handles.sort_by_key(|handle| matches!(handle, Handle::Memory(_)));
                // SAFETY: the constructor failed, so nothing that it made was ever handed to the device.
                unsafe { created.free(&cx.device, memory) };
            }
        }
        result
    }

    /// Notes a handle that was just created and returns it.
    pub fn track<T: Copy>(&mut self, handle: T, wrap: impl FnOnce(T) -> Handle) -> T {
        self.created.push(wrap(handle));
        handle
    }

    /// Notes a block of memory.
    pub fn track_block(&mut self, block: &Block) {
        self.created.push(Handle::Memory(block.clone()));
    }
}
