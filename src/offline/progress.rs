//! How long work is told of.

/// One step of a run: what, and how many parts of how many are done.
pub type Progress<'a> = dyn FnMut(&str, u64, u64) + 'a;
