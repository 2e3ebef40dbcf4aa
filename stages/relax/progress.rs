//! How far the sweeps have come, and as bytes that an ended run goes on from.

use crate::samples::Interior;
use crate::tile_solve::{FIRST_DAMPING, Outcome};
use crate::tiling::Tile;
use isospline_geometry::Vec3;

/// The surface between two visits, and what the visits to come depend on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Progress {
    /// Colours visited, over all sweeps.
    pub(crate) colours: u64,
    /// Tiles visited.
    pub(crate) visits: u64,
    /// Of these, those that found no step.
    pub(crate) idle_visits: u64,
    /// By tile.
    pub(crate) tiles: Vec<TileState>,
    /// The free scalar of each edge.
    pub(crate) nu: Vec<f64>,
    /// By how much each edge between patches of degree 6 misses the tie of its ends, else empty.
    pub(crate) gap: Vec<f64>,
    /// By face.
    pub(crate) interior: Vec<Interior>,
}

/// A surface to begin with.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    /// By face.
    pub(crate) interior: Vec<Interior>,
    /// The free scalar of each edge.
    pub(crate) nu: Vec<f64>,
    /// By how much each edge between patches of degree 6 misses the tie of its ends, else empty.
    pub(crate) gap: Vec<f64>,
}

/// What a tile carries from visit to visit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TileState {
    pub(crate) damping: f64,
    /// Sweeps that it sits out.
    pub(crate) rest: u32,
    /// Steps taken.
    pub(crate) steps: u32,
}

/// Words of 8 bytes before the tiles.
const COUNTS: usize = 3;
/// Words of a tile.
const TILE: usize = 3;
/// Words of the interior of a face.
const INTERIOR: usize = 45;

impl Progress {
    /// No colour visited yet.
    pub(crate) fn new(start: Start, n_tiles: usize) -> Self {
        let Start { interior, nu, gap } = start;
        let tiles = vec![TileState { damping: FIRST_DAMPING, rest: 0, steps: 0 }; n_tiles];
        Self { colours: 0, visits: 0, idle_visits: 0, tiles, nu, gap, interior }
    }

    /// Moves the surface by what came of a visit.
    pub(crate) fn take(&mut self, tile: &Tile, outcome: Outcome) {
        self.visits += 1;
        self.idle_visits += u64::from(outcome.interior.is_none());
        for (&f, points) in tile.faces.iter().zip(outcome.interior.unwrap_or_default()) {
            self.interior[f as usize] = points;
        }
        for (&e, change) in tile.edges.iter().zip(&outcome.nu) {
            self.nu[e as usize] += change;
        }
        for (&e, change) in tile.edges.iter().zip(&outcome.gap) {
            self.gap[e as usize] += change;
        }
    }

    /// Little-endian words: counts, damping, rest and steps of each tile, `nu`, gaps, interiors.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let counts = [self.colours, self.visits, self.idle_visits];
        let words = |t: &TileState| [t.damping.to_bits(), t.rest.into(), t.steps.into()];
        let tiles = self.tiles.iter().flat_map(words);
        let points = self.interior.iter().flatten().flat_map(|p| [p.x, p.y, p.z]);
        let reals = self.nu.iter().chain(&self.gap).copied().chain(points).map(f64::to_bits);
        counts.into_iter().chain(tiles).chain(reals).flat_map(u64::to_le_bytes).collect()
    }

    /// What [`encode`](Self::encode) wrote of a surface and a tiling of the same sizes; `None` if
    /// the bytes are not that.
    pub(crate) fn decode(&self, bytes: &[u8]) -> Option<Self> {
        let (words, []) = bytes.as_chunks::<8>() else { return None };
        let words: Vec<u64> = words.iter().map(|w| u64::from_le_bytes(*w)).collect();
        let (counts, rest) = words.split_at_checked(COUNTS)?;
        let (tiles, rest) = rest.split_at_checked(TILE * self.tiles.len())?;
        let (nu, rest) = rest.split_at_checked(self.nu.len())?;
        let (gap, points) = rest.split_at_checked(self.gap.len())?;
        if points.len() != INTERIOR * self.interior.len() {
            return None;
        }
        let real = |&word: &u64| f64::from_bits(word);
        let tile = |[damping, rest, steps]: &[u64; TILE]| {
            let [rest, steps] = [rest, steps].map(|&n| u32::try_from(n).ok());
            Some(TileState { damping: real(damping), rest: rest?, steps: steps? })
        };
        let interior = |face: &[u64; INTERIOR]| -> Interior {
            std::array::from_fn(|i| {
                Vec3::new(real(&face[3 * i]), real(&face[3 * i + 1]), real(&face[3 * i + 2]))
            })
        };
        Some(Self {
            colours: counts[0],
            visits: counts[1],
            idle_visits: counts[2],
            tiles: tiles.as_chunks().0.iter().map(tile).collect::<Option<_>>()?,
            nu: nu.iter().map(real).collect(),
            gap: gap.iter().map(real).collect(),
            interior: points.as_chunks().0.iter().map(interior).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn progress(n_tiles: usize) -> Progress {
        let interior = |f: usize| std::array::from_fn(|i| Vec3::new(f as f64, i as f64, -0.1));
        let interior = (0..4).map(interior).collect();
        let start = Start { interior, nu: vec![0.25; 6], gap: vec![1e-9; 6] };
        let mut progress = Progress::new(start, n_tiles);
        progress.tiles[1] = TileState { damping: 1e-9, rest: 2, steps: 1 };
        Progress { colours: 5, visits: 9, idle_visits: 1, ..progress }
    }

    #[test]
    fn progress_comes_back_from_its_bytes_and_from_no_others() {
        let (at, bytes) = (progress(3), progress(3).encode());
        let start = Start { interior: at.interior.clone(), nu: vec![0.0; 6], gap: vec![0.0; 6] };
        let new = Progress::new(start, 3);
        assert_eq!(new.decode(&bytes), Some(at));
        assert_eq!(progress(2).decode(&bytes), None, "another tiling");
        for length in 0..bytes.len() {
            assert_eq!(new.decode(&bytes[..length]), None, "{length} bytes");
        }
    }
}
