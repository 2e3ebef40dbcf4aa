//! How far the curve of an edge will be from the surface, before it is fitted.

use crate::sampled::{MOST_EDGES, quartic_errors};
use crate::vertex::Vertex;
use isospline_fitting::normal_curve::slant::Slant;
use isospline_fitting::normal_curve::{NormalEdge, NormalFit, NormalOptions};
use isospline_fitting::paper_curve::Ends;
use isospline_implicit::Field;
use isospline_stage::{Host, map};

/// Edges judged together: their samples fill the evaluator's blocks and stay in the nearest cache.
const BATCH: usize = MOST_EDGES;
/// Batches a task: fewer cost more to hand out than a second thread gains.
const BATCHES_A_TASK: usize = 2;

/// Eight iterations rank edges as thirty do.
const NORMAL: NormalOptions = NormalOptions { samples: 10, iterations: 8 };
/// Iterations for the few edges that have no sound curve after those: most come to one, and an
/// edge that is taken for hopeless draws faces that others need.
const PATIENT: NormalOptions = NormalOptions { iterations: 40, ..NORMAL };

/// An edge to be judged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JudgedEdge<'a> {
    /// Its two ends.
    pub(crate) ends: [&'a Vertex; 2],
    /// The vertices opposite to it in the face on its left and in that on its right; without them
    /// tangents turn freely.
    pub(crate) wings: Option<[&'a Vertex; 2]>,
}

/// Part of the error by [TK, Eq. (9)] that is added to the normal distance. Normal distance alone
/// lets the inside of patches become the worst place: dodecahedron of 1200 faces 2.7e-8 without
/// it, 7e-9 to 9e-9 with 1e-3 to 1e-2; torus of 600 1.2e-7, with 1e-2 4e-8.
const PARAMETRIC_PART: f64 = 1e-2;

/// How curves will be fitted.
#[derive(Clone, Debug)]
pub(crate) enum Measure {
    /// By [TK, Eq. (9)].
    Paper,
    /// By normal distance.
    Normal(NormalMeasure),
}

/// Fits by normal distance, short and long.
#[derive(Clone, Debug)]
pub(crate) struct NormalMeasure {
    quick: NormalFit,
    patient: NormalFit,
}

impl Measure {
    pub(crate) fn normal() -> Self {
        let (quick, patient) = (NormalFit::new(NORMAL), NormalFit::new(PATIENT));
        Self::Normal(NormalMeasure { quick, patient })
    }

    /// Distance from the surface of the curve between each pair of vertices, in model units; on
    /// the host's threads. An edge without a sound curve, or near which the field is not finite,
    /// has the error `0.1 * chord` at least.
    pub(crate) fn errors(
        &self,
        field: &dyn Field,
        host: &dyn Host,
        edges: &[JudgedEdge<'_>],
    ) -> Vec<f64> {
        let of_batch = |batch: &[JudgedEdge<'_>]| match self {
            Self::Paper => quartic_errors(field, &batch.iter().map(|e| e.ends).collect::<Vec<_>>()),
            Self::Normal(fit) => normal_errors_of(fit, field, batch),
        };
        let tasks: Vec<_> = edges.chunks(BATCH * BATCHES_A_TASK).collect();
        let judge = |k: usize| -> Vec<f64> { tasks[k].chunks(BATCH).flat_map(of_batch).collect() };
        map(host, tasks.len(), judge).concat()
    }
}

/// Largest normal distance of the curve of each edge, as the network stage will fit it, and
/// [`PARAMETRIC_PART`] of the distance of the curve of the paper.
fn normal_errors_of(fits: &NormalMeasure, field: &dyn Field, edges: &[JudgedEdge<'_>]) -> Vec<f64> {
    let edge = |JudgedEdge { ends, wings }: &JudgedEdge<'_>| NormalEdge {
        ends: Ends {
            points: ends.map(|v| v.position),
            normals: ends.map(|v| v.normal),
            shapes: ends.map(|v| v.shape),
        },
        slants: wings.map_or([Slant::free(); 2], |wings| slants(ends, &wings)),
    };
    let given: Vec<NormalEdge> = edges.iter().map(edge).collect();
    let fitted = |fit: &NormalFit, given: &[NormalEdge]| {
        fit.fit(field, given, &vec![None; given.len()]).into_iter().map(|c| c.map(|c| c.error))
    };
    let mut normal: Vec<Option<f64>> = fitted(&fits.quick, &given).collect();
    let hard: Vec<usize> = (0..given.len()).filter(|&i| normal[i].is_none()).collect();
    let again: Vec<NormalEdge> = hard.iter().map(|&i| given[i]).collect();
    for (i, error) in hard.into_iter().zip(fitted(&fits.patient, &again)) {
        normal[i] = error;
    }
    let parametric = quartic_errors(field, &edges.iter().map(|e| e.ends).collect::<Vec<_>>());
    // Without a curve that of the paper stays.
    let sum = |(normal, parametric): (Option<f64>, f64)| {
        normal.map_or(parametric, |normal| normal + PARAMETRIC_PART * parametric)
    };
    normal.into_iter().zip(parametric).map(sum).collect()
}

fn slants([a, b]: &[&Vertex; 2], [left, right]: &[&Vertex; 2]) -> [Slant; 2] {
    let at = |o: &Vertex, far: &Vertex, ccw: &Vertex, cw: &Vertex| {
        let from = |v: &Vertex| v.position - o.position;
        Slant::between(&from(far), &from(ccw), &from(cw), &o.normal)
    };
    [at(a, b, left, right), at(b, a, right, left)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vertex::vertices_at;
    use isospline_geometry::Vec3;
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;

    fn between(v: &[Vertex]) -> JudgedEdge<'_> {
        JudgedEdge { ends: [&v[0], &v[1]], wings: None }
    }

    #[test]
    fn on_a_sphere_the_error_falls_with_the_sixth_power_of_the_angle() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        let error = |angle: f64| {
            let ends = [Vec3::x(), Vec3::new(angle.cos(), angle.sin(), 0.0)];
            let v = vertices_at(&field, &Serial, &ends).unwrap();
            Measure::Paper.errors(&field, &Serial, &[between(&v)])[0]
        };
        let ratio = error(0.8) / error(0.4);
        assert!(error(0.4) < 1e-5 && error(0.4) > 1e-8, "{}", error(0.4));
        assert!((30.0..140.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn an_error_does_not_depend_on_what_is_judged_with_it() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        // From short edges to those without a sound curve, of which the last has no tangent.
        let angles = (1..=21).map(|k| 0.15 * f64::from(k)).chain([std::f64::consts::PI]);
        let ends: Vec<Vec3> =
            angles.flat_map(|a| [Vec3::x(), Vec3::new(a.cos(), a.sin(), 0.0)]).collect();
        let v = vertices_at(&field, &Serial, &ends).unwrap();
        let edges: Vec<_> = v.chunks(2).map(between).collect();
        let all = Measure::Paper.errors(&field, &Serial, &edges);
        for (edge, error) in edges.iter().zip(&all) {
            let alone = Measure::Paper.errors(&field, &Serial, &[*edge])[0];
            assert_eq!(alone.to_bits(), error.to_bits());
        }
        assert!(all[0] < 1e-7 && all[21] > 0.1, "{all:?}");
    }

    #[test]
    fn the_normal_distance_is_far_below_the_parametric_one() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        let ends = [Vec3::x(), Vec3::new(0.8, 0.6, 0.0)];
        let v = vertices_at(&field, &Serial, &ends).unwrap();
        let error = |measure: Measure| measure.errors(&field, &Serial, &[between(&v)])[0];
        let (normal, paper) = (error(Measure::normal()), error(Measure::Paper));
        assert!(50.0 * normal < paper, "{normal:e} {paper:e}");
    }

    #[test]
    fn a_straight_edge_in_a_plane_has_no_error() {
        let field = ClosureField::new(1.0, |p: Vec3| p.z).with_gradient(|_| Vec3::z());
        let field = field.with_hessian(|_| [0.0; 6]);
        let v = vertices_at(&field, &Serial, &[Vec3::zeros(), Vec3::new(1.0, 2.0, 0.0)]).unwrap();
        assert!(Measure::Paper.errors(&field, &Serial, &[between(&v)])[0] < 1e-16);
    }
}
