//! Pass 0b, continued: the lobes of each texel of a material's maps, as the filters store them (Xu et al. 2017, section 4;
//! [`crate::moments`] is the f64 twin). Once a set of materials.

use crate::config::Config;
use crate::distribution::clusters::Layout;
use crate::distribution::expectation::GAUSSIANS;
use crate::distribution::filter::Storage;
use crate::distribution::literal::SPREADS;
use crate::distribution::{Cells, Filter, MOST_BASE_LOBES, vmf};
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use crate::gpu::sampler::Samplers;
use crate::moments::{Base, Parameter};
use crate::pass::PassContext;
use crate::pass::kept::Own;
use crate::pass::maps::MapImages;
use crate::reflectance::Lobe;
use crate::texture::halved;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "brdf_map";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: false,
    materials: false,
    own: &[D::COMBINED_IMAGE_SAMPLER, D::COMBINED_IMAGE_SAMPLER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE, D::STORAGE_BUFFER],
};

/// Sizes that the moments of one set of materials may have: beyond them the smallest take a larger one.
const MAX_SIZES: usize = 4;
/// Where cells have arrays of their own.
const MAX_SIZES_OF_CELLS: usize = 2;

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Push {
    base: [[f32; 4]; MOST_BASE_LOBES],
    weights: [f32; MOST_BASE_LOBES],
    count: u32,
    lobes: u32,
    layer: i32,
    normal_layer: i32,
    roughness_layer: i32,
    colour_layer: i32,
    rule: f32,
    most: f32,
    upright: u32,
}

/// The number by which `glsl/include/moments.glsl` knows a filter.
pub(crate) fn number(filter: Filter) -> u32 {
    filter as u32
}

/// What a concentration is of: LOBES_* of `glsl/include/moments.glsl`.
pub(crate) fn lobes(filtered: bool, parameter: Parameter) -> u32 {
    match (filtered, parameter) {
        (false, _) => 0,
        (true, Parameter::Alpha) => 1,
        (true, Parameter::Exponent) => 2,
        (true, Parameter::Ggx) => 3,
    }
}

/// Class and layer of a texture.
pub(crate) type Place = (usize, usize);

/// What moments are made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Source {
    pub normal: Option<Place>,
    pub roughness: Option<Place>,
    /// Of specular colours, where clusters keep these.
    pub colours: Option<Place>,
    /// Of the roughness map, as `filter` has it.
    pub rule: [f32; 2],
    pub base: Base,
    pub parameter: Parameter,
    /// In the table.
    pub clusters: Own,
}

/// How many layers a source takes: of moments, and of cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layers {
    pub moments: usize,
    pub cells: usize,
}

impl Layers {
    /// As `glsl/include/moments.glsl` says.
    pub fn of(filter: Filter, base: &Base, clusters: Own) -> Self {
        let count = base.lobes().len();
        let (merged, each, cells) = match filter.storage() {
            None | Some(Storage::Cells(Cells::One)) => (true, 1, 0),
            Some(Storage::Directions { apart }) => (!apart, 1, 0),
            Some(Storage::Slopes { apart }) => (!apart, 2, 0),
            Some(Storage::Cells(cells)) => (false, 1, cells.count()),
            Some(Storage::Clusters | Storage::Peaks(_) | Storage::Base | Storage::Gaussians(_)) => (false, 1, 0),
        };
        let cells = match filter.storage() {
            Some(Storage::Clusters) => {
                let layout = Layout { normals: !base.upright(), colours: clusters.coloured };
                layout.layers(clusters.count as usize)
            }
            // With normals in layers behind all.
            Some(Storage::Peaks(peaks)) => peaks * if base.upright() { 1 } else { 2 },
            Some(Storage::Gaussians(_)) => GAUSSIANS * if base.upright() { 1 } else { 2 },
            // With their spreads, four in a layer, and the normals below lobes that are about other directions.
            _ => cells + cells / 4 + if base.upright() { 0 } else { cells },
        };
        let lobes = if merged { count.min(1) } else { count };
        let beside = usize::from(!base.upright()) + usize::from(clusters.coloured);
        Self { moments: beside + each * lobes, cells: if count > 0 { cells } else { 0 } }
    }
}

/// Moments of one size.
#[derive(Debug)]
pub(crate) struct Group {
    pub size: [u32; 2],
    /// With the first of the layers of each.
    pub sources: Vec<(Source, Layers)>,
    /// All layers.
    pub layers: Layers,
}

impl Group {
    pub fn new(size: [u32; 2]) -> Self {
        Self { size, sources: Vec::new(), layers: Layers::default() }
    }

    /// The first layers of `source`, which takes `layers` unless it is here already.
    pub fn place(&mut self, source: Source, layers: Layers) -> Layers {
        if let Some((_, first)) = self.sources.iter().find(|(known, _)| *known == source) {
            return *first;
        }
        let first = self.layers;
        self.sources.push((source, first));
        self.layers = Layers { moments: first.moments + layers.moments, cells: first.cells + layers.cells };
        first
    }

    /// Images of moments and, where there are some, of cells, clusters, peaks or Gaussians, with room for the mips that `filter` reads; without
    /// the latter if these are `filled` from the host.
    pub fn images(&self, build: &mut Build<'_>, filter: Filter, filled: bool) -> Result<Vec<Image>> {
        let [width, height] = self.size;
        let levels = 1 + width.max(height).ilog2();
        // Beside cells only a mean normal has mips.
        let flat = filter.keeps_base() && self.sources.iter().all(|(source, _)| source.base.upright());
        let mut images = vec![image(build, "moments", self.size, self.layers.moments, if flat { 1 } else { levels })?];
        if self.layers.cells > 0 && !filled {
            images.push(coarser(build, filter, self.size, self.layers.cells)?);
        }
        Ok(images)
    }
}

/// What mips from level 1 on are, in an image of their own, or all levels of Gaussians. Peaks are filled from the host, and Gaussians
/// that it knows.
pub(crate) fn coarser_desc(filter: Filter, size: [u32; 2], layers: usize) -> ImageDesc {
    let levels = size[0].max(size[1]).ilog2().max(1);
    let filled = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
    let of_base = desc("gaussians", size, layers, 1 + size[0].max(size[1]).ilog2());
    let desc = desc("cells", halved(size), layers, levels);
    match filter.storage() {
        Some(Storage::Clusters) => ImageDesc { name: "clusters", format: vk::Format::R16G16B16A16_SFLOAT, ..desc },
        Some(Storage::Peaks(_)) => ImageDesc { name: "peaks", usage: filled, ..desc },
        Some(Storage::Gaussians(_)) => of_base,
        _ => desc,
    }
}

/// That image, of a map of `size`.
pub(crate) fn coarser(build: &mut Build<'_>, filter: Filter, size: [u32; 2], layers: usize) -> Result<Image> {
    Image::new(build, coarser_desc(filter, size, layers))
}

fn desc(name: &'static str, [width, height]: [u32; 2], layers: usize, levels: u32) -> ImageDesc {
    let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
    let desc = ImageDesc::new(name, vk::Format::R32G32B32A32_SFLOAT, [width, height, 1], usage);
    ImageDesc { layers: Some(layers as u32), levels, ..desc }
}

fn image(build: &mut Build<'_>, name: &'static str, size: [u32; 2], layers: usize, levels: u32) -> Result<Image> {
    Image::new(build, desc(name, size, layers, levels))
}

/// The sizes of the arrays for moments of the sizes `wanted`; each of these fits one.
pub(crate) fn sizes(wanted: impl Iterator<Item = [u32; 2]>, cells: bool) -> Vec<[u32; 2]> {
    let most = if cells { MAX_SIZES_OF_CELLS } else { MAX_SIZES };
    let mut sizes: Vec<[u32; 2]> = wanted.collect();
    sizes.sort_unstable_by_key(|[w, h]| (u64::from(*w) * u64::from(*h), *w));
    sizes.dedup();
    while sizes.len() > most {
        let smallest = sizes.remove(0);
        sizes[0] = [sizes[0][0].max(smallest[0]), sizes[0][1].max(smallest[1])];
    }
    sizes.dedup();
    sizes
}

/// The group of `groups` that takes moments of `size` with the least area.
pub(crate) fn fitting(groups: &[Group], size: [u32; 2]) -> Option<usize> {
    let fits = |group: &Group| group.size[0] >= size[0] && group.size[1] >= size[1];
    let area = |i: &usize| u64::from(groups[*i].size[0]) * u64::from(groups[*i].size[1]);
    (0..groups.len()).filter(|i| fits(&groups[*i])).min_by_key(area)
}

pub(crate) struct Io<'a> {
    /// Textures, and behind them the moments, out.
    pub maps: &'a MapImages,
}

/// Arrays of one group: classes and views of their levels.
pub(crate) struct Arrays {
    pub moments: (usize, Vec<vk::ImageView>),
    pub cells: Option<(usize, Vec<vk::ImageView>)>,
}

/// The sets and views of one recording.
pub(crate) struct Work {
    pub arrays: Vec<Arrays>,
    /// The first class that is written.
    first: usize,
    pushes: Vec<(usize, Push)>,
    sets: Sets,
    /// [`SPREADS`].
    spreads: Buffer,
}

pub(crate) struct BrdfMap {
    pipeline: ComputePipeline,
    /// Whether what is in the second image of a group are cells.
    divides: bool,
}

impl BrdfMap {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config) -> Result<Self> {
        let constants = [number(config.filter), config.effective_rule() as u32];
        let pipeline = ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, 0, &constants)?;
        Ok(Self { pipeline, divides: config.filter.has_cells() })
    }

    /// What the recording needs: `groups` of which the images are `classes`, from `first` on, as [`Group::images`] has them.
    pub fn prepare(
        &self,
        build: &mut Build<'_>,
        samplers: &Samplers,
        groups: &[Group],
        classes: &[&Image],
        first: usize,
    ) -> Result<Work> {
        let sets = self.pipeline.sets(build, groups.iter().map(|g| g.sources.len()).sum())?;
        let entries: &[u8] = bytemuck::cast_slice(SPREADS.entries());
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let mut spreads = Buffer::new(build, "spreads", entries.len() as u64, usage, Location::Upload)?;
        spreads.bytes_mut().copy_from_slice(entries);
        let (mut arrays, mut pushes, mut class) = (Vec::new(), Vec::new(), first);
        for group in groups {
            let views = classes[class].level_views(build)?;
            for (source, layers) in &group.sources {
                let read = |place: Option<Place>| Resource::Sampled(classes[place.map_or(0, |p| p.0)], samplers.nearest);
                let [normal, roughness, colours] = [source.normal, source.roughness, source.colours].map(read);
                let resources = [normal, roughness, colours, Resource::Storage(views[0]), Resource::Buffer(&spreads)];
                write_set(&build.cx.device, sets.sets[pushes.len()], &resources);
                pushes.push((class, Push::of(source, layers)));
            }
            let cells = class + 1;
            let divides = self.divides && group.layers.cells > 0;
            let of_cells = if divides { Some((cells, classes[cells].level_views(build)?)) } else { None };
            arrays.push(Arrays { moments: (class, views), cells: of_cells });
            class += 1 + usize::from(group.layers.cells > 0);
        }
        Ok(Work { arrays, first, pushes, sets, spreads })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, work: &Work) {
        rec.begin(NAME);
        (0..work.first).for_each(|i| rec.image(io.maps.class(i), Access::COMPUTE_SAMPLED));
        work.arrays.iter().for_each(|a| rec.overwrite(io.maps.class(a.moments.0), Access::COMPUTE_WRITE));
        rec.flush();
        for ((class, push), set) in work.pushes.iter().zip(&work.sets.sets) {
            self.pipeline.bind_set(rec, *set, push);
            self.pipeline.dispatch(rec, io.maps.class(*class).extent());
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipeline.retire(bag);
    }
}

impl Push {
    fn of(source: &Source, layers: &Layers) -> Self {
        let of = |place: Option<Place>| place.map_or(-1, |p| p.1 as i32);
        let lobes_of_base = source.base.lobes();
        let mut push = Self {
            base: [[0.0; 4]; MOST_BASE_LOBES],
            weights: weights(lobes_of_base),
            count: lobes_of_base.len() as u32,
            lobes: lobes(!lobes_of_base.is_empty(), source.parameter),
            layer: layers.moments as i32,
            normal_layer: of(source.normal),
            roughness_layer: of(source.roughness),
            colour_layer: of(source.colours),
            rule: source.rule[0],
            most: source.rule[1],
            upright: u32::from(source.base.upright()),
        };
        for (base, lobe) in push.base.iter_mut().zip(lobes_of_base) {
            *base = lobe.mu.extend(vmf::spread(lobe.kappa)).as_vec4().to_array();
        }
        push
    }
}

/// Of lobes, as shaders read them.
pub(crate) fn weights(lobes: &[Lobe]) -> [f32; MOST_BASE_LOBES] {
    std::array::from_fn(|i| lobes.get(i).map_or(0.0, |lobe| lobe.weight as f32))
}

impl Work {
    pub fn retire(self, bag: &mut Retired) {
        let views = self.arrays.into_iter().flat_map(|a| a.moments.1.into_iter().chain(a.cells.into_iter().flat_map(|c| c.1)));
        views.for_each(|view| bag.push(Handle::View(view)));
        self.sets.retire(bag);
        self.spreads.retire(bag);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_few_sizes_and_each_fits() {
        let wanted = [[64, 64], [8, 128], [1024, 1024], [64, 64], [16, 16], [2, 2], [512, 1024]];
        assert_eq!(super::sizes(wanted.into_iter(), true), [[512, 1024], [1024, 1024]]);
        let sizes = sizes(wanted.into_iter(), false);
        assert!(sizes.len() <= MAX_SIZES && sizes.contains(&[1024, 1024]), "{sizes:?}");
        let groups: Vec<_> = sizes.into_iter().map(Group::new).collect();
        for [w, h] in wanted {
            let [width, height] = groups[fitting(&groups, [w, h]).unwrap()].size;
            assert!(width >= w && height >= h);
        }
        assert_eq!(groups[fitting(&groups, [512, 700]).unwrap()].size, [512, 1024]);
    }
}
