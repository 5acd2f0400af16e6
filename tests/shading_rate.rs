//! The shading-rate attachment: texels against all samples below them, in the renderer's buffer and in a host's image.

#[path = "support/chosen_device.rs"]
mod chosen_device;
mod common;
#[path = "support/frames.rs"]
mod frames;
#[path = "support/levels.rs"]
mod read_back;

use chosen_device::DEVICE;
use common::embed_minimal::memory::{Buffer, Image};
use common::rig::{Rig, Target};
use passband::ash::vk;
use passband::offline::aov::{Aov, SHADING_RATE};
use passband::offline::builtin;
use passband::offline::headless::Options;
use passband::offline::render::{Settings, render};
use passband::offline::session::Session;
use passband::pass::shading_rate::FORMAT;
use passband::{Access, Config, Estimator, FrameInputs, ImageRef, Location, Rate, Retired, ShadingRate};
use read_back::{scene, session};

/// The extension's code of a square of 1, 2 or 4 pixels a side.
fn code(level: u32) -> u8 {
    match level {
        0 => 0b0000,
        1 => 0b0101,
        _ => 0b1010,
    }
}

/// Row after row, what each texel should be by the level and the object of every sample.
fn expected(session: &mut Session, config: &Config, rate: ShadingRate) -> Vec<u8> {
    let words = |(bytes, ..): (Vec<u8>, vk::Format, [u32; 2])| bytemuck::pod_collect_to_vec::<u8, u32>(&bytes);
    let [levels, ids] = ["level", "ids"].map(|name| words(session.image(name).unwrap()));
    let side = config.samples_per_side;
    let [width, height] = config.extent.map(|e| e * side);
    let [across, down] = [0, 1].map(|axis| config.extent[axis].div_ceil(rate.texel[axis]));
    let texel = |i: u32| {
        let [x, y] = [i % across * rate.texel[0] * side, i / across * rate.texel[1] * side];
        let samples = (y..(y + rate.texel[1] * side).min(height))
            .flat_map(|y| (x..(x + rate.texel[0] * side).min(width)).map(move |x| (y * width + x) as usize));
        let finest = samples.filter(|i| ids[*i] != 0).map(|i| levels[i].saturating_sub(side.ilog2())).min();
        code(finest.unwrap_or(rate.coarsest).min(rate.coarsest))
    };
    (0..across * down).map(texel).collect()
}

/// The same as the pass wrote it.
fn written(words: &[u32], [across, down]: [u32; 2]) -> Vec<u8> {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let rows = bytes.chunks_exact(across.next_multiple_of(4) as usize).take(down as usize);
    rows.flat_map(|row| row[..across as usize].to_vec()).collect()
}

#[test]
fn each_texel_is_the_finest_of_its_samples() {
    let world = scene("trio");
    let mut seen = std::collections::BTreeSet::new();
    for (extent, side, texel, coarsest, rate) in [
        ([203, 117], 1, [16, 16], 2, Rate::Bandwidth),
        ([203, 117], 1, [8, 32], 1, Rate::Bandwidth),
        ([97, 64], 2, [16, 8], 2, Rate::Bandwidth),
        ([33, 29], 4, [4, 4], 2, Rate::Bandwidth),
        ([67, 35], 1, [64, 64], 0, Rate::Luminance),
        ([64, 64], 1, [8, 8], 2, Rate::Uniform(1)),
    ] {
        let shading_rate = Some(ShadingRate { texel, coarsest });
        let config = Config {
            rate,
            samples_per_side: side,
            shading_rate,
            samples_per_cycle: Some(0.5),
            ..frames::config(extent, Estimator::Mis, 16)
        };
        let mut session = session(&world, &config);
        session.frame([1, 0]).unwrap();
        session.frame([1, 1]).unwrap();
        // No coarser than the frame itself.
        let levels = if let Rate::Uniform(level) = rate { level } else { config.lmax };
        let expected = expected(&mut session, &config, ShadingRate { texel, coarsest: coarsest.min(levels) });
        let texels = [0, 1].map(|axis| extent[axis].div_ceil(texel[axis]));
        assert_eq!(written(&session.words("rates").unwrap(), texels), expected, "{extent:?} {side} {texel:?} {rate:?}");
        seen.extend(expected);
        assert_eq!(session.messages(), [""; 0]);
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), [0, 5, 10]);
}

#[test]
fn the_layer_shows_it() {
    let config = Config { rate: Rate::Uniform(1), ..Config::new([40, 24]) };
    let device = Options { device: Some(DEVICE.into()), validate: true };
    let settings = Settings { aovs: vec![Aov::ShadingRate], device, ..Settings::new(config.clone()) };
    let rendered = render(&scene("furnace"), &settings, &mut |_, _, _| {}).unwrap();
    let layer = rendered.image.channel("shading-rate.Y").unwrap();
    // Half of the pixels a side where there is a surface, the coarsest where there is none in a texel.
    assert_eq!(layer.len(), 40 * 24);
    assert!(layer.iter().all(|v| *v == 1.0 || *v == SHADING_RATE.coarsest as f32) && layer.contains(&1.0));
    let full = Settings { config: Config::new([40, 24]), ..settings };
    let refused = render(&scene("furnace"), &full, &mut |_, _, _| {}).err().unwrap().to_string();
    assert!(refused.contains("--aov shading-rate") && refused.contains("levels"), "{refused}");
}

#[test]
fn hosts_get_it_in_their_own_image() {
    let mut rig = Rig::new();
    let extent = [75, 42];
    let (texel, texels) = ([8, 16], [10, 3]);
    let rate = ShadingRate { texel, coarsest: 2 };
    let config = Config {
        rate: Rate::Bandwidth,
        shading_rate: Some(rate),
        samples_per_cycle: Some(0.5),
        directions: 4,
        ..Config::new(extent)
    };
    let mut renderer = rig.renderer(&config);
    let draws = [rig.draw(&builtin::mesh("sphere", 32).unwrap(), 0)];
    let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::SAMPLED;
    let own = Image::new(&rig.gpu, &mut rig.memory, FORMAT, texels, usage).unwrap();
    let mut pixels = Buffer::new(
        &rig.gpu,
        &mut rig.memory,
        (texels[0] * texels[1]).next_multiple_of(4) as usize,
        vk::BufferUsageFlags::TRANSFER_DST,
        Location::Readback,
    )
    .unwrap();
    let image = ImageRef {
        image: own.image,
        view: own.view,
        format: FORMAT,
        extent: texels,
        aspect: vk::ImageAspectFlags::COLOR,
        entry: Access::NONE,
        exit: Access::TRANSFER_READ,
    };
    let target = Target::new(&mut rig, extent);
    rig.submit(|cmd, gpu, _| {
        let inputs = FrameInputs { shading_rate: Some(image), ..target.inputs(0, &draws) };
        let other = FrameInputs { shading_rate: Some(ImageRef { extent: [9, 3], ..image }), ..inputs };
        let layers =
            vk::ImageSubresourceLayers { aspect_mask: vk::ImageAspectFlags::COLOR, layer_count: 1, ..Default::default() };
        let image_extent = vk::Extent3D { width: texels[0], height: texels[1], depth: 1 };
        let region = vk::BufferImageCopy { image_subresource: layers, image_extent, ..Default::default() };
        // SAFETY: the command buffer is recording; the renderer leaves the image ready to be copied.
        unsafe {
            let refused = renderer.record(cmd, &other).unwrap_err().to_string();
            assert!(refused.contains("shading_rate") && refused.contains("[10, 3]") && refused.contains("[9, 3]"), "{refused}");
            renderer.record(cmd, &inputs).unwrap();
            gpu.device.cmd_copy_image_to_buffer(cmd, own.image, image.exit.layout, pixels.buffer, &[region]);
        }
        ((), Retired::default())
    });
    let words = rig.memory.words("rates", 3 * 3);
    let copied = &pixels.bytes()[..(texels[0] * texels[1]) as usize];
    assert_eq!(copied, written(&words, texels));
    // The sphere in the middle, nothing in the corners.
    assert!(copied[0] == 10 && copied.iter().any(|rate| *rate < 10), "{copied:?}");
    target.free(&mut rig);
    // SAFETY: every submission is waited for.
    unsafe {
        pixels.free(&rig.gpu, &mut rig.memory);
        own.free(&rig.gpu, &mut rig.memory);
    }
    rig.destroy(renderer);
    assert_eq!(rig.close(), [""; 0]);
}

#[test]
fn what_cannot_be_is_refused() {
    let base = Config { rate: Rate::Bandwidth, ..Config::new([64, 64]) };
    let refused = |rate, shading_rate| {
        let config = Config { rate, shading_rate: Some(shading_rate), ..base.clone() };
        let requirements = passband::Requirements::of(&config);
        let headless =
            passband::offline::headless::Headless::new(&Options { device: Some(DEVICE.into()), validate: true }, &requirements);
        Session::new(headless.unwrap(), &scene("furnace"), &config).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let good = ShadingRate { texel: [16, 16], coarsest: 2 };
    for (rate, shading_rate, field) in [
        (Rate::Bandwidth, ShadingRate { texel: [12, 16], ..good }, "Config::shading_rate.texel"),
        (Rate::Bandwidth, ShadingRate { texel: [16, 128], ..good }, "Config::shading_rate.texel"),
        (Rate::Bandwidth, ShadingRate { coarsest: 3, ..good }, "Config::shading_rate.coarsest"),
        (Rate::Full, good, "Config::shading_rate"),
    ] {
        let said = refused(rate, shading_rate);
        assert!(said.contains(field), "{said}");
    }
}
