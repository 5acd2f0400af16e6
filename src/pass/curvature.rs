//! Pass 2, continued: both principal curvatures by the shape operator, from neighbours of the same object.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use ash::vk::DescriptorType as D;

/// Pass, shader, label, timer and AOV name.
pub const NAME: &str = "curvature";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: true,
    materials: false,
    own: &[D::UNIFORM_BUFFER, D::STORAGE_IMAGE, D::COMBINED_IMAGE_SAMPLER],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    /// Of the `filter` pass.
    pub normals: &'a Image,
    /// Out: k1, k2 in 1/m, |k1| >= |k2|, positive where convex.
    pub curvature: &'a Image,
}

pub(crate) struct Curvature(ComputePipeline);

impl Curvature {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &[])?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        rec.image(io.normals, Access::COMPUTE_SAMPLED);
        rec.overwrite(io.curvature, Access::COMPUTE_WRITE);
        rec.flush();
        let resources = [
            Resource::Uniform(io.frame),
            Resource::Storage(io.curvature.view),
            Resource::Sampled(io.normals, io.samplers.nearest),
        ];
        self.0.bind(rec, io.bridge, &resources, &());
        self.0.dispatch(rec, io.curvature.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
