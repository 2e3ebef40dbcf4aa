//! Relaxed patches: nearer to the surface by orders, with the conditions met as before.

use isospline_tests::{Sandbox, number};

/// Figures of `config` with curves by normal distance and `sweeps` of relaxation.
fn figures(config: &str, sweeps: u32) -> serde_json::Value {
    let sandbox = Sandbox::new();
    let sweeps = format!("relax.sweeps={sweeps}");
    sandbox.converts(config, &["--set", "network.method=\"normal\"", "--set", &sweeps]);
    sandbox.checked()
}

fn error(report: &serde_json::Value) -> f64 {
    number(report, "rel_error_max")
}

#[test]
fn relaxation_lowers_the_error_a_thousandfold_and_keeps_surfaces_exact() {
    for (config, limit) in [("sphere_320", 5e-9), ("torus_regular", 2e-7)] {
        let (before, after) = (figures(config, 0), figures(config, 12));
        assert!(error(&after) <= limit, "{config}: {:e}", error(&after));
        let gain = error(&before) / error(&after);
        assert!(gain >= 1e3, "{config}: {gain:.0} times");
        assert!(10.0 * number(&after, "rel_error_rms") <= limit, "{config}");
        assert!(number(&after, "g1_angle_deg_max") <= 1e-11, "{config}");
        for figure in ["gap_max", "shared_bits_differ", "flipped_patches", "lambda0_out_of_range"] {
            assert!(number(&after, figure) <= 0.0, "{config}: {figure} {}", after[figure]);
        }
    }
}

/// Largest distance of a curve of `config` from the surface, relative.
fn curve_error(config: &str) -> f64 {
    let sandbox = Sandbox::new();
    // Unrelaxed patches pass no check, which does not matter here.
    let limits = ["--set", "relax.sweeps=0", "--set", "check.error=1"];
    sandbox.converts(config, &[&["--set", "target.fit=full"], &limits[..]].concat());
    let record = std::fs::read(sandbox.path("out/07-network.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_slice(&record).expect("a record is JSON");
    number(&record["counters"]["maxima"], "curve_distance_max_rel")
}

#[test]
fn curves_on_spheres_converge_with_an_order_above_seven() {
    let errors = ["sphere_80", "sphere_320", "sphere_1280"].map(curve_error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order >= 7.2, "order {order:.1} of {errors:?}");
    }
}

/// The largest error is one order behind: it stands between the samples, near the curves.
#[test]
fn spheres_converge_with_order_six_and_more_in_the_mean_and_five_at_the_worst_place() {
    let [coarse, fine] = ["sphere_80", "sphere_320"].map(|config| figures(config, 40));
    for (figure, least) in [("rel_error_rms", 6.0), ("rel_error_max", 4.5)] {
        let order = (number(&coarse, figure) / number(&fine, figure)).log2();
        assert!(order >= least, "{figure}: order {order:.1}");
    }
}

#[test]
fn the_curves_of_the_paper_are_not_relaxed() {
    let sandbox = Sandbox::new();
    sandbox.converts("sphere_80", &["--set", "network.method=\"paper\""]);
    assert!(!sandbox.artifacts().iter().any(|(name, _)| name.contains("relax")));
}
