//! Normal equations of one face in the moves of the exact space.
//
// symbols: M, g normal matrix and gradient over the 45 coordinates, S the Schur complement of
// the innermost points, Z the map from moves to coordinates

use crate::face_moves::{FaceMoves, INNER, OUTER, REACHING, elimination_order};
use crate::samples::{Interior, LANES, Samples};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::N_INTERIOR;
use isospline_geometry::linear::{cholesky, cholesky_solve};

const ALL: usize = OUTER + INNER;

/// What draws the samples of a face aside, to places where it has no folds.
#[derive(Clone, Debug)]
pub(crate) struct Pull {
    /// Against the squared normal distance, 0 to 1.
    pub(crate) weight: f64,
    /// From each place to its sample, in the tangent plane.
    pub(crate) aside: Vec<Vec3>,
}

/// The equations of a face with its innermost points eliminated.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    /// `Z^T S Z`.
    pub(crate) matrix: [[f64; REACHING]; REACHING],
    /// `Z^T g`, reduced likewise.
    pub(crate) gradient: [f64; REACHING],
    /// Row of each innermost coordinate: minus its answer to the outer ones, and its own step.
    inner: [[f64; OUTER + 1]; INNER],
}

impl Element {
    /// Half the mean squared distance, linearised in the control points, plus half of `damping`
    /// times their squared shifts.
    ///
    /// `distance` and unit `normal` of the field at the samples; `pull`, if given, adds half the
    /// mean squared distance in the tangent planes from other places. `None` if the equations are not
    /// positive definite, which only numbers that are not finite bring about.
    pub(crate) fn new(
        samples: &Samples,
        face: &FaceMoves,
        distance: &[f64],
        normal: &[Vec3],
        pull: Option<&Pull>,
        damping: f64,
    ) -> Option<Self> {
        let weight = pull.map_or(0.0, |pull| pull.weight);
        let m = normal_matrix(samples, normal, weight, damping);
        let g = gradient(samples, distance, normal, pull);
        let (schur, reduced, inner) = condense(&m, &g)?;
        let matrix = face.times(&face.transposed_times(&schur));
        let gradient = face.transposed_times(&reduced.map(|x| [x])).map(|[x]| x);
        Some(Self { matrix, gradient, inner })
    }

    /// Shifts of the 15 points, in storage order, when the outer ones shift by `outer`.
    pub(crate) fn shifts(&self, outer: &[f64; OUTER]) -> Interior {
        let mut flat = [0.0; ALL];
        flat[..OUTER].copy_from_slice(outer);
        for (x, row) in flat[OUTER..].iter_mut().zip(&self.inner) {
            *x = -row[..OUTER].iter().zip(outer).fold(row[OUTER], |acc, (a, b)| acc + a * b);
        }
        let mut out = [Vec3::zeros(); N_INTERIOR];
        for (k, slot) in elimination_order().into_iter().enumerate() {
            out[slot] = Vec3::new(flat[3 * k], flat[3 * k + 1], flat[3 * k + 2]);
        }
        out
    }
}

/// Place of each interior point in the order of elimination.
fn places() -> [usize; N_INTERIOR] {
    let mut out = [0; N_INTERIOR];
    for (k, slot) in elimination_order().into_iter().enumerate() {
        out[slot] = k;
    }
    out
}

/// `M = damping + mean over samples of b b^T (x) (N N^T + weight (I - N N^T))`.
fn normal_matrix(
    samples: &Samples,
    normal: &[Vec3],
    weight: f64,
    damping: f64,
) -> [[f64; ALL]; ALL] {
    let square = |n: &Vec3| {
        let m = (1.0 - weight) * n;
        let [xx, yy, zz] = [0, 1, 2].map(|k| m[k] * n[k] + weight);
        [xx, m.x * n.y, m.x * n.z, yy, m.y * n.z, zz]
    };
    let squares: Vec<[f64; 6]> = normal.iter().map(square).collect();
    let places = places();
    let mut m = [[0.0; ALL]; ALL];
    let mut all = (0..N_INTERIOR).flat_map(|i| (0..=i).map(move |j| (i, j)));
    for weights in &samples.pairs {
        for [xx, xy, xz, yy, yz, zz] in weighted_sums(weights, &squares) {
            let (i, j) = all.next().expect("invariant: sums of as many pairs");
            let (i, j) = (3 * places[i], 3 * places[j]);
            let block = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
            for (r, row) in block.iter().enumerate() {
                for (c, &x) in row.iter().enumerate() {
                    m[i + r][j + c] = x;
                    m[j + c][i + r] = x;
                }
            }
        }
    }
    for (i, row) in m.iter_mut().enumerate() {
        row[i] += damping;
    }
    m
}

/// Sums over the samples of a few weights each times six numbers: half of all the work, so the
/// sums stay in registers.
fn weighted_sums(weights: &[[f64; LANES]], numbers: &[[f64; 6]]) -> [[f64; 6]; LANES] {
    let mut sums = [[0.0; 6]; LANES];
    for (w, x) in weights.iter().zip(numbers) {
        for lane in 0..LANES {
            for k in 0..6 {
                sums[lane][k] += w[lane] * x[k];
            }
        }
    }
    sums
}

fn gradient(
    samples: &Samples,
    distance: &[f64],
    normal: &[Vec3],
    pull: Option<&Pull>,
) -> [f64; ALL] {
    let places = places();
    let scale = 1.0 / distance.len() as f64;
    let mut g = [0.0; ALL];
    for (s, row) in samples.inner.iter().enumerate() {
        let aside = pull.map_or(Vec3::zeros(), |pull| pull.weight * pull.aside[s]);
        let force = scale * (distance[s] * normal[s] + aside);
        for (place, w) in places.iter().zip(row) {
            for x in 0..3 {
                g[3 * place + x] += w * force[x];
            }
        }
    }
    g
}

type Condensed = ([[f64; OUTER]; OUTER], [f64; OUTER], [[f64; OUTER + 1]; INNER]);

/// Eliminates the innermost points.
fn condense(m: &[[f64; ALL]; ALL], g: &[f64; ALL]) -> Option<Condensed> {
    let mut corner = [[0.0; INNER]; INNER];
    let mut inner = [[0.0; OUTER + 1]; INNER];
    for i in 0..INNER {
        corner[i].copy_from_slice(&m[OUTER + i][OUTER..]);
        inner[i][..OUTER].copy_from_slice(&m[OUTER + i][..OUTER]);
        inner[i][OUTER] = g[OUTER + i];
    }
    cholesky_solve(&cholesky(&corner).ok()?, &mut inner);
    let mut schur = [[0.0; OUTER]; OUTER];
    let mut reduced = [0.0; OUTER];
    for i in 0..OUTER {
        schur[i].copy_from_slice(&m[i][..OUTER]);
        reduced[i] = g[i];
        for (k, row) in inner.iter().enumerate() {
            let w = m[i][OUTER + k];
            reduced[i] -= w * row[OUTER];
            for (s, x) in schur[i].iter_mut().zip(row) {
                *s -= w * x;
            }
        }
    }
    Some((schur, reduced, inner))
}
