//! What the field says at the vertices of the fine mesh.

use isospline_geometry::{Mat3, TriangleMesh, Vec3};
use isospline_implicit::field::full;
use isospline_implicit::{Field, Jet2};
use isospline_stage::{Host, map};

/// Points evaluated at once.
const BLOCK: usize = 1024;

/// Outward unit normal and curvature of each vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceData {
    /// Unit normals: of the field, or of the faces where the field has none.
    pub(crate) normals: Vec<Vec3>,
    /// `sqrt(k1^2 + k2^2)` [1/length], 0 where it is not a finite number.
    pub(crate) curvatures: Vec<f64>,
}

impl SurfaceData {
    /// Evaluates `field` at all vertices of `mesh`, on the host's threads.
    pub(crate) fn of(field: &dyn Field, host: &dyn Host, mesh: &TriangleMesh) -> Self {
        let n = mesh.positions.len();
        let mut data = Self { normals: Vec::with_capacity(n), curvatures: Vec::with_capacity(n) };
        let empty = Jet2 { value: 0.0, gradient: Vec3::zeros(), hessian: [0.0; 6] };
        let blocks: Vec<&[Vec3]> = mesh.positions.chunks(BLOCK).collect();
        let found = map(host, blocks.len(), |k| {
            let mut jets = vec![empty; blocks[k].len()];
            field.hessians(blocks[k], &mut jets);
            jets.iter().map(normal_and_curvature).collect::<Vec<_>>()
        });
        for (normal, curvature) in found.into_iter().flatten() {
            data.normals.push(normal);
            data.curvatures.push(curvature);
        }
        if data.normals.iter().any(|n| n.x.is_nan()) {
            data.fill_from_faces(mesh);
        }
        data
    }

    /// Singular points get the mean normal of their faces.
    fn fill_from_faces(&mut self, mesh: &TriangleMesh) {
        let mut sums = vec![Vec3::zeros(); mesh.positions.len()];
        for f in 0..mesh.faces.len() as u32 {
            let [a, b, c] = mesh.corners(f);
            for v in mesh.faces[f as usize] {
                sums[v as usize] += (b - a).cross(&(c - a));
            }
        }
        for (normal, sum) in self.normals.iter_mut().zip(&sums) {
            if normal.x.is_nan() {
                *normal = sum.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
            }
        }
    }
}

/// NaN normal where the gradient is zero or not finite.
fn normal_and_curvature(jet: &Jet2) -> (Vec3, f64) {
    let length = jet.gradient.norm();
    let normal = jet.gradient / length;
    if !(length > 0.0 && length.is_finite()) {
        return (Vec3::new(f64::NAN, f64::NAN, f64::NAN), 0.0);
    }
    let tangential = Mat3::identity() - normal * normal.transpose();
    let shape = tangential * full(&jet.hessian) * tangential / length;
    let curvature = shape.norm();
    (normal, if curvature.is_finite() { curvature } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;

    #[test]
    fn a_sphere_of_radius_two_bends_by_a_half_in_both_directions() {
        let field = ClosureField::new(4.0, |p: Vec3| p.norm_squared() - 4.0)
            .with_gradient(|p| 2.0 * p)
            .with_hessian(|_| [2.0, 0.0, 0.0, 2.0, 0.0, 2.0]);
        let positions = vec![Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 1.2, -1.6)];
        let mesh = TriangleMesh { positions, faces: Vec::new() };
        let data = SurfaceData::of(&field, &Serial, &mesh);
        for (p, (n, k)) in mesh.positions.iter().zip(data.normals.iter().zip(&data.curvatures)) {
            assert!((n - p / 2.0).norm() < 1e-15);
            assert!((k - 0.5f64.sqrt()).abs() < 1e-14);
        }
    }

    #[test]
    fn a_singular_vertex_takes_the_normal_of_its_faces() {
        let field =
            ClosureField::new(1.0, |p: Vec3| p.z * p.z).with_gradient(|p| 2.0 * p.z * Vec3::z());
        let positions = vec![Vec3::zeros(), Vec3::x(), Vec3::y()];
        let mesh = TriangleMesh { positions, faces: vec![[0, 1, 2]] };
        let data = SurfaceData::of(&field, &Serial, &mesh);
        assert_eq!(data.normals, [Vec3::z(); 3]);
        assert_eq!(data.curvatures, [0.0; 3]);
    }
}
