//! How often light needs to be sampled, and how an image comes out of the samples: f64 twins of what the passes do.

pub mod reconstruction;
