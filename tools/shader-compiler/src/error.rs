//! What can go wrong between a GLSL file and its module.

use std::path::PathBuf;

/// Result of every fallible call of the tool.
pub type Result<T> = std::result::Result<T, Error>;

/// Every error names the file, and the line where there is one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's own word.
        source: std::io::Error,
    },
    /// A file could not be written, renamed or removed.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's own word.
        source: std::io::Error,
    },
    /// A source is not text.
    #[error("{file}: expected UTF-8 text without NUL, got other bytes at offset {offset}")]
    NotText {
        /// The source, relative to the root.
        file: String,
        /// Byte offset of the first bad byte.
        offset: usize,
    },
    /// An include is nowhere to be found.
    #[error("{includer}: #include \"{name}\" not found; searched {searched}")]
    MissingInclude {
        /// The file that asks for it.
        includer: String,
        /// What it asks for.
        name: String,
        /// The folders that were searched, in order.
        searched: String,
    },
    /// A `// variant:` line does not parse.
    #[error("{file}:{line}: expected `// variant: name [DEFINE[=VALUE]]…`, got {got}")]
    Variant {
        /// The stage file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        got: String,
    },
    /// Two sources, or two variants, would write one module.
    #[error("module {name} would come from {first} and from {second}")]
    Duplicate {
        /// The module.
        name: String,
        /// Where it comes from first.
        first: String,
        /// Where it comes from again.
        second: String,
    },
    /// A selected pass does not exist.
    #[error("only: expected one of {known}, got {name}")]
    UnknownPass {
        /// The name that was asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// A folder holds nothing to compile.
    #[error("{}: expected stage files (.comp, .vert, .frag), got none", folder.display())]
    NoStages {
        /// The folder.
        folder: PathBuf,
    },
    /// The GLSL is wrong; the messages carry `file:line`.
    #[error("{name} does not compile:\n{messages}")]
    Shader {
        /// The module.
        name: String,
        /// The compiler's messages.
        messages: String,
    },
    /// The compiler itself did not start.
    #[error("the shader compiler does not start: {0}")]
    Compiler(String),
    /// A manifest does not parse or could not be built.
    #[error("{}: {reason}", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// Why it was refused.
        reason: String,
    },
}
