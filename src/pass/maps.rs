//! Materials' textures on the device: layers of arrays by size and format, and where each material's maps are.

use crate::config::Filter;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::upload::{BufferUpload, ImageUpload};
use crate::material::{Material, Roughness};
use crate::moments::{Base, Parameter};
use crate::pass::brdf_map::{self, BrdfMap, Group, Place, Source};
use crate::pass::vmf_mips::{self, VmfMips};
use crate::reflectance::Model;
use crate::texture::classes::MAX_CLASSES;
use crate::texture::{Class, Classes, Format, Slots};
use ash::vk;
use bytemuck::{Pod, Zeroable};

/// Classes that hold albedo, specular, normal and roughness maps and moments, one bit each.
pub(crate) type Uses = [u32; 5];

/// Mirrors `MapRecord` in `glsl/filter.comp`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Record {
    places: [u32; 4],
    tiling: [f32; 2],
    rule: [f32; 2],
    without: f32,
    moments: u32,
    lobes: u32,
    unused: u32,
}

/// What the `filter` pass reads.
pub(crate) struct MapImages {
    records: Buffer,
    /// Textures, and behind them moments.
    classes: Vec<Image>,
    /// Class and layer of each material's moments.
    #[cfg_attr(not(feature = "offline"), expect(dead_code, reason = "only `offline` reads them back"))]
    moments: Vec<Option<Place>>,
}

/// What textures and their moments are read with.
pub(crate) struct Reading<'a> {
    pub filter: Filter,
    /// Whether the mesh's curvature widens lobes.
    pub widened: bool,
    /// There if the filter stores moments.
    pub passes: Option<&'a (BrdfMap, VmfMips)>,
    pub samplers: &'a Samplers,
}

/// Created and filled, not yet recorded.
pub(crate) struct MapsUpload {
    records: BufferUpload,
    classes: Vec<ImageUpload>,
    moments: Vec<Image>,
    places: Vec<Option<Place>>,
    pub uses: Uses,
    pub work: Option<(brdf_map::Work, vmf_mips::Work)>,
}

/// How the shader turns a roughness map's value into alpha, and the greatest alpha that comes of it.
fn rule(material: &Material) -> [f32; 2] {
    let Some((_, kind)) = &material.maps.roughness else {
        return [0.0, if matches!(material.model, Model::Vmf(_)) { MOST_ALPHA } else { 1.0 }];
    };
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

/// Where an array's layer is, as `MapRecord::places` has it.
fn code(place: Option<Place>) -> u32 {
    place.map_or(0, |(class, layer)| (layer << 3 | class) as u32 + 1)
}

/// The moments of `materials`, of which `bases` say what is filtered: one group for each size, one layer for each source. Of each
/// material its group and layer.
fn groups(
    materials: &[Material],
    bases: &[Option<Base>],
    sizes: Vec<[u32; 2]>,
    slots: &[Slots],
) -> (Vec<Group>, Vec<Option<Place>>) {
    let mut groups: Vec<_> = sizes.into_iter().map(|size| Group { size, sources: Vec::new() }).collect();
    let mut place = |((material, base), slots): ((&Material, &Option<Base>), &Slots)| {
        let base = (*base)?;
        let group = brdf_map::fitting(&groups, base.size(material))?;
        let roughness = base.roughness(material).and(slots.roughness);
        let parameter = Parameter::of(&material.model);
        let source = Source { normal: slots.normal, roughness, rule: rule(material), base, parameter };
        let sources = &mut groups[group].sources;
        let layer = sources.iter().position(|known| *known == source).unwrap_or_else(|| {
            sources.push(source);
            sources.len() - 1
        });
        Some((group, layer))
    };
    let places = materials.iter().zip(bases).zip(slots).map(&mut place).collect();
    (groups, places)
}

impl MapsUpload {
    pub fn new(build: &mut Build<'_>, materials: &[Material], reading: &Reading<'_>) -> Result<Self> {
        let base = |material| reading.passes.and_then(|_| Base::of(material));
        let bases: Vec<_> = materials.iter().map(base).collect();
        let sizes = brdf_map::sizes(materials.iter().zip(&bases).filter_map(|(m, base)| Some(base.as_ref()?.size(m))));
        let Classes { mut classes, slots } = Classes::within(materials, MAX_CLASSES - sizes.len());
        if classes.is_empty() {
            // Something to bind.
            let texel = std::sync::Arc::new(crate::Texture::scalar([1, 1], &[0.0])?);
            classes.push(Class { size: [1, 1], format: Format::Half1, layers: vec![texel] });
        }
        let (groups, places) = groups(materials, &bases, sizes, &slots);
        let places: Vec<_> = places.into_iter().map(|p| p.map(|(group, layer)| (classes.len() + group, layer))).collect();

        let mut uses = Uses::default();
        let mut records = Vec::with_capacity(materials.len());
        for (((material, slots), base), place) in materials.iter().zip(slots).zip(bases).zip(&places) {
            let mut slots = [slots.albedo, slots.specular, slots.normal, slots.roughness, *place];
            if let Some(base) = base {
                slots[2] = None;
                slots[3] = slots[3].filter(|_| base == Base::Normals);
            }
            for (uses, (class, _)) in uses.iter_mut().zip(slots).filter_map(|(uses, slot)| Some((uses, slot?))) {
                *uses |= 1 << class;
            }
            let [albedo, specular, normal, roughness, moments] = slots.map(code);
            records.push(Record {
                places: [albedo, specular, normal, roughness],
                tiling: material.maps.tiling,
                rule: rule(material),
                without: if matches!(material.model, Model::Vmf(_)) { 0.0 } else { 1.0 },
                moments,
                lobes: base.map_or(0, |base| brdf_map::lobes(base, Parameter::of(&material.model))),
                unused: 0,
            });
        }
        let classes = classes.iter().map(|class| upload(build, class)).collect::<Result<Vec<_>>>()?;
        let moments = groups.iter().map(|group| brdf_map::image(build, group)).collect::<Result<Vec<_>>>()?;
        let work = match reading.passes.filter(|_| !groups.is_empty()) {
            Some((map, mips)) => {
                let images: Vec<_> = classes.iter().map(|c| &c.image).chain(&moments).collect();
                let map = map.prepare(build, reading.samplers, &groups, &images, classes.len())?;
                let mips = mips.prepare(build, &map)?;
                Some((map, mips))
            }
            None => None,
        };
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let records = BufferUpload::new(build, "maps", usage, bytemuck::cast_slice(&records))?;
        Ok(Self { records, classes, moments, places, uses, work })
    }

    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> MapImages {
        let textures = self.classes.into_iter().map(|class| class.record(rec, bag));
        let mut classes: Vec<_> = textures.collect();
        classes.extend(self.moments);
        MapImages { records: self.records.record(rec, bag), classes, moments: self.places }
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

    /// The array of a material's moments, and its layer there.
    #[cfg(feature = "offline")]
    pub fn moments(&self, material: usize) -> Option<(&Image, u32)> {
        let (class, layer) = (*self.moments.get(material)?)?;
        Some((self.classes.get(class)?, layer as u32))
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
