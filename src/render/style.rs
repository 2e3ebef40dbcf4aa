//! What a picture shows, and its options.

use crate::View;
use crate::error::RenderError;

/// How the surface is coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    /// Reflections of black and white stripes: they break where tangent planes do, and bend
    /// where curvatures do.
    #[default]
    Zebra,
    /// Polished gold.
    Gold,
    /// Mean curvature, half the sum of the principal curvatures.
    Curvature,
    /// Gaussian curvature, their product.
    Gaussian,
    /// Distance from the implicit surface, to first order `|f| / |grad f|`, over the diagonal.
    Error,
    /// Each patch with its border.
    Patches,
    /// Control nets.
    Net,
}

impl Style {
    /// All styles.
    pub const ALL: [Self; 7] = [
        Self::Zebra,
        Self::Gold,
        Self::Curvature,
        Self::Gaussian,
        Self::Error,
        Self::Patches,
        Self::Net,
    ];

    /// Name, as in file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zebra => "zebra",
            Self::Gold => "gold",
            Self::Curvature => "curvature",
            Self::Gaussian => "gaussian",
            Self::Error => "error",
            Self::Patches => "patches",
            Self::Net => "net",
        }
    }
}

/// What picture is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Pixels a row. 16 to 8192.
    pub width: u32,
    /// Rows. 16 to 8192.
    pub height: u32,
    /// From where.
    pub view: View,
    /// In which colours.
    pub style: Style,
    /// Pairs of a black and a white stripe that [`Style::Zebra`] reflects, from pole to pole of
    /// the studio. 1 to 200.
    pub stripes: u32,
    /// Ends of the legend, in its unit; `None`: a range that 98 % of the sampled values keep.
    pub range: Option<[f64; 2]>,
}

impl Default for Options {
    fn default() -> Self {
        let view = View::default();
        Self { width: 1280, height: 720, view, style: Style::default(), stripes: 8, range: None }
    }
}

const MIN_SIDE: u32 = 16;
const MAX_SIDE: u32 = 8192;
/// More are finer than pixels nearly everywhere.
const MAX_STRIPES: u32 = 200;
/// Height at which lines and letters have their nominal size.
const NOMINAL_HEIGHT: f64 = 720.0;

impl Options {
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let (width, height, min, max) = (self.width, self.height, MIN_SIDE, MAX_SIDE);
        let sides = min..=max;
        if !(sides.contains(&width) && sides.contains(&height)) {
            return Err(RenderError::Size { width, height, min, max });
        }
        let stripes = self.stripes;
        if !(1..=MAX_STRIPES).contains(&stripes) {
            return Err(RenderError::Stripes { stripes, max: MAX_STRIPES });
        }
        Ok(())
    }

    /// By how much lines are wider than in a picture of 720 rows; at least 1.
    pub(crate) fn line_scale(&self) -> f64 {
        (f64::from(self.height) / NOMINAL_HEIGHT).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_out_of_range_are_refused() {
        for (width, height) in [(15, 720), (1280, 8193), (0, 0)] {
            let refused = Options { width, height, ..Options::default() }.check().unwrap_err();
            assert!(refused.to_string().contains(&format!("{width} by {height}")));
        }
        assert!(Options { width: 16, height: 8192, ..Options::default() }.check().is_ok());
        assert!(Options { stripes: 0, ..Options::default() }.check().is_err());
    }
}
