//! Components that are smaller than wanted are left out.

use isospline_geometry::{Aabb, TriangleMesh};
use isospline_stage::Counters;

/// The mesh without components whose box has a diagonal below `drop_below` times that of all, if
/// there are any; counts them.
pub(crate) fn without(
    mesh: &TriangleMesh,
    drop_below: f64,
    counters: &mut Counters,
) -> Option<TriangleMesh> {
    if drop_below <= 0.0 {
        return None;
    }
    let opposite = mesh.opposites().expect("invariant: the mesh is a manifold");
    let of_face = mesh.face_components(&opposite);
    let mut boxes: Vec<Aabb> = Vec::new();
    for (face, &component) in mesh.faces.iter().zip(&of_face) {
        // Components are numbered as they are met.
        if component as usize == boxes.len() {
            boxes.push(Aabb::EMPTY);
        }
        let part = &mut boxes[component as usize];
        *part = face.iter().fold(*part, |part, &v| part.including(&mesh.positions[v as usize]));
    }
    let least = drop_below * mesh.bounds().diagonal();
    let is_small: Vec<bool> = boxes.iter().map(|part| part.diagonal() < least).collect();
    let n_small = is_small.iter().filter(|&&small| small).count();
    if n_small == 0 {
        return None;
    }
    counters.count("dropped_components", n_small as u64);
    let faces = mesh.faces.iter().zip(&of_face);
    let kept =
        faces.filter(|&(_, &part)| !is_small[part as usize]).map(|(&face, _)| face).collect();
    Some(compacted(mesh, kept))
}

/// The mesh of these faces, with their vertices alone, in the order they had.
fn compacted(mesh: &TriangleMesh, mut faces: Vec<[u32; 3]>) -> TriangleMesh {
    let mut is_used = vec![false; mesh.positions.len()];
    faces.iter().flatten().for_each(|&v| is_used[v as usize] = true);
    let mut positions = Vec::new();
    let mut new = vec![0; mesh.positions.len()];
    for (v, &position) in mesh.positions.iter().enumerate().filter(|&(v, _)| is_used[v]) {
        new[v] = positions.len() as u32;
        positions.push(position);
    }
    for v in faces.iter_mut().flatten() {
        *v = new[*v as usize];
    }
    TriangleMesh { positions, faces }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::Vec3;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    /// Tetrahedra of these sizes.
    fn tetrahedra(sizes: &[f64]) -> TriangleMesh {
        let corners = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
        let mut mesh = TriangleMesh::default();
        for (k, size) in sizes.iter().enumerate() {
            mesh.faces.extend(TETRAHEDRON.map(|face| face.map(|v| v + 4 * k as u32)));
            mesh.positions.extend(corners.map(|p| p * *size));
        }
        mesh
    }

    #[test]
    fn small_components_are_left_out_and_counted() {
        let mut counters = Counters::default();
        let left = without(&tetrahedra(&[0.1, 1.0, 0.02]), 0.05, &mut counters).unwrap();
        assert_eq!(left, tetrahedra(&[0.1, 1.0]));
        assert_eq!(counters.counts.get("dropped_components"), Some(&1));
    }

    #[test]
    fn zero_keeps_all() {
        let mesh = tetrahedra(&[1.0, 1e-9]);
        assert_eq!(without(&mesh, 0.0, &mut Counters::default()), None);
    }
}
