//! When a base mesh is fit to be fitted: turning, slope and tilt of every face.

use crate::AdaptParams;
use crate::vertex::Vertex;
use isospline_geometry::Vec3;
use std::cmp::Ordering;

/// Cosine below which a face counts as folded against the normal of a corner. Positive means that
/// all sector angles, seen along the normal, lie in (0, 180) degrees; the rest is margin.
const COS_FOLD: f64 = 0.02;

/// Badness of a folded face; edges reach 4.
const FOLDED: f64 = 10.0;

/// The thresholds. Every figure is scaled so that 1 is the limit and larger is worse.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gate {
    cos_turning: f64,
    max_slope: f64,
    min_quality: f64,
    /// The square of `min_quality`, over 12.
    min_quality_sq_12th: f64,
}

/// Margins of compared products above rounding: of most, and of squared cosines near [`COS_FOLD`],
/// which have lost two digits.
const MARGINS: [f64; 2] = [1e-12, 1e-9];

/// What products tell of a face and a limit.
#[derive(Clone, Copy, Debug)]
struct Glance {
    /// A figure is above by more than rounding.
    above: bool,
    /// All figures are below by more than rounding.
    below: bool,
}

impl Gate {
    pub(crate) fn new(params: &AdaptParams) -> Self {
        Self {
            cos_turning: libm::cos(params.max_turning_deg.to_radians()),
            max_slope: params.max_slope,
            min_quality: params.min_quality,
            min_quality_sq_12th: params.min_quality * params.min_quality / 12.0,
        }
    }

    /// Worst of turning and slope of the edge between two vertices.
    pub(crate) fn edge(&self, p: &Vertex, q: &Vertex) -> f64 {
        let chord = q.position - p.position;
        self.edge_along(&chord, chord.norm_squared(), [p, q])
    }

    /// Worst of the edges of a face and of its fold; at most 1 if the face is fit.
    pub(crate) fn face(&self, corners: &[&Vertex; 3]) -> f64 {
        self.face_of(corners, &Sides::of(corners))
    }

    /// [`Self::face`], raised towards 1, never beyond, for slivers: quality alone does not make a
    /// face unfit, but of two fit meshes the one without slivers is better.
    pub(crate) fn face_with_quality(&self, corners: &[&Vertex; 3]) -> f64 {
        self.with_quality(corners, &Sides::of(corners))
    }

    /// Whether [`Self::face_with_quality`] is not `limit` or more. Most faces are far on one side,
    /// which products tell without a root or a division.
    pub(crate) fn is_below(&self, corners: &[&Vertex; 3], limit: f64) -> bool {
        let sides = Sides::of(corners);
        let glance = self.glance(corners, &sides, limit);
        glance.below
            || !(glance.above || {
                let cost = self.with_quality(corners, &sides);
                matches!(cost.partial_cmp(&limit), Some(Ordering::Greater | Ordering::Equal))
            })
    }

    /// Whether [`Self::face_with_quality`] is less than `limit` so clearly that products tell.
    pub(crate) fn is_clearly_below(&self, corners: &[&Vertex; 3], limit: f64) -> bool {
        self.glance(corners, &Sides::of(corners), limit).below
    }

    /// Compares squares and products with margins far above rounding.
    #[inline]
    fn glance(&self, corners: &[&Vertex; 3], sides: &Sides, limit: f64) -> Glance {
        let area_sq = sides.area.norm_squared();
        // Smaller products may lose digits, and no fold is above larger limits.
        if !(area_sq > 1e-200 && (1e-3..9.0).contains(&limit)) {
            return Glance { above: false, below: false };
        }
        let slope_sq = (limit * self.max_slope) * (limit * self.max_slope);
        let (mut turning, mut tilt) = (f64::NEG_INFINITY, f64::INFINITY);
        // Largest rise beyond the limit, a little more and a little less than that.
        let (mut over, mut short) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut is_number = true;
        for k in 0..3 {
            let (p, q) = (corners[k], corners[(k + 1) % 3]);
            let chord = &sides.chords[k];
            let rise = larger(chord.dot(&p.normal).abs(), chord.dot(&q.normal).abs());
            let (rise_sq, least_sq) = (rise * rise, slope_sq * sides.lengths_sq[k]);
            over = larger(over, rise_sq - (1.0 + MARGINS[0]) * least_sq);
            short = larger(short, rise_sq - (1.0 - MARGINS[0]) * least_sq);
            let turn = 1.0 - p.normal.dot(&q.normal);
            turning = larger(turning, turn);
            let along = p.normal.dot(&sides.area);
            tilt = -larger(-tilt, -along);
            is_number &= rise_sq + least_sq + turn + along < f64::INFINITY;
        }
        let most_turning = limit * (1.0 - self.cos_turning);
        let (tilt_sq, fold_sq) = (tilt * tilt, COS_FOLD * COS_FOLD * area_sq);
        let (thin_sq, is_low) = (self.min_quality_sq_12th * sides.sum_sq(), limit <= 0.9);
        // A sliver raises the figure to 0.9 at least and 0.99 at most.
        let above = over > 0.0
            || turning > (1.0 + MARGINS[0]) * most_turning
            || tilt < 0.0
            || tilt_sq < (1.0 - MARGINS[1]) * fold_sq
            || (is_low && thin_sq > (1.0 + MARGINS[0]) * area_sq);
        let below = short < 0.0
            && turning < (1.0 - MARGINS[0]) * most_turning
            && tilt > 0.0
            && tilt_sq > (1.0 + MARGINS[1]) * fold_sq
            && thin_sq < (1.0 - MARGINS[0]) * area_sq;
        Glance { above: is_number && above, below: is_number && below }
    }

    fn with_quality(&self, corners: &[&Vertex; 3], sides: &Sides) -> f64 {
        let sliver = 0.9 * self.min_quality / sides.quality();
        self.face_of(corners, sides).max(if sliver > 0.9 { sliver.min(0.99) } else { 0.0 })
    }

    fn face_of(&self, corners: &[&Vertex; 3], sides: &Sides) -> f64 {
        let [a, b, c] = *corners;
        let ends = [[a, b], [b, c], [c, a]];
        let edge = |k: usize| self.edge_along(&sides.chords[k], sides.lengths_sq[k], ends[k]);
        let edges = edge(0).max(edge(1)).max(edge(2));
        let cos_tilt = sides.cos_tilt(corners);
        // Worse than any edge: no edit may fold a face to save an edge, or repairs run away.
        edges.max(if cos_tilt < COS_FOLD { FOLDED * (1.0 - cos_tilt) } else { 0.0 })
    }

    fn edge_along(&self, chord: &Vec3, length_sq: f64, [p, q]: [&Vertex; 2]) -> f64 {
        let length = length_sq.sqrt();
        let turning = (1.0 - p.normal.dot(&q.normal)) / (1.0 - self.cos_turning);
        let slope = chord.dot(&p.normal).abs().max(chord.dot(&q.normal).abs()) / length;
        turning.max(slope / self.max_slope).max(if length > 0.0 { 0.0 } else { 2.0 })
    }
}

/// The larger of two numbers, in one instruction; if either is not a number any.
#[inline]
fn larger(x: f64, y: f64) -> f64 {
    if x > y { x } else { y }
}

/// The sides of a face, each from its corner to the next, and twice its vector area.
struct Sides {
    chords: [Vec3; 3],
    lengths_sq: [f64; 3],
    area: Vec3,
}

impl Sides {
    #[inline]
    fn of(corners: &[&Vertex; 3]) -> Self {
        let [a, b, c] = corners.map(|v| v.position);
        let chords = [b - a, c - b, a - c];
        let lengths_sq = chords.map(|chord| chord.norm_squared());
        Self { chords, lengths_sq, area: chords[0].cross(&(c - a)) }
    }

    /// Whether [`Self::quality`] is more than `limit` so clearly that products tell.
    fn is_clearly_better(&self, limit: f64) -> bool {
        let area_sq = self.area.norm_squared();
        area_sq > 1e-200 && 12.0 * area_sq > (1.0 + 1e-12) * limit * limit * self.sum_sq()
    }

    /// `4 sqrt(3) area / (sum of squared sides)`: 1 if equilateral, 0 if flat.
    fn quality(&self) -> f64 {
        let [x, y, z] = self.lengths_sq;
        2.0 * 3f64.sqrt() * self.area.norm() / (x + y + z)
    }

    /// The square of the sum of the squared sides.
    fn sum_sq(&self) -> f64 {
        let [x, y, z] = self.lengths_sq;
        (x + y + z) * (x + y + z)
    }

    /// Cosine of the largest angle between the face and the normal of a corner; -1 without area.
    fn cos_tilt(&self, corners: &[&Vertex; 3]) -> f64 {
        let Some(normal) = self.area.try_normalize(0.0) else { return -1.0 };
        corners.iter().map(|v| v.normal.dot(&normal)).fold(1.0, f64::min)
    }
}

/// Angle between the normals of two vertices, degrees.
pub(crate) fn turning_deg(p: &Vertex, q: &Vertex) -> f64 {
    let (sin, cos) = (p.normal.cross(&q.normal).norm(), p.normal.dot(&q.normal));
    libm::atan2(sin, cos).to_degrees()
}

/// Largest part of the chord along the normal at an end.
pub(crate) fn slope(p: &Vertex, q: &Vertex) -> f64 {
    let chord = q.position - p.position;
    chord.dot(&p.normal).abs().max(chord.dot(&q.normal).abs()) / chord.norm()
}

/// `4 sqrt(3) area / (sum of squared sides)`: 1 if equilateral, 0 if flat.
pub(crate) fn quality(corners: &[&Vertex; 3]) -> f64 {
    Sides::of(corners).quality()
}

/// Whether [`quality`] is more than `limit` so clearly that products tell.
pub(crate) fn is_clearly_better(corners: &[&Vertex; 3], limit: f64) -> bool {
    Sides::of(corners).is_clearly_better(limit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::Vec3;

    fn on_sphere(x: f64, y: f64, z: f64) -> Vertex {
        let normal = Vec3::new(x, y, z).normalize();
        Vertex { position: normal, normal, shape: [0.0; 6] }
    }

    fn narrow() -> AdaptParams {
        AdaptParams { max_turning_deg: 60.0, max_slope: 0.5, ..AdaptParams::default() }
    }

    #[test]
    fn an_edge_of_the_unit_sphere_turns_by_its_angle_and_slopes_by_half_its_sine() {
        let gate = Gate::new(&narrow());
        for (degrees, fit) in [(20.0f64, true), (59.0, true), (61.0, false)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (p, q) = (on_sphere(1.0, 0.0, 0.0), on_sphere(cos, sin, 0.0));
            assert!((turning_deg(&p, &q) - degrees).abs() < 1e-12);
            assert!((slope(&p, &q) - (0.5 * degrees).to_radians().sin()).abs() < 1e-14);
            assert_eq!(gate.edge(&p, &q) <= 1.0, fit);
        }
    }

    #[test]
    fn a_face_that_looks_inward_is_unfit_and_a_sliver_is_not() {
        let gate = Gate::new(&narrow());
        let (a, b) = (on_sphere(1.0, 0.0, 0.0), on_sphere(1.0, 0.3, 0.0));
        let (c, thin) = (on_sphere(1.0, 0.1, 0.3), on_sphere(1.0, 0.1, 0.002));
        assert!(gate.face(&[&a, &b, &c]) < 1.0);
        assert!(gate.face(&[&a, &c, &b]) > 1.0);
        let sliver = gate.face_with_quality(&[&a, &b, &thin]);
        assert!(gate.face_with_quality(&[&a, &b, &c]) < sliver && sliver < 1.0);
    }

    #[test]
    fn a_glance_says_what_the_figures_say() {
        let gate = Gate::new(&narrow());
        let (a, mut n_glances) = (on_sphere(1.0, 0.0, 0.0), 0);
        for k in 0..40_000u32 {
            let digit = |place: u32| f64::from((k / 20u32.pow(place)) % 20) / 20.0;
            let b = on_sphere(1.0, 1.5 * digit(0), 0.03 * digit(1));
            let c = on_sphere(1.0, digit(2) - 0.5, 0.1 * digit(1) - 0.03);
            let c = if k % 3 == 0 { Vertex { normal: b.normal, ..c } } else { c };
            let corners = [&a, &b, &c];
            let exact = gate.face_with_quality(&corners);
            for limit in [0.05, 0.5, 0.9, 0.95, 1.0, 4.0, 9.5, exact, 0.999 * exact, 1.001 * exact]
            {
                assert_eq!(gate.is_below(&corners, limit), exact < limit, "{exact} {limit}");
                let is_clear = gate.is_clearly_below(&corners, limit);
                assert!(!is_clear || exact < limit);
                n_glances += u32::from(is_clear);
                let better = is_clearly_better(&corners, 0.2);
                assert!(!better || quality(&corners) > 0.2);
            }
        }
        assert!(n_glances > 10_000, "{n_glances}");
    }
}
