//! TOML text as values, each with its place in the text.

use crate::config::ConfigError;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

/// A text that messages can point into.
#[derive(Debug, PartialEq, Eq)]
pub struct Source {
    /// A path, or what stands for one.
    pub name: String,
    /// The whole text.
    pub text: String,
}

/// A piece of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The text.
    pub source: Arc<Source>,
    /// Bytes of the text.
    pub range: Range<usize>,
}

impl Place {
    /// Line of the first byte, from 1.
    pub fn line(&self) -> usize {
        let start = self.range.start.min(self.source.text.len());
        1 + self.source.text[..start].matches('\n').count()
    }
}

/// Places of a key and of its value.
#[derive(Clone, Debug)]
struct Entry {
    key: Place,
    value: Place,
}

/// A table of values that knows where each was written.
#[derive(Clone, Debug, Default)]
pub struct Document {
    table: toml::Table,
    entries: BTreeMap<String, Entry>,
}

impl Document {
    /// Parses a file's text; a byte order mark and CRLF line ends are accepted.
    ///
    /// # Errors
    /// [`ConfigError::Syntax`] with its place.
    pub fn parse(name: &str, text: &str) -> Result<Self, ConfigError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let source = Arc::new(Source { name: name.to_owned(), text: text.to_owned() });
        let syntax = |error: toml::de::Error| ConfigError::Syntax {
            message: error.message().to_owned(),
            place: Place { source: source.clone(), range: error.span().unwrap_or(0..0) },
        };
        let table = toml::from_str(text).map_err(syntax)?;
        let spanned = DeTable::parse(text).map_err(syntax)?;
        let mut entries = BTreeMap::new();
        collect(spanned.get_ref(), "", &source, &mut entries);
        Ok(Self { table, entries })
    }

    /// Applies `KEY=VALUE`, a dotted key and a TOML value; what is no TOML value is a string.
    ///
    /// # Errors
    /// [`ConfigError::Override`] if there is no `=`, the key is empty or runs through a value.
    pub fn set(&mut self, argument: &str) -> Result<(), ConfigError> {
        let refuse = |reason| ConfigError::Override { argument: argument.to_owned(), reason };
        let (key, value) = argument.split_once('=').ok_or_else(|| refuse("there is no `=`"))?;
        let (key, text) = (key.trim(), value.trim());
        let path: Vec<&str> = key.split('.').map(str::trim).collect();
        if path.iter().any(|part| part.is_empty()) {
            return Err(refuse("the key has an empty part"));
        }
        let (last, parents) = path.split_last().expect("invariant: split yields a part");
        let mut table = &mut self.table;
        for part in parents {
            let next = table
                .entry((*part).to_owned())
                .or_insert_with(|| toml::Value::Table(toml::Table::new()));
            table = next.as_table_mut().ok_or_else(|| refuse("the key runs through a value"))?;
        }
        table.insert((*last).to_owned(), value_of(text));
        self.note_override(argument, &path.join("."));
        Ok(())
    }

    fn note_override(&mut self, argument: &str, path: &str) {
        let text = argument.to_owned();
        let split = argument.find('=').expect("invariant: checked by set");
        let source = Arc::new(Source { name: "--set".to_owned(), text });
        let place = |range| Place { source: source.clone(), range };
        let entry = Entry { key: place(0..split), value: place(split + 1..argument.len()) };
        self.entries.insert(path.to_owned(), entry);
    }

    /// Puts a value that the user did not write.
    pub fn put(&mut self, table: &str, key: &str, value: impl Into<toml::Value>) {
        let slot = self.table.entry(table.to_owned()).or_insert_with(|| toml::Table::new().into());
        if let Some(inner) = slot.as_table_mut() {
            inner.insert(key.to_owned(), value.into());
        }
    }

    /// Takes a value out, if it is there.
    pub(crate) fn take(&mut self, table: &str, key: &str) {
        if let Some(inner) = self.table.get_mut(table).and_then(toml::Value::as_table_mut) {
            inner.remove(key);
        }
    }

    /// All values.
    pub fn table(&self) -> &toml::Table {
        &self.table
    }

    /// Whether a key of a table is written.
    pub(crate) fn has(&self, table: &str, key: &str) -> bool {
        self.table().get(table).is_some_and(|table| table.get(key).is_some())
    }

    /// Where the key of this dotted path stands, or the nearest table above it.
    pub fn key_place(&self, path: &str) -> Option<Place> {
        self.nearest(path).map(|entry| entry.key.clone())
    }

    /// Where the value of this dotted path stands, or the nearest value above it.
    pub fn value_place(&self, path: &str) -> Option<Place> {
        self.nearest(path).map(|entry| entry.value.clone())
    }

    fn nearest(&self, path: &str) -> Option<&Entry> {
        let mut path = path;
        loop {
            if let Some(entry) = self.entries.get(path) {
                return Some(entry);
            }
            path = &path[..path.rfind('.')?];
        }
    }
}

/// A TOML value, or the text itself as a string.
fn value_of(text: &str) -> toml::Value {
    let parsed = toml::from_str::<toml::Table>(&format!("value = {text}"));
    let value = parsed.ok().filter(|table| table.len() == 1).and_then(|mut t| t.remove("value"));
    value.unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

fn collect(
    table: &DeTable<'_>,
    above: &str,
    source: &Arc<Source>,
    entries: &mut BTreeMap<String, Entry>,
) {
    for (key, value) in table {
        let path = match above {
            "" => key.get_ref().to_string(),
            _ => format!("{above}.{}", key.get_ref()),
        };
        let place = |range| Place { source: source.clone(), range };
        if let DeValue::Table(inner) = value.get_ref() {
            collect(inner, &path, source, entries);
        }
        entries.insert(path, Entry { key: place(key.span()), value: place(value.span()) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Document {
        Document::parse(
            "a.toml",
            "\u{feff}[model]\r\nname = \"a\"\r\n[network]\r\nsamples = 17\r\n",
        )
        .unwrap()
    }

    #[test]
    fn a_byte_order_mark_and_crlf_are_accepted_and_lines_count() {
        let doc = document();
        assert_eq!(doc.value_place("network.samples").unwrap().line(), 4);
        assert_eq!(doc.key_place("network.nothing").unwrap().line(), 3);
        assert_eq!(doc.table()["model"]["name"].as_str(), Some("a"));
    }

    #[test]
    fn overrides_take_toml_values_and_bare_words() {
        let mut doc = document();
        doc.set("network.samples=24").unwrap();
        doc.set("network.method = paper").unwrap();
        doc.set("model.formula=x^2 + y^2 - 1").unwrap();
        doc.set("model.box=[[-1, 1], [-1, 1], [-2, 2]]").unwrap();
        assert_eq!(doc.table()["network"]["samples"].as_integer(), Some(24));
        assert_eq!(doc.table()["network"]["method"].as_str(), Some("paper"));
        assert_eq!(doc.table()["model"]["formula"].as_str(), Some("x^2 + y^2 - 1"));
        assert_eq!(doc.table()["model"]["box"].as_array().unwrap().len(), 3);
        assert_eq!(doc.value_place("network.samples").unwrap().source.name, "--set");
    }

    #[test]
    fn overrides_without_a_key_or_value_are_refused() {
        for bad in ["network.samples", "=3", "a..b=3", "model.name.x=3"] {
            let error = document().set(bad).unwrap_err();
            assert!(matches!(error, ConfigError::Override { .. }), "{bad}: {error}");
        }
    }

    #[test]
    fn a_value_cannot_smuggle_in_a_second_key() {
        assert_eq!(value_of("1\nb = 2"), toml::Value::String("1\nb = 2".to_owned()));
    }

    #[test]
    fn a_syntax_error_knows_its_line() {
        let error = Document::parse("a.toml", "[model]\nname = \n").unwrap_err();
        let ConfigError::Syntax { place, .. } = error else { panic!("{error}") };
        assert_eq!(place.line(), 2);
    }
}
