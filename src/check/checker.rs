//! The whole check, figure by figure.

use crate::continuity::{self, Continuity};
use crate::curvature::{self, CurvatureJump};
use crate::distance::{self, Distance, first_order};
use crate::lent_threads::{ForEach, map};
use crate::params::{CheckParams, Expected};
use crate::report::{CheckReport, Place, worse};
use crate::sector::{self, Weights};
use crate::surface::Surface;
use crate::topology::Topology;
use crate::{foot, quality, verdict};
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Jet1};
use std::collections::BTreeMap;

/// What is checked, and against what.
pub struct Job<'a> {
    /// The surface.
    pub surface: &'a Surface<'a>,
    /// The field whose zero set it approximates, `f < 0` inside.
    pub field: &'a dyn Field,
    /// What earlier stages promise.
    pub expected: Expected,
    /// Limits.
    pub params: &'a CheckParams,
    /// Counters of every fallback that any stage took; they are passed on into the report.
    pub repairs: BTreeMap<String, u64>,
}

impl std::fmt::Debug for Job<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Job")
            .field("faces", &self.surface.faces().len())
            .field("expected", &self.expected)
            .field("params", &self.params)
            .finish_non_exhaustive()
    }
}

/// Measures all figures and holds them against the limits.
///
/// The report depends on the job alone, not on the threads that `for_each` lends.
pub fn check(job: &Job<'_>, for_each: ForEach<'_>) -> CheckReport {
    let mut report = measure(job, for_each);
    report.failures = verdict::failures(&report, job);
    report.pass = report.failures.is_empty();
    report
}

fn measure(job: &Job<'_>, for_each: ForEach<'_>) -> CheckReport {
    let Job { surface, field, .. } = *job;
    let topology = Topology::of(surface);
    let at_vertices = vertex_jets(surface, field, for_each);
    let normals: Vec<Vec3> = at_vertices.iter().map(|jet| jet.gradient).collect();
    let distance = distance::measure(surface, field, for_each);
    let parts = Parts {
        continuity: continuity::measure(surface, &topology, for_each),
        curvature: curvature::measure(surface, &topology, for_each),
        worst: foot::largest(surface, field, &distance),
        weights: sector::measure(surface, &topology, &normals),
        off_surface: at_vertices.iter().fold(0.0, |acc, jet| worse(acc, first_order(jet))),
        not_finite: count_not_finite(surface)
            + distance.not_finite
            + at_vertices.iter().filter(|jet| !first_order(jet).is_finite()).count() as u64,
        distance,
        topology,
    };
    parts.report(job)
}

/// What the parts of the check found, in model units.
struct Parts {
    topology: Topology,
    continuity: Continuity,
    curvature: CurvatureJump,
    distance: Distance,
    worst: Option<(f64, Place)>,
    weights: Weights,
    /// Largest first-order distance of a vertex.
    off_surface: f64,
    not_finite: u64,
}

impl Parts {
    /// The figures, relative where the report wants them so; no verdict yet.
    fn report(self, job: &Job<'_>) -> CheckReport {
        let Self { topology, continuity, curvature, distance, worst, weights, .. } = self;
        let surface = job.surface;
        let diagonal = surface.diagonal();
        CheckReport {
            faces: surface.faces().len() as u64,
            vertices: surface.vertices().len() as u64,
            euler_characteristic: topology.euler_characteristic(surface),
            components: topology.components.len() as u32,
            genus: topology.components.iter().map(|c| c.genus).sum(),
            edge_defects: topology.defects,
            component_list: topology.components,
            diagonal,
            gap_max: continuity.gap / diagonal,
            shared_bits_differ: continuity.bits_differ,
            g1_angle_deg_max: continuity.angle_deg_max,
            g1_angle_deg_p99: continuity.angle_deg_p99,
            curvature_jump_median: curvature.median,
            curvature_jump_p99: curvature.p99,
            rel_error_max: worst.map_or(f64::NAN, |(d, _)| d / diagonal),
            rel_error_grid_max: distance.max / diagonal,
            rel_error_rms: distance.rms / diagonal,
            rel_error_mean: distance.mean / diagonal,
            normal_error_deg_max: distance.normal_deg_max,
            flipped_patches: distance.flipped,
            degenerate_normals: distance.degenerate + continuity.degenerate_normals,
            vertex_error_max: worse(self.off_surface, continuity.corner_gap) / diagonal,
            lambda0_out_of_range: weights.out_of_range,
            lambda0_min: weights.min,
            lambda0_max: weights.max,
            quality_min: quality::least(surface),
            not_finite: self.not_finite,
            repairs: job.repairs.clone(),
            worst_error: worst.map(|(d, place)| Place { value: d / diagonal, ..place }),
            worst_g1_angle: continuity.worst_angle,
            worst_normal: distance.worst_normal,
            pass: false,
            failures: Vec::new(),
        }
    }
}

/// Field and gradient at every vertex.
fn vertex_jets(surface: &Surface<'_>, field: &dyn Field, for_each: ForEach<'_>) -> Vec<Jet1> {
    map(for_each, surface.vertices().len(), |range| {
        let points = &surface.vertices()[range];
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        field.gradients(points, &mut jets);
        jets
    })
}

/// Vertices and control points with a coordinate that is not a finite number.
fn count_not_finite(surface: &Surface<'_>) -> u64 {
    let lost =
        |points: &[Vec3]| points.iter().filter(|p| !p.iter().all(|x| x.is_finite())).count() as u64;
    let in_nets = (0..surface.faces().len()).map(|f| lost(&surface.net(f)));
    lost(surface.vertices()) + in_nets.sum::<u64>()
}
