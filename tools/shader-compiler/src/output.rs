//! Compares an output folder with what it should hold, and makes it so.

use crate::{Error, Manifest, Module, Options, Result, source};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How a file in the output folder is not what it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// Not there.
    Missing,
    /// Holds other bytes.
    Different,
    /// A module that no source produces.
    Stale,
}

/// One file to write or to remove.
#[derive(Clone, Debug)]
pub struct Change {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub kind: ChangeKind,
    /// What it should hold; nothing for a stale one.
    bytes: Vec<u8>,
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = match self.kind {
            ChangeKind::Missing => "is missing",
            ChangeKind::Different => "differs",
            ChangeKind::Stale => "has no source",
        };
        write!(f, "{} {what}", self.path.display())
    }
}

/// What stands between the output folder and `modules` with their manifest; empty if nothing does.
///
/// # Errors
/// [`Error::Read`] for what is there and cannot be read, [`Error::Manifest`].
pub fn changes(options: &Options, modules: &[Module], manifest: &Manifest) -> Result<Vec<Change>> {
    let manifest_path = options.out.join("manifest.json");
    let mut wanted: BTreeMap<PathBuf, Vec<u8>> =
        modules.iter().map(|module| (options.out.join(module.file_name()), module.bytes())).collect();
    wanted.insert(manifest_path.clone(), manifest.bytes(&manifest_path)?);
    let present = if options.out.is_dir() { source::entries(&options.out)? } else { Vec::new() };
    let stale = present.into_iter().filter(|path| path.extension().is_some_and(|e| e == "spv") && !wanted.contains_key(path));
    let mut changes: Vec<_> = stale.map(|path| Change { path, kind: ChangeKind::Stale, bytes: Vec::new() }).collect();
    for (path, bytes) in wanted {
        match std::fs::read(&path) {
            Ok(old) if old == bytes => {}
            Ok(_) => changes.push(Change { path, kind: ChangeKind::Different, bytes }),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                changes.push(Change { path, kind: ChangeKind::Missing, bytes });
            }
            Err(source) => return Err(Error::Read { path, source }),
        }
    }
    Ok(changes)
}

/// Writes and removes what [`changes`] found. Each file is written under a temporary name and renamed, so that an
/// interrupted run leaves whole files.
///
/// # Errors
/// [`Error::Write`] with the file.
pub fn apply(options: &Options, changes: &[Change]) -> Result<()> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |source| Error::Write { path, source }
    };
    std::fs::create_dir_all(&options.out).map_err(failed(&options.out))?;
    for change in changes {
        if change.kind == ChangeKind::Stale {
            std::fs::remove_file(&change.path).map_err(failed(&change.path))?;
            continue;
        }
        let mut temporary = change.path.clone().into_os_string();
        temporary.push(".tmp");
        std::fs::write(&temporary, &change.bytes).map_err(failed(&change.path))?;
        std::fs::rename(&temporary, &change.path).map_err(failed(&change.path))?;
    }
    Ok(())
}
