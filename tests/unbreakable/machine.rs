//! What is wrong with the machine: a full disk, a folder that takes no files, no driver, too little of one.

use crate::run::Row;
use crate::seeds::seed;
use std::path::{Path, PathBuf};
use std::process::Command;

const RENDER: &str = "render furnace --device llvmpipe --size 64x64 --samples 4 -o";

/// Files of more than some kilobytes cannot be written; the signal that says so is ignored, like a full disk's is.
const FULL: &str = "trap '' XFSZ\nulimit -f 4";

/// The driver of `lesser_driver.rs` over the one that the tests use, built once a run.
fn lesser_driver() -> (String, String) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("unbreakable").join("lesser-driver");
    std::fs::create_dir_all(&folder).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/unbreakable/lesser_driver.rs");
    let library = folder.join("lesser.so");
    let compiler = std::env::var("RUSTC").unwrap_or("rustc".into());
    let arguments = ["--edition", "2024", "--crate-type", "cdylib", "-o"];
    assert!(Command::new(compiler).args(arguments).arg(&library).arg(source).status().unwrap().success());
    let manifest = folder.join("lesser.json");
    let text = serde_json::json!({ "file_format_version": "1.0.0", "ICD": { "library_path": library, "api_version": "1.3.0" } });
    std::fs::write(&manifest, text.to_string()).unwrap();
    (manifest.to_str().unwrap().into(), real_driver())
}

/// The library of the software driver.
fn real_driver() -> String {
    let folders = ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let mut files =
        folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten().map(|entry| entry.path());
    let is_software = |path: &PathBuf| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("lvp_icd"));
    let manifest = files.find(is_software).expect("lavapipe's manifest");
    let text: serde_json::Value = serde_json::from_slice(&std::fs::read(manifest).unwrap()).unwrap();
    text["ICD"]["library_path"].as_str().unwrap().to_string()
}

pub fn rows() -> Vec<Row> {
    let render = |what: &str, output: &str| Row::new(what, &format!("{RENDER} {output}")).on_a_device();
    let (lesser, real) = lesser_driver();
    let lacking = |what: &str, args: &str| {
        let row = Row::new(what, args).on_a_device().variable("LESSER_DRIVER_OF", real.clone());
        row.variable("VK_ICD_FILENAMES", lesser.clone()).variable("VK_DRIVER_FILES", lesser.clone())
    };
    let whole = seed("png/rgba8.png");
    vec![
        render("a full disk under an EXR", "x.exr").shell(FULL).says(&["cannot write x.exr"]),
        render("a full disk under an HDR", "x.hdr").shell(FULL).says(&["cannot write x.hdr"]),
        Row::new("a full disk under a plot", "material rough -o x.png").shell(FULL).says(&["cannot write x.png"]).on_a_device(),
        Row::new("a full disk under standard output", "scenes").shell("exec >/dev/full").says(&["cannot write standard output"]),
        Row::new("a full disk under a comparison", "compare a.png a.png")
            .file("a.png", whole.clone())
            .shell("exec >/dev/full")
            .says(&["cannot write standard output"]),
        render("a device as the output", "/dev/full").says(&["--output: expected a name that ends in"]),
        render("a link to a full device", "x.exr").link("x.exr", "/dev/full").says(&["cannot write x.exr", "not a regular file"]),
        render("a folder that takes no files", "/proc/x.exr").says(&["cannot write /proc/x.exr"]),
        render("a read-only file system", "/sys/x.png").says(&["cannot write /sys/x.png"]),
        render("a folder that is not there", "gone/x.exr").says(&["cannot write gone/x.exr"]),
        render("a file in the place of a folder", "file/x.exr").file("file", "").says(&["cannot write file/x.exr"]),
        render("a folder in the place of the output", "x.exr").folder("x.exr").says(&["cannot write x.exr"]),
        render("statistics that cannot be written", "x.exr --stats /proc/x.json").says(&["cannot write /proc/x.json"]),
        Row::new("a difference that cannot be written", "compare a.png a.png --diff gone/x.png")
            .file("a.png", whole)
            .says(&["cannot write gone/x.png"]),
        Row::new("a plot that cannot be written", "material rough -o gone/x.png").says(&["cannot write gone/x.png"]),
        Row::new("no driver", "render furnace").codes(&[3]),
        Row::new("no driver to tell of", "info").codes(&[3]),
        Row::new("a driver's manifest that is none", "render furnace")
            .file("bad.json", "{")
            .codes(&[3])
            .variable("VK_ICD_FILENAMES", "bad.json")
            .variable("VK_DRIVER_FILES", "bad.json"),
        lacking("a driver without a required feature", "render furnace")
            .codes(&[3])
            .says(&["dynamicRendering must be true, is false"]),
        lacking("a driver without a required feature is told of", "info").codes(&[0]),
        Row::new("an image beyond the device's limits", "render furnace --size 16384x16384 --device llvmpipe")
            .on_a_device()
            .codes(&[3])
            .says(&["maxStorageBufferRange must be at least"]),
        Row::new("a device that is not there", "render furnace --device 99").on_a_device().codes(&[3]).says(&["99"]),
    ]
}
