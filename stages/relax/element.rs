//! Normal equations of one face in the moves of the exact space.
//
// symbols: M, g normal matrix and gradient over the 45 coordinates, S the Schur complement of
// the innermost points, Z the map from moves to coordinates

#![expect(clippy::inline_always, reason = "kernels are compiled for several processors")]

use crate::face_moves::{
    FaceMoves, INNER, OUTER, REACHING, Row, WIDTH, add, elimination_order, lanes,
};
use crate::functionals::LANES;
use crate::samples::{Interior, Samples};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::N_INTERIOR;
use isospline_geometry::linear::{cholesky, cholesky_solve};
use isospline_implicit::{Kernel, run_widest};

const ALL: usize = OUTER + INNER;
/// As many coordinates, filled up to whole vectors.
const FILLED: usize = ALL.next_multiple_of(LANES);
/// Rows that are summed at once.
const TOGETHER: usize = 5;

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
    /// `Z^T S Z`, then a column of `Z^T g`, reduced likewise.
    pub(crate) matrix: [Row; REACHING],
    /// Row of each innermost coordinate: minus its answer to the outer ones, then minus its own step.
    inner: [Row; INNER],
}

/// Half the mean cost at the samples of a face, linearised in the control points, plus half of
/// `damping` times their squared shifts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equations<'a> {
    pub(crate) samples: &'a Samples,
    pub(crate) moves: &'a FaceMoves,
    /// Derivative of half the cost by the distance at each sample: the distance, where nothing
    /// else has a weight.
    pub(crate) force: &'a [f64],
    /// Unit normal of the field there.
    pub(crate) normal: &'a [Vec3],
    /// Adds half the mean squared distance in the tangent planes from other places.
    pub(crate) pull: Option<&'a Pull>,
    pub(crate) damping: f64,
}

struct Setting<'a> {
    element: &'a mut Element,
    equations: Equations<'a>,
}

impl Kernel for Setting<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let Self { element, equations } = self;
        let (m, g) = (equations.matrix(), equations.gradient());
        let mut schur = [[0.0; WIDTH]; OUTER];
        if !condense(&m, &g, &mut schur, &mut element.inner) {
            return false;
        }
        let mut half = [[0.0; WIDTH]; REACHING];
        equations.moves.transposed_times(&schur, &mut half);
        // The Schur complement is symmetric.
        let columns = std::array::from_fn(|i| {
            let mut column = [0.0; WIDTH];
            column.iter_mut().zip(&half).for_each(|(x, row)| *x = row[i]);
            column
        });
        equations.moves.transposed_times(&columns, &mut element.matrix);
        for (row, half) in element.matrix.iter_mut().zip(&half) {
            row[REACHING] = half[OUTER];
        }
        true
    }
}

impl Element {
    /// No equations yet.
    pub(crate) fn zero() -> Self {
        Self { matrix: [[0.0; WIDTH]; REACHING], inner: [[0.0; WIDTH]; INNER] }
    }

    /// Becomes the element of these equations; false if they are not positive definite, which only
    /// numbers that are not finite bring about.
    pub(crate) fn set(&mut self, equations: Equations<'_>) -> bool {
        run_widest(Setting { element: self, equations })
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

impl Equations<'_> {
    /// `M = damping + mean over samples of b b^T (x) (N N^T + weight (I - N N^T))`, `weight` that of
    /// the pull.
    #[inline(always)]
    fn matrix(&self) -> [[f64; ALL]; ALL] {
        let weight = self.pull.map_or(0.0, |pull| pull.weight);
        let square = |n: &Vec3| {
            let m = (1.0 - weight) * n;
            let [xx, yy, zz] = [0, 1, 2].map(|k| m[k] * n[k] + weight);
            [xx, m.x * n.y, m.x * n.z, yy, m.y * n.z, zz]
        };
        let squares: Vec<[f64; 6]> = self.normal.iter().map(square).collect();
        let mut m = [[0.0; ALL]; ALL];
        put_pairs(&mut m, self.samples, &squares);
        self.add_differences(&mut m);
        for (i, row) in m.iter_mut().enumerate() {
            row[i] += self.damping;
        }
        m
    }

    /// Adds the mean square of the changes of the distance's differences. Each sample has its own
    /// normal: with one for all three, shifts along the surface would seem to make it rough.
    #[inline(always)]
    fn add_differences(&self, m: &mut [[f64; ALL]; ALL]) {
        let changes = self.changes_of_differences();
        for first in (0..ALL).step_by(LANES) {
            for top in (first / TOGETHER * TOGETHER..ALL).step_by(TOGETHER) {
                let sums = products(&changes, top, first);
                for (i, row) in (top..).zip(&sums) {
                    for (j, x) in (first..=i).zip(row) {
                        m[i][j] += x;
                        m[j][i] = m[i][j];
                    }
                }
            }
        }
    }

    /// Change of each difference with the coordinates, times the root of its weight.
    #[inline(always)]
    fn changes_of_differences(&self) -> Vec<[f64; FILLED]> {
        let places = places();
        let Samples { inner, roughness, .. } = self.samples;
        let scale = (roughness.weight() / inner.len() as f64).sqrt();
        let change = |difference: [(usize, f64); 3]| {
            let mut change = [0.0; FILLED];
            for (s, factor) in difference.into_iter().filter(|(s, _)| *s < inner.len()) {
                let normal = scale * factor * self.normal[s];
                for (place, w) in places.iter().zip(&inner[s]) {
                    (0..3).for_each(|x| change[3 * place + x] += w * normal[x]);
                }
            }
            change
        };
        roughness.differences().map(change).collect()
    }

    #[inline(always)]
    fn gradient(&self) -> [f64; ALL] {
        let places = places();
        let scale = 1.0 / self.force.len() as f64;
        let mut g = [0.0; ALL];
        for (s, row) in self.samples.inner.iter().enumerate() {
            let aside = self.pull.map_or(Vec3::zeros(), |pull| pull.weight * pull.aside[s]);
            let force = scale * (self.force[s] * self.normal[s] + aside);
            for (place, w) in places.iter().zip(row) {
                for x in 0..3 {
                    g[3 * place + x] += w * force[x];
                }
            }
        }
        g
    }
}

/// Puts into both triangles the sums over the samples of the weights of a pair of points times
/// `[xx, xy, xz, yy, yz, zz]`.
#[inline(always)]
fn put_pairs(m: &mut [[f64; ALL]; ALL], samples: &Samples, squares: &[[f64; 6]]) {
    let places = places();
    for (weights, pairs) in samples.products.iter().zip(samples.pairs.chunks_exact(LANES)) {
        let sums = weighted_sums(weights, squares);
        for (lane, pair) in pairs.iter().enumerate() {
            let [xx, xy, xz, yy, yz, zz] = sums.map(|sum| sum[lane]);
            let [i, j] = pair.map(|slot| 3 * places[slot]);
            let block = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
            for (r, row) in block.iter().enumerate() {
                for (c, &x) in row.iter().enumerate() {
                    m[i + r][j + c] = x;
                    m[j + c][i + r] = x;
                }
            }
        }
    }
}

/// Sums over `rows` of the products of [`TOGETHER`] columns from `top` on with [`LANES`] from `first`
/// on.
#[inline(always)]
fn products(rows: &[[f64; FILLED]], top: usize, first: usize) -> [[f64; LANES]; TOGETHER] {
    let mut sums = [[0.0; LANES]; TOGETHER];
    for row in rows {
        for r in 0..TOGETHER {
            for lane in 0..LANES {
                sums[r][lane] += row[top + r] * row[first + lane];
            }
        }
    }
    sums
}

/// Sums over the samples of a few weights each times six numbers: half of all the work, so the
/// sums stay in registers.
#[inline(always)]
fn weighted_sums(weights: &[[f64; LANES]], numbers: &[[f64; 6]]) -> [[f64; LANES]; 6] {
    let mut sums = [[0.0; LANES]; 6];
    for (w, x) in weights.iter().zip(numbers) {
        for k in 0..6 {
            for lane in 0..LANES {
                sums[k][lane] += w[lane] * x[k];
            }
        }
    }
    sums
}

/// Eliminates the innermost points: the Schur complement with the reduced gradient beside it, and
/// what `inner` keeps. False if the equations of these points are not positive definite.
#[inline(always)]
fn condense(
    m: &[[f64; ALL]; ALL],
    g: &[f64; ALL],
    schur: &mut [Row; OUTER],
    inner: &mut [Row; INNER],
) -> bool {
    for i in 0..OUTER {
        schur[i][..OUTER].copy_from_slice(&m[i][..OUTER]);
        schur[i][OUTER] = g[i];
    }
    let mut corner = [[0.0; INNER]; INNER];
    for i in 0..INNER {
        corner[i].copy_from_slice(&m[OUTER + i][OUTER..]);
        inner[i][..OUTER].copy_from_slice(&m[OUTER + i][..OUTER]);
        inner[i][OUTER] = g[OUTER + i];
    }
    let Ok(factor) = cholesky(&corner) else { return false };
    for first in (0..WIDTH).step_by(LANES) {
        let mut columns = inner.each_ref().map(|row| lanes(row, first));
        cholesky_solve(&factor, &mut columns);
        for (row, column) in inner.iter_mut().zip(&columns) {
            row[first..first + LANES].copy_from_slice(column);
        }
        for (m, schur) in m.iter().zip(schur.iter_mut()) {
            let weights: [f64; INNER] = std::array::from_fn(|k| -m[OUTER + k]);
            add(schur, first, &weights, &columns);
        }
    }
    true
}
