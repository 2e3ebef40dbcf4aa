//! Where exactly a line of sight meets a patch: Newton's method from what the tile saw.

use crate::camera::{Camera, Sight};
use crate::patch::{Curvature, Jet, Patch};
use isospline_geometry::Vec3;

/// A point of the surface as one sample sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// The face.
    pub(crate) face: u32,
    pub(crate) point: Vec3,
    /// Outward unit normal; not a number where the patch has none.
    pub(crate) normal: Vec3,
    /// Unit vector to the eye.
    pub(crate) toward_eye: Vec3,
    /// Whether the inner side is seen.
    pub(crate) is_back: bool,
    pub(crate) curvature: Curvature,
    /// Distance in the picture to the nearest border of the patch, pixels, to first order.
    pub(crate) border: f64,
}

/// A line of sight that ends within this many pixels of its sample has met the patch: less than a
/// thousandth of the distance between samples, and reached by the first step as a rule. What is
/// shown is evaluated on the patch at that very point, so this is no error of its values.
pub(crate) const MET: f64 = 1e-4;
/// Steps at most; along silhouettes the method is slow, and the guess good enough.
const MAX_STEPS: usize = 6;

/// The point of `patch` that sample `at` of the picture sees, started from barycentrics (v, w).
pub(crate) fn land(
    camera: &Camera,
    patch: &Patch,
    face: u32,
    at: [f64; 2],
    start: [f64; 2],
    is_back: bool,
) -> Hit {
    let sight = camera.sight(at);
    let guess = patch.jet(start);
    let (mut jet, mut place) = refine(camera, patch, &sight, start, guess);
    // Past a silhouette the other side of the patch may be met: it is hidden by this one.
    let faces_eye = |jet: &Jet| jet.normal().dot(&camera.toward_eye(&jet.point)) > 0.0;
    if faces_eye(&jet) == is_back {
        (jet, place) = (guess, start);
    }
    Hit {
        face,
        point: jet.point,
        normal: jet.normal().normalize(),
        toward_eye: camera.toward_eye(&jet.point),
        is_back,
        curvature: jet.curvature(),
        border: border(&sight, &jet, place),
    }
}

fn refine(
    camera: &Camera,
    patch: &Patch,
    sight: &Sight,
    mut place: [f64; 2],
    mut jet: Jet,
) -> (Jet, [f64; 2]) {
    let mut miss = camera.miss(sight, &jet.point);
    for _ in 0..MAX_STEPS {
        if largest(miss) <= MET {
            break;
        }
        let Some([[a, b], [c, d]]) = inverse(sight, &jet) else { break };
        let step = [a * miss[0] + b * miss[1], c * miss[0] + d * miss[1]];
        let next = inside([place[0] - step[0], place[1] - step[1]]);
        let next_jet = patch.jet(next);
        let next_miss = camera.miss(sight, &next_jet.point);
        // Not a number is no gain either.
        if largest(next_miss) < largest(miss) {
            (place, jet, miss) = (next, next_jet, next_miss);
        } else {
            break;
        }
    }
    (jet, place)
}

/// Derivatives of (v, w) by the two coordinates of the picture; `None` where the patch is seen
/// edge on.
fn inverse(sight: &Sight, jet: &Jet) -> Option<[[f64; 2]; 2]> {
    let [x, y] = sight.normals;
    let [[a, b], [c, d]] = [[x.dot(&jet.dv), x.dot(&jet.dw)], [y.dot(&jet.dv), y.dot(&jet.dw)]];
    let determinant = a * d - b * c;
    let out = [[d, -b], [-c, a]].map(|row| row.map(|entry| entry / determinant));
    out.iter().flatten().all(|entry| entry.is_finite()).then_some(out)
}

/// The nearest place in the triangle, as far as cutting off what is negative goes.
fn inside([v, w]: [f64; 2]) -> [f64; 2] {
    let (v, w) = (v.max(0.0), w.max(0.0));
    let over = (v + w).max(1.0);
    [v / over, w / over]
}

fn largest(miss: [f64; 2]) -> f64 {
    miss[0].abs().max(miss[1].abs())
}

/// A barycentric over the length of its gradient in the picture, the least of the three.
fn border(sight: &Sight, jet: &Jet, [v, w]: [f64; 2]) -> f64 {
    let Some([dv, dw]) = inverse(sight, jet) else { return 0.0 };
    let du = [-dv[0] - dw[0], -dv[1] - dw[1]];
    let to = |value: f64, slope: [f64; 2]| {
        value.max(0.0) / (slope[0] * slope[0] + slope[1] * slope[1]).sqrt()
    };
    to(1.0 - v - w, du).min(to(v, dv)).min(to(w, dw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Frame, View};
    use crate::lent_threads::on_this_thread;
    use crate::sample::{bowl_net, patches, surface};

    fn bowl_from_above(perspective_deg: f64) -> (Camera, Patch) {
        let net = bowl_net(1.5, -0.7);
        let rows = patches(&[net], vec![[0, 1, 2]]);
        let view = View { azimuth_deg: 20.0, elevation_deg: 70.0, perspective_deg };
        let frame = Frame { width: 300.0, height: 300.0 };
        let camera = Camera::fitted(view, &surface(&rows), frame, &on_this_thread).unwrap();
        (camera, Patch::new(&net))
    }

    #[test]
    fn what_is_met_is_the_point_behind_the_pixel() {
        for perspective_deg in [0.0, 40.0] {
            let (camera, patch) = bowl_from_above(perspective_deg);
            for place in [[0.3, 0.3], [0.05, 0.9], [0.5, 0.1], [0.0, 0.5]] {
                let target = patch.jet(place).point;
                let near = [place[0] + 0.02, (place[1] - 0.03).max(0.0)];
                let hit = land(&camera, &patch, 7, camera.pixel(target), near, false);
                let [found, asked] = [hit.point, target].map(|p| camera.pixel(p));
                assert!((found[0] - asked[0]).abs() <= 1.01 * MET);
                assert!((found[1] - asked[1]).abs() <= 1.01 * MET);
                assert!((hit.point - target).norm() < 10.0 * MET / camera.scale());
                let slope = Vec3::new(-1.5 * hit.point.x, 0.7 * hit.point.y, 1.0).normalize();
                assert!((hit.normal - slope).norm() < 1e-13);
            }
        }
    }

    #[test]
    fn the_border_is_as_far_as_the_picture_shows() {
        let (camera, patch) = bowl_from_above(0.0);
        let (on, off) = (patch.jet([0.0, 0.4]).point, patch.jet([0.001, 0.4]).point);
        let hit = land(&camera, &patch, 0, camera.pixel(off), [0.001, 0.4], false);
        let [a, b] = [camera.pixel(on), camera.pixel(off)];
        let moved = ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])).sqrt();
        assert!(hit.border > 0.5 * moved && hit.border <= 1.01 * moved, "{} {moved}", hit.border);
    }
}
