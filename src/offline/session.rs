//! A world on a device: uploaded once, rendered frame by frame, read back.

use crate::distribution::{LobeFit, chart};
use crate::gpu::access::Access;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::timer::FrameTimings;
use crate::gpu::upload::ImageUpload;
use crate::offline::error::{Error, Result};
use crate::offline::headless::Headless;
use crate::offline::mesh_buffers::MeshBuffers;
use crate::offline::prepared::Prepared;
use crate::offline::progress::Progress;
pub use crate::offline::read_back::MomentLevels;
use crate::offline::shadows::Shadows;
use crate::offline::shown::Shown;
use crate::offline::window::{Window, near};
use crate::offline::world::World;
use crate::pass::{brdf_map, cluster_moments, mixtures, vmf_mips};
use crate::plan::Levels;
use crate::renderer::Renderer;
use crate::sampling::LatLong;
use crate::{Config, Material, View};
use ash::vk;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

/// The set-up time of uploading meshes.
const MESHES: &str = "meshes";

/// Milliseconds of set-up work by name.
pub type SetupTimes = Vec<(&'static str, f64)>;

/// A renderer with a world's meshes, materials and environment on the device.
pub struct Session {
    pub(super) headless: Headless,
    pub(super) renderer: Option<Renderer>,
    /// Those that the renderer has.
    pub(super) materials: Vec<Material>,
    /// By the address of the mesh.
    meshes: HashMap<usize, MeshBuffers>,
    pub(super) shown: Shown,
    setup: SetupTimes,
    material_bytes: u64,
    record_ms: f64,
}

impl Session {
    /// Uploads `world` for frames of `config`, which must use draws.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn new(headless: Headless, world: &World, config: &Config) -> Result<Self> {
        Self::opening(headless, world, config, &mut |_, _, _| ())
    }

    /// The same; `told` is told how many of how many materials are analysed and fitted, which takes seconds each.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn opening(mut headless: Headless, world: &World, config: &Config, told: &mut Progress<'_>) -> Result<Self> {
        let mut setup = SetupTimes::new();
        let clock = Instant::now();
        let mut renderer = {
            let (host, memory) = headless.parts()?;
            // SAFETY: the handles live in `headless`, which outlives the renderer: `drop` destroys the renderer first.
            unsafe { Renderer::new(&host, config, memory) }?
        };
        setup.push(("pipelines", milliseconds(clock)));

        let clock = Instant::now();
        let others = headless.live_bytes();
        let Prepared { materials, mixtures_ms } = Prepared::new(world, config, told);
        // SAFETY: the command buffer is recording and submitted at once.
        headless.submit(|cmd, memory| Ok(unsafe { renderer.record_materials(cmd, &materials, memory) }?))?;
        // Beside the work on the processor, with which the rest of it is told.
        let on_device = of_maps(&renderer)?;
        let material_bytes = headless.live_bytes().saturating_sub(others + renderer.fit_bytes());
        let others = on_device.iter().map(|(_, time)| time).sum::<f64>() + mixtures_ms.unwrap_or_default();
        setup.push((crate::pass::materials::NAME, milliseconds(clock) - others));
        setup.extend(mixtures_ms.map(|ms| (mixtures::NAME, ms)));
        setup.extend(on_device);

        let clock = Instant::now();
        let dark = LatLong::new(1, 1, vec![[0.0; 3]])?;
        let map = world.environment.as_ref().map_or(&dark, |e| &e.map);
        // SAFETY: as above.
        headless.submit(|cmd, memory| Ok(unsafe { renderer.record_environment(cmd, map, memory) }?))?;
        setup.push((crate::pass::environment::NAME, milliseconds(clock)));

        let clock = Instant::now();
        let shown = Shown::of(world, config.extent);
        let (meshes, record_ms) = (HashMap::new(), 0.0);
        let mut session = Self { headless, renderer: Some(renderer), materials, meshes, shown, setup, material_bytes, record_ms };
        session.upload_objects(world, &mut HashMap::new())?;
        session.reserve_cells(world)?;
        session.set_shadows(world.shadows.as_deref())?;
        session.setup.push((MESHES, milliseconds(clock)));
        Ok(session)
    }

    /// Shows `world` as it is now from the next frame on: its camera and its objects. Meshes that are not on the device are
    /// uploaded, those that no object has any more are freed; materials, environment and lights stay those of the beginning.
    /// Nothing is derived from geometry. The time counts as set-up.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn show(&mut self, world: &World) -> Result<()> {
        let clock = Instant::now();
        let extent = self.renderer.as_ref().ok_or_else(closed)?.config().extent;
        (self.shown.camera, self.shown.near) = (world.camera, near(world));
        self.look_through(&Window::whole(extent));
        self.shown.draws.clear();
        let mut former = std::mem::take(&mut self.meshes);
        let uploaded = self.upload_objects(world, &mut former);
        let mut bag = Retired::default();
        former.into_values().for_each(|buffers| buffers.retire(&mut bag));
        let (host, memory) = self.headless.parts()?;
        // SAFETY: every submission was waited for.
        unsafe { bag.free(host.device, memory) };
        if let Some((_, time)) = self.setup.iter_mut().find(|(name, _)| *name == MESHES) {
            *time += milliseconds(clock);
        }
        uploaded.and_then(|()| self.reserve_cells(world))
    }

    /// Room for the cells that objects have of their own, once it is sure that their maps can hold them.
    fn reserve_cells(&mut self, world: &World) -> Result<()> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        for (i, object) in world.objects.iter().enumerate() {
            if let Some(size) = renderer.cell_map(object.material as u32) {
                chart::check(&format!("objects[{i}]"), &object.mesh.uvs, &object.mesh.indices, size)?;
            }
        }
        let (host, memory) = self.headless.parts()?;
        let bag = renderer.reserve_cells(&self.shown.draws, memory)?;
        // SAFETY: every submission was waited for.
        unsafe { bag.free(host.device, memory) };
        Ok(())
    }

    /// Shows a part of the camera's image from the next frame on, until [`Self::show`].
    pub(super) fn look_through(&mut self, window: &Window) {
        self.shown.view = window.view(&self.shown.camera, self.shown.near);
    }

    /// Makes the materials anew, as when they had changed: the GPU milliseconds of each pass that makes their maps.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn renew_materials(&mut self, world: &World) -> Result<SetupTimes> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let Prepared { materials, .. } = Prepared::new(world, renderer.config(), &mut |_, _, _| ());
        self.record_materials(materials)
    }

    /// The same of the materials that there are.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn remake_materials(&mut self) -> Result<SetupTimes> {
        self.record_materials(self.materials.clone())
    }

    fn record_materials(&mut self, materials: Vec<Material>) -> Result<SetupTimes> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        // SAFETY: every submission is waited for; the command buffer is recording and submitted at once.
        self.headless.submit(|cmd, memory| Ok(unsafe { renderer.record_materials(cmd, &materials, memory) }?))?;
        self.materials = materials;
        of_maps(renderer)
    }

    /// Renders frames of another size from the next one on, of the same camera.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn resize(&mut self, extent: [u32; 2]) -> Result<()> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let (host, memory) = self.headless.parts()?;
        let bag = renderer.resize(extent, memory)?;
        // SAFETY: every submission was waited for.
        unsafe { bag.free(host.device, memory) };
        self.look_through(&Window::whole(extent));
        Ok(())
    }

    /// The bytes that each pass of the last making of materials moved.
    pub fn set_up_bytes(&self) -> &[(&'static str, u64)] {
        self.renderer.as_ref().map_or(&[], |renderer| &renderer.set_up_bytes)
    }

    /// Replaces the environment's map from the next frame on, with all that is made of it.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn renew_environment(&mut self, map: &LatLong) -> Result<()> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        // SAFETY: every submission is waited for; the command buffer is recording and submitted at once.
        self.headless.submit(|cmd, memory| Ok(unsafe { renderer.record_environment(cmd, map, memory) }?))
    }

    /// Draws for all objects; what they need is taken out of `former` or uploaded.
    fn upload_objects(&mut self, world: &World, former: &mut HashMap<usize, MeshBuffers>) -> Result<()> {
        for (number, object) in (0u32..).zip(&world.objects) {
            let key = Arc::as_ptr(&object.mesh) as usize;
            if !self.meshes.contains_key(&key) {
                let buffers = match former.remove(&key) {
                    Some(buffers) => buffers,
                    None => {
                        let renderer = self.renderer.as_ref().ok_or_else(closed)?;
                        MeshBuffers::upload(&mut self.headless, renderer.context(), &object.mesh)?
                    }
                };
                self.meshes.insert(key, buffers);
            }
            let Some(mesh) = self.meshes.get(&key) else { continue };
            let eye = world.camera.position.as_vec3();
            self.shown.draws.push(mesh.draw(object.transform, eye, object.material as u32, number));
        }
        Ok(())
    }

    /// Renders one frame into the renderer's own images and waits for it.
    ///
    /// # Errors
    /// The library's or the device's.
    pub fn frame(&mut self, seed: [u32; 2]) -> Result<()> {
        let inputs = self.shown.inputs(seed);
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let mut record_ms = 0.0;
        self.headless.submit(|cmd, _| {
            let clock = Instant::now();
            // SAFETY: every submission is waited for, so slot 0 is always free; the buffers live as long as the session.
            unsafe { renderer.record(cmd, &inputs) }?;
            record_ms = milliseconds(clock);
            Ok(Retired::default())
        })?;
        self.record_ms = record_ms;
        Ok(())
    }

    /// CPU milliseconds that [`crate::Renderer::record`] took for the last frame.
    pub fn record_ms(&self) -> f64 {
        self.record_ms
    }

    /// Gives the frames of [`crate::Rate::Given`] the level of each sample, row by row.
    ///
    /// # Errors
    /// [`Error::Argument`] for another number of samples; the device's.
    pub fn set_levels(&mut self, levels: &[u8]) -> Result<()> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let [width, height] = renderer.levels().extents.first().copied().unwrap_or_default();
        if levels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(Error::argument("levels", format!("{width}x{height} samples"), levels.len()));
        }
        let desc = ImageDesc::new("levels", vk::Format::R8_UINT, [width, height, 1], vk::ImageUsageFlags::SAMPLED);
        let former = self.shown.levels.take();
        self.shown.levels = Some(self.upload(former, desc, levels)?);
        Ok(())
    }

    /// Shadows the lights from the next frame on.
    fn set_shadows(&mut self, shadows: Option<&Shadows>) -> Result<()> {
        let Some(Shadows { extent: [width, height], layers }) = shadows else { return Ok(()) };
        let array = Some(layers.len() as u32);
        let usage = vk::ImageUsageFlags::SAMPLED;
        let desc = ImageDesc { layers: array, ..ImageDesc::new("shadows", vk::Format::R32_SFLOAT, [*width, *height, 1], usage) };
        let former = self.shown.shadows.take();
        self.shown.shadows = Some(self.upload(former, desc, bytemuck::cast_slice(&layers.concat()))?);
        Ok(())
    }

    /// An image that frames sample, in the place of `former`.
    fn upload(&mut self, former: Option<Image>, desc: ImageDesc, texels: &[u8]) -> Result<Image> {
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let mut fresh = None;
        self.headless.submit(|cmd, memory| {
            let mut bag = Retired::default();
            if let Some(former) = former {
                former.retire(&mut bag);
            }
            let upload = Build::run(renderer.context(), memory, |build| ImageUpload::new(build, desc, texels))?;
            let mut states = States::default();
            let mut rec = Recorder::new(renderer.context(), cmd, 0, &mut states, None);
            let image = upload.record(&mut rec, &mut bag);
            rec.image(&image, Access::COMPUTE_SAMPLED);
            rec.flush();
            fresh = Some(image);
            Ok(bag)
        })?;
        fresh.ok_or_else(closed)
    }

    /// GPU times of the frame before the last.
    pub fn timings(&self) -> Option<&FrameTimings> {
        self.renderer.as_ref().and_then(Renderer::timings)
    }

    /// Bytes declared by each pass of the last frame.
    pub fn pass_bytes(&self) -> &[(&'static str, u64)] {
        self.renderer.as_ref().map_or(&[], Renderer::pass_bytes)
    }

    /// Bytes of device memory that the materials take: tables, textures, and the maps of the filter, but not
    /// lobe fits, which materials without filtered lobes have.
    pub fn material_bytes(&self) -> u64 {
        self.material_bytes
    }

    /// Set-up times.
    pub fn setup(&self) -> &[(&'static str, f64)] {
        &self.setup
    }

    /// Settings in force.
    pub(crate) fn config(&self) -> Option<&Config> {
        self.renderer.as_ref().map(Renderer::config)
    }

    /// Whether the environment shines, and the number of area lights.
    pub(crate) fn sources(&self) -> (bool, u32) {
        let area = self.shown.lights.iter().filter(|light| light.is_area()).count();
        (self.shown.environment.intensity > 0.0, area as u32)
    }

    /// The fit that stands for each material where light is looked up, if one does.
    pub(crate) fn fits(&self) -> &[Option<Arc<LobeFit>>] {
        self.renderer.as_ref().map_or(&[], Renderer::fits)
    }

    /// What the camera of the next frame sees.
    pub(crate) fn view(&self) -> &View {
        &self.shown.view
    }

    /// Levels of shading.
    pub(crate) fn levels(&self) -> Option<Levels> {
        self.renderer.as_ref().map(|renderer| renderer.levels().clone())
    }

    /// The device.
    pub fn headless(&self) -> &Headless {
        &self.headless
    }

    /// Validation messages so far.
    pub fn messages(&self) -> Vec<String> {
        self.headless.messages()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let mut bag = self.renderer.take().map_or_else(Retired::default, Renderer::destroy);
        let images = [self.shown.levels.take(), self.shown.shadows.take()];
        images.into_iter().flatten().for_each(|image| image.retire(&mut bag));
        self.meshes.drain().for_each(|(_, buffers)| buffers.retire(&mut bag));
        if let Ok((host, memory)) = self.headless.parts() {
            // SAFETY: every submission was waited for.
            unsafe { bag.free(host.device, memory) };
        }
    }
}

/// Times of the passes that made the materials' maps.
fn of_maps(renderer: &Renderer) -> Result<SetupTimes> {
    let known = |name: &&str| [brdf_map::NAME, vmf_mips::NAME, cluster_moments::NAME, mixtures::NAME].contains(name);
    Ok(renderer.set_up_timings()?.unwrap_or_default().passes.into_iter().filter(|(name, _)| known(name)).collect())
}

pub(super) fn closed() -> Error {
    Error::Device("the session is closed".into())
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
