//! A device without a window: instance, device, queue and memory of the command's own.

use crate::gpu::allocator::PooledAllocator;
use crate::gpu::context::Host;
use crate::offline::error::{Error, Result};
use crate::{Requirements, Retired};
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Which device to open and how.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// A device's index, or part of its name; the first real GPU, else the first device, if absent.
    pub device: Option<String>,
    /// Whether the validation layer runs, with synchronization validation.
    pub validate: bool,
}

/// A device as the driver describes it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct DeviceInfo {
    /// `deviceName`.
    pub name: String,
    /// Driver name and version text.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
    /// discrete, integrated, virtual, cpu or other.
    #[serde(rename = "type")]
    pub kind: &'static str,
}

/// Validation messages of severity warning and above.
type Messages = Arc<Mutex<Vec<String>>>;

struct Instance {
    instance: ash::Instance,
    debug: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Messages,
    // The loader stays mapped as long as anything made from it.
    _entry: ash::Entry,
}

/// An open device.
pub struct Headless {
    info: DeviceInfo,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    debug_device: Option<ash::ext::debug_utils::Device>,
    queue: vk::Queue,
    family: u32,
    pool: vk::CommandPool,
    fence: vk::Fence,
    allocator: Option<Arc<Mutex<Allocator>>>,
    memory: Option<PooledAllocator>,
    instance: Instance,
}

fn vulkan(call: &'static str) -> impl Fn(vk::Result) -> Error {
    move |result| crate::Error::Vulkan { call, result }.into()
}

/// Keeps the loader and the drivers in memory with an instance that stays. Without, each device that is the last one unloads them,
/// and NVIDIA's driver cannot be loaded again after some dozens of times.
fn keep_drivers(app: &vk::ApplicationInfo<'_>) {
    static KEPT: OnceLock<Option<(ash::Entry, ash::Instance)>> = OnceLock::new();
    KEPT.get_or_init(|| {
        // SAFETY: as in `Instance::new`; the entry stays with the instance.
        unsafe {
            let entry = ash::Entry::load().ok()?;
            let instance = entry.create_instance(&vk::InstanceCreateInfo::default().application_info(app), None).ok()?;
            Some((entry, instance))
        }
    });
}

impl Instance {
    fn new(validate: bool) -> Result<Self> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, as every Vulkan program does.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| Error::Device(format!("no Vulkan loader: {e}")))?;
        let app = vk::ApplicationInfo::default().application_name(c"passband").api_version(vk::API_VERSION_1_3);
        keep_drivers(&app);
        let mut layers = Vec::new();
        let mut extensions = Vec::new();
        if validate {
            // SAFETY: the entry is loaded.
            let available =
                unsafe { entry.enumerate_instance_layer_properties() }.map_err(vulkan("vkEnumerateInstanceLayerProperties"))?;
            if !available.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION)) {
                return Err(Error::Device(
                    "--validate needs the layer VK_LAYER_KHRONOS_validation, which is not installed".into(),
                ));
            }
            layers.push(VALIDATION.as_ptr());
            extensions.push(ash::ext::debug_utils::NAME.as_ptr());
        }
        let messages = Messages::default();
        let mut messenger = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&messages).cast_mut().cast());
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validate {
            info = info.push_next(&mut features).push_next(&mut messenger);
        }
        // SAFETY: all pointers live until the call returns; `messages` outlives the instance.
        let instance = unsafe { entry.create_instance(&info, None) }
            .map_err(|e| Error::Device(format!("no Vulkan 1.3 instance could be created: {e}")))?;
        let mut this = Self { instance, debug: None, messages, _entry: entry };
        if validate {
            let debug = ash::ext::debug_utils::Instance::new(&this._entry, &this.instance);
            messenger.p_next = std::ptr::null();
            // SAFETY: the extension is enabled; the callback's data outlives the messenger.
            let handle = unsafe { debug.create_debug_utils_messenger(&messenger, None) }
                .map_err(vulkan("vkCreateDebugUtilsMessengerEXT"))?;
            this.debug = Some((debug, handle));
        }
        Ok(this)
    }

    fn devices(&self) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.instance.enumerate_physical_devices() }.map_err(vulkan("vkEnumeratePhysicalDevices"))?;
        // SAFETY: the devices are the instance's own.
        Ok(devices.into_iter().map(|d| (d, unsafe { device_info(&self.instance, d) })).collect())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: everything made from the instance is gone.
        unsafe {
            if let Some((debug, messenger)) = self.debug.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

/// Collects a message; never stops the call that caused it.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer hands over a valid message, and `user` is the `Mutex` inside the instance's `Messages`.
    unsafe {
        let messages = &*user.cast::<Mutex<Vec<String>>>();
        let text = (*data).message_as_c_str().map_or_else(String::new, |m| m.to_string_lossy().into_owned());
        messages.lock().unwrap_or_else(PoisonError::into_inner).push(text);
    }
    vk::FALSE
}

unsafe fn device_info(instance: &ash::Instance, device: vk::PhysicalDevice) -> DeviceInfo {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: as the caller promises; drivers older than Vulkan 1.2 leave the second struct as it is.
    unsafe { instance.get_physical_device_properties2(device, &mut properties) };
    let p = properties.properties;
    let text = |c: std::result::Result<&CStr, _>| {
        c.map_or_else(|_: std::ffi::FromBytesUntilNulError| String::new(), |c| c.to_string_lossy().into_owned())
    };
    let version = p.api_version;
    DeviceInfo {
        name: text(p.device_name_as_c_str()),
        driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())).trim().into(),
        api: format!("{}.{}.{}", vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version)),
        kind: match p.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            vk::PhysicalDeviceType::CPU => "cpu",
            _ => "other",
        },
    }
}

/// All devices, each held against `requirements`.
///
/// # Errors
/// [`Error::Device`] without a Vulkan loader or instance.
pub fn survey(requirements: &Requirements) -> Result<Vec<(DeviceInfo, Vec<crate::gpu::requirements::Row>)>> {
    let instance = Instance::new(false)?;
    let devices = instance.devices()?;
    // SAFETY: the devices are the instance's own.
    Ok(devices.into_iter().map(|(d, info)| (info, unsafe { requirements.rows(&instance.instance, d) })).collect())
}

fn choose(devices: Vec<(vk::PhysicalDevice, DeviceInfo)>, wanted: Option<&str>) -> Result<(vk::PhysicalDevice, DeviceInfo)> {
    let names: Vec<_> = devices.iter().map(|(_, info)| info.name.clone()).collect();
    let index = match wanted {
        Some(text) => {
            let by_number = text.parse().ok().filter(|&i: &usize| i < names.len());
            by_number.or_else(|| names.iter().position(|n| n.to_lowercase().contains(&text.to_lowercase())))
        }
        None => {
            let kinds = ["discrete", "integrated", "virtual", "other", "cpu"];
            let rank = |kind| kinds.iter().position(|&k| k == kind);
            devices.iter().enumerate().min_by_key(|(_, (_, info))| rank(info.kind)).map(|(i, _)| i)
        }
    };
    let found = index.and_then(|i| devices.into_iter().nth(i));
    found.ok_or_else(|| match wanted {
        Some(text) => Error::Device(format!("no Vulkan device matches {text:?}; there are: {}", names.join(", "))),
        None => Error::Device("no Vulkan device: install a driver (Debian: mesa-vulkan-drivers)".into()),
    })
}

impl Headless {
    /// Opens a device that meets `requirements`.
    ///
    /// # Errors
    /// [`Error::Device`] without a loader, driver or matching device, or with every requirement that the device lacks.
    pub fn new(options: &Options, requirements: &Requirements) -> Result<Self> {
        let instance = Instance::new(options.validate)?;
        let (physical_device, info) = choose(instance.devices()?, options.device.as_deref())?;
        let vk_instance = &instance.instance;
        // SAFETY: the device is the instance's own.
        unsafe { requirements.check(vk_instance, physical_device) }
            .map_err(|missing| Error::Device(format!("{}: {missing}", info.name)))?;
        // SAFETY: as above.
        let families = unsafe { vk_instance.get_physical_device_queue_family_properties(physical_device) };
        let family = (0u32..).zip(&families).find(|(_, f)| f.queue_flags.contains(requirements.queue)).map_or(0, |(i, _)| i);
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities)];
        let mut features = vk::PhysicalDeviceVulkan13Features::default();
        requirements.merge_into(&mut features);
        let create = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut features);
        // SAFETY: the requirements were checked.
        let device = unsafe { vk_instance.create_device(physical_device, &create, None) }.map_err(vulkan("vkCreateDevice"))?;
        let debug_device = options.validate.then(|| ash::ext::debug_utils::Device::new(vk_instance, &device));
        // SAFETY: the queue was asked for above.
        let queue = unsafe { device.get_device_queue(family, 0) };
        let mut this = Self {
            info,
            physical_device,
            device,
            debug_device,
            queue,
            family,
            pool: vk::CommandPool::null(),
            fence: vk::Fence::null(),
            allocator: None,
            memory: None,
            instance,
        };
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(family).flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the device is alive.
        this.pool = unsafe { this.device.create_command_pool(&pool, None) }.map_err(vulkan("vkCreateCommandPool"))?;
        // SAFETY: as above.
        this.fence =
            unsafe { this.device.create_fence(&vk::FenceCreateInfo::default(), None) }.map_err(vulkan("vkCreateFence"))?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: this.instance.instance.clone(),
            device: this.device.clone(),
            physical_device,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|e| Error::Device(format!("no memory allocator: {e}")))?;
        let allocator = Arc::new(Mutex::new(allocator));
        this.memory = Some(PooledAllocator::new(allocator.clone()));
        this.allocator = Some(allocator);
        Ok(this)
    }

    /// The device as the driver describes it.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Handles to build a renderer on.
    pub fn host(&self) -> Host<'_> {
        host(&self.instance, self.physical_device, &self.device, self.family, self.debug_device.as_ref())
    }

    /// The host's handles and its allocator at once.
    ///
    /// # Errors
    /// [`Error::Device`] after the device was closed.
    pub fn parts(&mut self) -> Result<(Host<'_>, &mut PooledAllocator)> {
        let Some(memory) = self.memory.as_mut() else { return Err(Error::Device("the device is closed".into())) };
        Ok((host(&self.instance, self.physical_device, &self.device, self.family, self.debug_device.as_ref()), memory))
    }

    /// Largest number of bytes of device memory that were allocated at once.
    pub fn peak_bytes(&self) -> u64 {
        self.memory.as_ref().map_or(0, PooledAllocator::peak_bytes)
    }

    /// Bytes of device memory that are allocated.
    pub fn live_bytes(&self) -> u64 {
        self.memory.as_ref().map_or(0, PooledAllocator::live_bytes)
    }

    /// Validation messages so far.
    pub fn messages(&self) -> Vec<String> {
        self.instance.messages.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Records commands, submits them, waits, and frees what `record` retired.
    ///
    /// # Errors
    /// What `record` returns, or a Vulkan failure.
    pub fn submit(&mut self, record: impl FnOnce(vk::CommandBuffer, &mut PooledAllocator) -> Result<Retired>) -> Result<()> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is ours and used by this thread alone.
        let cmd = unsafe { self.device.allocate_command_buffers(&info) }.map_err(vulkan("vkAllocateCommandBuffers"))?[0];
        let result = self.submit_buffer(cmd, record);
        // SAFETY: the buffer is not pending: its fence was waited for, or it was never submitted.
        unsafe { self.device.free_command_buffers(self.pool, &[cmd]) };
        result
    }

    fn submit_buffer(
        &mut self,
        cmd: vk::CommandBuffer,
        record: impl FnOnce(vk::CommandBuffer, &mut PooledAllocator) -> Result<Retired>,
    ) -> Result<()> {
        let Some(memory) = self.memory.as_mut() else { return Err(Error::Device("the device is closed".into())) };
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: a fresh command buffer.
        unsafe { self.device.begin_command_buffer(cmd, &begin) }.map_err(vulkan("vkBeginCommandBuffer"))?;
        let bag = record(cmd, memory)?;
        // SAFETY: recording was begun above; queue and fence are ours and idle.
        unsafe {
            self.device.end_command_buffer(cmd).map_err(vulkan("vkEndCommandBuffer"))?;
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(cmd)];
            let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
            self.device.queue_submit2(self.queue, &submit, self.fence).map_err(vulkan("vkQueueSubmit2"))?;
            self.device.wait_for_fences(&[self.fence], true, u64::MAX).map_err(vulkan("vkWaitForFences"))?;
            self.device.reset_fences(&[self.fence]).map_err(vulkan("vkResetFences"))?;
            bag.free(&self.device, memory);
        }
        Ok(())
    }
}

fn host<'a>(
    instance: &'a Instance,
    physical_device: vk::PhysicalDevice,
    device: &'a ash::Device,
    queue_family: u32,
    debug_utils: Option<&'a ash::ext::debug_utils::Device>,
) -> Host<'a> {
    let instance = &instance.instance;
    Host { instance, physical_device, device, queue_family, pipeline_cache: vk::PipelineCache::null(), debug_utils }
}

impl Drop for Headless {
    fn drop(&mut self) {
        // SAFETY: nothing is pending after the idle; each handle is destroyed once, memory before the device.
        unsafe {
            if let Err(error) = self.device.device_wait_idle() {
                log::error!("vkDeviceWaitIdle: {error}");
            }
            self.memory = None;
            self.allocator = None;
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
        }
    }
}
