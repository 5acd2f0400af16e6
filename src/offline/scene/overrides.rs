//! `--set PATH=VALUE`: changes to a scene's TOML tree before it is read.

use crate::offline::error::{Error, Result};
use std::borrow::Cow;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// More segments than any key of the format has.
const MAX_DEPTH: usize = 16;

/// Applies every `(path, value)` in order. What an override brings is positioned from `next` on, past the text; the
/// first position of each is returned with its path.
pub(super) fn apply<'t>(
    tree: &mut DeTable<'t>,
    mut next: usize,
    overrides: &'t [(String, String)],
) -> Result<Vec<(usize, String)>> {
    let mut starts = Vec::new();
    for (path, text) in overrides {
        starts.push((next, path.clone()));
        let segments: Vec<&str> = path.split('.').map(str::trim).collect();
        if segments.len() > MAX_DEPTH || segments.iter().any(|s| s.is_empty()) {
            return Err(Error::argument("--set", "a path such as camera.fov_y", format!("`{path}`")));
        }
        // What is not TOML is a string without quotes.
        let bare = |_| Spanned::new(0..0, DeValue::String(Cow::Borrowed(text)));
        let mut value = DeValue::parse(text.trim()).unwrap_or_else(bare);
        place(&mut value, &mut next);
        Override { path, segments: &segments, next: &mut next }.enter_table(tree, 0, value)?;
    }
    Ok(starts)
}

/// One override on its way down the tree.
struct Override<'o> {
    path: &'o str,
    segments: &'o [&'o str],
    /// The next free position.
    next: &'o mut usize,
}

impl Override<'_> {
    /// Goes on from a table after `done` segments. Missing tables are made; materials are not.
    fn enter_table<'t>(&mut self, table: &mut DeTable<'t>, done: usize, value: Spanned<DeValue<'t>>) -> Result<()> {
        let Some(segment) = self.segments.get(done).copied() else { return Ok(()) };
        let parents = self.segments.get(..done).unwrap_or_default();
        if !table.contains_key(segment) {
            if parents == ["materials"] {
                let names: Vec<_> = table.keys().map(|k| k.get_ref().to_string()).collect();
                return Err(self.error(format!("a material: {}", names.join(", ")), format!("`{segment}`")));
            }
            // Another choice of a "one of" group takes the old one's place.
            let others = alternatives(parents);
            if others.contains(&segment) {
                others.iter().for_each(|other| drop(table.remove(*other)));
            }
            let key = Spanned::new(*self.next..*self.next + 1, Cow::Owned(segment.to_string()));
            let empty = Spanned::new(*self.next..*self.next + 1, DeValue::Table(DeTable::new()));
            *self.next += 1;
            table.insert(key, empty);
        }
        match table.get_mut(segment) {
            Some(slot) => self.enter(slot, done + 1, value),
            None => Ok(()),
        }
    }

    /// Goes on from any value after `done` segments. List elements must be there.
    fn enter<'t>(&mut self, slot: &mut Spanned<DeValue<'t>>, done: usize, value: Spanned<DeValue<'t>>) -> Result<()> {
        let Some(segment) = self.segments.get(done).copied() else {
            *slot = value;
            return Ok(());
        };
        match slot.get_mut() {
            DeValue::Table(table) => self.enter_table(table, done, value),
            DeValue::Array(array) => {
                let count = array.len();
                let element = segment.parse::<usize>().ok().and_then(|i| array.get_mut(i));
                let Some(element) = element else {
                    return Err(self.error(format!("an index below {count}"), format!("`{segment}`")));
                };
                self.enter(element, done + 1, value)
            }
            other => {
                let parents = self.segments.get(..done).unwrap_or_default().join(".");
                Err(self.error(format!("a table or list at {parents}"), format!("a {}", other.type_str())))
            }
        }
    }

    fn error(&self, expected: String, got: String) -> Error {
        Error::argument(format!("--set {}", self.path), expected, got)
    }
}

/// Keys of which a table holds exactly one.
fn alternatives(parents: &[&str]) -> &'static [&'static str] {
    match parents {
        ["environment"] => &["map", "builtin"],
        ["objects", _] => &["mesh", "builtin"],
        ["materials", _, "reflectance"] => super::format::REFLECTANCES,
        _ => &[],
    }
}

/// Gives everything in `value` a position of its own from `next` on.
fn place(value: &mut Spanned<DeValue<'_>>, next: &mut usize) {
    let at = *next;
    *next += 1;
    let mut inner = std::mem::replace(value.get_mut(), DeValue::Boolean(false));
    match &mut inner {
        DeValue::Array(array) => array.iter_mut().for_each(|element| place(element, next)),
        DeValue::Table(table) => {
            for (key, mut element) in std::mem::take(table) {
                let key = Spanned::new(*next..*next + 1, key.into_inner());
                *next += 1;
                place(&mut element, next);
                table.insert(key, element);
            }
        }
        _ => {}
    }
    *value = Spanned::new(at..at + 1, inner);
}
