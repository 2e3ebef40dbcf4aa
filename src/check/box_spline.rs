//! A surface for tests that owes nothing to the solvers: a quartic box spline on a torus.
//!
//! A regular triangle mesh of the torus is the control mesh of the three-direction quartic box
//! spline, which is piecewise polynomial, exactly C2, and can interpolate the torus at its knots.

use crate::surface::{Net, Surface};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{exponents, index};
use isospline_implicit::ClosureField;

const MAJOR: f64 = 2.0;
const MINOR: f64 = 0.8;

/// The torus `(sqrt(x^2 + y^2) - 2)^2 + z^2 = 0.64`, as a distance field.
pub(crate) fn torus() -> ClosureField {
    ClosureField::new(6.0, |p: Vec3| {
        let rho = p.xy().norm() - MAJOR;
        (rho * rho + p.z * p.z).sqrt() - MINOR
    })
    .with_gradient(|p: Vec3| {
        let radius = p.xy().norm();
        let rho = radius - MAJOR;
        let slope = 1.0 / (rho * rho + p.z * p.z).sqrt();
        slope * Vec3::new(rho * p.x / radius, rho * p.y / radius, p.z)
    })
}

/// A grid of knots, `n` around the axis and `m` around the tube.
pub(crate) struct Knots {
    n: usize,
    m: usize,
    points: Vec<Vec3>,
}

impl Knots {
    /// The surface through torus points: `2 n m` patches.
    pub(crate) fn surface(n: usize, m: usize) -> Surface<'static> {
        let targets = Self { n, m, points: torus_points(n, m) };
        let control = targets.interpolated();
        let (mut faces, mut nets) = (Vec::new(), Vec::new());
        for i in 0..n as isize {
            for j in 0..m as isize {
                for corners in
                    [[(i, j), (i + 1, j), (i + 1, j + 1)], [(i, j), (i + 1, j + 1), (i, j + 1)]]
                {
                    faces.push(corners.map(|(i, j)| targets.slot(i, j) as u32));
                    nets.push(control.net(corners));
                }
            }
        }
        let mut vertices = targets.points;
        // Corners and shared curves are computed once and copied, as the product's are.
        agree_in_bits(&mut vertices, &faces, &mut nets);
        Surface::new(vertices, faces, nets).unwrap()
    }

    fn slot(&self, i: isize, j: isize) -> usize {
        let (i, j) = (i.rem_euclid(self.n as isize), j.rem_euclid(self.m as isize));
        i as usize * self.m + j as usize
    }

    fn at(&self, i: isize, j: isize) -> Vec3 {
        self.points[self.slot(i, j)]
    }

    /// Control points whose box spline passes through `self` at the knots:
    /// `c/2 + (sum of six neighbours)/12` has eigenvalues in [1/4, 1], so repeated correction
    /// converges by 3/4 a step.
    fn interpolated(&self) -> Self {
        let mut control = Self { n: self.n, m: self.m, points: self.points.clone() };
        for _ in 0..160 {
            let errors: Vec<Vec3> = (0..self.n as isize)
                .flat_map(|i| (0..self.m as isize).map(move |j| (i, j)))
                .map(|(i, j)| {
                    self.at(i, j) - control.blend((i, j), (1, 0), [12.0, 2.0, 2.0, 2.0, 2.0])
                })
                .collect();
            for (c, e) in control.points.iter_mut().zip(&errors) {
                *c += e;
            }
        }
        control
    }

    /// `(w0 c + w1 (n0) + w2 (n1 + n5) + w3 (n2 + n4) + w4 n3) / 24` with the six neighbours of
    /// knot `c` counted counter-clockwise from direction `towards`.
    fn blend(&self, (i, j): (isize, isize), towards: (isize, isize), w: [f64; 5]) -> Vec3 {
        const RING: [(isize, isize); 6] = [(1, 0), (1, 1), (0, 1), (-1, 0), (-1, -1), (0, -1)];
        let start = RING.iter().position(|&d| d == towards).unwrap();
        let weights = [w[1], w[2], w[3], w[4], w[3], w[2]];
        let mut sum = w[0] * self.at(i, j);
        for (k, weight) in weights.into_iter().enumerate() {
            let (di, dj) = RING[(start + k) % 6];
            sum += weight * self.at(i + di, j + dj);
        }
        sum / 24.0
    }

    /// Bézier net of the box spline over one triangle of knots.
    fn net(&self, corners: [(isize, isize); 3]) -> Net {
        let mut quartic = [Vec3::zeros(); 15];
        let step = |a: (isize, isize), b: (isize, isize)| (b.0 - a.0, b.1 - a.1);
        for c in 0..3 {
            let (a, b, d) = (corners[c], corners[(c + 1) % 3], corners[(c + 2) % 3]);
            let mut put = |at_a: usize, at_b: usize, at_d: usize, p: Vec3| {
                let mut e = [0; 3];
                (e[c], e[(c + 1) % 3], e[(c + 2) % 3]) = (at_a, at_b, at_d);
                quartic[index(e)] = p;
            };
            put(4, 0, 0, self.blend(a, step(a, b), [12.0, 2.0, 2.0, 2.0, 2.0]));
            put(3, 1, 0, self.blend(a, step(a, b), [12.0, 4.0, 3.0, 1.0, 0.0]));
            put(3, 0, 1, self.blend(a, step(a, d), [12.0, 4.0, 3.0, 1.0, 0.0]));
            let opposite = (a.0 + b.0 - d.0, a.1 + b.1 - d.1);
            let wings = self.at(d.0, d.1) + self.at(opposite.0, opposite.1);
            put(2, 2, 0, (8.0 * (self.at(a.0, a.1) + self.at(b.0, b.1)) + 4.0 * wings) / 24.0);
            put(2, 1, 1, self.inner(a, b, d));
        }
        raise_to_septic(&quartic)
    }

    /// `(10 a + 6 b + 6 d + the two outer wings at a) / 24`.
    fn inner(&self, a: (isize, isize), b: (isize, isize), d: (isize, isize)) -> Vec3 {
        let wing = |p: (isize, isize), q: (isize, isize)| self.at(a.0 + p.0 - q.0, a.1 + p.1 - q.1);
        let main = 10.0 * self.at(a.0, a.1) + 6.0 * (self.at(b.0, b.1) + self.at(d.0, d.1));
        (main + wing(b, d) + wing(d, b)) / 24.0
    }
}

fn torus_points(n: usize, m: usize) -> Vec<Vec3> {
    let turn = |k: usize, n: usize| std::f64::consts::TAU * k as f64 / n as f64;
    let point = |phi: f64, theta: f64| {
        let radius = MAJOR + MINOR * libm::cos(theta);
        Vec3::new(radius * libm::cos(phi), radius * libm::sin(phi), MINOR * libm::sin(theta))
    };
    (0..n).flat_map(|i| (0..m).map(move |j| point(turn(i, n), turn(j, m)))).collect()
}

/// Raises a quartic Bézier triangle to degree 7, one degree at a time:
/// `b_ijk = (i b_(i-1)jk + j b_i(j-1)k + k b_ij(k-1)) / n`.
fn raise_to_septic(quartic: &[Vec3; 15]) -> Net {
    let mut net = quartic.to_vec();
    for n in 5..=7 {
        net = exponents(n)
            .map(|e| {
                let mut sum = Vec3::zeros();
                for c in (0..3).filter(|&c| e[c] > 0) {
                    let mut lower = e;
                    lower[c] -= 1;
                    sum += e[c] as f64 * net[index(lower)];
                }
                sum / n as f64
            })
            .collect();
    }
    net.try_into().unwrap()
}

/// Copies the lower face's shared control points to its neighbours and the vertices to corners.
fn agree_in_bits(vertices: &mut [Vec3], faces: &[[u32; 3]], nets: &mut [Net]) {
    use isospline_geometry::bezier_triangle::boundary_index;
    use std::collections::BTreeMap;
    let mut curves: BTreeMap<(u32, u32), [Vec3; 8]> = BTreeMap::new();
    for (face, net) in faces.iter().zip(nets) {
        for corner in 0..3 {
            let (a, b) = (face[corner], face[(corner + 1) % 3]);
            let mut curve: [Vec3; 8] = std::array::from_fn(|s| net[boundary_index(7, corner, s)]);
            (curve[0], curve[7]) = (vertices[a as usize], vertices[b as usize]);
            if let Some(known) = curves.get(&(b, a)) {
                curve = *known;
                curve.reverse();
            }
            curves.insert((a, b), curve);
            for (s, p) in curve.into_iter().enumerate() {
                net[boundary_index(7, corner, s)] = p;
            }
        }
    }
}
