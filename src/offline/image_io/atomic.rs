//! Outputs that appear whole or not at all.

use crate::offline::error::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// Writes a file through `content` under a temporary name in the target's folder, then renames it. On any failure, of
/// `content` included, an earlier file of that name is untouched and nothing is left behind.
///
/// # Errors
/// [`Error::Write`] with the system's word, also where `path` names something that is no regular file.
pub fn write_atomically<E: ToString>(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<&File>) -> std::result::Result<(), E>,
) -> Result<()> {
    let failed = |reason: &dyn ToString| refused(path, reason);
    let file = begin(path)?;
    {
        let mut writer = BufWriter::new(file.as_file());
        content(&mut writer).map_err(|e| failed(&e))?;
        writer.flush().map_err(|e| failed(&e))?;
    }
    file.persist(path).map_err(|e| failed(&e.error))?;
    Ok(())
}

/// That a file could be created at `path` now, so that long work for it is not in vain. Nothing is left behind.
///
/// # Errors
/// As [`write_atomically`].
pub fn check_writable(path: &Path) -> Result<()> {
    begin(path).map(drop)
}

/// An empty file under a temporary name, which is gone when dropped.
fn begin(path: &Path) -> Result<NamedTempFile> {
    // Renaming over a device or a pipe would replace it.
    if path.metadata().is_ok_and(|found| !found.is_file()) {
        return Err(refused(path, &"it exists and is not a regular file"));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".passband-");
    #[cfg(unix)]
    {
        // The usual mode of a new file: the system's mask applies.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder).map_err(|e| refused(path, &e))
}

fn refused(path: &Path, reason: &dyn ToString) -> Error {
    Error::Write { path: path.into(), reason: one_line(&reason.to_string()) }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
