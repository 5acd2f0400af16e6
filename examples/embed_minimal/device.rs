//! The host's own instance, device and queue; with the validation layer's messages on request.

use passband::ash::{self, vk};
use passband::{Host, Requirements};
use std::error::Error;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

type Messages = Arc<Mutex<Vec<String>>>;

/// Everything that a Vulkan program has before it draws.
pub struct Gpu {
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    pub queue: vk::Queue,
    pub family: u32,
    pub name: String,
    debug: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT, ash::ext::debug_utils::Device)>,
    messages: Messages,
    _entry: ash::Entry,
}

impl Gpu {
    /// The first device whose name contains `name`, with what the renderer requires switched on.
    pub fn new(requirements: &Requirements, name: &str, validate: bool) -> Result<Self, Box<dyn Error>> {
        let messages = Messages::default();
        let (layers, extensions) = ([VALIDATION.as_ptr()], [ash::ext::debug_utils::NAME.as_ptr()]);
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut validation = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let messenger = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&messages).cast_mut().cast());
        let app = vk::ApplicationInfo::default().api_version(requirements.api_version);
        let mut info = vk::InstanceCreateInfo::default().application_info(&app);
        if validate {
            info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut validation);
        }
        // SAFETY: all that the structs point to is alive during the calls; the messages outlive the messenger.
        unsafe {
            let entry = ash::Entry::load()?;
            let instance = entry.create_instance(&info, None)?;
            let debug_instance = ash::ext::debug_utils::Instance::new(&entry, &instance);
            let named = |d: &vk::PhysicalDevice| {
                let properties = instance.get_physical_device_properties(*d);
                properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned()
            };
            let devices = instance.enumerate_physical_devices()?;
            let physical_device = devices.into_iter().find(|d| named(d).contains(name)).ok_or("no such device")?;
            requirements.check(&instance, physical_device)?;

            let families = instance.get_physical_device_queue_family_properties(physical_device);
            let family = (0u32..).zip(families).find(|(_, f)| f.queue_flags.contains(requirements.queue));
            let family = family.ok_or("no queue family for graphics and compute")?.0;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            // A host adds its own features here: the renderer's are merged into the same struct.
            let mut features = vk::PhysicalDeviceVulkan13Features::default();
            requirements.merge_into(&mut features);
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut features);
            let device = instance.create_device(physical_device, &info, None)?;
            let debug = if validate {
                let messenger = debug_instance.create_debug_utils_messenger(&messenger, None)?;
                Some((debug_instance, messenger, ash::ext::debug_utils::Device::new(&instance, &device)))
            } else {
                None
            };
            let (queue, name) = (device.get_device_queue(family, 0), named(&physical_device));
            Ok(Self { instance, physical_device, device, queue, family, name, debug, messages, _entry: entry })
        }
    }

    /// What the renderer borrows.
    pub fn host(&self) -> Host<'_> {
        Host {
            instance: &self.instance,
            physical_device: self.physical_device,
            device: &self.device,
            queue_family: self.family,
            pipeline_cache: vk::PipelineCache::null(),
            debug_utils: self.debug.as_ref().map(|(_, _, device)| device),
        }
    }

    /// Destroys the device and returns all messages, those about leaked objects included.
    pub fn close(self) -> Vec<String> {
        let messages = self.messages.clone();
        drop(self);
        let messages = messages.lock().unwrap_or_else(PoisonError::into_inner);
        messages.clone()
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: the last use of every handle; objects made from the device were destroyed before, or are reported.
        unsafe {
            // A lost device is destroyed like any other.
            let _ = self.device.device_wait_idle();
            self.device.destroy_device(None);
            if let Some((instance, messenger, _)) = self.debug.take() {
                instance.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer hands over a valid message; `user` is the mutex of `Gpu::messages`.
    unsafe {
        let text = (*data).message_as_c_str().map_or_else(String::new, |m| m.to_string_lossy().into_owned());
        (*user.cast::<Mutex<Vec<String>>>()).lock().unwrap_or_else(PoisonError::into_inner).push(text);
    }
    vk::FALSE
}
