//! What a host lends.

use crate::error::{Error, Result};
use ash::vk;
use std::ffi::CString;

/// Handles of the host's that the renderer borrows. The function tables are cloned; the handles must outlive the renderer.
#[derive(Clone, Copy)]
pub struct Host<'a> {
    /// Instance, Vulkan 1.3.
    pub instance: &'a ash::Instance,
    /// The device's physical device.
    pub physical_device: vk::PhysicalDevice,
    /// Device with the features of [`crate::Requirements`] enabled.
    pub device: &'a ash::Device,
    /// Family of the queue on which the host submits; it supports graphics and compute.
    pub queue_family: u32,
    /// The host's pipeline cache, or null.
    pub pipeline_cache: vk::PipelineCache,
    /// For object names and labels, if the host enabled `VK_EXT_debug_utils`.
    pub debug_utils: Option<&'a ash::ext::debug_utils::Device>,
}

/// The library's copy of what it needs of [`Host`].
pub(crate) struct Context {
    pub device: ash::Device,
    pub pipeline_cache: vk::PipelineCache,
    pub debug_utils: Option<ash::ext::debug_utils::Device>,
    pub limits: vk::PhysicalDeviceLimits,
    /// Rounds of loops after which the driver ends all loops of an invocation without a word, if it does: Mesa's llvmpipe
    /// (`LP_MAX_TGSI_LOOP_ITERATIONS`, "shared between every loop").
    pub most_rounds: Option<u64>,
    /// Valid bits of the queue family's timestamps; 0 where it has none.
    pub timestamp_bits: u32,
}

impl Context {
    pub fn new(host: &Host<'_>) -> Result<Self> {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the host guarantees that its instance and physical device are alive.
        let families = unsafe {
            host.instance.get_physical_device_properties2(host.physical_device, &mut properties);
            host.instance.get_physical_device_queue_family_properties(host.physical_device)
        };
        let limits = properties.properties.limits;
        let family = families
            .get(host.queue_family as usize)
            .ok_or_else(|| Error::invalid("Host::queue_family", format!("below {}", families.len()), host.queue_family))?;
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        if !family.queue_flags.contains(wanted) {
            return Err(Error::invalid(
                "Host::queue_family",
                "a family with graphics and compute",
                format!("{:?}", family.queue_flags),
            ));
        }
        Ok(Self {
            device: host.device.clone(),
            pipeline_cache: host.pipeline_cache,
            debug_utils: host.debug_utils.cloned(),
            limits,
            most_rounds: (driver.driver_id == vk::DriverId::MESA_LLVMPIPE).then_some(65_535),
            timestamp_bits: family.timestamp_valid_bits,
        })
    }

    /// Names an object for debuggers and validation messages.
    pub fn name<T: vk::Handle>(&self, handle: T, name: &str) {
        let (Some(debug), Ok(name)) = (&self.debug_utils, CString::new(name)) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle belongs to this device; a failure only costs the name.
        if let Err(result) = unsafe { debug.set_debug_utils_object_name(&info) } {
            log::warn!("object name {name:?} was refused: {result}");
        }
    }
}

/// Turns a Vulkan result into an [`Error::Vulkan`] that names the call.
pub(crate) trait VkResultExt<T> {
    fn named(self, call: &'static str) -> Result<T>;
}

impl<T> VkResultExt<T> for ash::prelude::VkResult<T> {
    fn named(self, call: &'static str) -> Result<T> {
        self.map_err(|result| Error::Vulkan { call, result })
    }
}
