//! Overlapping tiles of faces, in colours that share no face.

use crate::face_moves::{reached_faces, reaching_spokes};
use isospline_artifact::kinds::BaseMeshView;
use isospline_geometry::HalfEdge;
use std::collections::BTreeSet;

/// Part of the surface that one solve moves, and the moves that stay inside it.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    /// Faces, ascending.
    pub(crate) faces: Vec<u32>,
    /// Edges between two of them, ascending.
    pub(crate) edges: Vec<u32>,
    /// Half-edges whose spoke moves reach no other face, ascending.
    pub(crate) spokes: Vec<u32>,
}

/// Tiles that cover a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Tiling {
    /// In order of their middle vertices.
    pub(crate) tiles: Vec<Tile>,
    /// Tiles of each colour: no two of them share a face.
    pub(crate) colours: Vec<Vec<usize>>,
}

impl Tiling {
    /// Balls of `rings` rings of faces about vertices, so many that each vertex lies well inside
    /// one: within `rings / 2` edges of its middle.
    pub(crate) fn new(mesh: &BaseMeshView<'_>, rings: usize) -> Self {
        let mut covered = vec![false; mesh.position.len()];
        let mut tiles = Vec::new();
        for middle in 0..covered.len() {
            if covered[middle] {
                continue;
            }
            let levels = ball(mesh, middle as u32, rings);
            for &v in levels[..=rings / 2].iter().flatten() {
                covered[v as usize] = true;
            }
            tiles.push(Tile::new(mesh, &levels));
        }
        let colours = colours(mesh.face.len(), &tiles);
        Self { tiles, colours }
    }
}

impl Tile {
    /// The tile of all faces at the vertices of `levels`.
    fn new(mesh: &BaseMeshView<'_>, levels: &[Vec<u32>]) -> Self {
        let around = levels.iter().flatten().flat_map(|&v| outgoing(mesh, v));
        let faces: BTreeSet<u32> = around.map(HalfEdge::face).collect();
        let is_inside = |f: &u32| faces.contains(f);
        let mut edges: Vec<u32> = faces
            .iter()
            .flat_map(|f| 3 * f..3 * f + 3)
            .filter(|&h| is_inside(&(mesh.opposite[h as usize] / 3)))
            .map(|h| mesh.edge_of[h as usize])
            .collect();
        let mut spokes: Vec<u32> = faces
            .iter()
            .flat_map(|&f| reaching_spokes(mesh, f as usize))
            .filter(|&h| reached_faces(mesh, h).iter().all(is_inside))
            .map(|h| h.0)
            .collect();
        for ids in [&mut edges, &mut spokes] {
            ids.sort_unstable();
            ids.dedup();
        }
        Self { faces: faces.into_iter().collect(), edges, spokes }
    }
}

fn outgoing(mesh: &BaseMeshView<'_>, vertex: u32) -> impl Iterator<Item = HalfEdge> {
    let v = vertex as usize;
    let rows = mesh.star_first[v] as usize..mesh.star_first[v + 1] as usize;
    mesh.star[rows].iter().map(|&h| HalfEdge(h))
}

/// Vertices at 0, 1, .. `rings - 1` edges from `middle`.
fn ball(mesh: &BaseMeshView<'_>, middle: u32, rings: usize) -> Vec<Vec<u32>> {
    let mut seen = BTreeSet::from([middle]);
    let mut levels = vec![vec![middle]];
    for _ in 1..rings {
        let mut next = Vec::new();
        for h in levels.iter().flatten().flat_map(|&v| outgoing(mesh, v)) {
            let end = mesh.face[h.next().face() as usize][h.next().corner() as usize];
            if seen.insert(end) {
                next.push(end);
            }
        }
        levels.push(next);
    }
    levels
}

/// Each tile takes the first colour that no tile before it has on one of its faces.
fn colours(n_faces: usize, tiles: &[Tile]) -> Vec<Vec<usize>> {
    let mut of_face = vec![Vec::new(); n_faces];
    let mut colours: Vec<Vec<usize>> = Vec::new();
    for (number, tile) in tiles.iter().enumerate() {
        let mut taken = vec![false; colours.len() + 1];
        for &f in &tile.faces {
            of_face[f as usize].iter().for_each(|&c: &u32| taken[c as usize] = true);
        }
        let colour = taken.iter().position(|t| !t).expect("invariant: one is new");
        if colour == colours.len() {
            colours.push(Vec::new());
        }
        colours[colour].push(number);
        tile.faces.iter().for_each(|&f| of_face[f as usize].push(colour as u32));
    }
    colours
}
