//! How far the tangent of an edge may turn away from its chord, so that no sector closes.

use crate::edge_end::{ccw, cw};
use isospline_artifact::kinds::BaseMeshView;
use isospline_geometry::{HalfEdge, Vec3};

/// Largest turn of a tangent, radians: 20 degrees.
const MAX_TURN: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Part of a sector, and of what it lacks to a straight angle, that one of its two edges may take:
/// both together leave a tenth. A third each costs meshes of decimation a factor of 3 to 7 in the
/// worst curve (double torus of 1800 faces, chair of 4000); without a bound sectors close.
const SHARE: f64 = 0.45;

/// Part of the way to the third corner of a face, beside the chord, by which a tangent may turn
/// aside over the length of the chord. Long sides of flat faces otherwise reach across them: two
/// patches of the raw torus of 600 faces then fold beside a corner of 1.6 degrees. With half of it
/// meshes of deccube fold in more places, since their curves become worse.
const BESIDE: f64 = 1.0;

/// Range of the tangent of the angle between chord and curve as they leave a vertex, both seen in
/// its tangent plane; positive counter-clockwise from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slant(pub [f64; 2]);

impl Slant {
    /// 20 degrees to either side: where no neighbours are known.
    pub fn free() -> Self {
        Self([-libm::tan(MAX_TURN), libm::tan(MAX_TURN)])
    }

    /// The ranges at both ends of an edge.
    pub fn at_ends(mesh: &BaseMeshView<'_>, edge: usize) -> [Self; 2] {
        let position = |v: u32| Vec3::from(mesh.position[v as usize]);
        let chord = |h: HalfEdge| {
            let e = mesh.edge_of[h.row()] as usize;
            let [a, b] = mesh.edge[e].map(position);
            if mesh.edge_half[e][0] == h.0 { b - a } else { a - b }
        };
        mesh.edge_half[edge].map(|h| {
            let h = HalfEdge(h);
            let normal = Vec3::from(mesh.frame[mesh.sector[h.row()] as usize].normal);
            Self::between(&chord(h), &chord(ccw(mesh, h)), &chord(cw(mesh, h)), &normal)
        })
    }

    /// The range for an edge that leaves a vertex of this `normal` along `chord`, between edges
    /// along `ccw` and `cw`.
    ///
    /// Each sector keeps a tenth of its angle and of what it lacks to 180 degrees, whatever the
    /// neighbours do, so `lambda0` stays in (0, 1). An edge beside a sector out of (0, 180) degrees
    /// may only turn to mend it, and the long side of a flat face turns no further than its third
    /// corner lies beside it.
    pub fn between(chord: &Vec3, ccw: &Vec3, cw: &Vec3, normal: &Vec3) -> Self {
        let (left, right) = (angle(chord, ccw, normal), angle(cw, chord, normal));
        let flat = |v: &Vec3| (v - v.dot(normal) * normal).norm();
        let tan_beside = |v: &Vec3, a: f64| BESIDE * flat(v) * libm::sin(a) / flat(chord);
        let beside = |v: &Vec3, a: f64| {
            if a < std::f64::consts::PI { tan_beside(v, a) } else { f64::INFINITY }
        };
        let narrow = |a: f64, b: f64| (SHARE * a).min(SHARE * (std::f64::consts::PI - b));
        let turn = |a: f64, b: f64| libm::tan(narrow(a, b).clamp(0.0, MAX_TURN));
        Self([-turn(right, left).min(beside(cw, right)), turn(left, right).min(beside(ccw, left))])
    }
}

/// Angle from `a` to `b` about `normal`, in [0, 2 pi).
fn angle(a: &Vec3, b: &Vec3, normal: &Vec3) -> f64 {
    let flat = |v: &Vec3| v - v.dot(normal) * normal;
    let (a, b) = (flat(a), flat(b));
    let angle = libm::atan2(a.cross(&b).dot(normal), a.dot(&b));
    if angle < 0.0 { angle + 2.0 * std::f64::consts::PI } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(degrees: f64) -> Vec3 {
        let angle = degrees.to_radians();
        Vec3::new(angle.cos(), angle.sin(), 0.3)
    }

    fn range_deg(ccw: f64, cw: f64) -> [f64; 2] {
        let Slant(range) = Slant::between(&at(0.0), &at(ccw), &at(cw), &Vec3::z());
        range.map(|slant| slant.atan().to_degrees())
    }

    #[test]
    fn narrow_and_wide_sectors_bound_the_turn() {
        let close = |found: [f64; 2], expected: [f64; 2]| {
            assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-9), "{found:?}");
        };
        close(range_deg(60.0, -60.0), [-20.0, 20.0]);
        close(range_deg(30.0, -90.0), [-20.0, 13.5]);
        // A corner at 174 degrees lies a tenth of its distance beside the chord.
        close(range_deg(60.0, -174.0), [-6f64.to_radians().sin().atan().to_degrees(), 2.7]);
        close(range_deg(200.0, -60.0), [0.0, 20.0]);
    }

    #[test]
    fn the_long_side_of_a_flat_face_turns_no_further_than_its_corner_lies_beside_it() {
        // A corner one tenth of the chord beside it, above its middle.
        let wing = Vec3::new(0.5, 0.1, 0.0);
        let Slant(range) = Slant::between(&Vec3::x(), &wing, &at(-60.0), &Vec3::z());
        // 0.45 of the sector of 11.3 degrees is 5.09, a tenth beside 1 is 5.71.
        assert!((range[1].atan().to_degrees() - 0.45 * 0.2f64.atan().to_degrees()).abs() < 1e-9);
        let Slant(range) =
            Slant::between(&Vec3::x(), &(wing - 0.4 * Vec3::x()), &at(-60.0), &Vec3::z());
        assert!((range[1] - 0.1).abs() < 1e-12, "{range:?}");
    }
}
