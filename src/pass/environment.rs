//! Pass 0a: the distant environment, uploaded on change: radiance and sampling density in one image, what
//! directions are drawn from in another.

use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::upload::ImageUpload;
use crate::sampling::LatLong;
use crate::sampling::environment::EnvironmentImportance;
use ash::vk;

/// Pass, label and set-up time name.
pub const NAME: &str = "environment";

/// Width of the alias table's image; its number of slots is a power of two, at least 16384.
const SLOTS_A_ROW: u32 = 1024;

/// What the shaders read (`glsl/include/environment.glsl`).
pub(crate) struct EnvironmentImages {
    /// RGBA32F: radiance; density over uv.
    pub map: Image,
    /// RG32UI: alias alias of every row's texels, and the rows' own alias.
    pub alias: Image,
}

/// Created and filled, not yet recorded.
pub(crate) struct EnvironmentUpload {
    map: ImageUpload,
    alias: ImageUpload,
}

impl EnvironmentUpload {
    pub fn new(build: &mut Build<'_>, map: &LatLong) -> Result<Self> {
        // Its largest sum over texels must stay finite in 32 bits.
        let brightest = map.texels().iter().flatten().copied().fold(0.0, f32::max);
        if brightest > 1e30 {
            return Err(Error::invalid("environment radiance", "at most 1e30", brightest));
        }
        let importance = EnvironmentImportance::build(map)?;
        let radiance: Vec<[f32; 4]> =
            map.texels().iter().zip(importance.density_texels()).map(|(&[r, g, b], density)| [r, g, b, density]).collect();
        let slots = importance.alias().packed();
        let desc = |name, format, [width, height]: [u32; 2]| {
            ImageDesc::new(name, format, [width, height, 1], vk::ImageUsageFlags::SAMPLED)
        };
        let radiance_desc = desc("environment", vk::Format::R32G32B32A32_SFLOAT, [map.width(), map.height()]);
        let alias_desc =
            desc("environment alias", vk::Format::R32G32B32A32_UINT, [SLOTS_A_ROW, slots.len() as u32 / SLOTS_A_ROW]);
        Ok(Self {
            map: ImageUpload::new(build, radiance_desc, bytemuck::cast_slice(&radiance))?,
            alias: ImageUpload::new(build, alias_desc, bytemuck::cast_slice(&slots))?,
        })
    }

    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> EnvironmentImages {
        EnvironmentImages { map: self.map.record(rec, bag), alias: self.alias.record(rec, bag) }
    }
}

impl EnvironmentImages {
    /// Declares both images sampled by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        rec.image(&self.map, Access::COMPUTE_SAMPLED);
        rec.image(&self.alias, Access::COMPUTE_SAMPLED);
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        for image in [self.map, self.alias] {
            states.forget(image.handle);
            image.retire(bag);
        }
    }
}
