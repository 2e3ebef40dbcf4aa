//! Tables for people: stage times and the figures of a check.

use crate::cli::output::{duration, size};
use isospline::Rounds;
use isospline::config::ModelFile;
use isospline::report::ConversionReport;
use isospline::tolerance::Verdict;
use isospline_check::{CheckParams, CheckReport, Expected};
use std::fmt::Write as _;

/// The stages of a conversion: time of their own work, share of the whole, size.
pub(crate) fn stages(report: &ConversionReport) -> String {
    // The time of a stage whose record is lost is not known.
    let all: f64 = report.stages.iter().map(|s| s.own_seconds).filter(|s| s.is_finite()).sum();
    let mut text = format!("{:<15}{:>10}{:>8}{:>10}\n", "stage", "work", "share", "size");
    for stage in &report.stages {
        let share = 100.0 * stage.own_seconds / all;
        let share = if share.is_finite() { format!("{share:.1}%") } else { "-".to_owned() };
        let (time, size) = (duration(stage.own_seconds), size(stage.bytes));
        writeln!(text, "{:<15}{time:>10}{share:>8}{size:>10}", stage.stage).expect(TEXT);
    }
    write!(text, "{:<15}{:>10}", "whole run", duration(report.seconds)).expect(TEXT);
    text
}

/// How the faces for a tolerance were found.
pub(crate) fn rounds(rounds: &Rounds) -> String {
    let verdict = match rounds.verdict {
        Verdict::Met => "just below the tolerance",
        Verdict::FewestSound => "far below the tolerance, but fewer make no sound mesh, or miss it",
        Verdict::Settled => "far below the tolerance, where the search was ended",
        Verdict::NotReached => "the nearest found; the tolerance is not reached",
    };
    format!("faces:    {}, {verdict}; {} rounds", rounds.faces, rounds.rounds.len())
}

/// The figures of a check beside their limits, and the verdict.
pub(crate) fn check(report: &CheckReport, file: &ModelFile) -> String {
    let mut text = format!("{:<24}{:>14}{:>12}\n", "figure", "value", "limit");
    for (name, value, limit) in figures(report, file) {
        writeln!(text, "{name:<24}{value:>14}{limit:>12}").expect(TEXT);
    }
    let repairs: u64 = report.repairs.values().sum();
    writeln!(text, "{:<24}{repairs:>14}", "repairs").expect(TEXT);
    for (name, n) in &report.repairs {
        writeln!(text, "  {name:<22}{n:>14}").expect(TEXT);
    }
    for failure in &report.failures {
        writeln!(text, "FAILED: {failure}").expect(TEXT);
    }
    text.push_str(if report.pass { "check passed" } else { "check FAILED" });
    text
}

const TEXT: &str = "invariant: a string takes all text";

fn figures(report: &CheckReport, file: &ModelFile) -> Vec<(&'static str, String, String)> {
    let params: &CheckParams = &file.check;
    let tolerance = file.target.tolerance(report.diagonal);
    let error_limit = params.error_limit(&Expected { tolerance, ..Expected::default() });
    let small = |x: f64| format!("{x:.2e}");
    let none = String::new;
    let genus = report.genus.map_or_else(|| "-".to_owned(), |g| g.to_string());
    vec![
        ("faces", report.faces.to_string(), none()),
        ("vertices", report.vertices.to_string(), none()),
        ("components", report.components.to_string(), none()),
        ("Euler characteristic", report.euler_characteristic.to_string(), none()),
        ("genus", genus, none()),
        ("gap / diagonal", small(report.gap_max), small(params.gap)),
        ("G1 angle max, deg", small(report.g1_angle_deg_max), small(params.g1_angle_deg)),
        ("G1 angle p99, deg", small(report.g1_angle_deg_p99), none()),
        ("curvature jump median", small(report.curvature_jump_median), none()),
        ("curvature jump p99", small(report.curvature_jump_p99), none()),
        ("error max / diagonal", small(report.rel_error_max), small(error_limit)),
        ("error rms / diagonal", small(report.rel_error_rms), none()),
        ("normal error max, deg", small(report.normal_error_deg_max), none()),
        ("vertex error / diagonal", small(report.vertex_error_max), small(params.vertices)),
        ("flipped patches", report.flipped_patches.to_string(), params.flipped_patches.to_string()),
        ("lambda0 out of (0, 1)", report.lambda0_out_of_range.to_string(), "0".to_owned()),
        ("lambda0 min", format!("{:.3}", report.lambda0_min), none()),
        ("lambda0 max", format!("{:.3}", report.lambda0_max), none()),
        ("face quality min", format!("{:.3}", report.quality_min), none()),
    ]
}
