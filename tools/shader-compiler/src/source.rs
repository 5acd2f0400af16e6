//! Finds stage files, reads their text and their `// variant:` lines.

use crate::{Error, Options, Result};
use std::path::{Path, PathBuf};

/// Shader stage, told by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// `.comp`
    Compute,
    /// `.vert`
    Vertex,
    /// `.frag`
    Fragment,
}

impl Stage {
    /// The stage of a file with this extension, if it is one.
    pub fn from_extension(extension: &str) -> Option<Self> {
        [Self::Compute, Self::Vertex, Self::Fragment].into_iter().find(|stage| stage.extension() == extension)
    }

    /// `comp`, `vert` or `frag`.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Compute => "comp",
            Self::Vertex => "vert",
            Self::Fragment => "frag",
        }
    }
}

/// A preprocessor macro.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Macro {
    /// Identifier.
    pub name: String,
    /// Replacement, if any.
    pub value: Option<String>,
}

impl std::fmt::Display for Macro {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.value {
            Some(value) => write!(f, "{}={value}", self.name),
            None => f.write_str(&self.name),
        }
    }
}

/// One module of a stage file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant {
    /// Name between stem and stage in the module's name; `None` for the plain module.
    pub name: Option<String>,
    /// Macros, in the order of the line.
    pub macros: Vec<Macro>,
}

/// A stage file and the modules that it stands for.
#[derive(Clone, Debug)]
pub struct StageFile {
    /// Where it is.
    pub path: PathBuf,
    /// Where it is, relative to the root, with `/`.
    pub label: String,
    /// `<pass>` or `<pass>_<name>`.
    pub stem: String,
    /// First part of its path: what `only` selects by.
    pub pass: String,
    /// Its stage.
    pub stage: Stage,
    /// Its text.
    pub text: String,
    /// At least one.
    pub variants: Vec<Variant>,
}

impl StageFile {
    /// Module name of a variant, as in `shade_full.fast.comp`; the file adds `.spv`.
    pub fn module_name(&self, variant: &Variant) -> String {
        match &variant.name {
            Some(name) => format!("{}.{name}.{}", self.stem, self.stage.extension()),
            None => format!("{}.{}", self.stem, self.stage.extension()),
        }
    }
}

/// The selected stage files of `options`, in the order of their paths.
///
/// # Errors
/// [`Error::Read`], [`Error::NotText`], [`Error::Variant`]; [`Error::NoStages`] if there is nothing to compile;
/// [`Error::UnknownPass`] if `only` names what does not exist.
pub fn stage_files(options: &Options) -> Result<Vec<StageFile>> {
    let all = stage_files_in(options, &options.glsl)?;
    if all.is_empty() {
        return Err(Error::NoStages { folder: options.glsl.clone() });
    }
    for name in &options.only {
        if !all.iter().any(|file| selects(name, file)) {
            let mut known: Vec<_> = all.iter().map(|file| file.pass.as_str()).collect();
            known.dedup();
            return Err(Error::UnknownPass { name: name.clone(), known: known.join(", ") });
        }
    }
    let wanted = |file: &StageFile| options.only.is_empty() || options.only.iter().any(|name| selects(name, file));
    let mut files: Vec<_> = all.into_iter().filter(wanted).collect();
    if let Some(extra) = &options.extra {
        files.extend(stage_files_in(options, extra)?);
    }
    Ok(files)
}

fn selects(name: &str, file: &StageFile) -> bool {
    name == file.pass || name == file.stem
}

/// Every stage file under `folder`, except in `include` and `bridge`.
fn stage_files_in(options: &Options, folder: &Path) -> Result<Vec<StageFile>> {
    let mut files = Vec::new();
    let mut folders = vec![(folder.to_path_buf(), Vec::<String>::new())];
    while let Some((folder, names)) = folders.pop() {
        for path in entries(&folder)? {
            let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
            let mut names = names.clone();
            if path.is_dir() {
                if !(names.is_empty() && (stem == "include" || stem == "bridge")) {
                    names.push(stem);
                    folders.push((path, names));
                }
                continue;
            }
            let extension = path.extension().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
            let Some(stage) = Stage::from_extension(&extension) else { continue };
            names.push(stem);
            let label = options.label(&path);
            let text = read_text(&path, &label)?;
            let variants = variants(&text, &label)?;
            let pass = names.first().cloned().unwrap_or_default();
            files.push(StageFile { path, label, stem: names.join("_"), pass, stage, text, variants });
        }
    }
    files.sort_by(|a, b| a.label.cmp(&b.label));
    Ok(files)
}

/// Paths in a folder, sorted.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let read = |source| Error::Read { path: folder.into(), source };
    let listed = std::fs::read_dir(folder).map_err(read)?;
    let mut paths = listed.map(|entry| Ok(entry.map_err(read)?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

/// A source as text; the compiler's C interface takes no NUL.
pub(crate) fn read_text(path: &Path, label: &str) -> Result<String> {
    let bytes = std::fs::read(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let not_text = |offset| Error::NotText { file: label.to_owned(), offset };
    if let Some(offset) = bytes.iter().position(|&byte| byte == 0) {
        return Err(not_text(offset));
    }
    String::from_utf8(bytes).map_err(|e| not_text(e.utf8_error().valid_up_to()))
}

/// The variants that a stage file's text asks for; one plain one if it asks for none.
fn variants(text: &str, label: &str) -> Result<Vec<Variant>> {
    let mut found: Vec<Variant> = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let Some(comment) = line.trim_start().strip_prefix("//") else { continue };
        let Some(words) = comment.trim_start().strip_prefix("variant:") else { continue };
        let wrong = |got: String| Error::Variant { file: label.to_owned(), line: index + 1, got };
        let mut words = words.split_whitespace();
        let name = words.next().ok_or_else(|| wrong("no name".into()))?;
        if !is_identifier(name) {
            return Err(wrong(format!("the name `{name}`")));
        }
        let name = Some(name.to_owned()).filter(|name| name != "default");
        if found.iter().any(|variant| variant.name == name) {
            return Err(wrong("a name that was used before".into()));
        }
        let macros = words.map(|word| parse_macro(word).ok_or_else(|| wrong(format!("the macro `{word}`"))));
        found.push(Variant { name, macros: macros.collect::<Result<_>>()? });
    }
    if found.is_empty() {
        found.push(Variant { name: None, macros: Vec::new() });
    }
    Ok(found)
}

fn parse_macro(word: &str) -> Option<Macro> {
    let (name, value) = match word.split_once('=') {
        Some((name, value)) => (name, Some(value.to_owned())),
        None => (word, None),
    };
    is_identifier(name).then(|| Macro { name: name.to_owned(), value })
}

fn is_identifier(word: &str) -> bool {
    let ok = |c: char| c.is_ascii_alphanumeric() || c == '_';
    !word.is_empty() && word.chars().all(ok) && !word.starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_variant_lines_is_one_plain_module() {
        let plain = variants("#version 460\n// variants are good\nvoid main() {}\n", "a.comp").unwrap();
        assert_eq!(plain, [Variant { name: None, macros: Vec::new() }]);
    }

    #[test]
    fn variant_lines_name_modules_and_macros() {
        let two = variants("// variant: default\n//variant: fast TAPS=4 HALF\n", "a.comp").unwrap();
        let taps = Macro { name: "TAPS".into(), value: Some("4".into()) };
        let half = Macro { name: "HALF".into(), value: None };
        assert_eq!(two[0], Variant { name: None, macros: Vec::new() });
        assert_eq!(two[1], Variant { name: Some("fast".into()), macros: vec![taps, half] });
    }

    #[test]
    fn wrong_variant_lines_name_file_and_line() {
        for bad in ["// variant:", "// variant: a-b", "// variant: a 1X=2", "// variant: b\n// variant: b"] {
            let error = variants(&format!("\n{bad}"), "a.comp").unwrap_err().to_string();
            let line = 1 + bad.lines().count();
            assert!(error.starts_with(&format!("a.comp:{line}: expected")), "{error}");
        }
    }
}
