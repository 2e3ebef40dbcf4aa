//! Quality of the base triangles.

use crate::surface::Surface;
use isospline_geometry::Vec3;

/// The least quality of a face; not-a-number if one has no size.
pub(crate) fn least(surface: &Surface<'_>) -> f64 {
    let of_face = |face: &[u32; 3]| quality(face.map(|v| surface.vertices()[v as usize]));
    let keep_least = |least: f64, q: f64| if q >= least { least } else { q };
    surface.faces().iter().map(of_face).fold(1.0, keep_least)
}

/// `4 sqrt(3) area / (sum of squared sides)`: 1 if equilateral, 0 if flat.
fn quality([a, b, c]: [Vec3; 3]) -> f64 {
    let sides_sq = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
    2.0 * 3f64.sqrt() * (b - a).cross(&(c - a)).norm() / sides_sq
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_equilateral_triangle_has_quality_one_and_a_flat_one_none() {
        let apex = |x, y| [Vec3::zeros(), Vec3::x(), Vec3::new(x, y, 0.0)];
        assert!((quality(apex(0.5, 0.75f64.sqrt())) - 1.0).abs() < 1e-15);
        // Right-angled: area 1/2, squared sides 1 + 1 + 2.
        assert!((quality(apex(0.0, 1.0)) - 0.75f64.sqrt()).abs() < 1e-15);
        assert!(quality(apex(0.3, 0.0)) <= 0.0);
    }
}
