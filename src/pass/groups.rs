//! Which materials' moments share images, by their size, and which of these are filled from the host.

use crate::config::Bins;
use crate::distribution::Filter;
use crate::distribution::filter::Storage;
use crate::error::Result;
use crate::gpu::retire::Build;
use crate::gpu::upload::ImageUpload;
use crate::material::Material;
use crate::moments::{Base, Parameter};
use crate::pass::brdf_map::{self, Group, Layers, Source};
use crate::pass::kept::{self, Mixtures, Own};
use crate::pass::map_record::rule;
use crate::pass::maps::Reading;
use crate::pass::mixtures;
use crate::texture::Slots;

/// A material's group, the first of its layers there and how many there are.
pub(crate) struct GroupPlace {
    pub group: usize,
    pub first: Layers,
    pub layers: Layers,
}

/// The moments of `materials`, of which `bases` say what is filtered: one group for each size, and each material's place.
/// Cells of objects are none of the group's.
pub(crate) fn groups(
    materials: &[Material],
    bases: &[Option<Base>],
    sizes: Vec<[u32; 2]>,
    slots: &[Slots],
    clusters: &[Own],
    reading: &Reading<'_>,
) -> (Vec<Group>, Vec<Option<GroupPlace>>) {
    let mut groups: Vec<_> = sizes.into_iter().map(Group::new).collect();
    let mut place = |i: usize| {
        let (material, base, slots, clusters) = (materials.get(i)?, (*bases.get(i)?)?, slots.get(i)?, *clusters.get(i)?);
        let group = brdf_map::fitting(&groups, base.size(material))?;
        let roughness = base.roughness(material).and(slots.roughness);
        let parameter = Parameter::of(&material.model);
        let colours = slots.specular.filter(|_| clusters.coloured);
        let source = Source { normal: slots.normal, roughness, colours, rule: rule(material), base, parameter, clusters };
        let layers = Layers::of(reading.filter, &base, clusters);
        let cells = if reading.bins == Bins::Camera { 0 } else { layers.cells };
        Some(GroupPlace { group, first: groups.get_mut(group)?.place(source, Layers { cells, ..layers }), layers })
    };
    let places = (0..materials.len()).map(&mut place).collect();
    (groups, places)
}

/// Materials of group `i` with the first of their layers of cells, one of each.
pub(crate) fn of_group(places: &[Option<GroupPlace>], i: usize) -> Vec<(usize, usize)> {
    let here = |(number, place): (usize, &Option<GroupPlace>)| {
        let place = place.as_ref().filter(|place| place.group == i && place.layers.cells > 0)?;
        Some((number, place.first.cells))
    };
    let mut sources: Vec<_> = places.iter().enumerate().filter_map(here).collect();
    sources.sort_by_key(|source| source.1);
    sources.dedup_by_key(|source| source.1);
    sources
}

/// Of each of `groups` whether the device fits its mixtures: not those of which materials bring some, nor more than it has room for.
pub(crate) fn fitted(
    build: &Build<'_>,
    materials: &[Material],
    groups: &[Group],
    places: &[Option<GroupPlace>],
    reading: &Reading<'_>,
) -> Vec<bool> {
    let pass = reading.passes.and_then(|passes| passes.3.as_ref());
    let brought = |(i, _): &(usize, usize)| {
        let known = materials.get(*i).and_then(|m| m.gaussians.as_ref());
        known.is_some_and(|known| Some(known.fit()) == reading.filter.gaussians())
    };
    let of = |(i, group)| pass.is_some() && !of_group(places, i).iter().any(brought) && mixtures::fits(&build.cx.limits, group);
    groups.iter().enumerate().map(of).collect()
}

/// The images of `groups` that are filled from the host: of peaks or of Gaussians, if the filter has some that it knows.
pub(crate) fn filled(
    build: &mut Build<'_>,
    materials: &[Material],
    groups: &[Group],
    places: &[Option<GroupPlace>],
    (mixtures, fitted): (&[Option<Mixtures>], &[bool]),
    filter: Filter,
) -> Result<Vec<Option<ImageUpload>>> {
    if !matches!(filter.storage(), Some(Storage::Peaks(_) | Storage::Gaussians(_))) {
        return Ok(groups.iter().map(|_| None).collect());
    }
    let mut image = |(i, (group, fitted)): (usize, (&Group, &bool))| {
        if group.layers.cells == 0 || *fitted {
            return Ok(None);
        }
        let sources = of_group(places, i);
        let desc = brdf_map::coarser_desc(filter, group.size, group.layers.cells);
        let texels = if let Some(Storage::Peaks(count)) = filter.storage() {
            let sources: Vec<_> = sources.iter().filter_map(|(i, first)| Some((materials.get(*i)?, *first))).collect();
            kept::peaks(&desc, group.size, count, &sources)
        } else {
            kept::gaussians(&desc, &mixed(mixtures, &sources))
        };
        Ok(Some(ImageUpload::new(build, desc, &texels)?))
    };
    groups.iter().zip(fitted).enumerate().map(&mut image).collect()
}

/// Of materials in the numbers `sources` their mixtures, with the first of their layers.
pub(crate) fn mixed<'a>(mixtures: &'a [Option<Mixtures>], sources: &[(usize, usize)]) -> Vec<(&'a Mixtures, usize)> {
    sources.iter().filter_map(|(i, first)| Some((mixtures.get(*i)?.as_ref()?, *first))).collect()
}
