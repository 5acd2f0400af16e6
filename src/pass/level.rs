//! Pass 4 of uniform rates: the same level at every sample.

use crate::gpu::access::Access;
use crate::gpu::image::Image;
use crate::gpu::recorder::Recorder;
use ash::vk;

/// Pass, label and timer name.
pub const NAME: &str = "level";

pub(crate) struct Io<'a> {
    /// Out: the level of each sample, in levels over a sample.
    pub level: &'a Image,
    pub value: u32,
}

/// Records a clear; there is no pipeline.
pub(crate) fn record(rec: &mut Recorder<'_>, io: &Io<'_>) {
    rec.begin(NAME);
    rec.overwrite(io.level, Access::TRANSFER_WRITE);
    rec.flush();
    let color = vk::ClearColorValue { uint32: [io.value; 4] };
    let range =
        vk::ImageSubresourceRange { aspect_mask: io.level.desc.aspect(), level_count: 1, layer_count: 1, ..Default::default() };
    let layout = Access::TRANSFER_WRITE.layout;
    // SAFETY: the command buffer is recording outside a render pass; the image was made ready above.
    unsafe { rec.cx.device.cmd_clear_color_image(rec.cmd, io.level.handle, layout, &color, &[range]) };
    rec.end();
}
