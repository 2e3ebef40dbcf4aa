//! Merging short edges: marching tetrahedra cut many slivers off the nodes near the surface.

use isospline_geometry::{EditMesh, HalfEdge, TriangleMesh, Vec3};
use isospline_implicit::{Field, Jet1};

/// Edges shorter than this are merged, of the cell side at both ends. At 0.5 more than half of
/// the triangles go and the rest are well shaped; above it, corners of thin sheets are refused
/// ever more often.
const SHORT: f64 = 0.5;
/// Least cosine between a merged face and the surface normals at its corners.
const LEAST_COSINE: f64 = 0.3;
/// Least shape of a merged face, 1 for an equilateral triangle, unless it replaces a worse one.
const LEAST_SHAPE: f64 = 0.1;

/// Merges edges shorter than half a cell side (`sides[v]` at vertex v) wherever that keeps the
/// topology (link condition) and turns no face; vertices stay where they are or go.
pub(crate) fn merge(mesh: TriangleMesh, sides: &[f64], field: &dyn Field) -> TriangleMesh {
    let normals = normals(field, &mesh.positions);
    let mut edit = EditMesh::new(mesh).expect("invariant: marching tetrahedra make a manifold");
    // A merge may free another that was refused before, say about a vertex with three faces.
    while merge_once(&mut edit, &normals, sides) > 0 {}
    edit.compact()
}

/// Tries all short edges, the shortest first; the number merged.
fn merge_once(edit: &mut EditMesh, normals: &[Vec3], sides: &[f64]) -> usize {
    let mut merged = 0;
    for (_, h) in short_edges(edit, sides) {
        // Earlier merges rename and remove: look again at what is there now.
        if !edit.is_face(h.face()) {
            continue;
        }
        let (a, b) = (edit.origin(h), edit.target(h));
        if !is_short(edit, sides, a, b) || !edit.can_collapse(h) {
            continue;
        }
        let o = edit.opposite(h).expect("invariant: the mesh is closed");
        if may_move(edit, normals, b, a) {
            edit.collapse(h);
            merged += 1;
        } else if may_move(edit, normals, a, b) {
            edit.collapse(o);
            merged += 1;
        }
    }
    merged
}

fn normals(field: &dyn Field, points: &[Vec3]) -> Vec<Vec3> {
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    for (points, out) in points.chunks(64).zip(jets.chunks_mut(64)) {
        field.gradients(points, out);
    }
    jets.iter().map(|jet| jet.gradient / jet.gradient.norm()).collect()
}

/// Short edges from the shortest up, equal ones by their half-edge.
fn short_edges(edit: &EditMesh, sides: &[f64]) -> Vec<(f64, HalfEdge)> {
    let length = |h: HalfEdge| {
        let (a, b) = (edit.origin(h), edit.target(h));
        is_short(edit, sides, a, b).then(|| (distance(edit, a, b), h))
    };
    let mut edges: Vec<_> = edit.edges().filter_map(length).collect();
    edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    edges
}

fn distance(edit: &EditMesh, a: u32, b: u32) -> f64 {
    (edit.positions[a as usize] - edit.positions[b as usize]).norm()
}

fn is_short(edit: &EditMesh, sides: &[f64], a: u32, b: u32) -> bool {
    distance(edit, a, b) < SHORT * sides[a as usize].min(sides[b as usize])
}

/// Whether the faces of `from` that remain keep their direction and shape with it moved to `to`.
fn may_move(edit: &EditMesh, normals: &[Vec3], from: u32, to: u32) -> bool {
    edit.spokes(from).all(|h| {
        let (b, c) = (edit.target(h), edit.origin(h.prev()));
        if b == to || c == to {
            return true;
        }
        let at = |v: u32| edit.positions[v as usize];
        let (old, new) = ([at(from), at(b), at(c)], [at(to), at(b), at(c)]);
        let corner_normals = [to, b, c].map(|v| normals[v as usize]);
        shape(&new) >= shape(&old).min(LEAST_SHAPE)
            && cosine(&new, &corner_normals) >= cosine(&old, &corner_normals).min(LEAST_COSINE)
    })
}

fn normal([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// Least cosine of the angles between a face and the given directions; -1 where that is not
/// known (kinks, flat faces).
fn cosine(corners: &[Vec3; 3], directions: &[Vec3; 3]) -> f64 {
    let n = normal(corners);
    let least = directions.iter().map(|d| n.dot(d) / n.norm()).fold(1.0, f64::min);
    if least.is_nan() { -1.0 } else { least }
}

/// `4 sqrt(3) area / sum of squared sides`: 1 if equilateral, 0 if flat.
fn shape(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let sides_sq = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
    // Three equal corners: as flat as can be.
    if sides_sq == 0.0 { 0.0 } else { 2.0 * 3f64.sqrt() * normal(corners).norm() / sides_sq }
}
