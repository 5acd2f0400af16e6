//! The text behind a scene: its TOML tree with overrides applied, and errors that point into it.

use crate::offline::error::{At, Error, Result};
use crate::offline::scene::overrides;
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a value stands: a byte range of the text, or past its end for what an override brought.
pub(super) type Span = Range<usize>;

/// A parsed scene file and what is needed to say where something in it is wrong.
#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    text: String,
    /// First position past the text of each override, with its path.
    overrides: Vec<(usize, String)>,
    /// Dotted path of everything that has a position, parents before children.
    places: Vec<(Span, String)>,
}

impl Source {
    /// Parses `text`, read from `path`, applies `overrides`, and deserialises it.
    pub(super) fn parse<T: serde::de::DeserializeOwned>(
        path: PathBuf,
        text: String,
        overrides: &[(String, String)],
    ) -> Result<(Self, T)> {
        let mut source = Self { path, text, overrides: Vec::new(), places: Vec::new() };
        let (overrides, places, parsed) = {
            let mut tree = DeTable::parse(&source.text).map_err(|e| source.malformed(&e))?;
            let overrides = overrides::apply(tree.get_mut(), source.text.len() + 1, overrides)?;
            let mut places = Vec::new();
            index_table(tree.get_ref(), "", &mut places);
            (overrides, places, serde::Deserialize::deserialize(toml::Deserializer::from(tree)))
        };
        source.overrides = overrides;
        source.places = places;
        let file = parsed.map_err(|e: toml::de::Error| source.mismatch(&e))?;
        Ok((source, file))
    }

    /// An error about what stands at `span`: of the file with its line, or of the override that brought it.
    pub(super) fn error(&self, span: &Span, expected: impl Into<String>, got: impl ToString) -> Error {
        self.error_of(span, self.field(span), expected, got)
    }

    /// That the table at `span` lacks the key `name`; an empty span is the whole file.
    pub(super) fn missing(&self, span: &Span, name: &str, expected: &str) -> Error {
        let field = if span.is_empty() { String::new() } else { self.field(span) + "." };
        self.error_of(span, field + name, expected, "none")
    }

    fn error_of(&self, span: &Span, field: String, expected: impl Into<String>, got: impl ToString) -> Error {
        match self.override_at(span) {
            Some(path) if field.is_empty() => Error::argument(format!("--set {path}"), expected, got),
            Some(_) => Error::argument(format!("--set {field}"), expected, got),
            None => Error::file(&self.path, At::Line(self.line(span)), field, expected, got),
        }
    }

    /// Syntax errors of the TOML text.
    fn malformed(&self, e: &toml::de::Error) -> Error {
        let (got, expected) = e.message().split_once(", expected ").unwrap_or((e.message(), "valid TOML"));
        let at = e.span().map_or(At::File, |span| At::Line(self.line(&span)));
        Error::file(&self.path, at, "TOML", expected, got)
    }

    /// Unknown and missing keys and values of another type, from serde's wording.
    fn mismatch(&self, e: &toml::de::Error) -> Error {
        let span = e.span().unwrap_or(0..0);
        let field = self.field(&span);
        if let Some(name) = e.message().strip_prefix("missing field `").and_then(|m| m.strip_suffix('`')) {
            let field = self.table_of(e, &span).unwrap_or(field);
            let field = if field.is_empty() { name.to_string() } else { format!("{field}.{name}") };
            return self.error_of(&span, field, "a value", "none");
        }
        let (got, expected) = e.message().split_once(", expected ").unwrap_or((e.message(), "another value"));
        let field = if field.is_empty() { "scene".to_string() } else { field };
        self.error_of(&span, field, expected, got)
    }

    /// The dotted path of the innermost thing at `span`'s start; empty for the whole file.
    fn field(&self, span: &Span) -> String {
        let here = self.places.iter().filter(|(place, _)| place.contains(&span.start));
        here.max_by_key(|(_, path)| path.split('.').count()).map(|(_, path)| path.clone()).unwrap_or_default()
    }

    /// The table in which `e` misses a key. A header such as `[[a.b]]` is the position of `a` and of its element alike;
    /// the error's last line tells them apart: the keys that led there, without indices.
    fn table_of(&self, e: &toml::de::Error, span: &Span) -> Option<String> {
        let text = e.to_string();
        let keys = text.lines().last()?.strip_prefix("in `")?.strip_suffix('`')?;
        let here = self.places.iter().filter(|(place, _)| place.contains(&span.start)).map(|(_, path)| path);
        let is_key = |segment: &&str| segment.parse::<usize>().is_err();
        here.filter(|path| path.split('.').filter(is_key).eq(keys.split('.'))).max_by_key(|path| path.split('.').count()).cloned()
    }

    fn override_at(&self, span: &Span) -> Option<&str> {
        self.overrides.iter().rev().find(|(first, _)| *first <= span.start).map(|(_, path)| path.as_str())
    }

    fn line(&self, span: &Span) -> u64 {
        1 + self.text.bytes().take(span.start).filter(|b| *b == b'\n').count() as u64
    }
}

fn index_table(table: &DeTable<'_>, prefix: &str, places: &mut Vec<(Span, String)>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        places.push((key.span(), path.clone()));
        index(value, path, places);
    }
}

fn index(value: &Spanned<DeValue<'_>>, path: String, places: &mut Vec<(Span, String)>) {
    places.push((value.span(), path.clone()));
    match value.get_ref() {
        DeValue::Table(table) => index_table(table, &path, places),
        DeValue::Array(array) => {
            for (i, element) in array.iter().enumerate() {
                index(element, format!("{path}.{i}"), places);
            }
        }
        _ => {}
    }
}
