//! The container of RGL files: named tensors behind a directory. Little-endian: the 12 bytes `tensor_file\0`, version 1.0 in
//! two bytes, the number of fields as `u32`; for each field the length of its name as `u16`, the name, the number of
//! dimensions as `u16`, the type of its entries in one byte, the offset of its data from the start of the file as `u64`, and
//! each dimension as `u64` (Dupuy and Jakob 2018, supplemental data format).

use crate::reflectance::DataError;

const MAGIC: &[u8] = b"tensor_file\0";
const VERSION: [u8; 2] = [1, 0];
/// Far above what any such file has.
const MAX_FIELDS: u32 = 64;
const MAX_NAME: u16 = 256;
const MAX_DIMENSIONS: u16 = 8;

/// Codes of entry types with the bytes of one entry; 0 is none.
const BYTES: [usize; 12] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];
const UINT8: u8 = 1;
const FLOAT32: u8 = 10;

/// One entry of the directory, its data within the file.
#[derive(Clone, Debug)]
pub(super) struct Field<'a> {
    pub name: String,
    /// Where its entry in the directory begins.
    pub at: usize,
    /// Where its data begin.
    pub offset: usize,
    pub shape: Vec<usize>,
    kind: u8,
    data: &'a [u8],
}

impl Field<'_> {
    /// The entries, which must be `float32` and finite.
    pub fn floats(&self) -> Result<Vec<f64>, DataError> {
        if self.kind != FLOAT32 {
            return Err(DataError::new(format!("{} type", self.name), self.at, "float32 (10)", self.kind));
        }
        let entries = self.data.as_chunks().0.iter().enumerate();
        entries
            .map(|(i, &bytes)| {
                let value = f32::from_le_bytes(bytes);
                let wrong = || DataError::new(format!("{} entry {i}", self.name), self.offset + 4 * i, "a finite number", value);
                if value.is_finite() { Ok(value.into()) } else { Err(wrong()) }
            })
            .collect()
    }

    /// The only entry, which must be a `uint8`.
    pub fn flag(&self) -> Result<bool, DataError> {
        match (self.kind, self.data) {
            (UINT8, [flag]) => Ok(*flag != 0),
            _ => Err(DataError::new(&self.name, self.at, "one uint8", format!("type {} and shape {:?}", self.kind, self.shape))),
        }
    }
}

/// Reads the directory.
pub(super) fn fields(bytes: &[u8]) -> Result<Vec<Field<'_>>, DataError> {
    let mut cursor = Cursor { bytes, at: 0 };
    let magic = cursor.take("identifier", MAGIC.len())?;
    if magic != MAGIC {
        return Err(DataError::new("identifier", 0, "tensor_file", format!("`{}`", magic.escape_ascii())));
    }
    let version: [u8; 2] = cursor.array("version")?;
    if version != VERSION {
        return Err(DataError::new("version", MAGIC.len(), "1.0", format!("{}.{}", version[0], version[1])));
    }
    let at = cursor.at;
    let count = u32::from_le_bytes(cursor.array("number of fields")?);
    if count > MAX_FIELDS {
        return Err(DataError::new("number of fields", at, format!("at most {MAX_FIELDS}"), count));
    }
    (0..count).map(|i| field(&mut cursor, i)).collect()
}

fn field<'a>(cursor: &mut Cursor<'a>, number: u32) -> Result<Field<'a>, DataError> {
    let start = cursor.at;
    let length = u16::from_le_bytes(cursor.array(&format!("field {number} name length"))?);
    if length > MAX_NAME {
        return Err(DataError::new(format!("field {number} name length"), start, format!("at most {MAX_NAME}"), length));
    }
    let at = cursor.at;
    let name = cursor.take(&format!("field {number} name"), length.into())?;
    let name = str::from_utf8(name)
        .map_err(|_| DataError::new(format!("field {number} name"), at, "UTF-8 text", format!("`{}`", name.escape_ascii())))?;
    let at = cursor.at;
    let dimensions = u16::from_le_bytes(cursor.array(&format!("{name} dimensions"))?);
    if dimensions > MAX_DIMENSIONS {
        return Err(DataError::new(format!("{name} dimensions"), at, format!("at most {MAX_DIMENSIONS}"), dimensions));
    }
    let at = cursor.at;
    let [kind] = cursor.array(&format!("{name} type"))?;
    let entry = match BYTES.get(usize::from(kind)) {
        Some(&bytes) if bytes > 0 => bytes,
        _ => return Err(DataError::new(format!("{name} type"), at, format!("1 to {}", BYTES.len() - 1), kind)),
    };
    let offset_at = cursor.at;
    let offset = u64::from_le_bytes(cursor.array(&format!("{name} offset"))?);
    let at = cursor.at;
    let shape: Vec<u64> = (0..dimensions)
        .map(|_| Ok(u64::from_le_bytes(cursor.array(&format!("{name} shape"))?)))
        .collect::<Result<_, DataError>>()?;
    let left = cursor.bytes.len() as u64;
    let size = shape.iter().try_fold(entry as u64, |size, &side| size.checked_mul(side)).filter(|&size| size <= left);
    let Some(size) = size else {
        return Err(DataError::new(format!("{name} shape"), at, format!("at most {left} bytes"), format!("{shape:?}")));
    };
    let data = usize::try_from(offset).ok().and_then(|o| cursor.bytes.get(o..o.checked_add(size as usize)?));
    let Some(data) = data else {
        let expected = format!("{size} bytes within the file's {left}");
        return Err(DataError::new(format!("{name} offset"), offset_at, expected, offset));
    };
    let shape = shape.iter().map(|&side| side as usize).collect();
    Ok(Field { name: name.into(), at: start, offset: offset as usize, shape, kind, data })
}

/// A position in the file.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, field: &str, length: usize) -> Result<&'a [u8], DataError> {
        let end = self.at.saturating_add(length);
        let got = self.bytes.len() - self.at;
        let error = || DataError::new(field, self.at, format!("{length} bytes"), format!("{got} bytes"));
        let taken = self.bytes.get(self.at..end).ok_or_else(error)?;
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, field: &str) -> Result<[u8; N], DataError> {
        let mut out = [0; N];
        self.take(field, N)?.iter().zip(&mut out).for_each(|(byte, out)| *out = *byte);
        Ok(out)
    }
}
