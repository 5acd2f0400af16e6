//! Pass 5: cells of every level above the samples, each with the least level of its covered samples and the sample that
//! stands for it (Bagher 2011, section 3.1), and the list of cells that have children to decide on.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::pass::PassContext;
use crate::plan::BLOCK_ARGUMENT_BYTES;
use ash::vk::{self, DescriptorType as D};

/// Pass, shader, label and timer name.
pub const NAME: &str = "pyramid";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: true,
    materials: false,
    own: &[D::UNIFORM_BUFFER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER],
};

/// Samples a side of a workgroup: a cell of the coarsest level that there can be.
pub(crate) const TILE: u32 = 32;

/// The cells' buffers; `glsl/include/levels.glsl` says what they hold.
#[derive(Clone, Copy)]
pub(crate) struct Cells<'a> {
    /// Of levels 1, 2, …, each row by row.
    pub cells: &'a Buffer,
    /// Cells with children to decide on, in the places of their level's cells.
    pub blocks: &'a Buffer,
    /// Groups in x, y, z and number: of all blocks, then of those of levels 1 to 5.
    pub arguments: &'a Buffer,
}

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    /// The level of each sample, readable by compute shaders, and a sampler for it.
    pub level: (vk::ImageView, vk::Sampler),
    pub shading: [u32; 2],
    /// Where the groups are, if not those of all samples: a buffer and an offset in bytes.
    pub groups: Option<(&'a Buffer, u64)>,
    /// Out.
    pub cells: Cells<'a>,
}

pub(crate) struct Pyramid(ComputePipeline);

impl Pyramid {
    /// For levels 1 to `top`.
    pub fn new(p: &mut PassContext<'_, '_>, top: u32) -> Result<Self> {
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &[top])?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        let Cells { cells, blocks, arguments } = io.cells;
        rec.begin(NAME);
        rec.buffer(arguments, Access::TRANSFER_WRITE);
        rec.flush();
        let empty = [[0u32, 1, 1, 0]; BLOCK_ARGUMENT_BYTES as usize / 16];
        // SAFETY: the command buffer is recording outside a render pass; the buffer holds as much.
        unsafe { rec.cx.device.cmd_update_buffer(rec.cmd, arguments.handle, 0, bytemuck::bytes_of(&empty)) };
        rec.buffer(arguments, Access::COMPUTE_ATOMIC);
        rec.buffer(cells, Access::COMPUTE_WRITE);
        rec.buffer(blocks, Access::COMPUTE_WRITE);
        if let Some((groups, _)) = io.groups {
            rec.buffer(groups, Access::INDIRECT);
        }
        rec.flush();
        let (level, sampler) = io.level;
        let resources = [
            Resource::Uniform(io.frame),
            Resource::View(level, sampler),
            Resource::Buffer(cells),
            Resource::Buffer(blocks),
            Resource::Buffer(arguments),
        ];
        self.0.bind(rec, io.bridge, &resources, &());
        match io.groups {
            Some((groups, offset)) => self.0.dispatch_indirect(rec, groups, offset),
            None => self.0.dispatch(rec, io.shading.map(|e| e.div_ceil(TILE) * INTERFACE.local_size[0])),
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
