//! The legend of a picture: a bar of colours with numbers, and what they are.

use crate::canvas::{Canvas, LINE_HEIGHT};
use crate::scale::number;
use crate::shader::Values;
use crate::style::Style;

/// Pixels that a legend takes off the width, at single size.
const WIDTH: usize = 152;
/// A picture of less than as many legends has none: it would be all legend.
const LEAST_WIDTHS: usize = 3;
/// Rows from which letters are twice as large.
const DOUBLE_FROM: usize = 1440;

/// Pixels on the right of a picture of this size that a legend takes; 0 if it has none.
pub(crate) fn width(style: Style, width: usize, height: usize) -> usize {
    let wanted = WIDTH * size(height);
    let is_wanted = matches!(style, Style::Curvature | Style::Gaussian | Style::Error);
    if is_wanted && width >= LEAST_WIDTHS * wanted { wanted } else { 0 }
}

/// What the values are, line by line.
fn title(style: Style, unit: &str) -> Vec<String> {
    match style {
        Style::Curvature => {
            vec!["mean curvature".to_owned(), format!("1/{unit}"), "(convex < 0)".to_owned()]
        }
        Style::Gaussian => vec!["Gaussian".to_owned(), format!("curvature 1/{unit}^2")],
        _ => ["distance from", "the surface", "/ diagonal"].map(str::to_owned).to_vec(),
    }
}

/// Draws the legend at the right side; `unit` names the unit of length.
pub(crate) fn draw(canvas: &mut Canvas, values: &Values, style: Style, unit: &str) {
    let scale = size(canvas.height());
    let line = LINE_HEIGHT * scale;
    let left = canvas.width() - WIDTH * scale;
    let bar = Bar {
        left,
        width: 18 * scale,
        top: canvas.height() / 4,
        height: canvas.height() / 2,
        scale,
    };
    let title = title(style, unit);
    let above = bar.top.saturating_sub(line * title.len() + line / 2);
    for (row, text) in title.iter().enumerate() {
        canvas.write(left, above + row * line, scale, text);
    }
    bar.draw(canvas, values);
    let below = bar.top + bar.height + line / 2;
    let [least, most] = values.extent.map(number);
    canvas.write(left, below, scale, &format!("least {least}"));
    canvas.write(left, below + line, scale, &format!("most  {most}"));
}

fn size(height: usize) -> usize {
    if height >= DOUBLE_FROM { 2 } else { 1 }
}

/// Where the colours stand, pixels.
struct Bar {
    left: usize,
    width: usize,
    top: usize,
    height: usize,
    scale: usize,
}

impl Bar {
    fn draw(&self, canvas: &mut Canvas, values: &Values) {
        for row in 0..self.height {
            let place = 1.0 - (row as f64 + 0.5) / self.height as f64;
            let color = values.ramp.at(place).to_screen();
            for x in 0..self.width {
                canvas.put(self.left + x, self.top + row, color);
            }
        }
        for tick in values.scale.ticks() {
            let row = ((1.0 - tick.place) * (self.height - 1) as f64 + 0.5) as usize;
            for x in 0..6 * self.scale {
                canvas.put(self.left + self.width + x, self.top + row, [60; 3]);
            }
            let half = LINE_HEIGHT * self.scale / 2;
            let y = (self.top + row).saturating_sub(half);
            canvas.write(self.left + self.width + 10 * self.scale, y, self.scale, &tick.label);
        }
    }
}
