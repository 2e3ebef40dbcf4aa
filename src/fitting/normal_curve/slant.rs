//! How far the tangent of an edge may turn away from its chord, so that no sector closes.

use isospline_geometry::Vec3;

/// Largest turn of a tangent, radians: 20 degrees.
const MAX_TURN: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Part of a sector, and of what it lacks to a straight angle, that one of its two edges may take:
/// both together leave a tenth. A third each costs meshes of decimation a factor of 3 to 7 in the
/// worst curve (double torus of 1800 faces, chair of 4000); without a bound sectors close.
const SHARE: f64 = 0.45;

/// Range of the tangent of the angle between chord and curve as they leave a vertex, both seen in
/// its tangent plane; positive counter-clockwise from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slant(pub [f64; 2]);

impl Slant {
    /// 20 degrees to either side: where no neighbours are known.
    pub fn free() -> Self {
        Self([-libm::tan(MAX_TURN), libm::tan(MAX_TURN)])
    }

    /// The range for an edge that leaves a vertex of this `normal` along `chord`, between edges
    /// along `ccw` and `cw`.
    ///
    /// Each sector keeps a tenth of its angle and of what it lacks to 180 degrees, whatever the
    /// neighbours do, so `lambda0` stays in (0, 1). An edge beside a sector out of (0, 180) degrees
    /// may only turn to mend it.
    pub fn between(chord: &Vec3, ccw: &Vec3, cw: &Vec3, normal: &Vec3) -> Self {
        let (left, right) = (angle(chord, ccw, normal), angle(cw, chord, normal));
        let narrow = |a: f64, b: f64| (SHARE * a).min(SHARE * (std::f64::consts::PI - b));
        let turn = |a: f64, b: f64| libm::tan(narrow(a, b).clamp(0.0, MAX_TURN));
        Self([-turn(right, left), turn(left, right)])
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
        close(range_deg(60.0, -174.0), [-20.0, 2.7]);
        close(range_deg(200.0, -60.0), [0.0, 20.0]);
    }
}
