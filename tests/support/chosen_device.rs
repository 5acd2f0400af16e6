//! The device that tests run on.

/// Part of its name: the reference device's, or what `PASSBAND_DEVICE` was when the tests were built.
pub const DEVICE: &str = match option_env!("PASSBAND_DEVICE") {
    Some(name) => name,
    None => "llvmpipe",
};
