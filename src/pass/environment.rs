//! Pass 0a: the distant environment, uploaded on change: radiance and sampling density in one image, what
//! directions are drawn from in another.

use crate::distribution::suns::Suns;
use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::upload::ImageUpload;
use crate::pass::environment_bandwidth::{self, EnvironmentBandwidth};
use crate::pass::prefilter::{self, Prefilter, Prefiltered};
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
    /// The same without its suns, where these are lights of their own and directions are drawn from the rest.
    pub rest: Option<Image>,
    /// RGBA32UI: the alias table of the texels that directions are drawn from, as `src/sampling/alias.rs` packs it.
    pub alias: Image,
    /// R32F: cycles/radian around each direction, one value a 2x2 block of the map that is analysed; looked up with the map's
    /// own coordinates, nearest. None unless the frame predicts bandwidth.
    pub bandwidth: Option<Image>,
    /// Mean luminance over the sphere.
    pub mean: f64,
    /// None unless the frame looks pre-convolved light up.
    pub prefiltered: Option<Prefiltered>,
}

/// The passes that an upload is followed by.
#[derive(Clone, Copy)]
pub(crate) struct Analyses<'a> {
    pub bandwidth: Option<&'a EnvironmentBandwidth>,
    pub prefilter: Option<&'a Prefilter>,
    /// Whether directions are drawn from what is left without suns.
    pub rest: bool,
}

/// Created and filled, not yet recorded.
pub(crate) struct EnvironmentUpload {
    map: ImageUpload,
    rest: Option<ImageUpload>,
    alias: ImageUpload,
    bandwidth: Option<environment_bandwidth::Work>,
    prefiltered: Option<prefilter::Work>,
    mean: f64,
}

impl EnvironmentUpload {
    pub fn new(build: &mut Build<'_>, map: &LatLong, passes: Analyses<'_>, samplers: &Samplers) -> Result<Self> {
        // Its largest sum over texels must stay finite in 32 bits.
        let brightest = map.texels().iter().flatten().copied().fold(0.0, f32::max);
        if brightest > 1e30 {
            return Err(Error::invalid("environment radiance", "at most 1e30", brightest));
        }
        let rest = passes.rest.then(|| Suns::of(map).removed(map));
        let importance = EnvironmentImportance::build(rest.as_ref().unwrap_or(map))?;
        let density = importance.density_texels();
        let texels = |map: &LatLong| -> Vec<[f32; 4]> {
            map.texels().iter().zip(&density).map(|(&[r, g, b], density)| [r, g, b, *density]).collect()
        };
        let slots = importance.alias().packed();
        let desc = |name, format, [width, height]: [u32; 2]| {
            ImageDesc::new(name, format, [width, height, 1], vk::ImageUsageFlags::SAMPLED)
        };
        let radiance = |name| desc(name, vk::Format::R32G32B32A32_SFLOAT, [map.width(), map.height()]);
        let alias_desc =
            desc("environment alias", vk::Format::R32G32B32A32_UINT, [SLOTS_A_ROW, slots.len() as u32 / SLOTS_A_ROW]);
        let upload = ImageUpload::new(build, radiance("environment"), bytemuck::cast_slice(&texels(map)))?;
        let rest = rest
            .map(|rest| ImageUpload::new(build, radiance("environment without suns"), bytemuck::cast_slice(&texels(&rest))))
            .transpose()?;
        let bandwidth = passes.bandwidth.map(|pass| pass.prepare(build, samplers, map, &upload.image)).transpose()?;
        let prefiltered = passes.prefilter.map(|pass| pass.prepare(build, samplers, map, &upload.image)).transpose()?;
        let alias = ImageUpload::new(build, alias_desc, bytemuck::cast_slice(&slots))?;
        Ok(Self { map: upload, rest, alias, bandwidth, prefiltered, mean: map.mean_luminance() })
    }

    /// With the passes that it was created with.
    pub fn record(self, rec: &mut Recorder<'_>, passes: Analyses<'_>, bag: &mut Retired) -> EnvironmentImages {
        rec.begin(NAME);
        let (map, alias) = (self.map.record(rec, bag), self.alias.record(rec, bag));
        let rest = self.rest.map(|rest| rest.record(rec, bag));
        rec.end();
        let io = environment_bandwidth::Io { map: &map };
        let bandwidth = self.bandwidth.zip(passes.bandwidth).map(|(work, pass)| pass.record(rec, &io, work, bag));
        let io = prefilter::Io { map: &map };
        let prefiltered = self.prefiltered.zip(passes.prefilter).map(|(work, pass)| pass.record(rec, &io, work, bag));
        EnvironmentImages { map, rest, alias, bandwidth, prefiltered, mean: self.mean }
    }
}

impl EnvironmentImages {
    /// Declares the images sampled by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        let all = [&self.map, &self.alias].into_iter().chain(&self.rest);
        all.for_each(|image| rec.image(image, Access::COMPUTE_SAMPLED));
    }

    /// What directions are drawn from.
    pub fn drawn(&self) -> &Image {
        self.rest.as_ref().unwrap_or(&self.map)
    }

    pub fn retire(self, states: &mut States, bag: &mut Retired) {
        for image in [self.map, self.alias].into_iter().chain(self.rest).chain(self.bandwidth) {
            states.forget(image.handle);
            image.retire(bag);
        }
        if let Some(prefiltered) = self.prefiltered {
            prefiltered.retire(states, bag);
        }
    }
}
