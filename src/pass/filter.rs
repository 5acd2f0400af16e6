//! Pass 2: what the surfaces' textures say at the pixel's scale: shading normals, factors and roughness.

use crate::config;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::maps::{MapImages, Uses};
use crate::pass::{PassContext, brdf_map};
use crate::texture::classes::MAX_CLASSES;
use ash::vk::DescriptorType as D;

/// Pass, shader, label and timer name.
pub const NAME: &str = "filter";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: true,
    materials: false,
    own: &[
        D::UNIFORM_BUFFER,
        D::STORAGE_BUFFER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::COMBINED_IMAGE_SAMPLER,
        D::STORAGE_IMAGE,
        D::STORAGE_IMAGE,
    ],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    pub maps: &'a MapImages,
    /// Out: shading normal; tangent as `glsl/include/tangent.glsl` encodes it.
    pub normals: &'a Image,
    /// Out: as `glsl/include/factors.glsl` packs them.
    pub factors: &'a Image,
}

/// Compiled for the classes that a set of materials uses.
pub(crate) struct Filter(ComputePipeline);

impl Filter {
    /// `geometric` says whether the mesh's curvature widens lobes.
    pub fn new(p: &mut PassContext<'_, '_>, filter: config::Filter, uses: Uses, geometric: bool) -> Result<Self> {
        let [albedo, specular, normal, roughness, moments] = uses;
        let constants = [albedo, specular, normal, roughness, u32::from(geometric), moments, brdf_map::number(filter)];
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.maps.sampled(rec);
        rec.overwrite(io.normals, Access::COMPUTE_WRITE);
        rec.overwrite(io.factors, Access::COMPUTE_WRITE);
        rec.flush();
        let mut resources = vec![Resource::Uniform(io.frame), Resource::Buffer(io.maps.records())];
        // Bindings without a class of their own are never read.
        resources.extend((0..MAX_CLASSES).map(|i| Resource::Sampled(io.maps.class(i), io.samplers.tiled)));
        resources.extend([Resource::Storage(io.normals.view), Resource::Storage(io.factors.view)]);
        self.0.bind(rec, io.bridge, &resources, &());
        self.0.dispatch(rec, io.normals.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
