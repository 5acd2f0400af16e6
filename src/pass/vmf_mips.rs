//! Pass 0b, continued: the mips of the moments, one dispatch a level for all layers of a size (Xu et al. 2017, section 3.2;
//! [`crate::distribution::mip`] is the f64 twin).

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::pipeline::{ComputePipeline, Interface, Resource, Sets, write_set};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::pass::PassContext;
use crate::pass::brdf_map;
use crate::pass::maps::MapImages;
use ash::vk::DescriptorType as D;

/// Pass, shader, label and timer name.
pub const NAME: &str = "vmf_mips";

/// Shader interface.
pub const INTERFACE: Interface = Interface {
    name: NAME,
    local_size: [8, 8, 1],
    push_bytes: 0,
    gbuffer: false,
    materials: false,
    own: &[D::STORAGE_IMAGE, D::STORAGE_IMAGE],
};

pub(crate) struct Io<'a> {
    /// In level 0 of its moments, out their other levels.
    pub maps: &'a MapImages,
}

/// The sets of one recording: for each array and level above 0, in order.
pub(crate) struct Work(Sets);

pub(crate) struct VmfMips(ComputePipeline);

impl VmfMips {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        Ok(Self(ComputePipeline::new(p.build, p.modules, &INTERFACE, p.bridge, 0, &[])?))
    }

    pub fn prepare(&self, build: &mut Build<'_>, moments: &brdf_map::Work) -> Result<Work> {
        let sets = self.0.sets(build, moments.arrays.iter().map(|(_, views)| views.len() - 1).sum())?;
        let levels = moments.arrays.iter().flat_map(|(_, views)| views.windows(2));
        for (set, pair) in sets.sets.iter().zip(levels) {
            write_set(&build.cx.device, *set, &[Resource::Storage(pair[0]), Resource::Storage(pair[1])]);
        }
        Ok(Work(sets))
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>, moments: &brdf_map::Work, work: &Work) {
        rec.begin(NAME);
        let mut sets = work.0.sets.iter();
        for (class, views) in &moments.arrays {
            let image = io.maps.class(*class);
            for (level, set) in (1..views.len() as u32).zip(&mut sets) {
                // Levels are views of their own: none is read and written through one binding.
                rec.image(image, Access::COMPUTE_ATOMIC);
                rec.flush();
                self.0.bind_set(rec, *set, &());
                let [x, y, _] = image.desc.level_extent(level);
                self.0.dispatch_groups(rec, [x.div_ceil(8), y.div_ceil(8), image.desc.layers.unwrap_or(1)]);
            }
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}

impl Work {
    pub fn retire(self, bag: &mut Retired) {
        self.0.retire(bag);
    }
}
