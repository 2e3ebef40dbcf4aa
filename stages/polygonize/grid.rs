//! The cell grid and the lattice of points below it.
//!
//! Lattice coordinates are whole numbers: a cell is `2^levels` steps wide, so midpoints of cells,
//! edges and test boxes have exact names and every float coordinate is computed in one place.

use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::Interval;

/// A point of the lattice.
pub(crate) type Site = [u32; 3];

/// Bits a lattice coordinate may take, so that three of them pack into a `u64`.
const SITE_BITS: u32 = 21;

/// Fewest cells along any side: a box made for a thin sheet must show nodes inside the sheet.
const LEAST_ACROSS: u32 = 6;

/// A grid of nearly cubic cells over a box.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// The box that the cells tile.
    pub(crate) domain: Aabb,
    /// Cells along each axis.
    pub(crate) cells: [u32; 3],
    /// A cell is `2^levels` lattice steps wide.
    pub(crate) levels: u32,
}

impl Grid {
    /// The grid with `longest` cells along the longest side of `domain`; other sides get as many
    /// as keep the cells nearly cubic, but 6 at least where the longest has those.
    pub(crate) fn new(domain: Aabb, longest: u32, levels: u32) -> Self {
        let size = domain.size();
        let step = size.max() / f64::from(longest);
        let least = LEAST_ACROSS.min(longest);
        let cells = [0, 1, 2].map(|k| ((size[k] / step).round() as u32).clamp(least, longest));
        Self { domain, cells, levels }
    }

    /// Most cells along a side that the lattice can name.
    pub(crate) fn most_cells(levels: u32) -> u32 {
        (1 << (SITE_BITS - levels)) - 1
    }

    /// Lattice steps a cell.
    pub(crate) fn scale(&self) -> u32 {
        1 << self.levels
    }

    /// Cells along the longest side.
    pub(crate) fn longest(&self) -> u32 {
        self.cells[0].max(self.cells[1]).max(self.cells[2])
    }

    /// Shortest side of a lattice step.
    pub(crate) fn lattice_step(&self) -> f64 {
        let size = self.domain.size();
        let side = |k: usize| size[k] / f64::from(self.cells[k] << self.levels);
        side(0).min(side(1)).min(side(2))
    }

    /// Lattice coordinate of the far side along `axis`.
    pub(crate) fn end(&self, axis: usize) -> u32 {
        self.cells[axis] << self.levels
    }

    fn coordinate(&self, axis: usize, at: u32) -> f64 {
        let (min, max) = (self.domain.min[axis], self.domain.max[axis]);
        // Both ends exactly: what is shown for the sides of the box must hold for the grid.
        if at == self.end(axis) {
            return max;
        }
        min + (max - min) * (f64::from(at) / f64::from(self.end(axis)))
    }

    /// Position of a lattice point.
    pub(crate) fn point(&self, at: Site) -> Vec3 {
        Vec3::new(self.coordinate(0, at[0]), self.coordinate(1, at[1]), self.coordinate(2, at[2]))
    }

    /// The box between two lattice points, with the very floats of [`Self::point`] as bounds.
    pub(crate) fn intervals(&self, lo: Site, hi: Site) -> [Interval; 3] {
        [0, 1, 2].map(|k| Interval::new(self.coordinate(k, lo[k]), self.coordinate(k, hi[k])))
    }

    /// The box of cells `lo .. hi`.
    pub(crate) fn cell_box(&self, lo: Site, hi: Site) -> Aabb {
        let corner = |at: Site| self.point(at.map(|c| c << self.levels));
        Aabb::new(corner(lo), corner(hi))
    }
}

/// The coordinates of the planes of a lattice: looked up, since those of a point take divisions.
#[derive(Clone, Debug)]
pub(crate) struct Planes([Vec<f64>; 3]);

impl Planes {
    /// Planes from which on they would take too much memory.
    const MOST: u32 = 1 << 17;

    /// All, or none where they are too many.
    pub(crate) fn of(grid: &Grid) -> Self {
        let fits = grid.longest() << grid.levels < Self::MOST;
        let planes = |axis: usize| (0..=grid.end(axis)).map(move |at| grid.coordinate(axis, at));
        Self([0, 1, 2].map(|axis| if fits { planes(axis).collect() } else { Vec::new() }))
    }

    /// [`Grid::point`], the same bits.
    #[inline]
    pub(crate) fn point(&self, grid: &Grid, at: Site) -> Vec3 {
        let [x, y, z] = &self.0;
        match (x.get(at[0] as usize), y.get(at[1] as usize), z.get(at[2] as usize)) {
            (Some(&x), Some(&y), Some(&z)) => Vec3::new(x, y, z),
            _ => grid.point(at),
        }
    }
}

/// Packs a lattice point.
pub(crate) fn pack(at: Site) -> u64 {
    u64::from(at[0]) | u64::from(at[1]) << SITE_BITS | u64::from(at[2]) << (2 * SITE_BITS)
}

/// Unpacks a lattice point.
pub(crate) fn unpack(key: u64) -> Site {
    [0, SITE_BITS, 2 * SITE_BITS].map(|shift| (key >> shift) as u32 & ((1 << SITE_BITS) - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_ends_exactly_on_the_sides_of_its_box_and_has_nearly_cubic_cells() {
        let domain = Aabb::new(Vec3::new(-0.1, 0.3, 1.0), Vec3::new(0.7, 0.7, 1.3));
        let grid = Grid::new(domain, 16, 4);
        assert_eq!(grid.cells, [16, 8, 6]);
        assert_eq!(grid.point([0, 0, 0]), domain.min);
        assert_eq!(grid.point([256, 128, 96]), domain.max);
        assert!((grid.lattice_step() - 0.05 / 16.0).abs() < 1e-15);
    }

    #[test]
    fn a_flat_box_gets_six_cells_across() {
        let domain = Aabb::new(Vec3::zeros(), Vec3::new(1.0, 1.0, 1e-3));
        assert_eq!(Grid::new(domain, 16, 4).cells, [16, 16, 6]);
        assert_eq!(Grid::new(domain, 2, 4).cells, [2, 2, 2]);
    }

    #[test]
    fn packing_a_site_is_undone_by_unpacking() {
        let end = (1 << SITE_BITS) - 1;
        for at in [[0, 0, 0], [1, 2, 3], [end, 0, end], [end, end, end]] {
            assert_eq!(unpack(pack(at)), at);
        }
    }
}
