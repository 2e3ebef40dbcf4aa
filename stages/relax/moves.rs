//! The space of exact G1 surfaces over fixed curves, as local moves that keep every condition.
//!
//! With curves and `lambda` fixed the conditions are linear, so the moves between exact surfaces
//! form a linear space. Its basis: one move a half-edge (a spoke of its vertex), which shifts the
//! two twists beside it, and seven an edge, six of which change the rows beside it alone and one
//! the scalar `nu`. The three innermost points of a face are free. That makes 22.5 moves a face.
//!
//! *A spoke's move* [derived]. Row k = 1 asks of the tangential twists `T` left and right of spoke i
//! that `a_i . ((1 - lambda0) T_left + lambda0 T_right)` stays, `a_i` across the spoke in the
//! tangent plane; what it asks along the spoke only sets `mu1`. A shift of `T_left` along spoke
//! i + 1 and of `T_right` along spoke i - 1 is seen by no `a` but `a_i`, so the pair
//! `lambda0 q_{i+1} / (a_i . q_{i+1})` and `-(1 - lambda0) q_{i-1} / (a_i . q_{i-1})` keeps all
//! rows of the vertex.
//!
//! The rows of the edges i - 1, i, i + 1 follow by least norm, so a spoke's move reaches the four
//! faces about them and no other.
//!
//! *Degree 6* [derived]. The same moves of spokes; of the rows beside an edge one combination is
//! free, three moves in place of six, and there is one innermost point; `mu1` of both ends and `nu`
//! are tied by one equation an edge (`isospline_fitting::sextic_edge`). That makes 10.5 moves a face:
//! 12, which are not free of each other, less 1.5 ties.
//
// symbols: q control points of a curve, p and r first inner rows left and right of an edge

use crate::degree::Degree;
use crate::ties::Tie;
use isospline_artifact::kinds::{BaseMeshView, NetworkView, VertexSystemsView};
use isospline_fitting::edge_end::{ccw, cw, outgoing_curve, outgoing_tangent};
use isospline_fitting::edge_system::{Points, System, nu_column};
use isospline_fitting::sextic_edge::{self, SexticSystem, fourth_difference, free_combination};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::Host;
use isospline_stage::host::map;

/// Least squared size of the move of `nu`, in squared chords: where the fourth difference of a
/// curve vanishes, `nu` moves nothing.
const LEAST_NU: f64 = 1e-4;

/// What one unit of a spoke's move does to the twists beside it; the two have length 1 together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spoke {
    /// Shift of the twist of the face left of the half-edge.
    pub(crate) left: Vec3,
    /// Shift of the twist of the face right of it.
    pub(crate) right: Vec3,
    lambda0: f64,
    tangent: Vec3,
}

/// Moves of p2, r2, p3, r3, p4, r4; of degree 6, of p2, r2, nothing, p3, r3.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeMoves {
    /// Two orthonormal combinations, each in three directions; of degree 6 one.
    pub(crate) free: [[f64; 6]; 2],
    /// The move of `nu`.
    pub(crate) nu: Points,
    /// What the spokes `cw`, own, `ccw` of the lower and of the higher vertex entail.
    pub(crate) ends: [[Points; 3]; 2],
    /// `nu` a unit of its move.
    pub(crate) nu_scale: f64,
}

/// All moves but those of the innermost points.
#[derive(Debug)]
pub(crate) struct Moves {
    /// By half-edge.
    pub(crate) spokes: Vec<Spoke>,
    /// By edge.
    pub(crate) edges: Vec<EdgeMoves>,
    /// By edge of patches of degree 6, else empty.
    pub(crate) ties: Vec<Tie>,
}

impl Moves {
    pub(crate) fn new(
        host: &dyn Host,
        mesh: &BaseMeshView<'_>,
        network: &NetworkView<'_>,
        vertices: &VertexSystemsView<'_>,
        degree: Degree,
    ) -> Self {
        let lambda0 = |h: HalfEdge| vertices.weights[mesh.star_row[h.row()] as usize][0];
        let spokes: Vec<Spoke> = map(host, mesh.opposite.len(), |h| {
            let h = HalfEdge(h as u32);
            Spoke::new(mesh, network, lambda0(h), h)
        });
        let edge = |e: usize| {
            let halves = mesh.edge_half[e].map(HalfEdge);
            let q = outgoing_curve(mesh, network, halves[0]);
            let lambda = [lambda0(halves[0]), 1.0 - lambda0(halves[1])];
            let ends = halves.map(|h| TwistMoves::about(mesh, &spokes, h, degree));
            (q, lambda, ends)
        };
        let n_edges = mesh.edge.len();
        let (edges, ties) = match degree {
            Degree::Seven => {
                let septic = |(q, lambda, ends)| EdgeMoves::septic(&q, lambda, &ends);
                (map(host, n_edges, |e| septic(edge(e))), Vec::new())
            }
            Degree::Six => {
                let sextic = |(q, lambda, ends)| EdgeMoves::sextic(&q, lambda, &ends);
                map(host, n_edges, |e| sextic(edge(e))).into_iter().unzip()
            }
        };
        Self { spokes, edges, ties }
    }
}

impl Spoke {
    fn new(mesh: &BaseMeshView<'_>, network: &NetworkView<'_>, lambda0: f64, h: HalfEdge) -> Self {
        let normal = Vec3::from(mesh.frame[mesh.sector[h.row()] as usize].normal);
        let along = |h| outgoing_tangent(mesh, network, h);
        let (tangent, next, previous) = (along(h), along(ccw(mesh, h)), along(cw(mesh, h)));
        let across = normal.cross(&tangent);
        let left = next * (lambda0 / across.dot(&next));
        let right = -previous * ((1.0 - lambda0) / across.dot(&previous));
        let size = (left.norm_squared() + right.norm_squared()).sqrt();
        // Where neighbouring tangents coincide no move is known: the spoke then stands still.
        let scale = if size.is_finite() && size > 0.0 { 1.0 / size } else { 0.0 };
        let scaled = |v: Vec3| if scale > 0.0 { scale * v } else { Vec3::zeros() };
        Self { left: scaled(left), right: scaled(right), lambda0, tangent }
    }

    /// Change of `mu1` when the twists left and right of the spoke move: the component of row
    /// k = 1 along the spoke, `6 (..) = 4 mu1 (q1 - q0) + ..`, of degree 6 `5 (..) = 3 mu1 ..`.
    fn mu1(&self, left: &Vec3, right: &Vec3, degree: Degree) -> f64 {
        let factor = match degree {
            Degree::Six => 5.0 / 3.0,
            Degree::Seven => 6.0 / 4.0,
        };
        let mixed = (1.0 - self.lambda0) * left + self.lambda0 * right;
        factor * self.tangent.dot(&mixed) / self.tangent.norm_squared()
    }
}

/// Shifts of the twists left and right of a spoke, and of its `mu1`, under three moves.
struct TwistMoves([(Vec3, Vec3, f64); 3]);

impl TwistMoves {
    fn about(mesh: &BaseMeshView<'_>, spokes: &[Spoke], h: HalfEdge, degree: Degree) -> Self {
        let own = &spokes[h.row()];
        let (before, after) = (&spokes[cw(mesh, h).row()], &spokes[ccw(mesh, h).row()]);
        let shifts =
            [(Vec3::zeros(), before.left), (own.left, own.right), (after.right, Vec3::zeros())];
        Self(shifts.map(|(left, right)| (left, right, own.mu1(&left, &right, degree))))
    }
}

impl EdgeMoves {
    fn septic(q: &[Vec3; 5], lambda: [f64; 2], [lower, higher]: &[TwistMoves; 2]) -> Self {
        let system = System::new(lambda);
        let along_nu = system.least_norm(&nu_column(q, lambda).map(|x| -x));
        // Both directions read the twists from their own end; the right one runs backwards.
        let at_lower = |(p1, r1, mu1)| system.least_norm(&lower_end(q, lambda[1], p1, r1, mu1));
        let at_higher = |(r5, p5, mu1)| system.least_norm(&higher_end(q, p5, r5, mu1));
        let ends = [lower.0.map(at_lower), higher.0.map(at_higher)];
        let nu_scale = nu_scale(&along_nu, q);
        let nu = along_nu.map(|x| nu_scale * x);
        Self { free: free_combinations(&system), nu, ends, nu_scale }
    }

    fn sextic(q: &[Vec3; 5], lambda: [f64; 2], [lower, higher]: &[TwistMoves; 2]) -> (Self, Tie) {
        let system = SexticSystem::new(lambda);
        let moved = |rhs: [Vec3; 3]| slots(system.least_norm(&rhs), Vec3::zeros());
        let at_lower = |(p1, r1, mu1)| moved(sextic_edge::lower_end(q, lambda[1], p1, r1, mu1));
        let at_higher = |(r4, p4, mu1)| moved(sextic_edge::higher_end(q, lambda[0], p4, r4, mu1));
        let ends = [lower.0.map(at_lower), higher.0.map(at_higher)];
        let along_nu = moved([Vec3::zeros(), Vec3::zeros(), fourth_difference(q)]);
        let nu_scale = nu_scale(&along_nu, q);
        let nu = along_nu.map(|x| nu_scale * x);
        let free = [slots(free_combination(lambda), 0.0), [0.0; 6]];
        // mu2 of the edge falls when mu1 of the higher end grows, so both ends count alike.
        let tie = Tie {
            ends: [lower, higher].map(|end| end.0.map(|(_, _, mu1)| 3.0 * mu1)),
            nu: (lambda[0] - lambda[1]) * nu_scale,
            chord_sq: (q[4] - q[0]).norm_squared(),
        };
        (Self { free, nu, ends, nu_scale }, tie)
    }
}

/// What is given of p2, r2, p3, r3 of degree 6, in the slots of a septic row.
fn slots<T: Copy>([p2, r2, p3, r3]: [T; 4], zero: T) -> [T; 6] {
    [p2, r2, zero, zero, p3, r3]
}

/// The amount of `nu` whose move shifts the points by a unit of length together.
fn nu_scale(along_nu: &Points, q: &[Vec3; 5]) -> f64 {
    let size_sq = along_nu.iter().map(Vec3::norm_squared).sum::<f64>();
    1.0 / (size_sq + LEAST_NU * (q[4] - q[0]).norm_squared()).sqrt()
}

/// Change of the right sides of an edge system when p1, r1 and `mu1` of the lower end change
/// by these.
fn lower_end(q: &[Vec3; 5], lambda1: f64, p1: Vec3, r1: Vec3, mu1: f64) -> [Vec3; 4] {
    let mu2 = 4.0 / 6.0 * mu1;
    let d: [Vec3; 4] = std::array::from_fn(|i| q[i + 1] - q[i]);
    [
        12.0 * mu1 * d[1] + 6.0 * mu2 * d[0] - 6.0 * ((1.0 - lambda1) * p1 + lambda1 * r1),
        12.0 * mu1 * d[2] + 18.0 * mu2 * d[1],
        4.0 * mu1 * d[3] + 18.0 * mu2 * d[2],
        6.0 * (p1 - r1),
    ]
}

/// The same for p5, r5 and the `mu1` of the higher end, which is `1 - mu3` of the edge.
fn higher_end(q: &[Vec3; 5], p5: Vec3, r5: Vec3, mu1: f64) -> [Vec3; 4] {
    let (mu2, mu3) = (-4.0 / 6.0 * mu1, -mu1);
    let d: [Vec3; 4] = std::array::from_fn(|i| q[i + 1] - q[i]);
    [
        6.0 * mu2 * d[0],
        18.0 * mu2 * d[1] + 4.0 * mu3 * d[0],
        18.0 * mu2 * d[2] + 12.0 * mu3 * d[1],
        6.0 * (p5 - r5),
    ]
}

/// Two orthonormal vectors that the matrix of an edge maps to zero.
fn free_combinations(system: &System) -> [[f64; 6]; 2] {
    let norm_sq = |v: &[f64; 6]| v.iter().map(|x| x * x).sum::<f64>();
    // Columns of the projector onto the kernel; the two longest, made orthogonal, span it.
    let mut projected: [[f64; 6]; 6] = std::array::from_fn(|k| {
        let column = std::array::from_fn(|i| Vec3::new(system.a[i][k], 0.0, 0.0));
        let x = system.least_norm(&column);
        std::array::from_fn(|i| f64::from(u8::from(i == k)) - x[i].x)
    });
    [(); 2].map(|()| {
        let longest =
            projected.iter().copied().reduce(|a, b| if norm_sq(&b) > norm_sq(&a) { b } else { a });
        let longest = longest.expect("invariant: six columns");
        let unit = longest.map(|x| x / norm_sq(&longest).sqrt());
        for v in &mut projected {
            let part: f64 = v.iter().zip(&unit).map(|(a, b)| a * b).sum();
            v.iter_mut().zip(&unit).for_each(|(a, b)| *a -= part * b);
        }
        unit
    })
}
