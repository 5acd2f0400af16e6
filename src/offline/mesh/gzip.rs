//! Gzip around a mesh file, and what it may grow to.

use crate::offline::error::{At, Error, Result};
use flate2::read::MultiGzDecoder;
use std::io::Read;
use std::path::Path;

/// Bytes out for each byte in. Text meshes shrink 3 to 10 times; deflate can reach 1032.
const MOST_GROWTH: u64 = 64;

/// What any file may grow to, however small.
const ALWAYS_ALLOWED: u64 = 1 << 20;

/// The content of the gzip file `bytes`, read from `path`: at most 64 times its size, or 1 MiB.
///
/// # Errors
/// [`Error::File`] for what is not gzip, damaged or cut off, and before the memory is taken for what grows further.
pub(super) fn decompress(path: &Path, bytes: &[u8]) -> Result<Vec<u8>> {
    let most = (bytes.len() as u64 * MOST_GROWTH).max(ALWAYS_ALLOWED);
    let mut content = Vec::new();
    let read = MultiGzDecoder::new(bytes).take(most + 1).read_to_end(&mut content);
    read.map_err(|e| Error::file(path, At::File, "gzip", "a whole gzip stream", e))?;
    match content.len() as u64 {
        0 => Err(Error::file(path, At::File, "gzip", "content", "0 bytes")),
        size if size > most => {
            let got = format!("more from {} bytes", bytes.len());
            Err(Error::file(path, At::File, "gzip", format!("at most {most} bytes of content"), got))
        }
        _ => Ok(content),
    }
}
