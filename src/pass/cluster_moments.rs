//! Pass 0b, continued: the moments of a material's lobes by clusters, from half the size of its maps on, and their mips
//! ([`crate::distribution::clusters`] is the f64 twin). Once a set of materials; averages are linear, so that other texels under the
//! same clusters are rebuilt by this pass alone.

use crate::distribution::MOST_BASE_LOBES;
use crate::distribution::clusters::Cluster;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use crate::pass::PassContext;
use crate::pass::brdf_map::{self, Group, Layers, Source};
use crate::pass::maps::MapImages;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{Pod, Zeroable};

/// Pass, shader, label and timer name.
pub const NAME: &str = "cluster_moments";

/// Shader interface of the first level.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: size_of::<Push>() as u32,
    gbuffer: false,
    materials: false,
    own: &[D::STORAGE_IMAGE, D::STORAGE_IMAGE, D::STORAGE_BUFFER],
};

/// Shader interface of one other level.
pub const LEVELS: Interface = Interface {
    name: "cluster_moments.levels",
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
    kind: u32,
    first: u32,
    all: u32,
    upright: u32,
    coloured: u32,
}

/// Mirrors `Cluster` in `glsl/include/clusters.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Record {
    at: [f32; 4],
    shape: [f32; 4],
    own: [f32; 4],
}

impl From<&Cluster> for Record {
    fn from(c: &Cluster) -> Self {
        let [xx, xy, yy] = c.inverse;
        let [at, shape] = [[c.centre.x, c.centre.y, c.constant, c.floor], [xx, xy, yy, c.bound]];
        let own = [c.own as f32, 0.0, 0.0, 0.0];
        Self { at: at.map(|v| v as f32), shape: shape.map(|v| v as f32), own }
    }
}

pub(crate) struct Io<'a> {
    /// In level 0 of its moments, out its clusters'.
    pub maps: &'a MapImages,
}

/// The sets and views of one recording.
pub(crate) struct Work {
    groups: Vec<GroupWork>,
    first: Sets,
    levels: Sets,
}

/// Of a group: classes of its moments and of its clusters', the views of levels of these, and what of each source.
struct GroupWork {
    classes: [usize; 2],
    views: Vec<vk::ImageView>,
    pushes: Vec<Push>,
}

pub(crate) struct ClusterMoments {
    first: ComputePipeline,
    levels: ComputePipeline,
}

impl ClusterMoments {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        let mut make = |interface| ComputePipeline::new(p.build, p.modules, interface, p.bridge, 0, &[]);
        Ok(Self { first: make(&INTERFACE)?, levels: make(&LEVELS)? })
    }

    /// What the recording needs; `moments` are of the same `groups`, whose clusters' images are behind those of moments, and `table`
    /// has all clusters.
    pub fn prepare(
        &self,
        build: &mut Build<'_>,
        groups: &[Group],
        classes: &[&Image],
        moments: &brdf_map::Work,
        table: &Buffer,
    ) -> Result<Work> {
        let mut works = Vec::new();
        let mut lobes = Vec::new();
        for (group, arrays) in groups.iter().zip(&moments.arrays).filter(|(group, _)| group.layers.cells > 0) {
            let class = arrays.moments.0;
            let Some(image) = classes.get(class + 1) else { continue };
            let pushes = group.sources.iter().filter(|(source, _)| source.clusters.count > 0).map(Push::of).collect();
            works.push(GroupWork { classes: [class, class + 1], views: image.level_views(build)?, pushes });
            lobes.push(arrays.moments.1[0]);
        }
        let first = self.first.sets(build, works.len())?;
        let levels = self.levels.sets(build, works.iter().map(|w| w.views.windows(2).count()).sum())?;
        for ((set, work), lobes) in first.sets.iter().zip(&works).zip(lobes) {
            let resources = [Resource::Storage(lobes), Resource::Storage(work.views[0]), Resource::Buffer(table)];
            write_set(&build.cx.device, *set, &resources);
        }
        for (set, pair) in levels.sets.iter().zip(works.iter().flat_map(|w| w.views.windows(2))) {
            write_set(&build.cx.device, *set, &[Resource::Storage(pair[0]), Resource::Storage(pair[1])]);
        }
        Ok(Work { groups: works, first, levels })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, work: &Work) {
        if work.groups.is_empty() {
            return;
        }
        rec.begin(NAME);
        rec.buffer(io.maps.clusters(), Access::COMPUTE_READ);
        for group in &work.groups {
            let [lobes, clusters] = group.classes.map(|class| io.maps.class(class));
            rec.image(lobes, Access::COMPUTE_ATOMIC);
            rec.overwrite(clusters, Access::COMPUTE_WRITE);
        }
        rec.flush();
        let mut levels = work.levels.sets.as_slice();
        for (group, set) in work.groups.iter().zip(&work.first.sets) {
            let image = io.maps.class(group.classes[1]);
            for push in &group.pushes {
                self.first.bind_set(rec, *set, push);
                self.first.dispatch(rec, image.extent());
            }
            let (own, rest) = levels.split_at((group.views.len() - 1).min(levels.len()));
            for (level, set) in (1..).zip(own) {
                // Levels are views of their own: none is read and written through one binding.
                rec.again(image, Access::COMPUTE_ATOMIC);
                rec.flush();
                self.levels.bind_set(rec, *set, &());
                let [x, y, _] = image.desc.level_extent(level);
                self.levels.dispatch_groups(rec, [x.div_ceil(8), y.div_ceil(8), image.desc.layers.unwrap_or(1)]);
            }
            levels = rest;
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.first.retire(bag);
        self.levels.retire(bag);
    }
}

impl Push {
    fn of((source, layers): &(Source, Layers)) -> Self {
        let base = source.base.lobes();
        Self {
            weights: brdf_map::weights(base),
            count: base.len() as u32,
            lobe_layer: (layers.moments + usize::from(!source.base.upright())) as i32,
            cell_layer: layers.cells as i32,
            kind: brdf_map::lobes(!base.is_empty(), source.parameter),
            first: source.clusters.first,
            all: source.clusters.count,
            upright: u32::from(source.base.upright()),
            coloured: u32::from(source.clusters.coloured),
        }
    }
}

impl Work {
    pub fn retire(self, bag: &mut Retired) {
        self.groups.into_iter().flat_map(|group| group.views).for_each(|view| bag.push(Handle::View(view)));
        self.first.retire(bag);
        self.levels.retire(bag);
    }
}
