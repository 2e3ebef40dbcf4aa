//! A numbering in which neighbours stand close together.
//!
//! Vertices follow a breadth-first front (Cuthill and `McKee` 1969) from a pseudo-peripheral vertex
//! of each component, faces and edges follow their lowest vertices. A row of a later stage then
//! needs only rows a little further on, which is what lets stages run behind each other; a
//! space-filling curve would make early rows wait for most of their source.

use isospline_geometry::TriangleMesh;

/// The same mesh with vertices and faces in front order; faces start at their lowest vertex.
pub fn in_front_order(mesh: &TriangleMesh) -> TriangleMesh {
    let neighbours = Neighbours::of(mesh);
    let order = front_order(&neighbours);
    let mut rank = vec![0u32; order.len()];
    for (new, &old) in (0u32..).zip(&order) {
        rank[old as usize] = new;
    }
    let positions = order.iter().map(|&v| mesh.positions[v as usize]).collect();
    let relabel = |face: &[u32; 3]| from_lowest(face.map(|v| rank[v as usize]));
    let faces: Vec<[u32; 3]> = mesh.faces.iter().map(relabel).collect();
    let (_, faces) = by_lowest(order.len(), &faces, |face| face[0]);
    TriangleMesh { positions, faces }
}

/// Rows in ascending order, with the first of each vertex `lowest(row)` and the end; that vertex is
/// the first thing the order looks at. It takes the vertices' few rows each in place of one long
/// sort.
pub(crate) fn by_lowest<T: Copy + Ord>(
    n_vertices: usize,
    rows: &[T],
    lowest: impl Fn(&T) -> u32,
) -> (Vec<u32>, Vec<T>) {
    let mut first = vec![0u32; n_vertices + 2];
    for row in rows {
        first[lowest(row) as usize + 2] += 1;
    }
    for v in 1..first.len() {
        first[v] += first[v - 1];
    }
    let mut sorted = rows.to_vec();
    for row in rows {
        let place = &mut first[lowest(row) as usize + 1];
        sorted[*place as usize] = *row;
        *place += 1;
    }
    first.truncate(n_vertices + 1);
    for v in first.windows(2) {
        sorted[v[0] as usize..v[1] as usize].sort_unstable();
    }
    (first, sorted)
}

/// The face rotated so that its lowest vertex comes first; orientation is kept.
fn from_lowest(mut face: [u32; 3]) -> [u32; 3] {
    let lowest = (0..3).min_by_key(|&k| face[k]).expect("invariant: three corners");
    face.rotate_left(lowest);
    face
}

/// Vertex adjacency; the neighbours of a vertex in ascending order of valence, then of row.
struct Neighbours {
    first: Vec<u32>,
    list: Vec<u32>,
}

impl Neighbours {
    fn of(mesh: &TriangleMesh) -> Self {
        let mut pairs = Vec::with_capacity(6 * mesh.faces.len());
        for f in &mesh.faces {
            for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
                pairs.push((a, b));
                pairs.push((b, a));
            }
        }
        let n_vertices = mesh.positions.len();
        let (rows, pairs) = by_lowest(n_vertices, &pairs, |&(a, _)| a);
        let mut first = Vec::with_capacity(n_vertices + 1);
        first.push(0);
        let mut list: Vec<u32> = Vec::with_capacity(pairs.len() / 2);
        for rows in rows.windows(2) {
            let begin = list.len();
            for &(_, b) in &pairs[rows[0] as usize..rows[1] as usize] {
                // In sorted order equal ones follow each other.
                if list.len() == begin || list.last() != Some(&b) {
                    list.push(b);
                }
            }
            first.push(list.len() as u32);
        }
        let mut found = Self { first, list };
        found.sort_by_valence();
        found
    }

    fn sort_by_valence(&mut self) {
        let Self { first, list } = self;
        let valence = |v: u32| first[v as usize + 1] - first[v as usize];
        for rows in first.windows(2) {
            list[rows[0] as usize..rows[1] as usize].sort_unstable_by_key(|&v| (valence(v), v));
        }
    }

    fn of_vertex(&self, v: u32) -> &[u32] {
        &self.list[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }

    fn n_vertices(&self) -> usize {
        self.first.len() - 1
    }
}

fn front_order(neighbours: &Neighbours) -> Vec<u32> {
    let n = neighbours.n_vertices();
    let mut order = Vec::with_capacity(n);
    let mut done = vec![false; n];
    let mut seen = vec![u32::MAX; n];
    let mut stamp = 0;
    for seed in 0..n as u32 {
        if done[seed as usize] {
            continue;
        }
        let start = far_end(neighbours, seed, &mut seen, &mut stamp);
        let begin = order.len();
        walk(neighbours, start, &mut seen, stamp, &mut order);
        stamp += 1;
        for &v in &order[begin..] {
            done[v as usize] = true;
        }
    }
    order
}

/// A pseudo-peripheral vertex: the last one of a front that starts at the last one of a front.
fn far_end(neighbours: &Neighbours, seed: u32, seen: &mut [u32], stamp: &mut u32) -> u32 {
    let mut start = seed;
    for _ in 0..2 {
        let mut front = Vec::new();
        walk(neighbours, start, seen, *stamp, &mut front);
        *stamp += 1;
        start = *front.last().expect("invariant: a front holds its seed");
    }
    start
}

/// Appends the breadth-first front from `start`, neighbours in ascending order of valence.
fn walk(neighbours: &Neighbours, start: u32, seen: &mut [u32], stamp: u32, order: &mut Vec<u32>) {
    // What is appended and not yet passed is the queue.
    let mut at = order.len();
    order.push(start);
    seen[start as usize] = stamp;
    while let Some(&v) = order.get(at) {
        at += 1;
        for &w in neighbours.of_vertex(v) {
            if seen[w as usize] != stamp {
                seen[w as usize] = stamp;
                order.push(w);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::Vec3;

    /// A closed strip: a torus grid of `n` by 4 vertices.
    fn ring(n: u32) -> TriangleMesh {
        let at = |i: u32, j: u32| (i % n) * 4 + j % 4;
        let mut faces = Vec::new();
        for i in 0..n {
            for j in 0..4 {
                faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        let positions =
            (0..4 * n).map(|v| Vec3::new(f64::from(v), f64::from(v * v % 7), 0.0)).collect();
        TriangleMesh { positions, faces }
    }

    #[test]
    fn ordering_keeps_positions_orientation_and_topology() {
        let mesh = ring(20);
        let ordered = in_front_order(&mesh);
        let opposite = ordered.opposites().unwrap();
        assert_eq!(ordered.euler_characteristic(&opposite), 0);
        let key = |m: &TriangleMesh| {
            let mut rows: Vec<[u64; 3]> = (0..m.faces.len() as u32)
                .map(|f| {
                    let mut c = m.corners(f).map(|p| p.x.to_bits());
                    let low = (0..3).min_by_key(|&k| c[k]).unwrap();
                    c.rotate_left(low);
                    c
                })
                .collect();
            rows.sort_unstable();
            rows
        };
        assert_eq!(key(&mesh), key(&ordered));
    }

    #[test]
    fn neighbours_stand_within_a_few_fronts() {
        let ordered = in_front_order(&ring(200));
        for face in &ordered.faces {
            let spread = face.iter().max().unwrap() - face.iter().min().unwrap();
            assert!(spread <= 24, "{face:?}");
        }
    }
}
