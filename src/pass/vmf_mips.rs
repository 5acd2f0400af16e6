//! Pass 0b, continued: the mips of the moments, one dispatch a level for all layers of a size (Xu et al. 2017, section 3.2;
//! [`crate::distribution::mip`] and [`crate::distribution::filter`] are the f64 twins). Cells begin at half the size of the map.

use crate::config::{Bins, Config};
use crate::distribution::MOST_BASE_LOBES;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::moments::Base;
use crate::pass::PassContext;
use crate::pass::brdf_map::{self, Group};
use crate::pass::gbuffer::Draw;
use crate::pass::maps::MapImages;
use crate::pass::object_cells::ObjectCells;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};
use glam::Mat3;

/// Pass, shader, label and timer name.
pub const NAME: &str = "vmf_mips";

/// Shader interface of the first level of cells.
pub const CELLS: Interface = Interface {
    name: "vmf_mips.cells",
    local_size: [8, 8, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: false,
    materials: false,
    own: &[D::STORAGE_IMAGE, D::STORAGE_IMAGE, D::STORAGE_IMAGE],
};

/// Shader interface of one level.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: false,
    materials: false,
    own: &[D::STORAGE_IMAGE, D::STORAGE_IMAGE],
};

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Push {
    weights: [f32; MOST_BASE_LOBES],
    view_from_world: [[f32; 4]; 3],
    count: u32,
    lobe_layer: i32,
    cell_layer: i32,
    frame_layer: i32,
    upright: u32,
}

/// The lobes of a material that go into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lobes {
    weights: [f32; MOST_BASE_LOBES],
    count: u32,
    layer: i32,
    upright: bool,
}

impl Lobes {
    /// Of moments whose first layer is `moments`.
    pub fn of(base: &Base, moments: usize) -> Self {
        let layer = (moments + usize::from(!base.upright())) as i32;
        Self { weights: brdf_map::weights(base.lobes()), count: base.lobes().len() as u32, layer, upright: base.upright() }
    }

    fn push(&self, cell_layer: usize) -> Push {
        Push {
            weights: self.weights,
            view_from_world: [[0.0; 4]; 3],
            count: self.count,
            lobe_layer: self.layer,
            cell_layer: cell_layer as i32,
            frame_layer: 0,
            upright: u32::from(self.upright),
        }
    }
}

pub(crate) struct Io<'a> {
    /// In level 0 of its moments, out their other levels and cells.
    pub maps: &'a MapImages,
}

pub(crate) struct ObjectIo<'a> {
    /// In level 0 of its moments.
    pub maps: &'a MapImages,
    /// In their frames, out their cells.
    pub objects: &'a ObjectCells,
    pub draws: &'a [Draw],
    pub view_from_world: Mat3,
}

/// The sets of one recording.
pub(crate) struct Work {
    /// For each group with cells, and for what of each of its sources.
    cells: Sets,
    pushes: Vec<Vec<Push>>,
    /// For each array and level above 0, in order.
    levels: Sets,
}

pub(crate) struct VmfMips {
    cells: Option<ComputePipeline>,
    levels: ComputePipeline,
}

impl VmfMips {
    pub fn new(p: &mut PassContext<'_, '_>, config: &Config) -> Result<Self> {
        let filter = config.filter;
        let constants = [brdf_map::number(filter), u32::from(config.bins == Bins::Camera)];
        let mut cells = || ComputePipeline::new(p.build, p.modules, &CELLS, p.bridge, 0, &constants);
        let cells = if filter.has_cells() { Some(cells()?) } else { None };
        Ok(Self { cells, levels: ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, 0, &[])? })
    }

    pub fn prepare(&self, build: &mut Build<'_>, groups: &[Group], moments: &brdf_map::Work) -> Result<Work> {
        let arrays: Vec<_> = moments.arrays.iter().flat_map(|a| std::iter::once(&a.moments).chain(&a.cells)).collect();
        let views: Vec<_> = arrays.into_iter().map(|a| a.1.as_slice()).collect();
        let levels = self.level_sets(build, &views)?;
        let divided: Vec<_> =
            moments.arrays.iter().zip(groups).filter_map(|(a, group)| Some((a, a.cells.as_ref()?, group))).collect();
        let cells = self.cells.as_ref().unwrap_or(&self.levels).sets(build, divided.len())?;
        let mut pushes = Vec::new();
        for (set, (arrays, (_, views), group)) in cells.sets.iter().zip(divided) {
            // In the place of frames something to bind.
            let resources = [arrays.moments.1[0], views[0], arrays.moments.1[0]].map(Resource::Storage);
            write_set(&build.cx.device, *set, &resources);
            let with_lobes = group.sources.iter().filter(|(source, _)| !source.base.lobes().is_empty());
            pushes.push(with_lobes.map(|(source, first)| Lobes::of(&source.base, first.moments).push(first.cells)).collect());
        }
        Ok(Work { cells, pushes, levels })
    }

    /// The sets of the levels above the first of images with these views.
    fn level_sets(&self, build: &mut Build<'_>, views: &[&[vk::ImageView]]) -> Result<Sets> {
        let sets = self.levels.sets(build, views.iter().map(|v| v.windows(2).count()).sum())?;
        for (set, pair) in sets.sets.iter().zip(views.iter().flat_map(|v| v.windows(2))) {
            write_set(&build.cx.device, *set, &[Resource::Storage(pair[0]), Resource::Storage(pair[1])]);
        }
        Ok(sets)
    }

    /// The sets for [`Self::record_objects`] of cells with these views of levels: of the first, and of the others.
    pub fn object_sets(
        &self,
        build: &mut Build<'_>,
        lobes: vk::ImageView,
        cells: &[vk::ImageView],
        frames: vk::ImageView,
    ) -> Result<[Sets; 2]> {
        let first = self.cells.as_ref().unwrap_or(&self.levels).sets(build, 1)?;
        for (set, cells) in first.sets.iter().zip(cells) {
            write_set(&build.cx.device, *set, &[lobes, *cells, frames].map(Resource::Storage));
        }
        Ok([first, self.level_sets(build, &[cells])?])
    }

    /// The cells of all draws that have some, in the frame.
    pub fn record_objects(&self, rec: &mut Recorder<'_>, io: &ObjectIo<'_>) {
        rec.begin(NAME);
        for images in io.objects.images() {
            rec.image(io.maps.class(images.moments), Access::COMPUTE_READ);
            rec.image(&images.frames, Access::COMPUTE_READ);
            rec.overwrite(&images.cells, Access::COMPUTE_WRITE);
        }
        rec.flush();
        let view_from_world = io.view_from_world.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]);
        for (_, seat, images) in io.objects.seated(io.draws) {
            let Some(divided) = io.maps.divided(seat.material) else { continue };
            let frame_layer = seat.number as i32;
            let push = Push { view_from_world, frame_layer, ..divided.lobes.push(seat.cell_layer) };
            for (pipeline, set) in self.cells.iter().zip(&images.first.sets) {
                pipeline.bind_set(rec, *set, &push);
                pipeline.dispatch(rec, images.cells.extent());
            }
        }
        for images in io.objects.images() {
            self.record_levels(rec, &images.cells, &images.levels.sets);
        }
        rec.end();
    }

    /// The levels of an image above its first, whose bytes the pass counts by itself.
    fn record_levels(&self, rec: &mut Recorder<'_>, image: &Image, sets: &[vk::DescriptorSet]) {
        for (level, set) in (1..).zip(sets) {
            // Levels are views of their own: none is read and written through one binding.
            rec.again(image, Access::COMPUTE_ATOMIC);
            rec.flush();
            self.levels.bind_set(rec, *set, &());
            let [x, y, _] = image.desc.level_extent(level);
            self.levels.dispatch_groups(rec, [x.div_ceil(8), y.div_ceil(8), image.desc.layers.unwrap_or(1)]);
        }
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, moments: &brdf_map::Work, work: &Work) {
        if work.pushes.is_empty() && work.levels.sets.is_empty() {
            return;
        }
        rec.begin(NAME);
        let divided = moments.arrays.iter().filter_map(|a| Some((a.moments.0, a.cells.as_ref()?.0)));
        let mut moved = 0;
        for (((lobes, cells), pushes), set) in divided.zip(&work.pushes).zip(&work.cells.sets) {
            let (lobes, cells) = (io.maps.class(lobes), io.maps.class(cells));
            moved += lobes.desc.level_bytes(0) + cells.desc.level_bytes(0);
            rec.image(lobes, Access::COMPUTE_ATOMIC);
            rec.overwrite(cells, Access::COMPUTE_WRITE);
            rec.flush();
            for (push, pipeline) in pushes.iter().zip(self.cells.iter().cycle()) {
                pipeline.bind_set(rec, *set, push);
                pipeline.dispatch(rec, cells.extent());
            }
        }
        let mut sets = work.levels.sets.as_slice();
        for (class, views) in moments.arrays.iter().flat_map(|a| std::iter::once(&a.moments).chain(&a.cells)) {
            let (own, rest) = sets.split_at((views.len() - 1).min(sets.len()));
            let image = io.maps.class(*class);
            self.record_levels(rec, image, own);
            // Each level is read by the next.
            moved +=
                (0..own.len() as u32).map(|level| image.desc.level_bytes(level) + image.desc.level_bytes(level + 1)).sum::<u64>();
            sets = rest;
        }
        rec.moved(moved);
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.cells.into_iter().for_each(|pass| pass.retire(bag));
        self.levels.retire(bag);
    }
}

impl Work {
    pub fn retire(self, bag: &mut Retired) {
        self.cells.retire(bag);
        self.levels.retire(bag);
    }
}
