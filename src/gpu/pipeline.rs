//! Shader modules, pipelines and descriptor sets. Set 0 is the G-buffer bridge, set 1 the material bridge, set 2 the pass's own.

use crate::error::{Error, Result};
use crate::gpu::buffer::Buffer;
use crate::gpu::context::VkResultExt;
use crate::gpu::image::Image;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use ash::vk;
use bytemuck::NoUninit;
use std::collections::HashMap;
use std::ffi::CStr;

pub(super) const MAIN: &CStr = c"main";

/// The shader interface of a compute pass, as Rust sees it; a test holds it against the SPIR-V.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// Module name: `spirv/NAME.comp.spv`.
    pub name: &'static str,
    /// Workgroup size.
    pub local_size: [u32; 3],
    /// Bytes of push constants, 0 for none.
    pub push_bytes: u32,
    /// Whether it reads the G-buffer through set 0.
    pub gbuffer: bool,
    /// Whether it reads materials through set 1.
    pub materials: bool,
    /// Descriptor types of set 2, bindings 0, 1, …
    pub own: &'static [vk::DescriptorType],
}

/// SPIR-V by module name; a host may replace the modules that include a bridge.
#[derive(Clone, Default)]
pub struct Modules {
    replaced: HashMap<String, Vec<u32>>,
}

impl Modules {
    /// Replaces module `name` (as `shade.comp`) by the host's own words of SPIR-V, compiled with its bridge.
    pub fn replace(&mut self, name: impl Into<String>, words: Vec<u32>) -> &mut Self {
        self.replaced.insert(name.into(), words);
        self
    }

    fn words(&self, name: &str) -> Result<Vec<u32>> {
        if let Some(words) = self.replaced.get(name) {
            return Ok(words.clone());
        }
        let bytes = crate::pass::modules::spirv(name)
            .ok_or_else(|| Error::Shader { name: name.into(), reason: "no such module".into() })?;
        Ok(bytemuck::pod_collect_to_vec(bytes))
    }

    /// Creates the module; the caller destroys it after pipeline creation.
    pub(super) fn create(&self, build: &mut Build<'_>, name: &str) -> Result<vk::ShaderModule> {
        let words = self.words(name)?;
        if words.first() != Some(&0x0723_0203) {
            return Err(Error::Shader { name: name.into(), reason: "does not start with the SPIR-V magic number".into() });
        }
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the device is alive; the words are a whole module.
        unsafe { build.cx.device.create_shader_module(&info, None) }.named("vkCreateShaderModule")
    }
}

/// A set layout of bindings 0, 1, … of the given types.
pub(crate) fn set_layout(
    build: &mut Build<'_>,
    stages: vk::ShaderStageFlags,
    types: &[vk::DescriptorType],
) -> Result<vk::DescriptorSetLayout> {
    let bindings: Vec<_> = (0u32..)
        .zip(types)
        .map(|(i, &t)| {
            vk::DescriptorSetLayoutBinding::default().binding(i).descriptor_type(t).descriptor_count(1).stage_flags(stages)
        })
        .collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: the device is alive.
    let layout = unsafe { build.cx.device.create_descriptor_set_layout(&info, None) }.named("vkCreateDescriptorSetLayout")?;
    Ok(build.track(layout, Handle::SetLayout))
}

/// A pool with one set of `layout` a slot.
pub(crate) struct Sets {
    pool: vk::DescriptorPool,
    pub sets: Vec<vk::DescriptorSet>,
}

impl Sets {
    pub fn new(
        build: &mut Build<'_>,
        layout: vk::DescriptorSetLayout,
        types: &[vk::DescriptorType],
        slots: usize,
    ) -> Result<Self> {
        if types.is_empty() || slots == 0 {
            return Ok(Self { pool: vk::DescriptorPool::null(), sets: vec![vk::DescriptorSet::null(); slots] });
        }
        let sizes: Vec<_> =
            types.iter().map(|&t| vk::DescriptorPoolSize::default().ty(t).descriptor_count(slots as u32)).collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(slots as u32).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let pool = unsafe { build.cx.device.create_descriptor_pool(&info, None) }.named("vkCreateDescriptorPool")?;
        build.track(pool, Handle::DescriptorPool);
        let layouts = vec![layout; slots];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool was sized for exactly these sets.
        let sets = unsafe { build.cx.device.allocate_descriptor_sets(&info) }.named("vkAllocateDescriptorSets")?;
        Ok(Self { pool, sets })
    }

    pub fn retire(self, bag: &mut Retired) {
        bag.push(Handle::DescriptorPool(self.pool));
    }
}

/// What a binding refers to.
#[derive(Clone, Copy)]
pub(crate) enum Resource<'a> {
    Sampled(&'a Image, vk::Sampler),
    /// As `Sampled`, of an image that may be the host's.
    View(vk::ImageView, vk::Sampler),
    Storage(vk::ImageView),
    Uniform(&'a Buffer),
    Buffer(&'a Buffer),
}

/// Points bindings 0, 1, … of `set`, which no pending frame uses, at `resources`.
pub(crate) fn write_set(device: &ash::Device, set: vk::DescriptorSet, resources: &[Resource<'_>]) {
    let images: Vec<_> = resources
        .iter()
        .map(|r| match r {
            Resource::Sampled(image, sampler) => vk::DescriptorImageInfo::default()
                .image_view(image.view)
                .sampler(*sampler)
                .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
            Resource::View(view, sampler) => vk::DescriptorImageInfo::default()
                .image_view(*view)
                .sampler(*sampler)
                .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
            Resource::Storage(view) => {
                vk::DescriptorImageInfo::default().image_view(*view).image_layout(vk::ImageLayout::GENERAL)
            }
            _ => vk::DescriptorImageInfo::default(),
        })
        .collect();
    let buffers: Vec<_> = resources
        .iter()
        .map(|r| match r {
            Resource::Uniform(b) | Resource::Buffer(b) => {
                vk::DescriptorBufferInfo::default().buffer(b.handle).range(vk::WHOLE_SIZE)
            }
            _ => vk::DescriptorBufferInfo::default(),
        })
        .collect();
    let writes: Vec<_> = (0u32..)
        .zip(resources)
        .zip(images.iter().zip(&buffers))
        .map(|((binding, resource), (image, buffer))| {
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(binding);
            let (image, buffer) = (std::slice::from_ref(image), std::slice::from_ref(buffer));
            match resource {
                Resource::Sampled(..) | Resource::View(..) => {
                    write.descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER).image_info(image)
                }
                Resource::Storage(_) => write.descriptor_type(vk::DescriptorType::STORAGE_IMAGE).image_info(image),
                Resource::Uniform(_) => write.descriptor_type(vk::DescriptorType::UNIFORM_BUFFER).buffer_info(buffer),
                Resource::Buffer(_) => write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(buffer),
            }
        })
        .collect();
    // SAFETY: the set is ours and idle; views and buffers are alive.
    unsafe { device.update_descriptor_sets(&writes, &[]) };
}

/// Set layouts and sets of the two bridges, ours or the host's.
#[derive(Clone, Copy)]
pub(crate) struct BridgeLayouts {
    pub gbuffer: vk::DescriptorSetLayout,
    pub materials: vk::DescriptorSetLayout,
}

#[derive(Clone, Copy)]
pub(crate) struct BridgeSets {
    pub gbuffer: vk::DescriptorSet,
    pub materials: vk::DescriptorSet,
}

impl BridgeSets {
    /// For passes that read neither.
    pub const NONE: Self = Self { gbuffer: vk::DescriptorSet::null(), materials: vk::DescriptorSet::null() };
}

/// A compute pipeline with its own descriptor set for every frame slot.
pub(crate) struct ComputePipeline {
    interface: Interface,
    pipeline: vk::Pipeline,
    layout: vk::PipelineLayout,
    set_layouts: Vec<vk::DescriptorSetLayout>,
    sets: Sets,
}

impl ComputePipeline {
    /// `constants` are specialization constants 0, 1, …
    pub fn new(
        build: &mut Build<'_>,
        modules: &Modules,
        interface: &Interface,
        bridge: BridgeLayouts,
        slots: usize,
        constants: &[u32],
    ) -> Result<Self> {
        let compute = vk::ShaderStageFlags::COMPUTE;
        let mut set_layouts = vec![set_layout(build, compute, interface.own)?];
        let own = set_layouts[0];
        let mut empty = || -> Result<_> {
            let layout = set_layout(build, compute, &[])?;
            set_layouts.push(layout);
            Ok(layout)
        };
        let first = if interface.gbuffer { bridge.gbuffer } else { empty()? };
        let second = if interface.materials { bridge.materials } else { empty()? };
        let layouts = [first, second, own];
        let push = vk::PushConstantRange::default().stage_flags(compute).size(interface.push_bytes);
        let pushes = if interface.push_bytes > 0 { std::slice::from_ref(&push) } else { &[] };
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(pushes);
        // SAFETY: the device and the layouts are alive.
        let layout = unsafe { build.cx.device.create_pipeline_layout(&info, None) }.named("vkCreatePipelineLayout")?;
        build.track(layout, Handle::PipelineLayout);

        let module = modules.create(build, &format!("{}.comp", interface.name))?;
        let entries: Vec<_> = (0u32..)
            .zip(constants)
            .map(|(i, _)| vk::SpecializationMapEntry::default().constant_id(i).offset(4 * i).size(4))
            .collect();
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(constants));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(compute)
            .module(module)
            .name(MAIN)
            .specialization_info(&specialization);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout);
        // SAFETY: all handles are alive; the module is destroyed once, after use.
        let created = unsafe {
            let created = build.cx.device.create_compute_pipelines(build.cx.pipeline_cache, &[info], None);
            build.cx.device.destroy_shader_module(module, None);
            created
        };
        let pipeline = created.map_err(|(_, result)| result).named("vkCreateComputePipelines")?[0];
        build.track(pipeline, Handle::Pipeline);
        build.cx.name(pipeline, interface.name);
        let sets = Sets::new(build, own, interface.own, slots)?;
        Ok(Self { interface: *interface, pipeline, layout, set_layouts, sets })
    }

    /// Binds everything for a dispatch in the recorder's slot. `push` must be as large as the interface says.
    pub fn bind<P: NoUninit>(&self, rec: &Recorder<'_>, bridge: BridgeSets, resources: &[Resource<'_>], push: &P) {
        debug_assert_eq!(resources.len(), self.interface.own.len(), "{}", self.interface.name);
        let device = &rec.cx.device;
        let own = self.sets.sets[rec.slot];
        write_set(device, own, resources);
        self.bind_sets(rec, bridge, own, push);
    }

    /// `count` further sets for [`Self::bind_set`], which whoever asks for them writes.
    pub fn sets(&self, build: &mut Build<'_>, count: usize) -> Result<Sets> {
        Sets::new(build, self.set_layouts[0], self.interface.own, count)
    }

    /// Binds everything for a dispatch of a pass that reads neither bridge, with a set that was written before.
    pub fn bind_set<P: NoUninit>(&self, rec: &Recorder<'_>, set: vk::DescriptorSet, push: &P) {
        self.bind_sets(rec, BridgeSets::NONE, set, push);
    }

    fn bind_sets<P: NoUninit>(&self, rec: &Recorder<'_>, bridge: BridgeSets, own: vk::DescriptorSet, push: &P) {
        debug_assert_eq!(size_of::<P>() as u32, self.interface.push_bytes, "{}", self.interface.name);
        let device = &rec.cx.device;
        let bind = |index: u32, set: vk::DescriptorSet| {
            // SAFETY: the command buffer is recording; the set fits the layout's slot `index`.
            unsafe { device.cmd_bind_descriptor_sets(rec.cmd, vk::PipelineBindPoint::COMPUTE, self.layout, index, &[set], &[]) };
        };
        // SAFETY: the command buffer is recording.
        unsafe { device.cmd_bind_pipeline(rec.cmd, vk::PipelineBindPoint::COMPUTE, self.pipeline) };
        if self.interface.gbuffer {
            bind(0, bridge.gbuffer);
        }
        if self.interface.materials {
            bind(1, bridge.materials);
        }
        if !self.interface.own.is_empty() {
            bind(2, own);
        }
        self.push(rec, push);
    }

    /// Replaces the push constants between two dispatches of the same resources.
    pub fn push<P: NoUninit>(&self, rec: &Recorder<'_>, push: &P) {
        if self.interface.push_bytes > 0 {
            let (stages, bytes) = (vk::ShaderStageFlags::COMPUTE, bytemuck::bytes_of(push));
            // SAFETY: the command buffer is recording; the range is the pipeline layout's own.
            unsafe { rec.cx.device.cmd_push_constants(rec.cmd, self.layout, stages, 0, bytes) };
        }
    }

    /// Dispatches over `extent` samples in two dimensions.
    pub fn dispatch(&self, rec: &Recorder<'_>, extent: [u32; 2]) {
        let [x, y, _] = self.interface.local_size;
        self.dispatch_groups(rec, [extent[0].div_ceil(x), extent[1].div_ceil(y), 1]);
    }

    /// Dispatches so many groups in x, y and z.
    pub fn dispatch_groups(&self, rec: &Recorder<'_>, [x, y, z]: [u32; 3]) {
        // SAFETY: `bind` came before; group counts follow from image extents, below every limit.
        unsafe { rec.cx.device.cmd_dispatch(rec.cmd, x, y, z) };
    }

    /// Dispatches what the three words at byte `offset` of `arguments` say.
    pub fn dispatch_indirect(&self, rec: &Recorder<'_>, arguments: &Buffer, offset: u64) {
        // SAFETY: `bind` came before; the buffer has indirect usage and at least 12 bytes from `offset` on.
        unsafe { rec.cx.device.cmd_dispatch_indirect(rec.cmd, arguments.handle, offset) };
    }

    pub fn retire(self, bag: &mut Retired) {
        bag.push(Handle::Pipeline(self.pipeline));
        bag.push(Handle::PipelineLayout(self.layout));
        self.sets.retire(bag);
        self.set_layouts.into_iter().for_each(|l| bag.push(Handle::SetLayout(l)));
    }
}
