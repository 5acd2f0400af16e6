//! Results that take long, kept in the user's cache by the content of what they are made of. An entry is the SHA-256 of what
//! follows it; one that is missing, damaged or cannot be written does not matter.

use crate::offline::image_io::write_atomically;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Bytes of the checksum.
const SUM: usize = 32;

/// The folder for results of a kind; `None` on systems that have none for caches.
pub(crate) fn folder(kind: &str) -> Option<PathBuf> {
    dirs::cache_dir().map(|folder| folder.join("passband").join(kind))
}

/// What an entry holds, if it is whole.
pub(crate) fn read(entry: &Path) -> Option<Vec<u8>> {
    let mut bytes = std::fs::read(entry).ok().filter(|bytes| bytes.len() >= SUM)?;
    let content = bytes.split_off(SUM);
    (Sha256::digest(&content).as_slice() == bytes).then_some(content)
}

/// What `entry` holds if it is whole and `from` can read it; otherwise what `make` makes, which is kept there if that is possible.
pub(crate) fn kept<T>(
    entry: Option<&Path>,
    from: impl FnOnce(&[u8]) -> Option<T>,
    to: impl FnOnce(&T) -> Vec<u8>,
    make: impl FnOnce() -> T,
) -> T {
    if let Some(known) = entry.and_then(|entry| from(&read(entry)?)) {
        return known;
    }
    let made = make();
    if let Some(entry) = entry {
        keep(entry, &to(&made));
    }
    made
}

/// Writes an entry if that is possible.
pub(crate) fn keep(entry: &Path, content: &[u8]) {
    let Some(folder) = entry.parent() else { return };
    let written = std::fs::create_dir_all(folder).map_err(|e| e.to_string()).and_then(|()| {
        let both = |file: &mut std::io::BufWriter<&std::fs::File>| {
            file.write_all(&Sha256::digest(content))?;
            file.write_all(content)
        };
        write_atomically(entry, both).map_err(|e| e.to_string())
    });
    if let Err(e) = written {
        log::warn!("what was computed is not kept: {e}");
    }
}
