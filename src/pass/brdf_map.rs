//! Pass 0b, continued: the lobe of each texel of a material's maps, as the filters with one lobe store it (Xu et al. 2017, section
//! 4; [`crate::moments`] is the f64 twin). Once a set of materials.

use crate::config::Filter;
use crate::distribution;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use crate::gpu::sampler::Samplers;
use crate::moments::{Base, Parameter};
use crate::pass::PassContext;
use crate::pass::maps::MapImages;
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
    own: &[D::COMBINED_IMAGE_SAMPLER, D::COMBINED_IMAGE_SAMPLER, D::STORAGE_IMAGE],
};

/// Sizes that the moments of one set of materials may have: beyond them the smallest take a larger one.
const MAX_SIZES: usize = 4;

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Push {
    layer: i32,
    normal_layer: i32,
    roughness_layer: i32,
    lobes: u32,
    spread: f32,
    rule: f32,
    most: f32,
}

/// The number by which `glsl/include/moments.glsl` knows a filter.
pub(crate) fn number(filter: Filter) -> u32 {
    match filter.stored() {
        Some(distribution::Filter::Fixed) => 1,
        Some(distribution::Filter::Toksvig) => 2,
        Some(distribution::Filter::Vmf1) => 3,
        _ => 0,
    }
}

/// What becomes of a material's lobes: LOBES_* of `glsl/include/moments.glsl`.
pub(crate) fn lobes(base: Base, parameter: Parameter) -> u32 {
    match (base, parameter) {
        (Base::Normals, _) => 0,
        (Base::Lobe { .. }, Parameter::Alpha) => 1,
        (Base::Lobe { .. }, Parameter::Exponent) => 2,
    }
}

/// Class and layer of a texture.
pub(crate) type Place = (usize, usize);

/// What one layer of moments is made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Source {
    pub normal: Option<Place>,
    pub roughness: Option<Place>,
    /// Of the roughness map, as `filter` has it.
    pub rule: [f32; 2],
    pub base: Base,
    pub parameter: Parameter,
}

/// Layers of moments of one size.
#[derive(Debug)]
pub(crate) struct Group {
    pub size: [u32; 2],
    pub sources: Vec<Source>,
}

/// The sizes of the arrays for moments of the sizes `wanted`; each of these fits one.
pub(crate) fn sizes(wanted: impl Iterator<Item = [u32; 2]>) -> Vec<[u32; 2]> {
    let mut sizes: Vec<[u32; 2]> = wanted.collect();
    sizes.sort_unstable_by_key(|[w, h]| (u64::from(*w) * u64::from(*h), *w));
    sizes.dedup();
    while sizes.len() > MAX_SIZES {
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

/// The image of a group, with room for all its mips.
pub(crate) fn image(build: &mut Build<'_>, group: &Group) -> Result<Image> {
    let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
    let [width, height] = group.size;
    let desc = ImageDesc {
        layers: Some(group.sources.len() as u32),
        levels: 1 + width.max(height).ilog2(),
        ..ImageDesc::new("moments", vk::Format::R32G32B32A32_SFLOAT, [width, height, 1], usage)
    };
    Image::new(build, desc)
}

pub(crate) struct Io<'a> {
    /// Textures, and behind them the moments, out.
    pub maps: &'a MapImages,
}

/// The sets and views of one recording.
pub(crate) struct Work {
    /// Class of each array, its layers and the views of its levels.
    pub arrays: Vec<(usize, Vec<vk::ImageView>)>,
    pushes: Vec<(usize, Push)>,
    sets: Sets,
}

pub(crate) struct BrdfMap(ComputePipeline);

impl BrdfMap {
    pub fn new(p: &mut PassContext<'_, '_>, filter: Filter) -> Result<Self> {
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, 0, &[number(filter)])?))
    }

    /// What the recording needs: `groups` of which the images are `classes`, from `first` on.
    pub fn prepare(
        &self,
        build: &mut Build<'_>,
        samplers: &Samplers,
        groups: &[Group],
        classes: &[&Image],
        first: usize,
    ) -> Result<Work> {
        let sets = self.0.sets(build, groups.iter().map(|g| g.sources.len()).sum())?;
        let (mut arrays, mut pushes) = (Vec::new(), Vec::new());
        for (class, group) in (first..).zip(groups) {
            let views = classes[class].level_views(build)?;
            for (layer, source) in group.sources.iter().enumerate() {
                let read = |place: Option<Place>| Resource::Sampled(classes[place.map_or(0, |p| p.0)], samplers.nearest);
                let resources = [read(source.normal), read(source.roughness), Resource::Storage(views[0])];
                write_set(&build.cx.device, sets.sets[pushes.len()], &resources);
                let of = |place: Option<Place>| place.map_or(-1, |p| p.1 as i32);
                let push = Push {
                    layer: layer as i32,
                    normal_layer: of(source.normal),
                    roughness_layer: of(source.roughness),
                    lobes: lobes(source.base, source.parameter),
                    spread: if let Base::Lobe { spread } = source.base { spread as f32 } else { 0.0 },
                    rule: source.rule[0],
                    most: source.rule[1],
                };
                pushes.push((class, push));
            }
            arrays.push((class, views));
        }
        Ok(Work { arrays, pushes, sets })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, work: &Work) {
        rec.begin(NAME);
        let first = work.arrays.first().map_or(0, |(class, _)| *class);
        (0..first).for_each(|i| rec.image(io.maps.class(i), Access::COMPUTE_SAMPLED));
        work.arrays.iter().for_each(|(class, _)| rec.overwrite(io.maps.class(*class), Access::COMPUTE_WRITE));
        rec.flush();
        for ((class, push), set) in work.pushes.iter().zip(&work.sets.sets) {
            self.0.bind_set(rec, *set, push);
            self.0.dispatch(rec, io.maps.class(*class).extent());
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}

impl Work {
    pub fn retire(self, bag: &mut Retired) {
        self.arrays.into_iter().flat_map(|(_, views)| views).for_each(|view| bag.push(Handle::View(view)));
        self.sets.retire(bag);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_have_few_sizes_and_each_fits() {
        let wanted = [[64, 64], [8, 128], [1024, 1024], [64, 64], [16, 16], [2, 2], [512, 1024]];
        let sizes = sizes(wanted.into_iter());
        assert!(sizes.len() <= MAX_SIZES && sizes.contains(&[1024, 1024]), "{sizes:?}");
        let groups: Vec<_> = sizes.into_iter().map(|size| Group { size, sources: vec![] }).collect();
        for [w, h] in wanted {
            let [width, height] = groups[fitting(&groups, [w, h]).unwrap()].size;
            assert!(width >= w && height >= h);
        }
        assert_eq!(groups[fitting(&groups, [512, 700]).unwrap()].size, [512, 1024]);
    }
}
