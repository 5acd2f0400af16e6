//! One stage file and one set of macros to one module, with the `shaderc` crate.

use crate::source::read_text;
use crate::{CompilerVersion, Error, Macro, Options, Result, Stage, StageFile, Variant, manifest};
use shaderc::{CompileOptions, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A compiled module and all that went into it.
#[derive(Clone, Debug)]
pub struct Module {
    /// `<stem>[.<variant>].<stage>`, as in `shade_full.comp`.
    pub name: String,
    /// Its stage.
    pub stage: Stage,
    /// Stage file, relative to the root.
    pub source: String,
    /// Files that it includes, directly or not, relative to the root, sorted.
    pub includes: Vec<String>,
    /// Macros of its variant.
    pub macros: Vec<Macro>,
    /// SHA-256 over the names and texts of source and includes.
    pub source_sha256: String,
    /// SPIR-V 1.5, host order.
    pub spirv: Vec<u32>,
    /// The compiler's warnings, empty if there are none.
    pub warnings: String,
}

impl Module {
    /// File name in the output folder.
    pub fn file_name(&self) -> String {
        format!("{}.spv", self.name)
    }

    /// The module as a file holds it: little-endian words.
    pub fn bytes(&self) -> Vec<u8> {
        self.spirv.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// Files that one compilation pulled in, and the first include that was nowhere.
#[derive(Default)]
struct Included {
    /// Label to path and text.
    files: BTreeMap<String, (PathBuf, String)>,
    error: Option<Error>,
}

/// The compiler, started once.
pub struct Compiler {
    inner: shaderc::Compiler,
}

impl Compiler {
    /// Starts the compiler.
    ///
    /// # Errors
    /// [`Error::Compiler`] if the library refuses.
    pub fn new() -> Result<Self> {
        shaderc::Compiler::new().map(|inner| Self { inner }).map_err(|e| Error::Compiler(e.to_string()))
    }

    /// What identifies this compiler's output: see [`CompilerVersion`].
    ///
    /// # Errors
    /// [`Error::Compiler`] if the probe shader does not compile.
    pub fn version(&self) -> Result<CompilerVersion> {
        let probe = include_str!("probe.comp");
        let options = self.options(&[])?;
        let artifact = self
            .inner
            .compile_into_spirv(probe, ShaderKind::Compute, "probe.comp", "main", Some(&options))
            .map_err(|e| Error::Compiler(e.to_string()))?;
        Ok(CompilerVersion::of_probe(shaderc::get_spirv_version(), artifact.as_binary()))
    }

    /// Compiles one variant of a stage file.
    ///
    /// # Errors
    /// [`Error::Shader`] with the compiler's messages, [`Error::MissingInclude`], or [`Error::NotText`] and
    /// [`Error::Read`] for an include.
    pub fn compile(&self, options: &Options, file: &StageFile, variant: &Variant) -> Result<Module> {
        let name = file.module_name(variant);
        let included = RefCell::new(Included::default());
        let mut flags = self.options(&variant.macros)?;
        flags.set_include_callback(|wanted, _, includer, _| {
            let folder = match included.borrow().files.get(includer) {
                Some((path, _)) => path.parent(),
                None => file.path.parent(),
            }
            .map(Path::to_path_buf)
            .unwrap_or_default();
            resolve(options, &folder, includer, wanted, &included)
        });
        let kind = match file.stage {
            Stage::Compute => ShaderKind::Compute,
            Stage::Vertex => ShaderKind::Vertex,
            Stage::Fragment => ShaderKind::Fragment,
        };
        let result = self.inner.compile_into_spirv(&file.text, kind, &file.label, "main", Some(&flags));
        drop(flags);
        let Included { files, error } = included.into_inner();
        if let Some(error) = error {
            return Err(error);
        }
        let artifact = result.map_err(|e| {
            let messages = match e {
                shaderc::Error::CompilationError(_, messages) => messages.trim_end().to_owned(),
                other => other.to_string(),
            };
            Error::Shader { name: name.clone(), messages }
        })?;
        let texts = files.iter().map(|(label, (_, text))| (label.as_str(), text.as_str()));
        Ok(Module {
            source_sha256: manifest::sha256_of_sources(std::iter::once((file.label.as_str(), file.text.as_str())).chain(texts)),
            name,
            stage: file.stage,
            source: file.label.clone(),
            includes: files.keys().cloned().collect(),
            macros: variant.macros.clone(),
            spirv: artifact.as_binary().to_vec(),
            warnings: artifact.get_warning_messages().trim_end().to_owned(),
        })
    }

    /// The one set of flags: [`crate::Flags`] spells it out in the manifest.
    fn options<'a>(&self, macros: &[Macro]) -> Result<CompileOptions<'a>> {
        let mut options = CompileOptions::new().map_err(|e| Error::Compiler(e.to_string()))?;
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
        options.set_target_spirv(SpirvVersion::V1_5);
        options.set_optimization_level(OptimizationLevel::Performance);
        for define in macros {
            options.add_macro_definition(&define.name, define.value.as_deref());
        }
        Ok(options)
    }
}

/// Finds an include and remembers it; the error text is only for the compiler, the typed error is kept aside.
fn resolve(
    options: &Options,
    folder: &Path,
    includer: &str,
    wanted: &str,
    included: &RefCell<Included>,
) -> std::result::Result<ResolvedInclude, String> {
    let folders = [folder.to_path_buf(), options.glsl.join("include"), options.bridge.clone()];
    let mut included = included.borrow_mut();
    let found = folders.iter().map(|folder| folder.join(wanted)).find(|path| path.is_file());
    let Some(path) = found else {
        let searched = folders.iter().map(|folder| options.label(folder)).collect::<Vec<_>>().join(", ");
        let error = Error::MissingInclude { includer: includer.to_owned(), name: wanted.to_owned(), searched };
        let message = error.to_string();
        included.error.get_or_insert(error);
        return Err(message);
    };
    let path = crate::without_dots(&path);
    let label = options.label(&path);
    let content = read_text(&path, &label).map_err(|error| {
        let message = error.to_string();
        included.error.get_or_insert(error);
        message
    })?;
    included.files.insert(label.clone(), (path, content.clone()));
    Ok(ResolvedInclude { resolved_name: label, content })
}
