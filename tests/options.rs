//! Options that trade time for accuracy: each gains what its documentation says, and the surfaces
//! stay exact.

use isospline_tests::Sandbox;
use serde_json::Value;

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("no {key} in {report}"))
}

/// What `isospline check` says of the regular torus with these settings.
fn checked(settings: &[&str]) -> Value {
    let sandbox = Sandbox::new();
    let settings = [&["target.fit=full"], settings].concat();
    let sets: Vec<&str> = settings.iter().flat_map(|s| ["--set", *s]).collect();
    sandbox.converts("torus_regular", &sets);
    sandbox.checked()
}

fn assert_exact(report: &Value) {
    assert_eq!(report["pass"], true, "{report}");
    assert!(number(report, "g1_angle_deg_max") < 1e-9, "{report}");
    assert_eq!(report["flipped_patches"], 0, "{report}");
}

#[test]
fn a_sobolev_term_lowers_jumps_of_curvature_and_not_the_accuracy() {
    let [plain, smooth] = ["0", "0.3"].map(|w| checked(&[&format!("relax.smoothness={w}")]));
    assert_exact(&smooth);
    let ratio = |key: &str| number(&smooth, key) / number(&plain, key);
    assert!(ratio("curvature_jump_median") < 0.6, "{}", ratio("curvature_jump_median"));
    assert!(ratio("curvature_jump_p99") < 0.6, "{}", ratio("curvature_jump_p99"));
    assert!(ratio("rel_error_max") < 1.1, "{}", ratio("rel_error_max"));
}

#[test]
fn free_vertices_leave_the_surface_by_less_than_its_error_and_patches_stay_exact() {
    let [bound, free] = ["on-surface", "free"].map(|v| checked(&[&format!("adapt.vertices={v}")]));
    assert_exact(&free);
    assert!(number(&bound, "vertex_error_max") < 1e-14);
    let off = number(&free, "vertex_error_max");
    assert!(off > 1e-12 && off < number(&free, "rel_error_max"), "{off:e}");
    let ratio = number(&free, "rel_error_rms") / number(&bound, "rel_error_rms");
    assert!(ratio < 1.05, "{ratio}");
}

#[test]
fn patches_of_degree_6_are_as_exact_and_nearly_as_near_with_three_quarters_of_the_points() {
    let [septic, sextic] = [7, 6].map(|degree| checked(&[&format!("relax.degree={degree}")]));
    assert_exact(&sextic);
    let ratio = |key: &str| number(&sextic, key) / number(&septic, key);
    assert!(ratio("rel_error_max") < 2.0, "{}", ratio("rel_error_max"));
    assert!(ratio("rel_error_rms") < 3.0, "{}", ratio("rel_error_rms"));
}
