//! The method reaches the figures of the paper on meshes that never change.

use isospline_tests::{Sandbox, number};

/// Relative room for the largest error on a fixed mesh.
const ROOM: f64 = 0.05;

/// Converts a model file and holds it against a largest error, an angle and a genus.
fn reaches(config: &str, faces: u64, error: f64, angle_deg: f64, genus: i64) -> serde_json::Value {
    let sandbox = Sandbox::new();
    sandbox.converts(config, &[]);
    let report = sandbox.checked();
    assert_eq!(report["faces"], faces, "{config}");
    assert_eq!(report["genus"], genus, "{config}");
    assert_eq!(report["flipped_patches"], 0, "{config}");
    assert_eq!(report["lambda0_out_of_range"], 0, "{config}");
    let found = number(&report, "rel_error_max");
    assert!((found / error - 1.0).abs() <= ROOM, "{config}: {found:.3e}, expected {error:.1e}");
    let angle = number(&report, "g1_angle_deg_max");
    assert!(angle <= angle_deg, "{config}: {angle:.1e} degrees");
    let all = std::fs::read(sandbox.path("out/report.json")).unwrap();
    serde_json::from_slice(&all).unwrap()
}

#[test]
fn spheres_on_refined_icosahedra() {
    reaches("sphere_80", 80, 1.9e-5, 1e-9, 0);
    reaches("sphere_320", 320, 3.8e-7, 1e-9, 0);
    reaches("sphere_1280", 1280, 6.2e-9, 1e-9, 0);
}

#[test]
fn the_regular_torus_in_as_many_iterations_as_the_paper() {
    let report = reaches("torus_regular", 400, 6.6e-5, 1e-9, 1);
    let stages = report["stages"].as_array().unwrap();
    let network = stages.iter().find(|s| s["stage"] == "network").unwrap();
    let counts = &network["counters"]["counts"];
    let mean = number(counts, "curve_iterations") / number(counts, "curves");
    // Table 3 of [TK] prints 2.40.
    assert!((mean - 2.40).abs() < 0.005, "{mean}");
}
