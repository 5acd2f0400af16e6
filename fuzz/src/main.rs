//! One loader under libFuzzer. `PASSBAND_FUZZ_LOADER` picks it, `PASSBAND_FUZZ_FOLDER` is an empty folder for its files;
//! `scripts/fuzz` sets both. A panic, a result that contradicts itself, and memory out of proportion to the input are findings;
//! time and the whole process's memory are libFuzzer's own (`-timeout`, `-rss_limit_mb`).
#![no_main]

mod loaders;
mod memory;
mod seeds;

use libfuzzer_sys::fuzz_target;
use loaders::{LOADERS, Loader};
use std::path::PathBuf;
use std::sync::OnceLock;

/// What any input may cost: a table of MERL resolution, a mebibyte of unpacked text with its mesh.
const ALWAYS_ALLOWED: usize = 64 << 20;

static CHOICE: OnceLock<(&Loader, PathBuf)> = OnceLock::new();

fn choice() -> &'static (&'static Loader, PathBuf) {
    CHOICE.get_or_init(|| {
        let wanted = std::env::var("PASSBAND_FUZZ_LOADER").unwrap_or_default();
        let folder = std::env::var_os("PASSBAND_FUZZ_FOLDER").map(PathBuf::from);
        // Here, as a program that is counted but has no fuzzer does not link.
        if let ("seeds", Some(corpus)) = (wanted.as_str(), &folder) {
            let written = seeds::write(corpus);
            std::process::exit(written.map_or_else(
                |e| {
                    eprintln!("{}: {e}", corpus.display());
                    1
                },
                |()| 0,
            ));
        }
        let (Some(loader), Some(folder)) = (LOADERS.iter().find(|l| l.name == wanted), folder) else {
            let names: Vec<_> = LOADERS.iter().map(|l| l.name).collect();
            eprintln!("PASSBAND_FUZZ_LOADER: expected one of {}, got `{wanted}`, with PASSBAND_FUZZ_FOLDER", names.join(" "));
            std::process::exit(2);
        };
        (loader, folder)
    })
}

fuzz_target!(
    init: {
        // libFuzzer's hook ends the process at every panic, those that a loader catches and turns into an error included.
        // Without it, what a loader lets through is printed and ends the process at the boundary to libFuzzer.
        let _ = std::panic::take_hook();
        let (loader, folder) = choice();
        (loader.prepare)(folder);
    },
    |data: &[u8]| {
        let (loader, folder) = choice();
        let peak = memory::peak(|| (loader.run)(&folder.join(loader.file), data));
        let most = ALWAYS_ALLOWED + loader.growth * data.len();
        assert!(peak <= most, "{peak} bytes of memory for {} bytes of input, expected at most {most}", data.len());
    }
);
