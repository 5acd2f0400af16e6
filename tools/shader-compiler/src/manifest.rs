//! `manifest.json`: what every committed module was made from, and by which compiler.

use crate::{Error, Module, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Version of the manifest's own layout.
const SCHEMA: u32 = 1;

/// What tells one compiler from another. The library has no version query, so the words of a fixed probe shader stand
/// in for one; the other fields are for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompilerVersion {
    /// `shaderc`.
    pub name: String,
    /// SPIR-V version and revision that the library knows.
    pub spirv_support: String,
    /// Generator word of the modules: tool and its version, as registered with Khronos.
    pub generator: String,
    /// SHA-256 of the compiled probe shader.
    pub probe_sha256: String,
}

impl CompilerVersion {
    pub(crate) fn of_probe((version, revision): (u32, u32), words: &[u32]) -> Self {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Self {
            name: "shaderc".into(),
            spirv_support: format!("{}.{} revision {revision}", (version >> 16) & 0xff, (version >> 8) & 0xff),
            generator: format!("{:#010x}", words.get(2).copied().unwrap_or_default()),
            probe_sha256: sha256(&bytes),
        }
    }
}

/// The one set of flags that every module is compiled with.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flags {
    /// Vulkan version that the module may ask for.
    pub target_env: String,
    /// SPIR-V version of the module.
    pub spirv: String,
    /// Optimisation level.
    pub optimization: String,
    /// Whether names and lines are kept.
    pub debug_info: bool,
}

impl Default for Flags {
    fn default() -> Self {
        let text = str::to_owned;
        Self { target_env: text("vulkan1.2"), spirv: text("1.5"), optimization: text("performance"), debug_info: false }
    }
}

/// One module's row.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestModule {
    /// Module name; the file adds `.spv`.
    pub name: String,
    /// Stage file, relative to the repository.
    pub source: String,
    /// Includes, relative to the repository.
    pub includes: Vec<String>,
    /// Macros, `NAME` or `NAME=VALUE`.
    pub macros: Vec<String>,
    /// SHA-256 over the names and texts of source and includes.
    pub source_sha256: String,
    /// SHA-256 of the module's file.
    pub spirv_sha256: String,
}

impl ManifestModule {
    /// The row of a compiled module.
    pub fn of(module: &Module) -> Self {
        Self {
            name: module.name.clone(),
            source: module.source.clone(),
            includes: module.includes.clone(),
            macros: module.macros.iter().map(ToString::to_string).collect(),
            source_sha256: module.source_sha256.clone(),
            spirv_sha256: sha256(&module.bytes()),
        }
    }
}

/// The whole manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this layout.
    pub schema: u32,
    /// Compiler of all modules.
    pub compiler: CompilerVersion,
    /// Flags of all modules.
    pub flags: Flags,
    /// Rows, sorted by name.
    pub modules: Vec<ManifestModule>,
}

impl Manifest {
    /// The manifest of compiled modules.
    pub fn of(compiler: CompilerVersion, modules: &[Module]) -> Self {
        Self { schema: SCHEMA, compiler, flags: Flags::default(), modules: modules.iter().map(ManifestModule::of).collect() }
    }

    /// The file's bytes: pretty JSON with a final newline.
    pub(crate) fn bytes(&self, path: &Path) -> Result<Vec<u8>> {
        let text = serde_json::to_string_pretty(self);
        let text = text.map_err(|e| Error::Manifest { path: path.into(), reason: e.to_string() })?;
        Ok(format!("{text}\n").into_bytes())
    }
}

/// Reads `manifest.json` in an output folder.
///
/// # Errors
/// [`Error::Read`], or [`Error::Manifest`] with line and column if it does not parse or has another schema.
pub fn read_manifest(folder: &Path) -> Result<Manifest> {
    let path = folder.join("manifest.json");
    let bytes = std::fs::read(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
    let manifest: Manifest =
        serde_json::from_slice(&bytes).map_err(|e| Error::Manifest { path: path.clone(), reason: e.to_string() })?;
    if manifest.schema != SCHEMA {
        return Err(Error::Manifest { path, reason: format!("schema: expected {SCHEMA}, got {}", manifest.schema) });
    }
    Ok(manifest)
}

/// Hash over names and texts; lengths go in so that no two lists of files read alike.
pub(crate) fn sha256_of_sources<'a>(files: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let mut hash = Sha256::new();
    for (name, text) in files {
        for part in [name, text] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        }
    }
    hex(&hash.finalize())
}

fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
