//! Devices on which tests run: lavapipe unless chosen otherwise, always under validation with synchronization validation.
#![allow(dead_code, reason = "each test file uses a part")]

#[path = "../../examples/embed_minimal.rs"]
pub mod embed_minimal;
pub mod rig;

pub use crate::chosen_device::DEVICE;
pub(crate) use embed_minimal::{device, memory};
use passband::offline::headless::{Headless, Options};
use passband::{Config, Requirements};

/// Fails on any validation message.
#[track_caller]
pub fn assert_clean(messages: &[String]) {
    assert!(messages.is_empty(), "{} validation messages:\n{}", messages.len(), messages.join("\n"));
}

/// The command's own headless device, validated. Hold its `messages` against [`assert_clean`] at the end.
pub fn headless(config: &Config) -> Headless {
    let options = Options { device: Some(DEVICE.into()), validate: true };
    let headless = Headless::new(&options, &Requirements::of(config)).unwrap();
    assert!(headless.info().name.contains(DEVICE), "{:?}", headless.info());
    headless
}
