//! How far the curve of an edge will be from the surface, before it is fitted.

use crate::vertex::Vertex;
use isospline_fitting::shape::apply;
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Jet1};

/// Parameters at which a curve is compared with the surface; its error is near
/// `t^3 (1 - t)^3 (e0 + e1 t + ..)`, largest about the middle.
const PARAMETERS: [f64; 3] = [0.3, 0.5, 0.7];

/// Largest distance from the surface of the quartic between each pair of vertices, in model units;
/// infinite where the field is not finite.
///
/// The quartic has position, tangent plane and normal curvature of the surface at both ends and
/// passes near a point of the surface above the middle: what the network stage fits, without its
/// iteration. Four gradient evaluations an edge.
pub(crate) fn curve_errors(field: &dyn Field, edges: &[[&Vertex; 2]]) -> Vec<f64> {
    let middles: Vec<Vec3> = edges.iter().map(middle_of_cubic).collect();
    let middles = one_newton_step(field, middles);
    let curves = edges.iter().zip(middles).map(|(ends, middle)| quartic(ends, middle));
    let points: Vec<Vec3> =
        curves.flat_map(|curve| PARAMETERS.map(|t| point_of_quartic(&curve, t))).collect();
    let distance = |jet: &Jet1| {
        let distance = jet.value.abs() / jet.gradient.norm();
        if distance.is_nan() { f64::INFINITY } else { distance }
    };
    let jets = gradients(field, &points);
    jets.chunks(PARAMETERS.len()).map(|c| c.iter().map(distance).fold(0.0, f64::max)).collect()
}

fn gradients(field: &dyn Field, points: &[Vec3]) -> Vec<Jet1> {
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    field.gradients(points, &mut jets);
    jets
}

fn one_newton_step(field: &dyn Field, mut points: Vec<Vec3>) -> Vec<Vec3> {
    let jets = gradients(field, &points);
    for (p, jet) in points.iter_mut().zip(&jets) {
        *p -= jet.value / jet.gradient.norm_squared() * jet.gradient;
    }
    points
}

/// Unit tangents at both ends along the chord, and the chord's length.
fn tangents([p, q]: &[&Vertex; 2]) -> ([Vec3; 2], f64) {
    let chord = q.position - p.position;
    let along = |v: &Vertex| (chord - v.normal * v.normal.dot(&chord)).normalize();
    ([along(p), along(q)], chord.norm())
}

fn middle_of_cubic(ends: &[&Vertex; 2]) -> Vec3 {
    let ([t0, t1], length) = tangents(ends);
    0.5 * (ends[0].position + ends[1].position) + length / 8.0 * (t0 - t1)
}

/// Control points of the quartic; `middle` is a point of the surface near its parameter 1/2.
fn quartic(ends: &[&Vertex; 2], middle: Vec3) -> [Vec3; 5] {
    // symbols (lengths over the chord's): l0, l1 tangent lengths, k0, k1 normal curvatures,
    // n0, n1 normals; constraints r0 = 4 l0^2 k0 - 3 (q2 - q0) n0, r1 likewise [TK, Eq. (9b)]
    let ([t0, t1], length) = tangents(ends);
    let [q0, q4] = ends.map(|v| v.position);
    let [n0, n1] = ends.map(|v| v.normal);
    let k0 = length * apply(&ends[0].shape, &t0, &t0);
    let k1 = length * apply(&ends[1].shape, &t1, &t1);
    let (mut l0, mut l1) = (0.25, 0.25);
    let (q1, q3) = (q0 + l0 * length * t0, q4 - l1 * length * t1);
    let mut q2 = (16.0 * middle - q0 - 4.0 * q1 - 4.0 * q3 - q4) / 6.0;
    for _ in 0..3 {
        let r0 = 4.0 * l0 * l0 * k0 - 3.0 * (q2 - q0).dot(&n0) / length;
        let r1 = 4.0 * l1 * l1 * k1 - 3.0 * (q2 - q4).dot(&n1) / length;
        let (j0, j1) = (8.0 * l0 * k0, 8.0 * l1 * k1);
        // Least-norm step; the 1e-6 holds where both constraints say the same.
        let (a, b, d) = (9.0 + j0 * j0 + 1e-6, 9.0 * n0.dot(&n1), 9.0 + j1 * j1 + 1e-6);
        let det = a * d - b * b;
        let (y0, y1) = ((d * r0 - b * r1) / det, (a * r1 - b * r0) / det);
        l0 = (l0 - j0 * y0).clamp(0.1, 0.6);
        l1 = (l1 - j1 * y1).clamp(0.1, 0.6);
        q2 += 3.0 * length * (y0 * n0 + y1 * n1);
    }
    [q0, q0 + l0 * length * t0, q2, q4 - l1 * length * t1, q4]
}

fn point_of_quartic(q: &[Vec3; 5], t: f64) -> Vec3 {
    let s = 1.0 - t;
    let (s2, t2) = (s * s, t * t);
    s2 * s2 * q[0]
        + 4.0 * s2 * s * t * q[1]
        + 6.0 * s2 * t2 * q[2]
        + 4.0 * s * t2 * t * q[3]
        + t2 * t2 * q[4]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vertex::vertices_at;
    use isospline_implicit::ClosureField;

    #[test]
    fn on_a_sphere_the_error_falls_with_the_sixth_power_of_the_angle() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        let error = |angle: f64| {
            let ends = [Vec3::x(), Vec3::new(angle.cos(), angle.sin(), 0.0)];
            let v = vertices_at(&field, &ends).unwrap();
            curve_errors(&field, &[[&v[0], &v[1]]])[0]
        };
        let ratio = error(0.8) / error(0.4);
        assert!(error(0.4) < 1e-5 && error(0.4) > 1e-9, "{}", error(0.4));
        assert!((30.0..140.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_straight_edge_in_a_plane_has_no_error() {
        let field = ClosureField::new(1.0, |p: Vec3| p.z).with_gradient(|_| Vec3::z());
        let field = field.with_hessian(|_| [0.0; 6]);
        let v = vertices_at(&field, &[Vec3::zeros(), Vec3::new(1.0, 2.0, 0.0)]).unwrap();
        assert!(curve_errors(&field, &[[&v[0], &v[1]]])[0] < 1e-16);
    }
}
