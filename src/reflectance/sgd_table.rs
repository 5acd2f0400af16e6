//! CSV tables of SGD parameters: a header, then a row a material.

use crate::reflectance::sgd::{PARAMETERS, Sgd};

/// Columns in which a material's name is looked for.
const NAMES: [&str; 2] = ["material", "alt_name"];

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {field}: expected {expected}, got {got}")]
pub struct SgdTableError {
    /// Counted from 1.
    pub line: u64,
    /// The column, or `name`.
    pub field: String,
    /// What would be right.
    pub expected: String,
    /// What was found.
    pub got: String,
}

/// The material `name` of a CSV table. Columns are known by the header's names: `material` (or `alt_name`), and for every
/// parameter P of [`PARAMETERS`] `P_R`, `P_G` and `P_B`; order and further columns do not matter.
///
/// # Errors
/// [`SgdTableError`] with the line for text that is no CSV, a missing column, an unknown name, or a field that is no number
/// or out of range.
pub fn find(text: &[u8], name: &str) -> Result<Sgd, SgdTableError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
    let header = reader.headers().map_err(malformed)?.clone();
    let column = |wanted: &str| {
        let found = header.iter().position(|c| c == wanted);
        found.ok_or_else(|| error(1, wanted, "a column of that name", "none"))
    };
    let names: Vec<_> = NAMES.into_iter().filter_map(|n| header.iter().position(|c| c == n)).collect();
    if names.is_empty() {
        column(NAMES[0])?;
    }
    let mut columns = [[0; 3]; PARAMETERS.len()];
    for (parameter, columns) in PARAMETERS.into_iter().zip(&mut columns) {
        for (channel, at) in ["R", "G", "B"].into_iter().zip(columns) {
            *at = column(&format!("{parameter}_{channel}"))?;
        }
    }
    let mut known = Vec::new();
    for record in reader.records() {
        let record = record.map_err(malformed)?;
        if !names.iter().any(|&at| record.get(at) == Some(name)) {
            known.extend(names.first().and_then(|&at| record.get(at)).map(str::to_owned));
            continue;
        }
        let line = record.position().map_or(1, csv::Position::line);
        let mut rows = [[0.0; 3]; PARAMETERS.len()];
        for (columns, row) in columns.iter().zip(&mut rows) {
            for (&at, value) in columns.iter().zip(row) {
                let field = record.get(at).unwrap_or_default();
                let title = header.get(at).unwrap_or_default();
                *value = field.parse().map_err(|_| error(line, title, "a number", format!("`{field}`")))?;
            }
        }
        let sgd = Sgd::from_rows(rows);
        return match sgd.validate() {
            Ok(()) => Ok(sgd),
            Err(crate::Error::InvalidInput { field, expected, got }) => Err(error(line, field, expected, got)),
            Err(other) => Err(error(line, "sgd", "a reflectance", other)),
        };
    }
    let shown = known.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
    let more = if known.len() > 8 { format!(" or one of {} more", known.len() - 8) } else { String::new() };
    Err(error(1, "name", format!("{shown}{more}"), format!("`{name}`")))
}

fn error(line: u64, field: impl Into<String>, expected: impl Into<String>, got: impl ToString) -> SgdTableError {
    SgdTableError { line, field: field.into(), expected: expected.into(), got: got.to_string() }
}

fn malformed(e: csv::Error) -> SgdTableError {
    let line = e.position().map_or(1, csv::Position::line);
    match e.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            error(line, "row", format!("{expected_len} fields"), format!("{len} fields"))
        }
        csv::ErrorKind::Utf8 { .. } => error(line, "row", "UTF-8 text", "other bytes"),
        _ => error(line, "table", "comma-separated values", e),
    }
}
