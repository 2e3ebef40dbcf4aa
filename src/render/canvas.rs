//! Pixels of a picture, and letters on them.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster};

/// Red, green and blue of each pixel, 0 to 255, row by row from above.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// Pixels from line to line, letters of single size.
pub(crate) const LINE_HEIGHT: usize = 19;

/// The colour of letters.
const TEXT: [u8; 3] = [30, 33, 38];

impl Canvas {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        Self { width, height, rgb: vec![255; 3 * width * height] }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    pub(crate) fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    pub(crate) fn get(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// Colours a pixel; one off the picture is passed over.
    pub(crate) fn put(&mut self, x: usize, y: usize, color: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.rgb[at..at + 3].copy_from_slice(&color);
        }
    }

    /// Writes a line from this upper left corner, letters of single or double size; what is not
    /// printable ASCII is left out.
    pub(crate) fn write(&mut self, x: usize, y: usize, scale: usize, text: &str) {
        let height = if scale > 1 { RasterHeight::Size32 } else { RasterHeight::Size16 };
        let mut left = x;
        for letter in text.chars() {
            let Some(raster) = get_raster(letter, FontWeight::Regular, height) else { continue };
            for (row, intensities) in raster.rows().enumerate() {
                for (column, &ink) in intensities.iter().enumerate() {
                    self.blend(left + column, y + row, ink);
                }
            }
            left += raster.width();
        }
    }

    fn blend(&mut self, x: usize, y: usize, ink: u8) {
        if ink == 0 || x >= self.width || y >= self.height {
            return;
        }
        let below = self.get(x, y);
        let ink = u32::from(ink);
        let mix = |k: usize| {
            ((u32::from(below[k]) * (255 - ink) + u32::from(TEXT[k]) * ink + 127) / 255) as u8
        };
        self.put(x, y, [mix(0), mix(1), mix(2)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_of_a_legend_has_its_letter() {
        for sign in "0123456789.-e/^()<>abcdefghijklmnopqrstuvwxyz G".chars() {
            let letter = |height| get_raster(sign, FontWeight::Regular, height);
            assert!(letter(RasterHeight::Size16).is_some(), "{sign}");
            assert!(letter(RasterHeight::Size32).is_some(), "{sign}");
        }
    }

    #[test]
    fn writing_beyond_the_border_is_cut_off() {
        let mut canvas = Canvas::new(20, 10);
        canvas.write(15, 5, 1, "888");
        assert!(canvas.rgb().iter().any(|&c| c < 255));
        assert_eq!(canvas.get(0, 0), [255; 3]);
    }
}
