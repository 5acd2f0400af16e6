//! The frame, readable top to bottom: which pass, in which order, on which images. What comes before it is in `set_up.rs`.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::frame::{FrameInputs, GBufferInput, Output};
use crate::frequency::allocation::DARK;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::context::{Context, Host};
use crate::gpu::memory::{HostAllocator, Location};
use crate::gpu::pipeline::BridgeSets;
use crate::gpu::recorder::{Recorder, States};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::sampler::Samplers;
use crate::gpu::timer::{FrameTimings, GpuTimer};
use crate::kinds::OfKinds;
use crate::light;
use crate::pass::environment::EnvironmentImages;
use crate::pass::gbuffer;
use crate::pass::materials::{MaterialBridge, MaterialImages};
use crate::pass::object_cells::ObjectCells;
use crate::pass::surfaces::Surfaces;
use crate::pass::{
    FrameUniform, allocate, bandwidth, base, classify, curvature, filter, level, luminance, pyramid, residual_level, resolve,
    shade, shading_rate, texture_space, tonemap, upsample, vmf_mips,
};
use crate::passes::Passes;
use crate::plan::{Directions, LIGHT_BYTES};
use crate::rounds;
use crate::targets::Targets;
use ash::vk;
use glam::Mat3;

/// Says so when a renderer is dropped instead of destroyed: its handles leak, since submitted work may still use them.
struct Undestroyed;

impl Drop for Undestroyed {
    fn drop(&mut self) {
        log::error!("a renderer was dropped without `destroy` and its handles leak");
    }
}

/// The renderer: records frames into the host's command buffers. It never submits and never waits.
pub struct Renderer {
    pub(crate) cx: Context,
    pub(crate) config: Config,
    pub(crate) states: States,
    timer: GpuTimer,
    /// Of [`Self::record_materials`].
    pub(crate) set_up: GpuTimer,
    timings: Option<FrameTimings>,
    pass_bytes: Vec<(&'static str, u64)>,
    /// Of [`Self::record_materials`].
    pub(crate) set_up_bytes: Vec<(&'static str, u64)>,
    pub(crate) samplers: Samplers,
    pub(crate) bridge: MaterialBridge,
    pub(crate) uniforms: Vec<Buffer>,
    lights: Vec<Buffer>,
    pub(crate) passes: Passes,
    pub(crate) targets: Targets,
    /// Whether `targets` hold a frame.
    pub(crate) shown: bool,
    pub(crate) environment: Option<EnvironmentImages>,
    pub(crate) materials: Option<MaterialImages>,
    /// Those that are compiled for their kinds.
    pub(crate) of_kinds: Option<OfKinds>,
    /// Of objects, where these have some of their own.
    pub(crate) cells: Option<ObjectCells>,
    undestroyed: Undestroyed,
}

impl Renderer {
    /// Creates pipelines and images; nothing is recorded or submitted.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a setting out of range, [`Error::MissingRequirements`] with every gap of the device,
    /// [`Error::Allocation`], [`Error::Shader`] or [`Error::Vulkan`]. Nothing is left behind.
    ///
    /// # Safety
    /// The handles in `host` are alive, have the features of [`crate::Requirements`] enabled, and outlive the renderer;
    /// `memory` allocates on the same device.
    pub unsafe fn new(host: &Host<'_>, config: &Config, memory: &mut dyn HostAllocator) -> Result<Self> {
        config.validate()?;
        // SAFETY: as the caller promises.
        unsafe { crate::Requirements::of(config).check(host.instance, host.physical_device) }?;
        let cx = Context::new(host)?;
        let slots = config.frames_in_flight;
        let parts = Build::run(&cx, memory, |build| {
            let timers = (GpuTimer::new(build, slots)?, GpuTimer::new(build, 1)?);
            let samplers = Samplers::new(build)?;
            let bridge = MaterialBridge::new(build, slots)?;
            let mut upload = |name, size, usage| -> Result<Vec<Buffer>> {
                (0..slots).map(|_| Buffer::new(build, name, size, usage, Location::Upload)).collect()
            };
            let uniforms = upload("frame", size_of::<FrameUniform>() as u64, vk::BufferUsageFlags::UNIFORM_BUFFER)?;
            let lights = upload("lights", LIGHT_BYTES, vk::BufferUsageFlags::STORAGE_BUFFER)?;
            let passes = Passes::new(build, config, bridge.layout)?;
            Ok((timers, samplers, bridge, [uniforms, lights], passes, Targets::new(build, config)?))
        })?;
        let ((timer, set_up), samplers, bridge, [uniforms, lights], passes, targets) = parts;
        Ok(Self {
            cx,
            config: config.clone(),
            states: States::default(),
            timer,
            set_up,
            timings: None,
            pass_bytes: Vec::new(),
            set_up_bytes: Vec::new(),
            samplers,
            bridge,
            uniforms,
            lights,
            passes,
            targets,
            shown: false,
            environment: None,
            materials: None,
            of_kinds: None,
            cells: None,
            undestroyed: Undestroyed,
        })
    }

    /// Records one frame.
    ///
    /// # Errors
    /// [`Error::CallOrder`] before an environment and materials were recorded; [`Error::InvalidInput`] for inputs that do
    /// not fit the configuration, with nothing recorded then except the timer's reset; and for more directions, with these materials and lights,
    /// than a driver has rounds of loops for.
    ///
    /// # Safety
    /// `cmd` is recording outside a render pass on the queue family of [`Host`]; command buffers are submitted in the order
    /// in which they were recorded; the work last recorded with `inputs.slot` has finished; handles in `inputs` are alive
    /// until this frame has finished. Bound pipelines, descriptor sets 0 to 2, push constants and dynamic state are lost.
    pub unsafe fn record(&mut self, cmd: vk::CommandBuffer, inputs: &FrameInputs<'_>) -> Result<()> {
        inputs.check(&self.config, self.targets.plan.shading)?;
        let before = "record_environment and record_materials";
        let set_up = (&self.environment, &self.materials, &self.of_kinds);
        let (Some(environment), Some(materials), Some(of_kinds)) = set_up else {
            return Err(Error::CallOrder { called: "record", before });
        };
        if let GBufferInput::Draws(draws) = inputs.gbuffer {
            gbuffer::check_materials(draws, materials.count)?;
            match (&self.cells, &self.passes.texture_space) {
                (Some(objects), _) => objects.check(draws, &materials.maps)?,
                (None, Some(_)) => return Err(Error::CallOrder { called: "record", before: "reserve_cells" }),
                (None, None) => {}
            }
        }
        let (records, counts) = light::records(inputs.lights);
        let [exact, area] = counts;
        let lit = inputs.environment.intensity > 0.0;
        rounds::check(self.cx.most_rounds, &self.config, of_kinds.kinds, lit, counts)?;
        if let Some(timings) = self.timer.begin_frame(&self.cx, cmd, inputs.slot)? {
            self.timings = Some(timings);
        }
        let coordinates = self.config.coordinates || of_kinds.kinds.coordinates;
        let clear = self.targets.gbuffer.as_mut().is_some_and(|images| images.expect(coordinates));
        let uniform = inputs.uniform(&self.config, &self.targets.plan, counts);
        self.uniforms[inputs.slot].bytes_mut().copy_from_slice(bytemuck::bytes_of(&uniform));
        let records: &[u8] = bytemuck::cast_slice(&records);
        self.lights[inputs.slot].bytes_mut()[..records.len()].copy_from_slice(records);
        let (frame, lights) = (&self.uniforms[inputs.slot], &self.lights[inputs.slot]);
        let (samplers, targets, passes) = (&self.samplers, &self.targets, &self.passes);
        let rec = &mut Recorder::new(&self.cx, cmd, inputs.slot, &mut self.states, Some(&mut self.timer));

        // 1  Surfaces: our own G-buffer from draws, or the host's behind its bridge.
        let gbuffer = match (inputs.gbuffer, &passes.gbuffer, &targets.gbuffer) {
            (GBufferInput::Draws(draws), Some(pass), Some(images)) => {
                let clip_from_world = inputs.view.clip_from_world();
                pass.record(rec, &gbuffer::Io { draws, clip_from_world, coordinates, clear, images });
                pass.bridge(rec, images, samplers)
            }
            (GBufferInput::Host { set, images }, None, None) => {
                images.iter().for_each(|image| rec.host_image(image, Access::COMPUTE_SAMPLED));
                set
            }
            _ => return Err(Error::invalid("gbuffer", format!("as {:?}", self.config.gbuffer), "the other kind")),
        };
        let bridge = BridgeSets { gbuffer, materials: self.bridge.write(rec, materials, samplers) };

        // 2  Their materials at the pixel's scale, by cells of directions that may be each object's own.
        let objects = self.cells.as_ref();
        if let (Some(pass), Some((_, mips, ..)), Some(objects), GBufferInput::Draws(draws)) =
            (&passes.texture_space, &passes.moments, objects, inputs.gbuffer)
        {
            let world_from_view = inputs.view.world_from_view();
            let (maps, eye) = (&materials.maps, world_from_view.w_axis.truncate());
            pass.record(rec, &texture_space::Io { draws, eye, objects });
            let view_from_world = Mat3::from_mat4(world_from_view).transpose();
            mips.record_objects(rec, &vmf_mips::ObjectIo { maps, objects, draws, view_from_world });
        }
        let (normals, factors, lobes) = (&targets.normals, &targets.factors, &targets.lobes);
        of_kinds
            .filter
            .record(rec, &filter::Io { frame, bridge, samplers, maps: &materials.maps, objects, normals, factors, lobes });
        if let (Some(pass), Some(curvature)) = (&passes.curvature, &targets.curvature) {
            pass.record(rec, &curvature::Io { frame, bridge, samplers, normals, curvature });
        }

        // What shadows lights, for whatever looks at these.
        let shadows = match &inputs.shadows {
            Some(masks) => {
                rec.host_image(&masks.image, Access::COMPUTE_SAMPLED);
                masks.image.view
            }
            None => {
                rec.image(&targets.unshadowed, Access::COMPUTE_SAMPLED);
                targets.unshadowed.view
            }
        };

        let light_count = exact + area;
        let surfaces = Surfaces { frame, bridge, samplers, normals, factors, lobes, materials, lights, light_count, shadows };

        // 4  The level of every sample: predicted, by the frame before, the same, or the host's.
        let shading = targets.plan.shading;
        let analysed = environment.bandwidth.as_ref().zip(materials.bandwidths.as_ref());
        let predict = of_kinds.bandwidth.as_ref().zip(analysed).zip(targets.prediction.as_ref());
        let mut forecast = None;
        let level = match (&targets.level, &inputs.levels) {
            (Some(level), _) if let Some(((pass, (environment_bandwidth, material_bandwidths)), prediction)) = predict => {
                pass.record(
                    rec,
                    &bandwidth::Io {
                        surfaces,
                        environment,
                        environment_bandwidth,
                        material_bandwidths,
                        dark: (DARK * environment.mean * f64::from(inputs.environment.intensity)) as f32,
                        level,
                        prediction,
                    },
                );
                forecast = Some(&prediction.forecast);
                rec.image(level, Access::COMPUTE_SAMPLED);
                Some(level.view)
            }
            (Some(level), _) if let (Some(pass), Some(fits)) = (&of_kinds.residual_level, &materials.fits) => {
                pass.record(rec, &residual_level::Io { surfaces, fits, area_lights: area > 0, level });
                rec.image(level, Access::COMPUTE_SAMPLED);
                Some(level.view)
            }
            (Some(level), _) => {
                match (&passes.luminance, &targets.luminance) {
                    (Some(pass), Some([tiles, mean])) if self.shown => {
                        let previous = &targets.resolved;
                        pass.record(rec, &luminance::Io { frame, samplers, previous, tiles, mean, level });
                    }
                    (Some(_), _) => level::record(rec, &level::Io { level, value: 0 }),
                    (None, _) => level::record(rec, &level::Io { level, value: targets.plan.levels.top }),
                }
                rec.image(level, Access::COMPUTE_SAMPLED);
                Some(level.view)
            }
            (None, Some(image)) => {
                rec.host_image(image, Access::COMPUTE_SAMPLED);
                Some(image.view)
            }
            (None, None) => None,
        };

        // 5  Their cells.
        let mut from = classify::From::Samples(shading);
        if let (Some(pass), Some(buffers), Some(view)) = (&passes.pyramid, &targets.cells, level) {
            let cells = buffers.cells();
            pass.record(
                rec,
                &pyramid::Io {
                    frame,
                    bridge,
                    level: (view, samplers.nearest),
                    shading,
                    groups: forecast.map(|f| (f, bandwidth::OF_CELLS)),
                    cells,
                },
            );
            from = classify::From::Cells(cells, &buffers.weights, forecast.map(|f| (f, bandwidth::OF_SAMPLES)));
        }

        if let (Some(pass), Some(rates), Some(view)) = (&passes.shading_rate, &targets.rates, level) {
            let (level, target) = ((view, samplers.nearest), inputs.shading_rate.as_ref());
            pass.record(rec, &shading_rate::Io { frame, bridge, level, extent: self.config.extent, rates, target });
        }

        // 6  Which samples to shade.
        let (arguments, list) = (&targets.arguments, &targets.list);
        if let Some(classify) = &passes.classify {
            classify.record(rec, &classify::Io { frame, bridge, from, arguments, list });
        }
        let directions = Directions::of(&self.config, lit, area);
        let mut to_shade = list;
        if let (Some(pass), Some(buffers), Some(prediction)) = (&passes.allocate, &targets.allocation, &targets.prediction) {
            let prediction = &prediction.image;
            let sources = area + u32::from(directions.environment > 0);
            pass.record(rec, &allocate::Io { samplers, prediction, arguments, list, sources, buffers });
            to_shade = &buffers.list;
        }

        // 7  Radiance of all, from pre-convolved light.
        let radiance = &targets.radiance;
        if let (Some(pass), Some(prefiltered), Some(fits)) = (&of_kinds.base, &environment.prefiltered, &materials.fits) {
            pass.record(rec, &base::Io { surfaces, prefiltered, fits, radiance: targets.base.as_ref().unwrap_or(radiance) });
        }

        // 8  Radiance of the samples to shade, or what the base leaves of it.
        let offset = shade::offset(environment.mean * f64::from(inputs.environment.intensity), inputs.lights);
        if let Some(pass) = &of_kinds.shade {
            let known = targets.base.as_ref().zip(materials.fits.as_ref()).zip(environment.prefiltered.as_ref());
            let residual = known.map(|((base, fits), light)| shade::Residual { base, fits, suns: &light.suns, offset });
            pass.record(
                rec,
                &shade::Io {
                    surfaces,
                    environment,
                    arguments,
                    list: to_shade,
                    directions,
                    residual,
                    radiance,
                    odd: targets.odd.as_ref(),
                },
            );
        }
        if let (Some(pass), Some(buffers), Some(odd)) = (&passes.upsample, &targets.cells, &targets.odd) {
            let (cells, weights, values) = (buffers.cells(), &buffers.weights, [radiance, odd]);
            pass.record(rec, &upsample::Io { frame, samplers, cells, weights, values });
        }

        // 9  The output.
        let (resolved, base) = (&targets.resolved, targets.base.as_ref().map(|base| (base, offset)));
        passes.resolve.record(rec, &resolve::Io { frame, bridge, samplers, environment, radiance, base, resolved });
        if let Some(Output { image, transfer }) = &inputs.output {
            passes.tonemap.record(rec, &tonemap::Io { samplers, resolved, target: image, transfer: *transfer });
            rec.release(image);
        }
        if let GBufferInput::Host { images, .. } = inputs.gbuffer {
            images.iter().for_each(|image| rec.release(image));
        }
        for image in inputs.levels.iter().chain(inputs.shadows.as_ref().map(|masks| &masks.image)) {
            rec.release(image);
        }
        self.pass_bytes = std::mem::take(&mut rec.pass_bytes);
        self.shown = true;
        Ok(())
    }

    /// Settings in force.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// GPU times of the last frame whose slot came round again; `None` until then, or without timestamps.
    pub fn timings(&self) -> Option<&FrameTimings> {
        self.timings.as_ref()
    }

    /// Bytes of the images and buffers that each pass of the last recorded frame declared.
    pub fn pass_bytes(&self) -> &[(&'static str, u64)] {
        &self.pass_bytes
    }

    /// Gives everything back.
    pub fn destroy(mut self) -> Retired {
        let mut bag = Retired::default();
        if let Some(environment) = self.environment {
            environment.retire(&mut self.states, &mut bag);
        }
        if let Some(cells) = self.cells {
            cells.retire(&mut self.states, &mut bag);
        }
        if let Some(passes) = self.of_kinds {
            passes.retire(&mut bag);
        }
        if let Some(materials) = self.materials {
            materials.retire(&mut self.states, &mut bag);
        }
        self.targets.retire(&mut self.states, &mut bag);
        self.passes.retire(&mut bag);
        self.uniforms.into_iter().chain(self.lights).for_each(|b| b.retire(&mut bag));
        self.bridge.retire(&mut bag);
        self.samplers.retire(&mut bag);
        self.timer.retire(&mut bag);
        self.set_up.retire(&mut bag);
        std::mem::forget(self.undestroyed);
        bag
    }
}
