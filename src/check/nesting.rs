//! Which components lie in which, by the solid angle that their corner triangles fill.

use crate::surface::Surface;
use isospline_geometry::{Aabb, Vec3};

/// For each component, given by its faces, the number of others around it.
pub(crate) fn depths(surface: &Surface<'_>, faces_of: &[Vec<u32>]) -> Vec<u32> {
    let boxes: Vec<Aabb> = faces_of.iter().map(|faces| around(surface, faces)).collect();
    let is_in = |inner: usize, outer: usize| {
        let (a, b) = (&boxes[inner], &boxes[outer]);
        let fits = b.contains(&a.min) && b.contains(&a.max);
        let Some(at) = corner(surface, &faces_of[inner]) else { return false };
        inner != outer && fits && winding(surface, &faces_of[outer], at).abs() > 0.5
    };
    let all = 0..faces_of.len();
    all.clone().map(|i| all.clone().filter(|&o| is_in(i, o)).count() as u32).collect()
}

fn around(surface: &Surface<'_>, faces: &[u32]) -> Aabb {
    let corners = faces.iter().flat_map(|&f| surface.faces()[f as usize]);
    corners.fold(Aabb::EMPTY, |all, v| all.including(&surface.vertices()[v as usize]))
}

fn corner(surface: &Surface<'_>, faces: &[u32]) -> Option<Vec3> {
    let face = surface.faces()[*faces.first()? as usize];
    Some(surface.vertices()[face[0] as usize])
}

/// How often the corner triangles wind about a point: the sum of their solid angles
/// `2 atan2(a . (b x c), |a||b||c| + (a . b)|c| + (b . c)|a| + (c . a)|b|)`, of 4 pi.
fn winding(surface: &Surface<'_>, faces: &[u32], at: Vec3) -> f64 {
    let angle = |&f: &u32| {
        let [a, b, c] = surface.faces()[f as usize].map(|v| surface.vertices()[v as usize] - at);
        let [l, m, n] = [a, b, c].map(|side| side.norm());
        let below = l * m * n + a.dot(&b) * n + b.dot(&c) * l + c.dot(&a) * m;
        2.0 * libm::atan2(a.dot(&b.cross(&c)), below)
    };
    faces.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
