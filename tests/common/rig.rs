//! A small host of the tests' own: it sees every block of memory, and can refuse one.

use super::device::Gpu;
use super::memory::{Buffer, Image};
use passband::ash::vk;
use passband::gpu::memory::MemoryRequest;
use passband::offline::mesh::Mesh;
use passband::reflectance::{Ggx, Model};
use passband::sampling::LatLong;
use passband::{
    Access, AllocationError, Block, Config, DedicatedAllocator, Draw, EnvironmentUse, Error, FrameInputs, GBufferInput,
    HostAllocator, ImageRef, Location, Output, Renderer, Requirements, Retired, Transfer, View,
};

/// Counts blocks, maps those of all buffers, and fails request number `fail_at` if told to.
pub struct Memory {
    plain: DedicatedAllocator,
    /// Names and addresses of the blocks that are out.
    pub live: Vec<(String, u64, usize)>,
    pub requests: usize,
    pub fail_at: Option<usize>,
    /// What the request that failed last was for.
    pub refused: Option<String>,
    token: u64,
}

impl Memory {
    pub fn new(gpu: &Gpu) -> Self {
        // SAFETY: the rig frees all blocks before its device goes.
        let plain = unsafe { DedicatedAllocator::new(&gpu.instance, gpu.physical_device, &gpu.device) };
        Self { plain, live: Vec::new(), requests: 0, fail_at: None, refused: None, token: 0 }
    }

    /// The words of the live buffer called `name`, of the newest.
    pub fn words(&self, name: &str, count: usize) -> Vec<u32> {
        let (_, _, address) = self.live.iter().rfind(|(n, ..)| n == name).unwrap();
        // SAFETY: blocks stay mapped while they live; the caller asks for no more than the block holds.
        unsafe { std::slice::from_raw_parts(*address as *const u32, count) }.to_vec()
    }
}

// SAFETY: blocks are the plain allocator's; mapping more than asked for is allowed.
unsafe impl HostAllocator for Memory {
    fn allocate(&mut self, request: &MemoryRequest<'_>) -> Result<Block, AllocationError> {
        self.requests += 1;
        if self.fail_at == Some(self.requests - 1) {
            self.refused = Some(request.name.into());
            return Err(AllocationError("refused by the test".into()));
        }
        // Images may have no visible memory to be in.
        let location = if request.linear { Location::Upload } else { request.location };
        let mut block = self.plain.allocate(&MemoryRequest { location, ..*request })?;
        self.token += 1;
        block.token = self.token;
        self.live.push((request.name.into(), block.token, block.mapped.map_or(0, |p| p.as_ptr() as usize)));
        Ok(block)
    }

    unsafe fn free(&mut self, block: Block) {
        let at = self.live.iter().position(|(_, token, _)| *token == block.token);
        self.live.swap_remove(at.expect("a block that is live"));
        // SAFETY: as the caller promises.
        unsafe { self.plain.free(block) };
    }
}

/// A device, its memory, and one command buffer that is waited for.
pub struct Rig {
    pub gpu: Gpu,
    pub memory: Memory,
    pool: vk::CommandPool,
    fence: vk::Fence,
    meshes: Vec<[Buffer; 4]>,
}

impl Rig {
    pub fn new() -> Self {
        let gpu = Gpu::new(&Requirements::of(&Config::new([64, 64])), super::DEVICE, true).unwrap();
        assert!(gpu.name.contains(super::DEVICE), "{}", gpu.name);
        let memory = Memory::new(&gpu);
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family);
        // SAFETY: the device is alive.
        let (pool, fence) = unsafe {
            let pool = gpu.device.create_command_pool(&pool, None).unwrap();
            (pool, gpu.device.create_fence(&vk::FenceCreateInfo::default(), None).unwrap())
        };
        Self { gpu, memory, pool, fence, meshes: Vec::new() }
    }

    /// Records, submits, waits, and frees the bag.
    pub fn submit<T>(&mut self, record: impl FnOnce(vk::CommandBuffer, &Gpu, &mut Memory) -> (T, Retired)) -> T {
        let device = &self.gpu.device;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // What the device wrote is made visible to the CPU, which may look into any block.
        let all = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        // SAFETY: everything is the rig's own, and nothing is pending after the wait.
        unsafe {
            let cmd = device.allocate_command_buffers(&info).unwrap()[0];
            device.begin_command_buffer(cmd, &begin).unwrap();
            let (value, bag) = record(cmd, &self.gpu, &mut self.memory);
            device.cmd_pipeline_barrier2(cmd, &vk::DependencyInfo::default().memory_barriers(&all));
            device.end_command_buffer(cmd).unwrap();
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
            let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
            device.queue_submit2(self.gpu.queue, &submit, self.fence).unwrap();
            device.wait_for_fences(&[self.fence], true, u64::MAX).unwrap();
            device.reset_fences(&[self.fence]).unwrap();
            device.free_command_buffers(self.pool, &[cmd]);
            bag.free(device, &mut self.memory);
            value
        }
    }

    /// As [`Self::submit`], for calls that may fail: what they recorded until then is submitted all the same.
    pub fn try_submit(
        &mut self,
        record: impl FnOnce(vk::CommandBuffer, &Gpu, &mut Memory) -> Result<Retired, Error>,
    ) -> Result<(), Error> {
        self.submit(|cmd, gpu, memory| match record(cmd, gpu, memory) {
            Ok(bag) => (Ok(()), bag),
            Err(error) => (Err(error), Retired::default()),
        })
    }

    /// A renderer with an environment and a grey material.
    pub fn renderer(&mut self, config: &Config) -> Renderer {
        // SAFETY: the device outlives the renderer, which the test gives to `destroy`.
        let mut renderer = unsafe { Renderer::new(&self.gpu.host(), config, &mut self.memory) }.unwrap();
        self.submit(|cmd, _, memory| {
            // SAFETY: the command buffer is recording.
            let mut bag = unsafe { renderer.record_environment(cmd, &sky(), memory) }.unwrap();
            // SAFETY: as above.
            bag.append(unsafe { renderer.record_materials(cmd, &[grey().into()], memory) }.unwrap());
            ((), bag)
        });
        renderer
    }

    /// The draw of a mesh that the rig keeps.
    pub fn draw(&mut self, mesh: &Mesh, object: u32) -> Draw {
        let vertex = vk::BufferUsageFlags::VERTEX_BUFFER;
        let streams: [(_, &[u8]); 4] = [
            (vertex, bytemuck::cast_slice(&mesh.positions)),
            (vertex, bytemuck::cast_slice(&mesh.normals)),
            (vertex, bytemuck::cast_slice(&mesh.uvs)),
            (vk::BufferUsageFlags::INDEX_BUFFER, bytemuck::cast_slice(&mesh.indices)),
        ];
        let buffers = streams.map(|(usage, bytes)| Buffer::with(&self.gpu, &mut self.memory, usage, bytes).unwrap());
        let [positions, normals, coordinates, indices] = [0, 1, 2, 3].map(|i: usize| (buffers[i].buffer, 0));
        self.meshes.push(buffers);
        let index_count = mesh.indices.len() as u32;
        let world_from_object = glam::Mat4::IDENTITY.to_cols_array();
        let (tangents, closed) = (None, false);
        Draw { positions, normals, coordinates, tangents, indices, index_count, closed, world_from_object, material: 0, object }
    }

    /// One frame of `draws` in slot 0: linear radiance and coverage.
    pub fn frame(&mut self, renderer: &mut Renderer, draws: &[Draw]) -> Vec<[f32; 4]> {
        let extent = renderer.config().extent;
        let target = Target::new(self, extent);
        self.submit(|cmd, _, _| {
            // SAFETY: the command buffer is recording; every submission is waited for.
            unsafe { renderer.record(cmd, &target.inputs(0, draws)) }.unwrap();
            ((), Retired::default())
        });
        target.read(self)
    }

    pub fn destroy(&mut self, renderer: Renderer) {
        // SAFETY: every submission is waited for.
        unsafe { renderer.destroy().free(&self.gpu.device, &mut self.memory) };
    }

    /// Gives everything back and returns the messages of the whole run: leaked objects are among them.
    pub fn close(mut self) -> Vec<String> {
        // SAFETY: every submission is waited for.
        unsafe {
            for buffer in self.meshes.drain(..).flatten() {
                buffer.free(&self.gpu, &mut self.memory);
            }
            self.gpu.device.destroy_fence(self.fence, None);
            self.gpu.device.destroy_command_pool(self.pool, None);
        }
        assert_eq!(self.memory.live, [], "blocks that nobody gave back");
        self.gpu.close()
    }
}

/// A host's output image, linear in 32-bit floats.
pub struct Target {
    pub image: ImageRef,
    own: Image,
    pixels: Buffer,
}

impl Target {
    pub fn new(rig: &mut Rig, extent: [u32; 2]) -> Self {
        let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_SRC;
        let format = vk::Format::R32G32B32A32_SFLOAT;
        let own = Image::new(&rig.gpu, &mut rig.memory, format, extent, usage).unwrap();
        let bytes = 16 * (extent[0] * extent[1]) as usize;
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let pixels = Buffer::new(&rig.gpu, &mut rig.memory, bytes, usage, Location::Readback).unwrap();
        let image = ImageRef {
            image: own.image,
            view: own.view,
            format,
            extent,
            aspect: vk::ImageAspectFlags::COLOR,
            entry: Access::NONE,
            exit: Access::TRANSFER_READ,
        };
        Self { image, own, pixels }
    }

    /// A frame into this image.
    pub fn inputs<'a>(&self, slot: usize, draws: &'a [Draw]) -> FrameInputs<'a> {
        FrameInputs {
            slot,
            view: view(self.image.extent),
            gbuffer: GBufferInput::Draws(draws),
            environment: EnvironmentUse::default(),
            lights: &[],
            shadows: None,
            levels: None,
            shading_rate: None,
            seed: [7, 0],
            output: Some(Output { image: self.image, transfer: Transfer::Linear }),
        }
    }

    /// The image's texels; the image is freed.
    pub fn read(mut self, rig: &mut Rig) -> Vec<[f32; 4]> {
        let [width, height] = self.image.extent;
        let layers =
            vk::ImageSubresourceLayers { aspect_mask: vk::ImageAspectFlags::COLOR, layer_count: 1, ..Default::default() };
        let image_extent = vk::Extent3D { width, height, depth: 1 };
        let region = vk::BufferImageCopy { image_subresource: layers, image_extent, ..Default::default() };
        rig.submit(|cmd, gpu, _| {
            let (from, layout) = (self.image.image, self.image.exit.layout);
            // SAFETY: the renderer left the image ready to be copied.
            unsafe { gpu.device.cmd_copy_image_to_buffer(cmd, from, layout, self.pixels.buffer, &[region]) };
            ((), Retired::default())
        });
        let texels = bytemuck::pod_collect_to_vec(self.pixels.bytes());
        self.free(rig);
        texels
    }

    pub fn free(self, rig: &mut Rig) {
        // SAFETY: every submission is waited for.
        unsafe {
            self.pixels.free(&rig.gpu, &mut rig.memory);
            self.own.free(&rig.gpu, &mut rig.memory);
        }
    }
}

/// A view from (0, 0, 3) along -z with 40 degrees from bottom to top.
pub fn view(extent: [u32; 2]) -> View {
    let f = 1.0 / 20f32.to_radians().tan();
    let aspect = extent[0] as f32 / extent[1] as f32;
    View {
        world_from_view: glam::Mat4::from_translation(glam::vec3(0.0, 0.0, 3.0)).to_cols_array(),
        clip_from_view: [f / aspect, 0.0, 0.0, 0.0, 0.0, -f, 0.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0, -0.1, 0.0],
    }
}

/// Four by two texels, no two alike.
pub fn sky() -> LatLong {
    LatLong::new(4, 2, (0..8).map(|i| [1.0 + i as f32, 2.0, 0.5 * i as f32]).collect()).unwrap()
}

pub fn grey() -> Model {
    Model::Ggx(Ggx { alpha: 0.4, f0: glam::DVec3::splat(0.3), albedo: glam::DVec3::splat(0.5) })
}
