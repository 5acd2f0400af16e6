//! A compute module of the caller's own over what a session has on the device.

use crate::gpu::buffer::Buffer;
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{BridgeLayouts, Modules};
use crate::gpu::retire::{Build, Retired};
use crate::gpu::upload::BufferUpload;
use crate::offline::error::Result;
use crate::offline::read_back::copy_buffer;
use crate::offline::session::{Session, closed};
use crate::pass::PassContext;
use crate::pass::probe::Probe;
use ash::vk;

impl Session {
    /// Runs a compute module of the caller's own over the session's materials and environment: local size 64, set 1 the
    /// material bridge, set 2 the frame uniform, the environment's map and intervals, `uvec4` input and `vec4` output; a
    /// push constant holds the number of entries. Entry i of the result is output i.
    ///
    /// # Errors
    /// [`crate::Error::Shader`] for words that are no SPIR-V; the device's.
    pub fn probe(&mut self, words: &[u32], input: &[[u32; 4]]) -> Result<Vec<[f32; 4]>> {
        let inputs = self.shown.inputs([0, 0]);
        let renderer = self.renderer.as_mut().ok_or_else(closed)?;
        let mut modules = Modules::default();
        modules.replace("probe.comp", words.to_vec());
        let mut made = None;
        self.headless.submit(|cmd, memory| {
            let bridge = BridgeLayouts { gbuffer: vk::DescriptorSetLayout::null(), materials: renderer.material_layout() };
            let bytes: &[u8] = bytemuck::cast_slice(input);
            let (probe, upload, output) = Build::run(renderer.context(), memory, |build| {
                let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
                let upload = BufferUpload::new(build, "probe input", usage, bytes)?;
                let source = usage | vk::BufferUsageFlags::TRANSFER_SRC;
                let output = Buffer::new(build, "probe output", bytes.len() as u64, source, Location::Device)?;
                Ok((Probe::new(&mut PassContext { build, modules: &modules, bridge, slots: 1 })?, upload, output))
            })?;
            let mut bag = Retired::default();
            let mut fresh = None;
            renderer.copy_out(cmd, |_, rec| fresh = Some(upload.record(rec, &mut bag)));
            let input_buffer = fresh.ok_or_else(closed)?;
            renderer.record_probe(cmd, &inputs, &probe, (&input_buffer, input.len() as u32, &output))?;
            made = Some((probe, input_buffer, output));
            Ok(bag)
        })?;
        let (probe, input_buffer, output) = made.ok_or_else(closed)?;
        let result = self.read(output.size, |_, rec, target| copy_buffer(rec, &output, target));
        let mut bag = Retired::default();
        if let Some(renderer) = self.renderer.as_mut() {
            renderer.forget(&input_buffer);
            renderer.forget(&output);
        }
        probe.retire(&mut bag);
        input_buffer.retire(&mut bag);
        output.retire(&mut bag);
        let (host, memory) = self.headless.parts()?;
        // SAFETY: every submission was waited for.
        unsafe { bag.free(host.device, memory) };
        Ok(bytemuck::pod_collect_to_vec(&result?))
    }
}
