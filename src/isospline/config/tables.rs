//! A table of a document as a typed value: unknown keys, wrong types and places.

use crate::config::{ConfigError, Document};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The table at `path` as a `T`; a missing table is the default.
///
/// The keys of `T::default()` are the known ones, and those of `optional`, which have no default;
/// a table that is empty among them takes any keys.
///
/// # Errors
/// Unknown keys with the nearest known name, and values of another type.
pub(crate) fn typed<T>(doc: &Document, path: &str, optional: &[&str]) -> Result<T, ConfigError>
where
    T: Serialize + DeserializeOwned + Default,
{
    let Some(value) = doc.table().get(path) else { return Ok(T::default()) };
    let Some(table) = value.as_table() else {
        return Err(wrong_type(
            doc,
            path,
            format!("expected a table, found a {}", value.type_str()),
        ));
    };
    let mut known = serde_json::to_value(T::default()).expect("invariant: defaults serialise");
    for key in optional {
        known[key] = serde_json::Value::Null;
    }
    refuse_unknown(doc, path, table, &known)?;
    serde_path_to_error::deserialize(value.clone()).map_err(|error| {
        let inner = error.path().to_string();
        let key = if inner == "." { path.to_owned() } else { format!("{path}.{inner}") };
        wrong_type(doc, &key, error.inner().message().trim().to_owned())
    })
}

/// Refuses names at the top of a document that are not `known`.
///
/// # Errors
/// [`ConfigError::UnknownKey`].
pub(crate) fn refuse_unknown_tables(doc: &Document, known: &[&str]) -> Result<(), ConfigError> {
    match doc.table().keys().find(|key| !known.contains(&key.as_str())) {
        Some(key) => Err(unknown(doc, "", key, known.iter().map(|k| (*k).to_owned()).collect())),
        None => Ok(()),
    }
}

/// A [`ConfigError::OutOfRange`] with its place.
pub(crate) fn out_of_range(doc: &Document, key: &str, message: impl Into<String>) -> ConfigError {
    let place = doc.value_place(key);
    ConfigError::OutOfRange { key: key.to_owned(), message: message.into(), place }
}

fn refuse_unknown(
    doc: &Document,
    path: &str,
    table: &toml::Table,
    known: &serde_json::Value,
) -> Result<(), ConfigError> {
    let Some(known) = known.as_object() else { return Ok(()) };
    for (key, value) in table {
        let Some(inside) = known.get(key) else {
            return Err(unknown(doc, path, key, known.keys().cloned().collect()));
        };
        let free = inside.as_object().is_some_and(serde_json::Map::is_empty);
        if let Some(inner) = value.as_table().filter(|_| !free) {
            refuse_unknown(doc, &format!("{path}.{key}"), inner, inside)?;
        }
    }
    Ok(())
}

fn wrong_type(doc: &Document, key: &str, message: String) -> ConfigError {
    ConfigError::WrongType { key: key.to_owned(), message, place: doc.value_place(key) }
}

fn unknown(doc: &Document, path: &str, key: &str, known: Vec<String>) -> ConfigError {
    // Below this likeness a suggestion misleads more than it helps: `samples` for `zzz`.
    const LIKE: f64 = 0.6;
    let nearest = known
        .iter()
        .map(|name| (strsim::normalized_damerau_levenshtein(name, key), name))
        .filter(|(likeness, _)| *likeness >= LIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name.clone());
    let key = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    let place = doc.key_place(&key);
    ConfigError::UnknownKey { key, nearest, known, place }
}
