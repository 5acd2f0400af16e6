//! The host's own G-buffer in its own encoding: reversed depth, octahedral normals, two bytes of numbers.

use super::device::Gpu;
use super::memory::{Buffer, Image, aspect};
use super::scene::Object;
use glam::Mat4;
use passband::ash::{util::read_spv, vk};
use passband::{Access, HostAllocator, ImageRef, View};
use std::error::Error;
use std::io::Cursor;

const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const NORMALS: vk::Format = vk::Format::R32_UINT;
const IDS: vk::Format = vk::Format::R8G8_UINT;
/// What the renderer writes for this host.
pub const OUTPUT: vk::Format = vk::Format::R8G8B8A8_UNORM;

/// An object's buffers.
struct Drawable {
    positions: Buffer,
    normals: Buffer,
    indices: Buffer,
    count: u32,
    world_from_object: Mat4,
    material: u32,
}

/// The geometry pass, and the layout of descriptor set 0 through which the renderer's shaders read its result.
pub struct Raster {
    pub set_layout: vk::DescriptorSetLayout,
    sampler: vk::Sampler,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    drawables: Vec<Drawable>,
}

/// All that depends on the extent.
pub struct Targets {
    pub extent: [u32; 2],
    pub set: vk::DescriptorSet,
    pub output: Image,
    depth: Image,
    normals: Image,
    ids: Image,
    pool: vk::DescriptorPool,
    used: bool,
}

impl Raster {
    pub fn new(gpu: &Gpu, memory: &mut dyn HostAllocator, objects: &[Object]) -> Result<Self, Box<dyn Error>> {
        let bindings = [0, 1, 2].map(|binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        });
        let upload = |memory: &mut dyn HostAllocator, object: &Object| -> Result<Drawable, Box<dyn Error>> {
            let vertex = vk::BufferUsageFlags::VERTEX_BUFFER;
            Ok(Drawable {
                positions: Buffer::with(gpu, memory, vertex, bytemuck::cast_slice(&object.positions))?,
                normals: Buffer::with(gpu, memory, vertex, bytemuck::cast_slice(&object.normals))?,
                indices: Buffer::with(gpu, memory, vk::BufferUsageFlags::INDEX_BUFFER, bytemuck::cast_slice(&object.indices))?,
                count: object.indices.len() as u32,
                world_from_object: object.world_from_object(),
                material: object.material,
            })
        };
        let push = [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::ALL_GRAPHICS, offset: 0, size: 72 }];
        // SAFETY: the device is alive.
        unsafe {
            let set_layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = gpu.device.create_descriptor_set_layout(&set_layout, None)?;
            let sampler = gpu.device.create_sampler(&vk::SamplerCreateInfo::default(), None)?;
            let layout = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&push);
            let layout = gpu.device.create_pipeline_layout(&layout, None)?;
            let pipeline = pipeline(gpu, layout)?;
            let drawables = objects.iter().map(|o| upload(memory, o)).collect::<Result<_, _>>()?;
            Ok(Self { set_layout, sampler, layout, pipeline, drawables })
        }
    }

    /// Draws all objects into `targets`, which stay attachments.
    ///
    /// # Safety
    /// `cmd` is recording outside a render pass; what was last recorded on `targets` was submitted before.
    pub unsafe fn record(&self, gpu: &Gpu, cmd: vk::CommandBuffer, targets: &mut Targets, view: &View) {
        if !targets.used {
            let images = [&targets.depth, &targets.normals, &targets.ids];
            let barriers = images.map(|i| to_attachment(i.image, aspect(i.format), attachment_use(i.format)));
            let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            // SAFETY: as the caller promises.
            unsafe { gpu.device.cmd_pipeline_barrier2(cmd, &info) };
            targets.used = true;
        }
        let attachment = |image: &Image| {
            vk::RenderingAttachmentInfo::default()
                .image_view(image.view)
                .image_layout(attachment_use(image.format).layout)
                .load_op(vk::AttachmentLoadOp::CLEAR) // to zero: the farthest depth, and no numbers
                .store_op(vk::AttachmentStoreOp::STORE)
        };
        let colors = [attachment(&targets.normals), attachment(&targets.ids)];
        let depth = attachment(&targets.depth);
        let [width, height] = targets.extent;
        let area = vk::Rect2D { extent: vk::Extent2D { width, height }, ..Default::default() };
        let info = vk::RenderingInfo::default().render_area(area).layer_count(1);
        let info = info.color_attachments(&colors).depth_attachment(&depth);
        let viewport = vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() };
        let world_from_view = Mat4::from_cols_array(&view.world_from_view);
        let clip_from_world = Mat4::from_cols_array(&view.clip_from_view) * world_from_view.inverse();
        // SAFETY: as the caller promises; the buffers live as long as the pass.
        unsafe {
            gpu.device.cmd_begin_rendering(cmd, &info);
            gpu.device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            gpu.device.cmd_set_viewport(cmd, 0, &[viewport]);
            gpu.device.cmd_set_scissor(cmd, 0, &[area]);
            for (number, object) in (0u32..).zip(&self.drawables) {
                let clip_from_object = (clip_from_world * object.world_from_object).to_cols_array();
                let stages = vk::ShaderStageFlags::ALL_GRAPHICS;
                gpu.device.cmd_push_constants(cmd, self.layout, stages, 0, bytemuck::cast_slice(&clip_from_object));
                let ids = [object.material, number];
                gpu.device.cmd_push_constants(cmd, self.layout, stages, 64, bytemuck::cast_slice(&ids));
                gpu.device.cmd_bind_vertex_buffers(cmd, 0, &[object.positions.buffer, object.normals.buffer], &[0, 0]);
                gpu.device.cmd_bind_index_buffer(cmd, object.indices.buffer, 0, vk::IndexType::UINT32);
                gpu.device.cmd_draw_indexed(cmd, object.count, 1, 0, 0, 0);
            }
            gpu.device.cmd_end_rendering(cmd);
        }
    }

    /// # Safety
    /// No submitted work uses the pass any more.
    pub unsafe fn free(self, gpu: &Gpu, memory: &mut dyn HostAllocator) {
        // SAFETY: as the caller promises.
        unsafe {
            for object in self.drawables {
                [object.positions, object.normals, object.indices].into_iter().for_each(|b| b.free(gpu, memory));
            }
            gpu.device.destroy_pipeline(self.pipeline, None);
            gpu.device.destroy_pipeline_layout(self.layout, None);
            gpu.device.destroy_sampler(self.sampler, None);
            gpu.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

impl Targets {
    pub fn new(gpu: &Gpu, memory: &mut dyn HostAllocator, raster: &Raster, extent: [u32; 2]) -> Result<Self, Box<dyn Error>> {
        use vk::ImageUsageFlags as U;
        // Copied from for debugging only; the renderer samples them.
        let sampled = U::SAMPLED | U::TRANSFER_SRC;
        let mut image = |format, usage| Image::new(gpu, memory, format, extent, usage);
        let depth = image(DEPTH, U::DEPTH_STENCIL_ATTACHMENT | sampled)?;
        let normals = image(NORMALS, U::COLOR_ATTACHMENT | sampled)?;
        let ids = image(IDS, U::COLOR_ATTACHMENT | sampled)?;
        let output = image(OUTPUT, U::STORAGE | U::TRANSFER_SRC)?;
        let kind = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
        let sizes = [vk::DescriptorPoolSize { ty: kind, descriptor_count: 3 }];
        let infos = [&depth, &normals, &ids].map(|i| {
            [vk::DescriptorImageInfo::default()
                .sampler(raster.sampler)
                .image_view(i.view)
                .image_layout(Access::COMPUTE_SAMPLED.layout)]
        });
        // SAFETY: the device is alive; the set is written before it is used.
        unsafe {
            let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let pool = gpu.device.create_descriptor_pool(&pool, None)?;
            let layouts = [raster.set_layout];
            let set = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
            let set = gpu.device.allocate_descriptor_sets(&set)?[0];
            let write = vk::WriteDescriptorSet::default().dst_set(set).descriptor_type(kind);
            let writes = [0, 1, 2].map(|i| write.dst_binding(i as u32).image_info(&infos[i]));
            gpu.device.update_descriptor_sets(&writes, &[]);
            Ok(Self { extent, set, output, depth, normals, ids, pool, used: false })
        }
    }

    /// The G-buffer for the renderer: it finds the images as [`Raster::record`] left them, and leaves them so.
    pub fn gbuffer(&self) -> [ImageRef; 3] {
        [&self.depth, &self.normals, &self.ids].map(|i| self.image_ref(i, attachment_use(i.format), attachment_use(i.format)))
    }

    /// The output for the renderer: it comes from the last frame's copy, or from nowhere, and goes to the next copy.
    pub fn output(&self) -> ImageRef {
        self.image_ref(&self.output, if self.used { Access::TRANSFER_READ } else { Access::NONE }, Access::TRANSFER_READ)
    }

    fn image_ref(&self, image: &Image, entry: Access, exit: Access) -> ImageRef {
        let Image { image, view, format, .. } = *image;
        ImageRef { image, view, format, extent: self.extent, aspect: aspect(format), entry, exit }
    }

    /// # Safety
    /// No submitted work uses the images any more.
    pub unsafe fn free(self, gpu: &Gpu, memory: &mut dyn HostAllocator) {
        // SAFETY: as the caller promises.
        unsafe {
            gpu.device.destroy_descriptor_pool(self.pool, None);
            [self.depth, self.normals, self.ids, self.output].into_iter().for_each(|i| i.free(gpu, memory));
        }
    }
}

fn attachment_use(format: vk::Format) -> Access {
    if format == DEPTH { Access::DEPTH_WRITE } else { Access::COLOR_WRITE }
}

/// From nothing to an attachment.
fn to_attachment(image: vk::Image, aspect_mask: vk::ImageAspectFlags, to: Access) -> vk::ImageMemoryBarrier2<'static> {
    vk::ImageMemoryBarrier2::default()
        .image(image)
        .dst_stage_mask(to.stage)
        .dst_access_mask(to.access)
        .new_layout(to.layout)
        .subresource_range(vk::ImageSubresourceRange { aspect_mask, level_count: 1, layer_count: 1, ..Default::default() })
}

unsafe fn pipeline(gpu: &Gpu, layout: vk::PipelineLayout) -> Result<vk::Pipeline, Box<dyn Error>> {
    let module = |bytes: &[u8]| -> Result<vk::ShaderModule, Box<dyn Error>> {
        let words = read_spv(&mut Cursor::new(bytes))?;
        // SAFETY: the module is one that scripts/compile-shaders wrote.
        Ok(unsafe { gpu.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None) }?)
    };
    let vertex = module(include_bytes!("spirv/host.vert.spv"))?;
    let fragment = module(include_bytes!("spirv/host.frag.spv"))?;
    let stage = |module, stage| vk::PipelineShaderStageCreateInfo::default().module(module).stage(stage).name(c"main");
    let stages = [stage(vertex, vk::ShaderStageFlags::VERTEX), stage(fragment, vk::ShaderStageFlags::FRAGMENT)];
    let bindings = [0, 1].map(|i| vk::VertexInputBindingDescription { binding: i, stride: 12, ..Default::default() });
    let format = vk::Format::R32G32B32_SFLOAT;
    let attributes = [0, 1].map(|i| vk::VertexInputAttributeDescription { location: i, binding: i, format, offset: 0 });
    let input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(vk::CompareOp::GREATER);
    let write = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA); 2];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&write);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let formats = [NORMALS, IDS];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats).depth_attachment_format(DEPTH);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .push_next(&mut rendering)
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout);
    // SAFETY: the handles are alive; the modules are not needed after the pipeline was made.
    unsafe {
        let made = gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        [vertex, fragment].into_iter().for_each(|module| gpu.device.destroy_shader_module(module, None));
        Ok(made.map_err(|(_, result)| result)?[0])
    }
}
