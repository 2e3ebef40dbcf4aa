//! Bad input: each kind its own message and exit code, nothing half-written taken for whole.

use isospline_tests::{Outcome, Sandbox};

/// A model file and what is wrong with it.
struct Case {
    text: &'static str,
    exit: i32,
    says: &'static [&'static str],
}

const BOX: &str = "box = [[-1.5, 1.5], [-1.5, 1.5], [-1.5, 1.5]]\n";

fn run(text: &str) -> (Sandbox, Outcome) {
    let sandbox = Sandbox::new();
    sandbox.write("bad.toml", text);
    let outcome = sandbox.isospline(&["run", "bad.toml", "--out", "out", "--no-sync"]);
    (sandbox, outcome)
}

fn refused(cases: &[Case]) {
    for case in cases {
        let (sandbox, outcome) = run(case.text);
        let Outcome { code, stderr, .. } = &outcome;
        assert_eq!(*code, case.exit, "{}\n{stderr}", case.text);
        // The frame around a message breaks its lines.
        let flat = stderr.replace(['│', '\n'], " ");
        let flat = flat.split_whitespace().collect::<Vec<_>>().join(" ");
        for word in case.says {
            assert!(flat.contains(word), "no {word:?} in\n{stderr}");
        }
        let finished = sandbox.path("out/11-fairing.isos");
        assert!(!finished.exists(), "{}", case.text);
    }
}

fn model(formula: &str) -> &'static str {
    Box::leak(format!("[model]\nformula = \"{formula}\"\n{BOX}").into_boxed_str())
}

#[test]
fn fields_that_have_no_surface() {
    refused(&[
        Case { text: model("sqrt(x - 10) + y + z"), exit: 20, says: &["not-a-number"] },
        Case {
            text: model("x^2 + y^2 + z^2 + 3"),
            exit: 21,
            says: &["empty-level-set", "[3", "model.level"],
        },
        Case {
            text: model("x^2 + y^2 - z^2*(1 - z^2)"),
            exit: 22,
            says: &["singular-point", "the surface is singular at"],
        },
        Case {
            text: model("x^2 + y^2 - 1 + 0.1*z"),
            exit: 23,
            says: &["leaves-box", "through z- and z+, at (", "16 times as large", "smax"],
        },
        Case {
            text: model("(x - 1.2)^2 + y^2 + z^2 - 1"),
            exit: 23,
            says: &["leaves-box", "through x+", "all of it lies in [[0.", "model.box"],
        },
        Case {
            text: model("x^2 + y^2 - 1"),
            exit: 27,
            says: &["two-dimensional", "does not depend on z", "smax(f"],
        },
        Case {
            text: "[model]\nformula = \"max(x, y)^2 + x^2 - 0.5\"\n",
            exit: 27,
            says: &["two-dimensional", "does not depend on z"],
        },
        Case {
            text: model("max(x^2 + y^2 + z^2 - 1, z - 0.5)"),
            exit: 28,
            says: &["sharp-edge", "60.0 degrees at (", "0.5), made by max", "smax(a, b, k)"],
        },
        Case {
            text: model("(x^2 + y^2 + z^2 - 1)^2"),
            exit: 29,
            says: &["no-sign-change", "touches zero near ("],
        },
        Case {
            text: "[model]\nformula = \"(x^2 + y^2 + z^2 - 1)^2\"\n",
            exit: 29,
            says: &["no-sign-change", "nearest to zero by ("],
        },
        Case {
            text: model("(x^2 + y^2 + z^2 - 1)^3"),
            exit: 22,
            says: &["level-not-regular", "vanishes all over the surface"],
        },
        Case {
            text: model("(x^2 + y^2 + z^2)^2 - (x^2 + y^2)"),
            exit: 22,
            says: &["singular-point", "singular at (0, 0, 0):"],
        },
    ]);
}

#[test]
fn too_few_faces_name_the_least_that_works() {
    let text = "[model]\nformula = \"(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.1\"\n\
        box = [[-1.5, 1.5], [-1.5, 1.5], [-0.5, 0.5]]\n[target]\nfaces = 4\n";
    refused(&[Case { text, exit: 24, says: &["too-few-faces", "least that works"] }]);
}

#[test]
fn nonsense_in_the_model_file() {
    refused(&[
        Case { text: "[model\n", exit: 11, says: &["toml-syntax", "bad.toml:1"] },
        Case {
            text: "[model]\nformula = \"x\"\n[target]\nface = 3\n",
            exit: 11,
            says: &["target.face", "line 4", "did you mean `faces`?", "bad.toml:4"],
        },
        Case {
            text: "[model]\nformula = \"x\"\n[target]\nfaces = \"many\"\n",
            exit: 11,
            says: &["target.faces", "wrong-type", "bad.toml:4"],
        },
        Case {
            text: "[model]\nformula = \"x\"\n[network]\nsamples = 3\n",
            exit: 11,
            says: &["network.samples", "out-of-range", "7 to 129"],
        },
        Case {
            text: "[model]\nformula = \"x\"\n[check]\ngap = nan\n",
            exit: 11,
            says: &["check.gap", "0 to 1", "bad.toml:4"],
        },
        Case {
            text: "[model]\nformula = \"x\"\n[target]\nfaces = 1000000000\n",
            exit: 11,
            says: &["`target.faces`", "bad.toml:4"],
        },
        Case {
            text: "[model]\nformula = \"x\"\nbox = [[-1e308, 1e308], [-1, 1], [-1, 1]]\n",
            exit: 11,
            says: &["model.box", "overflow", "bad.toml:3"],
        },
        Case {
            text: "[model]\nformula = \"x\"\n[model.parameters]\n\"a b\" = 1.0\n",
            exit: 11,
            says: &["model.parameters.a b", "is not a name", "bad.toml:4"],
        },
        Case { text: "[model]\nname = \"a\"\n", exit: 11, says: &["model.formula", "missing"] },
    ]);
}

#[test]
fn formulas_with_a_caret_below_the_place() {
    refused(&[
        Case {
            text: model("x^2 + log(y)"),
            exit: 12,
            says: &["ln or log10?", "model.formula:1:7", "log(y)"],
        },
        Case { text: model("x^2 + (y"), exit: 12, says: &["never closed", "model.formula:1:7"] },
    ]);
}

#[test]
fn a_long_formula_is_not_searched_for_ever_and_a_long_line_is_cut() {
    let terms: Vec<String> = (0..30_000).map(|k| format!("+0.0000001*(x - {k}.5)^2")).collect();
    let terms = terms.concat();
    let sandbox = Sandbox::new();
    let write = |end: &str| {
        sandbox.write("long.toml", format!("[model]\nformula = \"x^2+y^2+z^2-1{terms}{end}\"\n"));
        sandbox.isospline(&["run", "long.toml", "--out", "out", "--no-sync"])
    };
    let endless = write("");
    assert_eq!(endless.code, 11, "{}", endless.stderr);
    assert!(endless.stderr.contains("state model.box"), "{}", endless.stderr);
    let unknown = write("+ nope");
    assert_eq!(unknown.code, 12, "{}", unknown.stderr);
    assert!(unknown.stderr.contains("unknown name `nope`"), "{}", unknown.stderr);
    assert!(unknown.stderr.len() < 1000, "{}", unknown.stderr.len());
}

#[test]
fn a_stage_that_fails_tells_where() {
    let sandbox = Sandbox::new();
    sandbox.write("hole.obj", "v 1 0 0\nv 0 1 0\nv 0 0 0.75\nf 1 2 3\n");
    sandbox
        .write("hole.toml", format!("[model]\nformula = \"x\"\n{BOX}base_mesh = \"hole.obj\"\n"));
    let outcome =
        sandbox.isospline(&["run", "hole.toml", "--json", "--set", "model.formula=x^2+y^2+z^2-1"]);
    assert_eq!(outcome.code, 26, "{}", outcome.stderr);
    let last: serde_json::Value =
        serde_json::from_str(outcome.stdout.lines().last().unwrap()).unwrap();
    let place: Vec<f64> = serde_json::from_value(last["place"].clone()).unwrap();
    // Six digits are told.
    let six_digits = |x: f64| format!("{x:.5e}").parse::<f64>().unwrap();
    let [x, y, z] = [place[0], place[1], place[2]].map(six_digits);
    let told = format!("({x}, {y}, {z})");
    assert!(last["message"].as_str().unwrap().contains(&told), "{last}");
}

#[test]
fn files_that_are_not_there() {
    let sandbox = Sandbox::new();
    let outcome = sandbox.isospline(&["run", "nothing.toml"]);
    assert_eq!(outcome.code, 10, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("nothing.toml"), "{}", outcome.stderr);

    let text = "[model]\nformula = \"x^2+y^2+z^2-1\"\nbase_mesh = \"nothing.obj\"\n";
    refused(&[Case { text, exit: 10, says: &["nothing.obj", "base_mesh"] }]);

    let outcome = sandbox.isospline(&["check", "out"]);
    assert_eq!(outcome.code, 10, "{}", outcome.stderr);
}

#[test]
fn a_base_mesh_with_a_hole() {
    let sandbox = Sandbox::new();
    sandbox.write("hole.obj", "v 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\n");
    sandbox.write(
        "hole.toml",
        "[model]\nformula = \"x^2+y^2+z^2-1\"\nbox = [[-2,2],[-2,2],[-2,2]]\nbase_mesh = \"hole.obj\"\n",
    );
    let outcome = sandbox.isospline(&["run", "hole.toml"]);
    assert_eq!(outcome.code, 26, "{}", outcome.stderr);
}

#[test]
fn a_store_of_another_version_is_told_from_a_damaged_one() {
    let sandbox = Sandbox::new();
    sandbox.converts("torus", &["--set", "target.faces=600"]);
    let path = sandbox.path("out/11-fairing.isos");
    let sound = std::fs::read(&path).unwrap();

    let mut newer = sound.clone();
    newer[8] = 99;
    sandbox.write("out/11-fairing.isos", &newer);
    let outcome = sandbox.isospline(&["check", "out"]);
    assert_eq!(outcome.code, 30, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("version 99"), "{}", outcome.stderr);

    let mut damaged = sound.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    sandbox.write("out/11-fairing.isos", &damaged);
    let outcome = sandbox.isospline(&["check", "out"]);
    assert_eq!(outcome.code, 31, "{}", outcome.stderr);

    sandbox.write("out/11-fairing.isos", &sound[..middle]);
    let outcome = sandbox.isospline(&["inspect", "out/11-fairing.isos"]);
    assert_eq!(outcome.code, 31, "{}", outcome.stderr);
}

#[test]
fn usage_errors_exit_with_2() {
    let sandbox = Sandbox::new();
    let cases: [&[&str]; 6] = [
        &["check", ".", "--model", "a.toml"],
        &["run"],
        &["run", "a.toml", "--formula", "x"],
        &["export", "out", "--format", "doc"],
        &["run", "a.toml", "--threads", "0"],
        &["nonsense"],
    ];
    for args in cases {
        assert_eq!(sandbox.isospline(args).code, 2, "{args:?}");
    }
}
