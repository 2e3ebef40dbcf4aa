//! Distance, normals and flips of patches against the field, on a sample grid.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::evaluate::Stencil;
use crate::grid::Grid;
use crate::lanes::{LANES, Lane, dot, normal, vector};
use crate::octet::{Curve, Octet, PatchPoints};
use crate::report::{Place, worse};
use crate::slope::{Slope, Slopes, Steepest};
use crate::surface::Surface;
use isospline_implicit::{BLOCK, Field, Jet1, Kernel, run_widest};

/// Steps a side of the sample grid: 153 points a patch.
pub(crate) const GRID: usize = 16;

/// What one patch shows; distances in model units, first order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceFigures {
    pub(crate) max: f64,
    /// Grid index of the largest distance.
    pub(crate) worst: u32,
    pub(crate) flipped: bool,
}

/// What patches one after another show together.
#[derive(Debug, Default)]
pub(crate) struct Distances {
    pub(crate) faces: Vec<FaceFigures>,
    sum: f64,
    sum_sq: f64,
    /// Largest angle between patch normal and gradient, its patch and grid index.
    steepest: (Slope, usize, usize),
    pub(crate) degenerate: u64,
    pub(crate) not_finite: u64,
}

/// Figures of all patches together.
#[derive(Debug)]
pub(crate) struct Distance {
    pub(crate) max: f64,
    pub(crate) rms: f64,
    pub(crate) mean: f64,
    pub(crate) normal_deg_max: f64,
    pub(crate) worst_normal: Option<Place>,
    pub(crate) flipped: u64,
}

impl Distances {
    /// Takes in the patches that follow.
    pub(crate) fn append(&mut self, other: Self) {
        let (slope, face, at) = other.steepest;
        if slope.is_steeper_than(&self.steepest.0) {
            self.steepest = (slope, face + self.faces.len(), at);
        }
        self.faces.extend(other.faces);
        self.sum += other.sum;
        self.sum_sq += other.sum_sq;
        self.degenerate += other.degenerate;
        self.not_finite += other.not_finite;
    }

    /// The figures of the whole surface, if these are all its patches.
    pub(crate) fn summary(&self, surface: &Surface<'_>, grid: &Grid) -> Distance {
        let n_samples = (self.faces.len() * grid.places().len()) as f64;
        let (slope, face, at) = self.steepest;
        let angle = slope.angle_deg();
        let worst_normal = || place(surface, face, &grid.stencil(at), angle);
        Distance {
            max: self.faces.iter().fold(0.0, |acc, f| worse(acc, f.max)),
            rms: (self.sum_sq / n_samples).sqrt(),
            mean: self.sum / n_samples,
            normal_deg_max: angle,
            worst_normal: (!self.faces.is_empty()).then(worst_normal),
            flipped: self.faces.iter().map(|f| u64::from(f.flipped)).sum(),
        }
    }
}

/// A face whose patch will not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnfitFace {
    /// The face.
    pub face: u32,
    /// Whether its patch faces inward at a sample; if not it is too far from the surface.
    pub folds: bool,
}

/// The place of `stencil` on face `f`.
pub(crate) fn place(surface: &Surface<'_>, f: usize, stencil: &Stencil, value: f64) -> Place {
    let point = stencil.point(&surface.net(f)).into();
    Place { face: f as u32, barycentric: stencil.at, point, value }
}

/// Distance to first order, `|f| / |grad f|`; not-a-number where the gradient vanishes.
#[inline(always)]
pub(crate) fn first_order(jet: &Jet1) -> f64 {
    over_slope(jet.value, jet.gradient.into())
}

#[inline(always)]
fn over_slope(value: f64, gradient: [f64; 3]) -> f64 {
    let slope = dot(gradient, gradient).sqrt();
    // An exact zero: with f = 0 the quotient is not a number anyway, with f > 0 it would be
    // infinite; both mean that nothing is known here.
    if slope > 0.0 { value.abs() / slope } else { f64::NAN }
}

/// Samples patches; what it has found so far.
pub(crate) struct Sampler<'a> {
    field: &'a dyn Field,
    grid: &'a Grid,
    batch: Batch,
    pub(crate) found: Distances,
}

impl<'a> Sampler<'a> {
    pub(crate) fn new(field: &'a dyn Field, grid: &'a Grid) -> Self {
        Self { field, grid, batch: Batch::new(), found: Distances::default() }
    }

    /// Samples the next patches, the first `n` of an octet.
    pub(crate) fn enter(&mut self, octet: &Octet, n: usize) {
        let Self { field, grid, batch, found } = self;
        let tally = run_widest(Sample { field: *field, grid, octet, batch });
        for k in 0..n {
            let slope = tally.steepest.of(k);
            if slope.is_steeper_than(&found.steepest.0) {
                found.steepest = (slope, found.faces.len(), tally.steepest.at(k));
            }
            found.sum += tally.sum[k];
            found.sum_sq += tally.sum_sq[k];
            found.degenerate += tally.degenerate[k] as u64;
            found.not_finite += tally.not_finite[k] as u64;
            found.faces.push(FaceFigures {
                max: tally.max[k],
                worst: tally.worst[k] as u32,
                flipped: tally.least_cosine[k] < 0.0,
            });
        }
    }
}

/// Points of a grid whose samples on eight patches fill a block of the field.
const POINTS: usize = BLOCK / LANES;

/// Some grid points on eight patches, the patches of a point beside each other.
#[repr(C, align(64))]
struct Batch {
    curve: Curve,
    point: [[f64; BLOCK]; 3],
    along: [[f64; BLOCK]; 3],
    across: [[f64; BLOCK]; 3],
    jets: [[f64; BLOCK]; 4],
    distance: [f64; BLOCK],
    slopes: Slopes<BLOCK>,
    /// Ones where there is no normal.
    degenerate: [f64; BLOCK],
    /// Grid points before these, and of these.
    first: usize,
    n: usize,
}

impl Batch {
    fn new() -> Self {
        let (zero, zeros) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
        Self {
            curve: Curve::new(),
            point: zeros,
            along: zeros,
            across: zeros,
            jets: [zero; 4],
            distance: zero,
            slopes: Slopes::new(),
            degenerate: zero,
            first: 0,
            n: 0,
        }
    }

    #[inline(always)]
    fn push(&mut self, origin: &[Lane; 3], points: &PatchPoints) {
        let at = LANES * self.n;
        for c in 0..3 {
            for k in 0..LANES {
                self.point[c][at + k] = origin[c][k] + points.offset[c][k];
            }
            self.along[c][at..at + LANES].copy_from_slice(&points.along[c]);
            self.across[c][at..at + LANES].copy_from_slice(&points.across[c]);
        }
        self.n += 1;
    }

    /// Distances and angles at all places; those beyond `n` hold any numbers.
    #[inline(always)]
    fn compare(&mut self) {
        let [value, gradient @ ..] = &self.jets;
        for i in 0..BLOCK {
            let gradient = vector(gradient, i);
            self.distance[i] = over_slope(value[i], gradient);
            let (normal, exists) = normal(vector(&self.along, i), vector(&self.across, i));
            self.degenerate[i] = if exists { 0.0 } else { 1.0 };
            self.slopes.set(i, Slope::between(normal, gradient));
        }
    }
}

/// What eight patches show, each in its lane; counts are exact in floats.
struct Tally {
    max: Lane,
    worst: Lane,
    sum: Lane,
    sum_sq: Lane,
    steepest: Steepest,
    least_cosine: Lane,
    degenerate: Lane,
    not_finite: Lane,
}

struct Sample<'a> {
    field: &'a dyn Field,
    grid: &'a Grid,
    octet: &'a Octet,
    batch: &'a mut Batch,
}

impl Kernel for Sample<'_> {
    type Output = Tally;

    #[inline(always)]
    fn run(self) -> Tally {
        let Self { field, grid, octet, batch } = self;
        let mut tally = Tally::new();
        let n_points = grid.places().len();
        (batch.first, batch.n) = (0, 0);
        for row in grid.rows() {
            batch.curve.set(octet, row);
            for point in &row.points {
                batch.push(&octet.origin, &batch.curve.at(point));
                if batch.n == POINTS || batch.first + batch.n == n_points {
                    field.gradient_block(LANES * batch.n, &batch.point, &mut batch.jets);
                    batch.compare();
                    tally.enter(batch);
                    batch.first += batch.n;
                    batch.n = 0;
                }
            }
        }
        tally
    }
}

impl Tally {
    fn new() -> Self {
        let zero = [0.0; LANES];
        Self {
            max: zero,
            worst: zero,
            sum: zero,
            sum_sq: zero,
            steepest: Steepest::NONE,
            least_cosine: zero,
            degenerate: zero,
            not_finite: zero,
        }
    }

    /// Takes in a batch.
    #[inline(always)]
    fn enter(&mut self, batch: &Batch) {
        for point in 0..batch.n {
            let (at, first) = (batch.first + point, LANES * point);
            self.enter_distances(at, &batch.distance, first);
            self.steepest.enter(at, &batch.slopes, first);
            for k in 0..LANES {
                let cosine = batch.slopes.cosine[first + k];
                let least = self.least_cosine[k];
                self.least_cosine[k] = if cosine < least { cosine } else { least };
                self.degenerate[k] += batch.degenerate[first + k];
            }
        }
    }

    #[inline(always)]
    fn enter_distances(&mut self, at: usize, distance: &[f64; BLOCK], first: usize) {
        for k in 0..LANES {
            let (x, max) = (distance[first + k], self.max[k]);
            let is_worse = !(max.is_nan() || x <= max);
            self.max[k] = if is_worse { x } else { max };
            self.worst[k] = if is_worse { at as f64 } else { self.worst[k] };
            self.sum[k] += x;
            self.sum_sq[k] += x * x;
            self.not_finite[k] += if x.is_finite() { 0.0 } else { 1.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::box_spline::{Knots, torus};
    use crate::surface::Net;
    use isospline_geometry::Vec3;

    #[test]
    fn samples_side_by_side_show_what_single_points_show() {
        // 30 patches: the last ones do not fill an octet.
        let (surface, field, grid) = (Knots::surface(5, 3), torus(), Grid::new(GRID));
        let (mut octet, mut sampler) = (Octet::new(), Sampler::new(&field, &grid));
        let nets: Vec<Net> = (0..30).map(|f| surface.net(f)).collect();
        for nets in nets.chunks(LANES) {
            octet.set(nets);
            sampler.enter(&octet, nets.len());
        }
        let found = sampler.found.faces;
        assert_eq!(found.len(), surface.faces().len());
        for (f, found) in found.iter().enumerate() {
            let net = surface.net(f);
            let distance = |i: usize| first_order(&field.gradient(grid.stencil(i).point(&net)));
            let max = (0..grid.places().len()).map(distance).fold(0.0, f64::max);
            assert!(max > 0.1 && (found.max - max).abs() < 1e-14, "{} {max}", found.max);
            assert!((distance(found.worst as usize) - max).abs() < 1e-14);
            assert!(!found.flipped);
        }
    }

    #[test]
    fn a_vanishing_gradient_leaves_the_distance_unknown() {
        for value in [0.0, 1.0, f64::NAN] {
            assert!(first_order(&Jet1 { value, gradient: Vec3::zeros() }).is_nan());
        }
    }
}
