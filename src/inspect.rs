//! What the offline part reads back from a renderer, and what it records beside frames.

use crate::distribution::LobeFit;
use crate::error::{Error, Result};
use crate::frame::FrameInputs;
use crate::gpu::buffer::Buffer;
use crate::gpu::context::Context;
use crate::gpu::image::Image;
use crate::gpu::pipeline::BridgeSets;
use crate::gpu::recorder::Recorder;
use crate::pass::maps::MomentArrays;
use crate::renderer::Renderer;
use ash::vk;
use std::sync::Arc;

impl Renderer {
    /// One of the renderer's own colour images of the last frame, or the environment's bandwidth, by name.
    pub(crate) fn image(&self, name: &str) -> Option<&Image> {
        let bandwidth = self.environment.as_ref().and_then(|e| e.bandwidth.as_ref()).filter(|i| i.desc.name == name);
        bandwidth.or_else(|| self.targets.image(name))
    }

    /// One of the renderer's own buffers of the last frame, by name.
    pub(crate) fn buffer(&self, name: &str) -> Option<&Buffer> {
        self.targets.buffer(name)
    }

    /// Records a [`probe`](crate::pass::probe) module over the current materials and environment, at this frame's environment use.
    pub(crate) fn record_probe(
        &mut self,
        cmd: vk::CommandBuffer,
        inputs: &FrameInputs<'_>,
        probe: &crate::pass::probe::Probe,
        (input, count, output): (&Buffer, u32, &Buffer),
    ) -> Result<()> {
        let (Some(environment), Some(materials)) = (&self.environment, &self.materials) else {
            return Err(Error::CallOrder { called: "record_probe", before: "record_environment and record_materials" });
        };
        let uniform = inputs.uniform(&self.config, &self.targets.plan, [0, 0]);
        self.uniforms[inputs.slot].bytes_mut().copy_from_slice(bytemuck::bytes_of(&uniform));
        let rec = &mut Recorder::new(&self.cx, cmd, inputs.slot, &mut self.states, None);
        let bridge = BridgeSets { materials: self.bridge.write(rec, materials, &self.samplers), ..BridgeSets::NONE };
        let (frame, samplers) = (&self.uniforms[inputs.slot], &self.samplers);
        probe.record(rec, &crate::pass::probe::Io { frame, bridge, samplers, environment, materials, input, count, output });
        Ok(())
    }

    /// Levels of shading.
    pub(crate) fn levels(&self) -> &crate::plan::Levels {
        &self.targets.plan.levels
    }

    /// Forgets a buffer that is about to be destroyed.
    pub(crate) fn forget(&mut self, buffer: &Buffer) {
        self.states.forget(buffer.handle);
    }

    /// The arrays of a material's moments and of its cells, and its layers there.
    pub(crate) fn moments(&self, material: usize) -> Option<MomentArrays<'_>> {
        self.materials.as_ref()?.maps.moments(material)
    }

    /// The arrays of an object's frames and of the cells of its own in the last frame, and its layers there.
    pub(crate) fn object_cells(&self, object: u32) -> Option<MomentArrays<'_>> {
        self.cells.as_ref()?.arrays(object, &self.materials.as_ref()?.maps)
    }

    /// Bytes of the materials' lobe fits.
    pub(crate) fn fit_bytes(&self) -> u64 {
        self.materials.as_ref().and_then(|images| images.fits.as_ref()).map_or(0, |fits| fits.size)
    }

    /// The fit that stands for each material where light is looked up, if one does.
    pub(crate) fn fits(&self) -> &[Option<Arc<LobeFit>>] {
        self.materials.as_ref().map_or(&[], |images| &images.fitted)
    }

    /// Layout of set 1.
    pub(crate) fn material_layout(&self) -> vk::DescriptorSetLayout {
        self.bridge.layout
    }

    pub(crate) fn context(&self) -> &Context {
        &self.cx
    }

    /// Records copies out of the renderer's images, which continue from the last frame's uses.
    pub(crate) fn copy_out(&mut self, cmd: vk::CommandBuffer, copy: impl FnOnce(&Self, &mut Recorder<'_>)) {
        let mut states = std::mem::take(&mut self.states);
        copy(self, &mut Recorder::new(&self.cx, cmd, 0, &mut states, None));
        self.states = states;
    }
}
