//! As much of a validator of JSON Schema as the schema of model files asks for.

use serde_json::Value;

/// Why a value does not fit a schema; `None` if it does. A keyword that is not known here is a
/// refusal, so that nothing is passed unread.
pub(super) fn refusal(schema: &Value, value: &Value) -> Option<String> {
    let keywords = schema.as_object().expect("a schema is an object");
    let known = |keyword: &str| {
        let notes = ["$schema", "title", "description", "default"];
        notes.contains(&keyword) || keyword == "properties" || keyword == "required"
    };
    keywords.iter().find_map(|(keyword, limit)| match keyword.as_str() {
        "additionalProperties" => extra(schema, value, limit),
        "properties" | "required" if !value.is_object() => Some(format!("{value} is no object")),
        "properties" => inner(limit, value),
        "required" => {
            let lacks = |key: &&Value| value.get(key.as_str().unwrap()).is_none();
            limit.as_array().unwrap().iter().find(lacks).map(|key| format!("{key} is missing"))
        }
        "anyOf" => {
            let all = limit.as_array().unwrap();
            let fits = all.iter().any(|form| refusal(form, value).is_none());
            (!fits).then(|| format!("{value} fits none of {limit}"))
        }
        "allOf" => limit.as_array().unwrap().iter().find_map(|form| refusal(form, value)),
        "not" => refusal(limit, value).is_none().then(|| format!("{value} fits {limit}")),
        keyword if known(keyword) => None,
        keyword => (!holds(keyword, limit, value)).then(|| format!("{value}: {keyword} {limit}")),
    })
}

fn inner(properties: &Value, value: &Value) -> Option<String> {
    let members = value.as_object().unwrap().iter();
    members
        .filter_map(|(key, value)| Some((properties.get(key)?, value)))
        .find_map(|(schema, value)| refusal(schema, value))
}

fn extra(schema: &Value, value: &Value, limit: &Value) -> Option<String> {
    let known = schema.get("properties").and_then(Value::as_object);
    let is_known = |key: &String| known.is_some_and(|known| known.contains_key(key));
    let mut others = value.as_object()?.iter().filter(|(key, _)| !is_known(key));
    match limit {
        Value::Bool(false) => others.next().map(|(key, _)| format!("nobody knows {key}")),
        schema => others.find_map(|(_, value)| refusal(schema, value)),
    }
}

fn holds(keyword: &str, limit: &Value, value: &Value) -> bool {
    let (number, bound) = (value.as_f64(), limit.as_f64());
    let length = value.as_array().map(|items| items.len() as u64);
    match keyword {
        "type" => match limit.as_str().unwrap() {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "boolean" => value.is_boolean(),
            "number" => value.is_number(),
            "integer" => value.is_i64() || value.is_u64(),
            _ => false,
        },
        "enum" => limit.as_array().unwrap().contains(value),
        "minimum" => number >= bound,
        "maximum" => number <= bound,
        "exclusiveMinimum" => number > bound,
        "exclusiveMaximum" => number < bound,
        "minItems" => length >= limit.as_u64(),
        "maxItems" => length <= limit.as_u64(),
        "items" => value
            .as_array()
            .is_some_and(|items| items.iter().all(|item| refusal(limit, item).is_none())),
        _ => false,
    }
}
