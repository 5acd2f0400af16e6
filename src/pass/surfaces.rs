//! What the passes that evaluate surfaces under light read alike, and what they are compiled for.

use crate::config::Config;
use crate::distribution::Filter;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::Image;
use crate::gpu::pipeline::BridgeSets;
use crate::gpu::recorder::Recorder;
use crate::gpu::sampler::Samplers;
use crate::kinds::Kinds;
use crate::pass::materials::MaterialImages;
use ash::vk;

/// Of a frame.
#[derive(Clone, Copy)]
pub(crate) struct Surfaces<'a> {
    pub frame: &'a Buffer,
    pub bridge: BridgeSets,
    pub samplers: &'a Samplers,
    /// Of the `filter` pass.
    pub normals: &'a Image,
    pub factors: &'a Image,
    pub lobes: &'a Image,
    pub materials: &'a MaterialImages,
    /// Exact lights first.
    pub lights: &'a Buffer,
    pub light_count: u32,
    /// Masks of them, in an array.
    pub shadows: vk::ImageView,
}

impl Surfaces<'_> {
    /// Declares what is sampled of them by the pass that is open.
    pub fn sampled(&self, rec: &mut Recorder<'_>) {
        self.materials.sampled(rec);
        [self.normals, self.factors, self.lobes].into_iter().for_each(|image| rec.image(image, Access::COMPUTE_SAMPLED));
    }
}

/// Constants of `glsl/include/lobes.glsl` and `approximation.glsl`, and whether there are materials whose lobes the filter does not
/// find.
pub(crate) fn lobe_constants(config: &Config, kinds: Kinds) -> [u32; 8] {
    let layers = config.filter.lobe_layers();
    let slopes = config.filter.has_slopes();
    let smith = config.filter == Filter::Leadr;
    let elliptic = u32::from(config.filter.is_elliptic()) + u32::from(kinds.coloured);
    let of_kinds = [kinds.unfiltered, kinds.fitted, kinds.reflected].map(u32::from);
    let of_filter = [layers > 0, slopes, smith].map(u32::from);
    let ([lobed, slopes, smith], [unfiltered, fitted, reflected]) = (of_filter, of_kinds);
    [layers.max(1), lobed, slopes, smith, unfiltered, elliptic, fitted, reflected]
}
