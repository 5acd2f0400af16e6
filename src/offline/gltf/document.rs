//! The JSON of a glTF file, its buffers, and the files that it names.

use crate::offline::error::{At, Error, Result};
use crate::offline::{input, mesh};
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use gltf::json::{Root, buffer};
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// A validated glTF document with all its bytes.
pub(super) struct Document<'a> {
    pub path: &'a Path,
    pub root: Root,
    /// One a buffer, at least as long as it says.
    pub buffers: Vec<Arc<Vec<u8>>>,
}

/// Data URIs may leave their padding out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

impl<'a> Document<'a> {
    pub fn read(path: &'a Path) -> Result<Self> {
        let content = mesh::content(path)?;
        let fail = |e: gltf::Error| Error::file(path, At::File, "glTF", "a well-formed file", format!("{e:.200}"));
        let (json, blob) = if content.starts_with(b"glTF") {
            // The crate subtracts the header's 12 bytes from the length unseen.
            let length = content.get(8..12).map(|b| b.iter().rev().fold(0_u64, |n, b| n << 8 | u64::from(*b)));
            let length = length.unwrap_or(0);
            if length < 12 || length > content.len() as u64 {
                let expected = format!("12 to {}", content.len());
                return Err(Error::file(path, At::Byte(8), "GLB length", expected, length));
            }
            let glb = gltf::Glb::from_slice(content.get(..length as usize).unwrap_or_default()).map_err(fail)?;
            (glb.json.into_owned(), glb.bin.map(|bin| Arc::new(bin.into_owned())))
        } else {
            (content, None)
        };
        let root: Root = gltf::json::deserialize::from_slice(&json).map_err(|e| {
            let at = if blob.is_none() { At::Line(e.line() as u64) } else { At::File };
            Error::file(path, at, "glTF JSON", "a well-formed document", e)
        })?;
        if !root.asset.version.starts_with("2.") {
            return Err(Error::file(path, At::File, "asset.version", "2.0", &root.asset.version));
        }
        // The crate's validation looks positions up before it has checked their index.
        for (m, mesh) in root.meshes.iter().enumerate() {
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
                if position.is_some_and(|index| root.get(*index).is_none()) {
                    let field = format!("meshes[{m}].primitives[{p}].attributes.POSITION");
                    let expected = format!("an index below {}", root.accessors.len());
                    return Err(Error::file(path, At::File, field, expected, "another"));
                }
            }
        }
        let root = match gltf::Document::from_json(root) {
            Ok(document) => document.into_json(),
            Err(gltf::Error::Validation(errors)) => {
                let (field, problem) = errors.first().map(|(path, e)| (path.to_string(), e.to_string())).unwrap_or_default();
                return Err(Error::file(path, At::File, field, "a valid glTF 2.0 entry of no required extension", problem));
            }
            Err(e) => return Err(fail(e)),
        };
        let mut document = Self { path, root, buffers: Vec::new() };
        document.buffers = document.load_buffers(blob)?;
        Ok(document)
    }

    /// An error about the entry `field`.
    pub fn error(&self, field: impl Into<String>, expected: impl Into<String>, got: impl ToString) -> Error {
        Error::file(self.path, At::File, field, expected, got)
    }

    fn load_buffers(&self, blob: Option<Arc<Vec<u8>>>) -> Result<Vec<Arc<Vec<u8>>>> {
        let mut known = HashMap::new();
        let load = |(i, buffer): (usize, &buffer::Buffer)| {
            let field = format!("buffers[{i}]");
            let bytes = match (&buffer.uri, &blob) {
                (Some(uri), _) => self.resource(&format!("{field}.uri"), uri, &mut known)?,
                (None, Some(blob)) if i == 0 => Arc::clone(blob),
                (None, _) => return Err(self.error(field, "a uri, or the first buffer of a GLB file", "neither")),
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                let expected = format!("{} bytes", buffer.byte_length.0);
                return Err(self.error(field, expected, format!("{} bytes", bytes.len())));
            }
            Ok(bytes)
        };
        self.root.buffers.iter().enumerate().map(load).collect()
    }

    /// The bytes at `uri`: inside it, or of a file in the document's folder or below. A file is read once.
    pub fn resource(&self, field: &str, uri: &str, known: &mut HashMap<PathBuf, Arc<Vec<u8>>>) -> Result<Arc<Vec<u8>>> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((_, encoded)) = data.split_once(";base64,") else {
                return Err(self.error(field, "a data URI in base64", "another"));
            };
            let decoded = BASE64.decode(encoded).map_err(|e| self.error(field, "base64", e))?;
            return Ok(Arc::new(decoded));
        }
        let outside = || self.error(field, "a relative name of a file in the same folder or below", format!("`{uri:.200}`"));
        let name = percent_encoding::percent_decode_str(uri).decode_utf8().map_err(|_| outside())?;
        let name = Path::new(name.as_ref());
        let inside = name.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        // A colon makes a scheme, or a drive; the other slash separates folders elsewhere.
        if !inside || name.components().next().is_none() || name.to_string_lossy().contains([':', '\\', '\0']) {
            return Err(outside());
        }
        let folder = self.path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let path = folder.join(name);
        // Links may lead anywhere, too.
        if let (Ok(folder), Ok(target)) = (folder.canonicalize(), path.canonicalize())
            && !target.starts_with(folder)
        {
            return Err(outside());
        }
        if let Some(bytes) = known.get(&path) {
            return Ok(Arc::clone(bytes));
        }
        let bytes = Arc::new(input::read(&path)?);
        known.insert(path, Arc::clone(&bytes));
        Ok(bytes)
    }
}
