//! Stage network: a quartic boundary curve for every edge of the base mesh.

mod error;
mod paper_faces;
mod params;

pub use error::NetworkError;
pub use params::{Method, NetworkParams};

use isospline_artifact::kinds::{
    BaseMeshView, Bounds, CurvatureView, CurveFit, CurveStatus, Network,
};
use isospline_fitting::curve_samples::Samples;
use isospline_fitting::normal_curve::slant::Slant;
use isospline_fitting::normal_curve::{NormalCurve, NormalEdge, NormalFit, NormalOptions};
use isospline_fitting::paper_curve::{Ends, Solution};
use isospline_fitting::paper_curves::fit_curves;
use isospline_fitting::projection::project_all;
use isospline_geometry::Vec3;
use isospline_implicit::Jet1;
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use paper_faces::PaperFaces;
use std::ops::Range;

/// Fits each edge by itself under the curvature conditions [TK, Eq. (9b)].
#[derive(Clone, Debug)]
pub struct NetworkStage {
    samples: Samples,
    /// What goes on from the curves of the paper.
    normal: Option<NormalFit>,
    paper_faces: PaperFaces,
}

impl Stage for NetworkStage {
    const NAME: &'static str = "network";
    const VERSION: u32 = 4;
    type Params = NetworkParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = (CurvatureView<'a>,);
    type Output = Network;
    type Error = NetworkError;

    fn prepare(
        _: &Ctx<'_>,
        params: &NetworkParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, NetworkError> {
        let options =
            NormalOptions { samples: params.normal_samples, iterations: params.iterations };
        let normal = (params.method == Method::Normal).then(|| NormalFit::new(options));
        let paper_faces = PaperFaces::new(&params.paper_faces);
        Ok(Self { samples: Samples::new(params.samples), normal, paper_faces })
    }

    fn plan(&self, (mesh,): (BaseMeshView<'_>,), rows_per_task: usize) -> Plan {
        let n_edges = mesh.edge.len();
        let tasks = cut(n_edges, rows_per_task).map(|rows| {
            let sectors = rows.clone().flat_map(|e| end_sectors(&mesh, e)).collect();
            let needs = vec![Need { input: 0, section: "shape", rows: ranges(sectors) }];
            Task { writes: vec![rows; 3], needs }
        });
        Plan::Rows { lengths: vec![n_edges; 3], tasks: tasks.collect() }
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (curvature,): (CurvatureView<'_>,),
        task: &Task,
    ) -> Result<Piece<Network>, NetworkError> {
        let edges = task.writes[0].clone();
        let all: Vec<Ends> = edges.clone().map(|e| ends(&mesh, &curvature, e)).collect();
        let mut curves = self.paper_curves(ctx, &mesh, edges.clone(), &all);
        let mut piece = Piece::<Network>::default();
        if let Some(fit) = &self.normal {
            let is_kept = |(k, curve): (usize, &Option<Solution>)| {
                sound(*curve).is_some() && self.paper_faces.are_beside(&mesh, edges.start + k)
            };
            let kept: Vec<bool> = curves.iter().enumerate().map(is_kept).collect();
            let n_kept = kept.iter().filter(|&&kept| kept).count();
            piece.counters.repair("curves_of_the_paper", n_kept as u64);
            let slants = edges.clone().map(|e| Slant::at_ends(&mesh, e));
            let all: Vec<NormalEdge> = all
                .into_iter()
                .zip(slants)
                .map(|(ends, slants)| NormalEdge { ends, slants })
                .collect();
            improve(ctx, fit, &all, &kept, &mut curves);
        }
        for (edge, curve) in edges.clone().zip(curves) {
            record(&mut piece, &curve.ok_or_else(|| no_curve(&mesh, edge))?);
        }
        measure(ctx, &self.samples, &mesh, edges, &mut piece);
        Ok(piece)
    }
}

impl NetworkStage {
    /// The curve of each edge by the method of the paper; `None` where it has none.
    fn paper_curves(
        &self,
        ctx: &Ctx<'_>,
        mesh: &BaseMeshView<'_>,
        edges: Range<usize>,
        all: &[Ends],
    ) -> Vec<Option<Solution>> {
        let targets = self.targets(ctx, mesh, &mesh.bounds[0], edges);
        fit_curves(all, &self.samples, &targets)
    }

    /// Projections of the inner sample points of the chords, edge after edge.
    fn targets(
        &self,
        ctx: &Ctx<'_>,
        mesh: &BaseMeshView<'_>,
        bounds: &Bounds,
        edges: Range<usize>,
    ) -> Vec<Vec3> {
        let mut points = Vec::with_capacity(edges.len() * self.samples.len());
        for edge in edges {
            let [a, b] = mesh.edge[edge].map(|v| Vec3::from(mesh.position[v as usize]));
            points.extend(self.samples.parameters().map(|t| a + t * (b - a)));
        }
        // A target that misses the surface only biases the fit; the checks measure the result.
        project_all(ctx.field, bounds.diagonal, &mut points);
        points
    }
}

/// Replaces curves by ones of less normal distance, but for those that are `kept`.
fn improve(
    ctx: &Ctx<'_>,
    fit: &NormalFit,
    all: &[NormalEdge],
    kept: &[bool],
    curves: &mut [Option<Solution>],
) {
    let open = |k: &usize| !kept[*k];
    let open: Vec<usize> = (0..all.len()).filter(open).collect();
    let edges: Vec<NormalEdge> = open.iter().map(|&k| all[k]).collect();
    let starts: Vec<_> = open.iter().map(|&k| sound(curves[k]).map(|c| c.inner)).collect();
    for (k, better) in open.into_iter().zip(fit.fit(ctx.field, &edges, &starts)) {
        if let Some(better) = better {
            curves[k] = Some(solution(&better));
        }
    }
}

/// A curve that is fit to go on from: one from the table of lengths lies too far from any good one.
fn sound(curve: Option<Solution>) -> Option<Solution> {
    curve.filter(|c| c.status == CurveStatus::Converged)
}

fn solution(curve: &NormalCurve) -> Solution {
    Solution {
        inner: curve.inner,
        tangent: curve.tangent,
        residual: curve.residual,
        iterations: curve.iterations,
        status: CurveStatus::Converged,
    }
}

/// Sectors at the two ends of an edge: those of its first half-edge and of the opposite one.
fn end_sectors(mesh: &BaseMeshView<'_>, edge: usize) -> [usize; 2] {
    mesh.edge_half[edge].map(|h| mesh.sector[h as usize] as usize)
}

fn ends(mesh: &BaseMeshView<'_>, curvature: &CurvatureView<'_>, edge: usize) -> Ends {
    let sectors = end_sectors(mesh, edge);
    Ends {
        points: mesh.edge[edge].map(|v| Vec3::from(mesh.position[v as usize])),
        normals: sectors.map(|s| Vec3::from(mesh.frame[s].normal)),
        shapes: sectors.map(|s| curvature.shape[s]),
    }
}

fn no_curve(mesh: &BaseMeshView<'_>, edge: usize) -> NetworkError {
    let [a, b] = mesh.edge[edge].map(|v| Vec3::from(mesh.position[v as usize]));
    NetworkError::NoCurve { edge: edge as u32, place: 0.5 * (a + b) }
}

fn record(piece: &mut Piece<Network>, solution: &Solution) {
    let [q1, q2, q3] = solution.inner;
    piece.rows.control.push([q1.x, q1.y, q1.z, q2.x, q2.y, q2.z, q3.x, q3.y, q3.z]);
    piece.rows.tangent.push(solution.tangent);
    piece.rows.fit.push(CurveFit {
        residual: solution.residual,
        error: 0.0,
        iterations: solution.iterations,
        status: solution.status.code(),
    });
    let counters = &mut piece.counters;
    counters.count("curve_iterations", u64::from(solution.iterations));
    counters.count("curves", 1);
    counters.max("curve_iterations_max", f64::from(solution.iterations));
    counters.repair("curves_clamped", u64::from(solution.status == CurveStatus::Clamped));
}

/// Fills in the distance of each curve to the surface at the inner samples.
fn measure(
    ctx: &Ctx<'_>,
    samples: &Samples,
    mesh: &BaseMeshView<'_>,
    edges: Range<usize>,
    piece: &mut Piece<Network>,
) {
    let mut points = Vec::with_capacity(edges.len() * samples.len());
    for (edge, c) in edges.zip(&piece.rows.control) {
        let [a, b] = mesh.edge[edge].map(|v| Vec3::from(mesh.position[v as usize]));
        let at = |k: usize| Vec3::new(c[3 * k], c[3 * k + 1], c[3 * k + 2]);
        points.extend(samples.curve_points(&[a, at(0), at(1), at(2), b]));
    }
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    ctx.field.gradients(&points, &mut jets);
    for (fit, jets) in piece.rows.fit.iter_mut().zip(jets.chunks_exact(samples.len())) {
        let distance = |jet: &Jet1| jet.value.abs() / jet.gradient.norm();
        fit.error = jets.iter().map(distance).fold(0.0, f64::max);
        piece.counters.max("curve_distance_max_rel", fit.error / mesh.bounds[0].diagonal);
    }
}
