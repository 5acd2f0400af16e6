//! A host that renders with passband through its own device, memory, command buffers and G-buffer.
//!
//! `cargo run --example embed_minimal -- [OUT.png]`; the file to read first is this one. The renderer records into the
//! host's command buffers and reads the host's G-buffer through `embed_minimal/bridge/gbuffer.glsl`.

#[path = "embed_minimal/device.rs"]
pub(crate) mod device;
#[path = "embed_minimal/memory.rs"]
pub(crate) mod memory;
#[path = "embed_minimal/raster.rs"]
pub(crate) mod raster;
#[path = "embed_minimal/scene.rs"]
pub(crate) mod scene;

use device::Gpu;
use memory::{Buffer, Memory};
use passband::ash::{util::read_spv, vk};
use passband::{Config, EnvironmentUse, FrameInputs, GBufferInput, GBufferSource, Location, Output, Renderer};
use passband::{Requirements, Retired, Transfer};
use raster::{Raster, Targets};
use std::error::Error;
use std::io::Cursor;

/// How to run.
pub struct Options {
    /// Part of the device's name.
    pub device: &'static str,
    /// Validation layer with synchronization validation.
    pub validate: bool,
    /// Frames to render, at least 2.
    pub frames: usize,
    /// Image size in the first half of the frames, and in the second.
    pub extents: [[u32; 2]; 2],
    /// Directions a pixel.
    pub directions: u32,
}

/// What came of it.
pub struct Report {
    /// The device's name.
    pub device: String,
    /// Validation messages until after the device was destroyed.
    pub messages: Vec<String>,
    /// The last frame: sRGB and coverage, 8 bits a channel, `extents[1]`.
    pub image: Vec<u8>,
    /// Blocks of memory that nobody gave back.
    pub live_blocks: usize,
}

const IN_FLIGHT: usize = 2;

/// What a submitted frame may still use: freed when `frame` has finished.
struct Grave {
    frame: usize,
    retired: Retired,
    targets: Option<Targets>,
}

/// Renders `options.frames` frames and destroys everything.
pub fn run(options: &Options) -> Result<Report, Box<dyn Error>> {
    // 1  What the renderer needs is known before there is a device. The G-buffer's layout follows below.
    let mut config = Config::new(options.extents[0]);
    config.directions = options.directions;
    config.frames_in_flight = IN_FLIGHT;
    config.curvature = true;
    config.gbuffer = GBufferSource::Host { layout: vk::DescriptorSetLayout::null() };
    let gpu = Gpu::new(&Requirements::of(&config), options.device, options.validate)?;
    let mut memory = Memory::new(&gpu);
    let raster = Raster::new(&gpu, &mut memory, &scene::objects())?;
    let mut targets = Targets::new(&gpu, &mut memory, &raster, options.extents[0])?;

    // 2  The renderer, with the passes compiled to read this host's G-buffer.
    config.gbuffer = GBufferSource::Host { layout: raster.set_layout };
    replace_modules(&mut config)?;
    // SAFETY: the device has what `Requirements` asked for and outlives the renderer.
    let mut renderer = unsafe { Renderer::new(&gpu.host(), &config, &mut memory) }?;

    let device = &gpu.device;
    let pool = vk::CommandPoolCreateInfo::default()
        .queue_family_index(gpu.family)
        .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
    let signaled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
    // SAFETY: the device is alive.
    let (pool, fences) = unsafe {
        let fences: Result<Vec<_>, _> = (0..IN_FLIGHT).map(|_| device.create_fence(&signaled, None)).collect();
        (device.create_command_pool(&pool, None)?, fences?)
    };
    let buffers = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(IN_FLIGHT as u32);
    // SAFETY: the pool was just made.
    let commands = unsafe { device.allocate_command_buffers(&buffers) }?;
    let [width, height] = options.extents[1];
    let bytes = 4 * (width * height) as usize;
    let mut pixels = Buffer::new(&gpu, &mut memory, bytes, vk::BufferUsageFlags::TRANSFER_DST, Location::Readback)?;

    // 3  Frames. Nothing is freed before the fence of the last frame that may use it.
    let mut graves: Vec<Grave> = Vec::new();
    let sky = scene::sky()?;
    for frame in 0..options.frames {
        let slot = frame % IN_FLIGHT;
        let (cmd, fence) = (commands[slot], fences[slot]);
        // SAFETY: the fence is the slot's own; then frame `frame - IN_FLIGHT` and all before it have finished.
        unsafe {
            device.wait_for_fences(&[fence], true, u64::MAX)?;
            device.reset_fences(&[fence])?;
            for grave in graves.extract_if(.., |g| g.frame + IN_FLIGHT <= frame) {
                grave.free(&gpu, &mut memory);
            }
            device.begin_command_buffer(cmd, &vk::CommandBufferBeginInfo::default())?;
        }
        if frame == 0 {
            // SAFETY: the command buffer is recording, and is submitted before every later frame.
            let mut retired = unsafe { renderer.record_environment(cmd, &sky, &mut memory) }?;
            // SAFETY: as above.
            retired.append(unsafe { renderer.record_materials(cmd, &scene::materials(), &mut memory) }?);
            graves.push(Grave { frame, retired, targets: None });
        }
        if frame == options.frames / 2 {
            let retired = renderer.resize(options.extents[1], &mut memory)?;
            let fresh = Targets::new(&gpu, &mut memory, &raster, options.extents[1])?;
            let former = std::mem::replace(&mut targets, fresh);
            graves.push(Grave { frame: frame.saturating_sub(1), retired, targets: Some(former) });
        }
        let (view, output) = (scene::view(targets.extent), targets.output());
        // SAFETY: the command buffer is recording; the slot's last frame has finished; the last frame is copied once.
        unsafe {
            raster.record(&gpu, cmd, &mut targets, &view);
            let inputs = FrameInputs {
                slot,
                view,
                gbuffer: GBufferInput::Host { set: targets.set, images: &targets.gbuffer() },
                environment: EnvironmentUse::default(),
                lights: &[],
                shadows: None,
                levels: None,
                shading_rate: None,
                seed: [0, 0],
                output: Some(Output { image: output, transfer: Transfer::Srgb { exposure: 0.5 } }),
            };
            renderer.record(cmd, &inputs)?;
            if frame + 1 == options.frames {
                copy(&gpu, cmd, &targets, &pixels);
            }
            device.end_command_buffer(cmd)?;
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
            device.queue_submit2(gpu.queue, &[vk::SubmitInfo2::default().command_buffer_infos(&commands)], fence)?;
        }
    }

    // 4  The end: wait, give everything back, then the device.
    // SAFETY: nothing is pending after the wait.
    unsafe {
        device.wait_for_fences(&fences, true, u64::MAX)?;
        graves.push(Grave { frame: options.frames, retired: renderer.destroy(), targets: Some(targets) });
        graves.into_iter().for_each(|grave| grave.free(&gpu, &mut memory));
    }
    let image = pixels.bytes().to_vec();
    // SAFETY: as above.
    unsafe {
        pixels.free(&gpu, &mut memory);
        raster.free(&gpu, &mut memory);
        fences.into_iter().for_each(|fence| device.destroy_fence(fence, None));
        device.destroy_command_pool(pool, None);
    }
    Ok(Report { device: gpu.name.clone(), messages: gpu.close(), image, live_blocks: memory.live })
}

/// The passes that read the G-buffer, compiled with this host's bridge.
pub(crate) fn replace_modules(config: &mut Config) -> Result<(), Box<dyn Error>> {
    let modules: [(&str, &[u8]); 5] = [
        ("filter.comp", include_bytes!("embed_minimal/spirv/filter.comp.spv")),
        ("curvature.comp", include_bytes!("embed_minimal/spirv/curvature.comp.spv")),
        ("classify.comp", include_bytes!("embed_minimal/spirv/classify.comp.spv")),
        ("shade.comp", include_bytes!("embed_minimal/spirv/shade.comp.spv")),
        ("resolve.comp", include_bytes!("embed_minimal/spirv/resolve.comp.spv")),
    ];
    for (name, bytes) in modules {
        config.modules.replace(name, read_spv(&mut Cursor::new(bytes))?);
    }
    Ok(())
}

impl Grave {
    unsafe fn free(self, gpu: &Gpu, memory: &mut Memory) {
        // SAFETY: the caller waited for the frame.
        unsafe {
            self.retired.free(&gpu.device, memory);
            if let Some(targets) = self.targets {
                targets.free(gpu, memory);
            }
        }
    }
}

/// The output, which the renderer left ready to be copied, into memory that the CPU reads after the fence.
unsafe fn copy(gpu: &Gpu, cmd: vk::CommandBuffer, targets: &Targets, pixels: &Buffer) {
    let [width, height] = targets.extent;
    let layers = vk::ImageSubresourceLayers { aspect_mask: vk::ImageAspectFlags::COLOR, layer_count: 1, ..Default::default() };
    let image_extent = vk::Extent3D { width, height, depth: 1 };
    let region = vk::BufferImageCopy { image_subresource: layers, image_extent, ..Default::default() };
    let to_host = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    // SAFETY: the command buffer is recording; the buffer holds the whole image.
    unsafe {
        let (image, layout) = (targets.output.image, targets.output().exit.layout);
        gpu.device.cmd_copy_image_to_buffer(cmd, image, layout, pixels.buffer, &[region]);
        gpu.device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&to_host));
    }
}

#[allow(dead_code, reason = "a test includes this file for `run` alone")]
fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "embed_minimal.png".into());
    let extents = [[320, 240], [640, 480]];
    let report = run(&Options { device: "", validate: false, frames: 8, extents, directions: 64 })?;
    let [width, height] = extents[1];
    image::save_buffer(&path, &report.image, width, height, image::ColorType::Rgba8)?;
    println!("{path}: {width}x{height}, {}", report.device);
    Ok(())
}
