//! The first collapses of a large mesh, tile by tile.
//!
//! A loop that takes the cheapest edge of a large mesh looks somewhere else at every step and waits
//! for memory. Most of its collapses are so cheap that their order does not matter: they are made
//! in tiles that stay in the cache, on all threads. A tile leaves the vertices on its border and
//! their neighbours alone, so that the whole stays a manifold of the same topology; the loop over
//! the whole mesh, which follows, takes the seams with all else.

use crate::simplify::{Run, Vertices};
use crate::{DecimateError, DecimateParams};
use isospline_geometry::{EditMesh, TriangleMesh, Vec3};
use isospline_stage::{Counters, Ctx, map};

/// Triangles from which a mesh is large.
const LARGE: usize = 100_000;
/// Triangles a tile: what a collapse looks at, some hundred bytes a triangle, stays in the
/// second-level cache. With a quarter of it the seams keep half as many triangles again.
const TILE: usize = 24_576;
/// Faces left by the tiles, of those wanted: the tiles get equal shares, and which place needs more
/// is for the loop over all to decide. With 6 no faster.
const KEPT: f64 = 10.0;

/// A tile with its collapses made.
struct Tile {
    /// Its faces, by vertices of the whole mesh.
    faces: Vec<[u32; 3]>,
    /// Vertices that may have moved, as rows of the whole mesh.
    rows: Vec<u32>,
    positions: Vec<Vec3>,
    vertices: Vertices,
}

/// Whether the tiles would take most of the triangles.
pub(crate) fn are_worth_it(mesh: &TriangleMesh, params: &DecimateParams) -> bool {
    mesh.faces.len() > LARGE && kept_share(mesh, params) < 0.5
}

/// The mesh and its vertices after the collapses in tiles.
///
/// # Errors
/// [`DecimateError::NotManifold`].
pub(crate) fn coarsen(
    ctx: &Ctx<'_>,
    params: &DecimateParams,
    mut mesh: TriangleMesh,
    mut vertices: Vertices,
    counters: &mut Counters,
) -> Result<(TriangleMesh, Vertices), DecimateError> {
    let share = kept_share(&mesh, params);
    let parts: Vec<&[[u32; 3]]> = mesh.faces.chunks(TILE).collect();
    let tiles = map(ctx.host, parts.len(), |i| {
        coarsen_tile(params, (&mesh.positions, parts[i]), &vertices, share)
    });
    let mut faces = Vec::new();
    for tile in tiles {
        let tile = tile?;
        for (k, &v) in tile.rows.iter().enumerate() {
            let v = v as usize;
            mesh.positions[v] = tile.positions[k];
            vertices.quadrics[v] = tile.vertices.quadrics[k];
            vertices.weights[v] = tile.vertices.weights[k];
            vertices.normals[v] = tile.vertices.normals[k];
        }
        faces.extend(tile.faces);
    }
    counters.count("collapses_in_tiles", (mesh.faces.len() - faces.len()) as u64 / 2);
    Ok(compacted(&mesh.positions, faces, &vertices))
}

fn kept_share(mesh: &TriangleMesh, params: &DecimateParams) -> f64 {
    KEPT * f64::from(params.faces) / mesh.faces.len() as f64
}

fn coarsen_tile(
    params: &DecimateParams,
    (positions, faces): (&[Vec3], &[[u32; 3]]),
    vertices: &Vertices,
    share: f64,
) -> Result<Tile, DecimateError> {
    let mut rows: Vec<u32> = faces.as_flattened().to_vec();
    rows.sort_unstable();
    rows.dedup();
    let local = |v: u32| rows.binary_search(&v).expect("invariant: a vertex of the tile") as u32;
    let part = TriangleMesh {
        positions: rows.iter().map(|&v| positions[v as usize]).collect(),
        faces: faces.iter().map(|face| face.map(local)).collect(),
    };
    let mut run = Run::new(EditMesh::part(part)?, vertices.of_rows(&rows));
    run.locked = locked(&run.mesh);
    run.reach_or_stop(params, (share * faces.len() as f64) as usize);
    let Run { mesh, vertices, locked, .. } = run;
    let faces = mesh.live_faces().map(|f| mesh.face(f).map(|v| rows[v as usize])).collect();
    let free: Vec<u32> = mesh.vertices().filter(|&v| !locked[v as usize]).collect();
    Ok(Tile {
        faces,
        rows: free.iter().map(|&v| rows[v as usize]).collect(),
        positions: free.iter().map(|&v| mesh.positions[v as usize]).collect(),
        vertices: vertices.of_rows(&free),
    })
}

/// The vertices on a border and their neighbours.
fn locked(mesh: &EditMesh) -> Vec<bool> {
    let on_border: Vec<bool> = mesh.vertices().map(|v| mesh.on_border(v)).collect();
    let mut locked = on_border.clone();
    for v in mesh.vertices().filter(|&v| !on_border[v as usize]) {
        locked[v as usize] = mesh.neighbours(v).any(|n| on_border[n as usize]);
    }
    locked
}

/// The mesh of these faces with their vertices alone, in the order they had.
fn compacted(
    positions: &[Vec3],
    mut faces: Vec<[u32; 3]>,
    vertices: &Vertices,
) -> (TriangleMesh, Vertices) {
    let mut new = vec![u32::MAX; positions.len()];
    faces.iter().flatten().for_each(|&v| new[v as usize] = 0);
    let kept: Vec<u32> = (0..new.len() as u32).filter(|&v| new[v as usize] != u32::MAX).collect();
    for (row, &v) in (0u32..).zip(&kept) {
        new[v as usize] = row;
    }
    for v in faces.iter_mut().flatten() {
        *v = new[*v as usize];
    }
    let vertices = vertices.of_rows(&kept);
    let positions = kept.iter().map(|&v| positions[v as usize]).collect();
    (TriangleMesh { positions, faces }, vertices)
}
