//! Pass 0b, continued: aligned mixtures of the lobes of a material's maps, a level at a time from the coarsest on
//! ([`crate::distribution::alignment`] is the f64 twin). Once a set of materials: whoever changes a map has them fitted anew by recording
//! it. The host finds what the coarsest level starts from, in at most 1024 texels; all else is the device's.

use crate::distribution::MOST_BASE_LOBES;
use crate::distribution::alignment::Fit;
use crate::distribution::below::{self, across};
use crate::distribution::expectation::GAUSSIANS;
use crate::distribution::gaussians::Start;
use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use crate::gpu::upload::BufferUpload;
use crate::pass::PassContext;
use crate::pass::brdf_map::{self, Group, Layers, Source};
use crate::pass::maps::MapImages;
use ash::vk::{self, DescriptorType as D};
use bytemuck::{NoUninit, Pod, Zeroable};

/// Pass, label and timer name.
pub const NAME: &str = "mixtures";

const fn interface<P: NoUninit>(name: &'static str, own: &'static [D]) -> Interface {
    let push_bytes = size_of::<P>() as u32;
    Interface { name, local_size: [8, 8, 1], push_bytes, gbuffer: false, materials: false, own }
}

const LOBES: Interface = interface::<LobesPush>("mixtures_lobes", &[D::STORAGE_IMAGE, D::STORAGE_BUFFER]);
const FIT: Interface =
    interface::<FitPush>("mixtures_fit", &[D::STORAGE_BUFFER, D::STORAGE_BUFFER, D::STORAGE_BUFFER, D::STORAGE_IMAGE]);
const LABELS: Interface = interface::<LabelsPush>("mixtures_labels", &[D::STORAGE_BUFFER, D::STORAGE_BUFFER, D::STORAGE_IMAGE]);

/// Shader interfaces, in the order in which they run.
pub const INTERFACES: [Interface; 3] = [LOBES, FIT, LABELS];

/// Vectors of a texel's moments: mass, place in x and y, mean products xx, xy, yy, of all Gaussians each.
const VECTORS: u64 = 6;

/// Lobes below a texel from which on a group of invocations fits it.
const TOGETHER: u64 = 256;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LobesPush {
    weights: [f32; MOST_BASE_LOBES],
    middle: [f32; 2],
    count: i32,
    layer: i32,
    kind: u32,
    upright: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct FitPush {
    from: [u32; 2],
    above: [u32; 2],
    across: [f32; 2],
    first: i32,
    to: i32,
    count: i32,
    layer: i32,
    upright: u32,
    some: u32,
    strength: f32,
    least: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LabelsPush {
    above: [u32; 2],
    first: i32,
    count: i32,
    layer: i32,
    upright: u32,
    least: f32,
}

pub(crate) struct Io<'a> {
    /// In level 0 of its moments, out its mixtures.
    pub maps: &'a MapImages,
}

/// What one recording needs.
pub(crate) struct Work {
    places: BufferUpload,
    groups: Vec<GroupWork>,
    lobes: Sets,
    /// Of each group, of each level from 1 on.
    levels: Sets,
    labels: Sets,
}

/// Of a group: the classes of its moments and of its mixtures, the views of levels of these, and what is fitted.
struct GroupWork {
    classes: [usize; 2],
    views: Vec<vk::ImageView>,
    sources: Vec<Fitting>,
    /// The lobes of one source, and moments of all levels, coarsest first behind what that starts from.
    lobes: Buffer,
    mixtures: Buffer,
}

/// A source and what it starts from.
struct Fitting {
    lobes: LobesPush,
    layer: i32,
    least: f32,
    start: [[f32; GAUSSIANS]; VECTORS as usize],
}

pub(crate) struct Mixtures {
    lobes: ComputePipeline,
    /// A texel in an invocation, and in a group.
    fit: [ComputePipeline; 2],
    labels: ComputePipeline,
    strength: f32,
}

/// Sizes of a map's levels.
fn sizes(size: [u32; 2]) -> Vec<[u32; 2]> {
    let levels = 1 + size[0].max(size[1]).ilog2();
    (0..levels).map(|level| size.map(|side| (side >> level).max(1))).collect()
}

fn area([w, h]: [u32; 2]) -> u64 {
    u64::from(w) * u64::from(h)
}

/// The first vector of each level from 1 on, and the number of all; behind one texel from which the coarsest starts.
fn starts(sizes: &[[u32; 2]]) -> (Vec<u64>, u64) {
    let mut next = VECTORS;
    let mut firsts: Vec<_> = sizes
        .iter()
        .skip(1)
        .rev()
        .map(|size| {
            let first = next;
            next += VECTORS * area(*size);
            first
        })
        .collect();
    firsts.reverse();
    (firsts, next)
}

/// The most vectors that a source of a group has as lobes.
fn lobe_vectors(group: &Group) -> u64 {
    let stride = |(source, _): &(Source, Layers)| source.base.lobes().len() + usize::from(!source.base.upright());
    area(group.size) * group.sources.iter().map(stride).max().unwrap_or(1) as u64
}

/// Whether buffers for a group are within a device's limits.
pub(crate) fn fits(limits: &vk::PhysicalDeviceLimits, group: &Group) -> bool {
    let (_, mixtures) = starts(&sizes(group.size));
    mixtures.max(lobe_vectors(group)) * 16 <= u64::from(limits.max_storage_buffer_range)
}

impl Mixtures {
    /// For fits that all texels of a level have at once.
    pub fn new(p: &mut PassContext<'_, '_>, fit: Fit) -> Result<Self> {
        let mut make = |interface, constants: &[u32]| ComputePipeline::new(p.build, p.modules, interface, p.bridge, 0, constants);
        let (lobes, labels) = (make(&LOBES, &[])?, make(&LABELS, &[])?);
        Ok(Self { lobes, fit: [make(&FIT, &[0, 1, 1])?, make(&FIT, &[1, 8, 4])?], labels, strength: fit.strength as f32 })
    }

    /// What the recording needs: `starts` of the sources of `groups` that are fitted, whose mixtures' images are behind those of moments.
    pub fn prepare(
        &self,
        build: &mut Build<'_>,
        groups: &[Group],
        classes: &[&Image],
        moments: &brdf_map::Work,
        starts: &[Vec<Option<Start>>],
    ) -> Result<Work> {
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let places = BufferUpload::new(build, "places", storage, bytemuck::cast_slice(&below::places()))?;
        let (mut works, mut lobe_views) = (Vec::new(), Vec::new());
        for ((group, arrays), starts) in groups.iter().zip(&moments.arrays).zip(starts) {
            let sources: Vec<_> = group
                .sources
                .iter()
                .zip(starts)
                .filter_map(|(source, start)| Some(Fitting::of(source, start.as_ref()?)))
                .collect();
            let class = arrays.moments.0;
            let Some(image) = classes.get(class + 1).filter(|_| !sources.is_empty()) else { continue };
            let (_, vectors) = self::starts(&sizes(group.size));
            let lobes = Buffer::new(build, "lobes", 16 * lobe_vectors(group), storage, Location::Device)?;
            let updated = storage | vk::BufferUsageFlags::TRANSFER_DST;
            let mixtures = Buffer::new(build, "mixtures", 16 * vectors, updated, Location::Device)?;
            let views = image.level_views(build)?;
            works.push(GroupWork { classes: [class, class + 1], views, sources, lobes, mixtures });
            lobe_views.push(arrays.moments.1[0]);
        }
        let (lobes, labels) = (self.lobes.sets(build, works.len())?, self.labels.sets(build, works.len())?);
        let levels = self.fit[0].sets(build, works.iter().map(|w| w.views.len() - 1).sum())?;
        let device = &build.cx.device;
        for (((work, view), lobes), labels) in works.iter().zip(lobe_views).zip(&lobes.sets).zip(&labels.sets) {
            write_set(device, *lobes, &[Resource::Storage(view), Resource::Buffer(&work.lobes)]);
            let own = [Resource::Buffer(&work.lobes), Resource::Buffer(&work.mixtures), Resource::Storage(work.views[0])];
            write_set(device, *labels, &own);
        }
        let all = works.iter().flat_map(|work| work.views.iter().skip(1).map(move |view| (work, *view)));
        for (set, (work, view)) in levels.sets.iter().zip(all) {
            let own = [&work.lobes, &work.mixtures, &places.buffer].map(Resource::Buffer);
            let [lobes, mixtures, places] = own;
            write_set(device, *set, &[lobes, mixtures, places, Resource::Storage(view)]);
        }
        Ok(Work { places, groups: works, lobes, levels, labels })
    }

    /// Records it; what is needed no longer goes into `bag`.
    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, work: Work, bag: &mut Retired) {
        let Work { places, groups, lobes, levels, labels } = work;
        rec.begin(NAME);
        let places = places.record(rec, bag);
        rec.buffer(&places, Access::COMPUTE_READ);
        let mut rest = levels.sets.as_slice();
        for ((group, lobes), labels) in groups.iter().zip(&lobes.sets).zip(&labels.sets) {
            let [of_map, gaussians] = group.classes.map(|class| io.maps.class(class));
            rec.image(of_map, Access::COMPUTE_READ);
            rec.overwrite(gaussians, Access::COMPUTE_WRITE);
            let (own, others) = rest.split_at((group.views.len() - 1).min(rest.len()));
            for fitting in &group.sources {
                self.record_source(rec, group, fitting, gaussians.desc, (*lobes, own, *labels));
            }
            rest = others;
        }
        rec.end();

        for group in groups {
            group.views.into_iter().for_each(|view| bag.push(Handle::View(view)));
            for buffer in [group.lobes, group.mixtures] {
                rec.forget(buffer.handle);
                buffer.retire(bag);
            }
        }
        rec.forget(places.handle);
        places.retire(bag);
        [lobes, levels, labels].into_iter().for_each(|sets| sets.retire(bag));
    }

    fn record_source(
        &self,
        rec: &mut Recorder<'_>,
        group: &GroupWork,
        fitting: &Fitting,
        desc: ImageDesc,
        (lobes, levels, labels): (vk::DescriptorSet, &[vk::DescriptorSet], vk::DescriptorSet),
    ) {
        let [width, height, _] = desc.extent;
        let sizes = sizes([width, height]);
        let (firsts, _) = starts(&sizes);
        rec.buffer(&group.mixtures, Access::TRANSFER_WRITE);
        rec.buffer(&group.lobes, Access::COMPUTE_WRITE);
        rec.flush();
        let start = bytemuck::bytes_of(&fitting.start);
        // SAFETY: the command buffer is recording outside a render pass; the buffer holds as much.
        unsafe { rec.cx.device.cmd_update_buffer(rec.cmd, group.mixtures.handle, 0, start) };
        self.lobes.bind_set(rec, lobes, &fitting.lobes);
        self.lobes.dispatch(rec, [width, height]);
        rec.buffer(&group.lobes, Access::COMPUTE_READ);

        let (count, upright) = (fitting.lobes.count, fitting.lobes.upright);
        let Fitting { layer, least, .. } = *fitting;
        let (mut above, mut first) = ([1, 1], 0);
        for ((size, to), set) in sizes.iter().skip(1).zip(&firsts).zip(levels).rev() {
            rec.buffer(&group.mixtures, Access::COMPUTE_ATOMIC);
            rec.flush();
            let push = FitPush {
                from: sizes[0],
                above,
                across: across(*size, sizes[0]),
                first: first as i32,
                to: *to as i32,
                count,
                layer,
                upright,
                some: u32::from(below::is_some(*size, sizes[0])),
                strength: self.strength,
                least,
            };
            let together = area(sizes[0]) * count as u64 > TOGETHER * area(*size);
            let fit = &self.fit[usize::from(together)];
            fit.bind_set(rec, *set, &push);
            match together {
                true => fit.dispatch_groups(rec, [size[0], size[1], 1]),
                false => fit.dispatch(rec, *size),
            }
            (above, first) = (*size, *to);
        }
        rec.buffer(&group.mixtures, Access::COMPUTE_READ);
        rec.flush();
        self.labels.bind_set(rec, labels, &LabelsPush { above, first: first as i32, count, layer, upright, least });
        self.labels.dispatch(rec, [width, height]);
    }

    pub fn retire(self, bag: &mut Retired) {
        [self.lobes, self.labels].into_iter().chain(self.fit).for_each(|pipeline| pipeline.retire(bag));
    }
}

impl Fitting {
    fn of((source, layers): &(Source, Layers), start: &Start) -> Self {
        let (base, upright) = (source.base.lobes(), source.base.upright());
        let mut vectors = [[0.0; GAUSSIANS]; VECTORS as usize];
        for (k, sums) in start.sums.iter().enumerate() {
            vectors.iter_mut().zip(sums).for_each(|(vector, sum)| vector[k] = *sum as f32);
        }
        let lobes = LobesPush {
            weights: brdf_map::weights(base),
            middle: start.frame.middle.as_vec2().to_array(),
            count: base.len() as i32,
            layer: (layers.moments + usize::from(!upright)) as i32,
            kind: brdf_map::lobes(!base.is_empty(), source.parameter),
            upright: u32::from(upright),
        };
        Self { lobes, layer: layers.cells as i32, least: start.frame.floor as f32, start: vectors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_lie_one_behind_another() {
        let sizes = sizes([67, 9]);
        assert_eq!(sizes, [[67, 9], [33, 4], [16, 2], [8, 1], [4, 1], [2, 1], [1, 1]]);
        let (firsts, all) = starts(&sizes);
        assert_eq!(firsts, [6 * 48, 6 * 16, 6 * 8, 6 * 4, 6 * 2, 6]);
        assert_eq!(all, 6 * (48 + 33 * 4));
        assert_eq!(starts(&super::sizes([1, 1])), (vec![], 6));
    }
}
