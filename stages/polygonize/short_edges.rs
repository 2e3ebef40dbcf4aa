//! Merging short edges: marching tetrahedra cut many slivers off the nodes near the surface.

use crate::bulk;
use isospline_geometry::{EditMesh, HalfEdge, TriangleMesh, Vec3};
use isospline_implicit::Jet1;
use isospline_stage::{Ctx, Host, Serial, map};

/// Edges shorter than this are merged, of the cell side at both ends. At 0.5 more than half of
/// the triangles go and the rest are well shaped; above it, corners of thin sheets are refused
/// ever more often.
const SHORT: f64 = 0.5;
/// Least cosine between a merged face and the surface normals at its corners.
const LEAST_COSINE: f64 = 0.3;
/// Least shape of a merged face, 1 for an equilateral triangle, unless it replaces a worse one.
const LEAST_SHAPE: f64 = 0.1;

/// Triangles a tile: the edges of a tile stay in the second-level cache, and 5 % of them are
/// left to the pass over the whole mesh.
const TILE: usize = 32_768;

/// Faces whose edges are measured in a task.
const FACES_A_TASK: usize = 4096;

/// Merges edges shorter than half a cell side (`sides[v]` at vertex v) wherever that keeps the
/// topology (link condition) and turns no face; vertices stay where they are or go.
///
/// Large meshes first tile by tile, faces in their order and vertices by a seam left alone, then
/// as a whole: by then two thirds of the triangles are gone.
pub(crate) fn merge(ctx: &Ctx<'_>, mesh: TriangleMesh, sides: Vec<f64>) -> TriangleMesh {
    let (mesh, sides) =
        if mesh.faces.len() > TILE { merge_tiles(ctx, mesh, &sides) } else { (mesh, sides) };
    let normals = normals(ctx, &mesh.positions);
    let mut edit = EditMesh::part(mesh).expect("invariant: marching tetrahedra make a manifold");
    merge_all(ctx.host, &mut edit, &normals, &sides, &[]);
    edit.compact()
}

/// The mesh with its tiles merged, and the sides of the vertices that are left.
fn merge_tiles(ctx: &Ctx<'_>, mesh: TriangleMesh, sides: &[f64]) -> (TriangleMesh, Vec<f64>) {
    let tiles: Vec<&[[u32; 3]]> = mesh.faces.chunks(TILE).collect();
    let merged = map(ctx.host, tiles.len(), |i| merge_tile(ctx, &mesh.positions, sides, tiles[i]));
    let TriangleMesh { positions, faces } = mesh;
    drop(faces);
    let mut row = vec![u32::MAX; positions.len()];
    for &v in merged.iter().flatten().flatten() {
        row[v as usize] = 0;
    }
    let mut left = (Vec::new(), Vec::new());
    for (v, row) in row.iter_mut().enumerate().filter(|(_, row)| **row == 0) {
        *row = left.0.len() as u32;
        left.0.push(positions[v]);
        left.1.push(sides[v]);
    }
    let faces = merged.iter().flatten().map(|face| face.map(|v| row[v as usize])).collect();
    (TriangleMesh { positions: left.0, faces }, left.1)
}

/// The faces left of a tile.
fn merge_tile(
    ctx: &Ctx<'_>,
    positions: &[Vec3],
    sides: &[f64],
    faces: &[[u32; 3]],
) -> Vec<[u32; 3]> {
    let mut vertices: Vec<u32> = faces.as_flattened().to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    let local =
        |v: u32| vertices.binary_search(&v).expect("invariant: a vertex of the tile") as u32;
    let part = TriangleMesh {
        positions: vertices.iter().map(|&v| positions[v as usize]).collect(),
        faces: faces.iter().map(|face| face.map(local)).collect(),
    };
    let sides: Vec<f64> = vertices.iter().map(|&v| sides[v as usize]).collect();
    let normals = normals(&Ctx { host: &Serial, ..*ctx }, &part.positions);
    let mut edit = EditMesh::part(part).expect("invariant: marching tetrahedra make a manifold");
    let mut kept: Vec<bool> = edit.vertices().map(|v| edit.on_border(v)).collect();
    for v in edit.vertices().filter(|&v| !edit.on_border(v)) {
        kept[v as usize] = edit.neighbours(v).any(|n| edit.on_border(n));
    }
    merge_all(&Serial, &mut edit, &normals, &sides, &kept);
    edit.live_faces().map(|f| edit.face(f).map(|v| vertices[v as usize])).collect()
}

/// Merges short edges, but those of `kept` vertices, until none is left that may go.
fn merge_all(host: &dyn Host, edit: &mut EditMesh, normals: &[Vec3], sides: &[f64], kept: &[bool]) {
    let is_kept = |v: u32| kept.get(v as usize).copied().unwrap_or(false);
    // A merge may free another that was refused before, say about a vertex with three faces: one
    // of an edge about whose ends the faces have changed.
    let mut changed = vec![true; edit.vertex_rows()];
    loop {
        let before = std::mem::replace(&mut changed, vec![false; edit.vertex_rows()]);
        let mut merged = false;
        for h in short_edges(host, edit, sides) {
            // Earlier merges rename and remove: look again at what is there now.
            if !edit.is_face(h.face()) {
                continue;
            }
            let (a, b) = (edit.origin(h), edit.target(h));
            if ![a, b].iter().any(|&v| before[v as usize] || changed[v as usize]) {
                continue;
            }
            if is_kept(a)
                || is_kept(b)
                || !is_short(distance(edit, a, b), sides, a, b)
                || !edit.can_collapse(h)
            {
                continue;
            }
            let o = edit.opposite(h).expect("invariant: the mesh is closed");
            let (h, left) = if may_move(edit, normals, b, a) {
                (h, a)
            } else if may_move(edit, normals, a, b) {
                (o, b)
            } else {
                continue;
            };
            edit.collapse(h);
            merged = true;
            changed[left as usize] = true;
            edit.neighbours(left).for_each(|v| changed[v as usize] = true);
        }
        if !merged {
            return;
        }
    }
}

fn normals(ctx: &Ctx<'_>, points: &[Vec3]) -> Vec<Vec3> {
    bulk::shares(ctx.host, points, |points| {
        let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
        for (points, out) in points.chunks(64).zip(jets.chunks_mut(64)) {
            ctx.field.gradients(points, out);
        }
        jets.iter().map(|jet| jet.gradient / jet.gradient.norm()).collect()
    })
}

/// Short edges from the shortest up, equal ones by their half-edge.
fn short_edges(host: &dyn Host, edit: &EditMesh, sides: &[f64]) -> Vec<HalfEdge> {
    // Lengths are not negative: their bits have their order.
    let key = |h: HalfEdge| {
        let (a, b) = (edit.origin(h), edit.target(h));
        let length = distance(edit, a, b);
        is_short(length, sides, a, b)
            .then_some(u128::from(length.to_bits()) << 32 | u128::from(h.0))
    };
    let rows = edit.face_rows();
    let shares = map(host, rows.div_ceil(FACES_A_TASK), |i| {
        let first = i * FACES_A_TASK;
        let edges = edit.edge_list(first..rows.min(first + FACES_A_TASK));
        edges.into_iter().filter_map(key).collect::<Vec<u128>>()
    });
    let mut keys = shares.concat();
    keys.sort_unstable();
    keys.into_iter().map(|key| HalfEdge(key as u32)).collect()
}

fn distance(edit: &EditMesh, a: u32, b: u32) -> f64 {
    (edit.positions[a as usize] - edit.positions[b as usize]).norm()
}

fn is_short(length: f64, sides: &[f64], a: u32, b: u32) -> bool {
    length < SHORT * sides[a as usize].min(sides[b as usize])
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
        let directions = [to, b, c].map(|v| normals[v as usize]);
        keeps(shape, [&old, &new], LEAST_SHAPE)
            && keeps(|face| cosine(face, &directions), [&old, &new], LEAST_COSINE)
    })
}

/// Whether a figure stays at least at `least`, or at what it was.
fn keeps(figure: impl Fn(&[Vec3; 3]) -> f64, [old, new]: [&[Vec3; 3]; 2], least: f64) -> bool {
    let found = figure(new);
    found >= least || found >= figure(old)
}

fn normal([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// Least cosine of the angles between a face and the given directions, of those that are known:
/// at kinks they are not. 1 for flat faces, of which the shape tells enough.
fn cosine(corners: &[Vec3; 3], directions: &[Vec3; 3]) -> f64 {
    let n = normal(corners);
    let length = n.norm();
    let least = directions.iter().map(|d| n.dot(d)).fold(length, f64::min);
    if length == 0.0 { 1.0 } else { least / length }
}

/// `4 sqrt(3) area / sum of squared sides`: 1 if equilateral, 0 if flat.
fn shape(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let sides_sq = (b - a).norm_squared() + (c - b).norm_squared() + (a - c).norm_squared();
    // Three equal corners: as flat as can be.
    if sides_sq == 0.0 { 0.0 } else { 2.0 * 3f64.sqrt() * normal(corners).norm() / sides_sq }
}
