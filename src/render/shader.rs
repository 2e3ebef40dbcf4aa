//! Hits become light: the style's material, and for values the colours of a legend.

use crate::camera::Camera;
use crate::color::{Light, Ramp};
use crate::landing::Hit;
use crate::lent_threads::{ForEach, map};
use crate::material::Studio;
use crate::patch::{Jet, Patch};
use crate::scale::{Scale, Weighted};
use crate::style::Style;
use crate::{Job, RenderError};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::grid;
use isospline_implicit::{Field, Jet1};

/// Steps a side of the samples of each patch that fix the range of values: 28 a patch.
const RANGE_STEPS: usize = 6;
/// Half the width of a drawn border, pixels.
const BORDER: f64 = 0.65;

/// Colours of one picture.
pub(crate) struct Shader<'a> {
    field: &'a dyn Field,
    diagonal: f64,
    style: Style,
    studio: Studio,
    /// Half width of the borders of patches, pixels.
    border: f64,
    values: Option<Values>,
}

/// How values become colours.
#[derive(Clone, Debug)]
pub(crate) struct Values {
    pub(crate) scale: Scale,
    pub(crate) ramp: Ramp,
    /// Least and largest of the sampled values.
    pub(crate) extent: [f64; 2],
}

impl<'a> Shader<'a> {
    /// # Errors
    /// [`RenderError::Range`].
    pub(crate) fn new(
        job: &Job<'a>,
        camera: &Camera,
        for_each: ForEach<'_>,
    ) -> Result<Self, RenderError> {
        let style = job.options.style;
        let mut shader = Self {
            field: job.field,
            diagonal: job.surface.diagonal(),
            style,
            studio: Studio::new(camera, job.options.stripes),
            border: BORDER * job.options.line_scale(),
            values: None,
        };
        if matches!(style, Style::Curvature | Style::Gaussian | Style::Error) {
            shader.values = Some(shader.values(job, for_each)?);
        }
        Ok(shader)
    }

    /// The map of values to colours; `None` for styles that show none.
    pub(crate) fn legend(&self) -> Option<&Values> {
        self.values.as_ref()
    }

    /// Light of each hit, in order.
    pub(crate) fn shade(&self, hits: &[Hit]) -> Vec<Light> {
        let studio = &self.studio;
        if let Some(values) = &self.values {
            let color = |value: &f64| values.ramp.at(values.scale.place(*value));
            let shown = self.of_hits(hits);
            return hits.iter().zip(&shown).map(|(h, v)| studio.tinted(h, color(v))).collect();
        }
        let shade = |hit: &Hit| match self.style {
            Style::Gold => studio.gold(hit),
            Style::Patches if hit.border < self.border => studio.clay(hit, BORDER_COLOR),
            Style::Patches => studio.clay(hit, tint(hit.face)),
            Style::Net => studio.clay(hit, Light([0.86, 0.87, 0.88])),
            _ => studio.zebra(hit),
        };
        hits.iter().map(shade).collect()
    }

    /// The value that the style shows at each hit.
    fn of_hits(&self, hits: &[Hit]) -> Vec<f64> {
        match self.style {
            Style::Curvature => hits.iter().map(|hit| hit.curvature.mean).collect(),
            Style::Gaussian => hits.iter().map(|hit| hit.curvature.gaussian).collect(),
            _ => self.distances(&hits.iter().map(|hit| hit.point).collect::<Vec<_>>()),
        }
    }

    /// The same at points of a patch that are not looked at.
    fn of_jets(&self, jets: &[Jet]) -> Vec<f64> {
        match self.style {
            Style::Curvature => jets.iter().map(|jet| jet.curvature().mean).collect(),
            Style::Gaussian => jets.iter().map(|jet| jet.curvature().gaussian).collect(),
            _ => self.distances(&jets.iter().map(|jet| jet.point).collect::<Vec<_>>()),
        }
    }

    /// Distance from the implicit surface to first order, over the diagonal.
    fn distances(&self, points: &[Vec3]) -> Vec<f64> {
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        self.field.gradients(points, &mut jets);
        let distance = |jet: &Jet1| jet.value.abs() / jet.gradient.norm() / self.diagonal;
        jets.iter().map(distance).collect()
    }

    fn values(&self, job: &Job<'_>, for_each: ForEach<'_>) -> Result<Values, RenderError> {
        let sampled = map(for_each, job.surface.n_faces(), |range| {
            range.flat_map(|f| self.of_patch(&Patch::new(&job.surface.net(f)))).collect()
        });
        let all = || sampled.iter().copied();
        let values = || sampled.iter().map(|v| v.value);
        let (scale, ramp) = match self.style {
            Style::Error => (Scale::decades(all()), Ramp::rising()),
            _ => (Scale::about_zero(all()), Ramp::diverging()),
        };
        let scale = match job.options.range {
            Some(range) => scale.over(range, self.style.name())?,
            None => scale,
        };
        let extent = [values().fold(f64::NAN, f64::min), values().fold(f64::NAN, f64::max)];
        Ok(Values { scale, ramp, extent })
    }

    fn of_patch(&self, patch: &Patch) -> Vec<Weighted> {
        let jets: Vec<Jet> = grid(RANGE_STEPS).map(|[_, v, w]| patch.jet([v, w])).collect();
        // Samples of a patch stand for its area evenly in the parameters.
        let weigh = |(jet, value): (&Jet, f64)| Weighted { value, weight: jet.normal().norm() };
        jets.iter().zip(self.of_jets(&jets)).map(weigh).collect()
    }
}

const BORDER_COLOR: Light = Light([0.012, 0.03, 0.10]);

/// A pale colour of a face's own: hues a golden section apart are never near for faces whose
/// numbers are.
fn tint(face: u32) -> Light {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = (f64::from(face) * GOLDEN).fract();
    let wave = |k: f64| libm::cos(std::f64::consts::TAU * (hue + k / 3.0));
    Light([0.0, 1.0, 2.0].map(|k| 0.66 + 0.16 * wave(k)))
}
