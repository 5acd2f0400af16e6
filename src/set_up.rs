//! What is done when something changes: the environment, the materials, the extent.

use crate::config::{Bins, Config};
use crate::error::{Error, Result};
use crate::gpu::memory::HostAllocator;
use crate::gpu::pipeline::BridgeLayouts;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Retired};
use crate::gpu::timer::FrameTimings;
use crate::kinds::OfKinds;
use crate::material::Material;
use crate::pass::environment::{Analyses, EnvironmentUpload};
use crate::pass::gbuffer::{self, Draw};
use crate::pass::maps::Reading;
use crate::pass::materials::{Analysis, MaterialsUpload, Uploading};
use crate::pass::object_cells::{ObjectCells, Seats};
use crate::pass::{PassContext, brdf_map, cluster_moments, mixtures, vmf_mips};
use crate::passes::layout;
use crate::renderer::Renderer;
use crate::sampling::LatLong;
use crate::targets::Targets;
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
        let passes = Analyses {
            bandwidth: self.passes.environment_bandwidth.as_ref(),
            prefilter: self.passes.prefilter.as_ref(),
            rest: self.config.estimator.has_residual(),
        };
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
    /// Draws and G-buffers name them by index. The bag holds the staging memory and the former materials. With
    /// [`Bins::Camera`], [`Self::reserve_cells`] comes after it.
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
        let rule = config.effective_rule();
        let (modules, slots, widened) = (&config.modules, config.frames_in_flight, config.widened());
        let (filter, bins) = (self.config.filter, self.config.bins);
        let (passes, samplers) = (self.passes.moments.as_ref(), &self.samplers);
        let analysis = Analysis { eps: config.eps, lobe_components: config.lobe_components };
        let (analysis, estimator) = (config.predicts().then_some(analysis), config.estimator);
        let budget = config.fit_budget();
        let kept = self.of_kinds.as_ref().map(|passes| passes.kinds);
        let (mut upload, of_kinds) = Build::run(&self.cx, memory, |build| {
            let reading = Reading { filter, bins, rule, widened, passes, samplers };
            let upload = MaterialsUpload::new(build, materials, &Uploading { reading, analysis, estimator, budget })?;
            let mut p = PassContext { build, modules, bridge, slots };
            let fresh = kept != Some(upload.kinds);
            let of_kinds = fresh.then(|| OfKinds::new(&mut p, config, upload.kinds)).transpose()?;
            Ok((upload, of_kinds))
        })?;
        let mut bag = Retired::default();
        self.set_up.restart(&self.cx, cmd, 0);
        let mut rec = Recorder::new(&self.cx, cmd, 0, &mut self.states, Some(&mut self.set_up));
        rec.begin(crate::pass::materials::NAME);
        let work = upload.work();
        let fresh = upload.record(&mut rec, &mut bag);
        rec.end();
        if let (Some((map, mips, clusters, mixtures)), Some((of_map, of_mips, of_clusters, of_mixtures))) =
            (&self.passes.moments, work)
        {
            map.record(&mut rec, &brdf_map::Io { maps: &fresh.maps }, &of_map);
            mips.record(&mut rec, &vmf_mips::Io { maps: &fresh.maps }, &of_map, &of_mips);
            for (pass, of_clusters) in clusters.iter().zip(of_clusters) {
                pass.record(&mut rec, &cluster_moments::Io { maps: &fresh.maps }, &of_clusters);
                of_clusters.retire(&mut bag);
            }
            for (pass, of_mixtures) in mixtures.iter().zip(of_mixtures) {
                pass.record(&mut rec, &mixtures::Io { maps: &fresh.maps }, of_mixtures, &mut bag);
            }
            of_map.retire(&mut bag);
            of_mips.retire(&mut bag);
        }
        self.set_up_bytes = rec.pass_bytes;
        if let Some(former) = self.cells.take() {
            // They are made from the former materials' lobes.
            former.retire(&mut self.states, &mut bag);
        }
        if let Some(former) = self.materials.replace(fresh) {
            former.retire(&mut self.states, &mut bag);
        }
        if let Some(former) = of_kinds.and_then(|fresh| self.of_kinds.replace(fresh)) {
            former.retire(&mut bag);
        }
        Ok(bag)
    }

    /// Builds for another output extent. The bag holds the former images.
    ///
    /// # Errors
    /// As [`Self::new`]; the renderer keeps its former extent then.
    pub fn resize(&mut self, extent: [u32; 2], memory: &mut dyn HostAllocator) -> Result<Retired> {
        let config = Config { extent, ..self.config.clone() };
        config.validate()?;
        let fresh = Build::run(&self.cx, memory, |build| Targets::new(build, &config))?;
        self.config = config;
        self.shown = false;
        let mut bag = Retired::default();
        std::mem::replace(&mut self.targets, fresh).retire(&mut self.states, &mut bag);
        Ok(bag)
    }

    /// Makes room for the cells of `draws` with [`Bins::Camera`], before the frames that show them, or some of them: by the
    /// material and the number of each. Where there is just that room it stays; nothing happens with [`Bins::Tangent`]. The bag
    /// holds the former room.
    ///
    /// # Errors
    /// [`Error::CallOrder`] before [`Self::record_materials`]; [`Error::InvalidInput`] for draws that cannot be encoded or that
    /// share a number; [`Error::Allocation`], or as [`Self::new`] for more layers than an image has. The former room stays then.
    pub fn reserve_cells(&mut self, draws: &[Draw], memory: &mut dyn HostAllocator) -> Result<Retired> {
        let mut bag = Retired::default();
        let (Bins::Camera, Some((_, mips, ..))) = (self.config.bins, &self.passes.moments) else { return Ok(bag) };
        let Some(materials) = &self.materials else {
            return Err(Error::CallOrder { called: "reserve_cells", before: "record_materials" });
        };
        gbuffer::check(draws)?;
        gbuffer::check_materials(draws, materials.count)?;
        let seats = Seats::of(draws, &materials.maps)?;
        if self.cells.as_ref().is_none_or(|cells| *cells.seats() != seats) {
            let fresh = Build::run(&self.cx, memory, |build| ObjectCells::new(build, mips, &materials.maps, seats))?;
            if let Some(former) = self.cells.replace(fresh) {
                former.retire(&mut self.states, &mut bag);
            }
        }
        Ok(bag)
    }

    /// Texels of the map of which each draw of a material makes cells of its own, if it does: what
    /// [`chart::check`](crate::distribution::chart::check) takes.
    pub fn cell_map(&self, material: u32) -> Option<[u32; 2]> {
        Some(self.materials.as_ref()?.maps.divided(material)?.size)
    }

    /// GPU times of the last [`Self::record_materials`], which has run; `None` without timestamps.
    ///
    /// # Errors
    /// [`crate::Error::Vulkan`].
    pub fn set_up_timings(&self) -> Result<Option<FrameTimings>> {
        self.set_up.results(&self.cx, 0)
    }
}
