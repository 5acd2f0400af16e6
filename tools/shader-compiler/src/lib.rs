//! Compiles GLSL stage files into SPIR-V modules and keeps a manifest of them.
//!
//! **Sources.** Every `*.comp`, `*.vert` and `*.frag` under the source folder is a stage file; `include/` and `bridge/`
//! hold only includes. `glsl/<pass>.comp` becomes `<pass>.comp.spv`, `glsl/<pass>/<name>.comp` becomes
//! `<pass>_<name>.comp.spv`. `#include "…"` is looked up in the including file's folder, then in `include/`, then in the
//! bridge folder, which a host replaces to have the passes read its own G-buffer.
//!
//! **Variants.** A stage file without a `// variant:` line is one module. A file with such lines is exactly one module a
//! line: `// variant: fast TAPS=4 HALF` becomes `<pass>.fast.comp.spv` with those macros, and the name `default` stands
//! for the plain `<pass>.comp.spv`.
//!
//! **Outputs.** The output folder holds exactly the selected modules and `manifest.json`: unchanged files are not
//! touched, a `.spv` that nothing produces any more is removed. Order and bytes depend on sources and compiler only.

mod compile;
mod error;
mod manifest;
mod output;
mod source;

pub use compile::{Compiler, Module};
pub use error::{Error, Result};
pub use manifest::{CompilerVersion, Flags, Manifest, ManifestModule, read_manifest};
pub use output::{Change, ChangeKind, apply, changes};
pub use source::{Macro, Stage, StageFile, Variant, stage_files};

use std::path::{Path, PathBuf};

/// One set of modules: where it comes from and where it goes.
#[derive(Clone, Debug)]
pub struct Options {
    /// Paths in manifests and messages are relative to this folder.
    pub root: PathBuf,
    /// The passes' stage files, and their `include/`.
    pub glsl: PathBuf,
    /// Accessors through which passes read G-buffer and materials.
    pub bridge: PathBuf,
    /// A host's own stage files: all of them are compiled, with the same includes.
    pub extra: Option<PathBuf>,
    /// Passes or modules to take from `glsl` (`shade`, `shade_full`); empty takes all.
    pub only: Vec<String>,
    /// Output folder.
    pub out: PathBuf,
}

impl Options {
    /// The usual folders under `root`: `glsl`, `glsl/bridge`, `spirv`, every pass.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        let root = root.into();
        let glsl = root.join("glsl");
        Self { bridge: glsl.join("bridge"), extra: None, only: Vec::new(), out: root.join("spirv"), glsl, root }
    }

    /// Every set of a repository: its own, and one for each example host, that is each folder with
    /// `examples/<host>/bridge`. A host's set is compiled from its `bridge` and its own `glsl` (if there is one) into its
    /// `spirv`, with the passes that `passes.txt` lists, one a line, `#` for comments; without that file, all.
    ///
    /// # Errors
    /// [`Error::Read`] if a folder or a `passes.txt` cannot be read.
    pub fn of_repository(root: impl Into<PathBuf>) -> Result<Vec<Self>> {
        let own = Self::new(root);
        let mut sets = vec![own.clone()];
        let examples = own.root.join("examples");
        if !examples.is_dir() {
            return Ok(sets);
        }
        for host in source::entries(&examples)? {
            let bridge = host.join("bridge");
            if !bridge.is_dir() {
                continue;
            }
            let extra = Some(host.join("glsl")).filter(|folder| folder.is_dir());
            let only = read_passes(&host.join("passes.txt"))?;
            sets.push(Self { bridge, extra, only, out: host.join("spirv"), ..own.clone() });
        }
        Ok(sets)
    }

    /// `path` relative to the root with `/` between its parts, so that no machine's folders reach a manifest.
    pub(crate) fn label(&self, path: &Path) -> String {
        let (root, path) = (without_dots(&self.root), without_dots(path));
        let shared = root.components().zip(path.components()).take_while(|(a, b)| a == b).count();
        let up = root.components().skip(shared).map(|_| "..".into());
        let down = path.components().skip(shared).map(|part| part.as_os_str().to_string_lossy().into_owned());
        up.chain(down).collect::<Vec<_>>().join("/")
    }
}

/// `a/./b/../c` as `a/c`, so that one file has one label however it is reached.
pub(crate) fn without_dots(path: &Path) -> PathBuf {
    use std::path::Component::{CurDir, Normal, ParentDir};
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            CurDir => {}
            ParentDir if matches!(out.components().next_back(), Some(Normal(_))) => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

/// Compiles every selected stage file and variant, in the order of module names.
///
/// # Errors
/// The first wrong source, by name and line: [`Error::Shader`], [`Error::MissingInclude`], [`Error::Variant`],
/// [`Error::Duplicate`], [`Error::UnknownPass`], [`Error::NoStages`], [`Error::NotText`], [`Error::Read`].
pub fn compile_all(options: &Options) -> Result<Vec<Module>> {
    let compiler = Compiler::new()?;
    let mut modules = Vec::new();
    for file in stage_files(options)? {
        for variant in &file.variants {
            modules.push(compiler.compile(options, &file, variant)?);
        }
    }
    modules.sort_by(|a, b| a.name.cmp(&b.name));
    for pair in modules.windows(2) {
        if let [first, second] = pair
            && first.name == second.name
        {
            let (name, first, second) = (first.name.clone(), first.source.clone(), second.source.clone());
            return Err(Error::Duplicate { name, first, second });
        }
    }
    Ok(modules)
}

/// The pass names in a host's list; none if there is no list.
fn read_passes(path: &Path) -> Result<Vec<String>> {
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let names = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    Ok(names.filter(|name| !name.is_empty()).map(str::to_owned).collect())
}
