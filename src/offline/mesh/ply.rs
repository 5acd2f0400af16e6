//! Stanford PLY, through `ply-rs-bw`.

use crate::offline::error::{At, Error, Result};
use crate::offline::mesh::{Mesh, Parts};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};
use std::path::Path;

/// Reads the vertices and faces of a PLY file, ascii or binary of either byte order: polygons as fans, other elements and
/// properties left out. Normals are `nx ny nz`, texture coordinates `s t`, `u v` or `texture_u texture_v` of the vertices;
/// missing normals are weighted by area.
///
/// # Errors
/// [`Error::File`] for malformed headers and elements (with the line of a text, the byte of a binary one), counts that the
/// file cannot hold, positions or coordinates that are not finite, indices out of range, and if there are no triangles.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<Other>::new().read_header(&mut reader).map_err(|e| {
        let at = e.line().map_or(At::File, |line| At::Line(line as u64));
        Error::file(path, at, "PLY header", "a well-formed header", excerpt(&e))
    })?;
    let mut file = File { path, size: bytes.len(), reader, header: &header };
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => vertices = file.read::<Vertex>(element)?,
            "face" => faces = file.read::<Face>(element)?,
            _ => drop(file.read::<Other>(element)?),
        }
    }

    let vertex = header.elements.get("vertex");
    let has = |names: &[&str]| vertex.is_some_and(|v| names.iter().any(|name| v.properties.contains_key(*name)));
    for axis in ["x", "y", "z"] {
        if !has(&[axis]) {
            return Err(Error::file(path, At::File, format!("vertex {axis}"), "a property", "none"));
        }
    }
    let mut parts = Parts { positions: vertices.iter().map(|v| v.position).collect(), ..Default::default() };
    if has(&["nx"]) && has(&["ny"]) && has(&["nz"]) {
        parts.normals = vertices.iter().map(|v| v.normal).collect();
    }
    if has(&U) && has(&V) {
        parts.uvs = vertices.iter().map(|v| v.uv).collect();
    }
    drop(vertices);
    for (i, Face(corners)) in faces.iter().enumerate() {
        if corners.len() < 3 {
            return Err(Error::file(path, At::File, format!("face {i}"), "at least 3 corners", corners.len()));
        }
        if corners.iter().any(|c| *c as usize >= parts.positions.len()) {
            let expected = format!("indices from 0 to below {}", parts.positions.len());
            let got = corners.iter().find(|c| **c as usize >= parts.positions.len()).map_or(String::new(), described);
            return Err(Error::file(path, At::File, format!("face {i}"), expected, got));
        }
        parts.fan(corners);
    }
    parts.finish(path)
}

/// Names of texture coordinates.
const U: [&str; 4] = ["s", "u", "texture_u", "texture_s"];
const V: [&str; 4] = ["t", "v", "texture_v", "texture_t"];

/// What [`Face`] keeps in the place of an index that is negative or too large for 32 bits.
const NO_INDEX: u32 = u32::MAX;

fn described(index: &u32) -> String {
    if *index == NO_INDEX { "one that is negative or too large".into() } else { index.to_string() }
}

/// The parser's word, which may quote a line of any length.
fn excerpt(e: &ParseError) -> String {
    e.to_string().chars().take(200).collect()
}

/// A file whose header has been read.
struct File<'a> {
    path: &'a Path,
    size: usize,
    reader: Reader<&'a [u8]>,
    header: &'a Header,
}

impl File<'_> {
    /// All of the next element.
    fn read<E: PropertyAccess>(&mut self, element: &ElementDef) -> Result<Vec<E>> {
        let left = self.reader.get_ref().len() as u64;
        let binary = self.header.encoding != Encoding::Ascii;
        let least = element.properties.values().map(|p| if binary { least_size(&p.data_type) } else { 2 }).sum::<u64>();
        // The parser would go round for every element, even where each takes no byte at all.
        if element.count > 0 && (least == 0 || (element.count as u64).saturating_mul(least) > left + 1) {
            let most = (left + 1).checked_div(least).unwrap_or(0);
            let expected = format!("at most {most} in the {left} bytes that follow");
            return Err(Error::file(self.path, At::File, format!("element {}", element.name), expected, element.count));
        }
        Parser::new().read_payload_for_element(&mut self.reader, element, self.header).map_err(|e: ParseError| {
            let byte = At::Byte((self.size - self.reader.get_ref().len()) as u64);
            let at = if binary { byte } else { e.line().map_or(byte, |line| At::Line(line as u64)) };
            Error::file(self.path, at, format!("element {}", element.name), "what the header declares", excerpt(&e))
        })
    }
}

/// Bytes that a binary property takes at least.
fn least_size(property: &PropertyType) -> u64 {
    let (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _)) = property;
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// A scalar as a number.
fn number(property: &Property) -> Option<f32> {
    match *property {
        Property::Char(v) => Some(f32::from(v)),
        Property::UChar(v) => Some(f32::from(v)),
        Property::Short(v) => Some(f32::from(v)),
        Property::UShort(v) => Some(f32::from(v)),
        Property::Int(v) => Some(v as f32),
        Property::UInt(v) => Some(v as f32),
        Property::Float(v) => Some(v),
        Property::Double(v) => Some(v as f32),
        _ => None,
    }
}

#[derive(Default)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
}

impl Vertex {
    fn set(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        let ([x, y, z], [nx, ny, nz], [u, v]) = (&mut self.position, &mut self.normal, &mut self.uv);
        let slot = match name {
            "x" => x,
            "y" => y,
            "z" => z,
            "nx" => nx,
            "ny" => ny,
            "nz" => nz,
            _ if U.contains(&name) => u,
            _ if V.contains(&name) => v,
            _ => return PropertyAccessResult::Ignored,
        };
        *slot = value;
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value)
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        number(&property).map_or(PropertyAccessResult::Ignored, |value| self.set(name, value))
    }
}

/// Indices of a polygon's corners.
struct Face(Vec<u32>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(Vec::new())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        fn all<T: TryInto<u32>>(list: Vec<T>) -> Vec<u32> {
            list.into_iter().map(|i| i.try_into().unwrap_or(NO_INDEX)).collect()
        }
        self.0 = match property {
            Property::ListChar(list) => all(list),
            Property::ListUChar(list) => all(list),
            Property::ListShort(list) => all(list),
            Property::ListUShort(list) => all(list),
            Property::ListInt(list) => all(list),
            Property::ListUInt(list) => list,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that is read past.
struct Other;

impl PropertyAccess for Other {
    fn new() -> Self {
        Self
    }
}
