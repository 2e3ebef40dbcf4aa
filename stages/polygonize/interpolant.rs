//! The piece of the mesh in a tetrahedron as a linear function, and plain tests of it; eight
//! tetrahedra side by side, for wide vectors.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::complex::{Complex, EDGES, Tetrahedron};
use isospline_geometry::Vec3;
use isospline_implicit::Interval;

/// Tetrahedra side by side.
pub(crate) const LANES: usize = 8;
/// A number of each of them.
pub(crate) type Row = [f64; LANES];
/// A vector of each.
pub(crate) type Rows = [Row; 3];

/// Margin for the rounding of the interpolant, relative to the terms that are summed.
pub(crate) const ROUNDING: f64 = 1e-10;

/// The linear interpolants L of the node values on eight tetrahedra T.
#[derive(Clone, Debug)]
pub(crate) struct Octet {
    /// Positions and values of the four corners.
    corners: [Rows; 4],
    values: [Row; 4],
    /// Gradients of the barycentrics of corners 1, 2, 3.
    barycentric: [Rows; 3],
    /// Gradient of L.
    pub(crate) gradient: Rows,
    /// Least and largest node value.
    pub(crate) least: Row,
    pub(crate) most: Row,
}

impl Octet {
    /// What is to be [filled](Self::fill).
    pub(crate) const EMPTY: Self = Self {
        corners: [[[0.0; LANES]; 3]; 4],
        values: [[0.0; LANES]; 4],
        barycentric: [[[0.0; LANES]; 3]; 3],
        gradient: [[0.0; LANES]; 3],
        least: [0.0; LANES],
        most: [0.0; LANES],
    };

    /// Makes it that of up to eight tetrahedra of a complex; idle lanes hold the last.
    #[inline(always)]
    pub(crate) fn fill(&mut self, complex: &Complex, tetrahedra: &[Tetrahedron]) {
        for i in 0..LANES {
            let t = &tetrahedra[i.min(tetrahedra.len() - 1)];
            for (k, &node) in t.iter().enumerate() {
                let at = complex.point(node);
                self.values[k][i] = complex.value(node);
                for axis in 0..3 {
                    self.corners[k][axis][i] = at[axis];
                }
            }
        }
        self.complete();
    }

    /// Gradients and bounds from corners and values.
    #[inline(always)]
    fn complete(&mut self) {
        let ([o, p, q, r], values) = (&self.corners, &self.values);
        for i in 0..LANES {
            let side = |end: &Rows| [0, 1, 2].map(|k| end[k][i] - o[k][i]);
            let [a, b, c] = [side(p), side(q), side(r)];
            let normals = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
            let volume = dot(&normals[2], &c);
            let mut gradient = [0.0; 3];
            for (k, normal) in normals.iter().enumerate() {
                let rise = values[k + 1][i] - values[0][i];
                for axis in 0..3 {
                    let slope = normal[axis] / volume;
                    self.barycentric[k][axis][i] = slope;
                    gradient[axis] += rise * slope;
                }
            }
            for axis in 0..3 {
                self.gradient[axis][i] = gradient[axis];
            }
            let [f0, f1, f2, f3] = [0, 1, 2, 3].map(|k| values[k][i]);
            self.least[i] = f0.min(f1).min(f2).min(f3);
            self.most[i] = f0.max(f1).max(f2).max(f3);
        }
    }

    /// Edges of a tetrahedron, as places of their ends, with where L vanishes on them.
    pub(crate) fn crossings(&self, i: usize) -> impl Iterator<Item = ((usize, usize), Vec3)> + '_ {
        let edges = if (self.least[i] < 0.0) == (self.most[i] < 0.0) { &[] } else { &EDGES[..] };
        edges.iter().filter_map(move |&(a, b)| {
            let (f, g) = (self.values[a][i], self.values[b][i]);
            if (f < 0.0) == (g < 0.0) {
                return None;
            }
            let place = f / (f - g);
            let corner = |k: usize| {
                let [x, y, z] = &self.corners[k];
                Vec3::new(x[i], y[i], z[i])
            };
            let (from, to) = (corner(a), corner(b));
            place.is_finite().then(|| ((a, b), from + place * (to - from)))
        })
    }

    /// Gradient of L on one tetrahedron.
    pub(crate) fn gradient_of(&self, i: usize) -> Vec3 {
        let [x, y, z] = &self.gradient;
        Vec3::new(x[i], y[i], z[i])
    }

    /// `grad L . g > 0` on a tetrahedron for all `g` of the enclosure.
    pub(crate) fn is_transversal(&self, i: usize, enclosure: &[Interval; 3]) -> bool {
        let (mut least, mut size) = (0.0, 0.0);
        for (g, slope) in self.gradient_of(i).iter().zip(enclosure) {
            least += (g * slope.lo).min(g * slope.hi);
            size += g.abs() * slope.lo.abs().max(slope.hi.abs());
        }
        // Unbounded or unknown slopes prove nothing.
        least > ROUNDING * size && enclosure.iter().all(|i| i.lo.is_finite() && i.hi.is_finite())
    }

    /// `f`, enclosed by `value`, and `L` are both positive or both negative on what the box
    /// shares with a tetrahedron.
    pub(crate) fn has_sign_of(&self, i: usize, value: Interval, [middle, radius]: &Frame) -> bool {
        if value.may_be_zero() {
            return false;
        }
        let center = self.at(i, middle);
        let rounding = ROUNDING * self.least[i].abs().max(self.most[i].abs());
        let spread = self.gradient_of(i).abs().dot(&Vec3::from(*radius)) + rounding;
        // On T the interpolant also stays between the node values.
        let (lo, hi) = ((center - spread).max(self.least[i]), (center + spread).min(self.most[i]));
        (value.lo > 0.0 && lo > 0.0) || (value.hi < 0.0 && hi < 0.0)
    }

    /// The linear function of a tetrahedron at any place.
    #[inline(always)]
    pub(crate) fn at(&self, i: usize, place: &[f64; 3]) -> f64 {
        let offset = [0, 1, 2].map(|k| place[k] - self.corners[0][k][i]);
        self.values[0][i] + dot(&[0, 1, 2].map(|k| self.gradient[k][i]), &offset)
    }

    /// Those that a box does not meet, as a set of bits: a barycentric is negative on all of it.
    #[inline(always)]
    pub(crate) fn beside(&self, [middle, radius]: &Frame) -> u64 {
        let mut most = [0.0; LANES];
        for i in 0..LANES {
            let offset = [0, 1, 2].map(|k| middle[k] - self.corners[0][k][i]);
            let slope = |b: &Rows| [b[0][i], b[1][i], b[2][i]];
            let [p, q, r] = &self.barycentric;
            let (b1, b2, b3) = (slope(p), slope(q), slope(r));
            let b0 = [0, 1, 2].map(|k| -(b1[k] + b2[k] + b3[k]));
            let reach = |constant: f64, slope: &[f64; 3]| {
                constant + dot(slope, &offset) + dot(&slope.map(f64::abs), radius)
            };
            let reach = [reach(1.0, &b0), reach(0.0, &b1), reach(0.0, &b2), reach(0.0, &b3)];
            most[i] = reach[0].min(reach[1]).min(reach[2]).min(reach[3]);
        }
        set_of(&most.map(|most| most < -ROUNDING))
    }
}

/// The middle of a box, and half its sides.
pub(crate) type Frame = [[f64; 3]; 2];

/// The places of what is true, as bits.
#[inline(always)]
pub(crate) fn set_of(row: &[bool; LANES]) -> u64 {
    let mut set = 0;
    for (i, &is_member) in row.iter().enumerate() {
        set |= u64::from(is_member) << i;
    }
    set
}

/// From x to z, as that of a [`Vec3`].
#[inline(always)]
pub(crate) fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use isospline_geometry::Aabb;
    use isospline_implicit::ClosureField;
    use isospline_stage::{Ctx, Serial};

    /// The six tetrahedra of a unit cell with `f = x + 2 y - z - 1/4`.
    fn octet() -> (Octet, Vec<[Vec3; 4]>) {
        let domain = Aabb::new(Vec3::zeros(), Vec3::repeat(2.0));
        let field = ClosureField::new(1.0, |p: Vec3| p.x + 2.0 * p.y - p.z - 0.25);
        let ctx = Ctx { field: &field, domain, host: &Serial };
        let complex = Complex::new(&ctx, Grid::new(domain, 2, 3), &[[0, 0, 0]]).unwrap();
        let tetrahedra: Vec<Tetrahedron> = complex.tetrahedra(0).collect();
        let mut octet = Octet::EMPTY;
        octet.fill(&complex, &tetrahedra);
        (octet, tetrahedra.iter().map(|t| t.map(|n| complex.point(n))).collect())
    }

    #[test]
    fn a_linear_field_is_its_own_interpolant_in_every_lane() {
        let (octet, tetrahedra) = octet();
        for i in 0..LANES {
            assert!((octet.gradient_of(i) - Vec3::new(1.0, 2.0, -1.0)).norm() < 1e-14);
            assert!((octet.at(i, &[0.5, 0.25, 1.0]) + 0.25).abs() < 1e-14);
            // Idle lanes hold the last.
            let corners = tetrahedra[i.min(5)];
            let value = |p: &Vec3| p.x + 2.0 * p.y - p.z - 0.25;
            let least = corners.iter().map(value).reduce(f64::min).unwrap();
            let most = corners.iter().map(value).reduce(f64::max).unwrap();
            assert!((octet.least[i] - least).abs() < 1e-14 && (octet.most[i] - most).abs() < 1e-14);
            for (_, at) in octet.crossings(i) {
                assert!(value(&at).abs() < 1e-14, "{at}");
            }
        }
        assert!((0..6).all(|i| octet.crossings(i).count() >= 3));
    }

    #[test]
    fn a_box_meets_the_tetrahedra_that_hold_its_middle_and_is_beside_those_far_off() {
        let (octet, tetrahedra) = octet();
        for (i, corners) in tetrahedra.iter().enumerate() {
            let middle: Vec3 = 0.25 * corners.iter().sum::<Vec3>();
            let beside = |radius: f64| octet.beside(&[middle.into(), [radius; 3]]) & 0x3f;
            // A small box about the middle of one meets it alone, a large one all.
            assert_eq!(beside(1e-3), 0x3f & !(1 << i));
            assert_eq!(beside(0.5), 0);
        }
    }
}
