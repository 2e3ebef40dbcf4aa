//! The whole check, figure by figure.

use crate::curvature;
use crate::distance::{FaceFigures, GRID, UnfitFace, first_order};
use crate::edges::{self, Edges};
use crate::faces::{self, Faces, count_not_finite};
use crate::grid::Grid;
use crate::lent_threads::{ForEach, blocks, blocks_beside};
use crate::params::{CheckParams, Expected};
use crate::percentile::percentile;
use crate::report::{CheckReport, Place, worse};
use crate::surface::Surface;
use crate::topology::Topology;
use crate::volume::{self, Quadrature};
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

/// A report, and what single faces showed.
#[derive(Debug)]
pub struct Checked {
    /// The figures of all faces together, and the verdict.
    pub report: CheckReport,
    faces: Vec<FaceFigures>,
}

impl Checked {
    /// The faces whose patch faces inward at a sample, or is farther from the surface than `limit`,
    /// in model units.
    pub fn unfit_faces(&self, limit: f64) -> Vec<UnfitFace> {
        let is_unfit = |figures: &FaceFigures| figures.flipped || figures.max > limit;
        let unfit = (0..).zip(&self.faces).filter(|(_, figures)| is_unfit(figures));
        unfit.map(|(face, figures)| UnfitFace { face, folds: figures.flipped }).collect()
    }
}

/// Measures all figures and holds them against the limits.
///
/// The report depends on the job alone, not on the threads that `for_each` lends.
pub fn check(job: &Job<'_>, for_each: ForEach<'_>) -> CheckReport {
    check_faces(job, for_each).report
}

/// [`check`], with what single faces showed.
pub fn check_faces(job: &Job<'_>, for_each: ForEach<'_>) -> Checked {
    let mut checked = measure(job, for_each);
    let report = &mut checked.report;
    report.failures = verdict::failures(report, job);
    report.pass = report.failures.is_empty();
    checked
}

fn measure(job: &Job<'_>, for_each: ForEach<'_>) -> Checked {
    let Job { surface, field, .. } = *job;
    let at_vertices = vertex_jets(surface, field, for_each);
    let (grid, quadrature) = (&Grid::new(GRID), &Quadrature::new());
    let gauge = faces::Gauge { surface, field, grid, quadrature };
    let (mut topology, blocks) = blocks_beside(
        for_each,
        || Topology::of(surface),
        surface.faces().len(),
        |range| gauge.measure(range),
    );
    let mut faces = Faces::default();
    for block in blocks {
        faces.append(block);
    }
    topology.enter_volumes(|faces_of| volume::enclosed(surface, faces_of, &faces.moments));
    let gauge = edges::Gauge::new(surface, &at_vertices);
    let (worst, blocks) = blocks_beside(
        for_each,
        || foot::largest(surface, field, &faces.distances.faces, grid),
        topology.joints.len(),
        |range| gauge.measure(&topology.joints[range]),
    );
    let mut edges = Edges::default();
    for block in blocks {
        edges.append(block);
    }
    Parts { topology, faces, edges, worst, at_vertices, grid }.checked(job)
}

/// What the parts of the check found, in model units.
struct Parts<'a> {
    topology: Topology,
    faces: Faces,
    edges: Edges,
    worst: Option<(f64, Place)>,
    at_vertices: Vec<Jet1>,
    grid: &'a Grid,
}

impl Parts<'_> {
    /// The figures, relative where the report wants them so; no verdict yet.
    fn checked(mut self, job: &Job<'_>) -> Checked {
        let not_finite = self.not_finite(job.surface);
        let off_surface = self.at_vertices.iter().map(first_order).fold(0.0, worse);
        let Self { topology, faces, worst, .. } = self;
        let Edges { continuity, jumps, weights } = &mut self.edges;
        let distances = faces.distances;
        let surface = job.surface;
        let distance = distances.summary(surface, self.grid);
        let curvature = curvature::percentiles(jumps);
        let diagonal = surface.diagonal();
        let report = CheckReport {
            faces: surface.faces().len() as u64,
            vertices: surface.vertices().len() as u64,
            euler_characteristic: topology.euler_characteristic(surface),
            components: topology.components.len() as u32,
            genus: topology.components.iter().map(|c| c.genus).sum(),
            edge_defects: topology.defects,
            component_list: topology.components,
            diagonal,
            gap_max: worse(faces.corners.gap, continuity.gap) / diagonal,
            shared_bits_differ: faces.corners.bits_differ + continuity.bits_differ,
            g1_angle_deg_max: continuity.angle_deg_max(),
            g1_angle_deg_p99: percentile(&mut continuity.angles_deg, 99),
            curvature_jump_median: curvature.median,
            curvature_jump_p99: curvature.p99,
            rel_error_max: worst.map_or(f64::NAN, |(d, _)| d / diagonal),
            rel_error_grid_max: distance.max / diagonal,
            rel_error_rms: distance.rms / diagonal,
            rel_error_mean: distance.mean / diagonal,
            normal_error_deg_max: distance.normal_deg_max,
            flipped_patches: distance.flipped,
            degenerate_normals: distances.degenerate + continuity.degenerate_normals,
            vertex_error_max: worse(off_surface, faces.corners.gap) / diagonal,
            lambda0_out_of_range: weights.out_of_range,
            lambda0_min: weights.min,
            lambda0_max: weights.max,
            quality_min: quality::least(surface),
            not_finite,
            repairs: job.repairs.clone(),
            worst_error: worst.map(|(d, place)| Place { value: d / diagonal, ..place }),
            worst_g1_angle: continuity.worst_angle(surface),
            worst_normal: distance.worst_normal,
            pass: false,
            failures: Vec::new(),
        };
        Checked { report, faces: distances.faces }
    }

    fn not_finite(&self, surface: &Surface<'_>) -> u64 {
        let at_vertices = self.at_vertices.iter().filter(|jet| !first_order(jet).is_finite());
        count_not_finite(surface.vertices())
            + self.faces.not_finite
            + self.faces.distances.not_finite
            + at_vertices.count() as u64
    }
}

/// Field and gradient at every vertex.
fn vertex_jets(surface: &Surface<'_>, field: &dyn Field, for_each: ForEach<'_>) -> Vec<Jet1> {
    let blocks = blocks(for_each, surface.vertices().len(), |range| {
        let points = &surface.vertices()[range];
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        field.gradients(points, &mut jets);
        jets
    });
    blocks.concat()
}
