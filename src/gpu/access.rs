//! How a command uses an image or buffer, and the barriers between uses.

use ash::vk;

/// One use: stages, memory access and, for images, the layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Stages that touch it.
    pub stage: vk::PipelineStageFlags2,
    /// What they do.
    pub access: vk::AccessFlags2,
    /// Layout during it; ignored for buffers.
    pub layout: vk::ImageLayout,
}

impl Access {
    /// Never used, contents undefined.
    pub const NONE: Self = Self::new(vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED);
    /// Sampled or fetched by a compute shader.
    pub const COMPUTE_SAMPLED: Self = Self::new(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_SAMPLED_READ,
        vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    );
    /// Written as a storage image or buffer by a compute shader.
    pub const COMPUTE_WRITE: Self =
        Self::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_STORAGE_WRITE, vk::ImageLayout::GENERAL);
    /// Read and written by one dispatch of a compute shader: by atomics, or one level of an image from another.
    pub const COMPUTE_ATOMIC: Self = Self::new(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw() | vk::AccessFlags2::SHADER_STORAGE_READ.as_raw(),
        ),
        vk::ImageLayout::GENERAL,
    );
    /// A storage buffer read by a compute shader.
    pub const COMPUTE_READ: Self =
        Self::new(vk::PipelineStageFlags2::COMPUTE_SHADER, vk::AccessFlags2::SHADER_STORAGE_READ, vk::ImageLayout::GENERAL);
    /// Arguments of an indirect dispatch.
    pub const INDIRECT: Self =
        Self::new(vk::PipelineStageFlags2::DRAW_INDIRECT, vk::AccessFlags2::INDIRECT_COMMAND_READ, vk::ImageLayout::UNDEFINED);
    /// Colour attachment, cleared or written.
    pub const COLOR_WRITE: Self = Self::new(
        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
        vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
    );
    /// Depth attachment, tested and written.
    pub const DEPTH_WRITE: Self = Self::new(
        vk::PipelineStageFlags2::from_raw(
            vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw() | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
        ),
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw() | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
        ),
        vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
    );
    /// Source of a copy.
    pub const TRANSFER_READ: Self =
        Self::new(vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_READ, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
    /// Target of a copy, fill or update.
    pub const TRANSFER_WRITE: Self =
        Self::new(vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
    /// Read by the host after a fence.
    pub const HOST_READ: Self = Self::new(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ, vk::ImageLayout::GENERAL);

    /// An access from its parts.
    pub const fn new(stage: vk::PipelineStageFlags2, access: vk::AccessFlags2, layout: vk::ImageLayout) -> Self {
        Self { stage, access, layout }
    }

    fn writes(&self) -> bool {
        const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
            vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
                | vk::AccessFlags2::SHADER_WRITE.as_raw()
                | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
                | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
                | vk::AccessFlags2::TRANSFER_WRITE.as_raw()
                | vk::AccessFlags2::HOST_WRITE.as_raw()
                | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
        );
        self.access.intersects(WRITES)
    }
}

/// An image of the host's for one frame: what it is, how the host leaves it and how it wants it back.
#[derive(Clone, Copy, Debug)]
pub struct ImageRef {
    /// The image.
    pub image: vk::Image,
    /// A 2-D view of one level and layer.
    pub view: vk::ImageView,
    /// The view's format.
    pub format: vk::Format,
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Aspects that barriers name.
    pub aspect: vk::ImageAspectFlags,
    /// The last use before `record`; its writes are waited for.
    pub entry: Access,
    /// The use that follows `record`; the image is left ready for it.
    pub exit: Access,
}

/// What the commands recorded so far did to one resource.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    layout: vk::ImageLayout,
    write_stage: vk::PipelineStageFlags2,
    write_access: vk::AccessFlags2,
    read_stage: vk::PipelineStageFlags2,
    read_access: vk::AccessFlags2,
}

/// The scope halves of a barrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Transition {
    pub from: Access,
    pub to: Access,
}

impl State {
    pub fn after(access: Access) -> Self {
        let write = access.writes();
        let pick = |yes: bool| if yes { (access.stage, access.access) } else { Default::default() };
        let ((write_stage, write_access), (read_stage, read_access)) = (pick(write), pick(!write));
        Self { layout: access.layout, write_stage, write_access, read_stage, read_access }
    }

    /// The contents need not survive the next use.
    pub fn discard(&mut self) {
        self.layout = vk::ImageLayout::UNDEFINED;
    }

    /// The barrier that `next` needs, if any, and the state after it. `image` says whether layouts count.
    pub fn advance(&mut self, next: Access, image: bool) -> Option<Transition> {
        let moved = image && self.layout != next.layout;
        let first = self.write_stage.is_empty() && self.read_stage.is_empty();
        if !moved && !next.writes() {
            let seen = self.read_stage.contains(next.stage) && self.read_access.contains(next.access);
            let from = Access::new(self.write_stage, self.write_access, self.layout);
            self.read_stage |= next.stage;
            self.read_access |= next.access;
            return (!seen && !self.write_stage.is_empty()).then_some(Transition { from, to: next });
        }
        let from = Access::new(self.write_stage | self.read_stage, self.write_access, self.layout);
        *self = Self::after(next);
        if !next.writes() {
            // The layout change itself is a write that later readers in other stages must follow.
            self.write_stage = next.stage;
        }
        (moved || !first).then_some(Transition { from, to: next })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_wait_for_writes_once_and_writes_wait_for_all() {
        let mut s = State::after(Access::NONE);
        assert!(s.advance(Access::COMPUTE_WRITE, true).is_some(), "the first use sets the layout");
        assert!(s.advance(Access::COMPUTE_SAMPLED, true).is_some());
        assert!(s.advance(Access::COMPUTE_SAMPLED, true).is_none(), "a second reader in the same stage waits for nothing");
        let t = s.advance(Access::COMPUTE_WRITE, true).unwrap();
        assert_eq!(t.from.stage, vk::PipelineStageFlags2::COMPUTE_SHADER);
        assert_eq!(t.from.access, vk::AccessFlags2::NONE, "a write after reads needs only execution");
    }

    #[test]
    fn buffers_ignore_layouts() {
        let mut s = State::after(Access::TRANSFER_WRITE);
        assert!(s.advance(Access::COMPUTE_READ, false).is_some());
        assert!(s.advance(Access::INDIRECT, false).is_some(), "another stage has not waited yet");
        assert!(s.advance(Access::COMPUTE_READ, false).is_none());
        let t = s.advance(Access::TRANSFER_WRITE, false).unwrap();
        assert!(t.from.stage.contains(vk::PipelineStageFlags2::DRAW_INDIRECT | vk::PipelineStageFlags2::COMPUTE_SHADER));
    }
}
