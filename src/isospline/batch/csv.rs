//! The table of a batch for spreadsheets: comma-separated, quoted as RFC 4180 has it.

use crate::batch::{Part, Record};
use std::fmt::Display;

const HEAD: [&str; 20] = [
    "model",
    "outcome",
    "reason",
    "sentence",
    "x",
    "y",
    "z",
    "what_to_do",
    "faces",
    "components",
    "genus",
    "genus_of_each",
    "volume_of_each",
    "topology",
    "error_max_rel",
    "error_rms_rel",
    "g1_angle_deg_max",
    "seconds",
    "peak_resident_bytes",
    "folder",
];

/// The records as a table with a head, a line each.
pub fn csv(records: &[&Record]) -> String {
    let mut table = HEAD.join(",");
    table.push_str("\r\n");
    for record in records {
        let fields = fields(record).map(|field| quoted(&field));
        table.push_str(&fields.join(","));
        table.push_str("\r\n");
    }
    table
}

fn fields(record: &Record) -> [String; 20] {
    let axis = |k: usize| optional(record.point.map(|point| point[k]));
    let each = |value: fn(&Part) -> String| {
        let all: Vec<String> = record.parts.iter().map(value).collect();
        all.join(" ")
    };
    [
        harmless(&record.model),
        record.outcome.word().to_owned(),
        harmless(&record.reason),
        harmless(&record.sentence),
        axis(0),
        axis(1),
        axis(2),
        harmless(&record.what_to_do),
        optional(record.faces),
        optional(record.components),
        optional(record.genus),
        each(|part| part.genus.map_or_else(|| "-".to_owned(), |genus| genus.to_string())),
        each(|part| part.volume.map_or_else(|| "-".to_owned(), |v| format!("{v:.6e}"))),
        record.topology.clone(),
        optional(record.error_max_rel.map(|e| format!("{e:e}"))),
        optional(record.error_rms_rel.map(|e| format!("{e:e}"))),
        optional(record.g1_angle_deg_max.map(|a| format!("{a:e}"))),
        format!("{:.3}", record.seconds),
        optional(record.peak_resident_bytes),
        harmless(&record.folder),
    ]
}

fn optional(value: Option<impl Display>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// A text that a spreadsheet would take for a formula is set off by an apostrophe.
fn harmless(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        return format!("'{text}");
    }
    text.to_owned()
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", field.replace('"', "\"\""));
    }
    field.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_quotes_and_lines_stay_in_their_field() {
        assert_eq!(quoted("a,b"), "\"a,b\"");
        assert_eq!(quoted("say \"so\""), "\"say \"\"so\"\"\"");
        assert_eq!(quoted("two\nlines"), "\"two\nlines\"");
        assert_eq!(quoted("plain text"), "plain text");
    }

    #[test]
    fn a_name_is_never_a_formula_of_the_spreadsheet() {
        assert_eq!(harmless("=1+1.toml"), "'=1+1.toml");
        assert_eq!(harmless("a=1"), "a=1");
    }
}
