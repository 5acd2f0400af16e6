//! Small valid files of every kind: the corpus from which fuzzing starts (`scripts/fuzz`).

use std::path::Path;

pub fn seed(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// `seed` as text with `from` replaced, which must be there.
pub fn edited(name: &str, from: &str, to: &str) -> Vec<u8> {
    let text = String::from_utf8(seed(name)).unwrap();
    assert!(text.contains(from), "`{from}` is not in {name}");
    text.replacen(from, to, 1).into_bytes()
}

/// `seed` with the bytes at `at` replaced.
pub fn patched(name: &str, at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut all = seed(name);
    all[at..at + bytes.len()].copy_from_slice(bytes);
    all
}

/// Where `what` begins in a seed.
pub fn place(name: &str, what: &[u8]) -> usize {
    let all = seed(name);
    all.windows(what.len()).position(|w| w == what).unwrap_or_else(|| panic!("{what:?} is not in {name}"))
}

const CAMERA: &str = "[camera]\nposition = [0, 0, 3]\n";
pub const GREY: &str = "[materials.a]\nreflectance = { ggx = { alpha = 0.5, f0 = 0.04, albedo = 0.2 } }\n";

/// A scene that shows a mesh file.
pub fn shows(mesh: &str) -> String {
    format!("{CAMERA}[[objects]]\nmesh = '{mesh}'\nmaterial = 'a'\n{GREY}")
}

/// A scene that shows a glTF file with its own materials.
pub fn shows_whole(mesh: &str) -> String {
    format!("{CAMERA}[[objects]]\nmesh = '{mesh}'\n")
}

/// A scene under an environment map.
pub fn under(map: &str) -> String {
    format!("{CAMERA}[environment]\nmap = '{map}'\n[[objects]]\nbuiltin = 'plane'\nmaterial = 'a'\n{GREY}")
}

/// A scene with a reflectance.
pub fn made_of(reflectance: &str) -> String {
    format!("{CAMERA}[[objects]]\nbuiltin = 'plane'\nmaterial = 'a'\n[materials.a]\nreflectance = {{ {reflectance} }}\n")
}
