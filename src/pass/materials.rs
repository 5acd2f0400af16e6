//! Pass 0b: reflectance tables and importance tables, uploaded on change (Bagher 2011, section 3.3).

use crate::config::Estimator;
use crate::distribution::LobeFit;
use crate::distribution::fitter::Budget;
use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::pipeline::{Resource, Sets, set_layout, write_set};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Handle, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::upload::{BufferUpload, ImageUpload};
use crate::kinds::Kinds;
use crate::material::{MOST_KERNEL, Material};
use crate::pass::fits::{self, Packed};
use crate::pass::maps::{MapImages, MapsUpload, MomentWork, Reading};
use crate::reflectance::ladder::{Ladder, own_square};
use crate::reflectance::merl::{PHI_DIFF, THETA_DIFF, THETA_HALF};
use crate::reflectance::{Lobe, MerlTable, Model, atlas, bandwidth};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use std::sync::Arc;

/// Pass, label and set-up time name.
pub const NAME: &str = "materials";

/// Descriptor types of set 1 as `glsl/bridge/materials.glsl` declares them.
pub const BRIDGE: [vk::DescriptorType; 4] = [
    vk::DescriptorType::STORAGE_BUFFER,
    vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
    vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
    vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
];

/// Materials of a frame.
pub const MAX_MATERIALS: usize = 64;

/// Mirrors `MaterialRecord` in `glsl/bridge/materials.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Record {
    kind: [u32; 4],
    f0: [f32; 4],
    albedo: [f32; 4],
    importance: [f32; 4],
    /// Where its cells begin among the texture bandwidths; tiling.
    texture_bandwidth: [f32; 4],
}

/// What the shaders read.
pub(crate) struct MaterialImages {
    /// Materials that draws may name: fewer than records, of which lobes have some.
    pub count: u32,
    records: Buffer,
    tables: Image,
    importance: Image,
    density: Image,
    pub maps: MapImages,
    /// Of the lobes and the textures, if the frame predicts bandwidth.
    pub bandwidths: Option<Bandwidths>,
    /// Of all materials, if light is looked up.
    pub fits: Option<Buffer>,
    /// What these hold, material by material.
    #[cfg_attr(not(feature = "offline"), expect(dead_code, reason = "only `offline` reads them back"))]
    pub fitted: Vec<Option<Arc<LobeFit>>>,
}

/// Created and filled, not yet recorded.
pub(crate) struct MaterialsUpload {
    count: u32,
    records: BufferUpload,
    tables: ImageUpload,
    importance: ImageUpload,
    density: ImageUpload,
    maps: MapsUpload,
    bandwidths: Option<(ImageUpload, BufferUpload)>,
    fits: Option<BufferUpload>,
    fitted: Vec<Option<Arc<LobeFit>>>,
    pub kinds: Kinds,
}

/// What materials are prepared for.
pub(crate) struct Uploading<'a> {
    /// How maps are read.
    pub reading: Reading<'a>,
    /// How bandwidths are analysed, if the frame predicts it.
    pub analysis: Option<Analysis>,
    pub estimator: Estimator,
    /// Of fits that are not there yet.
    pub budget: Budget,
}

/// How the bandwidths of lobes and textures are found.
#[derive(Clone, Copy)]
pub(crate) struct Analysis {
    /// Details below this share of the largest do not count.
    pub eps: f64,
    /// As [`crate::Config::lobe_components`].
    pub lobe_components: Option<u32>,
}

/// What the prediction of bandwidth knows of the materials.
pub(crate) struct Bandwidths {
    /// Of the lobes, in cycles/radian.
    pub lobes: Image,
    /// Of the textures, in cycles per unit of the surface's coordinates: a 0 for materials without, then the cells of the others.
    pub textures: Buffer,
}

/// Where table number `i` of `count` stands in the atlas, and the atlas's size, in tables along theta_d and theta_h: as square
/// as can be, since a coordinate is rounded in proportion to the atlas.
fn place(i: usize, count: usize, limit: u32) -> Option<([u32; 2], [u32; 2])> {
    let per_side = limit as usize / THETA_DIFF;
    let columns = (1..=count.max(1)).find(|side| side * side >= count).unwrap_or(1);
    let rows = count.div_ceil(columns).max(1);
    (columns <= per_side).then(|| ([(i % columns) as u32, (i / columns) as u32], [columns as u32, rows as u32]))
}

/// The tables of all models, each stored once however many materials share it.
struct Tables<'a> {
    /// With the factor under which it is packed.
    all: Vec<(&'a MerlTable, f32)>,
    /// Of each model: its first table.
    slots: Vec<usize>,
}

impl<'a> Tables<'a> {
    fn of(materials: &'a [Material]) -> Self {
        let mut tables = Self { all: Vec::new(), slots: Vec::new() };
        let mut known: Vec<(*const u8, usize)> = Vec::new();
        for Material { model, .. } in materials {
            let (key, nodes): (*const u8, Vec<&MerlTable>) = match model {
                Model::Table(table) => (Arc::as_ptr(table).cast(), vec![table]),
                Model::Turned(turned) => (Arc::as_ptr(turned).cast(), turned.nodes().iter().map(Arc::as_ref).collect()),
                Model::Ggx(_) | Model::BlinnPhong(_) | Model::Vmf(_) => (std::ptr::null(), Vec::new()),
            };
            let found = known.iter().find(|k| k.0 == key && !nodes.is_empty()).map(|k| k.1);
            let slot = found.unwrap_or_else(|| {
                known.push((key, tables.all.len()));
                // Neighbours are interpolated, so that the tables of one material have one factor.
                let scale = nodes.iter().map(|t| t.packing_scale()).fold(1.0, f32::max);
                tables.all.extend(nodes.iter().map(|&t| (t, scale)));
                tables.all.len() - nodes.len()
            });
            tables.slots.push(slot);
        }
        tables
    }
}

/// As `glsl/bridge/materials.glsl` numbers kinds of reflectance.
fn number(model: &Model) -> u32 {
    match model {
        Model::Table(_) => 0,
        Model::Ggx(_) => 1,
        Model::BlinnPhong(_) => 2,
        Model::Vmf(_) => 3,
        Model::Turned(_) => 4,
    }
}

/// The records of `materials`, and behind them those of vMF lobes; `columns` is the width of the atlas in tables.
fn records(materials: &[Material], tables: &Tables<'_>, importance: &[[f32; 4]], columns: u32) -> Vec<Record> {
    let with = |v: DVec3, w: f64| v.extend(w).as_vec4().to_array();
    let mut lobes = Vec::new();
    let mut records: Vec<_> = materials
        .iter()
        .zip(&tables.slots)
        .zip(importance)
        .map(|((Material { model, .. }, &slot), &importance)| {
            let scale = tables.all.get(slot).map_or(1.0, |t| t.1);
            let (kind, slot) = (number(model), slot as u32);
            let record = |kind, f0, albedo| Record { kind, f0, albedo, importance, texture_bandwidth: [0.0; 4] };
            match model {
                Model::Table(_) => record([kind, slot % columns, slot / columns, 0], [1.0; 4], [1.0, 1.0, 1.0, scale]),
                Model::Ggx(g) => record([kind, 0, 0, 0], with(g.f0, g.alpha), with(g.albedo, 1.0)),
                Model::BlinnPhong(b) => record([kind, 0, 0, 0], with(b.specular, b.exponent), with(b.albedo, 1.0)),
                Model::Vmf(vmf) => {
                    let first = materials.len() + lobes.len();
                    let weight: f64 = vmf.lobes().iter().map(|l| l.weight).sum();
                    let facing: f64 = vmf.lobes().iter().map(|l| l.weight * l.mu.z).sum();
                    let lobe = |(l, peak): (&Lobe, &f64)| Record {
                        kind: [0; 4],
                        f0: with(l.mu, l.kappa),
                        albedo: [*peak as f32, l.weight as f32, 0.0, 0.0],
                        importance: [0.0; 4],
                        texture_bandwidth: [0.0; 4],
                    };
                    lobes.extend(vmf.lobes().iter().zip(vmf.peaks()).map(lobe));
                    let kind = [kind, first as u32, vmf.lobes().len() as u32, 0];
                    let sharpest = own_square(model).unwrap_or(1.0);
                    record(kind, with(DVec3::ONE, facing / weight), with(DVec3::ONE, sharpest))
                }
                Model::Turned(turned) => {
                    let kind = [kind, slot, turned.nodes().len() as u32, 0];
                    record(kind, with(DVec3::ONE, turned.nodes_per_radian()), [1.0, 1.0, 1.0, scale])
                }
            }
        })
        .collect();
    records.append(&mut lobes);
    records
}

/// The bandwidths of lobes and textures of `materials`, whose records learn where theirs are.
fn bandwidths(
    build: &mut Build<'_>,
    materials: &[Material],
    records: &mut [Record],
    Analysis { eps, lobe_components }: Analysis,
) -> Result<(ImageUpload, BufferUpload)> {
    let extent = [bandwidth::WIDTH as u32, (bandwidth::SIDE * materials.len()) as u32, 1];
    let desc = ImageDesc::new("lobe bandwidth", vk::Format::R32_SFLOAT, extent, vk::ImageUsageFlags::SAMPLED);
    let lobes = ImageUpload::new(build, desc, bytemuck::cast_slice(&atlas::lobe_bandwidths(materials, eps, lobe_components)))?;
    let mut cells = vec![0.0f32];
    for (material, record) in materials.iter().zip(records) {
        let [u, v] = material.maps.tiling;
        record.texture_bandwidth = [0.0, u, v, 0.0];
        if let Some(found) = material.texture_bandwidth(eps) {
            // Exact: 64 materials have fewer cells than 2^24.
            record.texture_bandwidth[0] = cells.len() as f32;
            cells.extend_from_slice(found.values());
        }
    }
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    Ok((lobes, BufferUpload::new(build, "texture bandwidth", usage, bytemuck::cast_slice(&cells))?))
}

impl MaterialsUpload {
    pub fn new(build: &mut Build<'_>, materials: &[Material], io: &Uploading<'_>) -> Result<Self> {
        let Uploading { reading, analysis, estimator, budget } = io;
        if materials.is_empty() || materials.len() > MAX_MATERIALS {
            return Err(Error::invalid("materials", format!("1 to {MAX_MATERIALS}"), materials.len()));
        }
        for (i, material) in materials.iter().enumerate() {
            material.validate().map_err(|e| match e {
                Error::InvalidInput { field, expected, got } => Error::invalid(format!("materials[{i}].{field}"), expected, got),
                other => other,
            })?;
        }
        let tables = Tables::of(materials);
        let limit = build.cx.limits.max_image_dimension3_d;
        let size = place(0, tables.all.len(), limit)
            .ok_or_else(|| Error::invalid("materials", format!("tables that fit a 3-D image of side {limit}"), tables.all.len()))?
            .1;
        let packed: Vec<_> = tables.all.iter().map(|(table, scale)| table.packed_at(*scale)).collect();
        let kernel = if reading.widened { MOST_KERNEL } else { 0.0 };
        let ladders: Vec<_> = materials.iter().map(|m| Ladder::of(m, kernel)).collect();
        let firsts = ladders.iter().scan(0, |next, ladder| Some(std::mem::replace(next, *next + ladder.steps())));
        let places: Vec<_> = ladders.iter().zip(firsts).map(|(ladder, first)| ladder.record(first)).collect();
        let mut records = records(materials, &tables, &places, size[0]);
        let maps = MapsUpload::new(build, materials, reading)?;
        let fits = match estimator.looks_up() {
            true => fits::of(materials, &maps.found, reading.widened, *budget),
            false => vec![None; materials.len()],
        };
        let packed_fits = Packed::of(&fits);
        records.iter_mut().zip(&packed_fits.firsts).for_each(|(record, first)| record.kind[3] = *first);
        let models = materials.iter().fold(0, |bits, m| bits | 1 << number(&m.model));
        let kinds = Kinds::of(materials, &maps, &packed_fits, reading.filter, if estimator.looks_up() { models } else { 0 });
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let fit_upload = estimator
            .looks_up()
            .then(|| BufferUpload::new(build, "lobe fits", storage, bytemuck::cast_slice(&packed_fits.words)))
            .transpose()?;
        let bandwidths = analysis.map(|analysis| bandwidths(build, materials, &mut records, analysis)).transpose()?;
        let left: Vec<_> = fits.iter().map(|fit| fit.as_deref().filter(|_| estimator.has_residual())).collect();
        let importance = atlas::importance_tables(materials, &ladders, &left);
        let image = |name, format, extent| ImageDesc::new(name, format, extent, vk::ImageUsageFlags::SAMPLED);
        let table_extent = [PHI_DIFF as u32, THETA_DIFF as u32 * size[0], THETA_HALF as u32 * size[1]];
        let texels = atlas::tables(&packed, size);
        let (cells, cell_extent) = atlas::cells(&importance);
        let (density, density_extent) = atlas::density(&importance);
        let cast = bytemuck::cast_slice::<u32, u8>;
        Ok(Self {
            count: materials.len() as u32,
            records: BufferUpload::new(build, "materials", storage, bytemuck::cast_slice(&records))?,
            tables: ImageUpload::new(build, image("tables", vk::Format::E5B9G9R9_UFLOAT_PACK32, table_extent), cast(&texels))?,
            importance: ImageUpload::new(
                build,
                image("importance", vk::Format::R32G32_UINT, cell_extent),
                bytemuck::cast_slice(&cells),
            )?,
            density: ImageUpload::new(
                build,
                image("importance density", vk::Format::R16_SFLOAT, density_extent),
                bytemuck::cast_slice(&density),
            )?,
            maps,
            bandwidths,
            fits: fit_upload,
            fitted: fits,
            kinds,
        })
    }

    /// The sets of the passes over the maps, which run after [`Self::record`].
    pub fn work(&mut self) -> Option<MomentWork> {
        self.maps.work.take()
    }

    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> MaterialImages {
        MaterialImages {
            count: self.count,
            records: self.records.record(rec, bag),
            tables: self.tables.record(rec, bag),
            importance: self.importance.record(rec, bag),
            density: self.density.record(rec, bag),
            maps: self.maps.record(rec, bag),
            bandwidths: self
                .bandwidths
                .map(|(lobes, textures)| Bandwidths { lobes: lobes.record(rec, bag), textures: textures.record(rec, bag) }),
            fits: self.fits.map(|fits| fits.record(rec, bag)),
            fitted: self.fitted,
        }
    }
}

impl MaterialImages {
    /// Declares everything read by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        rec.buffer(&self.records, Access::COMPUTE_READ);
        [&self.tables, &self.importance, &self.density].into_iter().for_each(|i| rec.image(i, Access::COMPUTE_SAMPLED));
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        states.forget(self.records.handle);
        self.records.retire(bag);
        let (lobes, textures) = self.bandwidths.map(|b| (b.lobes, b.textures)).unzip();
        for buffer in textures.into_iter().chain(self.fits) {
            states.forget(buffer.handle);
            buffer.retire(bag);
        }
        for image in [self.tables, self.importance, self.density].into_iter().chain(lobes) {
            states.forget(image.handle);
            image.retire(bag);
        }
        self.maps.retire(states, bag);
    }
}

/// Set 1 for the passes that read materials.
pub(crate) struct MaterialBridge {
    pub layout: vk::DescriptorSetLayout,
    sets: Sets,
}

impl MaterialBridge {
    pub fn new(build: &mut Build<'_>, slots: usize) -> Result<Self> {
        let layout = set_layout(build, vk::ShaderStageFlags::COMPUTE, &BRIDGE)?;
        Ok(Self { layout, sets: Sets::new(build, layout, &BRIDGE, slots)? })
    }

    /// Set 1 of this slot over `images`.
    pub fn write(&self, rec: &Recorder<'_>, images: &MaterialImages, samplers: &Samplers) -> vk::DescriptorSet {
        let set = self.sets.sets[rec.slot];
        let resources = [
            Resource::Buffer(&images.records),
            Resource::Sampled(&images.tables, samplers.linear),
            Resource::Sampled(&images.importance, samplers.nearest),
            Resource::Sampled(&images.density, samplers.linear),
        ];
        write_set(&rec.cx.device, set, &resources);
        set
    }

    pub fn retire(self, bag: &mut Retired) {
        self.sets.retire(bag);
        bag.push(Handle::SetLayout(self.layout));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_fill_the_atlas_without_overlap() {
        for (count, limit) in [(1, 256), (4, 256), (3, 256), (64, 2048), (0, 256)] {
            let mut seen = std::collections::HashSet::new();
            for i in 0..count {
                let (at, size) = place(i, count, limit).unwrap();
                assert!(at[0] < size[0] && at[1] < size[1] && seen.insert(at));
                assert!(size[0] * 90 <= limit && size[1] * 90 <= limit);
            }
        }
        assert_eq!(place(0, 5, 256), None);
    }
}
