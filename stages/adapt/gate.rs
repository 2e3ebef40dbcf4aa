//! When a base mesh is fit to be fitted: turning, slope and tilt of every face.

use crate::AdaptParams;
use crate::vertex::Vertex;
use isospline_geometry::Vec3;

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
}

impl Gate {
    pub(crate) fn new(params: &AdaptParams) -> Self {
        Self {
            cos_turning: libm::cos(params.max_turning_deg.to_radians()),
            max_slope: params.max_slope,
            min_quality: params.min_quality,
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
        let sides = Sides::of(corners);
        let sliver = 0.9 * self.min_quality / sides.quality();
        self.face_of(corners, &sides).max(if sliver > 0.9 { sliver.min(0.99) } else { 0.0 })
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

/// The sides of a face, each from its corner to the next, and twice its vector area.
struct Sides {
    chords: [Vec3; 3],
    lengths_sq: [f64; 3],
    area: Vec3,
}

impl Sides {
    fn of(corners: &[&Vertex; 3]) -> Self {
        let [a, b, c] = corners.map(|v| v.position);
        let chords = [b - a, c - b, a - c];
        let lengths_sq = chords.map(|chord| chord.norm_squared());
        Self { chords, lengths_sq, area: chords[0].cross(&(c - a)) }
    }

    /// `4 sqrt(3) area / (sum of squared sides)`: 1 if equilateral, 0 if flat.
    fn quality(&self) -> f64 {
        let [x, y, z] = self.lengths_sq;
        2.0 * 3f64.sqrt() * self.area.norm() / (x + y + z)
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
}
