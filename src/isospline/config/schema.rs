//! The JSON Schema of model files, for editors, found by asking the reader itself.
//!
//! There is no second list of keys: their names are those that the reader offers for a key that
//! nobody knows, types and ranges are what it takes of values put to it, and sentences and
//! defaults stand in `configs/reference.toml`. So the schema cannot say what the reader does not.

mod exclusion;
mod range;
mod reference;

#[cfg(test)]
mod validator;

use crate::config::{ConfigError, Document, ModelFile};
use reference::Reference;
use serde_json::{Value, json};

/// A key that no table has.
const NOBODY_KNOWS: &str = "a_key_that_nobody_knows";
/// A text that no key takes unless it takes any.
const NO_WORD: &str = "no such word";

/// The schema, draft 7, which editors of TOML understand.
pub fn schema() -> Value {
    let reference = Reference::new();
    let mut properties = serde_json::Map::new();
    for table in names_at("") {
        properties.insert(table.clone(), table_schema(&table, &reference));
    }
    if let Some((table, key)) = missing() {
        properties[&table]["required"] = json!([key]);
        return json!({
            "$schema": "http://json-schema.org/draft-07/schema#",
            "title": "Model file of isospline",
            "type": "object",
            "additionalProperties": false,
            "required": [table],
            "properties": properties,
        });
    }
    unreachable!("invariant: there is no model without a formula")
}

/// What the reader says to one value in a model that is otherwise sound.
fn verdict(table: &str, key: &str, value: toml::Value) -> Result<(), ConfigError> {
    verdict_of(|doc| doc.put(table, key, value))
}

/// What the reader says to a sound model to which something is added.
fn verdict_of(add: impl FnOnce(&mut Document)) -> Result<(), ConfigError> {
    let mut doc = Document::default();
    doc.put("model", "formula", "x");
    add(&mut doc);
    ModelFile::from_document(&doc).map(|_| ())
}

/// Whether the reader takes a value, out of range or not.
fn fits(table: &str, key: &str, value: impl Into<toml::Value>) -> bool {
    let path = format!("{table}.{key}");
    match verdict(table, key, value.into()) {
        Err(ConfigError::WrongType { key, .. }) => !key.starts_with(&path),
        _ => true,
    }
}

/// Names of the tables, or of the keys of a table.
fn names_at(table: &str) -> Vec<String> {
    let mut doc = Document::default();
    doc.put("model", "formula", "x");
    match table {
        "" => doc.put(NOBODY_KNOWS, NOBODY_KNOWS, 1),
        _ => doc.put(table, NOBODY_KNOWS, 1),
    }
    match ModelFile::from_document(&doc) {
        Err(ConfigError::UnknownKey { known, .. }) => known,
        _ => Vec::new(),
    }
}

/// The key without which there is no model, and its table.
fn missing() -> Option<(String, String)> {
    match ModelFile::from_document(&Document::default()) {
        Err(ConfigError::Missing { key }) => {
            key.split_once('.').map(|(table, key)| (table.to_owned(), key.to_owned()))
        }
        _ => None,
    }
}

fn table_schema(table: &str, reference: &Reference) -> Value {
    let mut properties = serde_json::Map::new();
    for key in names_at(table) {
        let is_elsewhere =
            matches!(verdict(table, &key, 1.into()), Err(ConfigError::Elsewhere { .. }));
        if !is_elsewhere {
            let path = format!("{table}.{key}");
            let mut schema = key_schema(table, &key);
            reference.describe(&path, &mut schema);
            properties.insert(key, schema);
        }
    }
    let keys: Vec<String> = properties.keys().cloned().collect();
    let mut schema =
        json!({ "type": "object", "additionalProperties": false, "properties": properties });
    let exclusions = exclusion::exclusions(table, &keys);
    if !exclusions.is_empty() {
        schema["allOf"] = exclusions.into();
    }
    reference.describe(table, &mut schema);
    schema
}

fn key_schema(table: &str, key: &str) -> Value {
    let mut forms = Vec::new();
    if fits(table, key, true) {
        forms.push(json!({ "type": "boolean" }));
    }
    if fits(table, key, 1) {
        forms.push(range::number(table, key));
    }
    if fits(table, key, NO_WORD) {
        forms.push(json!({ "type": "string" }));
    } else {
        let words = words(table, key);
        if !words.is_empty() {
            forms.push(json!({ "type": "string", "enum": words }));
        }
    }
    forms.extend(list_forms(table, key));
    let free = toml::Table::from_iter([("a".to_owned(), toml::Value::Float(1.5))]);
    if fits(table, key, free) {
        forms.push(json!({ "type": "object", "additionalProperties": { "type": "number" } }));
    }
    match forms.len() {
        1 => forms.remove(0),
        _ => json!({ "anyOf": forms }),
    }
}

/// The lists that a key takes: three sides of a box, points, or lists of points.
fn list_forms(table: &str, key: &str) -> Vec<Value> {
    let list = |items: Value| json!({ "type": "array", "items": items });
    let fixed = |items: Value, n: usize| {
        let mut fixed = list(items);
        fixed["minItems"] = n.into();
        fixed["maxItems"] = n.into();
        fixed
    };
    let point = toml::Value::Array(vec![0.5.into(); 3]);
    let number = json!({ "type": "number" });
    let mut forms = Vec::new();
    let sides = [0, 1, 2].map(|k| toml::Value::Array(vec![k.into(), (k + 1).into()]));
    if fits(table, key, sides.to_vec()) {
        forms.push(fixed(fixed(number.clone(), 2), 3));
    }
    if fits(table, key, vec![point.clone()]) {
        forms.push(list(fixed(number.clone(), 3)));
    }
    if fits(table, key, vec![toml::Value::Array(vec![point])]) {
        forms.push(list(list(fixed(number, 3))));
    }
    forms
}

/// The words that a key takes: those in quotes in what the reader says to another one, if it takes
/// them.
fn words(table: &str, key: &str) -> Vec<String> {
    let Err(ConfigError::WrongType { message, .. }) = verdict(table, key, NO_WORD.into()) else {
        return Vec::new();
    };
    let expected = message.split_once("expected").map_or("", |(_, expected)| expected);
    let quoted = expected.split(['`', '"']).skip(1).step_by(2);
    quoted.filter(|word| fits(table, key, *word)).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::validator::refusal;
    use super::*;

    fn read(text: &str) -> Value {
        serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
    }

    #[test]
    fn every_model_file_of_the_repository_fits() {
        let schema = schema();
        let mut n_files = 0;
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs");
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "toml") {
                let text = std::fs::read_to_string(&path).unwrap();
                assert_eq!(refusal(&schema, &read(&text)), None, "{path:?}");
                n_files += 1;
            }
        }
        assert!(n_files > 10, "{n_files}");
    }

    #[test]
    fn the_reader_and_the_schema_say_the_same() {
        let schema = schema();
        let model = "[model]\nformula = \"x\"\n";
        for (text, is_sound) in [
            ("", true),
            ("level = 2", true),
            ("level = \"2\"", false),
            ("levle = 2", false),
            ("inside = \"positive\"", true),
            ("inside = \"left\"", false),
            ("box = \"auto\"", true),
            ("box = \"big\"", false),
            ("box = [[0, 1], [0, 1], [0, 1]]", true),
            ("box = [[0, 1], [0, 1]]", false),
            ("box_limit = 0", false),
            ("unit = \"mm\"", true),
            ("unit = \"parsec\"", false),
            ("parameters = { a = 1 }", true),
            ("parameters = { a = \"1\" }", false),
            ("base_mesh = \"a.obj\"", true),
            ("[target]\nfaces = 4", true),
            ("[target]\nfaces = 3", false),
            ("[target]\nfaces = 5000000000", false),
            ("[target]\nfaces = 7.5", false),
            ("[target]\ntolerance = 0.5", true),
            ("[target]\ntolerance = 1.0", false),
            ("[target]\ntolerance = 0", false),
            ("[target]\nfaces = 9\ntolerance = 1e-6", false),
            ("[target]\nfaces = 9\ntolerance_abs = 1e-6", false),
            ("[target]\ntolerance = 1e-6\ntolerance_abs = 1e-6", false),
            ("[target]\ntolerance_abs = 1e-6\nfit = \"paper\"", true),
            ("[target]\nfit = \"fast\"", true),
            ("[target]\nfit = \"slow\"", false),
            ("[check]\nsame_bits = false", true),
            ("[check]\nsame_bits = 1", false),
            ("[decimate]\nfaces = 100", false),
            ("[decimate]\nmin_quality = 1", true),
            ("[decimate]\nmin_quality = 1.5", false),
            ("[network]\nsamples = 129", true),
            ("[network]\nsamples = 130", false),
            ("[project]", true),
            ("[projekt]", false),
        ] {
            let text = format!("{model}{text}\n");
            let doc = Document::parse("a.toml", &text).unwrap();
            assert_eq!(ModelFile::from_document(&doc).is_ok(), is_sound, "the reader of {text}");
            let found = refusal(&schema, &read(&text));
            assert_eq!(found.is_none(), is_sound, "{text}: {found:?}");
        }
        assert!(refusal(&schema, &read("[target]\nfaces = 7")).is_some());
    }

    #[test]
    fn every_key_has_one_form_or_says_which_and_is_described() {
        let schema = schema();
        for (table, inner) in schema["properties"].as_object().unwrap() {
            assert!(inner["description"].is_string(), "{table}");
            for (key, schema) in inner["properties"].as_object().unwrap() {
                let forms = schema["anyOf"].as_array().map_or(1, Vec::len);
                assert!(forms > 0, "{table}.{key} takes nothing");
                assert!(schema["description"].is_string(), "{table}.{key}");
            }
        }
    }

    #[test]
    fn the_schema_names_defaults_and_ranges() {
        let schema = schema();
        let key = |table: &str, key: &str| schema["properties"][table]["properties"][key].clone();
        assert_eq!(key("target", "faces")["default"], 2000);
        assert_eq!(key("target", "faces")["minimum"], 4);
        assert_eq!(key("target", "tolerance")["exclusiveMaximum"], 1.0);
        assert_eq!(key("network", "samples")["maximum"], 129);
        assert_eq!(key("decimate", "max_slope")["minimum"], 0.05);
        assert_eq!(key("model", "inside")["enum"], json!(["auto", "negative", "positive"]));
        assert_eq!(schema["required"], json!(["model"]));
    }
}
