//! Quadric error of a vertex.

use isospline_geometry::Vec3;

/// `Q(x) = x^T A x + 2 b x + c`: weighted squared distances to planes and points [GH97, Sec. 4].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Quadric {
    /// `A` as `[xx, xy, xz, yy, yz, zz]`.
    a: [f64; 6],
    b: Vec3,
    c: f64,
}

impl Quadric {
    /// `weight` times the squared distance to the plane through `point` with unit `normal`.
    pub(crate) fn plane(normal: &Vec3, point: &Vec3, weight: f64) -> Self {
        let n = weight * normal;
        let d = -normal.dot(point);
        let a = [
            n.x * normal.x,
            n.x * normal.y,
            n.x * normal.z,
            n.y * normal.y,
            n.y * normal.z,
            n.z * normal.z,
        ];
        Self { a, b: d * n, c: weight * d * d }
    }

    /// `weight` times the squared distance to `point`.
    pub(crate) fn point(point: &Vec3, weight: f64) -> Self {
        let a = [weight, 0.0, 0.0, weight, 0.0, weight];
        Self { a, b: -weight * point, c: weight * point.norm_squared() }
    }

    /// The sum of two errors.
    #[inline]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mut a = self.a;
        for (x, y) in a.iter_mut().zip(&other.a) {
            *x += y;
        }
        Self { a, b: self.b + other.b, c: self.c + other.c }
    }

    /// `Q(x)`, zero if rounding makes it negative.
    #[inline]
    pub(crate) fn error(&self, x: &Vec3) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let ax = Vec3::new(
            xx * x.x + xy * x.y + xz * x.z,
            xy * x.x + yy * x.y + yz * x.z,
            xz * x.x + yz * x.y + zz * x.z,
        );
        (x.dot(&ax) + 2.0 * self.b.dot(x) + self.c).max(0.0)
    }

    /// The point of least error by Cholesky; `None` if `A` is not safely positive definite.
    #[inline]
    pub(crate) fn minimum(&self) -> Option<Vec3> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        // A pivot below this part of the trace is rounding, not shape.
        let floor = 1e-12 * (xx + yy + zz);
        let l21 = xy / xx;
        let l31 = xz / xx;
        let d2 = yy - l21 * xy;
        let l32 = (yz - l31 * xy) / d2;
        let d3 = zz - l31 * xz - l32 * (yz - l31 * xy);
        if !(xx > floor && d2 > floor && d3 > floor) {
            return None;
        }
        let y1 = -self.b.x;
        let y2 = -self.b.y - l21 * y1;
        let y3 = -self.b.z - l31 * y1 - l32 * y2;
        let z = y3 / d3;
        let y = y2 / d2 - l32 * z;
        Some(Vec3::new(y1 / xx - l21 * y - l31 * z, y, z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_where_the_error_is_least() {
        let corner = Vec3::new(0.5, -1.0, 2.0);
        let normals = [Vec3::x(), Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.6, -0.8)];
        let sum = normals
            .iter()
            .map(|n| Quadric::plane(n, &corner, 2.0))
            .reduce(|p, q| p.plus(&q))
            .unwrap();
        assert!((sum.minimum().unwrap() - corner).norm() < 1e-14);
        assert!(sum.error(&corner) < 1e-14);
        let off = corner + normals[0];
        let expected = normals.iter().map(|n| 2.0 * n.dot(&normals[0]).powi(2)).sum::<f64>();
        assert!((sum.error(&off) - expected).abs() < 1e-13);
    }

    #[test]
    fn one_plane_alone_has_no_single_minimum_until_a_point_joins() {
        let plane = Quadric::plane(&Vec3::z(), &Vec3::z(), 1.0);
        assert_eq!(plane.minimum(), None);
        let joined = plane.plus(&Quadric::point(&Vec3::new(3.0, 4.0, 1.0), 1e-3));
        assert!((joined.minimum().unwrap() - Vec3::new(3.0, 4.0, 1.0)).norm() < 1e-9);
    }
}
