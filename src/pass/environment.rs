//! Pass 0a: the distant environment, uploaded on change: radiance and sampling density in one image, alias table in another.

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

/// What the shaders read (`glsl/include/environment.glsl`).
pub(crate) struct EnvironmentImages {
    /// RGBA32F: radiance; density over uv.
    pub map: Image,
    /// RG32UI: threshold as float bits; alias as row << 16 | column.
    pub alias: Image,
}

/// Created and filled, not yet recorded.
pub(crate) struct EnvironmentUpload {
    map: ImageUpload,
    alias: ImageUpload,
}

impl EnvironmentUpload {
    pub fn new(build: &mut Build<'_>, map: &LatLong) -> Result<Self> {
        if map.width() > 65535 || map.height() > 65535 {
            let got = format!("{}x{}", map.width(), map.height());
            return Err(Error::invalid("environment", "at most 65535 texels a side", got));
        }
        // Its largest sum over texels must stay finite in 32 bits.
        let brightest = map.texels().iter().flatten().copied().fold(0.0, f32::max);
        if brightest > 1e30 {
            return Err(Error::invalid("environment radiance", "at most 1e30", brightest));
        }
        let importance = EnvironmentImportance::build(map)?;
        let density = importance.density_texels();
        let radiance: Vec<[f32; 4]> = map.texels().iter().zip(&density).map(|(&[r, g, b], &d)| [r, g, b, d]).collect();
        let place = |texel: u32| ((texel / map.width()) << 16) | (texel % map.width());
        let alias: Vec<[u32; 2]> = importance.alias().entries().iter().map(|e| [e.threshold.to_bits(), place(e.alias)]).collect();
        let desc = |name, format| ImageDesc {
            name,
            format,
            extent: [map.width(), map.height(), 1],
            usage: vk::ImageUsageFlags::SAMPLED,
        };
        Ok(Self {
            map: ImageUpload::new(build, desc("environment", vk::Format::R32G32B32A32_SFLOAT), bytemuck::cast_slice(&radiance))?,
            alias: ImageUpload::new(build, desc("environment alias", vk::Format::R32G32_UINT), bytemuck::cast_slice(&alias))?,
        })
    }

    pub fn record(self, rec: &mut Recorder<'_>, bag: &mut Retired) -> EnvironmentImages {
        EnvironmentImages { map: self.map.record(rec, bag), alias: self.alias.record(rec, bag) }
    }
}

impl EnvironmentImages {
    /// Declares both images sampled by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        [&self.map, &self.alias].into_iter().for_each(|image| rec.image(image, Access::COMPUTE_SAMPLED));
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        for image in [self.map, self.alias] {
            states.forget(image.handle);
            image.retire(bag);
        }
    }
}
