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
            return Err(Error::argument(format!("--set {path}"), "a path such as camera.fov_y", path));
        }
        // What is not TOML is a string without quotes.
        let bare = |_| Spanned::new(0..0, DeValue::String(Cow::Borrowed(text)));
        let mut value = DeValue::parse(text.trim()).unwrap_or_else(bare);
        place(&mut value, &mut next);
        set(tree, path, &segments, value, &mut next)?;
    }
    Ok(starts)
}

/// Sets the value at `segments`; tables on the way are made where they are missing, list elements and materials are not.
fn set<'t>(tree: &mut DeTable<'t>, path: &str, segments: &[&str], value: Spanned<DeValue<'t>>, next: &mut usize) -> Result<()> {
    let mut table = tree;
    let mut done = 0;
    while let Some(segment) = segments.get(done) {
        let parents = segments.get(..done).unwrap_or_default();
        done += 1;
        let last = done == segments.len();
        if !table.contains_key(*segment) {
            if parents == ["materials"] {
                let names: Vec<_> = table.keys().map(|k| k.get_ref().to_string()).collect();
                return Err(Error::argument(format!("--set {path}"), format!("a material: {}", names.join(", ")), segment));
            }
            // Another choice of a "one of" group takes the old one's place.
            let others = alternatives(parents);
            if others.contains(segment) {
                table.retain(|key, _| !others.contains(&key.get_ref().as_ref()));
            }
            let key = Spanned::new(*next..*next + 1, Cow::Owned(segment.to_string()));
            let empty = Spanned::new(*next..*next + 1, DeValue::Table(DeTable::new()));
            *next += 1;
            table.insert(key, empty);
        }
        let Some(mut slot) = table.get_mut(*segment) else { break };
        if last {
            *slot = value;
            return Ok(());
        }
        // List elements on the way.
        while let DeValue::Array(_) = slot.get_ref() {
            let index = segments.get(done).copied().unwrap_or_default();
            done += 1;
            let DeValue::Array(array) = slot.get_mut() else { break };
            let count = array.len();
            let element = index.parse::<usize>().ok().and_then(|i| array.get_mut(i));
            let Some(element) = element else {
                return Err(Error::argument(format!("--set {path}"), format!("an index below {count}"), index));
            };
            if done == segments.len() {
                *element = value;
                return Ok(());
            }
            slot = element;
        }
        let kind = slot.get_ref().type_str();
        match slot.get_mut() {
            DeValue::Table(inner) => table = inner,
            _ => {
                let field = segments.get(..done).unwrap_or_default().join(".");
                return Err(Error::argument(format!("--set {path}"), format!("a table at {field}"), format!("a {kind}")));
            }
        }
    }
    Ok(())
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
