//! Light from a point of the surface to the eye: clay, gold, reflected stripes.

use crate::camera::Camera;
use crate::color::Light;
use crate::landing::Hit;
use isospline_geometry::Vec3;

/// The studio around the surface: it stands still with respect to the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Studio {
    right: Vec3,
    up: Vec3,
    toward: Vec3,
    /// Directions of the main and of the filling light.
    key: Vec3,
    fill: Vec3,
    /// Axis of the stripes that zebra reflects.
    stripes: Vec3,
    /// Pairs of a black and a white stripe from pole to pole.
    n_stripes: f64,
}

/// What clay and reflections show of an inner side: a closed surface shows none.
const INSIDE: Light = Light([0.16, 0.22, 0.36]);
/// What stands where the patch has no normal.
const NO_NORMAL: Light = Light([0.8, 0.0, 0.5]);

impl Studio {
    pub(crate) fn new(camera: &Camera, stripes: u32) -> Self {
        let (right, up, toward) = (camera.right, camera.up, camera.toward);
        let at = |x: f64, y: f64, z: f64| (x * right + y * up + z * toward).normalize();
        Self {
            right,
            up,
            toward,
            key: at(-0.55, 0.75, 0.7),
            fill: at(0.8, -0.1, 0.6),
            stripes: at(0.35, 0.9, 0.15),
            n_stripes: f64::from(stripes),
        }
    }

    /// Soft light on a dull surface of this colour.
    pub(crate) fn clay(&self, hit: &Hit, color: Light) -> Light {
        let Some(normal) = facing(hit) else { return NO_NORMAL };
        let color = if hit.is_back { INSIDE } else { color };
        // Light that wraps around: half of what a dull surface gives reaches its far side.
        let wrapped = |light: Vec3| 0.5 + 0.5 * normal.dot(&light);
        let (key, fill) = (wrapped(self.key), wrapped(self.fill));
        color * (0.16 + 0.78 * key * key + 0.16 * fill * fill)
            + Light::grey(0.06) * gloss(hit, normal, self.key)
    }

    /// The same with less shade, so that colours stay those of a legend.
    pub(crate) fn tinted(&self, hit: &Hit, color: Light) -> Light {
        let Some(normal) = facing(hit) else { return NO_NORMAL };
        let key = 0.5 + 0.5 * normal.dot(&self.key);
        let rim = normal.dot(&hit.toward_eye).clamp(0.0, 1.0);
        color * (0.55 + 0.4 * key) * (0.75 + 0.25 * rim)
    }

    /// Black and white stripes of the studio's dome, seen in a mirror.
    pub(crate) fn zebra(&self, hit: &Hit) -> Light {
        let Some(normal) = facing(hit) else { return NO_NORMAL };
        let angle = libm::acos(reflected(hit, normal).dot(&self.stripes).clamp(-1.0, 1.0));
        let is_black = (angle / std::f64::consts::PI * self.n_stripes).fract() < 0.5;
        let color = if hit.is_back { INSIDE } else { Light([0.93, 0.94, 0.96]) };
        let stripe = if is_black { Light([0.006, 0.008, 0.014]) } else { color };
        let rim = normal.dot(&hit.toward_eye).clamp(0.0, 1.0);
        let key = 0.5 + 0.5 * normal.dot(&self.key);
        stripe * (0.55 + 0.45 * rim) * (0.62 + 0.38 * key)
            + Light::grey(0.05) * gloss(hit, normal, self.key)
    }

    /// Polished gold in the studio.
    pub(crate) fn gold(&self, hit: &Hit) -> Light {
        let Some(normal) = facing(hit) else { return NO_NORMAL };
        let metal = if hit.is_back { INSIDE } else { Light([1.0, 0.60, 0.15]) };
        // A metal reflects its own colour, and all light at grazing angles [derived: Schlick's
        // approximation of Fresnel's formula].
        let grazing = 1.0 - normal.dot(&hit.toward_eye).clamp(0.0, 1.0);
        let square = grazing * grazing;
        let mirror = metal.mixed(Light::WHITE, square * square * grazing);
        // Polished, not a mirror: part of the light is spread.
        let seen = self.dome(reflected(hit, normal)).filtered(mirror);
        let spread = metal * (0.03 + 0.16 * (0.5 + 0.5 * normal.dot(&self.key)));
        Light((seen + spread).0.map(|c| 1.0 - libm::exp(-1.4 * c)))
    }

    /// Brightness of the studio in a direction: a floor, a sky and two lamps.
    fn dome(&self, direction: Vec3) -> Light {
        let height = self.up.dot(&direction);
        let floor =
            Light([0.16, 0.13, 0.11]).mixed(Light([0.05, 0.04, 0.035]), step(-1.0, 0.0, height));
        let sky =
            Light([0.12, 0.12, 0.13]).mixed(Light([0.70, 0.72, 0.76]), step(0.0, 1.0, height));
        let room = floor.mixed(sky, step(-0.05, 0.10, height));
        let key = step(0.70, 0.95, self.key.dot(&direction));
        let beside = 0.9 * self.right.dot(&direction) + 0.3 * self.toward.dot(&direction);
        let side = step(0.75, 0.95, beside);
        let behind = step(0.55, 0.95, self.toward.dot(&direction));
        room + Light::grey(2.6) * key + Light([0.9, 0.95, 1.0]) * side + Light::grey(0.35) * behind
    }
}

/// The normal turned to the eye; `None` where there is none.
fn facing(hit: &Hit) -> Option<Vec3> {
    let normal = if hit.normal.dot(&hit.toward_eye) < 0.0 { -hit.normal } else { hit.normal };
    normal.iter().all(|x| x.is_finite()).then_some(normal)
}

/// Where the eye looks by way of the surface.
fn reflected(hit: &Hit, normal: Vec3) -> Vec3 {
    2.0 * normal.dot(&hit.toward_eye) * normal - hit.toward_eye
}

/// A soft highlight, 0 to 1.
fn gloss(hit: &Hit, normal: Vec3, light: Vec3) -> f64 {
    let half = (light + hit.toward_eye).normalize();
    let cosine = normal.dot(&half).max(0.0);
    let fourth = cosine * cosine * cosine * cosine;
    let sixteenth = fourth * fourth * fourth * fourth;
    sixteenth * sixteenth
}

/// 0 up to `lo`, 1 from `hi` on, smooth between.
fn step(lo: f64, hi: f64, x: f64) -> f64 {
    let t = ((x - lo) / (hi - lo)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
