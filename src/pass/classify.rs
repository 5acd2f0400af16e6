//! Pass 6: the list of samples to shade and the arguments of the indirect dispatch over it. All covered ones at full rate;
//! otherwise those that stand for a cell that must be shaded, and the weights of all other cells' parents.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::pass::PassContext;
use crate::pass::pyramid::Cells;
use ash::vk::DescriptorType as D;

/// Pass, shader, label and timer name.
pub const NAME: &str = "classify";

/// Shader interfaces: of the full rate, and of levels.
pub const INTERFACES: [Interface; 2] = [
    Interface {
        name: NAME,
        local_size: [8, 8, 1],
        push_bytes: 0,
        gbuffer: true,
        materials: false,
        own: &[D::UNIFORM_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER],
    },
    Interface {
        name: "classify.levels",
        local_size: [64, 1, 1],
        push_bytes: 0,
        gbuffer: true,
        materials: false,
        own: &[
            D::UNIFORM_BUFFER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
            D::STORAGE_BUFFER,
        ],
    },
];

/// What is decided from.
pub(crate) enum From<'a> {
    /// Every covered one of this many samples is shaded.
    Samples([u32; 2]),
    /// The pyramid, and the weights that are found: four words a block. With groups in a buffer at an offset in bytes, the list
    /// of all covered samples, instead of an empty pyramid.
    Cells(Cells<'a>, &'a Buffer, Option<(&'a Buffer, u64)>),
}

/// Groups of the list of all samples: tiles down in a stripe (`STRIPE` of `glsl/include/list.glsl`), tiles across, stripes.
pub(crate) fn groups_of_all(extent: [u32; 2]) -> [u32; 3] {
    let [width, height, _] = INTERFACES[0].local_size;
    [STRIPE, extent[0].div_ceil(width), extent[1].div_ceil(height * STRIPE)]
}

/// Tiles down in a stripe.
const STRIPE: u32 = 4;

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub from: From<'a>,
    /// Out: groups in x, y, z; number of samples.
    pub arguments: &'a Buffer,
    /// Out: the samples, `y << 16 | x` from samples, `list_entry` of `glsl/include/levels.glsl` from cells.
    pub list: &'a Buffer,
}

/// With the pipeline that lists all samples of a frame with levels, if that may happen.
pub(crate) struct Classify(ComputePipeline, Option<ComputePipeline>);

impl Classify {
    /// For levels up to `top`; 0 is the full rate. `either` is whether a frame with levels may list all samples.
    pub fn new(p: &mut PassContext<'_, '_>, top: u32, either: bool) -> Result<Self> {
        let (interface, constants) = if top == 0 { (&INTERFACES[0], vec![16]) } else { (&INTERFACES[1], vec![top]) };
        let mut make =
            |interface, constants: &[u32]| ComputePipeline::new(p.build, p.modules, interface, p.bridge, p.slots, constants);
        let all = (top > 0 && either).then(|| make(&INTERFACES[0], &[14])).transpose()?;
        Ok(Self(make(interface, &constants)?, all))
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
        let [arguments, list] = [io.arguments, io.list].map(Resource::Buffer);
        match io.from {
            From::Samples(extent) => {
                rec.flush();
                self.0.bind(rec, io.bridge, &[Resource::Uniform(io.frame), arguments, list], &());
                self.0.dispatch_groups(rec, groups_of_all(extent));
            }
            From::Cells(Cells { cells, blocks, arguments: all }, weights, groups) => {
                rec.buffer(cells, Access::COMPUTE_READ);
                rec.buffer(blocks, Access::COMPUTE_READ);
                rec.buffer(all, Access::INDIRECT);
                rec.buffer(all, Access::COMPUTE_READ);
                rec.buffer(weights, Access::COMPUTE_WRITE);
                rec.flush();
                let [cells, blocks, counts, weights] = [cells, blocks, all, weights].map(Resource::Buffer);
                let resources = [Resource::Uniform(io.frame), cells, blocks, counts, weights, arguments, list];
                self.0.bind(rec, io.bridge, &resources, &());
                self.0.dispatch_indirect(rec, all, 0);
                if let (Some(pipeline), Some((groups, offset))) = (&self.1, groups) {
                    rec.buffer(groups, Access::INDIRECT);
                    rec.buffer(io.arguments, Access::COMPUTE_ATOMIC);
                    rec.buffer(io.list, Access::COMPUTE_WRITE);
                    rec.flush();
                    pipeline.bind(rec, io.bridge, &[Resource::Uniform(io.frame), arguments, list], &());
                    pipeline.dispatch_indirect(rec, groups, offset);
                }
            }
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
        if let Some(pipeline) = self.1 {
            pipeline.retire(bag);
        }
    }
}
