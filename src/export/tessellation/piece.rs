//! Pieces of patches and curves as nets of their own, and how far those are from what replaces
//! them.
//!
//! The distance to a convex set is a convex function. So no point of a piece is farther from its
//! triangle, or its segment, than the farthest of its control points: a bound that holds for
//! every point, and comes within some 15 % of the truth for a piece that is nearly quadratic. Where
//! that is too much by little, the piece is cut into six and an arc into two, whose points are
//! four times as near to it.

use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::raise_quartic_to_septic;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, boundary_index, exponents, index};

type Net = [Vec3; N_CONTROL];

/// Cuts pieces out of patches.
#[derive(Clone, Debug)]
pub(super) struct Cutter {
    /// Of each point of a net of degree 6, those of degree 7 that it comes from. Nets of lower
    /// degree are their starts.
    parents: Vec<[usize; 3]>,
    exponents: Vec<[usize; 3]>,
}

impl Cutter {
    pub(super) fn new() -> Self {
        let parent = |[i, j, k]: [usize; 3]| {
            [index([i + 1, j, k]), index([i, j + 1, k]), index([i, j, k + 1])]
        };
        Self {
            parents: exponents(DEGREE - 1).map(parent).collect(),
            exponents: exponents(DEGREE).collect(),
        }
    }

    /// Net of the piece between three points in barycentric coordinates: `b_ijk` is the blossom
    /// at i times the first, j times the second, k times the third.
    pub(super) fn piece(&self, net: &Net, corners: [[f64; 3]; 3]) -> Net {
        let mut piece = *net;
        let mut from_a = *net;
        for i in 0..=DEGREE {
            let mut from_b = from_a;
            for j in 0..=DEGREE - i {
                let mut rest = from_b;
                for degree in (1..=DEGREE - i - j).rev() {
                    self.reduce(&mut rest, degree, corners[2]);
                }
                piece[index([i, j, DEGREE - i - j])] = rest[0];
                if i + j < DEGREE {
                    self.reduce(&mut from_b, DEGREE - i - j, corners[1]);
                }
            }
            if i < DEGREE {
                self.reduce(&mut from_a, DEGREE - i, corners[0]);
            }
        }
        debug_assert_eq!(self.exponents.len(), piece.len());
        piece
    }

    /// A step of de Casteljau, in place: a net of `degree` becomes one of a degree less.
    fn reduce(&self, net: &mut Net, degree: usize, [u, v, w]: [f64; 3]) {
        for (q, &[a, b, c]) in self.parents[..degree * (degree + 1) / 2].iter().enumerate() {
            net[q] = u * net[a] + v * net[b] + w * net[c];
        }
    }
}

/// The three points of degree 1 that de Casteljau comes to: the tangent plane at a point.
pub(super) fn reduced_to_plane(net: &Net, [u, v, w]: [f64; 3]) -> [Vec3; 3] {
    let mut row = *net;
    for degree in (2..=DEGREE).rev() {
        for [i, j, k] in exponents(degree - 1) {
            row[index([i, j, k])] = u * row[index([i + 1, j, k])]
                + v * row[index([i, j + 1, k])]
                + w * row[index([i, j, k + 1])];
        }
    }
    [row[0], row[1], row[2]]
}

/// Control points at most this much too far off may be so by the bound alone; 14 % for quadratics.
const DOUBTFUL: f64 = 1.16;

/// Whether no point of a piece is farther than `tolerance` from the triangle of its corners.
pub(super) fn is_within(piece: &Net, tolerance: f64) -> bool {
    let corners = [0, 1, 2].map(|corner| piece[boundary_index(DEGREE, corner, 0)]);
    let off = |net: &Net| net.map(|p| p - nearest_in_triangle(p, corners));
    match reach(off(piece), tolerance) {
        Reach::Within => true,
        Reach::Beyond => false,
        Reach::Doubtful => {
            sixths(piece).iter().all(|part| reach(off(part), tolerance) == Reach::Within)
        }
    }
}

/// A piece cut from corner 2 to the middle m of the side opposite, then from m to the middles of
/// the other two sides, then across from those to the middle of the first cut: no part has a side
/// above half of the longest.
fn sixths(piece: &Net) -> [Net; 6] {
    let [left, right] = halves(piece, 0);
    let [upper_left, lower_left] = halves(&left, 2);
    let [lower_right, upper_right] = halves(&right, 1);
    let [a, b] = halves(&upper_left, 1);
    let [c, d] = halves(&upper_right, 2);
    [lower_left, lower_right, a, b, c, d]
}

/// The two pieces on either side of the cut from the middle of the edge from `corner` to the next
/// one to the third: that at `corner`, then the other. Points of one exponent of the third corner
/// are a curve, which is halved.
fn halves(net: &Net, corner: usize) -> [Net; 2] {
    let mut both = [*net, *net];
    for third in 0..DEGREE {
        let degree = DEGREE - third;
        let place = |step: usize| {
            let mut e = [third; 3];
            e[corner] = degree - step;
            e[(corner + 1) % 3] = step;
            index(e)
        };
        let mut row: [Vec3; DEGREE + 1] = std::array::from_fn(|step| net[place(step.min(degree))]);
        for done in 0..degree {
            both[0][place(done)] = row[0];
            both[1][place(degree - done)] = row[degree - done];
            for step in 0..degree - done {
                row[step] = 0.5 * (row[step] + row[step + 1]);
            }
        }
        both[0][place(degree)] = row[0];
        both[1][place(0)] = row[0];
    }
    both
}

/// How far points reach from what they are to be near to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reach {
    Within,
    Doubtful,
    Beyond,
}

fn reach<const N: usize>(distances: [Vec3; N], tolerance: f64) -> Reach {
    let farthest_sq = distances.iter().map(Vec3::norm_squared).fold(0.0, f64::max);
    let limit = |share: f64| (share * tolerance) * (share * tolerance);
    if farthest_sq <= limit(1.0) {
        Reach::Within
    } else if farthest_sq <= limit(DOUBTFUL) {
        Reach::Doubtful
    } else {
        Reach::Beyond
    }
}

/// Whether the triangle of its corners looks to the side that a piece does at each of them; a
/// corner where the piece has no normal does not count.
pub(super) fn faces_as(piece: &Net) -> bool {
    let at = |corner: usize, step: usize| piece[boundary_index(DEGREE, corner, step)];
    let [a, b, c] = [0, 1, 2].map(|corner| at(corner, 0));
    let flat = (b - a).cross(&(c - a));
    (0..3).all(|corner| {
        let start = at(corner, 0);
        let before = at((corner + 2) % 3, DEGREE - 1);
        let normal = (at(corner, 1) - start).cross(&(before - start));
        normal.dot(&flat) > 0.0 || normal.norm_squared() == 0.0
    })
}

/// Whether the arc of a curve from `t0` to `t1` stays within `tolerance` of its chord.
pub(super) fn is_arc_within(curve: &[Vec3; 5], [t0, t1]: [f64; 2], tolerance: f64) -> bool {
    let whole = arc(curve, t0, t1);
    // Points of a higher degree lie nearer to the arc: the bound falls from 33 % above to 14 %.
    let off = |part: &[Vec3; 5]| {
        let points = raise_quartic_to_septic(part);
        points.map(|p| p - nearest_in_segment(p, whole[0], whole[4]))
    };
    match reach(off(&whole), tolerance) {
        Reach::Within => true,
        Reach::Beyond => false,
        Reach::Doubtful => {
            let halves = [[0.0, 0.5], [0.5, 1.0]].map(|[t0, t1]| arc(&whole, t0, t1));
            halves.iter().all(|half| reach(off(half), tolerance) == Reach::Within)
        }
    }
}

/// Control points of an arc of a quartic: the blossom at `t0` and `t1`.
fn arc(curve: &[Vec3; 5], t0: f64, t1: f64) -> [Vec3; 5] {
    std::array::from_fn(|k| {
        let mut row = *curve;
        for step in 0..4 {
            let t = if step < k { t1 } else { t0 };
            for at in 0..4 - step {
                row[at] = (1.0 - t) * row[at] + t * row[at + 1];
            }
        }
        row[0]
    })
}

fn nearest_in_segment(p: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let along = b - a;
    let length_sq = along.norm_squared();
    if length_sq == 0.0 {
        return a;
    }
    a + ((p - a).dot(&along) / length_sq).clamp(0.0, 1.0) * along
}

/// The nearest point of a triangle: its plane's where that is inside, else that of an edge.
pub(super) fn nearest_in_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let normal = (b - a).cross(&(c - a));
    let is_inside = |from: Vec3, to: Vec3| (to - from).cross(&(p - from)).dot(&normal) >= 0.0;
    let sides = [[a, b], [b, c], [c, a]];
    if normal.norm_squared() > 0.0 && sides.iter().all(|&[from, to]| is_inside(from, to)) {
        return p - (p - a).dot(&normal) / normal.norm_squared() * normal;
    }
    let on_sides = sides.map(|[from, to]| nearest_in_segment(p, from, to));
    let nearer =
        |x: Vec3, y: Vec3| if (p - y).norm_squared() < (p - x).norm_squared() { y } else { x };
    nearer(nearer(on_sides[0], on_sides[1]), on_sides[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::{bezier_curve, bezier_triangle};

    fn net() -> Net {
        std::array::from_fn(|k| {
            let x = k as f64;
            Vec3::new(libm::sin(x), libm::cos(1.7 * x), 0.1 * x)
        })
    }

    #[test]
    fn a_piece_is_the_patch_between_its_corners() {
        let corners = [[0.5, 0.25, 0.25], [0.0, 0.9, 0.1], [0.3, 0.0, 0.7]];
        let piece = Cutter::new().piece(&net(), corners);
        for at in [[1.0, 0.0, 0.0], [0.2, 0.5, 0.3], [0.0, 0.0, 1.0]] {
            let inside: [f64; 3] =
                std::array::from_fn(|k| (0..3).map(|c| at[c] * corners[c][k]).sum());
            let expected = bezier_triangle::evaluate(DEGREE, &net(), inside);
            assert!((bezier_triangle::evaluate(DEGREE, &piece, at) - expected).norm() < 1e-13);
        }
    }

    #[test]
    fn sixths_are_the_patch_and_cover_it() {
        let evaluate = |net: &Net, at| bezier_triangle::evaluate(DEGREE, net, at);
        // Corners in the patch, a its corner 0 and so on, m the middle of ab, p that of ca.
        let [a, b, c] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let [m, p, q] = [[0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]];
        let r = [0.25, 0.25, 0.5];
        let corners = [[a, m, p], [m, b, q], [p, m, r], [p, r, c], [r, q, c], [m, q, r]];
        for (part, corners) in sixths(&net()).iter().zip(corners) {
            for at in [[1.0, 0.0, 0.0], [0.2, 0.5, 0.3], [0.0, 0.0, 1.0]] {
                let inside: [f64; 3] =
                    std::array::from_fn(|k| (0..3).map(|c| at[c] * corners[c][k]).sum());
                assert!((evaluate(part, at) - evaluate(&net(), inside)).norm() < 1e-13);
            }
        }
    }

    #[test]
    fn the_bound_of_a_paraboloid_is_4_percent_above_the_truth_at_most() {
        // Over an equilateral triangle about the origin, of corners at a distance of 1: it sinks
        // by 1 / 2. The control point of seven corners s is the mean over pairs of s . s'.
        let height = 0.75_f64.sqrt();
        let corners = [[1.0, 0.0], [-0.5, height], [-0.5, -height]];
        let mut net: Net = [Vec3::zeros(); N_CONTROL];
        for (point, e) in net.iter_mut().zip(exponents(DEGREE)) {
            let [x, y] = [0, 1].map(|k| (0..3).map(|n| e[n] as f64 * corners[n][k]).sum::<f64>());
            *point = Vec3::new(x / 7.0, y / 7.0, 0.5 * (x * x + y * y - 7.0) / 42.0);
        }
        assert!(!is_within(&net, 0.499));
        assert!(is_within(&net, 1.04 * 0.5));
        // The points of the whole do not show it.
        let top = Vec3::new(0.0, 0.0, 0.5);
        assert_eq!(reach(net.map(|p| Vec3::new(0.0, 0.0, (top - p).z)), 0.52), Reach::Doubtful);
    }

    #[test]
    fn an_arc_is_the_curve_between_its_ends() {
        let curve: [Vec3; 5] = std::array::from_fn(|k| net()[3 * k]);
        let part = arc(&curve, 0.3, 0.9);
        for t in [0.0, 0.4, 1.0] {
            let expected = bezier_curve::evaluate(&curve, 0.3 + 0.6 * t);
            assert!((bezier_curve::evaluate(&part, t) - expected).norm() < 1e-14);
        }
    }

    #[test]
    fn the_nearest_point_of_a_triangle_is_nearer_than_any_of_a_grid() {
        let corners =
            [Vec3::new(0.0, 0.0, 0.0), Vec3::new(2.0, 0.1, 0.0), Vec3::new(0.3, 1.0, 0.5)];
        for k in 0..200 {
            let x = f64::from(k);
            let p = 2.0 * Vec3::new(libm::sin(x), libm::sin(2.1 * x), libm::cos(3.3 * x));
            let found = (nearest_in_triangle(p, corners) - p).norm();
            let grid = bezier_triangle::grid(40)
                .map(|[u, v, w]| (u * corners[0] + v * corners[1] + w * corners[2] - p).norm());
            let best = grid.fold(f64::INFINITY, f64::min);
            assert!(found <= best + 1e-12 && best - found < 0.05, "{found} {best}");
        }
    }
}
