//! Distance, normals and flips of patches against the field, on a sample grid.

use crate::evaluate::{PreparedPatch, Stencil, StencilTable};
use crate::lent_threads::{ForEach, map};
use crate::report::{Place, worse};
use crate::surface::{Net, Surface};
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Jet1};

/// Steps a side of the sample grid: 153 points a patch.
pub(crate) const GRID: usize = 16;

/// What one patch shows; distances in model units, first order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FaceFigures {
    pub(crate) max: f64,
    /// Grid index of the largest distance.
    pub(crate) worst: usize,
    sum: f64,
    sum_sq: f64,
    /// Largest angle between patch normal and gradient.
    steepest: Slope,
    /// Grid index of `steepest`.
    steepest_at: usize,
    flipped: bool,
    degenerate: u64,
    not_finite: u64,
}

/// Figures of all patches together.
#[derive(Debug)]
pub(crate) struct Distance {
    pub(crate) faces: Vec<FaceFigures>,
    pub(crate) max: f64,
    pub(crate) rms: f64,
    pub(crate) mean: f64,
    pub(crate) normal_deg_max: f64,
    pub(crate) worst_normal: Option<Place>,
    pub(crate) flipped: u64,
    pub(crate) degenerate: u64,
    pub(crate) not_finite: u64,
}

pub(crate) fn measure(surface: &Surface<'_>, field: &dyn Field, for_each: ForEach<'_>) -> Distance {
    let grid = StencilTable::grid(GRID);
    let faces = map(for_each, surface.faces().len(), |range| {
        let mut sampler = Sampler::new(field, &grid);
        range.map(|f| sampler.measure(&surface.net(f))).collect()
    });
    let n_samples = (faces.len() * grid.stencils().len()) as f64;
    let mut out = Distance {
        max: faces.iter().fold(0.0, |acc, f| worse(acc, f.max)),
        rms: (faces.iter().map(|f| f.sum_sq).sum::<f64>() / n_samples).sqrt(),
        mean: faces.iter().map(|f| f.sum).sum::<f64>() / n_samples,
        normal_deg_max: 0.0,
        worst_normal: None,
        flipped: faces.iter().map(|f| u64::from(f.flipped)).sum(),
        degenerate: faces.iter().map(|f| f.degenerate).sum(),
        not_finite: faces.iter().map(|f| f.not_finite).sum(),
        faces,
    };
    for (f, figures) in out.faces.iter().enumerate() {
        let angle = figures.steepest.angle_deg();
        if out.worst_normal.is_none() || angle > out.normal_deg_max {
            out.worst_normal =
                Some(place(surface, f, &grid.stencils()[figures.steepest_at], angle));
        }
        out.normal_deg_max = worse(out.normal_deg_max, angle);
    }
    out
}

/// A face whose patch will not do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnfitFace {
    /// The face.
    pub face: u32,
    /// Whether its patch faces inward at a sample; if not it is too far from the surface.
    pub folds: bool,
}

/// The faces whose patch faces inward at a sample, or is farther from the surface than `limit`,
/// in model units.
pub fn unfit_faces(
    surface: &Surface<'_>,
    field: &dyn Field,
    limit: f64,
    for_each: ForEach<'_>,
) -> Vec<UnfitFace> {
    let faces = measure(surface, field, for_each).faces;
    let is_unfit = |figures: &FaceFigures| figures.flipped || figures.max > limit;
    let unfit = (0..).zip(faces).filter(|(_, figures)| is_unfit(figures));
    unfit.map(|(face, figures)| UnfitFace { face, folds: figures.flipped }).collect()
}

/// The place of `stencil` on face `f`.
pub(crate) fn place(surface: &Surface<'_>, f: usize, stencil: &Stencil, value: f64) -> Place {
    let point = PreparedPatch::new(&surface.net(f)).evaluate(stencil).point.into();
    Place { face: f as u32, barycentric: stencil.at, point, value }
}

/// Distance to first order, `|f| / |grad f|`; not-a-number where the gradient vanishes.
pub(crate) fn first_order(jet: &Jet1) -> f64 {
    let slope = jet.gradient.norm();
    // An exact zero: with f = 0 the quotient is not a number anyway, with f > 0 it would be
    // infinite; both mean that nothing is known here.
    if slope > 0.0 { jet.value.abs() / slope } else { f64::NAN }
}

/// Scratch of one thread: a patch's points, normals and field values.
struct Sampler<'a> {
    field: &'a dyn Field,
    grid: &'a StencilTable,
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    jets: Vec<Jet1>,
}

impl<'a> Sampler<'a> {
    fn new(field: &'a dyn Field, grid: &'a StencilTable) -> Self {
        let jet = Jet1 { value: 0.0, gradient: Vec3::zeros() };
        let n = grid.stencils().len();
        let (points, jets) = (vec![Vec3::zeros(); n], vec![jet; n]);
        Self { field, grid, normals: points.clone(), points, jets }
    }

    fn measure(&mut self, net: &Net) -> FaceFigures {
        let patch = PreparedPatch::new(net);
        let mut out = FaceFigures::default();
        let (points, normals) = (&mut self.points, &mut self.normals);
        patch.evaluate_all(self.grid, |i, at| {
            points[i] = at.point;
            normals[i] = at.normal;
            out.degenerate += u64::from(at.is_degenerate());
        });
        self.field.gradients(points, &mut self.jets);
        for (i, (normal, jet)) in normals.iter().zip(&self.jets).enumerate() {
            out.enter(i, normal, jet);
        }
        out
    }
}

impl FaceFigures {
    fn enter(&mut self, i: usize, normal: &Vec3, jet: &Jet1) {
        let distance = first_order(jet);
        self.not_finite += u64::from(!distance.is_finite());
        if distance > self.max || distance.is_nan() {
            self.worst = i;
        }
        self.max = worse(self.max, distance);
        self.sum += distance;
        self.sum_sq += distance * distance;
        let slope = Slope::between(normal, &jet.gradient);
        self.flipped |= slope.cosine < 0.0;
        if slope.is_steeper_than(&self.steepest) {
            self.steepest = slope;
            self.steepest_at = i;
        }
    }
}

/// An angle kept as (sine, cosine) times a common length: one arc tangent a patch is enough.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    sine_sq: f64,
    cosine: f64,
    /// Grows with the angle, from 0 at 0 to 2 at half a turn; not-a-number for zero vectors.
    rank: f64,
}

impl Slope {
    #[inline]
    fn between(a: &Vec3, b: &Vec3) -> Self {
        let (sine_sq, cosine) = (a.cross(b).norm_squared(), a.dot(b));
        let part = sine_sq / (sine_sq + cosine * cosine);
        Self { sine_sq, cosine, rank: if cosine < 0.0 { 2.0 - part } else { part } }
    }

    #[inline]
    fn is_steeper_than(&self, other: &Self) -> bool {
        self.rank > other.rank || (self.rank.is_nan() && !other.rank.is_nan())
    }

    fn angle_deg(&self) -> f64 {
        if self.rank.is_nan() {
            return f64::NAN;
        }
        libm::atan2(self.sine_sq.sqrt(), self.cosine).to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_rank_as_their_angles_do() {
        let turned = |a: f64| Vec3::new(libm::sin(a), 0.0, libm::cos(a));
        let angles = [1e-9, 1e-4, 0.5, 1.5, 1.6, 3.0, 3.1];
        let slopes = angles.map(|a| Slope::between(&Vec3::z(), &(7.0 * turned(a))));
        for pair in slopes.windows(2) {
            assert!(pair[1].is_steeper_than(&pair[0]) && !pair[0].is_steeper_than(&pair[1]));
        }
        for (slope, angle) in slopes.iter().zip(angles) {
            assert!((slope.angle_deg() - angle.to_degrees()).abs() < 1e-12);
        }
        let none = Slope::between(&Vec3::zeros(), &Vec3::z());
        assert!(none.is_steeper_than(&slopes[6]) && none.angle_deg().is_nan());
    }

    #[test]
    fn a_vanishing_gradient_leaves_the_distance_unknown() {
        for value in [0.0, 1.0, f64::NAN] {
            assert!(first_order(&Jet1 { value, gradient: Vec3::zeros() }).is_nan());
        }
    }
}
