//! What a session shows: camera, draws and lights, as the renderer takes them.

use crate::gpu::access::{Access, ImageRef};
use crate::gpu::image::Image;
use crate::offline::window::{Window, near};
use crate::offline::world::{Camera, World};
use crate::{Draw, EnvironmentUse, FrameInputs, GBufferInput, Light, ShadowMasks, View};

/// An image of the session's own that frames sample.
fn sampled(image: &Image) -> ImageRef {
    ImageRef {
        image: image.handle,
        view: image.view,
        format: image.desc.format,
        extent: image.extent(),
        aspect: image.desc.aspect(),
        entry: Access::COMPUTE_SAMPLED,
        exit: Access::COMPUTE_SAMPLED,
    }
}

/// What every frame of a session shows.
pub(super) struct Shown {
    pub camera: Camera,
    pub near: f64,
    pub view: View,
    pub draws: Vec<Draw>,
    pub environment: EnvironmentUse,
    pub lights: Vec<Light>,
    /// Masks of the lights, in layers.
    pub shadows: Option<Image>,
    /// Of [`crate::Rate::Given`].
    pub levels: Option<Image>,
}

impl Shown {
    /// The world without its objects, which are uploaded one by one.
    pub fn of(world: &World, extent: [u32; 2]) -> Self {
        // Without an environment nothing is spent on sampling one.
        let none = EnvironmentUse { intensity: 0.0, ..EnvironmentUse::default() };
        let environment = world.environment.as_ref().map_or(none, |e| EnvironmentUse {
            intensity: e.intensity as f32,
            rotation: e.rotation as f32,
            visible: e.visible,
        });
        let (camera, near) = (world.camera, near(world));
        Self {
            camera,
            near,
            view: Window::whole(extent).view(&camera, near),
            draws: Vec::new(),
            environment,
            lights: world.lights.clone(),
            shadows: None,
            levels: None,
        }
    }

    /// Of a frame with this seed.
    pub fn inputs(&self, seed: [u32; 2]) -> FrameInputs<'_> {
        let Self { view, draws, environment, lights, shadows, levels, .. } = self;
        let frame = FrameInputs::new(0, *view, GBufferInput::Draws(draws));
        let levels = levels.as_ref().map(sampled);
        let shadows = shadows.as_ref().map(|image| ShadowMasks { image: sampled(image), layers: image.desc.layers.unwrap_or(1) });
        FrameInputs { environment: *environment, lights, shadows, seed, levels, ..frame }
    }
}
