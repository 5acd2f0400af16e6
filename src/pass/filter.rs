//! Pass 2: what the surfaces' textures say at the pixel's scale: shading normals, factors, roughness and lobes.

use crate::config::{Bins, Config};
use crate::distribution::Division;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{BridgeSets, ComputePipeline, Interface, Resource};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::gpu::sampler::Samplers;
use crate::pass::maps::{MapImages, Uses};
use crate::pass::object_cells::ObjectCells;
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
        D::STORAGE_IMAGE,
        D::STORAGE_BUFFER,
        D::STORAGE_BUFFER,
    ],
};

pub(crate) struct Io<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    pub maps: &'a MapImages,
    /// Where they have cells of their own.
    pub objects: Option<&'a ObjectCells>,
    /// Out: shading normal; tangent as `glsl/include/tangent.glsl` encodes it.
    pub normals: &'a Image,
    /// Out: as `glsl/include/factors.glsl` packs them.
    pub factors: &'a Image,
    /// Out, where the filter finds lobes: as `glsl/include/lobes.glsl` reads them.
    pub lobes: &'a Image,
}

/// Compiled for the classes that a set of materials uses, and the most clusters of one.
pub(crate) struct Filter(ComputePipeline);

impl Filter {
    /// `clusters` is the most that a material has, at least 1, and whether those of some keep colours.
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config, uses: Uses, clusters: (u32, bool)) -> Result<Self> {
        let [albedo, specular, normal, roughness, moments, cells] = uses;
        let (geometric, filter) = (u32::from(config.widened()), config.filter);
        let lengths = match config.division {
            Division::Lengths(lengths) => lengths.map(|length| length as f32),
            Division::SpreadRatio => [0.0; 2],
        };
        let [one, quarters] = lengths.map(f32::to_bits);
        let read = [config.anisotropy, config.lod_bias.to_bits(), u32::from(config.effective_rule().is_literal()), one, quarters];
        let read = read.into_iter().chain([u32::from(config.bins == Bins::Camera), clusters.0, u32::from(clusters.1)]);
        let lobes = [brdf_map::number(filter), filter.lobe_layers()].into_iter().chain(read);
        let constants = [albedo, specular, normal, roughness, geometric, moments, cells];
        let constants: Vec<_> = constants.into_iter().chain(lobes).collect();
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, p.slots, &constants)?))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.maps.sampled(rec);
        io.objects.into_iter().for_each(|objects| objects.sampled(rec));
        rec.overwrite(io.normals, Access::COMPUTE_WRITE);
        rec.overwrite(io.factors, Access::COMPUTE_WRITE);
        rec.overwrite(io.lobes, Access::COMPUTE_WRITE);
        rec.flush();
        let mut resources = vec![Resource::Uniform(io.frame), Resource::Buffer(io.maps.records())];
        // Bindings without a class of their own are never read.
        let class = |i| io.objects.and_then(|objects| objects.class(i)).unwrap_or_else(|| io.maps.class(i));
        resources.extend((0..MAX_CLASSES).map(|i| Resource::Sampled(class(i), io.samplers.tiled)));
        resources.extend([io.normals, io.factors, io.lobes].map(|image| Resource::Storage(image.view)));
        resources.push(Resource::Buffer(io.objects.map_or(io.maps.records(), ObjectCells::table)));
        resources.push(Resource::Buffer(io.maps.clusters()));
        self.0.bind(rec, io.bridge, &resources, &());
        self.0.dispatch(rec, io.normals.extent());
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
