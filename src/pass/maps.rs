//! Materials' textures on the device: layers of arrays by size and format, and where each material's maps are.

use crate::config::Bins;
use crate::distribution::Filter;
use crate::distribution::effective::Rule;
use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::upload::{BufferUpload, ImageUpload};
use crate::material::Material;
use crate::moments::{Base, BaseLobes};
use crate::pass::brdf_map::{self, BrdfMap, Group, Place};
use crate::pass::cluster_moments::{self, ClusterMoments};
use crate::pass::groups::{self, GroupPlace};
use crate::pass::kept::{Mixtures, Table};
use crate::pass::map_record::Record;
use crate::pass::mixtures;
use crate::pass::vmf_mips::{self, VmfMips};
use crate::texture::classes::MAX_CLASSES;
use crate::texture::{Class, Classes, Format};
use ash::vk;

/// Classes that hold albedo, specular, normal and roughness maps, moments and cells, one bit each.
pub(crate) type Uses = [u32; 6];

/// The passes over the maps of materials: the third if the filter has clusters, the last if it has mixtures that are fitted a level at
/// a time.
pub(crate) type MomentPasses = (BrdfMap, VmfMips, Option<ClusterMoments>, Option<mixtures::Mixtures>);

/// What their recordings need.
pub(crate) type MomentWork = (brdf_map::Work, vmf_mips::Work, Option<cluster_moments::Work>, Option<mixtures::Work>);

/// What the `filter` pass reads.
pub(crate) struct MapImages {
    records: Buffer,
    /// Of all materials.
    clusters: Buffer,
    /// Textures, and behind them moments.
    classes: Vec<Image>,
    /// Where each material's moments are.
    #[cfg_attr(not(feature = "offline"), expect(dead_code, reason = "only `offline` reads them back"))]
    moments: Vec<Option<MomentsPlace>>,
    /// What goes into the cells of each material's objects.
    divided: Vec<Option<Divided>>,
}

/// Where a material's moments are: class, first layer and number of layers, and the same of its cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MomentsPlace {
    pub moments: (Place, usize),
    pub cells: Option<(Place, usize)>,
}

/// What goes into the cells of a material's objects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Divided {
    /// Classes of its moments and of the cells, one of each for all materials of a size.
    pub moments: usize,
    pub cells: usize,
    /// Of the moments.
    pub size: [u32; 2],
    pub lobes: vmf_mips::Lobes,
    /// Of an object's cells.
    pub layers: usize,
}

/// An array and layers of it: of moments and of cells.
#[cfg(feature = "offline")]
pub(crate) type MomentArrays<'a> = [Option<(&'a Image, std::ops::Range<u32>)>; 2];

/// What textures and their moments are read with.
pub(crate) struct Reading<'a> {
    pub filter: Filter,
    pub bins: Bins,
    /// How a base lobe counts.
    pub rule: Rule,
    /// Whether the mesh's curvature widens lobes.
    pub widened: bool,
    /// There if the filter stores moments.
    pub passes: Option<&'a MomentPasses>,
    pub samplers: &'a Samplers,
}

/// Created and filled, not yet recorded.
pub(crate) struct MapsUpload {
    records: BufferUpload,
    clusters: BufferUpload,
    classes: Vec<ImageUpload>,
    moments: Vec<Made>,
    places: Vec<Option<MomentsPlace>>,
    divided: Vec<Option<Divided>>,
    /// Of each material, whether the filter finds its lobes.
    pub found: Vec<bool>,
    pub uses: Uses,
    /// The most clusters that a material has, at least 1.
    pub most_clusters: u32,
    /// Whether clusters of some keep colours.
    pub coloured: bool,
    pub work: Option<MomentWork>,
}

/// An image behind the textures: written by the passes, or filled.
enum Made {
    Written(Image),
    Filled(ImageUpload),
}

impl Made {
    fn image(&self) -> &Image {
        match self {
            Self::Written(image) => image,
            Self::Filled(upload) => &upload.image,
        }
    }

    fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> Image {
        match self {
            Self::Written(image) => image,
            Self::Filled(upload) => upload.record(rec, bag),
        }
    }
}

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
pub(super) fn code(place: Option<Place>) -> u32 {
    place.map_or(0, |(class, layer)| (layer << 3 | class) as u32 + 1)
}

/// Of each of `materials` what has to be known of it to make the cells of an object of it. Moments and cells of `groups` are behind
/// `first` classes of textures.
fn divided(
    materials: &[Material],
    bases: &[Option<Base>],
    places: &[Option<MomentsPlace>],
    groups: &[Group],
    first: usize,
) -> Result<Vec<Option<Divided>>> {
    let mut all = Vec::new();
    for (i, ((material, base), place)) in materials.iter().zip(bases).zip(places).enumerate() {
        let of_objects = place.and_then(|p| Some((p.moments.0, p.cells?))).zip(*base);
        let Some((((moments, layer), ((cells, _), layers)), base)) = of_objects else {
            all.push(None);
            continue;
        };
        if material.maps.tiling != [1.0; 2] {
            let (field, got) = (format!("materials[{i}].maps.tiling"), format!("{:?}", material.maps.tiling));
            return Err(Error::invalid(field, "[1.0, 1.0], as bins are camera", got));
        }
        let size = groups.get(moments - first).map_or([1; 2], |group| group.size);
        all.push(Some(Divided { moments, cells, size, lobes: vmf_mips::Lobes::of(&base, layer), layers }));
    }
    Ok(all)
}

impl MapsUpload {
    pub fn new(build: &mut Build<'_>, materials: &[Material], reading: &Reading<'_>) -> Result<Self> {
        let filters = reading.passes.is_some();
        let base = |material| if filters { Base::of(material, reading.rule) } else { None };
        let bases: Vec<_> = materials.iter().map(base).collect();
        let wanted = materials.iter().zip(&bases).filter_map(|(m, base)| Some(base.as_ref()?.size(m)));
        let sizes = brdf_map::sizes(wanted, reading.filter.has_coarser());
        let arrays = sizes.len() * (1 + usize::from(reading.filter.has_coarser()));
        let Classes { mut classes, slots } = Classes::within(materials, MAX_CLASSES - arrays);
        if classes.is_empty() {
            // Something to bind.
            let texel = std::sync::Arc::new(crate::Texture::scalar([1, 1], &[0.0])?);
            classes.push(Class { size: [1, 1], format: Format::Half1, layers: vec![texel] });
        }
        let table = Table::of(materials, &bases, reading.filter);
        let (groups, places) = groups::groups(materials, &bases, sizes, &slots, &table.of, reading);
        let fitted = groups::fitted(build, materials, &groups, &places, reading);
        let of_places = |place: &Option<GroupPlace>| {
            let group = place.as_ref()?.group;
            Some((groups.get(group)?.size, *fitted.get(group)?))
        };
        let of_places: Vec<_> = places.iter().map(of_places).collect();
        let known = Mixtures::of(materials, &bases, &of_places, reading.filter);
        let filled = groups::filled(build, materials, &groups, &places, (&known, &fitted), reading.filter)?;
        let starts = |(i, group)| Mixtures::starts(group, &groups::mixed(&known, &groups::of_group(&places, i)));
        let starts: Vec<_> = groups.iter().enumerate().map(starts).collect();
        let camera = reading.bins == Bins::Camera;
        // Cells are behind the moments of their group, those of objects behind all.
        let firsts: Vec<_> = groups
            .iter()
            .scan(classes.len(), |next, group| Some(std::mem::replace(next, *next + 1 + usize::from(group.layers.cells > 0))))
            .collect();
        let place = |GroupPlace { group, first, layers }: GroupPlace| {
            let class = *firsts.get(group)?;
            let of_cells = if camera { classes.len() + groups.len() + group } else { class + 1 };
            let cells = (layers.cells > 0).then_some(((of_cells, first.cells), layers.cells));
            Some(MomentsPlace { moments: ((class, first.moments), layers.moments), cells })
        };
        let places: Vec<_> = places.into_iter().map(|p| p.and_then(place)).collect();

        let divided = if camera { divided(materials, &bases, &places, &groups, classes.len())? } else { Vec::new() };
        let (mut uses, mut found) = (Uses::default(), Vec::new());
        let mut records = Vec::with_capacity(materials.len());
        let shared = table
            .of
            .iter()
            .zip(&known)
            .map(|(own, known)| known.as_ref().map_or([own.first, own.count, u32::from(own.coloured), 0], Mixtures::shared));
        for ((((material, slots), base), place), shared) in materials.iter().zip(slots).zip(bases).zip(&places).zip(shared) {
            let (moments, cells) = (place.map(|p| p.moments.0), place.and_then(|p| p.cells.map(|c| c.0)));
            let mut slots = [slots.albedo, slots.specular, slots.normal, slots.roughness, moments, cells];
            if let Some(base) = base {
                slots[2] = None;
                slots[3] = slots[3].filter(|_| base == Base::Normals);
            }
            for (uses, (class, _)) in uses.iter_mut().zip(slots).filter_map(|(uses, slot)| Some((uses, slot?))) {
                *uses |= 1 << class;
            }
            // Without maps a lobe about the normal is found as it is.
            let lone =
                BaseLobes::of(&material.model, reading.rule).filter(|own| filters && own.upright() && own.lobes().len() == 1);
            let lobes = base.or(lone.map(Base::Lobes)).unwrap_or(Base::Normals);
            found.push(!lobes.lobes().is_empty());
            records.push(Record::of(material, &lobes, shared, slots.map(code)));
        }
        let classes = classes.iter().map(|class| upload(build, class)).collect::<Result<Vec<_>>>()?;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let clusters = BufferUpload::new(build, "clusters", usage, bytemuck::cast_slice(&table.records))?;
        let mut moments = Vec::new();
        for (group, filled) in groups.iter().zip(filled) {
            moments.extend(group.images(build, reading.filter, filled.is_some())?.into_iter().map(Made::Written));
            moments.extend(filled.map(Made::Filled));
        }
        let work = match reading.passes.filter(|_| !groups.is_empty()) {
            Some((map, mips, by_clusters, aligned)) => {
                let images: Vec<_> = classes.iter().map(|c| &c.image).chain(moments.iter().map(Made::image)).collect();
                let map = map.prepare(build, reading.samplers, &groups, &images, classes.len())?;
                let mips = mips.prepare(build, &groups, &map)?;
                let prepare = |pass: &ClusterMoments| pass.prepare(build, &groups, &images, &map, &clusters.buffer);
                let by_clusters = by_clusters.as_ref().map(prepare).transpose()?;
                let prepare = |pass: &mixtures::Mixtures| pass.prepare(build, &groups, &images, &map, &starts);
                let aligned = aligned.as_ref().map(prepare).transpose()?;
                Some((map, mips, by_clusters, aligned))
            }
            None => None,
        };
        let records = BufferUpload::new(build, "maps", usage, bytemuck::cast_slice(&records))?;
        let (most_clusters, coloured) = (table.most(), table.coloured());
        Ok(Self { records, clusters, classes, moments, places, divided, found, uses, most_clusters, coloured, work })
    }

    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> MapImages {
        let textures = self.classes.into_iter().map(|class| class.record(rec, bag));
        let mut classes: Vec<_> = textures.collect();
        classes.extend(self.moments.into_iter().map(|made| made.record(rec, bag)));
        let (records, clusters) = (self.records.record(rec, bag), self.clusters.record(rec, bag));
        MapImages { records, clusters, classes, moments: self.places, divided: self.divided }
    }
}

impl MapImages {
    pub fn records(&self) -> &Buffer {
        &self.records
    }

    pub fn clusters(&self) -> &Buffer {
        &self.clusters
    }

    /// The array of class `i`, or of the last if there are not that many.
    pub fn class(&self, i: usize) -> &Image {
        &self.classes[i.min(self.classes.len() - 1)]
    }

    /// What goes into the cells of a material's objects, if these have some of their own.
    pub fn divided(&self, material: u32) -> Option<&Divided> {
        self.divided.get(material as usize)?.as_ref()
    }

    /// The arrays of a material's moments and of its cells, its first layer there and how many there are.
    #[cfg(feature = "offline")]
    pub fn moments(&self, material: usize) -> Option<MomentArrays<'_>> {
        let place = (*self.moments.get(material)?)?;
        let array =
            |((class, layer), count): (Place, usize)| Some((self.classes.get(class)?, layer as u32..(layer + count) as u32));
        Some([array(place.moments), place.cells.and_then(array)])
    }

    /// Declares everything read by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        rec.buffer(&self.records, Access::COMPUTE_READ);
        rec.buffer(&self.clusters, Access::COMPUTE_READ);
        self.classes.iter().for_each(|class| rec.image(class, Access::COMPUTE_SAMPLED));
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        for buffer in [self.records, self.clusters] {
            states.forget(buffer.handle);
            buffer.retire(bag);
        }
        for class in self.classes {
            states.forget(class.handle);
            class.retire(bag);
        }
    }
}
