//! Part of the picture: which patch each of its samples sees, and about where on the patch.

use crate::camera::{Camera, Projected};
use crate::patch::Patch;

/// Pixels a side of a tile: its samples stay in a core's cache.
pub(crate) const TILE: usize = 64;
/// Samples a side of a pixel.
pub(crate) const SAMPLES: usize = 4;
/// Samples a side of a tile.
pub(crate) const SIDE: usize = TILE * SAMPLES;

/// Distance, in pixels, that the triangles of a patch may be off it by the bound of its bend: what a
/// silhouette is off at most. The bound is several times what is found.
pub(crate) const CHORD: f64 = 0.1;
/// Pixels by which a triangle is farther where only its reach has the sample: more than surfaces
/// but those seen edge on fall back over the reach.
const SET_BACK: f64 = 10.0 * CHORD;
/// Most steps a side of a patch: a patch as large as the largest picture needs 130.
const MAX_STEPS: usize = 256;

/// What one sample sees: a place in the list of patches, or nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Nearness of the triangle.
    pub(crate) nearness: f64,
    /// Place in the tile's list of patches; [`NOTHING`].
    pub(crate) patch: u32,
    /// Whether its inner side is seen.
    pub(crate) is_back: bool,
    /// Barycentrics v and w.
    pub(crate) at: [f32; 2],
}

/// No patch.
pub(crate) const NOTHING: u32 = u32::MAX;

/// The samples of one tile.
#[derive(Debug)]
pub(crate) struct Tile {
    /// Pixel of the upper left corner.
    pub(crate) corner: [usize; 2],
    seen: Vec<Seen>,
}

/// A triangle at a sample.
#[derive(Clone, Copy, Debug)]
struct Offer {
    place: u32,
    is_back: bool,
    corners: [Corner; 3],
    /// Barycentrics of the sample in the picture; below 0 in the reach of an edge.
    shares: [f64; 3],
}

/// A corner of a triangle: its picture and its place on the patch.
#[derive(Clone, Copy, Debug)]
struct Corner {
    picture: Projected,
    at: [f64; 2],
}

impl Tile {
    pub(crate) fn new(corner: [usize; 2]) -> Self {
        let nothing =
            Seen { nearness: f64::NEG_INFINITY, patch: NOTHING, is_back: false, at: [0.0; 2] };
        Self { corner, seen: vec![nothing; SIDE * SIDE] }
    }

    /// What sample `i` of row `j` sees.
    pub(crate) fn seen(&self, i: usize, j: usize) -> &Seen {
        &self.seen[j * SIDE + i]
    }

    /// Place of a sample in the picture, pixels.
    ///
    /// The grid of samples is turned by a slope of a quarter, so that the sixteen samples of a
    /// pixel have sixteen columns and rows: edges along the axes get sixteen shades, not four.
    pub(crate) fn place(&self, i: usize, j: usize) -> [f64; 2] {
        let (x, y) = (i % SAMPLES, j % SAMPLES);
        let shift = |other: usize| (other as f64 - 1.5) / (SAMPLES * SAMPLES) as f64;
        [
            self.corner[0] as f64 + (i as f64 + 0.5) / SAMPLES as f64 + shift(y),
            self.corner[1] as f64 + (j as f64 + 0.5) / SAMPLES as f64 - shift(x),
        ]
    }

    /// Rows or columns of samples whose places may lie from `lo` to `hi` pixels, `axis` 0 for
    /// columns.
    pub(crate) fn span(&self, axis: usize, lo: f64, hi: f64) -> std::ops::Range<usize> {
        let base = self.corner[axis] as f64;
        // A sample is off the plain grid by less than half a step.
        let from = ((lo - base) * SAMPLES as f64 - 1.0).floor().clamp(0.0, SIDE as f64);
        let to = ((hi - base) * SAMPLES as f64 + 1.0).ceil().clamp(from, SIDE as f64);
        from as usize..to as usize
    }

    /// Enters the triangles of a patch.
    pub(crate) fn enter(&mut self, camera: &Camera, place: u32, patch: &Patch) {
        let n = steps(camera, patch);
        let row = |r: usize| -> Vec<Corner> {
            (0..=r)
                .map(|k| {
                    let at = [(r - k) as f64 / n as f64, k as f64 / n as f64];
                    Corner { picture: camera.project(&patch.jet(at).point), at }
                })
                .collect()
        };
        let mut above = row(0);
        for r in 1..=n {
            let below = row(r);
            for k in 0..r {
                self.triangle(camera, place, [above[k], below[k], below[k + 1]]);
                if k + 1 < r {
                    self.triangle(camera, place, [above[k], below[k + 1], above[k + 1]]);
                }
            }
            above = below;
        }
    }

    /// Enters one triangle; corners counter-clockwise from outside.
    ///
    /// Front sides reach [`CHORD`] beyond their edges, so that neighbours cut into other steps
    /// leave no gap; back sides do not, or they would show along silhouettes.
    fn triangle(&mut self, camera: &Camera, place: u32, corners: [Corner; 3]) {
        let [a, b, c] = corners.map(|corner| corner.picture.at);
        let doubled = cross(a, b, c);
        if !(doubled.is_finite() && doubled.abs() > 1e-300) {
            return;
        }
        // Rows count downwards, so what runs counter-clockwise in space runs clockwise here.
        let is_back = doubled > 0.0;
        let reach = if is_back { 0.0 } else { CHORD };
        let slack = [[b, c], [c, a], [a, b]].map(|[p, q]| {
            let length = ((q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1])).sqrt();
            reach * length / doubled.abs()
        });
        let bounds = |k: usize| {
            let (lo, hi) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            self.span(k, lo - reach, hi + reach)
        };
        let (columns, rows) = (bounds(0), bounds(1));
        for j in rows {
            for i in columns.clone() {
                let p = self.place(i, j);
                let first = cross(p, b, c) / doubled;
                let second = cross(p, c, a) / doubled;
                let shares = [first, second, 1.0 - first - second];
                let is_near = |k: usize| shares[k] >= -slack[k];
                if is_near(0) && is_near(1) && is_near(2) && within(p, shares, [a, b, c]) {
                    self.offer(camera, j * SIDE + i, Offer { place, is_back, corners, shares });
                }
            }
        }
    }

    /// Notes a triangle at a sample if nothing nearer is there.
    fn offer(&mut self, camera: &Camera, sample: usize, offer: Offer) {
        let Offer { place: patch, is_back, corners, shares } = offer;
        let in_reach = shares.iter().any(|&share| share < 0.0);
        let shares = shares.map(|share| share.max(0.0));
        let sum = shares[0] + shares[1] + shares[2];
        let weigh = |values: [f64; 3]| {
            (shares[0] * values[0] + shares[1] * values[1] + shares[2] * values[2]) / sum
        };
        let mut nearness = weigh(corners.map(|corner| corner.picture.nearness));
        if in_reach {
            // A neighbour that has the sample within its edges goes first.
            nearness = camera.farther(nearness, SET_BACK);
        }
        if nearness > self.seen[sample].nearness {
            let weights = corners.map(|corner| corner.picture.weight);
            let weight = weigh(weights);
            let at = [0, 1].map(|k| {
                let values = [0, 1, 2].map(|c| weights[c] * corners[c].at[k]);
                (weigh(values) / weight) as f32
            });
            self.seen[sample] = Seen { nearness, patch, is_back, at };
        }
    }
}

/// Whether a place in the reach of all three edges is not far beyond a sharp corner, where their
/// reaches meet far out.
fn within(place: [f64; 2], shares: [f64; 3], corners: [[f64; 2]; 3]) -> bool {
    if shares.iter().all(|&share| share >= 0.0) {
        return true;
    }
    let shares = shares.map(|share| share.max(0.0));
    let sum = shares[0] + shares[1] + shares[2];
    let off = |axis: usize| {
        let inside: f64 = (0..3).map(|k| shares[k] * corners[k][axis]).sum();
        inside / sum - place[axis]
    };
    let (x, y) = (off(0), off(1));
    x * x + y * y <= 4.0 * CHORD * CHORD
}

/// Steps a side at which the triangles of a patch are within [`CHORD`] of it.
fn steps(camera: &Camera, patch: &Patch) -> usize {
    let n = (patch.bend() * camera.largest_scale() / (8.0 * CHORD)).sqrt().ceil();
    // Not a number counts as one step.
    n.clamp(1.0, MAX_STEPS as f64).max(1.0) as usize
}

/// Twice the area of a triangle of the picture; positive where it runs clockwise in the picture.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_samples_of_a_pixel_have_sixteen_columns_and_rows() {
        let tile = Tile::new([128, 64]);
        for axis in 0..2 {
            let mut all: Vec<f64> = (0..SAMPLES * SAMPLES)
                .map(|s| tile.place(4 + s % SAMPLES, 8 + s / SAMPLES)[axis])
                .collect();
            all.sort_by(f64::total_cmp);
            let pixel = [129.0, 66.0][axis];
            for (n, x) in all.iter().enumerate() {
                assert!((x - pixel - (n as f64 + 0.5) / 16.0).abs() < 1e-12, "{all:?}");
            }
        }
    }

    #[test]
    fn a_span_holds_every_sample_within_it() {
        let tile = Tile::new([64, 0]);
        let (lo, hi) = (70.3, 70.9);
        let span = tile.span(0, lo, hi);
        for i in 0..SIDE {
            for j in 0..SAMPLES {
                let x = tile.place(i, j)[0];
                assert!(!(lo..=hi).contains(&x) || span.contains(&i), "{i} {x}");
            }
        }
        assert!(tile.span(0, 500.0, 600.0).is_empty() && tile.span(0, -9.0, 3.0).is_empty());
    }
}
