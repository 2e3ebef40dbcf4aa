//! Folded patches: their faces are edited and the surface made again, by the program and the library.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline::config::ModelFile;
use isospline::{CheckParams, MENDS_NOTE, Model, Options, convert};
use isospline_tests::{Sandbox, config_path, root};

/// So few faces that patches fold where the two tori meet.
const FACES: u32 = 160;

/// Runs the double torus with so few faces; the exit code.
fn run(sandbox: &Sandbox, more: &[&str]) -> i32 {
    let (model, faces) = (config_path("double_torus"), format!("target.faces={FACES}"));
    let args = ["run", &model, "--out", "out", "--no-sync", "--set", &faces];
    sandbox.isospline(&[&args, more].concat()).code
}

/// How many faces were unfit in each surface that was made.
fn unfit(sandbox: &Sandbox) -> Vec<usize> {
    let note = std::fs::read(sandbox.path("out").join(MENDS_NOTE)).unwrap();
    let note: serde_json::Value = serde_json::from_slice(&note).unwrap();
    let made = note["by_faces"][FACES.to_string()].as_array().unwrap().clone();
    made.iter().map(|unfit| unfit.as_array().unwrap().len()).collect()
}

#[test]
fn faces_that_fold_are_split_until_none_does() {
    let sandbox = Sandbox::new();
    assert_eq!(run(&sandbox, &["--set", "target.mends=0"]), 1);
    let folded = sandbox.checked()["flipped_patches"].as_u64().unwrap();
    assert!(folded > 0);
    assert_eq!(run(&sandbox, &[]), 0);
    let unfit = unfit(&sandbox);
    // Some do not fold, but are too far from the surface.
    assert!(unfit[0] as u64 >= folded && unfit.last() == Some(&0), "{unfit:?}");
    let report = sandbox.checked();
    assert_eq!((&report["flipped_patches"], &report["pass"]), (&0.into(), &true.into()));
    // As many vertices are merged elsewhere, where meshes so coarse can spare them.
    assert!(report["faces"].as_u64().unwrap() <= u64::from(FACES) + 8, "{}", report["faces"]);
    let split = report["repairs"]["adapt.unfit_faces_split"].as_u64().unwrap();
    assert!(split >= folded, "{split} faces split");
}

#[test]
fn a_mended_surface_is_fresh_and_a_note_cut_short_makes_the_same_again() {
    let sandbox = Sandbox::new();
    assert_eq!(run(&sandbox, &[]), 0);
    let before = sandbox.artifacts();
    let again = sandbox.succeeds(&["run", "out/model.toml", "--out", "out"]);
    assert!(again.stdout.contains("nothing to do"), "{}", again.stdout);
    // As a run killed after its first surface leaves it.
    let path = sandbox.path("out").join(MENDS_NOTE);
    let mut note: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    note["by_faces"][FACES.to_string()].as_array_mut().unwrap().truncate(1);
    sandbox.write(&format!("out/{MENDS_NOTE}"), note.to_string());
    assert_eq!(run(&sandbox, &[]), 0);
    assert_eq!(sandbox.artifacts(), before);
}

#[test]
fn a_shorter_search_after_a_longer_one_ends_as_it_would_have_alone() {
    let (alone, after) = (Sandbox::new(), Sandbox::new());
    let short = ["--set", "target.mends=1"];
    let code = run(&alone, &short);
    assert_eq!(run(&after, &[]), 0);
    assert_eq!(run(&after, &short), code);
    assert_eq!(after.artifacts(), alone.artifacts());
}

#[test]
fn beside_planes_and_cylinders_folds_go_without_a_larger_error() {
    let sandbox = Sandbox::new();
    let formula = "smax(x^2 + y^2 - 0.5, z^2 - 0.6, 0.3)";
    let run = |more: &[&str]| {
        let args = ["run", "--formula", formula, "--out", "out", "--no-sync"];
        let sets = ["--set", "target.faces=1000", "--set", "target.fit=fast"];
        sandbox.isospline(&[&args[..], &sets, more].concat()).code
    };
    assert_eq!(run(&["--set", "target.mends=0"]), 1);
    let folded = sandbox.checked();
    assert!(folded["flipped_patches"].as_u64().unwrap() > 0);
    assert_eq!(run(&[]), 0);
    let report = sandbox.checked();
    assert_eq!((&report["flipped_patches"], &report["pass"]), (&0.into(), &true.into()));
    assert!(report["repairs"]["network.curves_of_the_paper"].as_u64().unwrap() > 0);
    let error = |report: &serde_json::Value| report["rel_error_max"].as_f64().unwrap();
    assert!(error(&report) <= 1.2 * error(&folded), "{} {}", error(&report), error(&folded));
}

#[test]
fn in_the_fit_of_the_paper_needles_that_fold_are_merged_and_what_is_too_far_is_split() {
    let needle = ("smax(x^2 + y^2 - 0.5, z^2 - 0.6, 0.3)", "1.0", 2000, "merged");
    let too_far = ("smax(smax(abs(x), abs(y), 0.4), abs(z), 0.4) - 1", "1.5", 600, "split");
    for (formula, half, faces, remedy) in [needle, too_far] {
        let sandbox = Sandbox::new();
        let side = format!("[-{half}, {half}]");
        let model = format!(
            "[model]\nformula = \"{formula}\"\nbox = [{side}, {side}, {side}]\n
            [target]\nfaces = {faces}\nfit = \"paper\"\n"
        );
        sandbox.write("model.toml", model);
        let run = |more: &[&str]| {
            let args = ["run", "model.toml", "--out", "out", "--no-sync"];
            sandbox.isospline(&[&args[..], more].concat()).code
        };
        assert_eq!(run(&["--set", "target.mends=0"]), 1, "{formula}");
        assert!(sandbox.checked()["flipped_patches"].as_u64().unwrap() > 0);
        assert_eq!(run(&[]), 0, "{formula}");
        let report = sandbox.checked();
        let made = report["repairs"][format!("adapt.unfit_faces_{remedy}")].as_u64();
        assert!(made.is_some_and(|n| n > 0), "{formula}: {}", report["repairs"]);
    }
}

#[test]
fn a_given_mesh_with_a_corner_of_two_degrees_is_kept_and_does_not_fold() {
    let sandbox = Sandbox::new();
    let mesh = root().join("tests/fixtures/meshes/torus_600.obj").display().to_string();
    let text = std::fs::read_to_string(config_path("torus")).unwrap();
    let box_ = "box =";
    let model =
        sandbox.write("torus.toml", text.replace(box_, &format!("base_mesh = {mesh:?}\n{box_}")));
    sandbox.succeeds(&["run", &model.display().to_string(), "--out", "out", "--no-sync"]);
    let report = sandbox.checked();
    assert_eq!((&report["faces"], &report["flipped_patches"]), (&600.into(), &0.into()));
}

#[test]
fn the_library_mends_folds_as_the_program_does() {
    let path = config_path("double_torus");
    let model = Model::new(ModelFile::open(path.as_ref(), &[]).unwrap()).unwrap();
    let options = Options { faces: FACES, ..Options::new(model.domain) };
    let flips = |mends| {
        let surface = convert(&model.field, &Options { mends, ..options.clone() }).unwrap();
        surface.check(&CheckParams::default()).unwrap().flipped_patches
    };
    assert!(flips(0) > 0);
    assert_eq!(flips(6), 0);
}
