//! Where the eye stands, and what of space falls on which pixel.

use crate::RenderError;
use crate::lent_threads::{ForEach, map};
use crate::patch::Patch;
use crate::surface::Surface;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::grid;

/// From where the surface is looked at.
///
/// # Examples
/// ```
/// use isospline_render::View;
///
/// let from_above = View { elevation_deg: 90.0, ..View::default() };
/// assert_eq!(from_above.perspective_deg, 20.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Angle of the eye about the z axis, from the x axis towards y, degrees. -360 to 360.
    pub azimuth_deg: f64,
    /// Angle of the eye above the xy plane, degrees. -90 to 90.
    pub elevation_deg: f64,
    /// Angle at the eye that holds the ball around the surface, degrees. 0 to 90; 0 is parallel
    /// projection.
    pub perspective_deg: f64,
}

impl Default for View {
    /// The three axes alike, x to the left, y to the right, z up, with a little perspective.
    fn default() -> Self {
        Self { azimuth_deg: 45.0, elevation_deg: ISO_ELEVATION_DEG, perspective_deg: 20.0 }
    }
}

/// `atan(1 / sqrt(2))`.
const ISO_ELEVATION_DEG: f64 = 35.264_389_682_754_654;

/// Part of the picture left free on each side, of its shorter side.
const MARGIN: f64 = 0.04;

/// Steps a side of the points of each patch that are to lie in the picture.
const FRAME_STEPS: usize = 3;

/// The part of the picture that the surface may fill, pixels from the upper left corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) width: f64,
    pub(crate) height: f64,
}

/// A view fitted to a surface: maps points to pixels.
///
/// A camera looks along `-toward`; pixels count from the upper left corner to the right and down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub(crate) right: Vec3,
    pub(crate) up: Vec3,
    pub(crate) toward: Vec3,
    target: Vec3,
    /// One over the distance of the eye from the target; 0 in parallel projection.
    per_distance: f64,
    /// Pixels a model unit at the target.
    scale: f64,
    /// Pixel of the target.
    center: [f64; 2],
    /// Radius of the ball around the surface.
    radius: f64,
}

/// A point as the picture has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projected {
    /// Pixels.
    pub(crate) at: [f64; 2],
    /// Larger is nearer; affine over the picture of a plane.
    pub(crate) nearness: f64,
    /// Weight of the point when values are interpolated over the picture of a plane.
    pub(crate) weight: f64,
}

/// The line of sight of a point of the picture, as two planes `normal . (p - target) = offset`
/// measured in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) normals: [Vec3; 2],
    pub(crate) offsets: [f64; 2],
}

impl Camera {
    /// The camera of this view that has all of the surface in the frame.
    ///
    /// # Errors
    /// [`RenderError::View`], [`RenderError::Extent`].
    pub(crate) fn fitted(
        view: View,
        surface: &Surface<'_>,
        frame: Frame,
        for_each: ForEach<'_>,
    ) -> Result<Self, RenderError> {
        view.check()?;
        let samples: Vec<Vec<Vec3>> = map(for_each, surface.n_faces(), |range| {
            range.map(|f| frame_points(&surface.net(f))).collect()
        });
        let points = || samples.iter().flatten();
        let mut camera = Self::about(view, points())?;
        // symbols: lo, hi corners of the picture at one pixel a unit
        let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points() {
            let at = camera.project(p).at;
            for k in 0..2 {
                lo[k] = lo[k].min(at[k]);
                hi[k] = hi[k].max(at[k]);
            }
        }
        let margin = MARGIN * frame.width.min(frame.height);
        let room = [frame.width - 2.0 * margin, frame.height - 2.0 * margin];
        // A surface of no width still has the other extent, or the radius would be zero.
        let fit = |k: usize| room[k] / (hi[k] - lo[k]);
        camera.scale = fit(0).min(fit(1));
        let middle = [0, 1].map(|k| 0.5 * (lo[k] + hi[k]) * camera.scale);
        camera.center = [0.5 * frame.width - middle[0], 0.5 * frame.height - middle[1]];
        Ok(camera)
    }

    /// The camera at one pixel a unit about the middle of these points; others than finite points
    /// are passed over.
    fn about<'p>(
        view: View,
        points: impl Iterator<Item = &'p Vec3> + Clone,
    ) -> Result<Self, RenderError> {
        let (mut lo, mut hi) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for p in points.clone().filter(|p| p.iter().all(|x| x.is_finite())) {
            (lo, hi) = (lo.inf(p), hi.sup(p));
        }
        let target = 0.5 * (lo + hi);
        let radius = points.fold(0.0_f64, |acc, p| acc.max((p - target).norm()));
        if !(radius.is_finite() && radius > 0.0) {
            return Err(RenderError::Extent);
        }
        let [right, up, toward] = view.axes();
        let half = 0.5 * view.perspective_deg.to_radians();
        let (scale, center) = (1.0, [0.0; 2]);
        let per_distance = libm::sin(half) / radius;
        Ok(Self { right, up, toward, target, per_distance, scale, center, radius })
    }

    /// Pixel of a point; not a number for points behind the eye.
    pub fn pixel(&self, point: Vec3) -> [f64; 2] {
        self.project(&point).at
    }

    /// Pixels a model unit at the middle of the surface.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    pub(crate) fn project(&self, point: &Vec3) -> Projected {
        let arm = point - self.target;
        let z = self.toward.dot(&arm);
        // symbols: q is the distance of the target from the eye over that of the point
        let behind = 1.0 - z * self.per_distance;
        let q = if behind > NEAREST { 1.0 / behind } else { f64::NAN };
        let (x, y) = (self.right.dot(&arm), self.up.dot(&arm));
        let at = [self.center[0] + self.scale * q * x, self.center[1] - self.scale * q * y];
        let nearness = if self.is_parallel() { z } else { q };
        Projected { at, nearness, weight: q }
    }

    /// The line of sight through a point of the picture.
    pub(crate) fn sight(&self, at: [f64; 2]) -> Sight {
        let (x, y) = (at[0] - self.center[0], self.center[1] - at[1]);
        // scale q x = X with q = 1 / (1 - z / D) is linear: scale x + X z / D = X.
        let plane =
            |axis: Vec3, offset: f64| self.scale * axis + offset * self.per_distance * self.toward;
        Sight { normals: [plane(self.right, x), plane(self.up, y)], offsets: [x, y] }
    }

    /// How far a point is off a line of sight, pixels at the distance of the target.
    pub(crate) fn miss(&self, sight: &Sight, point: &Vec3) -> [f64; 2] {
        let arm = point - self.target;
        [0, 1].map(|k| sight.normals[k].dot(&arm) - sight.offsets[k])
    }

    /// Unit vector from a point to the eye.
    pub(crate) fn toward_eye(&self, point: &Vec3) -> Vec3 {
        // The eye's distance times the vector to it: finite in parallel projection too.
        (self.toward - self.per_distance * (point - self.target)).normalize()
    }

    /// Most pixels that a model unit of the surface takes.
    pub(crate) fn largest_scale(&self) -> f64 {
        self.scale / (1.0 - self.radius * self.per_distance)
    }

    /// The nearness of a point that is nearer by a part of the radius.
    pub(crate) fn lifted(&self, nearness: f64, part: f64) -> f64 {
        self.moved(nearness, part * self.radius)
    }

    /// The nearness of a point that is farther by what so many pixels measure.
    pub(crate) fn farther(&self, nearness: f64, pixels: f64) -> f64 {
        self.moved(nearness, -pixels / self.scale)
    }

    fn moved(&self, nearness: f64, rise: f64) -> f64 {
        if self.is_parallel() {
            nearness + rise
        } else {
            nearness * (1.0 + rise * self.per_distance * nearness)
        }
    }

    fn is_parallel(&self) -> bool {
        // An exact zero: the sine of a zero angle.
        self.per_distance == 0.0
    }
}

/// Distances from the eye below this part of the target's are not drawn.
const NEAREST: f64 = 1e-3;

fn frame_points(net: &[Vec3; 36]) -> Vec<Vec3> {
    let patch = Patch::new(net);
    grid(FRAME_STEPS).map(|[_, v, w]| patch.jet([v, w]).point).collect()
}

impl View {
    fn check(&self) -> Result<(), RenderError> {
        let limits = [
            ("azimuth", self.azimuth_deg, -360.0, 360.0),
            ("elevation", self.elevation_deg, -90.0, 90.0),
            ("perspective", self.perspective_deg, 0.0, 90.0),
        ];
        for (what, value, min, max) in limits {
            if !(min..=max).contains(&value) {
                return Err(RenderError::View { what, value, min, max });
            }
        }
        Ok(())
    }

    /// Unit vectors to the right, up, and towards the eye.
    fn axes(&self) -> [Vec3; 3] {
        let [(sin_a, cos_a), (sin_e, cos_e)] = [self.azimuth_deg, self.elevation_deg].map(turn);
        let right = Vec3::new(-sin_a, cos_a, 0.0);
        let toward = Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        [right, toward.cross(&right), toward]
    }
}

/// Sine and cosine of an angle in degrees, exact at multiples of a right angle: a view along an
/// axis shows planes across it as lines.
fn turn(angle_deg: f64) -> (f64, f64) {
    let quarters = angle_deg / 90.0;
    if quarters.fract() == 0.0 {
        // An exact zero: a whole number of right angles.
        return [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)]
            [quarters.rem_euclid(4.0) as usize];
    }
    let angle = angle_deg.to_radians();
    (libm::sin(angle), libm::cos(angle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lent_threads::on_this_thread;
    use crate::sample::ball;

    const FRAME: Frame = Frame { width: 400.0, height: 300.0 };

    fn ball_camera(view: View) -> Camera {
        let (position, face) = ball(40);
        let surface = Surface::from_mesh(&position, &face).unwrap();
        Camera::fitted(view, &surface, FRAME, &on_this_thread).unwrap()
    }

    #[test]
    fn views_along_the_axes_show_the_other_two() {
        let cases = [
            ([0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
            ([90.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            ([-90.0, 90.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ];
        for ([azimuth_deg, elevation_deg], right, up) in cases {
            let view = View { azimuth_deg, elevation_deg, ..View::default() };
            let axes = view.axes();
            assert_eq!([axes[0], axes[1]], [Vec3::from(right), Vec3::from(up)]);
            assert!((axes[0].cross(&axes[1]) - axes[2]).norm() < 1e-15);
        }
    }

    #[test]
    fn a_ball_fills_the_frame_up_to_its_margin() {
        let camera = ball_camera(View { perspective_deg: 0.0, ..View::default() });
        let expected = 0.5 * 300.0 * (1.0 - 2.0 * MARGIN);
        // The sampled height falls short of the radius by at most a face's share.
        assert!((camera.scale() / expected - 1.0).abs() < 2e-3, "{}", camera.scale());
        let [x, y] = camera.pixel(Vec3::zeros());
        assert!((x - 200.0).abs() < 0.2 && (y - 150.0).abs() < 0.2, "{x} {y}");
    }

    #[test]
    fn a_line_of_sight_holds_all_points_of_its_pixel() {
        for perspective_deg in [0.0, 20.0, 80.0] {
            let camera = ball_camera(View { perspective_deg, ..View::default() });
            let p = Vec3::new(0.3, -0.5, 0.7);
            let sight = camera.sight(camera.pixel(p));
            for step in [0.0, 0.5, -2.0] {
                let on_line = p + step * camera.toward_eye(&p);
                let miss = camera.miss(&sight, &on_line);
                assert!(miss.iter().all(|m| m.abs() < 1e-10), "{perspective_deg} {miss:?}");
            }
            assert!(camera.miss(&sight, &(p + 0.1 * camera.up))[1] > 1.0);
        }
    }

    #[test]
    fn what_is_nearer_is_nearer() {
        for perspective_deg in [0.0, 30.0] {
            let camera = ball_camera(View { perspective_deg, ..View::default() });
            let p = Vec3::new(0.3, -0.5, 0.7);
            let here = camera.project(&p).nearness;
            let there = camera.project(&(p + 0.01 * camera.radius * camera.toward)).nearness;
            assert!(there > here);
            assert!((camera.lifted(here, 0.01) / there - 1.0).abs() < 1e-4, "{here} {there}");
        }
    }

    #[test]
    fn a_view_out_of_range_is_named() {
        let view = View { elevation_deg: f64::NAN, ..View::default() };
        assert!(view.check().unwrap_err().to_string().contains("elevation"));
        let view = View { perspective_deg: 91.0, ..View::default() };
        assert!(view.check().unwrap_err().to_string().contains("perspective"));
    }
}
