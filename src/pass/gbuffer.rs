//! Pass 1: rasterises draws into normal, depth, ids, texture coordinate and its derivative (Bagher 2011, section 3).

use crate::error::{Error, Result};
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::image::{Image, ImageDesc};
use crate::gpu::memory::Location;
use crate::gpu::pipeline::{Resource, Sets, set_layout, write_set};
use crate::gpu::raster::RasterPipeline;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::{Build, Handle, Retired};
use crate::gpu::sampler::Samplers;
use crate::pass::PassContext;
use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4};

/// Pass, shader, label, timer and AOV name.
pub const NAME: &str = "gbuffer";

/// Descriptor types of set 0 as `glsl/bridge/gbuffer.glsl` declares them.
pub const BRIDGE: [vk::DescriptorType; 4] = [vk::DescriptorType::COMBINED_IMAGE_SAMPLER; 4];

const COLORS: [vk::Format; 4] =
    [vk::Format::R32G32B32A32_SFLOAT, vk::Format::R32_UINT, vk::Format::R32G32B32A32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT];
/// How many of them there are without texture coordinates.
const PLAIN_COLORS: usize = 2;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// Contents of the buffer that stands in for missing tangents.
pub(crate) const NO_TANGENT: [u8; 16] = [0; 16];

/// Formats of the streams of a [`Draw`], in the order in which [`Draw::record`] binds them.
pub(crate) const STREAMS: [vk::Format; 4] =
    [vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT];

/// One tangent of zero length, for all vertices of draws without.
pub(crate) fn no_tangent(build: &mut Build<'_>) -> Result<Buffer> {
    let (bytes, usage) = (NO_TANGENT.len() as u64, vk::BufferUsageFlags::VERTEX_BUFFER);
    let mut buffer = Buffer::new(build, "no tangent", bytes, usage, Location::Upload)?;
    buffer.bytes_mut().copy_from_slice(&NO_TANGENT);
    Ok(buffer)
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    clip_from_object: [[f32; 4]; 4],
    normal_from_object: [[f32; 4]; 3],
    id: [u32; 4],
}
const _: () = assert!(size_of::<Push>() <= 128);

/// One indexed triangle mesh to rasterise. Streams are tightly packed and ready for vertex input when `record`ed work runs.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// `R32G32B32_SFLOAT` positions and byte offset.
    pub positions: (vk::Buffer, u64),
    /// `R32G32B32_SFLOAT` normals and byte offset.
    pub normals: (vk::Buffer, u64),
    /// `R32G32_SFLOAT` texture coordinates and byte offset.
    pub coordinates: (vk::Buffer, u64),
    /// `R32G32B32A32_SFLOAT` tangents and byte offset, for normal maps and reflectances that depend on the azimuth: direction of
    /// growing `u`, and handedness `w`, where growing `v` is `w * cross(normal, tangent)`. Without them neither knows its azimuth.
    pub tangents: Option<(vk::Buffer, u64)>,
    /// 32-bit indices and byte offset.
    pub indices: (vk::Buffer, u64),
    /// Indices to draw.
    pub index_count: u32,
    /// Whether the mesh is the border of a solid that is seen from outside, triangles counter-clockwise from there: faces that show
    /// their back are left out then, as others hide them, which saves up to half of the pass.
    pub closed: bool,
    /// World from object, column-major, invertible.
    pub world_from_object: [f32; 16],
    /// Index of the material among those uploaded, below 65535.
    pub material: u32,
    /// The host's number for the object, below 65535; edges between objects are kept.
    pub object: u32,
}

impl Draw {
    pub(crate) fn world_from_object(&self) -> Mat4 {
        Mat4::from_cols_array(&self.world_from_object)
    }

    /// Columns that make world normals, up to length.
    pub(crate) fn normal_from_object(&self) -> [[f32; 4]; 3] {
        let normal = Mat3::from_mat4(self.world_from_object()).inverse().transpose();
        normal.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0])
    }

    /// Leaves back faces out where none is seen. A mirror image winds the other way.
    fn cull(&self, rec: &Recorder<'_>) {
        let mirrored = self.world_from_object().determinant() < 0.0;
        let front = if mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE };
        let mode = if self.closed { vk::CullModeFlags::BACK } else { vk::CullModeFlags::NONE };
        // SAFETY: the command buffer is recording.
        unsafe {
            rec.cx.device.cmd_set_cull_mode(rec.cmd, mode);
            rec.cx.device.cmd_set_front_face(rec.cmd, front);
        }
    }

    /// Draws it with the pipeline that is bound, which takes `push`. The rendering is open.
    pub(crate) fn record<P: Pod>(&self, rec: &Recorder<'_>, layout: vk::PipelineLayout, push: &P, no_tangent: &Buffer) {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let tangents = self.tangents.unwrap_or((no_tangent.handle, 0));
        let streams = [self.positions, self.normals, self.coordinates, tangents];
        let strides = [12, 12, 8, if self.tangents.is_some() { 16 } else { 0 }];
        let device = &rec.cx.device;
        // SAFETY: inside the rendering; the host promises that its buffers hold what `Draw` says.
        unsafe {
            device.cmd_push_constants(rec.cmd, layout, stages, 0, bytemuck::bytes_of(push));
            device.cmd_bind_vertex_buffers2(rec.cmd, 0, &streams.map(|s| s.0), &streams.map(|s| s.1), None, Some(&strides));
            device.cmd_bind_index_buffer(rec.cmd, self.indices.0, self.indices.1, vk::IndexType::UINT32);
            device.cmd_draw_indexed(rec.cmd, self.index_count, 1, 0, 0, 0);
        }
    }
}

/// The G-buffer in the encoding of `glsl/bridge/gbuffer.glsl`.
pub(crate) struct GBufferImages {
    /// World normal; depth along the view axis in metres.
    surface: Image,
    /// 0 for nothing, else (object << 16 | material) + 1.
    ids: Image,
    /// Texture coordinate; tangent as `glsl/include/tangent.glsl` encodes it.
    coordinate: Image,
    /// d(uv)/dx, d(uv)/dy in texture units a sample.
    derivative: Image,
    depth: Image,
    /// Whether `coordinate` and `derivative` are zero.
    blank: bool,
}

impl GBufferImages {
    pub fn new(build: &mut Build<'_>, [surface, ids, coordinate, derivative, depth]: [ImageDesc; 5]) -> Result<Self> {
        Ok(Self {
            surface: Image::new(build, surface)?,
            ids: Image::new(build, ids)?,
            coordinate: Image::new(build, coordinate)?,
            derivative: Image::new(build, derivative)?,
            depth: Image::new(build, depth)?,
            blank: false,
        })
    }

    /// That a frame with or without coordinates follows: whether they have to be made zero before it.
    pub fn expect(&mut self, coordinates: bool) -> bool {
        let blank = std::mem::replace(&mut self.blank, !coordinates);
        !coordinates && !blank
    }

    pub fn colors(&self) -> [&Image; 4] {
        [&self.surface, &self.ids, &self.coordinate, &self.derivative]
    }

    pub fn into_images(self) -> [Image; 5] {
        [self.surface, self.ids, self.coordinate, self.derivative, self.depth]
    }
}

pub(crate) struct Io<'a> {
    pub draws: &'a [Draw],
    pub clip_from_world: Mat4,
    /// Whether there are texture coordinates and tangents to write, and whether their images have to be made zero.
    pub coordinates: bool,
    pub clear: bool,
    /// Out.
    pub images: &'a GBufferImages,
}

/// The pipelines, and set 0 for the passes that read the result.
pub(crate) struct GBuffer {
    /// Without texture coordinates and tangents, and with them.
    pipelines: [RasterPipeline; 2],
    no_tangent: Buffer,
    pub layout: vk::DescriptorSetLayout,
    sets: Sets,
}

impl GBuffer {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        let mut pipeline = |variant: &str, streams: &[vk::Format], colors: &[vk::Format]| {
            RasterPipeline::new(
                p.build,
                p.modules,
                &format!("{NAME}.{variant}"),
                size_of::<Push>() as u32,
                streams,
                colors,
                DEPTH,
            )
        };
        let pipelines = [pipeline("plain", &STREAMS[..2], &COLORS[..PLAIN_COLORS])?, pipeline("coordinates", &STREAMS, &COLORS)?];
        let no_tangent = no_tangent(p.build)?;
        let layout = set_layout(p.build, vk::ShaderStageFlags::COMPUTE, &BRIDGE)?;
        let sets = Sets::new(p.build, layout, &BRIDGE, p.slots)?;
        Ok(Self { pipelines, no_tangent, layout, sets })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        let all = io.images.colors();
        let (colors, without) = all.split_at(if io.coordinates { all.len() } else { PLAIN_COLORS });
        if io.clear {
            without.iter().for_each(|image| rec.overwrite(image, Access::TRANSFER_WRITE));
            rec.flush();
            without.iter().for_each(|image| clear(rec, image));
        }
        colors.iter().for_each(|image| rec.overwrite(image, Access::COLOR_WRITE));
        rec.overwrite(&io.images.depth, Access::DEPTH_WRITE);
        rec.flush();
        let attachment = |image: &Image, layout, depth: f32| {
            let clear = if image.desc.format == DEPTH {
                vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 } }
            } else {
                vk::ClearValue { color: vk::ClearColorValue { uint32: [0; 4] } }
            };
            vk::RenderingAttachmentInfo::default()
                .image_view(image.view)
                .image_layout(layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(if image.desc.format == DEPTH {
                    vk::AttachmentStoreOp::DONT_CARE
                } else {
                    vk::AttachmentStoreOp::STORE
                })
                .clear_value(clear)
        };
        let attachments: Vec<_> = colors.iter().map(|image| attachment(image, Access::COLOR_WRITE.layout, 0.0)).collect();
        let depth = attachment(&io.images.depth, Access::DEPTH_WRITE.layout, 1.0);
        let pipeline = &self.pipelines[usize::from(io.coordinates)];
        pipeline.begin(rec, io.images.surface.extent(), &attachments, Some(&depth));
        for draw in io.draws {
            let push = Push {
                clip_from_object: (io.clip_from_world * draw.world_from_object()).to_cols_array_2d(),
                normal_from_object: draw.normal_from_object(),
                id: [(draw.object << 16 | draw.material) + 1, 0, 0, 0],
            };
            draw.cull(rec);
            draw.record(rec, pipeline.layout, &push, &self.no_tangent);
        }
        pipeline.end(rec);
        rec.end();
    }

    /// Set 0 of this slot over the images that `record` wrote, made ready to be sampled.
    pub fn bridge(&self, rec: &mut Recorder<'_>, images: &GBufferImages, samplers: &Samplers) -> vk::DescriptorSet {
        let images = images.colors();
        images.into_iter().for_each(|image| rec.image(image, Access::COMPUTE_SAMPLED));
        let set = self.sets.sets[rec.slot];
        write_set(&rec.cx.device, set, &images.map(|image| Resource::Sampled(image, samplers.nearest)));
        set
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipelines.into_iter().for_each(|pipeline| pipeline.retire(bag));
        self.no_tangent.retire(bag);
        self.sets.retire(bag);
        bag.push(Handle::SetLayout(self.layout));
    }
}

/// Makes an image that is ready to be written by transfers zero.
fn clear(rec: &Recorder<'_>, image: &Image) {
    let range =
        vk::ImageSubresourceRange { aspect_mask: image.desc.aspect(), level_count: 1, layer_count: 1, ..Default::default() };
    let (zero, layout) = (vk::ClearColorValue { float32: [0.0; 4] }, Access::TRANSFER_WRITE.layout);
    // SAFETY: the command buffer is recording; the image is in that layout.
    unsafe { rec.cx.device.cmd_clear_color_image(rec.cmd, image.handle, layout, &zero, &[range]) };
}

/// Refuses draws whose material was not uploaded: the shaders would read past the last one.
pub(crate) fn check_materials(draws: &[Draw], count: u32) -> Result<()> {
    match draws.iter().position(|draw| draw.material >= count) {
        Some(i) => Err(Error::invalid(format!("draws[{i}].material"), format!("below {count}"), draws[i].material)),
        None => Ok(()),
    }
}

/// Refuses draws that cannot be encoded or transformed.
pub(crate) fn check(draws: &[Draw]) -> Result<()> {
    for (i, draw) in draws.iter().enumerate() {
        for (field, value) in [("material", draw.material), ("object", draw.object)] {
            if value >= 0xffff {
                return Err(Error::invalid(format!("draws[{i}].{field}"), "below 65535", value));
            }
        }
        let determinant = Mat4::from_cols_array(&draw.world_from_object).determinant();
        if !determinant.is_normal() {
            return Err(Error::invalid(
                format!("draws[{i}].world_from_object"),
                "an invertible matrix",
                format!("determinant {determinant}"),
            ));
        }
    }
    Ok(())
}
