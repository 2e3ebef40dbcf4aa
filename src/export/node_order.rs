//! The order of points in a triangle that VTK and Gmsh share.

use isospline_geometry::bezier_triangle::index;

/// Storage indices of the points of a triangle: corners, inner points of the edges 0 to 1, 1 to 2
/// and 2 to 0, then the triangle inside by the same rule.
pub(crate) fn corners_edges_inside(degree: usize) -> Vec<usize> {
    let mut out = Vec::new();
    let mut ring = 0;
    while degree >= 3 * ring {
        // Each ring is the border of a triangle of degree `n` whose exponents start at `ring`.
        let n = degree - 3 * ring;
        let lift = |e: [usize; 3]| index(e.map(|x| x + ring));
        if n == 0 {
            out.push(lift([0; 3]));
            break;
        }
        out.extend((0..3).map(|corner| lift(on_border(n, corner, 0))));
        for corner in 0..3 {
            out.extend((1..n).map(|s| lift(on_border(n, corner, s))));
        }
        ring += 1;
    }
    out
}

/// Exponents `s` steps from `corner` towards the next one, degree `n`.
fn on_border(n: usize, corner: usize, s: usize) -> [usize; 3] {
    let mut e = [0; 3];
    e[corner] = n - s;
    e[(corner + 1) % 3] = s;
    e
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::n_control;

    #[test]
    fn every_point_is_named_once() {
        for degree in 1..=8 {
            let mut order = corners_edges_inside(degree);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..n_control(degree)), "degree {degree}");
        }
    }

    #[test]
    fn corners_come_first_and_the_middle_last() {
        let order = corners_edges_inside(7);
        assert_eq!(order[..5], [0, 28, 35, index([6, 1, 0]), index([5, 2, 0])]);
        assert_eq!(order[21..24], [[5, 1, 1], [1, 5, 1], [1, 1, 5]].map(index));
        assert_eq!(order[33..], [[3, 2, 2], [2, 3, 2], [2, 2, 3]].map(index));
        assert_eq!(corners_edges_inside(3).last(), Some(&index([1, 1, 1])));
    }
}
