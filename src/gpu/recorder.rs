//! Records commands into the host's command buffer: barriers from declared uses, labels and timer scopes by pass name.

use crate::gpu::access::{Access, ImageRef, State, Transition};
use crate::gpu::buffer::Buffer;
use crate::gpu::context::Context;
use crate::gpu::image::Image;
use crate::gpu::timer::GpuTimer;
use ash::vk;
use ash::vk::Handle as _;
use std::collections::HashMap;
use std::ffi::CString;

/// Last use of every resource that the renderer knows, kept from one `record` to the next (submissions run in order).
#[derive(Default)]
pub(crate) struct States(HashMap<u64, State>);

impl States {
    /// A destroyed handle's value may come back as another resource.
    pub fn forget(&mut self, handle: impl vk::Handle) {
        self.0.remove(&handle.as_raw());
    }
}

pub(crate) struct Recorder<'a> {
    pub cx: &'a Context,
    pub cmd: vk::CommandBuffer,
    pub slot: usize,
    states: &'a mut States,
    timer: Option<&'a mut GpuTimer>,
    images: Vec<(vk::Image, vk::ImageAspectFlags, Transition)>,
    buffers: Vec<(vk::Buffer, Transition)>,
    /// Bytes of images and buffers declared by the pass that is open.
    bytes: u64,
    pub pass_bytes: Vec<(&'static str, u64)>,
}

impl<'a> Recorder<'a> {
    pub fn new(
        cx: &'a Context,
        cmd: vk::CommandBuffer,
        slot: usize,
        states: &'a mut States,
        timer: Option<&'a mut GpuTimer>,
    ) -> Self {
        Self { cx, cmd, slot, states, timer, images: Vec::new(), buffers: Vec::new(), bytes: 0, pass_bytes: Vec::new() }
    }

    /// Opens a pass: its label and timer scope. Uses are declared inside, then [`Self::flush`] waits for them.
    pub fn begin(&mut self, name: &'static str) {
        if let (Some(debug), Ok(label)) = (&self.cx.debug_utils, CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&label);
            // SAFETY: the command buffer is recording.
            unsafe { debug.cmd_begin_debug_utils_label(self.cmd, &label) };
        }
        self.bytes = 0;
        self.pass_bytes.push((name, 0));
        if let Some(timer) = &mut self.timer {
            timer.begin(self.cx, self.cmd, self.slot, name);
        }
    }

    /// Counts what the pass that is open moves, in the place of what it has declared: parts of images, some of them several times.
    pub fn moved(&mut self, bytes: u64) {
        self.bytes = bytes;
    }

    pub fn end(&mut self) {
        if let Some(timer) = &mut self.timer {
            timer.end(self.cx, self.cmd, self.slot);
        }
        if let Some(last) = self.pass_bytes.last_mut() {
            last.1 = self.bytes;
        }
        if let Some(debug) = &self.cx.debug_utils {
            // SAFETY: closes the label of `begin`.
            unsafe { debug.cmd_end_debug_utils_label(self.cmd) };
        }
    }

    /// Declares a use of one of the renderer's images.
    pub fn image(&mut self, image: &Image, access: Access) {
        self.bytes += image.desc.bytes();
        self.raw_image(image.handle, image.desc.aspect(), access);
    }

    /// Declares a further use of an image in the pass that is open, of bytes that count already.
    pub fn again(&mut self, image: &Image, access: Access) {
        self.raw_image(image.handle, image.desc.aspect(), access);
    }

    /// Declares that the whole image is about to be overwritten: its contents need not survive.
    pub fn overwrite(&mut self, image: &Image, access: Access) {
        if let Some(state) = self.states.0.get_mut(&image.handle.as_raw()) {
            state.discard();
        }
        self.image(image, access);
    }

    /// Declares a use of an image of the host's, whose entry is the state before the first one.
    pub fn host_image(&mut self, image: &ImageRef, access: Access) {
        self.bytes += u64::from(image.extent[0]) * u64::from(image.extent[1]) * crate::gpu::image::texel_bytes(image.format);
        self.states.0.entry(image.image.as_raw()).or_insert_with(|| State::after(image.entry));
        self.raw_image(image.image, image.aspect, access);
    }

    /// Leaves an image of the host's as its exit says, and forgets it.
    pub fn release(&mut self, image: &ImageRef) {
        self.states.0.entry(image.image.as_raw()).or_insert_with(|| State::after(image.entry));
        self.raw_image(image.image, image.aspect, image.exit);
        self.flush();
        self.states.0.remove(&image.image.as_raw());
    }

    fn raw_image(&mut self, image: vk::Image, aspect: vk::ImageAspectFlags, access: Access) {
        let state = self.states.0.entry(image.as_raw()).or_insert_with(|| State::after(Access::NONE));
        if let Some(transition) = state.advance(access, true) {
            self.images.push((image, aspect, transition));
        }
    }

    /// Declares a use of a buffer.
    pub fn buffer(&mut self, buffer: &Buffer, access: Access) {
        self.bytes += buffer.size;
        let state = self.states.0.entry(buffer.handle.as_raw()).or_insert_with(|| State::after(Access::NONE));
        if let Some(transition) = state.advance(access, false) {
            self.buffers.push((buffer.handle, transition));
        }
    }

    /// Forgets a resource that is about to be destroyed.
    pub fn forget(&mut self, handle: impl vk::Handle) {
        self.states.forget(handle);
    }

    /// One barrier for all uses declared since the last.
    pub fn flush(&mut self) {
        if self.images.is_empty() && self.buffers.is_empty() {
            return;
        }
        let images: Vec<_> = self
            .images
            .drain(..)
            .map(|(image, aspect_mask, t)| {
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(t.from.stage)
                    .src_access_mask(t.from.access)
                    .old_layout(t.from.layout)
                    .dst_stage_mask(t.to.stage)
                    .dst_access_mask(t.to.access)
                    .new_layout(t.to.layout)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .image(image)
                    .subresource_range(vk::ImageSubresourceRange {
                        aspect_mask,
                        level_count: vk::REMAINING_MIP_LEVELS,
                        layer_count: vk::REMAINING_ARRAY_LAYERS,
                        ..Default::default()
                    })
            })
            .collect();
        let buffers: Vec<_> = self
            .buffers
            .drain(..)
            .map(|(buffer, t)| {
                vk::BufferMemoryBarrier2::default()
                    .src_stage_mask(t.from.stage)
                    .src_access_mask(t.from.access)
                    .dst_stage_mask(t.to.stage)
                    .dst_access_mask(t.to.access)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .buffer(buffer)
                    .size(vk::WHOLE_SIZE)
            })
            .collect();
        let info = vk::DependencyInfo::default().image_memory_barriers(&images).buffer_memory_barriers(&buffers);
        // SAFETY: the command buffer is recording outside a render pass; the handles are alive.
        unsafe { self.cx.device.cmd_pipeline_barrier2(self.cmd, &info) };
    }
}
