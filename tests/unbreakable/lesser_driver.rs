//! A Vulkan driver that lacks a feature: another driver, named by `LESSER_DRIVER_OF`, with `dynamicRendering` taken away.
//! The table builds it; by hand, on Debian:
//!
//!     rustc --edition 2024 --crate-type cdylib -o lesser.so tests/unbreakable/lesser_driver.rs
//!     echo '{"file_format_version":"1.0.0","ICD":{"library_path":"./lesser.so","api_version":"1.3.0"}}' > lesser.json
//!     export LESSER_DRIVER_OF=libvulkan_lvp.so VK_ICD_FILENAMES=lesser.json VK_DRIVER_FILES=lesser.json
//!     passband info; passband render trio

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::sync::OnceLock;

#[link(name = "dl")]
unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

type Lookup = unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void;
type Features = unsafe extern "C" fn(*mut c_void, *mut Chained);

/// The start of every structure that can be chained.
#[repr(C)]
struct Chained {
    kind: u32,
    next: *mut Chained,
}

/// `VkPhysicalDeviceVulkan13Features`: its `VkBool32`s begin behind the chain, `dynamicRendering` is the thirteenth.
const VULKAN_1_3_FEATURES: u32 = 53;
const DYNAMIC_RENDERING: usize = 12;

static REAL_FEATURES: OnceLock<Features> = OnceLock::new();

/// An entry point of the real driver.
fn real(name: &CStr) -> *mut c_void {
    static LIBRARY: OnceLock<usize> = OnceLock::new();
    let library = *LIBRARY.get_or_init(|| {
        let path = CString::new(std::env::var("LESSER_DRIVER_OF").unwrap_or_default()).unwrap_or_default();
        const RTLD_NOW: c_int = 2;
        // SAFETY: a driver may be loaded at any time.
        unsafe { dlopen(path.as_ptr(), RTLD_NOW) as usize }
    });
    // SAFETY: a library, or none, in which nothing is found.
    if library == 0 { std::ptr::null_mut() } else { unsafe { dlsym(library as *mut c_void, name.as_ptr()) } }
}

unsafe extern "C" fn features(device: *mut c_void, all: *mut Chained) {
    let Some(real) = REAL_FEATURES.get() else { return };
    // SAFETY: the caller's arguments, and structures as Vulkan 1.3 defines them.
    unsafe {
        real(device, all);
        let mut at = all;
        while !at.is_null() {
            if (*at).kind == VULKAN_1_3_FEATURES {
                at.add(1).cast::<u32>().add(DYNAMIC_RENDERING).write(0);
            }
            at = (*at).next;
        }
    }
}

/// The loader's way to every function of the driver.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vk_icdGetInstanceProcAddr(instance: *mut c_void, name: *const c_char) -> *mut c_void {
    let lookup = real(c"vk_icdGetInstanceProcAddr");
    if lookup.is_null() {
        return std::ptr::null_mut();
    }
    // SAFETY: the driver's function of this name has this type.
    let found = unsafe { std::mem::transmute::<*mut c_void, Lookup>(lookup)(instance, name) };
    // SAFETY: the loader passes a name.
    let wanted = unsafe { CStr::from_ptr(name) };
    if !found.is_null() && (wanted == c"vkGetPhysicalDeviceFeatures2" || wanted == c"vkGetPhysicalDeviceFeatures2KHR") {
        // SAFETY: the functions of these names have this type.
        REAL_FEATURES.get_or_init(|| unsafe { std::mem::transmute::<*mut c_void, Features>(found) });
        return features as Features as *mut c_void;
    }
    found
}

/// Which of the loader's interfaces the driver speaks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vk_icdNegotiateLoaderICDInterfaceVersion(version: *mut u32) -> i32 {
    let negotiate = real(c"vk_icdNegotiateLoaderICDInterfaceVersion");
    const INCOMPATIBLE_DRIVER: i32 = -9;
    if negotiate.is_null() {
        return INCOMPATIBLE_DRIVER;
    }
    // SAFETY: the driver's function of this name has this type.
    unsafe { std::mem::transmute::<*mut c_void, unsafe extern "C" fn(*mut u32) -> i32>(negotiate)(version) }
}
