//! What a device lacks is listed whole, what a host hands in wrongly is named, and a refused frame leaves no trace.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;

use common::assert_clean;
use common::rig::{Rig, Target, grey};
use passband::ash::vk;
use passband::offline::builtin;
use passband::reflectance::{Ggx, Lobe, Model, Vmf};
use passband::sampling::LatLong;
use passband::{
    Config, Draw, EnvironmentUse, Error, FrameInputs, GBufferInput, GBufferSource, Host, ImageRef, Material, Output, Renderer,
    Requirements, Retired, Transfer, View,
};
use std::sync::Arc;

fn config() -> Config {
    Config { directions: 4, ..Config::new([24, 16]) }
}

#[test]
fn every_gap_is_listed() {
    let rig = Rig::new();
    let mut wanted = Requirements::of(&config());
    // SAFETY: the instance is alive and the device its own.
    let check = |wanted: &Requirements| unsafe { wanted.check(&rig.gpu.instance, rig.gpu.physical_device) };
    assert_eq!(check(&wanted), Ok(()));

    wanted.api_version = vk::make_api_version(0, 9, 0, 0);
    wanted.limits.push(("maxImageDimension2D", u64::MAX));
    wanted.limits.push(("maxPushConstantsSize", u64::MAX - 1));
    wanted.limits.push(("aLimitThatNobodyHas", 1));
    wanted.formats.push((vk::Format::BC7_UNORM_BLOCK, vk::FormatFeatureFlags::STORAGE_IMAGE));
    wanted.queue |= vk::QueueFlags::from_raw(1 << 30);
    let missing = check(&wanted).unwrap_err();
    let mut names: Vec<_> = missing.0.iter().map(|row| row.name.as_str()).collect();
    names.sort_unstable();
    let expected =
        ["BC7_UNORM_BLOCK", "aLimitThatNobodyHas", "apiVersion", "maxImageDimension2D", "maxPushConstantsSize", "queue family"];
    assert_eq!(names, expected);
    assert!(missing.0.iter().all(|row| !row.ok));
    let text = Error::from(missing).to_string();
    for part in expected.into_iter().chain(["18446744073709551615", "9.0.0", "STORAGE_IMAGE"]) {
        assert!(text.contains(part), "{part} in {text}");
    }
    // All rows, met or not, are there to be shown.
    // SAFETY: as above.
    let rows = unsafe { wanted.rows(&rig.gpu.instance, rig.gpu.physical_device) };
    assert_eq!(rows.iter().filter(|row| !row.ok).count(), 6);
    assert!(rows.iter().filter(|row| row.ok).count() > 10);
    assert_clean(&rig.close());
}

/// That these two suffice is shown by every other test: their devices have nothing else enabled.
#[test]
fn merging_switches_on_what_is_needed_and_no_more() {
    let mut features = vk::PhysicalDeviceVulkan13Features::default().maintenance4(true);
    Requirements::of(&config()).merge_into(&mut features);
    let expected =
        vk::PhysicalDeviceVulkan13Features::default().maintenance4(true).dynamic_rendering(true).synchronization2(true);
    assert_eq!(format!("{features:?}"), format!("{expected:?}"));
}

#[track_caller]
fn assert_invalid<T>(result: Result<T, Error>, field: &str) {
    match result {
        Err(Error::InvalidInput { field: got, expected, got: value }) => {
            assert_eq!(got, field);
            assert!(!expected.is_empty() && !value.is_empty());
        }
        Err(other) => panic!("{field}: {other}"),
        Ok(_) => panic!("{field}: accepted"),
    }
}

#[test]
fn impossible_renderers_are_refused_and_leave_nothing() {
    let mut rig = Rig::new();
    let too_wide = rig.gpu.family + 100;
    let mut refuse = |config: &Config, change: fn(&mut Host<'_>, u32), field: &str| {
        let mut host = rig.gpu.host();
        change(&mut host, too_wide);
        // SAFETY: the device is alive.
        assert_invalid(unsafe { Renderer::new(&host, config, &mut rig.memory) }, field);
        assert_eq!(rig.memory.requests, 0, "{field}: memory was asked for");
    };
    let same: fn(&mut Host<'_>, u32) = |_, _| {};
    refuse(&Config::new([0, 4]), same, "Config::extent");
    refuse(&Config { samples_per_side: 3, ..config() }, same, "Config::samples_per_side");
    refuse(&Config { frames_in_flight: 0, ..config() }, same, "Config::frames_in_flight");
    refuse(&Config { directions: 1, ..config() }, same, "Config::directions");
    refuse(&config(), |host, family| host.queue_family = family, "Host::queue_family");

    // 16384 x 16384 pixels list more than a storage buffer holds here; the device's gaps come as one error.
    // SAFETY: the device is alive.
    let result = unsafe { Renderer::new(&rig.gpu.host(), &Config::new([16384, 16384]), &mut rig.memory) };
    let Err(Error::MissingRequirements(text)) = result else { panic!("accepted") };
    assert!(text.contains("maxStorageBufferRange"), "{text}");

    let mut broken = config();
    broken.modules.replace("resolve.comp", vec![1, 2, 3]);
    // SAFETY: as above.
    match unsafe { Renderer::new(&rig.gpu.host(), &broken, &mut rig.memory) } {
        Err(Error::Shader { name, .. }) => assert_eq!(name, "resolve.comp"),
        other => panic!("{:?}", other.err()),
    }
    assert_clean(&rig.close());
}

#[test]
fn a_refused_frame_leaves_no_trace() {
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config());
    let draws = [rig.draw(&builtin::mesh("sphere", 16).unwrap(), 0)];
    let expected = rig.frame(&mut renderer, &draws);
    let target = Target::new(&mut rig, config().extent);
    let good = target.inputs(0, &draws);

    let with_view = |change: fn(&mut View)| {
        let mut view = good.view;
        change(&mut view);
        FrameInputs { view, ..good }
    };
    let with_output = |change: fn(&mut Output)| {
        let mut output = good.output.unwrap();
        change(&mut output);
        FrameInputs { output: Some(output), ..good }
    };
    let wrong_draws: Vec<(Draw, &str)> = vec![
        (Draw { material: 0xffff, ..draws[0] }, "draws[0].material"),
        (Draw { material: 1, ..draws[0] }, "draws[0].material"),
        (Draw { object: 0xffff, ..draws[0] }, "draws[0].object"),
        (Draw { world_from_object: [0.0; 16], ..draws[0] }, "draws[0].world_from_object"),
        (Draw { world_from_object: [f32::NAN; 16], ..draws[0] }, "draws[0].world_from_object"),
    ];
    let images = [ImageRef { extent: [25, 16], ..target.image }];
    let host = GBufferInput::Host { set: vk::DescriptorSet::null(), images: &images };
    let mut wrong = vec![
        (FrameInputs { slot: 2, ..good }, "slot"),
        (FrameInputs { slot: usize::MAX, ..good }, "slot"),
        (with_view(|v| v.clip_from_view[0] = 0.0), "View"),
        (with_view(|v| v.clip_from_view[5] = f32::INFINITY), "View"),
        (with_view(|v| (v.clip_from_view[11], v.clip_from_view[15]) = (0.0, 1.0)), "View"),
        (with_view(|v| v.world_from_view[0] = 2.0), "View::world_from_view"),
        (with_view(|v| v.world_from_view[12] = f32::NAN), "View"),
        (FrameInputs { environment: EnvironmentUse { intensity: -1.0, ..good.environment }, ..good }, "environment"),
        (FrameInputs { environment: EnvironmentUse { rotation: f32::NAN, ..good.environment }, ..good }, "environment"),
        (with_output(|o| o.image.format = vk::Format::B8G8R8A8_SRGB), "output.image.format"),
        (with_output(|o| o.image.extent = [16, 24]), "output.image.extent"),
        (with_output(|o| o.transfer = Transfer::Srgb { exposure: 0.0 }), "output.transfer.exposure"),
        (FrameInputs { gbuffer: host, ..good }, "gbuffer.images[0].extent"),
        (FrameInputs { gbuffer: GBufferInput::Host { set: vk::DescriptorSet::null(), images: &[] }, ..good }, "gbuffer"),
    ];
    for (draw, field) in &wrong_draws {
        wrong.push((FrameInputs { gbuffer: GBufferInput::Draws(std::slice::from_ref(draw)), ..good }, field));
    }
    // All of them into one command buffer, and then a good frame.
    rig.submit(|cmd, _, _| {
        for (inputs, field) in &wrong {
            // SAFETY: the command buffer is recording; every submission is waited for.
            assert_invalid(unsafe { renderer.record(cmd, inputs) }, field);
        }
        // SAFETY: as above.
        unsafe { renderer.record(cmd, &good) }.unwrap();
        ((), Retired::default())
    });
    assert!(target.read(&mut rig) == expected);
    assert_invalid(renderer.resize([24, 0], &mut rig.memory), "Config::extent");
    assert_eq!(renderer.config().extent, config().extent);
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

#[test]
fn a_host_gbuffer_has_the_samples_extent() {
    let mut rig = Rig::new();
    let binding = vk::DescriptorSetLayoutBinding::default()
        .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::COMPUTE);
    let bindings = [0, 1, 2, 3].map(|i| binding.binding(i));
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: the device is alive.
    let own = unsafe { rig.gpu.device.create_descriptor_set_layout(&info, None) }.unwrap();
    let config = Config { samples_per_side: 2, gbuffer: GBufferSource::Host { layout: own }, ..config() };
    let mut renderer = rig.renderer(&config);
    let target = Target::new(&mut rig, config.extent);
    // An image of the output's size is too small where a pixel has four samples.
    let images = [target.image];
    let good = target.inputs(0, &[]);
    let small = FrameInputs { gbuffer: GBufferInput::Host { set: vk::DescriptorSet::null(), images: &images }, ..good };
    rig.submit(|cmd, _, _| {
        // SAFETY: the command buffer is recording; every submission is waited for.
        unsafe {
            assert_invalid(renderer.record(cmd, &small), "gbuffer.images[0].extent");
            assert_invalid(renderer.record(cmd, &good), "gbuffer");
        }
        ((), Retired::default())
    });
    rig.destroy(renderer);
    target.free(&mut rig);
    // SAFETY: nothing uses the layout any more.
    unsafe { rig.gpu.device.destroy_descriptor_set_layout(own, None) };
    assert_clean(&rig.close());
}

#[test]
fn frames_come_after_environment_and_materials() {
    let mut rig = Rig::new();
    let draws = [rig.draw(&builtin::mesh("sphere", 16).unwrap(), 0)];
    // SAFETY: the device outlives the renderer.
    let mut renderer = unsafe { Renderer::new(&rig.gpu.host(), &config(), &mut rig.memory) }.unwrap();
    let target = Target::new(&mut rig, config().extent);
    let inputs = target.inputs(0, &draws);
    let white = LatLong::new(1, 1, vec![[1.0; 3]]).unwrap();
    rig.submit(|cmd, _, memory| {
        let mut bag = Retired::default();
        // SAFETY: the command buffer is recording; every submission is waited for.
        unsafe {
            assert!(matches!(renderer.record(cmd, &inputs), Err(Error::CallOrder { called: "record", .. })));
            bag.append(renderer.record_environment(cmd, &white, memory).unwrap());
            assert!(matches!(renderer.record(cmd, &inputs), Err(Error::CallOrder { called: "record", .. })));
            bag.append(renderer.record_materials(cmd, &[grey().into()], memory).unwrap());
            renderer.record(cmd, &inputs).unwrap();
        }
        ((), bag)
    });
    assert!(target.read(&mut rig).iter().any(|texel| texel[0] > 0.0));
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

#[test]
fn impossible_materials_and_environments_are_refused() {
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config());
    let ggx = |alpha, f0: f64| Model::Ggx(Ggx { alpha, f0: glam::DVec3::splat(f0), albedo: glam::DVec3::ZERO });
    let wrong = [
        (vec![], "materials"),
        (vec![grey(); 65], "materials"),
        (vec![grey(), ggx(0.0, 0.5)], "materials[1].ggx.alpha"),
        (vec![ggx(f64::NAN, 0.5)], "materials[0].ggx.alpha"),
        (vec![ggx(0.5, 2.0)], "materials[0].ggx.f0"),
    ];
    let blinding = LatLong::new(1, 1, vec![[f32::MAX; 3]]).unwrap();
    let live = rig.memory.live.len();
    rig.submit(|cmd, _, memory| {
        for (models, field) in wrong {
            let materials: Vec<_> = models.into_iter().map(Material::from).collect();
            // SAFETY: the command buffer is recording.
            assert_invalid(unsafe { renderer.record_materials(cmd, &materials, memory) }, field);
        }
        // SAFETY: as above.
        assert_invalid(unsafe { renderer.record_environment(cmd, &blinding, memory) }, "environment radiance");
        ((), Retired::default())
    });
    assert_eq!(rig.memory.live.len(), live);
    rig.destroy(renderer);
    assert_clean(&rig.close());
}

#[test]
fn the_lobes_of_a_material_are_no_materials() {
    let mut rig = Rig::new();
    let mut renderer = rig.renderer(&config());
    let draw = rig.draw(&builtin::mesh("sphere", 16).unwrap(), 0);
    let lobe = Lobe { mu: glam::DVec3::Z, kappa: 20.0, weight: 0.5 };
    let vmf = Model::Vmf(Arc::new(Vmf::new(&[lobe, lobe]).unwrap()));
    let target = Target::new(&mut rig, config().extent);
    rig.submit(|cmd, _, memory| {
        // SAFETY: the command buffer is recording.
        let bag = unsafe { renderer.record_materials(cmd, &[vmf.into()], memory) }.unwrap();
        let draws = [Draw { material: 1, ..draw }];
        // SAFETY: as above.
        assert_invalid(unsafe { renderer.record(cmd, &target.inputs(0, &draws)) }, "draws[0].material");
        // SAFETY: as above.
        unsafe { renderer.record(cmd, &target.inputs(0, &[draw])) }.unwrap();
        ((), bag)
    });
    assert!(target.read(&mut rig).iter().any(|texel| texel[0] > 0.0));
    rig.destroy(renderer);
    assert_clean(&rig.close());
}
