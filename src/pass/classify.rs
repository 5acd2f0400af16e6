//! Pass 6: the list of samples that carry a surface and the arguments of the indirect dispatch over it.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::pass::PassContext;
use ash::vk::DescriptorType as D;

/// Pass, shader, label and timer name.
pub const NAME: &str = "classify";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: true,
    materials: false,
    own: &[D::UNIFORM_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub shading: [u32; 2],
    /// Out: groups in x, y, z; number of samples.
    pub arguments: &'a Buffer,
    /// Out: `y << 16 | x` of each sample, tile by tile.
    pub list: &'a Buffer,
}

pub(crate) struct Classify(ComputePipeline);

impl Classify {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &[])?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        rec.buffer(io.arguments, Access::TRANSFER_WRITE);
        rec.flush();
        let empty: [u32; 4] = [0, 1, 1, 0];
        // SAFETY: the command buffer is recording outside a render pass; the buffer holds 16 bytes.
        unsafe { rec.cx.device.cmd_update_buffer(rec.cmd, io.arguments.handle, 0, bytemuck::bytes_of(&empty)) };
        rec.buffer(io.arguments, Access::COMPUTE_ATOMIC);
        rec.buffer(io.list, Access::COMPUTE_WRITE);
        rec.flush();
        let resources = [Resource::Uniform(io.frame), Resource::Buffer(io.arguments), Resource::Buffer(io.list)];
        self.0.bind(rec, io.bridge, &resources, &());
        self.0.dispatch(rec, io.shading);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
