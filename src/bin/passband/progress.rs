//! The bar that long work has on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// One bar for all steps of a run.
pub struct Bar(ProgressBar);

impl Bar {
    /// Drawn from the first step on.
    pub fn new() -> Self {
        let style = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len} {eta}");
        Self(ProgressBar::new(1).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())))
    }

    /// How many of how many parts of a step are done.
    pub fn tell(&self, what: &str, done: u64, total: u64) {
        if self.0.message() != what {
            // The time left is of each step alone.
            self.0.reset_eta();
            self.0.set_message(what.to_string());
        }
        self.0.set_length(total);
        self.0.set_position(done);
    }

    /// Leaves the terminal to results.
    pub fn clear(&self) {
        self.0.finish_and_clear();
    }
}
