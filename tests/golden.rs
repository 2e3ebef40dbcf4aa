//! What comes out stays what it was, figure by figure and byte by byte, until someone means it.
//!
//! `tests/golden/<model>.txt` holds figures that a person can judge, rounded, and then the content
//! key of each artifact: equal bytes on every machine. `make golden` rewrites the files; the diff
//! is to be read.

use isospline_tests::{Sandbox, number, root};
use std::fmt::Write;

/// Models small enough to be quick, one imported and two from formulas.
const MODELS: [&str; 3] = ["torus_regular", "torus", "dodecahedron"];

fn golden(model: &str) -> String {
    let sandbox = Sandbox::new();
    sandbox.converts(model, &[]);
    let report = sandbox.checked();
    let mut text = format!("model {model}\n");
    for name in ["faces", "vertices", "components", "genus"] {
        writeln!(text, "{name} {}", report[name]).expect("invariant: strings take writes");
    }
    for name in ["rel_error_max", "rel_error_rms"] {
        writeln!(text, "{name} {:.1e}", number(&report, name)).expect("invariant: as above");
    }
    for (name, _) in sandbox.artifacts() {
        let inspected = sandbox.succeeds(&["inspect", &format!("out/{name}")]).stdout;
        let content = inspected.lines().find(|line| line.starts_with("content"));
        let key = content.and_then(|line| line.split_whitespace().nth(1)).expect("a content key");
        writeln!(text, "{name} {}", &key[..16]).expect("invariant: as above");
    }
    text
}

#[test]
#[expect(clippy::disallowed_methods, reason = "rewriting the golden files is no user's data")]
fn golden_figures_and_bytes_are_unchanged() {
    for model in MODELS {
        let path = root().join("tests/golden").join(format!("{model}.txt"));
        let now = golden(model);
        if std::env::var_os("ISOSPLINE_GOLDEN").is_some_and(|mode| mode == "rewrite") {
            std::fs::write(&path, &now).expect("the golden file can be written");
        }
        let expected = std::fs::read_to_string(&path).expect("a golden file: run `make golden`");
        assert_eq!(now, expected, "{model}: if this is meant, run `make golden`");
    }
}
