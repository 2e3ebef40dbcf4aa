//! Vertices that leave the surface, and normals that leave its own, so that curves lie nearer.
//!
//! A curve that takes position, tangent plane and curvature from the surface has nothing left to
//! cancel its error with. Unknowns of each vertex are an offset along the normal, two tilts of it
//! and the three entries of the second fundamental form; the curves, fitted anew after every step,
//! are eliminated.

use crate::AdaptError;
use crate::vertex::{Vertex, vertices_at};
use isospline_artifact::kinds::BaseMesh;
use isospline_fitting::normal_curve::answer::{Answer, OWN};
use isospline_fitting::normal_curve::slant::Slant;
use isospline_fitting::normal_curve::{NormalCurve, NormalEdge, NormalFit, NormalOptions};
use isospline_fitting::paper_curve::Ends;
use isospline_fitting::vertex_star::Frame;
use isospline_geometry::Vec3;
use isospline_geometry::linear::solve;
use isospline_implicit::Jet1;
use isospline_stage::{Counters, Ctx, map};

/// Steps at most. The first four lower squared distances thirty- to seventyfold, the next four
/// twice, and patches gain nothing from those.
const STEPS: u32 = 6;
/// A step that lowers the squared distances by a smaller part is the last.
const LITTLE_GAIN: f64 = 0.02;
/// Damping of the first step, times the diagonal of a vertex's equations.
const FIRST_DAMPING: f64 = 1e-3;
/// Factors on it after a step that helped, and after one that did not.
const DAMPING_FACTORS: [f64; 2] = [0.1, 10.0];
/// Passes over the vertices in the solution of a step's equations.
const PASSES: u32 = 60;
/// Largest offset, times the mean chord, largest tilt and largest change of the form over the mean
/// chord: far more than smooth edges need.
const LARGEST_MOVE: f64 = 1e-2;
/// How curves are fitted between steps. Answers hold for curves that have come to rest: with 16
/// iterations each, a first step gains a tenth and the next ones nothing.
const FIT: NormalOptions = NormalOptions { samples: 12, iterations: 40 };
/// Edges a task.
const SHARE: usize = 64;

/// Inner control points of an edge's curve, if it has one.
type Inner = Option<[Vec3; 3]>;

/// Moves vertices, tilts normals and bends forms where that lowers the distance of curves from the
/// surface. Positions are then off the surface by about the error of the curves.
pub(crate) fn settle(
    ctx: &Ctx<'_>,
    base: &mut BaseMesh,
    counters: &mut Counters,
) -> Result<(), AdaptError> {
    let problem = Problem::new(ctx, base);
    let no_starts = vec![None; base.edge.len()];
    let mut best = problem.judged(State::of(ctx, base)?, &no_starts);
    counters.max("free_rms_rel_in", problem.rms_rel(&best));
    let mut damping = FIRST_DAMPING;
    for _ in 0..STEPS {
        let next = problem.judged(best.state.moved(&problem.step(&best, damping)), &best.inner);
        // Edges without a curve tell nothing: no step may make more of them.
        let helps = next.n_curves >= best.n_curves && next.cost < best.cost;
        damping *= DAMPING_FACTORS[usize::from(!helps)];
        if helps {
            let gain = 1.0 - next.cost / best.cost;
            best = next;
            counters.count("free_steps", 1);
            if gain < LITTLE_GAIN {
                break;
            }
        }
    }
    counters.max("free_rms_rel", problem.rms_rel(&best));
    best.state.store(base);
    Ok(())
}

/// What a step may change, by vertex.
#[derive(Clone, Debug)]
struct State(Vec<Vertex>);

impl State {
    fn of(ctx: &Ctx<'_>, base: &BaseMesh) -> Result<Self, AdaptError> {
        let positions: Vec<Vec3> = base.position.iter().map(|&p| p.into()).collect();
        Ok(Self(vertices_at(ctx.field, ctx.host, &positions)?))
    }

    /// After these moves in model units and radians.
    fn moved(&self, moves: &[[f64; OWN]]) -> Self {
        Self(self.0.iter().zip(moves).map(|(vertex, moves)| moved(vertex, moves)).collect())
    }

    fn store(&self, base: &mut BaseMesh) {
        for ((position, frame), vertex) in
            base.position.iter_mut().zip(&mut base.frame).zip(&self.0)
        {
            *position = vertex.position.into();
            frame.normal = vertex.normal.into();
        }
        base.shape = self.0.iter().map(|vertex| vertex.shape).collect();
    }
}

fn moved(vertex: &Vertex, &[offset, first, second, aa, ab, bb]: &[f64; OWN]) -> Vertex {
    let frame = Frame::about(vertex.normal);
    let [a, b] = frame.axes;
    let mixed = a * b.transpose();
    let m = aa * a * a.transpose() + ab * (mixed + mixed.transpose()) + bb * b * b.transpose();
    let change = [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33];
    Vertex {
        position: vertex.position + offset * frame.normal,
        normal: frame.lift([first, second], 1.0).normalize(),
        shape: std::array::from_fn(|k| vertex.shape[k] + change[k]),
    }
}

/// A state with the answers of its curves.
struct Judged {
    state: State,
    /// By edge; `None` without a curve.
    answers: Vec<Option<Answer>>,
    inner: Vec<Inner>,
    /// Length of each edge's chord.
    chords: Vec<f64>,
    n_curves: usize,
    /// Half the squared distances, model units.
    cost: f64,
}

/// What all steps share.
struct Problem<'a, 'b> {
    ctx: &'a Ctx<'b>,
    fit: NormalFit,
    edges: Vec<[u32; 2]>,
    slants: Vec<[Slant; 2]>,
    /// Edges of each vertex, and which end of the edge it is.
    around: Vec<Vec<(usize, usize)>>,
    diagonal: f64,
}

impl<'a, 'b> Problem<'a, 'b> {
    fn new(ctx: &'a Ctx<'b>, base: &BaseMesh) -> Self {
        let view = base.view();
        let mut around = vec![Vec::new(); base.position.len()];
        for (e, ends) in base.edge.iter().enumerate() {
            (0..2).for_each(|end| around[ends[end] as usize].push((e, end)));
        }
        Self {
            ctx,
            fit: NormalFit::new(FIT),
            edges: base.edge.clone(),
            slants: (0..base.edge.len()).map(|e| Slant::at_ends(&view, e)).collect(),
            around,
            diagonal: base.bounds[0].diagonal,
        }
    }

    /// Root of the mean squared distance at the samples of the curves, relative.
    fn rms_rel(&self, at: &Judged) -> f64 {
        let n = at.n_curves.max(1) as f64 * f64::from(FIT.samples);
        (2.0 * at.cost / n).sqrt() / self.diagonal
    }

    /// Fits all curves, from `starts` among others.
    fn judged(&self, state: State, starts: &[Inner]) -> Judged {
        let edge = |e: usize| NormalEdge { ends: self.ends(&state, e), slants: self.slants[e] };
        let edges: Vec<NormalEdge> = (0..self.edges.len()).map(edge).collect();
        let shares: Vec<_> = edges.chunks(SHARE).zip(starts.chunks(SHARE)).collect();
        let found = map(self.ctx.host, shares.len(), |k| self.fitted(shares[k].0, shares[k].1));
        let (answers, inner): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
        let chord = |edge: &NormalEdge| (edge.ends.points[1] - edge.ends.points[0]).norm();
        let chords: Vec<f64> = edges.iter().map(chord).collect();
        let cost = |(answer, chord): (&Option<Answer>, &f64)| {
            answer.as_ref().map_or(0.0, |answer| answer.cost * chord * chord)
        };
        let total = answers.iter().zip(&chords).map(cost).sum();
        let n_curves = answers.iter().flatten().count();
        Judged { state, inner, answers, chords, n_curves, cost: total }
    }

    fn ends(&self, State(vertices): &State, edge: usize) -> Ends {
        let ends = self.edges[edge].map(|v| &vertices[v as usize]);
        Ends {
            points: ends.map(|v| v.position),
            normals: ends.map(|v| v.normal),
            shapes: ends.map(|v| v.shape),
        }
    }

    fn fitted(&self, edges: &[NormalEdge], starts: &[Inner]) -> Vec<(Option<Answer>, Inner)> {
        let curves = self.fit.fit(self.ctx.field, edges, starts);
        let answer = |(edge, curve): (&NormalEdge, Option<NormalCurve>)| {
            let answer = curve.as_ref().and_then(|curve| self.answer(edge, curve));
            (answer, curve.map(|curve| curve.inner))
        };
        edges.iter().zip(curves).map(answer).collect()
    }

    fn answer(&self, edge: &NormalEdge, curve: &NormalCurve) -> Option<Answer> {
        let points: Vec<Vec3> = self.fit.points(edge, curve).collect();
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        self.ctx.field.gradients(&points, &mut jets);
        let axes = edge.ends.normals.map(|n| Frame::about(n).axes);
        self.fit.answer(edge, curve, &jets, &axes)
    }

    /// Damped Gauss-Newton moves of all vertices, by passes over the vertices in their order.
    fn step(&self, at: &Judged, damping: f64) -> Vec<[f64; OWN]> {
        let scales: Vec<f64> = self.around.iter().map(|edges| mean_chord(at, edges)).collect();
        let mut moves = vec![[0.0; OWN]; scales.len()];
        for _ in 0..PASSES {
            for v in 0..moves.len() {
                moves[v] = self.own_moves(at, damping, &scales, &moves, v).unwrap_or_default();
            }
        }
        let capped = |(moves, scale): ([f64; OWN], f64)| {
            let capped = moves.map(|x| x.clamp(-LARGEST_MOVE, LARGEST_MOVE));
            let [offset, first, second, aa, ab, bb] = capped;
            [offset * scale, first, second, aa / scale, ab / scale, bb / scale]
        };
        moves.into_iter().zip(scales).map(capped).collect()
    }

    /// Moves of one vertex that are best while the others make theirs; offsets over mean chords, forms
    /// times them.
    fn own_moves(
        &self,
        at: &Judged,
        damping: f64,
        scales: &[f64],
        moves: &[[f64; OWN]],
        vertex: usize,
    ) -> Option<[f64; OWN]> {
        let mut matrix = [[0.0; OWN]; OWN];
        let mut rhs = [0.0; OWN];
        for &(e, end) in &self.around[vertex] {
            let Some(answer) = &at.answers[e] else { continue };
            let chord = at.chords[e];
            let other = self.edges[e][1 - end] as usize;
            // Offsets and forms of the answer are in its own chord, its values in squared chords.
            let unit = |v: usize, k: usize| match k {
                0 => scales[v] / chord,
                1 | 2 => 1.0,
                _ => chord / scales[v],
            };
            for i in 0..OWN {
                let row = &answer.matrix[OWN * end + i];
                let weight = chord * chord * unit(vertex, i);
                rhs[i] -= weight * answer.gradient[OWN * end + i];
                for j in 0..OWN {
                    matrix[i][j] += weight * unit(vertex, j) * row[OWN * end + j];
                    let by_other = row[OWN * (1 - end) + j] * unit(other, j);
                    rhs[i] -= weight * by_other * moves[other][j];
                }
            }
        }
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] *= 1.0 + damping;
        }
        solve(matrix, rhs)
    }
}

fn mean_chord(at: &Judged, edges: &[(usize, usize)]) -> f64 {
    edges.iter().map(|&(e, _)| at.chords[e]).sum::<f64>() / edges.len() as f64
}
