//! Errors of files and commands: what was wrong, where, and what would be right, on one line.

use std::path::{Path, PathBuf};

/// Result of every fallible call in [`crate::offline`].
pub type Result<T> = std::result::Result<T, Error>;

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum At {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(u64),
    /// A byte offset, counted from 0.
    Byte(u64),
}

impl std::fmt::Display for At {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(n) => write!(f, ":{n}"),
            Self::Byte(n) => write!(f, " at byte {n}"),
        }
    }
}

/// What stopped a command. [`Error::exit_code`] is 2 for the user's input and 3 for the device.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file is missing, unreadable, malformed or holds an impossible value.
    #[error("{}{at}: {}: expected {}, got {}", plain(path.display()), plain(field), plain(expected), plain(got))]
    File {
        /// The file.
        path: PathBuf,
        /// Where in it.
        at: At,
        /// The field, key or header entry.
        field: String,
        /// What would be right.
        expected: String,
        /// What was found.
        got: String,
    },
    /// A command-line argument or name is not usable.
    #[error("{}: expected {}, got {}", plain(field), plain(expected), plain(got))]
    Argument {
        /// The flag or name.
        field: String,
        /// What would be right.
        expected: String,
        /// What was given.
        got: String,
    },
    /// Something that the format or the command knows, but that this version cannot do yet.
    #[error("{} is not supported yet", plain(what))]
    NotSupportedYet {
        /// The key or flag, with the file where there is one.
        what: String,
    },
    /// An output could not be written; nothing was left behind.
    #[error("cannot write {}: {}", plain(path.display()), plain(reason))]
    Write {
        /// The output.
        path: PathBuf,
        /// The system's word.
        reason: String,
    },
    /// The library refused its input or the device failed.
    #[error(transparent)]
    Library(#[from] crate::Error),
    /// No usable Vulkan device or driver.
    #[error("{0}")]
    Device(String),
}

impl Error {
    /// Shorthand for [`Error::File`].
    pub fn file(path: &Path, at: At, field: impl Into<String>, expected: impl Into<String>, got: impl ToString) -> Self {
        Self::File { path: path.into(), at, field: field.into(), expected: expected.into(), got: one_line(got) }
    }

    /// Shorthand for [`Error::Argument`].
    pub fn argument(field: impl Into<String>, expected: impl Into<String>, got: impl ToString) -> Self {
        Self::Argument { field: field.into(), expected: expected.into(), got: one_line(got) }
    }

    /// The command's exit code: 3 for the device or driver, 2 for everything that the user handed in.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Device(_) => 3,
            Self::Library(crate::Error::InvalidInput { .. }) => 2,
            Self::Library(_) => 3,
            _ => 2,
        }
    }
}

/// The most characters of a file that an error quotes.
const LONGEST: usize = 400;

/// Errors are one line, whatever a parser said.
fn one_line(text: impl ToString) -> String {
    let text = text.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => text.get(..end).unwrap_or_default().to_string() + "...",
        None => text,
    }
}

/// What files and file names say, with control characters written out: they would break the line or command the terminal.
fn plain(text: impl ToString) -> String {
    let text = text.to_string();
    if text.contains(char::is_control) {
        text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect()
    } else {
        text
    }
}
