//! The equation of an edge between patches of degree 6 that ties the moves of its two ends.
//!
//! Tiles keep the ties by a penalty: at the minimum a gap is as small as the force on it, below the
//! distance that is left. What remains is closed for all edges together at the end.

use crate::face_moves::{OWN, column};
use crate::numbering::Numbering;
use crate::tiling::Tile;
use isospline_artifact::kinds::BaseMeshView;
use isospline_fitting::edge_end::{ccw, cw};
use isospline_geometry::HalfEdge;

/// Moves that a tie ties: three spokes of each end, and that of `nu`.
const TIED: usize = 7;
/// Penalty on squared gaps in chords, beside squared distances.
const PENALTY: f64 = 1.0;
/// Steps of conjugate gradients at most; a hundred bring gaps to rounding.
const STEPS: usize = 1000;
/// Part of the largest gap that is rounding.
const ROUNDING: f64 = 1e-15;

/// What a unit of each move changes the gap by which an edge misses the row that ties its ends
/// (`SexticEdge::gap`); in 1 over lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tie {
    /// Of the spokes `cw`, own, `ccw` of the lower and of the higher vertex.
    pub(crate) ends: [[f64; 3]; 2],
    /// Of `nu`.
    pub(crate) nu: f64,
    /// Square of the chord.
    pub(crate) chord_sq: f64,
}

impl Tie {
    fn coefficients(&self) -> [f64; TIED] {
        let [[a, b, c], [d, e, f]] = self.ends;
        [a, b, c, d, e, f, self.nu]
    }
}

/// A tie among the unknowns of a tile.
#[derive(Clone, Debug)]
pub(crate) struct TileTie {
    /// Unknowns and what a unit of each changes the gap.
    pub(crate) terms: Vec<(usize, f64)>,
    /// Of the squared gap.
    pub(crate) weight: f64,
    /// Before the step.
    pub(crate) gap: f64,
}

impl TileTie {
    /// The ties of a tile's edges; none where patches are of degree 7.
    pub(crate) fn all(
        mesh: &BaseMeshView<'_>,
        ties: &[Tie],
        gap: &[f64],
        tile: &Tile,
        numbering: &Numbering,
    ) -> Vec<Self> {
        let tie = |&e: &u32| {
            let (tie, h) = (ties.get(e as usize)?, HalfEdge(mesh.edge_half[e as usize][0]));
            let face = tile.faces.binary_search(&h.face()).expect("invariant: an edge inside");
            let columns = numbering.columns[face];
            let unknown = |(i, x): (usize, f64)| {
                let which = if i == TIED - 1 { OWN - 1 } else { OWN + i };
                columns[column(h.corner() as usize, which)].map(|c| (c as usize, x))
            };
            let terms = tie.coefficients().into_iter().enumerate().filter_map(unknown).collect();
            Some(Self { terms, weight: PENALTY * tie.chord_sq, gap: gap[e as usize] })
        };
        tile.edges.iter().filter_map(tie).collect()
    }

    /// Change of the gap under these amounts of all unknowns.
    pub(crate) fn change(&self, amounts: &[f64]) -> f64 {
        self.terms.iter().map(|&(unknown, x)| x * amounts[unknown]).sum()
    }
}

/// Amounts of moves.
#[derive(Clone, Debug)]
pub(crate) struct Amounts {
    /// By half-edge.
    pub(crate) spokes: Vec<f64>,
    /// Of `nu`, by edge.
    pub(crate) nu: Vec<f64>,
}

/// The least amounts that close these gaps, by conjugate gradients on the normal equations of the
/// second kind. Sums run in order on one thread, so the bits do not depend on the machine.
pub(crate) fn close(mesh: &BaseMeshView<'_>, ties: &[Tie], gap: &[f64]) -> Amounts {
    let system = Ties::new(mesh, ties);
    let mut rest: Vec<f64> = gap.iter().zip(&system.scale).map(|(g, s)| -g * s).collect();
    let mut amounts = vec![0.0; system.n_moves];
    let mut along = rest.clone();
    let mut size_sq = squared(&rest);
    let enough = ROUNDING * ROUNDING * size_sq;
    for _ in 0..STEPS {
        let moves = system.transposed(&along);
        let curvature = squared(&moves);
        if !(size_sq > enough && curvature > 0.0) {
            break;
        }
        let step = size_sq / curvature;
        let image = system.times(&moves);
        amounts.iter_mut().zip(&moves).for_each(|(x, m)| *x += step * m);
        rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
        let next = squared(&rest);
        let turn = next / size_sq;
        along.iter_mut().zip(&rest).for_each(|(a, r)| *a = r + turn * *a);
        size_sq = next;
    }
    let nu = amounts.split_off(mesh.opposite.len());
    Amounts { spokes: amounts, nu }
}

fn squared(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// All ties as a sparse matrix with rows of length 1; the moves are those of all spokes, then those
/// of all `nu`.
struct Ties {
    rows: Vec<[(usize, f64); TIED]>,
    scale: Vec<f64>,
    n_moves: usize,
}

impl Ties {
    fn new(mesh: &BaseMeshView<'_>, ties: &[Tie]) -> Self {
        let n_halves = mesh.opposite.len();
        let (rows, scale) = ties
            .iter()
            .enumerate()
            .map(|(e, tie)| {
                let [lower, higher] = mesh.edge_half[e].map(|h| spokes(mesh, HalfEdge(h)));
                let [a, b, c] = lower.map(HalfEdge::row);
                let [d, f, g] = higher.map(HalfEdge::row);
                let x = tie.coefficients();
                let size = squared(&x).sqrt();
                let scale = if size > 0.0 { 1.0 / size } else { 0.0 };
                let moves = [a, b, c, d, f, g, n_halves + e];
                (std::array::from_fn(|i| (moves[i], scale * x[i])), scale)
            })
            .unzip();
        Self { rows, scale, n_moves: n_halves + ties.len() }
    }

    fn times(&self, moves: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| row.iter().map(|&(at, x)| x * moves[at]).sum()).collect()
    }

    fn transposed(&self, y: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.n_moves];
        for (row, y) in self.rows.iter().zip(y) {
            for &(at, x) in row {
                out[at] += x * y;
            }
        }
        out
    }
}

/// The spokes whose moves change `mu1` of `h`: the clockwise one, `h`, the counter-clockwise one.
fn spokes(mesh: &BaseMeshView<'_>, h: HalfEdge) -> [HalfEdge; 3] {
    [cw(mesh, h), h, ccw(mesh, h)]
}
