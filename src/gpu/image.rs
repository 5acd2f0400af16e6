//! Images that the renderer owns.

use crate::error::{Error, Result};
use crate::gpu::context::VkResultExt;
use crate::gpu::memory::{Block, Location, MemoryRequest, allocate};
use crate::gpu::retire::{Build, Handle, Retired};
use ash::vk;

/// What an image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ImageDesc {
    pub name: &'static str,
    pub format: vk::Format,
    /// Width, height, depth; a depth above 1 makes it 3-D.
    pub extent: [u32; 3],
    /// Layers of an array of 2-D images; `None` for an image that is no array.
    pub layers: Option<u32>,
    /// Mip levels.
    pub levels: u32,
    pub usage: vk::ImageUsageFlags,
}

impl ImageDesc {
    /// One level, no array.
    pub fn new(name: &'static str, format: vk::Format, extent: [u32; 3], usage: vk::ImageUsageFlags) -> Self {
        Self { name, format, extent, layers: None, levels: 1, usage }
    }

    pub fn aspect(&self) -> vk::ImageAspectFlags {
        match self.format {
            vk::Format::D32_SFLOAT => vk::ImageAspectFlags::DEPTH,
            _ => vk::ImageAspectFlags::COLOR,
        }
    }

    /// Width, height and depth of a level.
    pub fn level_extent(&self, level: u32) -> [u32; 3] {
        self.extent.map(|e| (e >> level).max(1))
    }

    /// Bytes of the texels, without the driver's padding.
    pub fn bytes(&self) -> u64 {
        (0..self.levels).map(|level| self.level_bytes(level)).sum()
    }

    /// Of one level.
    pub fn level_bytes(&self, level: u32) -> u64 {
        let texels: u64 = self.level_extent(level).iter().map(|&e| u64::from(e)).product();
        texels * u64::from(self.layers.unwrap_or(1)) * texel_bytes(self.format)
    }
}

/// Bytes of one texel of the formats that the frame uses.
pub(crate) fn texel_bytes(format: vk::Format) -> u64 {
    match format {
        vk::Format::R8_UINT | vk::Format::R8_UNORM => 1,
        vk::Format::R16_SFLOAT | vk::Format::R16_UNORM => 2,
        vk::Format::R32G32_SFLOAT | vk::Format::R32G32_UINT | vk::Format::R16G16B16A16_SFLOAT => 8,
        vk::Format::R32G32B32A32_SFLOAT | vk::Format::R32G32B32A32_UINT => 16,
        _ => 4,
    }
}

/// An image with one view of all of it.
#[derive(Debug)]
pub struct Image {
    pub(crate) desc: ImageDesc,
    pub(crate) handle: vk::Image,
    pub(crate) view: vk::ImageView,
    block: Block,
}

impl Image {
    pub(crate) fn new(build: &mut Build<'_>, desc: ImageDesc) -> Result<Self> {
        let device = &build.cx.device;
        let [width, height, depth] = desc.extent;
        let limits = &build.cx.limits;
        let (kind, view_kind, limit) = if desc.layers.is_some() {
            (vk::ImageType::TYPE_2D, vk::ImageViewType::TYPE_2D_ARRAY, limits.max_image_dimension2_d)
        } else if depth > 1 {
            (vk::ImageType::TYPE_3D, vk::ImageViewType::TYPE_3D, limits.max_image_dimension3_d)
        } else {
            (vk::ImageType::TYPE_2D, vk::ImageViewType::TYPE_2D, limits.max_image_dimension2_d)
        };
        if desc.extent.iter().any(|&e| e == 0 || e > limit) {
            return Err(Error::invalid(
                format!("extent of image {}", desc.name),
                format!("1 to {limit}"),
                format!("{:?}", desc.extent),
            ));
        }
        let layers = desc.layers.unwrap_or(1);
        if layers == 0 || layers > limits.max_image_array_layers {
            let expected = format!("1 to {}", limits.max_image_array_layers);
            return Err(Error::invalid(format!("layers of image {}", desc.name), expected, layers));
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(kind)
            .format(desc.format)
            .extent(vk::Extent3D { width, height, depth })
            .mip_levels(desc.levels)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(desc.usage);
        // SAFETY: the device is alive; the description is checked above and by Requirements.
        let handle = build.track(unsafe { device.create_image(&info, None) }.named("vkCreateImage")?, Handle::Image);
        build.cx.name(handle, desc.name);
        // SAFETY: the image is alive and unbound.
        let requirements = unsafe { device.get_image_memory_requirements(handle) };
        let request = MemoryRequest { name: desc.name, requirements, location: Location::Device, linear: false };
        let block = allocate(build.memory, &request)?;
        build.track_block(&block);
        // SAFETY: the block satisfies the image's requirements and is unshared.
        unsafe { device.bind_image_memory(handle, block.memory, block.offset) }.named("vkBindImageMemory")?;
        let range = vk::ImageSubresourceRange {
            aspect_mask: desc.aspect(),
            level_count: desc.levels,
            layer_count: layers,
            ..Default::default()
        };
        let info =
            vk::ImageViewCreateInfo::default().image(handle).view_type(view_kind).format(desc.format).subresource_range(range);
        // SAFETY: the image is bound.
        let view = build.track(unsafe { device.create_image_view(&info, None) }.named("vkCreateImageView")?, Handle::View);
        Ok(Self { desc, handle, view, block })
    }

    /// A view of all layers of each level, which the caller retires.
    pub(crate) fn level_views(&self, build: &mut Build<'_>) -> Result<Vec<vk::ImageView>> {
        let kind = if self.desc.layers.is_some() { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
        let layers = self.desc.layers.unwrap_or(1);
        (0..self.desc.levels).map(|level| self.part(build, kind, level, 0..layers)).collect()
    }

    /// A view of the first level of each layer, which the caller retires.
    pub(crate) fn layer_views(&self, build: &mut Build<'_>) -> Result<Vec<vk::ImageView>> {
        let kind = vk::ImageViewType::TYPE_2D;
        (0..self.desc.layers.unwrap_or(1)).map(|layer| self.part(build, kind, 0, layer..layer + 1)).collect()
    }

    /// A view of layers of one level.
    fn part(
        &self,
        build: &mut Build<'_>,
        kind: vk::ImageViewType,
        base_mip_level: u32,
        layers: std::ops::Range<u32>,
    ) -> Result<vk::ImageView> {
        let range = vk::ImageSubresourceRange {
            aspect_mask: self.desc.aspect(),
            base_mip_level,
            level_count: 1,
            base_array_layer: layers.start,
            layer_count: layers.len() as u32,
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(kind)
            .format(self.desc.format)
            .subresource_range(range);
        // SAFETY: the image is bound.
        let view = unsafe { build.cx.device.create_image_view(&info, None) };
        Ok(build.track(view.named("vkCreateImageView")?, Handle::View))
    }

    pub(crate) fn extent(&self) -> [u32; 2] {
        [self.desc.extent[0], self.desc.extent[1]]
    }

    pub(crate) fn retire(self, bag: &mut Retired) {
        bag.push(Handle::View(self.view));
        bag.push(Handle::Image(self.handle));
        bag.push(Handle::Memory(self.block));
    }
}
