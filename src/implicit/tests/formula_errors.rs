//! Every refusal of a formula: its cause and where the caret stands.

#![expect(clippy::float_cmp, reason = "these values are exact")]

use isospline_geometry::Vec3;
use isospline_implicit::{Field, Formula, FormulaError, FormulaErrorKind as Kind};
use std::collections::BTreeMap;

fn parse(text: &str) -> Result<Formula, FormulaError> {
    let parameters = BTreeMap::from([("radius".to_owned(), 2.0)]);
    Formula::parse(text, &parameters)
}

/// The refusal of `text`; `place` marks the blamed characters with `^` below the line.
#[track_caller]
fn check(text: &str, line: usize, place: &str, kind: &Kind) {
    let error = parse(text).expect_err("a formula to refuse");
    assert_eq!(&error.kind, kind, "{text}");
    assert_eq!(error.line, line, "{text}");
    let shown = error.rendered();
    let caret = shown.lines().last().and_then(|line| line.split_once("| "));
    assert_eq!(caret.map(|(_, caret)| caret), Some(place), "\n{shown}");
    assert_eq!(Some(error.column - 1), place.find('^'), "{text}");
}

fn name(name: &str, nearest: Option<&str>) -> Kind {
    Kind::UnknownName { name: name.into(), nearest: nearest.map(str::to_owned) }
}

#[test]
fn names_that_are_not_known_are_marked_with_the_nearest() {
    check("x^2 + radus", 1, "      ^^^^^", &name("radus", Some("radius")));
    check("x + X", 1, "    ^", &name("X", Some("x")));
    check("x + w", 1, "    ^", &name("w", None));
    check("r2 = x^2\n  r22 + 1", 2, "  ^^^", &name("r22", Some("r2")));
    let nearest = Some("sqrt".to_owned());
    check("sqr(x)", 1, "^^^", &Kind::UnknownFunction { name: "sqr".into(), nearest });
}

#[test]
fn functions_are_called_with_the_right_arguments() {
    check("y + log(x)", 1, "    ^^^", &Kind::AmbiguousLog);
    check("1 + sin", 1, "    ^^^", &Kind::NoArguments { name: "sin" });
    check("x(2)", 1, "^", &Kind::NotAFunction { name: "x".into() });
    let count = |name, least, most, found| Kind::ArgumentCount { name, least, most, found };
    check("1 + atan2(x)", 1, "    ^^^^^^^^", &count("atan2", 2, 2, 1));
    check("sin(x, y)", 1, "^^^^^^^^^", &count("sin", 1, 1, 2));
    check("min(x)", 1, "^^^^^^", &count("min", 2, usize::MAX, 1));
    check("exp()", 1, "^^^^^", &count("exp", 1, 1, 0));
    check("smin(x, y, 0)", 1, "^^^^^^^^^^^^^", &Kind::BlendWidth { width: 0.0 });
}

#[test]
fn syntax_is_marked_where_it_breaks() {
    let value = |found: &str| Kind::ExpectedValue { found: found.into() };
    let operator = |found: &str| Kind::ExpectedOperator { found: found.into() };
    check("x + * y", 1, "    ^", &value("`*`"));
    check("x +", 1, "   ^", &value("the end of the formula"));
    check("x + ; y", 1, "    ^", &value("the end of the line"));
    check("2 x", 1, "  ^", &operator("`x`"));
    check("2(x)", 1, " ^", &operator("`(`"));
    check("y * (x + 1", 1, "    ^", &Kind::Unclosed);
    check("r = (x + y\nr^2", 1, "    ^", &Kind::Unclosed);
    check("x + 1)", 1, "     ^", &Kind::Unopened);
    check("(x, y)", 1, "  ^", &Kind::StrayComma);
    check("x, y", 1, " ^", &Kind::StrayComma);
    check("x $ y", 1, "  ^", &Kind::UnexpectedCharacter { character: '$' });
    check("x + 1.2.3", 1, "    ^^^^^", &Kind::BadNumber { text: "1.2.3".into() });
}

#[test]
fn lines_are_definitions_and_one_value() {
    check("", 1, "^", &Kind::Empty);
    check("# nothing\n\n", 3, "^", &Kind::Empty);
    check("r = x^2", 1, "       ^", &Kind::NoValue);
    check("x + 1\ny", 1, "^^^^^", &Kind::ValueNotLast);
    check("r = x; r = y; r", 1, "       ^", &Kind::DefinedTwice { name: "r".into() });
    check("radius = 1; x", 1, "^^^^^^", &Kind::DefinedTwice { name: "radius".into() });
    check("pi = 3; x", 1, "^^", &Kind::Reserved { name: "pi".into() });
}

#[test]
fn carets_stand_below_their_characters_behind_tabs_and_wide_text() {
    let error = parse("\t# caf\u{e9}\r\n\tx + w\r\n").unwrap_err();
    assert_eq!((error.line, error.column), (2, 6));
    assert_eq!(error.rendered().lines().last(), Some("  | \t    ^"));
    assert_eq!(&"\t# caf\u{e9}\r\n\tx + w\r\n"[error.span.clone()], "w");
    let long = format!("{} + w + {}", vec!["x"; 5000].join(" + "), vec!["x"; 5000].join(" + "));
    let error = parse(&long).unwrap_err();
    assert_eq!(error.column, 5000 * 4 + 1);
    let shown = error.rendered();
    let lines: Vec<&str> = shown.lines().collect();
    assert!(lines[2].len() < 200);
    assert_eq!(lines[2].as_bytes()[lines[3].find('^').unwrap()], b'w');
}

#[test]
fn parameters_have_names_and_finite_values() {
    let refused = |name: &str, value: f64| {
        let parameters = BTreeMap::from([(name.to_owned(), value)]);
        Formula::parse("x", &parameters).unwrap_err().kind
    };
    assert_eq!(refused("2r", 1.0), Kind::ParameterName { name: "2r".into() });
    assert_eq!(refused("sin", 1.0), Kind::ParameterReserved { name: "sin".into() });
    let infinite = f64::INFINITY;
    assert_eq!(refused("r", infinite), Kind::ParameterValue { name: "r".into(), value: infinite });
}

#[test]
fn deep_nesting_is_refused_and_length_is_not() {
    for deep in ["(".repeat(100_000), "sin(".repeat(100_000), "2^".repeat(100_000)] {
        let error = parse(&format!("{deep}x")).unwrap_err();
        assert_eq!(error.kind, Kind::TooDeep { limit: 200 });
    }
    let signs = format!("{}x", "-".repeat(100_001));
    assert_eq!(parse(&signs).unwrap().value(Vec3::x()), -1.0);
}

#[test]
fn a_million_terms_are_read_and_evaluated() {
    let terms: Vec<String> = (0..1000).map(|i| format!("x*{i}")).collect();
    let text = vec![terms.join(" + "); 1000].join(" + ");
    let field = parse(&text).unwrap();
    assert_eq!(field.value(Vec3::x()), 499_500_000.0);
}

#[test]
fn high_powers_are_quick_and_right() {
    let value = |text: &str, x: f64| parse(text).unwrap().value(Vec3::new(x, 0.0, 0.0));
    assert_eq!(value("x^1e9", 1.0), 1.0);
    assert_eq!(value("x^1e9", -1.0), 1.0);
    assert_eq!(value("x^1000000001", -1.0), -1.0);
    assert_eq!(value("x^64", -2.0), 2.0_f64.powi(64));
    assert_eq!(value("x^-2", 4.0), 0.0625);
    assert!((value("x^2.5", 4.0) - 32.0).abs() < 1e-12);
}
