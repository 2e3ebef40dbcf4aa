//! Colours of light, and maps from values to colours.

use std::ops::{Add, AddAssign, Mul};

/// Red, green and blue light, 1 for the brightest white of the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Light(pub(crate) [f64; 3]);

impl Light {
    pub(crate) const WHITE: Self = Self([1.0; 3]);

    pub(crate) const fn grey(level: f64) -> Self {
        Self([level; 3])
    }

    /// Light of a colour as screens and files number it, 0 to 255.
    pub(crate) fn of_screen(rgb: [u8; 3]) -> Self {
        Self(rgb.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
        }))
    }

    /// The colour that a screen shows it by; what is brighter than white is white.
    pub(crate) fn to_screen(self) -> [u8; 3] {
        self.0.map(|c| {
            let c = c.clamp(0.0, 1.0);
            let code =
                if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * libm::pow(c, 1.0 / 2.4) - 0.055 };
            (255.0 * code + 0.5) as u8
        })
    }

    /// `part` of the other in place of as much of this one; 0 to 1.
    pub(crate) fn mixed(self, other: Self, part: f64) -> Self {
        self * (1.0 - part) + other * part
    }

    /// Light through a filter.
    pub(crate) fn filtered(self, filter: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] * filter.0[k]))
    }
}

impl Add for Light {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl AddAssign for Light {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Light {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|c| c * factor))
    }
}

/// Colours between which values are mixed, evenly spaced over 0 to 1.
#[derive(Clone, Debug)]
pub(crate) struct Ramp {
    stops: Vec<Light>,
}

impl Ramp {
    /// Blue below, white at the middle, red above: for values with a sign.
    pub(crate) fn diverging() -> Self {
        Self::through(&[
            [23, 56, 138],
            [59, 112, 196],
            [140, 184, 226],
            [240, 240, 238],
            [240, 168, 134],
            [205, 82, 66],
            [130, 18, 38],
        ])
    }

    /// Dark blue to yellow, brighter all the way: for sizes. Samples of the map "viridis".
    pub(crate) fn rising() -> Self {
        Self::through(&[
            [68, 1, 84],
            [70, 50, 127],
            [54, 92, 141],
            [39, 127, 142],
            [31, 161, 135],
            [74, 194, 109],
            [159, 218, 58],
            [253, 231, 37],
        ])
    }

    /// The colour at a place, 0 to 1; beyond the ends that of the end.
    pub(crate) fn at(&self, place: f64) -> Light {
        let last = self.stops.len() - 1;
        // Not a number goes to the start.
        let place = place.clamp(0.0, 1.0).max(0.0) * last as f64;
        let stop = (place as usize).min(last - 1);
        self.stops[stop].mixed(self.stops[stop + 1], place - stop as f64)
    }

    fn through(stops: &[[u8; 3]]) -> Self {
        Self { stops: stops.iter().map(|&rgb| Light::of_screen(rgb)).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_screen_colour_comes_back() {
        for c in 0..=255 {
            assert_eq!(Light::of_screen([c, 0, 255]).to_screen(), [c, 0, 255]);
        }
    }

    #[test]
    fn a_ramp_begins_and_ends_where_it_says() {
        let ramp = Ramp::rising();
        assert_eq!(ramp.at(-3.0).to_screen(), [68, 1, 84]);
        assert_eq!(ramp.at(7.0).to_screen(), [253, 231, 37]);
        assert_eq!(ramp.at(f64::NAN).to_screen(), [68, 1, 84]);
        assert_eq!(Ramp::diverging().at(0.5).to_screen(), [240, 240, 238]);
    }

    #[test]
    fn sizes_are_brighter_the_larger_they_are() {
        let ramp = Ramp::rising();
        let luminance = |place: f64| {
            let [r, g, b] = ramp.at(place).0;
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for step in 0..50 {
            let place = f64::from(step) / 50.0;
            assert!(luminance(place) < luminance(place + 0.02), "{place}");
        }
    }
}
