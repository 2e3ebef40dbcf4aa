//! The tetrahedra about the surface: Kuhn's subdivision of the cells, bisected where need be.
//!
//! A cell is cut into six tetrahedra about its main diagonal [Kuhn], the same way in every cell,
//! so neighbours agree on their common face. A tetrahedron is refined by halving its longest edge
//! together with all others that share it [Maubach]; the longest edge is unique in each of the
//! three shapes that arise, so the rule needs no history, and three halvings give the first shape
//! at half the size. Only cells that the surface may touch are there.

use crate::PolygonizeError;
use crate::bulk;
use crate::grid::{Grid, Planes, Site, pack, unpack};
use crate::key_map::{KeyMap, pair};
use isospline_geometry::Vec3;
use isospline_implicit::Interval;
use isospline_stage::Ctx;

/// Four nodes, positively oriented.
pub(crate) type Tetrahedron = [u32; 4];

/// Kuhn's six tetrahedra in a cell whose corner `x + 2 y + 4 z` is the one at offset (x, y, z).
const KUHN: [Tetrahedron; 6] =
    [[0, 1, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 6, 4, 7]];

/// A cell that the surface may touch.
#[derive(Clone, Debug)]
struct Cell {
    corners: [u32; 8],
    /// Row of its tetrahedra once it is refined; [`WHOLE`] while Kuhn's six stand.
    refined: u32,
}

/// Marks a cell that is not refined.
const WHOLE: u32 = u32::MAX;

/// A tetrahedron of a refined cell.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    nodes: Tetrahedron,
    /// Whether the present call of [`Complex::refine`] made it.
    is_new: bool,
}

/// Tetrahedra with field values at their nodes.
#[derive(Clone, Debug)]
pub(crate) struct Complex {
    /// The grid of the cells.
    pub(crate) grid: Grid,
    planes: Planes,
    cells: Vec<Cell>,
    /// Tetrahedra of the refined cells, which are few.
    refined: Vec<Vec<Leaf>>,
    cell_at: KeyMap,
    sites: Vec<u64>,
    values: Vec<f64>,
    node_at: KeyMap,
    halved: KeyMap,
    queue: Vec<u32>,
    queued: Vec<bool>,
    touched: Vec<u32>,
}

impl Complex {
    /// The complex of `cells`, with values.
    ///
    /// # Errors
    /// [`PolygonizeError::NotANumber`] if the field has no value at a node.
    pub(crate) fn new(ctx: &Ctx<'_>, grid: Grid, cells: &[Site]) -> Result<Self, PolygonizeError> {
        let mut complex = Self {
            planes: Planes::of(&grid),
            grid,
            cells: Vec::with_capacity(cells.len()),
            refined: Vec::new(),
            cell_at: KeyMap::with_room_for(0),
            sites: Vec::new(),
            values: Vec::new(),
            node_at: KeyMap::with_room_for(0),
            halved: KeyMap::with_room_for(0),
            queue: Vec::new(),
            queued: vec![false; cells.len()],
            touched: Vec::new(),
        };
        let mut nodes = GridNodes::of(&complex.grid, cells.len());
        for &cell in cells {
            let corner = |i: u32| [cell[0] + (i & 1), cell[1] + (i >> 1 & 1), cell[2] + (i >> 2)];
            let corners = std::array::from_fn(|i| {
                let at = corner(i as u32);
                let (node, is_new) = nodes.get_or_insert(at, complex.sites.len() as u32);
                if is_new {
                    complex.sites.push(pack(at.map(|c| c << complex.grid.levels)));
                }
                node
            });
            complex.cells.push(Cell { corners, refined: WHOLE });
        }
        complex.evaluate(ctx)?;
        Ok(complex)
    }

    /// How much the slopes of f along the axes change across a cell, of the slopes; not a number
    /// where they are not.
    pub(crate) fn bend(&self, cell: usize) -> f64 {
        let values = self.cells[cell].corners.map(|n| self.value(n));
        let (mut bend_sq, mut slope_sq) = (0.0, 0.0);
        for axis in [1, 2, 4] {
            let lower = (0..8).filter(|i| i & axis == 0);
            let slopes = lower.map(|i| values[i | axis] - values[i]);
            let (least, most, sum) = slopes
                .fold((f64::INFINITY, f64::NEG_INFINITY, 0.0), |(least, most, sum), slope| {
                    (slope.min(least), slope.max(most), sum + slope)
                });
            bend_sq += (most - least) * (most - least);
            slope_sq += 0.0625 * sum * sum;
        }
        (bend_sq / slope_sq).sqrt()
    }

    /// Gives up what only refining needs: a third of the memory.
    pub(crate) fn keep_as_it_is(&mut self) {
        for map in [&mut self.cell_at, &mut self.node_at, &mut self.halved] {
            *map = KeyMap::with_room_for(0);
        }
        self.queued = Vec::new();
    }

    /// Cells that the surface may touch.
    pub(crate) fn n_cells(&self) -> usize {
        self.cells.len()
    }

    /// All tetrahedra of a cell.
    pub(crate) fn tetrahedra(&self, cell: usize) -> impl Iterator<Item = Tetrahedron> + '_ {
        let Cell { corners, refined } = &self.cells[cell];
        let refined = self.refined.get(*refined as usize).map_or(&[][..], Vec::as_slice);
        let kuhn = if refined.is_empty() { &KUHN[..] } else { &[] };
        kuhn.iter().map(|t| t.map(|i| corners[i as usize])).chain(refined.iter().map(|t| t.nodes))
    }

    /// The box of a cell.
    pub(crate) fn cell_box(&self, cell: usize) -> [Interval; 3] {
        let corners = &self.cells[cell].corners;
        self.grid.intervals(self.site(corners[0]), self.site(corners[7]))
    }

    /// Whether all corners of an unrefined cell lie on one side: it has no piece of the mesh.
    pub(crate) fn is_one_sided(&self, cell: usize) -> bool {
        let Cell { corners, refined } = &self.cells[cell];
        *refined == WHOLE && corners.iter().all(|&n| self.inside(n) == self.inside(corners[0]))
    }

    /// Lattice point of a node.
    pub(crate) fn site(&self, node: u32) -> Site {
        unpack(self.sites[node as usize])
    }

    /// Position of a node.
    pub(crate) fn point(&self, node: u32) -> Vec3 {
        self.planes.point(&self.grid, self.site(node))
    }

    /// Field value at a node.
    pub(crate) fn value(&self, node: u32) -> f64 {
        self.values[node as usize]
    }

    /// The side of a node; exact zeros count as outside, everywhere alike.
    pub(crate) fn inside(&self, node: u32) -> bool {
        self.values[node as usize] < 0.0
    }

    /// Median size of f at the nodes of the cells: its size about a cell away from the surface.
    pub(crate) fn typical_value(&self) -> f64 {
        let mut sizes: Vec<f64> = self.values.iter().map(|f| f.abs()).collect();
        let middle = sizes.len() / 2;
        if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// Length of the box around an edge in lattice steps.
    pub(crate) fn extent(&self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.site(a), self.site(b));
        (0..3).map(|k| a[k].abs_diff(b[k])).max().expect("invariant: three axes")
    }

    /// The longest edge of a tetrahedron, as places of its ends.
    pub(crate) fn longest_edge(&self, t: &Tetrahedron) -> (usize, usize) {
        let length_sq = |&(i, j): &(usize, usize)| {
            let (a, b) = (self.site(t[i]), self.site(t[j]));
            (0..3).map(|k| u64::from(a[k].abs_diff(b[k])).pow(2)).sum::<u64>()
        };
        EDGES.into_iter().max_by_key(length_sq).expect("invariant: six edges")
    }

    /// Halves the longest edge of each of `tetrahedra` and whatever that entails, so that the
    /// tetrahedra stay conforming; returns the tetrahedra that are new.
    ///
    /// # Errors
    /// [`PolygonizeError::NotANumber`] if the field has no value at a new node.
    pub(crate) fn refine(
        &mut self,
        ctx: &Ctx<'_>,
        tetrahedra: &[Tetrahedron],
    ) -> Result<Vec<Tetrahedron>, PolygonizeError> {
        if self.cell_at.is_empty() {
            self.cell_at = KeyMap::with_room_for(self.cells.len());
            for (row, cell) in (0u32..).zip(&self.cells) {
                let at = self.site(cell.corners[0]).map(|c| c >> self.grid.levels);
                self.cell_at.get_or_insert(pack(at), row);
            }
        }
        for t in tetrahedra {
            let (i, j) = self.longest_edge(t);
            self.halve(t[i], t[j]);
        }
        while let Some(cell) = self.queue.pop() {
            self.queued[cell as usize] = false;
            self.bisect_cell(cell as usize);
        }
        self.evaluate(ctx)?;
        Ok(self.take_new())
    }

    /// The tetrahedra made since the last call, cell by cell.
    fn take_new(&mut self) -> Vec<Tetrahedron> {
        let mut touched = std::mem::take(&mut self.touched);
        touched.sort_unstable();
        touched.dedup();
        let mut new = Vec::new();
        for cell in touched {
            let row = self.cells[cell as usize].refined;
            for leaf in &mut self.refined[row as usize] {
                if std::mem::take(&mut leaf.is_new) {
                    new.push(leaf.nodes);
                }
            }
        }
        new
    }

    /// Bisects the tetrahedra of a cell until none of them has an edge that is halved now.
    fn bisect_cell(&mut self, cell: usize) {
        let row = self.cells[cell].refined;
        let mut stack = self.refined.get_mut(row as usize).map(std::mem::take).unwrap_or_default();
        if stack.is_empty() {
            stack.extend(self.tetrahedra(cell).map(|nodes| Leaf { nodes, is_new: false }));
        }
        stack.reverse();
        let mut done = Vec::with_capacity(stack.len() + 6);
        while let Some(leaf) = stack.pop() {
            if !self.has_halved_edge(&leaf.nodes) {
                done.push(leaf);
                continue;
            }
            let (i, j) = self.longest_edge(&leaf.nodes);
            let middle = self.halve(leaf.nodes[i], leaf.nodes[j]);
            for end in [j, i] {
                let mut child = Leaf { is_new: true, ..leaf };
                child.nodes[end] = middle;
                stack.push(child);
            }
        }
        // A cell that was only looked at keeps Kuhn's six unstored.
        if done.len() > 6 || done.iter().any(|leaf| leaf.is_new) {
            if row == WHOLE {
                self.cells[cell].refined = self.refined.len() as u32;
                self.refined.push(done);
            } else {
                self.refined[row as usize] = done;
            }
            self.touched.push(cell as u32);
        }
    }

    fn has_halved_edge(&self, t: &Tetrahedron) -> bool {
        EDGES.iter().any(|&(i, j)| self.halved.get(pair(t[i], t[j])).is_some())
    }

    /// The node in the middle of an edge; if the edge was whole, all cells there are queued.
    fn halve(&mut self, a: u32, b: u32) -> u32 {
        if let Some(middle) = self.halved.get(pair(a, b)) {
            return middle;
        }
        let (at_a, at_b) = (self.site(a), self.site(b));
        let at = [0, 1, 2].map(|k| u32::midpoint(at_a[k], at_b[k]));
        let middle = self.lattice_node(at);
        self.halved.get_or_insert(pair(a, b), middle);
        self.queue_cells_at(at);
        middle
    }

    fn queue_cells_at(&mut self, at: Site) {
        let scale = self.grid.scale();
        // On a cell border the lower neighbour has the point too.
        let lower = at.map(|c| u32::from(c % scale == 0 && c > 0));
        for i in 0..8u32 {
            let back = [i & 1, i >> 1 & 1, i >> 2];
            if (0..3).any(|k| back[k] > lower[k]) {
                continue;
            }
            let cell = [0, 1, 2].map(|k| at[k] / scale - back[k]);
            if let Some(row) = self.cell_at.get(pack(cell))
                && !self.queued[row as usize]
            {
                self.queued[row as usize] = true;
                self.queue.push(row);
            }
        }
    }

    /// A node between those of the grid.
    fn lattice_node(&mut self, at: Site) -> u32 {
        let key = pack(at);
        let (node, is_new) = self.node_at.get_or_insert(key, self.sites.len() as u32);
        if is_new {
            self.sites.push(key);
        }
        node
    }

    /// Gives values to the nodes that have none yet.
    fn evaluate(&mut self, ctx: &Ctx<'_>) -> Result<(), PolygonizeError> {
        let new = &self.sites[self.values.len()..];
        let found = bulk::shares(ctx.host, new, |sites| {
            let points: Vec<_> =
                sites.iter().map(|&s| self.planes.point(&self.grid, unpack(s))).collect();
            bulk::values(ctx.field, &points)
        });
        if let Some(i) = found.iter().position(|f| f.is_nan()) {
            return Err(PolygonizeError::NotANumber { at: self.grid.point(unpack(new[i])) });
        }
        self.values.extend(found);
        Ok(())
    }
}

/// The nodes of a grid while they are numbered.
enum GridNodes {
    /// One row a node of the whole grid, [`WHOLE`] where there is none yet.
    All { size: [usize; 2], rows: Vec<u32> },
    /// Where that would be too many.
    Some(KeyMap),
}

impl GridNodes {
    /// Rows of the whole grid for each cell with surface, from which on a map takes less memory.
    const MOST_A_CELL: usize = 16;

    fn of(grid: &Grid, n_cells: usize) -> Self {
        let [x, y, z] = grid.cells.map(|n| n as usize + 1);
        if x.saturating_mul(y).saturating_mul(z) <= Self::MOST_A_CELL * n_cells {
            Self::All { size: [x, y], rows: vec![WHOLE; x * y * z] }
        } else {
            Self::Some(KeyMap::with_room_for(2 * n_cells))
        }
    }

    /// The row of a node, and whether it is new: then it is `row`.
    fn get_or_insert(&mut self, at: Site, row: u32) -> (u32, bool) {
        match self {
            Self::All { size: [nx, ny], rows } => {
                let [x, y, z] = at.map(|c| c as usize);
                let place = &mut rows[x + *nx * (y + *ny * z)];
                let is_new = *place == WHOLE;
                if is_new {
                    *place = row;
                }
                (*place, is_new)
            }
            Self::Some(map) => map.get_or_insert(pack(at), row),
        }
    }
}

/// The edges of a tetrahedron, as places of their ends.
pub(crate) const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::Aabb;
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;
    use std::collections::BTreeMap;

    fn volume(complex: &Complex, t: &Tetrahedron) -> f64 {
        let [a, b, c, d] = t.map(|n| complex.point(n));
        (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
    }

    #[test]
    fn refined_tetrahedra_stay_positive_conforming_and_fill_the_box() {
        let domain = Aabb::new(Vec3::zeros(), Vec3::new(2.0, 2.0, 2.0));
        let field = ClosureField::new(1.0, |p: Vec3| p.x);
        let ctx = Ctx { field: &field, domain, host: &Serial };
        let cells: Vec<Site> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2]).collect();
        let mut complex = Complex::new(&ctx, Grid::new(domain, 2, 6), &cells).unwrap();
        for round in 0..9 {
            let some = complex.tetrahedra(round % 3).nth(round).unwrap();
            complex.refine(&ctx, &[some]).unwrap();
        }
        let all: Vec<_> = (0..8).flat_map(|c| complex.tetrahedra(c)).collect();
        assert!(all.len() > 100, "{}", all.len());
        assert!(all.iter().all(|t| volume(&complex, t) > 0.0));
        assert!((all.iter().map(|t| volume(&complex, t)).sum::<f64>() - 8.0).abs() < 1e-12);
        let mut faces = BTreeMap::new();
        for t in &all {
            for skip in 0..4 {
                let mut face: Vec<u32> = (0..4).filter(|&i| i != skip).map(|i| t[i]).collect();
                face.sort_unstable();
                *faces.entry(face).or_insert(0) += 1;
            }
        }
        for (face, uses) in faces {
            let on_side = |k: usize, c: u32| face.iter().all(|&n| complex.site(n)[k] == c);
            let outer = (0..3).any(|k| on_side(k, 0) || on_side(k, complex.grid.end(k)));
            assert_eq!(uses, if outer { 1 } else { 2 });
        }
    }
}
