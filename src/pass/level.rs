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
    clear(rec, io.level, io.value);
    rec.end();
}

/// Sets all words of an image.
pub(crate) fn clear(rec: &mut Recorder<'_>, image: &Image, word: u32) {
    rec.overwrite(image, Access::TRANSFER_WRITE);
    rec.flush();
    let color = vk::ClearColorValue { uint32: [word; 4] };
    let range =
        vk::ImageSubresourceRange { aspect_mask: image.desc.aspect(), level_count: 1, layer_count: 1, ..Default::default() };
    let layout = Access::TRANSFER_WRITE.layout;
    // SAFETY: the command buffer is recording outside a render pass; the image was made ready above.
    unsafe { rec.cx.device.cmd_clear_color_image(rec.cmd, image.handle, layout, &color, &[range]) };
}
