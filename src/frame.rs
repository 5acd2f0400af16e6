//! What a host hands over for one frame.

use crate::config::{Config, Estimator, Rate};
use crate::error::{Error, Result};
use crate::gpu::access::ImageRef;
use crate::light::{self, Light};
use crate::pass::gbuffer::{self, Draw};
use crate::pass::{FrameUniform, base, shading_rate, tonemap};
use crate::plan::Plan;
use crate::view::View;
use ash::vk;

/// Where this frame's G-buffer comes from; must match [`Config::gbuffer`].
#[derive(Clone, Copy)]
pub enum GBufferInput<'a> {
    /// Meshes to rasterise.
    Draws(&'a [Draw]),
    /// The host's own.
    Host {
        /// Set 0, allocated with the layout of [`crate::GBufferSource::Host`], unchanged until the frame has finished.
        set: vk::DescriptorSet,
        /// The images in it: sampled in compute between their entry and exit.
        images: &'a [ImageRef],
    },
}

/// Where the image goes.
#[derive(Clone, Copy)]
pub struct Output {
    /// A storage image of one of [`tonemap::FORMATS`] and of [`Config::extent`].
    pub image: ImageRef,
    /// Linear or display values.
    pub transfer: tonemap::Transfer,
}

/// How much of each light beside the environment arrives at each pixel, as the host found it: shadows. Where a mask changes, levels of
/// predicted rates are fine enough to show it.
#[derive(Clone, Copy)]
pub struct ShadowMasks {
    /// An image of one of [`SHADOW_FORMATS`] and of the output's or of the samples' extent, whose view is a 2-D array of one level; sampled
    /// between its entry and exit. Its first channel is a factor on the light.
    pub image: ImageRef,
    /// Layers of the view: that of number i is of [`FrameInputs::lights`]`[i]`. Lights beyond them are unshadowed.
    pub layers: u32,
}

/// Formats that [`ShadowMasks`] may have.
pub const SHADOW_FORMATS: [vk::Format; 5] =
    [vk::Format::R8_UNORM, vk::Format::R16_UNORM, vk::Format::R16_SFLOAT, vk::Format::R32_SFLOAT, vk::Format::R8G8B8A8_UNORM];

/// How the environment is used in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentUse {
    /// Factor on radiance.
    pub intensity: f32,
    /// Degrees about +Y.
    pub rotation: f32,
    /// Whether the background shows it; black otherwise.
    pub visible: bool,
}

impl Default for EnvironmentUse {
    fn default() -> Self {
        Self { intensity: 1.0, rotation: 0.0, visible: false }
    }
}

/// Everything that changes from frame to frame.
#[derive(Clone, Copy)]
pub struct FrameInputs<'a> {
    /// Which of [`Config::frames_in_flight`] slots; the work last recorded with it has finished.
    pub slot: usize,
    /// Camera.
    pub view: View,
    /// Surfaces.
    pub gbuffer: GBufferInput<'a>,
    /// Environment.
    pub environment: EnvironmentUse,
    /// Lights beside it, at most [`MAX_LIGHTS`](crate::light::MAX_LIGHTS).
    pub lights: &'a [Light],
    /// What shadows them, if the host knows.
    pub shadows: Option<ShadowMasks>,
    /// For [`crate::Rate::Given`]: the level of each sample, in levels over a sample (0 is finest), in an image of
    /// `R8_UINT` and of the samples' extent, sampled between its entry and exit. Coarser than the configuration's coarsest
    /// counts as that.
    pub levels: Option<ImageRef>,
    /// With [`Config::shading_rate`]: an image of [`shading_rate::FORMAT`](crate::pass::shading_rate::FORMAT) with a texel for each
    /// [`ShadingRate::texel`](crate::ShadingRate::texel) pixels, rounded up, to whose level 0 and layer 0 a transfer writes between its entry and exit; its view
    /// is not used. Each is the finest level of the surfaces that it stands for, as `VK_KHR_fragment_shading_rate` has it, or the
    /// coarsest that there can be.
    pub shading_rate: Option<ImageRef>,
    /// Seed and frame number of the sample points.
    pub seed: [u32; 2],
    /// The host's image; `None` leaves the result in the renderer's own.
    pub output: Option<Output>,
}

impl ShadowMasks {
    /// Refuses masks that are of none of `extents`, or more than `lights`.
    fn check(&self, extents: [[u32; 2]; 2], lights: usize) -> Result<()> {
        let ImageRef { format, extent, .. } = self.image;
        if !SHADOW_FORMATS.contains(&format) {
            return Err(Error::invalid("shadows.image.format", format!("one of {SHADOW_FORMATS:?}"), format!("{format:?}")));
        }
        if !extents.contains(&extent) {
            let [output, samples] = extents;
            let expected = if output == samples { format!("{output:?}") } else { format!("{output:?} or {samples:?}") };
            return Err(Error::invalid("shadows.image.extent", expected, format!("{extent:?}")));
        }
        if self.layers == 0 || self.layers as usize > lights {
            return Err(Error::invalid("shadows.layers", format!("1 to {lights}, the number of lights"), self.layers));
        }
        Ok(())
    }
}

impl<'a> FrameInputs<'a> {
    /// A frame under the environment as it is, with no other light and no output but the renderer's own.
    pub fn new(slot: usize, view: View, gbuffer: GBufferInput<'a>) -> Self {
        Self {
            slot,
            view,
            gbuffer,
            environment: EnvironmentUse::default(),
            lights: &[],
            shadows: None,
            levels: None,
            shading_rate: None,
            seed: [0, 0],
            output: None,
        }
    }

    /// Refuses what cannot be recorded with `config` on `shading` samples.
    pub(crate) fn check(&self, config: &Config, shading: [u32; 2]) -> Result<()> {
        if self.slot >= config.frames_in_flight {
            return Err(Error::invalid("slot", format!("below {}", config.frames_in_flight), self.slot));
        }
        self.view.validate()?;
        let EnvironmentUse { intensity, rotation, .. } = self.environment;
        if !(intensity >= 0.0 && intensity.is_finite() && rotation.is_finite()) {
            return Err(Error::invalid("environment", "finite rotation and intensity >= 0", format!("{:?}", self.environment)));
        }
        light::check(self.lights)?;
        if config.estimator == Estimator::Preconvolved {
            base::check_lights(self.lights)?;
        }
        match self.gbuffer {
            GBufferInput::Draws(draws) => gbuffer::check(draws)?,
            GBufferInput::Host { images, .. } => {
                if let Some(i) = images.iter().position(|image| image.extent != shading) {
                    return Err(Error::invalid(
                        format!("gbuffer.images[{i}].extent"),
                        format!("{shading:?}"),
                        format!("{:?}", images[i].extent),
                    ));
                }
            }
        }
        if let Some(masks) = &self.shadows {
            masks.check([config.extent, shading], self.lights.len())?;
        }
        match (&self.levels, config.rate) {
            (Some(image), Rate::Given) => {
                let got = (image.format, image.extent);
                let expected = (vk::Format::R8_UINT, shading);
                if got != expected {
                    return Err(Error::invalid("levels", format!("{expected:?}"), format!("{got:?}")));
                }
            }
            (None, Rate::Given) => return Err(Error::invalid("levels", "an image, as the rate is Given", "none")),
            (Some(_), rate) => return Err(Error::invalid("levels", format!("none, as the rate is {rate:?}"), "an image")),
            (None, _) => {}
        }
        if let Some(image) = &self.shading_rate {
            shading_rate::check(image, config.shading_rate, config.extent)?;
        }
        match &self.output {
            Some(output) => tonemap::check(&output.image, output.transfer, config.extent),
            None => Ok(()),
        }
    }

    /// What the shaders know of the frame; `exact` and `area` count the lights.
    pub(crate) fn uniform(&self, config: &Config, plan: &Plan, [exact, area]: [u32; 2]) -> FrameUniform {
        let world = self.view.world_from_view();
        let shading = plan.shading;
        let EnvironmentUse { intensity, rotation, visible } = self.environment;
        FrameUniform {
            world_from_view: [world.x_axis, world.y_axis, world.z_axis].map(|c| c.to_array()),
            eye: world.w_axis.to_array(),
            ray: self.view.ray().to_array(),
            extent: [shading[0], shading[1], config.samples_per_side, u32::from(visible)],
            sampling: [self.seed[0], self.seed[1], config.directions, 0],
            // A turn about +Y moves the map towards smaller u.
            environment: [-rotation / 360.0, intensity, 0.0, 0.0],
            lights: [exact, area, self.shadows.map_or(0, |masks| masks.layers), 0],
            levels: plan.levels.uniform(),
        }
    }
}
