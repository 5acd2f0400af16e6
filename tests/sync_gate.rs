//! The gate that all device tests rely on fires: a barrier that is missing on purpose is reported.
//!
//! The case is the one that a frame could get wrong: a dispatch writes a storage image that the next dispatch reads. Both
//! are the crate's own tone mapping, from image to image, at host level.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::memory::Image;
use common::rig::Rig;
use passband::Retired;
use passband::ash::{util::read_spv, vk};
use std::io::Cursor;

const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// Two dispatches in one submission, a -> b -> c, with or without the barrier between them; the run's messages.
fn dispatch_twice(barrier_between: bool) -> Vec<String> {
    let mut rig = Rig::new();
    let device = rig.gpu.device.clone();
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::STORAGE;
    let images = [0, 1, 2].map(|_| Image::new(&rig.gpu, &mut rig.memory, FORMAT, [16, 16], usage).unwrap());
    let kinds = [vk::DescriptorType::COMBINED_IMAGE_SAMPLER, vk::DescriptorType::STORAGE_IMAGE];
    let bindings = [0, 1].map(|i| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(i)
            .descriptor_type(kinds[i as usize])
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
    });
    let push = [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::COMPUTE, offset: 0, size: 8 }];
    let words = read_spv(&mut Cursor::new(include_bytes!("../spirv/tonemap.rgba32f.comp.spv"))).unwrap();
    let barrier = |image: &Image, old_layout, src_stage_mask, src_access_mask| {
        let range = vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            level_count: 1,
            layer_count: 1,
            ..Default::default()
        };
        vk::ImageMemoryBarrier2::default()
            .image(image.image)
            .old_layout(old_layout)
            .new_layout(vk::ImageLayout::GENERAL)
            .src_stage_mask(src_stage_mask)
            .src_access_mask(src_access_mask)
            .dst_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .dst_access_mask(vk::AccessFlags2::SHADER_SAMPLED_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE)
            .subresource_range(range)
    };
    let first = [0, 1, 2]
        .map(|i: usize| barrier(&images[i], vk::ImageLayout::UNDEFINED, vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE));
    let between = [barrier(
        &images[1],
        vk::ImageLayout::GENERAL,
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_STORAGE_WRITE,
    )];
    // SAFETY: everything is this test's own and outlives the submission; only the barrier may be wrong, on purpose.
    unsafe {
        let set_layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let set_layout = device.create_descriptor_set_layout(&set_layout, None).unwrap();
        let empty = device.create_descriptor_set_layout(&Default::default(), None).unwrap();
        let layouts = [empty, empty, set_layout];
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&push);
        let layout = device.create_pipeline_layout(&layout, None).unwrap();
        let module = device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None).unwrap();
        let stage =
            vk::PipelineShaderStageCreateInfo::default().stage(vk::ShaderStageFlags::COMPUTE).module(module).name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
        let pipeline = device.create_compute_pipelines(vk::PipelineCache::null(), &info, None).unwrap()[0];
        let sampler = device.create_sampler(&Default::default(), None).unwrap();
        let sizes = kinds.map(|ty| vk::DescriptorPoolSize { ty, descriptor_count: 2 });
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(2).pool_sizes(&sizes);
        let pool = device.create_descriptor_pool(&pool, None).unwrap();
        let set_layouts = [set_layout; 2];
        let sets = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&set_layouts);
        let sets = device.allocate_descriptor_sets(&sets).unwrap();
        for (i, &set) in sets.iter().enumerate() {
            let image = |image: &Image| vk::DescriptorImageInfo {
                sampler,
                image_view: image.view,
                image_layout: vk::ImageLayout::GENERAL,
            };
            let infos = [[image(&images[i])], [image(&images[i + 1])]];
            let write = vk::WriteDescriptorSet::default().dst_set(set);
            let writes = [0, 1].map(|b: usize| write.dst_binding(b as u32).descriptor_type(kinds[b]).image_info(&infos[b]));
            device.update_descriptor_sets(&writes, &[]);
        }
        rig.submit(|cmd, _, _| {
            let wait = |barriers: &[_]| {
                device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().image_memory_barriers(barriers));
            };
            wait(&first);
            device.cmd_bind_pipeline(cmd, vk::PipelineBindPoint::COMPUTE, pipeline);
            device.cmd_push_constants(cmd, layout, vk::ShaderStageFlags::COMPUTE, 0, &[0; 8]);
            for (i, set) in sets.into_iter().enumerate() {
                if i == 1 && barrier_between {
                    wait(&between);
                }
                device.cmd_bind_descriptor_sets(cmd, vk::PipelineBindPoint::COMPUTE, layout, 2, &[set], &[]);
                device.cmd_dispatch(cmd, 2, 2, 1);
            }
            ((), Retired::default())
        });
        device.destroy_descriptor_pool(pool, None);
        device.destroy_sampler(sampler, None);
        device.destroy_pipeline(pipeline, None);
        device.destroy_shader_module(module, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_descriptor_set_layout(set_layout, None);
        device.destroy_descriptor_set_layout(empty, None);
        images.into_iter().for_each(|image| image.free(&rig.gpu, &mut rig.memory));
    }
    rig.close()
}

#[test]
fn a_missing_barrier_is_reported() {
    let messages = dispatch_twice(false);
    assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-READ")), "the gate is silent: {messages:?}");
}

#[test]
fn the_same_work_with_its_barrier_is_clean() {
    common::assert_clean(&dispatch_twice(true));
}

#[test]
fn an_object_that_nobody_destroys_is_reported() {
    let rig = Rig::new();
    // SAFETY: the device is alive; the leak is the point.
    unsafe { rig.gpu.device.create_sampler(&Default::default(), None) }.unwrap();
    let messages = rig.close();
    assert!(messages.iter().any(|m| m.contains("VkSampler")), "the gate is silent: {messages:?}");
}
