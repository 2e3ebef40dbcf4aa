//! Sentences and defaults of keys, as `configs/reference.toml` has them.

use serde_json::Value;
use std::collections::BTreeMap;

const TEXT: &str = include_str!("../../../../configs/reference.toml");

/// What stands above each key, and the values of those that have a default.
#[derive(Debug)]
pub(super) struct Reference {
    sentences: BTreeMap<String, String>,
    values: toml::Table,
}

impl Reference {
    pub(super) fn new() -> Self {
        let values = TEXT.parse().expect("invariant: the reference is TOML, which a test reads");
        let mut sentences = BTreeMap::new();
        let (mut table, mut above) = (String::new(), Vec::new());
        for line in TEXT.lines() {
            let comment = line.strip_prefix("# ");
            if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
                name.clone_into(&mut table);
                sentences.insert(table.clone(), above.join(" "));
                above.clear();
            } else if let Some(key) = key_of(comment.unwrap_or(line)) {
                sentences.insert(format!("{table}.{key}"), above.join(" "));
                above.clear();
            } else if let Some(sentence) = comment {
                above.push(sentence);
            } else {
                above.clear();
            }
        }
        Self { sentences, values }
    }

    /// Adds the sentence and the default of a dotted path.
    pub(super) fn describe(&self, path: &str, schema: &mut Value) {
        let sentence = self.sentences.get(path).filter(|sentence| !sentence.is_empty());
        schema["description"] = match (sentence, path) {
            (Some(sentence), _) => sentence.as_str().into(),
            // The one table whose keys say all.
            (None, path) => format!("Table `{path}`.").into(),
        };
        let Some((table, key)) = path.split_once('.') else { return };
        let has_default = !["model.name", "model.formula", "model.parameters"].contains(&path);
        let value = self.values.get(table).and_then(|table| table.get(key));
        if let Some(value) = value.filter(|_| has_default) {
            schema["default"] =
                serde_json::to_value(value).expect("invariant: TOML of the reference is JSON");
        }
    }
}

/// The key of a line `key = value`, also of one that is commented out.
fn key_of(line: &str) -> Option<&str> {
    let (key, _) = line.split_once(" = ")?;
    key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_').then_some(key)
}
