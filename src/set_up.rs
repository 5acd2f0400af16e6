//! What is recorded when something changes: the environment, the materials.

use crate::config::{Estimator, Rate};
use crate::distribution::effective::Rule;
use crate::error::Result;
use crate::gpu::memory::HostAllocator;
use crate::gpu::pipeline::BridgeLayouts;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::gpu::timer::FrameTimings;
use crate::material::Material;
use crate::pass::environment::{Analyses, EnvironmentUpload};
use crate::pass::maps::Reading;
use crate::pass::materials::MaterialsUpload;
use crate::pass::{PassContext, base, brdf_map, filter, vmf_mips};
use crate::passes::layout;
use crate::renderer::Renderer;
use crate::sampling::LatLong;
use ash::vk;

impl Renderer {
    /// Replaces the environment: creates its images and records their upload. The bag holds the staging memory and the
    /// former environment.
    ///
    /// # Errors
    /// As [`Self::new`]; the former environment stays then.
    ///
    /// # Safety
    /// `cmd` is recording outside a render pass, and is submitted before any frame recorded afterwards.
    pub unsafe fn record_environment(
        &mut self,
        cmd: vk::CommandBuffer,
        map: &LatLong,
        memory: &mut dyn HostAllocator,
    ) -> Result<Retired> {
        let passes =
            Analyses { bandwidth: self.passes.environment_bandwidth.as_ref(), prefilter: self.passes.prefilter.as_ref() };
        let upload = Build::run(&self.cx, memory, |build| EnvironmentUpload::new(build, map, passes, &self.samplers))?;
        let mut bag = Retired::default();
        let mut rec = Recorder::new(&self.cx, cmd, 0, &mut self.states, None);
        let fresh = upload.record(&mut rec, passes, &mut bag);
        if let Some(former) = self.environment.replace(fresh) {
            former.retire(&mut self.states, &mut bag);
        }
        Ok(bag)
    }

    /// Replaces the materials: builds their importance tables, compiles the pass that reads their maps and records the uploads.
    /// Draws and G-buffers name them by index. The bag holds the staging memory and the former materials.
    ///
    /// # Errors
    /// As [`Self::new`]; the former materials stay then.
    ///
    /// # Safety
    /// As [`Self::record_environment`].
    pub unsafe fn record_materials(
        &mut self,
        cmd: vk::CommandBuffer,
        materials: &[Material],
        memory: &mut dyn HostAllocator,
    ) -> Result<Retired> {
        let bridge = BridgeLayouts { gbuffer: layout(&self.passes.gbuffer, &self.config), materials: self.bridge.layout };
        let config = &self.config;
        let rule = if config.takes_lobes_literally() { Rule::Literal } else { Rule::Exact };
        let (modules, slots, widened) = (&config.modules, config.frames_in_flight, config.widened());
        let (filter, passes, samplers) = (self.config.filter, self.passes.moments.as_ref(), &self.samplers);
        let eps = (self.config.rate == Rate::Bandwidth).then_some(self.config.eps);
        if self.config.estimator == Estimator::Preconvolved {
            base::check_materials(materials)?;
        }
        let (mut upload, filter) = Build::run(&self.cx, memory, |build| {
            let upload = MaterialsUpload::new(build, materials, &Reading { filter, rule, widened, passes, samplers }, eps)?;
            let mut p = PassContext { build, modules, bridge, slots };
            let filter = filter::Filter::new(&mut p, config, upload.uses())?;
            Ok((upload, filter))
        })?;
        let mut bag = Retired::default();
        self.set_up.restart(&self.cx, cmd, 0);
        let mut rec = Recorder::new(&self.cx, cmd, 0, &mut self.states, Some(&mut self.set_up));
        rec.begin(crate::pass::materials::NAME);
        let work = upload.work();
        let fresh = upload.record(&mut rec, &mut bag);
        rec.end();
        if let (Some((map, mips)), Some((of_map, of_mips))) = (&self.passes.moments, work) {
            map.record(&mut rec, &brdf_map::Io { maps: &fresh.maps }, &of_map);
            mips.record(&mut rec, &vmf_mips::Io { maps: &fresh.maps }, &of_map, &of_mips);
            of_map.retire(&mut bag);
            of_mips.retire(&mut bag);
        }
        if let Some((former, pass)) = self.materials.replace((fresh, filter)) {
            former.retire(&mut self.states, &mut bag);
            pass.retire(&mut bag);
        }
        Ok(bag)
    }

    /// GPU times of the last [`Self::record_materials`], which has run; `None` without timestamps.
    ///
    /// # Errors
    /// [`crate::Error::Vulkan`].
    pub fn set_up_timings(&self) -> Result<Option<FrameTimings>> {
        self.set_up.results(&self.cx, 0)
    }
}
