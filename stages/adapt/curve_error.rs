//! How far the curve of an edge will be from the surface, before it is fitted.

use crate::vertex::Vertex;
use isospline_fitting::shape::apply;
use isospline_geometry::Vec3;
use isospline_geometry::linear::{cholesky, cholesky_solve, solve};
use isospline_implicit::{Field, Jet1};

/// Inner samples, at `t = 1/6 .. 5/6`: the network stage takes 15, five rank edges as well.
const N_SAMPLES: usize = 5;
/// Steps onto the curvature conditions; they converge by a digit or more a step.
const CONDITION_STEPS: u32 = 4;
/// Tangent lengths, times the chord, that a sound curve has; as in the network stage.
const LENGTH_RANGE: [f64; 2] = [0.08, 0.75];
/// Error, times the chord, of an edge without a sound curve: worse than any other.
const UNSOUND: f64 = 0.1;

/// Largest distance from the surface of the quartic between each pair of vertices, in model units.
///
/// The quartic has position, tangent plane and normal curvature of the surface at both ends and is
/// the nearest such curve to the projected chord [TK, Eq. (9)]: what the network stage will fit,
/// from fewer samples. Fifteen gradient evaluations an edge. An edge without a sound curve, or
/// near which the field is not finite, has the error `0.1 * chord` at least.
pub(crate) fn curve_errors(field: &dyn Field, edges: &[[&Vertex; 2]]) -> Vec<f64> {
    let chord_point =
        |[p, q]: &[&Vertex; 2], k: usize| p.position + parameter(k) * (q.position - p.position);
    let mut targets: Vec<Vec3> =
        edges.iter().flat_map(|e| (0..N_SAMPLES).map(move |k| chord_point(e, k))).collect();
    newton_step(field, &mut targets);
    newton_step(field, &mut targets);
    let weights: [[f64; 5]; N_SAMPLES] = std::array::from_fn(|k| bernstein_4(parameter(k)));
    let mut points = Vec::with_capacity(targets.len());
    let mut sound = Vec::with_capacity(edges.len());
    for (ends, targets) in edges.iter().zip(targets.chunks(N_SAMPLES)) {
        let curve = quartic(ends, targets, &weights);
        sound.push(curve.is_some());
        let q = curve.unwrap_or([ends[0].position; 5]);
        points.extend(weights.iter().map(|w| (0..5).map(|i| w[i] * q[i]).sum::<Vec3>()));
    }
    let jets = gradients(field, &points);
    let distances = jets.chunks(N_SAMPLES).map(|jets| {
        jets.iter().fold(0.0, |worst: f64, jet| {
            let distance = jet.value.abs() / jet.gradient.norm();
            if distance.is_finite() { worst.max(distance) } else { f64::INFINITY }
        })
    });
    let chord = |[p, q]: &[&Vertex; 2]| (q.position - p.position).norm();
    let judged = edges.iter().zip(sound).zip(distances);
    judged
        .map(
            |((ends, sound), distance)| {
                if sound && distance.is_finite() { distance } else { UNSOUND * chord(ends) }
            },
        )
        .collect()
}

fn parameter(k: usize) -> f64 {
    (k + 1) as f64 / (N_SAMPLES + 1) as f64
}

fn bernstein_4(t: f64) -> [f64; 5] {
    let s = 1.0 - t;
    let (s2, t2) = (s * s, t * t);
    [s2 * s2, 4.0 * s2 * s * t, 6.0 * s2 * t2, 4.0 * s * t2 * t, t2 * t2]
}

fn gradients(field: &dyn Field, points: &[Vec3]) -> Vec<Jet1> {
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    field.gradients(points, &mut jets);
    jets
}

fn newton_step(field: &dyn Field, points: &mut [Vec3]) {
    let jets = gradients(field, points);
    for (p, jet) in points.iter_mut().zip(&jets) {
        *p -= jet.value / jet.gradient.norm_squared() * jet.gradient;
    }
}

/// Unknowns of a curve in units of the chord: tangent lengths `l`, `m` and `q2 - q0`.
type Unknowns = [f64; 5];

/// Control points of the quartic nearest to the targets; `None` if there is no sound one.
fn quartic(
    ends: &[&Vertex; 2],
    targets: &[Vec3],
    weights: &[[f64; 5]; N_SAMPLES],
) -> Option<[Vec3; 5]> {
    // symbols: q1 = l t0, q3 = q4 - m t1, k0, k1 normal curvatures times the chord
    let [q0, q4] = ends.map(|v| v.position);
    let length = (q4 - q0).norm();
    let chord = (q4 - q0) / length;
    let tangent = |v: &Vertex| (chord - v.normal * v.normal.dot(&chord)).try_normalize(1e-6);
    let tangents = [tangent(ends[0])?, tangent(ends[1])?];
    let k = [0, 1].map(|i| length * apply(&ends[i].shape, &tangents[i], &tangents[i]));
    let local: [Vec3; N_SAMPLES] = std::array::from_fn(|i| (targets[i] - q0) / length);
    let (factor, free) = least_squares(&tangents, &chord, &local, weights)?;
    let mut x = free;
    for _ in 0..CONDITION_STEPS {
        x = onto_conditions(&factor, &free, &x, (k, [ends[0].normal, ends[1].normal], chord))?;
    }
    let in_range = |l: f64| (LENGTH_RANGE[0]..=LENGTH_RANGE[1]).contains(&l);
    let q2 = q0 + length * Vec3::new(x[2], x[3], x[4]);
    let curve = [q0, q0 + length * x[0] * tangents[0], q2, q4 - length * x[1] * tangents[1], q4];
    (in_range(x[0]) && in_range(x[1])).then_some(curve)
}

/// Factor of the normal equations and the curve nearest to the targets without conditions.
fn least_squares(
    [t0, t1]: &[Vec3; 2],
    chord: &Vec3,
    targets: &[Vec3; N_SAMPLES],
    weights: &[[f64; 5]; N_SAMPLES],
) -> Option<([[f64; 5]; 5], Unknowns)> {
    let mut a = [[0.0; 5]; 5];
    let mut b = [[0.0]; 5];
    for (w, target) in weights.iter().zip(targets) {
        let offset = target - (w[3] + w[4]) * chord;
        let (along0, along1) = (w[1] * t0, -w[3] * t1);
        a[0][0] += w[1] * w[1];
        a[1][1] += w[3] * w[3];
        a[1][0] += along0.dot(&along1);
        b[0][0] += along0.dot(&offset);
        b[1][0] += along1.dot(&offset);
        for i in 0..3 {
            a[2 + i][0] += w[2] * along0[i];
            a[2 + i][1] += w[2] * along1[i];
            a[2 + i][2 + i] += w[2] * w[2];
            b[2 + i][0] += w[2] * offset[i];
        }
    }
    let factor = cholesky(&a).ok()?;
    cholesky_solve(&factor, &mut b);
    Some((factor, b.map(|[x]| x)))
}

/// The curve nearest to the free one that meets the conditions linearised at `x`.
fn onto_conditions(
    factor: &[[f64; 5]; 5],
    free: &Unknowns,
    x: &Unknowns,
    (k, [n0, n1], chord): ([f64; 2], [Vec3; 2], Vec3),
) -> Option<Unknowns> {
    // Conditions 4 l^2 k0 = 3 q2 n0 and 4 m^2 k1 = 3 (q2 - q4) n1, with gradients g.
    let g = [
        [8.0 * x[0] * k[0], 0.0, -3.0 * n0.x, -3.0 * n0.y, -3.0 * n0.z],
        [0.0, 8.0 * x[1] * k[1], -3.0 * n1.x, -3.0 * n1.y, -3.0 * n1.z],
    ];
    let dot = |a: &Unknowns, b: &Unknowns| (0..5).map(|i| a[i] * b[i]).sum::<f64>();
    // Linearised at x: c(x) + g (y - x) with c = g x - 4 l^2 k0, so the value at `free` is:
    let at_free = [
        dot(&g[0], free) - 4.0 * x[0] * x[0] * k[0],
        dot(&g[1], free) - 4.0 * x[1] * x[1] * k[1] + 3.0 * chord.dot(&n1),
    ];
    let mut reach: [[f64; 2]; 5] = std::array::from_fn(|i| [g[0][i], g[1][i]]);
    cholesky_solve(factor, &mut reach);
    let column = |j: usize| -> Unknowns { std::array::from_fn(|i| reach[i][j]) };
    let (r0, r1) = (column(0), column(1));
    // Raised a little where both conditions say the same: both then share the load.
    let (d0, d1, mixed) = (dot(&g[0], &r0), dot(&g[1], &r1), dot(&g[0], &r1));
    let y = solve([[d0 * (1.0 + 1e-12), mixed], [mixed, d1 * (1.0 + 1e-12)]], at_free)?;
    Some(std::array::from_fn(|i| free[i] - y[0] * r0[i] - y[1] * r1[i]))
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
        assert!(error(0.4) < 1e-5 && error(0.4) > 1e-8, "{}", error(0.4));
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
