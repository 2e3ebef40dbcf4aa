//! The commands as the README promises them.

use isospline_tests::{Sandbox, config_path, root};
use std::io::Read;
use std::process::Stdio;

const SMALL: [&str; 4] = ["--set", "target.faces=600", "--set", "target.fit=paper"];

#[test]
fn a_formula_alone_becomes_a_surface() {
    let sandbox = Sandbox::new();
    let args = ["run", "--formula", "x^2 + 2*y^2 + z^2 - 1", "--set", "target.faces=200"];
    let outcome = sandbox.succeeds(&args);
    assert!(outcome.stderr.contains("model.box is auto"), "{}", outcome.stderr);
    assert!(outcome.stdout.contains("check passed"), "{}", outcome.stdout);
    assert!(sandbox.path("out/formula/model.toml").is_file());
}

#[test]
fn a_formula_that_is_positive_inside_is_turned_and_that_is_told() {
    let sandbox = Sandbox::new();
    let args = ["--set", "target.faces=200", "--out", "out"];
    let run = |formula| [&["run", "--formula", formula], &args[..]].concat();
    let plain = sandbox.succeeds(&run("x^2 + y^2 + z^2 - 1")).stderr;
    assert!(!plain.contains("the sign is turned"), "{plain}");
    let turned = sandbox.succeeds(&run("1 - x^2 - y^2 - z^2")).stderr;
    assert!(turned.contains("the sign is turned"), "{turned}");
    assert_eq!(sandbox.checked()["flipped_patches"], 0);
}

#[test]
fn a_formula_may_begin_with_a_minus_and_be_small() {
    let sandbox = Sandbox::new();
    let args = ["run", "--formula", "-(x^2+y^2+z^2)*1e18+1", "--set", "target.faces=200"];
    let told = sandbox.isospline(&[&args[..], &["--set", "model.box_limit=1e-8"]].concat()).stderr;
    assert!(told.contains("found [[-1."), "{told}");
    assert!(told.contains("e-9"), "{told}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_the_program_while_no_stage_runs() {
    let terms: Vec<String> = (0..200_000).map(|k| format!("+0.0000001*sin({k}*x)")).collect();
    let terms = terms.concat();
    let sandbox = Sandbox::new();
    let text =
        format!("[model]\nformula = \"x^2+y^2+z^2-1{terms}\"\nbox = [[-2, 2], [-2, 2], [-2, 2]]\n");
    sandbox.write("slow.toml", text);
    let mut child = sandbox.command(&["run", "slow.toml"]).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_secs(1));
    let id = child.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!sandbox.path("out").exists());
}

#[test]
fn a_folder_with_a_base_mesh_can_be_moved() {
    let sandbox = Sandbox::new();
    let mesh = root().join("tests/fixtures/meshes/icosphere_80.obj");
    std::fs::copy(mesh, sandbox.path("ball.obj")).unwrap();
    let text = "[model]\nformula = \"x^2+y^2+z^2-1\"\nbase_mesh = \"ball.obj\"\n\
        box = [[-2, 2], [-2, 2], [-2, 2]]\n[target]\nfaces = 80\n";
    sandbox.write("ball.toml", text);
    sandbox.isospline(&["run", "ball.toml", "--out", "out"]);
    let before = sandbox.isospline(&["check", "out", "--json"]).stdout;
    assert!(before.contains("\"faces\": 80"), "{before}");
    std::fs::remove_file(sandbox.path("ball.obj")).unwrap();
    std::fs::rename(sandbox.path("out"), sandbox.path("moved")).unwrap();
    assert_eq!(sandbox.isospline(&["check", "moved", "--json"]).stdout, before);
    let status = sandbox.succeeds(&["status", "moved"]).stdout;
    assert!(status.lines().all(|line| line.contains("fresh")), "{status}");
    let again = sandbox.isospline(&["run", "moved/model.toml", "--out", "moved"]);
    assert!(again.stdout.contains("up to date"), "{}{}", again.stdout, again.stderr);
    let here = sandbox.path("").display().to_string();
    for entry in std::fs::read_dir(sandbox.path("moved")).unwrap() {
        let path = entry.unwrap().path();
        let bytes = std::fs::read(&path).unwrap();
        assert!(!bytes.windows(here.len()).any(|w| w == here.as_bytes()), "{path:?}");
    }
}

#[test]
fn a_run_does_not_call_damaged_rows_up_to_date() {
    let sandbox = Sandbox::new();
    sandbox.converts("torus", &SMALL);
    let path = sandbox.path("out/11-fairing.isos");
    let sound = std::fs::read(&path).unwrap();
    let mut damaged = sound.clone();
    damaged[sound.len() / 2] ^= 1;
    sandbox.write("out/11-fairing.isos", &damaged);
    let outcome = sandbox.converts("torus", &SMALL);
    assert!(outcome.stderr.contains("made again"), "{}", outcome.stderr);
    assert!(std::fs::read(&path).unwrap() == sound);
}

#[test]
fn a_folder_is_checked_without_its_model_file() {
    let sandbox = Sandbox::new();
    let config = std::fs::read_to_string(config_path("torus")).unwrap();
    let model = sandbox.write("torus.toml", config);
    let args = ["run", "torus.toml", "--out", "out", "--no-sync"];
    sandbox.succeeds(&[&args[..], &SMALL].concat());
    std::fs::remove_file(model).unwrap();
    let report = sandbox.checked();
    for figure in [
        "faces",
        "vertices",
        "euler_characteristic",
        "components",
        "genus",
        "gap_max",
        "g1_angle_deg_max",
        "g1_angle_deg_p99",
        "curvature_jump_median",
        "curvature_jump_p99",
        "rel_error_max",
        "rel_error_rms",
        "normal_error_deg_max",
        "flipped_patches",
        "vertex_error_max",
        "lambda0_out_of_range",
        "lambda0_min",
        "lambda0_max",
        "quality_min",
        "repairs",
        "pass",
    ] {
        assert!(!report[figure].is_null(), "{figure} in {report}");
    }
}

#[test]
fn an_npz_export_has_the_figures_of_its_folder() {
    let sandbox = Sandbox::new();
    sandbox.converts("torus", &SMALL);
    sandbox.succeeds(&["export", "out", "--format", "npz", "-o", "torus.npz"]);
    let config = config_path("torus");
    let outcome = sandbox.isospline(&["check", "torus.npz", "--model", config.as_str(), "--json"]);
    let npz: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let mut folder = sandbox.checked();
    // Repairs are counted by stages; an export does not hold them.
    folder["repairs"] = npz["repairs"].clone();
    assert_eq!(folder, npz);
    let alone = sandbox.isospline(&["check", "torus.npz"]);
    assert_eq!(alone.code, 2, "{}", alone.stderr);
}

#[test]
fn every_format_is_written_where_it_is_asked_for() {
    let sandbox = Sandbox::new();
    sandbox.converts("torus", &SMALL);
    for format in ["step", "msh", "vtu", "3mf", "stl", "glb", "obj", "ply", "bv", "npz"] {
        sandbox.succeeds(&["export", "out", "--format", format]);
        let default = std::fs::read(sandbox.path(&format!("out/torus.{format}"))).unwrap();
        let file = format!("elsewhere.{format}");
        sandbox.succeeds(&[
            "export",
            "out",
            "--format",
            format,
            "-o",
            &file,
            "--tolerance",
            "1e-4",
        ]);
        assert!(std::fs::read(sandbox.path(&file)).unwrap() == default, "{format}");
    }
    let lost = sandbox.isospline(&["export", "out", "--format", "stl", "-o", "no/such/a.stl"]);
    assert_eq!(lost.code, 33, "{}", lost.stderr);
    for (option, value, code) in
        [("--tolerance", "0", 2), ("--chord", "-1", 2), ("--order", "8", 2)]
    {
        let option = format!("{option}={value}");
        let refused = sandbox.isospline(&["export", "out", "--format", "stl", &option]);
        assert_eq!(refused.code, code, "{option}: {}", refused.stderr);
    }
    lint_tells_a_sound_file_from_a_broken_one(&sandbox);
}

fn lint_tells_a_sound_file_from_a_broken_one(sandbox: &Sandbox) {
    let sound = sandbox.succeeds(&["lint", "out/torus.step"]).stdout;
    assert!(sound.contains("genus 1") && sound.contains("lint passed"), "{sound}");
    let text = std::fs::read_to_string(sandbox.path("out/torus.step")).expect("the export is text");
    sandbox.write("broken.step", text.replacen(".T.);\n", ".F.);\n", 1));
    let broken = sandbox.isospline(&["lint", "broken.step", "--json"]);
    assert_eq!(broken.code, 1, "{}", broken.stderr);
    let found: serde_json::Value = serde_json::from_str(&broken.stdout).expect("JSON");
    assert_eq!(found["pass"], false);
    assert!(!found["defects"].as_array().expect("a list").is_empty());
}

#[test]
fn inspect_tells_what_an_artifact_holds() {
    let sandbox = Sandbox::new();
    sandbox.converts("torus", &SMALL);
    let told = sandbox.succeeds(&["inspect", "--verify", "out/07-network.isos"]).stdout;
    for word in ["kind       network", "control", "\"samples\":17", "curve_iterations", "checksums"]
    {
        assert!(told.contains(word), "no {word:?} in\n{told}");
    }
}

#[test]
fn a_check_that_fails_exits_with_1_and_says_which_limit() {
    let sandbox = Sandbox::new();
    let config = config_path("torus");
    let args = ["run", config.as_str(), "--out", "out", "--set", "check.error=1e-12"];
    let run = [&args[..], &SMALL].concat();
    let outcome = sandbox.isospline(&run);
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert!(outcome.stdout.contains("FAILED: rel_error_max"), "{}", outcome.stdout);
    assert_eq!(sandbox.isospline(&run).code, 1, "the second run forgets that the check failed");
    assert_eq!(sandbox.isospline(&["check", "out"]).code, 1);
}

#[test]
fn json_output_is_one_value_a_line_to_the_end() {
    let sandbox = Sandbox::new();
    let config = config_path("torus");
    let run = [&["run", config.as_str(), "--json", "--out", "out"], &SMALL[..]].concat();
    let lines = |text: &str| -> Vec<serde_json::Value> {
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    let done = lines(&sandbox.succeeds(&run).stdout);
    let last = done.last().unwrap();
    assert_eq!(last["event"], "report");
    assert_eq!(last["report"]["check"]["pass"], true);
    assert_eq!(last["report"]["stages"].as_array().unwrap().len(), 10);

    let failed = lines(&sandbox.isospline(&["run", "nothing.toml", "--json"]).stdout);
    assert_eq!(failed.last().unwrap()["code"], "model-file-unreadable");
    assert_eq!(failed.last().unwrap()["exit"], 10);
}

#[test]
fn a_reader_that_goes_away_is_no_panic() {
    let sandbox = Sandbox::new();
    let config = config_path("torus");
    let mut child = sandbox
        .command(&[&["run", config.as_str(), "--json", "--out", "out"], &SMALL[..]].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut told = String::new();
    child.stderr.take().unwrap().read_to_string(&mut told).unwrap();
    assert!(child.wait().unwrap().success(), "{told}");
    assert!(!told.contains("panic"), "{told}");
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let sandbox = Sandbox::new();
    let commands =
        ["run", "stage", "status", "inspect", "check", "export", "lint", "man", "schema"];
    for shell in ["bash", "zsh", "fish"] {
        let script = sandbox.succeeds(&["completions", shell]).stdout;
        for word in commands.iter().chain(&["--tolerance", "--format"]) {
            assert!(script.contains(word.trim_start_matches("--")), "{shell} lacks {word}");
        }
    }
    let page = sandbox.succeeds(&["man"]).stdout;
    assert!(
        page.contains(".TH isospline") && page.contains("the model file has a bad key"),
        "{page}"
    );
    let page = sandbox.succeeds(&["man", "export"]).stdout;
    assert!(page.contains("isospline export") && page.contains("tolerance"), "{page}");
    assert_eq!(sandbox.isospline(&["man", "nothing"]).code, 2);
    std::fs::create_dir(sandbox.path("pages")).unwrap();
    sandbox.succeeds(&["man", "--out", "pages"]);
    for command in commands {
        assert!(sandbox.path(&format!("pages/isospline-{command}.1")).is_file(), "{command}");
    }
}

#[test]
fn nothing_is_coloured_where_colour_is_not_wanted() {
    let sandbox = Sandbox::new();
    for args in [&["--help"][..], &["run", "nothing.toml"], &["export", "x", "--format", "zzz"]] {
        let outcome = sandbox.isospline(args);
        assert!(
            !outcome.stdout.contains('\u{1b}') && !outcome.stderr.contains('\u{1b}'),
            "{args:?}"
        );
    }
}

#[test]
fn help_has_examples_and_the_exit_codes_of_the_readme() {
    let sandbox = Sandbox::new();
    for command in [
        "run",
        "stage",
        "status",
        "inspect",
        "check",
        "export",
        "lint",
        "completions",
        "man",
        "schema",
    ] {
        let help = sandbox.succeeds(&[command, "--help"]).stdout;
        assert!(help.contains(&format!("isospline {command} ")), "{help}");
        assert!(help.contains("Example"), "{help}");
    }
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let help = sandbox.succeeds(&["--help"]).stdout;
    let codes: Vec<&str> =
        help.lines().skip_while(|line| !line.starts_with("Exit codes")).skip(1).collect();
    assert!(codes.len() > 15, "{help}");
    for code in codes {
        assert!(readme.contains(code.trim()), "README.md lacks: {code}");
    }
}
