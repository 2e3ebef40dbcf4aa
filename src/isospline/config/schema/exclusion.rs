//! Which keys of a table exclude each other, found by putting each two of them to the reader.

use super::{Document, verdict_of, words};
use crate::config::ConfigError;
use serde_json::{Value, json};

/// A schema for each two keys of a table that the reader takes alone but not together.
pub(super) fn exclusions(table: &str, keys: &[String]) -> Vec<Value> {
    let sound: Vec<(&String, toml::Value)> =
        keys.iter().filter_map(|key| Some((key, sound_value(table, key)?))).collect();
    let mut found = Vec::new();
    for (k, (key, value)) in sound.iter().enumerate() {
        for (other, other_value) in &sound[k + 1..] {
            let both = [(*key, value), (*other, other_value)];
            let put = |doc: &mut Document| {
                for (key, value) in both {
                    doc.put(table, key, value.clone());
                }
            };
            if matches!(verdict_of(put), Err(ConfigError::Conflict { .. })) {
                found.push(json!({ "not": { "required": [key, other] } }));
            }
        }
    }
    found
}

/// Some value that the reader takes for a key; `None` where none of a few does.
fn sound_value(table: &str, key: &str) -> Option<toml::Value> {
    let numbers = [0.5, 1e-3, 1.0, 100.0].map(toml::Value::from);
    let integers = [0, 1, 8, 100, 10_000].map(toml::Value::from);
    let words = words(table, key).into_iter().map(toml::Value::from);
    let others = [true.into(), toml::Value::from("x")];
    let mut all = integers.into_iter().chain(numbers).chain(words).chain(others);
    all.find(|value| verdict_of(|doc| doc.put(table, key, value.clone())).is_ok())
}
