//! Pass 2, before it: the tangent frame of each texel of an object's map, by rasterising the object over its texture coordinates
//! (the instant BRDF map of Xu et al. 2017, section 4, before it has lobes). Where the cells of directions are the camera's.

use crate::error::Result;
use crate::gpu::access::Access;
use crate::gpu::buffer::Buffer;
use crate::gpu::raster::RasterPipeline;
use crate::gpu::recorder::Recorder;
use crate::gpu::retire::Retired;
use crate::pass::PassContext;
use crate::pass::gbuffer::{self, Draw};
use crate::pass::object_cells::{FRAMES, ObjectCells};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Pass, shader, label and timer name.
pub const NAME: &str = "texture_space";

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    /// Rows.
    world_from_object: [[f32; 4]; 3],
    normal_from_object: [[f32; 4]; 3],
    eye: [f32; 4],
}
const _: () = assert!(size_of::<Push>() <= 128);

pub(crate) struct Io<'a> {
    pub draws: &'a [Draw],
    /// World position.
    pub eye: Vec3,
    /// Out: their frames.
    pub objects: &'a ObjectCells,
}

pub(crate) struct TextureSpace {
    pipeline: RasterPipeline,
    no_tangent: Buffer,
}

impl TextureSpace {
    pub fn new(p: &mut PassContext<'_, '_>) -> Result<Self> {
        let (push, streams, depth) = (size_of::<Push>() as u32, gbuffer::STREAMS, vk::Format::UNDEFINED);
        let pipeline = RasterPipeline::new(p.build, p.modules, NAME, push, &streams, &[FRAMES], depth)?;
        Ok(Self { pipeline, no_tangent: gbuffer::no_tangent(p.build)? })
    }

    pub fn record(&self, rec: &mut Recorder<'_>, io: &Io<'_>) {
        rec.begin(NAME);
        io.objects.images().for_each(|images| rec.overwrite(&images.frames, Access::COLOR_WRITE));
        rec.flush();
        for (draw, seat, images) in io.objects.seated(io.draws) {
            let Some(view) = images.frame_views.get(seat.number) else { continue };
            let attachment = vk::RenderingAttachmentInfo::default()
                .image_view(*view)
                .image_layout(Access::COLOR_WRITE.layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE);
            self.pipeline.begin(rec, images.frames.extent(), &[attachment], None);
            let world = draw.world_from_object();
            let push = Push {
                world_from_object: [0, 1, 2].map(|i| world.row(i).to_array()),
                normal_from_object: draw.normal_from_object(),
                eye: io.eye.extend(1.0).to_array(),
            };
            draw.record(rec, self.pipeline.layout, &push, &self.no_tangent);
            self.pipeline.end(rec);
        }
        rec.end();
    }

    pub fn retire(self, bag: &mut Retired) {
        self.pipeline.retire(bag);
        self.no_tangent.retire(bag);
    }
}
