//! Control nets as ink over the samples of a tile.

use crate::camera::{Camera, Projected};
use crate::color::Light;
use crate::tile::{NOTHING, SIDE, Tile};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, exponents, index};

/// What is drawn over a sample, later ones over earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Mark {
    None,
    /// A line between control points off the border.
    Inner,
    /// A line of the border.
    Border,
    /// A control point.
    Point,
}

impl Mark {
    pub(crate) fn color(self) -> Light {
        match self {
            Self::None => Light::WHITE,
            Self::Inner => Light([0.10, 0.22, 0.55]),
            Self::Border => Light([0.02, 0.02, 0.03]),
            Self::Point => Light([0.70, 0.05, 0.03]),
        }
    }
}

/// Half widths of lines and of points, pixels.
const LINE: f64 = 0.5;
const BORDER_LINE: f64 = 0.75;
const POINT: f64 = 1.9;
/// Most of the length of the lines that a point may be wide to either side: small nets stay nets.
const POINT_PART: f64 = 0.17;
/// What a net reaches beyond its control points, pixels at the nominal size.
pub(crate) const REACH: f64 = 2.0;

/// Part of the radius by which ink is nearer than it is: nets touch the patch at its corners.
const LIFT: f64 = 2e-3;

/// Ink over the samples of a tile.
#[derive(Debug)]
pub(crate) struct Ink {
    marks: Vec<Mark>,
    line_scale: f64,
}

impl Ink {
    pub(crate) fn new(line_scale: f64) -> Self {
        Self { marks: vec![Mark::None; SIDE * SIDE], line_scale }
    }

    pub(crate) fn mark(&self, i: usize, j: usize) -> Mark {
        self.marks[j * SIDE + i]
    }

    /// Draws a net where nothing in the tile hides it.
    pub(crate) fn draw(&mut self, camera: &Camera, tile: &Tile, net: &[Vec3; N_CONTROL]) {
        let points = net.map(|p| camera.project(&p));
        // symbols: length of the mean line of the net, in the picture
        let length = |[a, b]: [[usize; 3]; 2]| {
            let (a, b) = (points[index(a)].at, points[index(b)].at);
            ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])).sqrt()
        };
        let mean = lines().map(length).sum::<f64>() / lines().count() as f64;
        let point = (POINT * self.line_scale).min(POINT_PART * mean);
        let shrunk = point / POINT;
        for [a, b] in lines() {
            // Both ends have the same zero exponent: the line lies on a side of the net.
            let is_border = (0..3).any(|c| a[c] == 0 && b[c] == 0);
            let (mark, half) =
                if is_border { (Mark::Border, BORDER_LINE) } else { (Mark::Inner, LINE) };
            let ends = [points[index(a)], points[index(b)]];
            self.stroke(camera, tile, ends, mark, half * shrunk);
        }
        for p in points {
            self.stroke(camera, tile, [p, p], Mark::Point, point);
        }
    }

    /// A line with round ends.
    fn stroke(
        &mut self,
        camera: &Camera,
        tile: &Tile,
        [a, b]: [Projected; 2],
        mark: Mark,
        half: f64,
    ) {
        let span = |k: usize| {
            let (lo, hi) = (a.at[k].min(b.at[k]), a.at[k].max(b.at[k]));
            tile.span(k, lo - half, hi + half)
        };
        let along = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
        let length_sq = along[0] * along[0] + along[1] * along[1];
        if !length_sq.is_finite() {
            return;
        }
        let columns = span(0);
        for j in span(1) {
            for i in columns.clone() {
                let place = tile.place(i, j);
                let off = [place[0] - a.at[0], place[1] - a.at[1]];
                // A point has no length, and the quotient is not a number.
                let t = (off[0] * along[0] + off[1] * along[1]) / length_sq;
                let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
                let [x, y] = [off[0] - t * along[0], off[1] - t * along[1]];
                let nearness = a.nearness + t * (b.nearness - a.nearness);
                let seen = tile.seen(i, j);
                let is_free =
                    seen.patch == NOTHING || camera.lifted(nearness, LIFT) >= seen.nearness;
                if x * x + y * y <= half * half && is_free {
                    let slot = &mut self.marks[j * SIDE + i];
                    *slot = (*slot).max(mark);
                }
            }
        }
    }
}

/// The lines of a net, each once, by the exponents of their ends.
fn lines() -> impl Iterator<Item = [[usize; 3]; 2]> {
    exponents(DEGREE - 1).flat_map(|[i, j, k]| {
        let [a, b, c] = [[i + 1, j, k], [i, j + 1, k], [i, j, k + 1]];
        [[a, b], [b, c], [c, a]]
    })
}
