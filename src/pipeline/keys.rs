//! What enters the key of a node, as one list: hashed to find what is fresh, compared to say why
//! the rest is not.

use crate::registry::StageInfo;
use crate::{ModelKey, Node};
use isospline_artifact::{Key, KeyHasher};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;

/// Longer values are replaced by their hash: a formula of a million terms is not to stand in
/// every record.
const LONGEST_VALUE: usize = 512;
/// Longer values are not shown in a reason.
const LONGEST_SHOWN: usize = 40;

/// One named value that may change the output.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ingredient {
    /// `stage`, `version`, `schema`, `model.level`, `params.samples`.
    pub name: String,
    /// Its text, or `blake3:` and the hash of a long text.
    pub value: String,
}

impl Ingredient {
    fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        let value = value.into();
        if value.len() <= LONGEST_VALUE {
            return Self { name: name.into(), value };
        }
        let mut hasher = KeyHasher::new("isospline value");
        hasher.field(value.as_bytes());
        Self { name: name.into(), value: format!("blake3:{}", hasher.finish()) }
    }
}

/// Why an artifact is not what the graph asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A value has changed, come or gone.
    Value {
        /// Name of the ingredient.
        name: String,
        /// Value in the artifact's record.
        old: Option<String>,
        /// Value now.
        new: Option<String>,
    },
    /// An input holds other rows.
    Input {
        /// Its kind.
        kind: String,
    },
    /// An input is stale itself.
    Pending {
        /// Its label.
        stage: String,
    },
    /// The model is a closure, which has no text to compare.
    Unhashable,
    /// The record that could tell is lost.
    Unrecorded,
    /// The user asked for it.
    Asked,
    /// There is no artifact.
    Missing,
    /// The file is damaged.
    Damaged,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value { name, old, new } => write_change(f, name, old.as_ref(), new.as_ref()),
            Self::Input { kind } => write!(f, "{} changed", kind.replace('_', " ")),
            Self::Pending { stage } => write!(f, "{stage} is not fresh"),
            Self::Unhashable => f.write_str("a closure cannot be compared"),
            Self::Unrecorded => f.write_str("made from other inputs; its record is lost"),
            Self::Asked => f.write_str("asked for"),
            Self::Missing => f.write_str("missing"),
            Self::Damaged => f.write_str("damaged"),
        }
    }
}

fn write_change(
    f: &mut fmt::Formatter<'_>,
    name: &str,
    old: Option<&String>,
    new: Option<&String>,
) -> fmt::Result {
    let name = name.strip_prefix("params.").unwrap_or(name);
    let short = |value: &String| value.len() <= LONGEST_SHOWN && !value.starts_with("blake3:");
    match (old, new) {
        (Some(old), Some(new)) if short(old) && short(new) => write!(f, "{name} {old} -> {new}"),
        (Some(_), Some(_)) => write!(f, "{name} changed"),
        (None, Some(new)) if short(new) => write!(f, "{name} = {new} is new"),
        (None, _) => write!(f, "{name} is new"),
        (Some(_), None) => write!(f, "{name} is gone"),
    }
}

/// The list of a node, without its inputs.
pub(crate) fn ingredients(
    info: &StageInfo,
    node: &Node,
    params: &Value,
    model: &ModelKey,
) -> Vec<Ingredient> {
    let mut list = vec![
        Ingredient::new("stage", info.name),
        Ingredient::new("version", info.version.to_string()),
        Ingredient::new("kind", info.kind),
        Ingredient::new("schema", info.schema.to_string()),
    ];
    if node.round > 0 {
        list.push(Ingredient::new("round", node.round.to_string()));
    }
    if !model.hashable {
        list.push(Ingredient::new("model", "closure"));
    }
    let content = model.content.iter();
    list.extend(content.map(|(name, value)| Ingredient::new(format!("model.{name}"), value)));
    flatten("params", params, &mut list);
    list
}

/// One ingredient a leaf of the table, by sorted paths: `params.gate.turning_deg`.
fn flatten(path: &str, value: &Value, list: &mut Vec<Ingredient>) {
    let Value::Object(table) = value else {
        list.push(Ingredient::new(path, canonical_text(value)));
        return;
    };
    let mut keys: Vec<&String> = table.keys().collect();
    keys.sort();
    for key in keys {
        flatten(&format!("{path}.{key}"), &table[key.as_str()], list);
    }
}

/// JSON with sorted keys and no spaces.
pub(crate) fn canonical_text(value: &Value) -> String {
    match value {
        Value::Object(table) => {
            let mut keys: Vec<&String> = table.keys().collect();
            keys.sort();
            let name = |key: &String| Value::String(key.clone());
            let field = |key| format!("{}:{}", name(key), canonical_text(&table[key.as_str()]));
            format!("{{{}}}", keys.into_iter().map(field).collect::<Vec<_>>().join(","))
        }
        Value::Array(items) => {
            format!("[{}]", items.iter().map(canonical_text).collect::<Vec<_>>().join(","))
        }
        leaf => leaf.to_string(),
    }
}

/// The key over a list and the inputs `(kind, key)`.
pub(crate) fn key_of<'a>(
    purpose: &str,
    list: &[Ingredient],
    inputs: impl IntoIterator<Item = (&'a str, Key)>,
) -> Key {
    let mut hasher = KeyHasher::new(purpose);
    hasher.number(list.len() as u64);
    for ingredient in list {
        hasher.field(ingredient.name.as_bytes());
        hasher.field(ingredient.value.as_bytes());
    }
    for (kind, key) in inputs {
        hasher.field(kind.as_bytes());
        hasher.field(&key.0);
    }
    hasher.finish()
}

/// What differs between two lists, in the order of the new one.
pub(crate) fn changes(old: &[Ingredient], new: &[Ingredient]) -> Vec<Reason> {
    let value = |list: &[Ingredient], name: &str| {
        list.iter().find(|i| i.name == name).map(|i| i.value.clone())
    };
    let gone = old.iter().filter(|i| value(new, &i.name).is_none());
    let names = new.iter().chain(gone).map(|i| &i.name);
    let change = |name: &String| Reason::Value {
        name: name.clone(),
        old: value(old, name),
        new: value(new, name),
    };
    names.filter(|name| value(old, name) != value(new, name)).map(change).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn list(params: &Value) -> Vec<Ingredient> {
        let mut out = Vec::new();
        flatten("params", params, &mut out);
        out
    }

    #[test]
    fn the_order_of_keys_does_not_enter_the_list() {
        let text = r#"{"b":1,"a":{"y":[1,{"d":1,"c":2}],"x":0.1}}"#;
        let other = r#"{"a":{"x":0.1,"y":[1,{"c":2,"d":1}]},"b":1}"#;
        let parse = |t: &str| list(&serde_json::from_str(t).unwrap());
        assert_eq!(parse(text), parse(other));
        assert_eq!(parse(text)[1].value, r#"[1,{"c":2,"d":1}]"#);
    }

    #[test]
    fn every_change_is_named_with_old_and_new_value() {
        let text = |old: Value, new: Value| {
            let reasons = changes(&list(&old), &list(&new));
            reasons.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert_eq!(text(json!({"samples": 17}), json!({"samples": 24})), ["samples 17 -> 24"]);
        assert_eq!(text(json!({}), json!({"gate": {"turn": 1.5}})), ["gate.turn = 1.5 is new"]);
        assert_eq!(text(json!({"a": 1, "b": 2}), json!({"b": 2})), ["a is gone"]);
        let long = "x".repeat(LONGEST_VALUE);
        assert_eq!(text(json!({"f": "x"}), json!({"f": long})), ["f changed"]);
        assert_eq!(text(json!({"a": 1}), json!({"a": 1})), [""; 0]);
    }

    #[test]
    fn long_values_are_told_apart_by_their_hash() {
        let text = |tail: &str| Ingredient::new("f", "x".repeat(LONGEST_VALUE) + tail);
        assert_ne!(text("a"), text("b"));
        assert!(text("a").value.len() < 100);
    }
}
