//! Numbers of a tile's unknowns.

use crate::degree::Degree;
use crate::face_moves::{OWN, REACHING, reaching_spokes};
use crate::tiling::Tile;
use isospline_artifact::kinds::BaseMeshView;

/// Which unknown of a tile each move is: edge after edge, its own moves and then its spokes'.
///
/// Edges of the frozen order lie near each other, so the matrix keeps a narrow envelope.
#[derive(Clone, Debug)]
pub(crate) struct Numbering {
    /// Unknown of each move that reaches a face; `None` where the move is not the tile's.
    pub(crate) columns: Vec<[Option<u32>; REACHING]>,
    /// The first unknown that shares a face with each one.
    pub(crate) lowest: Vec<usize>,
    /// Unknown of the scalar `nu` of each edge.
    pub(crate) nu: Vec<usize>,
}

impl Numbering {
    pub(crate) fn new(mesh: &BaseMeshView<'_>, tile: &Tile, degree: Degree) -> Self {
        let own = own_moves(degree);
        let mut first_of_edge = Vec::with_capacity(tile.edges.len());
        let mut of_spoke = vec![0; tile.spokes.len()];
        let mut n = 0;
        for &e in &tile.edges {
            first_of_edge.push(n);
            n += own.len();
            for h in mesh.edge_half[e as usize] {
                if let Ok(at) = tile.spokes.binary_search(&h) {
                    of_spoke[at] = n as u32;
                    n += 1;
                }
            }
        }
        let columns: Vec<_> = tile
            .faces
            .iter()
            .map(|&f| columns(mesh, tile, f as usize, own, &first_of_edge, &of_spoke))
            .collect();
        let nu = first_of_edge.iter().map(|first| first + own.len() - 1).collect();
        Self { lowest: lowest(n, &columns), columns, nu }
    }
}

/// An edge's own moves that there are; the last is that of `nu`.
const fn own_moves(degree: Degree) -> &'static [usize] {
    match degree {
        Degree::Six => &[0, 1, 2, 6],
        Degree::Seven => &[0, 1, 2, 3, 4, 5, 6],
    }
}

fn columns(
    mesh: &BaseMeshView<'_>,
    tile: &Tile,
    face: usize,
    own: &[usize],
    first_of_edge: &[usize],
    of_spoke: &[u32],
) -> [Option<u32>; REACHING] {
    let mut out = [None; REACHING];
    for k in 0..3 {
        if let Ok(at) = tile.edges.binary_search(&mesh.edge_of[3 * face + k]) {
            for (i, c) in own.iter().enumerate() {
                out[OWN * k + c] = Some((first_of_edge[at] + i) as u32);
            }
        }
    }
    for (slot, h) in out[3 * OWN..].iter_mut().zip(reaching_spokes(mesh, face)) {
        *slot = tile.spokes.binary_search(&h.0).ok().map(|at| of_spoke[at]);
    }
    out
}

fn lowest(n: usize, columns: &[[Option<u32>; REACHING]]) -> Vec<usize> {
    let mut lowest: Vec<usize> = (0..n).collect();
    for face in columns {
        let Some(&least) = face.iter().flatten().min() else { continue };
        for &column in face.iter().flatten() {
            let slot = &mut lowest[column as usize];
            *slot = (*slot).min(least as usize);
        }
    }
    lowest
}
