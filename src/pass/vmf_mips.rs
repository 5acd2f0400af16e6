//! Pass 0b, continued: the mips of the moments, one dispatch a level for all layers of a size (Xu et al. 2017, section 3.2;
//! [`crate::distribution::mip`] and [`crate::distribution::filter`] are the f64 twins). Cells begin at half the size of the map.

use crate::config::{Filter, MOST_BASE_LOBES};
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::pass::PassContext;
use crate::pass::brdf_map::{self, Group, Layers};
use crate::pass::maps::MapImages;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "vmf_mips";

/// Shader interface of the first level of cells.
pub const CELLS: Interface = Interface {
    name: "vmf_mips.cells",
    local_size: [8, 8, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: false,
    materials: false,
    own: &[D::STORAGE_IMAGE, D::STORAGE_IMAGE],
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
    count: u32,
    lobe_layer: i32,
    cell_layer: i32,
    upright: u32,
}

pub(crate) struct Io<'a> {
    /// In level 0 of its moments, out their other levels and cells.
    pub maps: &'a MapImages,
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

/// The levels of an array, pair by pair.
fn pairs(array: &(usize, Vec<vk::ImageView>)) -> impl Iterator<Item = &[vk::ImageView]> {
    array.1.windows(2)
}

impl VmfMips {
    pub fn new(p: &mut PassContext<'_, '_>, filter: Filter) -> Result<Self> {
        let constants = [brdf_map::number(filter)];
        let mut cells = || ComputePipeline::new(p.build, p.modules, &CELLS, p.bridge, 0, &constants);
        let cells = if filter.has_cells() { Some(cells()?) } else { None };
        Ok(Self { cells, levels: ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, 0, &[])? })
    }

    pub fn prepare(&self, build: &mut Build<'_>, groups: &[Group], moments: &brdf_map::Work, filter: Filter) -> Result<Work> {
        let arrays = || moments.arrays.iter().flat_map(|a| std::iter::once(&a.moments).chain(&a.cells));
        let levels = self.levels.sets(build, arrays().map(|a| pairs(a).count()).sum())?;
        for (set, pair) in levels.sets.iter().zip(arrays().flat_map(pairs)) {
            write_set(&build.cx.device, *set, &[Resource::Storage(pair[0]), Resource::Storage(pair[1])]);
        }
        let divided: Vec<_> =
            moments.arrays.iter().zip(groups).filter_map(|(a, group)| Some((a, a.cells.as_ref()?, group))).collect();
        let cells = self.cells.as_ref().unwrap_or(&self.levels).sets(build, divided.len())?;
        let mut pushes = Vec::new();
        for (set, (arrays, (_, views), group)) in cells.sets.iter().zip(divided) {
            write_set(&build.cx.device, *set, &[Resource::Storage(arrays.moments.1[0]), Resource::Storage(views[0])]);
            let with_lobes = group.sources.iter().filter(|(source, _)| Layers::of(filter, &source.base).cells > 0);
            let push = |(source, first): &(brdf_map::Source, Layers)| Push {
                weights: brdf_map::weights(source.base.lobes()),
                count: source.base.lobes().len() as u32,
                lobe_layer: (first.moments + usize::from(!source.base.upright())) as i32,
                cell_layer: first.cells as i32,
                upright: u32::from(source.base.upright()),
            };
            pushes.push(with_lobes.map(push).collect());
        }
        Ok(Work { cells, pushes, levels })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, moments: &brdf_map::Work, work: &Work) {
        rec.begin(NAME);
        let divided = moments.arrays.iter().filter_map(|a| Some((a.moments.0, a.cells.as_ref()?.0)));
        for (((lobes, cells), pushes), set) in divided.zip(&work.pushes).zip(&work.cells.sets) {
            let (lobes, cells) = (io.maps.class(lobes), io.maps.class(cells));
            rec.image(lobes, Access::COMPUTE_ATOMIC);
            rec.overwrite(cells, Access::COMPUTE_WRITE);
            rec.flush();
            for (push, pipeline) in pushes.iter().zip(self.cells.iter().cycle()) {
                pipeline.bind_set(rec, *set, push);
                pipeline.dispatch(rec, cells.extent());
            }
        }
        let mut sets = work.levels.sets.iter();
        for (class, views) in moments.arrays.iter().flat_map(|a| std::iter::once(&a.moments).chain(&a.cells)) {
            let image = io.maps.class(*class);
            for (level, set) in (1..views.len() as u32).zip(&mut sets) {
                // Levels are views of their own: none is read and written through one binding.
                rec.image(image, Access::COMPUTE_ATOMIC);
                rec.flush();
                self.levels.bind_set(rec, *set, &());
                let [x, y, _] = image.desc.level_extent(level);
                self.levels.dispatch_groups(rec, [x.div_ceil(8), y.div_ceil(8), image.desc.layers.unwrap_or(1)]);
            }
        }
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
