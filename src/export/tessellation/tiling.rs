//! A triangular face whose edges are cut into different numbers of segments, as triangles.
//!
//! Inside is a regular grid; three strips join it to the edges, of as many steps together as the
//! level says. Where all edges have as many segments as the level the whole is the regular grid,
//! and where one edge is whole there may be no inner points at all.

use isospline_geometry::bezier_triangle::{exponents, index, n_control};

/// Height of the strips, in quarters of a row of the grid. Where the points of an edge and of the
/// grid do not stand by turns triangles lean, which in a full row makes the squares of their circles
/// 1.3 times as large as in the grid: it would have to be finer for their sake.
const STRIP: usize = 3;

/// What a point of a face lies on; steps are counted from the corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Corner(usize),
    Edge {
        corner: usize,
        step: usize,
    },
    /// A point of the grid, and its place among the inner ones.
    Inner {
        exponents: [usize; 3],
        slot: usize,
    },
}

/// Points and triangles of a face; triangles name places, counter-clockwise.
#[derive(Clone, Debug)]
pub(super) struct Tiling {
    pub(super) places: Vec<Place>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// What determines the tiling of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    /// Segments of the edges from each corner to the next.
    pub(super) segments: [usize; 3],
    /// Three more than the steps a side of the grid of the inner points; 0 where there are none and
    /// one edge is whole.
    pub(super) level: usize,
}

impl Shape {
    pub(super) fn n_inner(&self) -> usize {
        if self.level < 3 { 0 } else { n_control(self.level - 3) }
    }

    pub(super) fn n_triangles(&self) -> usize {
        // Every triangulation of a disc has as many for its points: 2 inside + border - 2.
        2 * self.n_inner() + self.segments.iter().sum::<usize>() - 2
    }

    /// Barycentric coordinates of the inner points, in storage order.
    pub(super) fn inner(self) -> impl Iterator<Item = [f64; 3]> {
        self.inner_places().map(move |place| self.at(place))
    }

    /// Barycentric coordinates of a place.
    pub(super) fn at(&self, place: Place) -> [f64; 3] {
        let mut at = [0.0; 3];
        match place {
            Place::Corner(corner) => at[corner] = 1.0,
            Place::Edge { corner, step } => {
                let n = self.segments[corner];
                at[corner] = (n - step) as f64 / n as f64;
                at[(corner + 1) % 3] = step as f64 / n as f64;
            }
            Place::Inner { exponents, .. } if self.is_grid() => {
                at = exponents.map(|x| x as f64 / self.level as f64);
            }
            Place::Inner { exponents, .. } => {
                let span = span(self.level) as f64;
                at = exponents.map(|x| (4 * (x - 1) + STRIP) as f64 / span);
            }
        }
        at
    }

    /// Whether the whole is the regular grid.
    fn is_grid(&self) -> bool {
        self.segments == [self.level; 3]
    }

    pub(super) fn tiling(self) -> Tiling {
        if self.is_grid() {
            let places = self.grid_places().collect();
            let triangles = grid_triangles(self.level).map(|t| t.map(|q| q as u32)).collect();
            return Tiling { places, triangles };
        }
        let mut tiling = Tiling { places: Vec::new(), triangles: Vec::new() };
        let rows = [0, 1, 2].map(|corner| self.row(corner));
        tiling.places.extend((0..3).map(Place::Corner));
        for corner in 0..3 {
            let steps = 1..self.segments[corner];
            tiling.places.extend(steps.map(|step| Place::Edge { corner, step }));
        }
        if self.level == 0 {
            tiling.fan(&rows);
        } else {
            tiling.fill(self.level, &rows);
        }
        tiling
    }

    /// All points of the regular grid, in storage order, where the edges have as many segments.
    pub(super) fn grid_places(self) -> impl Iterator<Item = Place> {
        let n = self.level;
        let mut n_inner = 0;
        exponents(n).map(move |e| {
            if let Some(corner) = (0..3).find(|&c| e[c] == n) {
                return Place::Corner(corner);
            }
            if let Some(opposite) = (0..3).find(|&c| e[c] == 0) {
                let corner = (opposite + 1) % 3;
                return Place::Edge { corner, step: e[(corner + 1) % 3] };
            }
            n_inner += 1;
            Place::Inner { exponents: e, slot: n_inner - 1 }
        })
    }

    fn inner_places(self) -> impl Iterator<Item = Place> {
        // The inner points of a grid are ordered like a grid of three steps fewer.
        let inner = (self.level >= 3).then(|| exponents(self.level - 3)).into_iter().flatten();
        inner.enumerate().map(|(slot, e)| Place::Inner { exponents: e.map(|x| x + 1), slot })
    }

    /// Points along the edge from a corner to the next, as indices of places.
    fn row(&self, corner: usize) -> Vec<u32> {
        let before: usize = self.segments[..corner].iter().map(|n| n - 1).sum();
        let first = 3 + before;
        let inside = first..first + self.segments[corner] - 1;
        let ends = [corner, (corner + 1) % 3];
        let all = [ends[0]].into_iter().chain(inside).chain([ends[1]]);
        all.map(|place| place as u32).collect()
    }
}

impl Tiling {
    /// No inner points: from the corner opposite to a whole edge, the other two are zipped.
    fn fan(&mut self, rows: &[Vec<u32>; 3]) {
        let whole = rows.iter().position(|row| row.len() == 2);
        let whole = whole.expect("invariant: a face without inner points has a whole edge");
        let left = &rows[(whole + 2) % 3];
        let right: Vec<u32> = rows[(whole + 1) % 3].iter().rev().copied().collect();
        self.triangles.push([left[0], left[1], right[1]]);
        let middles = |n: usize| move |k: usize| (2 * k + 1, 2 * n);
        let (of_left, of_right) = (middles(left.len() - 1), middles(right.len() - 1));
        self.zip([&left[1..], &right[1..]], |s, t| is_before(of_left(s + 1), of_right(t + 1)));
    }

    /// The inner grid of a level, and a strip between it and each edge.
    fn fill(&mut self, level: usize, rows: &[Vec<u32>; 3]) {
        let first = self.places.len() as u32;
        let shape = Shape { segments: [0; 3], level };
        self.places.extend(shape.inner_places());
        let side = level - 3;
        if side > 0 {
            let shifted = grid_triangles(side).map(|t| t.map(|q| first + q as u32));
            self.triangles.extend(shifted);
        }
        let inner = |corner: usize, step: usize| {
            let mut e = [0; 3];
            e[corner] = side - step;
            e[(corner + 1) % 3] = step;
            first + index(e) as u32
        };
        let is_cut = [0, 1, 2].map(|corner| self.cut(corner, rows, inner(corner, 0), level));
        for (corner, outer) in rows.iter().enumerate() {
            let n = outer.len() - 1;
            let start = usize::from(is_cut[corner]);
            let outer = &outer[start..=n - usize::from(is_cut[(corner + 1) % 3])];
            let inner: Vec<u32> = (0..=side).map(|step| inner(corner, step)).collect();
            // Along the edge, an inner point of step t stands at (4 t + 3/2 STRIP) / span.
            self.zip([outer, &inner], |s, t| {
                is_before((2 * (s + start) + 1, 2 * n), (8 * t + 4 + 3 * STRIP, 2 * span(level)))
            });
        }
    }

    /// Cuts a corner off as the regular grid does, where both of its edges have points inside:
    /// an edge from the corner inward would be the longest of all.
    fn cut(&mut self, corner: usize, rows: &[Vec<u32>; 3], inner: u32, level: usize) -> bool {
        let (after, before) = (&rows[corner], &rows[(corner + 2) % 3]);
        // The cut meets the innermost point where the two numbers of segments, as many strips, make
        // the span; there should be room for a triangle between them.
        let is_clear = 3 * STRIP * (after.len() + before.len() - 2) >= 4 * span(level);
        if after.len() == 2 || before.len() == 2 || !is_clear {
            return false;
        }
        let (next, last) = (after[1], before[before.len() - 2]);
        self.triangles.extend([[after[0], next, last], [next, inner, last]]);
        true
    }

    /// Triangles between two rows of points, the first on the right hand going along; the first
    /// row goes on where `first_next` of the steps done says so.
    fn zip(&mut self, [a, b]: [&[u32]; 2], first_next: impl Fn(usize, usize) -> bool) {
        let (mut s, mut t) = (0, 0);
        while s + 1 < a.len() || t + 1 < b.len() {
            let can = [s + 1 < a.len(), t + 1 < b.len()];
            if can[0] && (!can[1] || first_next(s, t)) {
                self.triangles.push([a[s], a[s + 1], b[t]]);
                s += 1;
            } else {
                self.triangles.push([a[s], b[t + 1], b[t]]);
                t += 1;
            }
        }
    }
}

/// The denominator of the inner points: rows of the grid and three strips, in quarters of a row.
fn span(level: usize) -> usize {
    4 * (level - 3) + 3 * STRIP
}

/// Whether one fraction is not above another.
fn is_before((a, b): (usize, usize), (c, d): (usize, usize)) -> bool {
    a * d <= c * b
}

/// Grid indices of the `n^2` small triangles: those that point as the patch does, then the others.
fn grid_triangles(n: usize) -> impl Iterator<Item = [usize; 3]> {
    let upright = exponents(n - 1)
        .map(|[i, j, k]| [index([i + 1, j, k]), index([i, j + 1, k]), index([i, j, k + 1])]);
    let inverted = (n > 1).then(|| exponents(n - 2)).into_iter().flatten().map(|[i, j, k]| {
        [index([i + 1, j + 1, k]), index([i, j + 1, k + 1]), index([i + 1, j, k + 1])]
    });
    upright.chain(inverted)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area of a triangle in barycentric coordinates, of that of the face.
    fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
        let [p, q] = [b, c].map(|x| [x[1] - a[1], x[2] - a[2]]);
        p[0] * q[1] - p[1] * q[0]
    }

    #[test]
    fn tilings_cover_the_face_once_with_every_point_on_it() {
        for segments in
            [[1, 1, 1], [2, 1, 1], [1, 3, 2], [1, 1, 7], [2, 2, 2], [3, 5, 4], [9, 2, 2]]
        {
            let whole = segments.contains(&1).then_some(0);
            let grid = (segments == [segments[0]; 3]).then_some(segments[0]);
            for level in whole.into_iter().chain(grid).chain([3, 4, 5, 9]) {
                let shape = Shape { segments, level };
                let Tiling { places, triangles } = shape.tiling();
                assert_eq!(triangles.len(), shape.n_triangles(), "{shape:?}");
                assert_eq!(places.len(), segments.iter().sum::<usize>() + shape.n_inner());
                let areas = triangles.iter().map(|t| area(t.map(|q| shape.at(places[q as usize]))));
                let areas: Vec<f64> = areas.collect();
                assert!(areas.iter().all(|&a| a > 1e-9), "{shape:?}: {areas:?}");
                assert!((areas.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{shape:?}");
                let mut used: Vec<u32> = triangles.concat();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), places.len(), "{shape:?}");
            }
        }
    }
}
