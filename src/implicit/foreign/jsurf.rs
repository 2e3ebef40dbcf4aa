//! `.jsurf`: Java properties, of which `surface_equation` is the formula.
//!
//! The picture is clipped to the ball of radius `10^scale_factor` around the origin: so seen in
//! the gallery, where the unit sphere has a scale factor of 0.15 and two balls that reach to 3.03
//! one of 0.53.

use super::{ForeignError, ForeignErrorKind, ForeignModel, finite};
use std::collections::BTreeMap;

/// Prefix of the keys that hold values of parameters.
const PARAMETER: &str = "surface_parameter_";

pub(super) fn read(text: &str) -> Result<ForeignModel, ForeignError> {
    let properties = properties(text);
    let mut formula = None;
    let mut parameters = BTreeMap::new();
    let mut view_radius = None;
    for Property { line, key, value } in properties {
        if key == "surface_equation" {
            formula = Some(value);
        } else if key == "scale_factor" {
            view_radius = Some(libm::pow(10.0, finite(&value, line)?));
        } else if let Some(name) = key.strip_prefix(PARAMETER) {
            parameters.insert(name.to_owned(), finite(&value, line)?);
        }
    }
    let formula = formula.filter(|formula| !formula.trim().is_empty());
    let missing = ForeignErrorKind::Empty { expected: "surface_equation" };
    let formula = formula.ok_or(ForeignError { line: text.lines().count(), kind: missing })?;
    Ok(ForeignModel { formula: formula.trim().to_owned(), parameters, view_radius })
}

struct Property {
    line: usize,
    key: String,
    value: String,
}

/// All properties: comments and empty lines skipped, continued lines joined, escapes resolved.
fn properties(text: &str) -> Vec<Property> {
    let mut found = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        let line = line.trim_start();
        if line.is_empty() || line.starts_with(['#', '!']) {
            continue;
        }
        let mut whole = line.to_owned();
        while is_continued(&whole) {
            whole.pop();
            let Some((_, next)) = lines.next() else { break };
            whole.push_str(next.trim_start());
        }
        let (key, value) = split(&whole);
        found.push(Property { line: number + 1, key: unescaped(key), value: unescaped(value) });
    }
    found
}

/// Whether the line ends with an odd number of backslashes.
fn is_continued(line: &str) -> bool {
    line.bytes().rev().take_while(|&byte| byte == b'\\').count() % 2 == 1
}

/// Key and value: parted by the first `=` or `:` or white space that no backslash precedes.
fn split(line: &str) -> (&str, &str) {
    let mut escaped = false;
    let ends = |c: char| c == '=' || c == ':' || c.is_whitespace();
    for (at, c) in line.char_indices() {
        if !escaped && ends(c) {
            let rest = line[at..].trim_start();
            let rest = rest.strip_prefix(['=', ':']).unwrap_or(rest);
            return (&line[..at], rest.trim_start());
        }
        escaped = c == '\\' && !escaped;
    }
    (line, "")
}

/// The text with `\t`, `\n`, `\uXXXX` and the like replaced; another escaped character is itself.
fn unescaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars();
    while let Some(c) = rest.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match rest.next() {
            Some('t') => out.push('\t'),
            Some('n') => out.push('\n'),
            Some('r') => out.push('\r'),
            Some('u') => {
                let digits: String = rest.by_ref().take(4).collect();
                let code = u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32);
                out.push(code.unwrap_or(char::REPLACEMENT_CHARACTER));
            }
            Some(other) => out.push(other),
            None => {}
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formula_parameters_and_view_are_found() {
        let text = "#jSurfer surface description\r\n#Thu Feb 17 14:46:28 CET 2011\r\n\
            camera_type=ORTHOGRAPHIC_CAMERA\r\nscale_factor=0.5\r\n\
            surface_parameter_a=-2.5\r\nsurface_equation=x^2+y^2*z-a*z^2\r\n";
        let model = read(text).unwrap();
        assert_eq!(model.formula, "x^2+y^2*z-a*z^2");
        assert_eq!(model.parameters, BTreeMap::from([("a".to_owned(), -2.5)]));
        assert!((model.view_radius.unwrap() - 10_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn escapes_continued_lines_and_other_separators_are_those_of_java() {
        let text =
            "! note\n  surface_equation : x\\^2 \\\n    + y\\u005e2 \\= z\n\nother\\ key value";
        let found = properties(text);
        assert_eq!((found[0].line, &*found[0].value), (2, "x^2 + y^2 = z"));
        assert_eq!((&*found[1].key, &*found[1].value), ("other key", "value"));
    }

    #[test]
    fn what_is_missing_or_no_number_is_named() {
        let error = read("scale_factor=0.1\n").unwrap_err();
        assert_eq!(error.to_string(), "line 1: no surface_equation");
        let error = read("surface_equation=x\nsurface_parameter_a=much\n").unwrap_err();
        assert_eq!(error.to_string(), "line 2: `much` is not a finite number");
        assert!(read("scale_factor=inf\nsurface_equation=x").is_err());
    }
}
