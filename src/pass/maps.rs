//! Materials' textures on the device: layers of arrays by size and format, and where each material's maps are.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::upload::{BufferUpload, ImageUpload};
use crate::material::{Material, Roughness};
use crate::reflectance::Model;
use crate::texture::{Class, Classes, Format};
use ash::vk;
use bytemuck::{Pod, Zeroable};

/// Classes that hold albedo, specular, normal and roughness maps, one bit each.
pub(crate) type Uses = [u32; 4];

/// Mirrors `MapRecord` in `glsl/filter.comp`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Record {
    places: [u32; 4],
    tiling: [f32; 2],
    rule: [f32; 2],
    without: [f32; 4],
}

/// What the `filter` pass reads.
pub(crate) struct MapImages {
    records: Buffer,
    classes: Vec<Image>,
}

/// Created and filled, not yet recorded.
pub(crate) struct MapsUpload {
    records: BufferUpload,
    classes: Vec<ImageUpload>,
    pub uses: Uses,
}

/// How the shader turns a roughness map's value into alpha, and the greatest alpha that comes of it.
fn rule(material: &Material) -> [f32; 2] {
    let Some((_, kind)) = &material.maps.roughness else { return [0.0, 1.0] };
    match (&material.model, kind) {
        (Model::Vmf(_), Roughness::Alpha) => [0.0, MOST_ALPHA],
        (Model::Vmf(_), Roughness::Kappa) => [1.0, MOST_ALPHA],
        (_, Roughness::Alpha) => [0.0, 1.0],
        (Model::BlinnPhong(_), Roughness::Kappa) => [2.0, 1.0],
        (_, Roughness::Kappa) => [1.0, 1.0],
    }
}

/// Of a lobe without concentration, in 16-bit floating point.
const MOST_ALPHA: f32 = 6e4;

fn format(format: Format) -> vk::Format {
    match format {
        Format::Srgb8 => vk::Format::R8G8B8A8_SRGB,
        Format::Half4 => vk::Format::R16G16B16A16_SFLOAT,
        Format::Half2 => vk::Format::R16G16_SFLOAT,
        Format::Half1 => vk::Format::R16_SFLOAT,
    }
}

fn upload(build: &mut Build<'_>, class: &Class) -> Result<ImageUpload> {
    let levels = class.layers.first().map_or(1, |layer| layer.levels());
    let extent = [class.size[0], class.size[1], 1];
    let desc = ImageDesc {
        layers: Some(class.layers.len() as u32),
        levels: levels as u32,
        ..ImageDesc::new("textures", format(class.format), extent, vk::ImageUsageFlags::SAMPLED)
    };
    let texels: Vec<u8> =
        (0..levels).flat_map(|level| class.layers.iter().flat_map(move |layer| layer.level(level).1)).copied().collect();
    ImageUpload::new(build, desc, &texels)
}

impl MapsUpload {
    pub fn new(build: &mut Build<'_>, materials: &[Material]) -> Result<Self> {
        let Classes { mut classes, slots } = Classes::of(materials);
        let mut uses = Uses::default();
        let mut records = Vec::with_capacity(materials.len());
        for (material, slots) in materials.iter().zip(slots) {
            let slots = [slots.albedo, slots.specular, slots.normal, slots.roughness];
            for (uses, (class, _)) in uses.iter_mut().zip(slots).filter_map(|(uses, slot)| Some((uses, slot?))) {
                *uses |= 1 << class;
            }
            let places = slots.map(|slot| slot.map_or(0, |(class, layer)| (layer << 3 | class) as u32 + 1));
            let [u, v] = material.maps.tiling;
            let without = if matches!(material.model, Model::Vmf(_)) { 0.0 } else { 1.0 };
            records.push(Record { places, tiling: [u, v], rule: rule(material), without: [without; 4] });
        }
        if classes.is_empty() {
            // Something to bind.
            let texel = std::sync::Arc::new(crate::Texture::scalar([1, 1], &[0.0])?);
            classes.push(Class { size: [1, 1], format: Format::Half1, layers: vec![texel] });
        }
        Ok(Self {
            records: BufferUpload::new(build, "maps", vk::BufferUsageFlags::STORAGE_BUFFER, bytemuck::cast_slice(&records))?,
            classes: classes.iter().map(|class| upload(build, class)).collect::<Result<_>>()?,
            uses,
        })
    }

    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> MapImages {
        MapImages {
            records: self.records.record(rec, bag),
            classes: self.classes.into_iter().map(|class| class.record(rec, bag)).collect(),
        }
    }
}

impl MapImages {
    pub fn records(&self) -> &Buffer {
        &self.records
    }

    /// The array of class `i`, or of the last if there are not that many.
    pub fn class(&self, i: usize) -> &Image {
        &self.classes[i.min(self.classes.len() - 1)]
    }

    /// Declares everything read by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        rec.buffer(&self.records, Access::COMPUTE_READ);
        self.classes.iter().for_each(|class| rec.image(class, Access::COMPUTE_SAMPLED));
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        states.forget(self.records.handle);
        self.records.retire(bag);
        for class in self.classes {
            states.forget(class.handle);
            class.retire(bag);
        }
    }
}
