//! Graphics pipelines.

use crate::error::Result;
use crate::gpu::context::VkResultExt;
use crate::gpu::pipeline::{MAIN, Modules};
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use ash::vk;

/// A graphics pipeline for dynamic rendering with per-pass push constants and no descriptors.
pub(crate) struct RasterPipeline {
    pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
}

impl RasterPipeline {
    /// `vertices` are streams, binding and location i of format i, whose strides are bound with them. Nothing is tested against
    /// depth if its format is `UNDEFINED`.
    pub fn new(
        build: &mut Build<'_>,
        modules: &Modules,
        name: &str,
        push_bytes: u32,
        vertices: &[vk::Format],
        colors: &[vk::Format],
        depth: vk::Format,
    ) -> Result<Self> {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let push = [vk::PushConstantRange::default().stage_flags(stages).size(push_bytes)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&push);
        // SAFETY: the device is alive.
        let layout = unsafe { build.cx.device.create_pipeline_layout(&info, None) }.named("vkCreatePipelineLayout")?;
        build.track(layout, Handle::PipelineLayout);

        let vertex = modules.create(build, &format!("{name}.vert"))?;
        let fragment = match modules.create(build, &format!("{name}.frag")) {
            Ok(module) => module,
            Err(error) => {
                // SAFETY: never used.
                unsafe { build.cx.device.destroy_shader_module(vertex, None) };
                return Err(error);
            }
        };
        let stage = |module, stage| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(MAIN);
        let stages = [stage(vertex, vk::ShaderStageFlags::VERTEX), stage(fragment, vk::ShaderStageFlags::FRAGMENT)];
        let (bindings, attributes): (Vec<_>, Vec<_>) = (0u32..)
            .zip(vertices)
            .map(|(i, &format)| {
                (
                    vk::VertexInputBindingDescription { binding: i, stride: 0, input_rate: vk::VertexInputRate::VERTEX },
                    vk::VertexInputAttributeDescription { location: i, binding: i, format, offset: 0 },
                )
            })
            .unzip();
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().polygon_mode(vk::PolygonMode::FILL).line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let test = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(depth != vk::Format::UNDEFINED)
            .depth_write_enable(depth != vk::Format::UNDEFINED)
            .depth_compare_op(vk::CompareOp::LESS);
        let write = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let attachments = vec![write; colors.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&[
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::FRONT_FACE,
        ]);
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(colors).depth_attachment_format(depth);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .push_next(&mut rendering)
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&test)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout);
        // SAFETY: all handles are alive; the modules are destroyed once, after use.
        let created = unsafe {
            let created = build.cx.device.create_graphics_pipelines(build.cx.pipeline_cache, &[info], None);
            build.cx.device.destroy_shader_module(vertex, None);
            build.cx.device.destroy_shader_module(fragment, None);
            created
        };
        let pipeline = created.map_err(|(_, result)| result).named("vkCreateGraphicsPipelines")?[0];
        build.track(pipeline, Handle::Pipeline);
        build.cx.name(pipeline, name);
        Ok(Self { pipeline, layout })
    }

    /// Opens a rendering over all of `extent` with this pipeline, for triangles of either side; the attachments are ready.
    /// [`Self::end`] closes it.
    pub fn begin(
        &self,
        rec: &Recorder<'_>,
        [width, height]: [u32; 2],
        colors: &[vk::RenderingAttachmentInfo<'_>],
        depth: Option<&vk::RenderingAttachmentInfo<'_>>,
    ) {
        let area = vk::Rect2D { extent: vk::Extent2D { width, height }, ..Default::default() };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(colors);
        if let Some(depth) = depth {
            info = info.depth_attachment(depth);
        }
        let viewport = vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() };
        let device = &rec.cx.device;
        // SAFETY: the command buffer is recording; attachments are ready, as the caller promises; dynamic state is all set.
        unsafe {
            device.cmd_begin_rendering(rec.cmd, &info);
            device.cmd_bind_pipeline(rec.cmd, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            device.cmd_set_viewport(rec.cmd, 0, &[viewport]);
            device.cmd_set_scissor(rec.cmd, 0, &[area]);
            device.cmd_set_cull_mode(rec.cmd, vk::CullModeFlags::NONE);
            device.cmd_set_front_face(rec.cmd, vk::FrontFace::COUNTER_CLOCKWISE);
        }
    }

    /// Closes it.
    pub fn end(&self, rec: &Recorder<'_>) {
        // SAFETY: closes the rendering that `begin` opened.
        unsafe { rec.cx.device.cmd_end_rendering(rec.cmd) };
    }

    pub fn retire(self, bag: &mut Retired) {
        bag.push(Handle::Pipeline(self.pipeline));
        bag.push(Handle::PipelineLayout(self.layout));
    }
}
