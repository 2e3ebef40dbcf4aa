//! Relaxed patches: nearer to the surface by orders, with the conditions met as before.

use isospline::Vec3;
use isospline_tests::{Sandbox, number, root};
use std::collections::BTreeMap;

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

/// A unit sphere's base mesh as a model, without improvement; `steps` splits of each face into four.
fn uneven_sphere(sandbox: &Sandbox, steps: u32) -> std::path::PathBuf {
    let path = root().join("tests/fixtures/meshes/icosphere_80.obj");
    let text = std::fs::read_to_string(path).expect("a fixture");
    let rows = |kind: &str| -> Vec<Vec<String>> {
        let row = |line: &str| line.split_whitespace().skip(1).map(str::to_owned).collect();
        text.lines().filter(|line| line.starts_with(kind)).map(row).collect()
    };
    let number = |word: &String| word.parse::<f64>().expect("a coordinate");
    let mut points: Vec<Vec3> =
        rows("v ").iter().map(|r| Vec3::from_iterator(r.iter().map(number))).collect();
    let mut faces: Vec<[usize; 3]> = rows("f ")
        .iter()
        .map(|r| [0, 1, 2].map(|k| r[k].parse::<usize>().expect("an index") - 1))
        .collect();
    for (i, p) in (0u32..).zip(&mut points) {
        let wave = |k: f64| 0.1 * (k * f64::from(i)).sin();
        *p = (*p + Vec3::new(wave(7.0), wave(11.0), wave(13.0))).normalize();
    }
    for _ in 0..steps {
        faces = split_in_four(&mut points, &faces);
    }
    let vertices = points.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z));
    let faces = faces.iter().map(|f| format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1));
    sandbox.write("uneven.obj", vertices.chain(faces).collect::<String>());
    let box_ = "[[-1.1, 1.1], [-1.1, 1.1], [-1.1, 1.1]]";
    let formula = "x^2 + y^2 + z^2 - 1";
    let model =
        format!("[model]\nformula = \"{formula}\"\nbox = {box_}\nbase_mesh = \"uneven.obj\"\n");
    sandbox.write("uneven.toml", model)
}

/// Each face becomes four, its new corners on the unit sphere.
fn split_in_four(points: &mut Vec<Vec3>, faces: &[[usize; 3]]) -> Vec<[usize; 3]> {
    let mut middles = BTreeMap::new();
    let mut middle = |a: usize, b: usize| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            points.push((points[a] + points[b]).normalize());
            points.len() - 1
        })
    };
    let four = |&[a, b, c]: &[usize; 3]| {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    faces.iter().flat_map(four).collect()
}

#[test]
fn refined_uneven_meshes_converge_with_order_seven_and_their_normals_with_order_five() {
    let figures = |steps: u32| {
        let sandbox = Sandbox::new();
        let model = uneven_sphere(&sandbox, steps).display().to_string();
        // Tiles of nearly the whole sphere: what the method gives where sweeps are no limit.
        let sets = ["--set", "relax.tile=6", "--set", "relax.sweeps=20"];
        let args = ["run", &model, "--out", "out", "--no-sync"];
        sandbox.succeeds(&[&args[..], &sets].concat());
        sandbox.checked()
    };
    let [coarse, fine] = [figures(0), figures(1)];
    let orders = [("rel_error_max", 7.0), ("rel_error_rms", 7.0), ("normal_error_deg_max", 4.5)];
    for (figure, least) in orders {
        let order = (number(&coarse, figure) / number(&fine, figure)).log2();
        assert!(order >= least, "{figure}: order {order:.1}");
    }
}

#[test]
fn tiles_end_where_one_solve_of_the_whole_surface_ends() {
    // Six rings about a vertex are all of this surface.
    let [tiles, whole] = ["2", "6"].map(|rings| {
        let sandbox = Sandbox::new();
        let tile = format!("relax.tile={rings}");
        let sets = ["--set", "target.fit=full", "--set", "relax.sweeps=100", "--set", &tile];
        sandbox.converts("sphere_80", &sets);
        sandbox.checked()
    });
    for figure in ["rel_error_max", "rel_error_rms"] {
        let ratio = number(&tiles, figure) / number(&whole, figure);
        assert!(ratio > 0.5 && ratio < 1.5, "{figure}: {ratio}");
    }
}

#[test]
fn the_curves_of_the_paper_are_not_relaxed() {
    let sandbox = Sandbox::new();
    sandbox.converts("sphere_80", &["--set", "network.method=\"paper\""]);
    assert!(!sandbox.artifacts().iter().any(|(name, _)| name.contains("relax")));
}
