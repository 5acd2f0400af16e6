//! Reading whole input files, with errors that say what the file is instead.

use crate::offline::error::{At, Error, Result};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::path::Path;
use std::sync::Once;

/// The largest image side that any reader accepts, in pixels.
pub(crate) const MAX_SIDE: u64 = 16_384;

/// More than any file that we read whole has.
const MOST_BYTES: u64 = 4 << 30;

/// The most bytes that deflate makes of one.
pub(crate) const DEFLATE_RATIO: u64 = 1032;

/// Every byte of the regular, non-empty file at `path`.
///
/// # Errors
/// [`Error::File`] if it is missing, unreadable, empty, above 4 GiB or no regular file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    let unreadable = |e: std::io::Error| Error::file(path, At::File, "file", "a readable file", e);
    let found = std::fs::metadata(path).map_err(unreadable)?;
    if !found.is_file() {
        let kind = if found.is_dir() { "a directory" } else { "a special file" };
        return Err(Error::file(path, At::File, "file", "a regular file", kind));
    }
    if found.len() > MOST_BYTES {
        return Err(Error::file(path, At::File, "file", "at most 4 GiB", format!("{} bytes", found.len())));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    if bytes.is_empty() {
        return Err(Error::file(path, At::File, "file", "content", "0 bytes"));
    }
    Ok(bytes)
}

/// The file name's extension in lower case, without the dot; empty if there is none.
pub(crate) fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Refuses sizes that no image of ours has, before anything is allocated.
///
/// # Errors
/// [`Error::File`] unless both sides are in 1 to `max`.
pub(crate) fn check_size(path: &Path, [width, height]: [u64; 2], max: [u64; 2]) -> Result<()> {
    if (1..=max[0]).contains(&width) && (1..=max[1]).contains(&height) {
        return Ok(());
    }
    let expected = format!("1x1 to {}x{} pixels", max[0], max[1]);
    Err(Error::file(path, At::File, "image size", expected, format!("{width}x{height}")))
}

thread_local! {
    /// Whether a panic of this thread is a malformed file and nothing to tell.
    static CATCHING: Cell<bool> = const { Cell::new(false) };
}

/// What `decode` returns, or `None` if it panicked on this thread. Nothing is printed then: that the file is malformed is
/// told once, by the error that the caller makes of it.
///
/// The standard library prints before anyone can catch, through a hook that the whole process shares. The first call puts
/// one in front of it that keeps quiet about threads inside this function and hands everything else on.
pub(crate) fn caught<T>(decode: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if !CATCHING.get() {
                before(panic);
            }
        }));
    });
    let outer = CATCHING.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(decode));
    CATCHING.set(outer);
    outcome.ok()
}
