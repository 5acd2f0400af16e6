//! `passband bench` in a folder of its own.
#![allow(dead_code, reason = "each test file uses its part")]

use crate::chosen_device::DEVICE;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of the test's own, in which the command runs and keeps its references.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(test: &str) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench").join(test);
        if path.exists() {
            std::fs::remove_dir_all(&path).unwrap();
        }
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().unwrap()
    }

    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_passband"));
        command.arg("bench").args(args).args(["--device", DEVICE]).current_dir(&self.0);
        // Caches of every system are under these.
        command.env("XDG_CACHE_HOME", self.0.join("cache")).env("HOME", &self.0);
        command
    }

    /// What a silent and successful run printed, and its JSON.
    pub fn json(&self, args: &[&str]) -> (String, Value) {
        let output = self.run(&[args, &["--json", "bench.json"]].concat());
        assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
        let json = serde_json::from_slice(&std::fs::read(self.0.join("bench.json")).unwrap()).unwrap();
        (String::from_utf8(output.stdout).unwrap(), json)
    }

    /// Files in the cache of a kind.
    pub fn kept(&self, kind: &str) -> Vec<PathBuf> {
        let folder = self.0.join("cache").join("passband").join(kind);
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect()
    }
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}
