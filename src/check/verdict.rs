//! The figures against their limits, in sentences.

use crate::checker::Job;
use crate::report::{CheckReport, EdgeDefects, Place};
use std::fmt::{Display, Write};

/// One sentence a broken limit; none if the surface passes.
pub(crate) fn failures(report: &CheckReport, job: &Job<'_>) -> Vec<String> {
    let mut out = Vec::new();
    shape(&mut out, report, job);
    continuity(&mut out, report, job);
    fidelity(&mut out, report, job);
    unlimited(&mut out, report);
    out
}

/// Closed, oriented, and of the promised topology.
fn shape(out: &mut Vec<String>, report: &CheckReport, job: &Job<'_>) {
    let EdgeDefects {
        border,
        misoriented,
        non_manifold,
        pinched_vertices,
        loose_vertices,
        repeated_corners,
    } = report.edge_defects;
    if report.faces == 0 {
        out.push("the surface has no faces".to_owned());
    }
    none(out, border, "edges have a face on one side only");
    none(out, misoriented, "edges have faces of opposite orientation");
    none(out, non_manifold, "edges have more than two faces");
    none(out, pinched_vertices, "vertices have more than one fan of faces");
    none(out, loose_vertices, "vertices belong to no face");
    none(out, repeated_corners, "faces name a vertex twice");
    let expected = &job.expected;
    equal(out, "components", &report.components, expected.components.as_ref());
    let characteristic = &report.euler_characteristic;
    equal(out, "euler_characteristic", characteristic, expected.euler_characteristic.as_ref());
}

/// No gap, no kink.
fn continuity(out: &mut Vec<String>, report: &CheckReport, job: &Job<'_>) {
    let params = job.params;
    at_most(out, ("gap_max", report.gap_max, None), params.gap);
    if params.same_bits {
        let n_differ = report.shared_bits_differ;
        none(out, n_differ, "shared edges or corners differ in bits between their faces");
    }
    let angle = ("g1_angle_deg_max", report.g1_angle_deg_max, report.worst_g1_angle);
    at_most(out, angle, params.g1_angle_deg);
    none(out, report.lambda0_out_of_range, "half-edge ends have lambda0 outside (0, 1)");
    none(out, report.degenerate_normals, "sampled points have no tangent plane");
}

/// Near the zero set, and facing the right way.
fn fidelity(out: &mut Vec<String>, report: &CheckReport, job: &Job<'_>) {
    let params = job.params;
    none(out, report.not_finite, "points or field samples are not finite numbers");
    at_most(out, ("vertex_error_max", report.vertex_error_max, None), params.vertices);
    let error = ("rel_error_max", report.rel_error_max, report.worst_error);
    at_most(out, error, params.error_limit(&job.expected));
    if report.flipped_patches > params.flipped_patches {
        let (found, limit) = (report.flipped_patches, params.flipped_patches);
        out.push(format!("{found} patches face inward somewhere, at most {limit} may"));
    }
}

/// Figures without a limit of their own: they must at least be numbers.
fn unlimited(out: &mut Vec<String>, report: &CheckReport) {
    let figures = [
        ("diagonal", report.diagonal),
        ("g1_angle_deg_p99", report.g1_angle_deg_p99),
        ("curvature_jump_median", report.curvature_jump_median),
        ("curvature_jump_p99", report.curvature_jump_p99),
        ("rel_error_grid_max", report.rel_error_grid_max),
        ("rel_error_rms", report.rel_error_rms),
        ("rel_error_mean", report.rel_error_mean),
        ("normal_error_deg_max", report.normal_error_deg_max),
        ("lambda0_min", report.lambda0_min),
        ("lambda0_max", report.lambda0_max),
        ("quality_min", report.quality_min),
    ];
    for (name, _) in figures.into_iter().filter(|(_, value)| !value.is_finite()) {
        out.push(format!("{name} is not a finite number"));
    }
}

fn none(out: &mut Vec<String>, found: u64, what: &str) {
    if found > 0 {
        out.push(format!("{found} {what}"));
    }
}

fn equal<T: PartialEq + Display>(out: &mut Vec<String>, name: &str, found: &T, wanted: Option<&T>) {
    if let Some(wanted) = wanted
        && found != wanted
    {
        out.push(format!("{name} is {found}, but the surface was found to have {wanted}"));
    }
}

fn at_most(out: &mut Vec<String>, (name, value, at): (&str, f64, Option<Place>), limit: f64) {
    // Written so that not-a-number fails.
    if value <= limit {
        return;
    }
    let mut sentence = format!("{name} is {value:.3e}, the limit is {limit:.3e}");
    if let Some(Place { face, point: [x, y, z], .. }) = at {
        write!(sentence, "; worst in face {face} at ({x:.6}, {y:.6}, {z:.6})")
            .expect("invariant: a string takes all that is written");
    }
    out.push(sentence);
}
