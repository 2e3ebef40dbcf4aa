//! How far quartics between vertices are from the surface, their samples kept as the evaluator takes
//! them.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::quartic::{End, MoveToQuartics, Samples};
use crate::vertex::Vertex;
use isospline_fitting::lanes::{Lanes, Mask, N, Vectors};
use isospline_implicit::{BLOCK, Field, Kernel, run_widest};

/// Inner samples, at `t = 1/6 .. 5/6`: the network stage takes 15, five rank edges as well.
pub(crate) const N_SAMPLES: usize = 5;
/// Edges whose samples fill whole blocks of the evaluator.
pub(crate) const MOST_EDGES: usize = BLOCK;
/// Error, times the chord, of an edge without a sound curve: worse than any other.
const UNSOUND: f64 = 0.1;
/// Rows of lanes a block.
const ROWS: usize = BLOCK / N;

/// Coordinates of the points of a block, x of all, then y and z.
type Block = [[f64; BLOCK]; 3];
/// Values at the points of a block, then the three slopes.
type Jets = [[f64; BLOCK]; 4];

/// Largest distance from the surface of the quartic between each pair of vertices, in model units;
/// [`MOST_EDGES`] at most.
///
/// The quartic has position, tangent plane and normal curvature of the surface at both ends and is
/// the nearest such curve to the projected chord [TK, Eq. (9)]: what the network stage will fit,
/// from fewer samples. Fifteen gradient evaluations an edge.
pub(crate) fn quartic_errors(field: &dyn Field, edges: &[[&Vertex; 2]]) -> Vec<f64> {
    let samples = Samples::new();
    let (ends, mut places) = run_widest(Chords { samples: &samples, edges });
    let mut jets = [[0.0; BLOCK]; 4];
    for _ in 0..2 {
        for (n, block) in places.blocks() {
            field.gradient_block(n, block, &mut jets);
            run_widest(NewtonStep { block, jets: &jets });
        }
    }
    let sound = run_widest(MoveToQuartics { samples: &samples, ends: &ends, places: &mut places });
    let mut worst = vec![Lanes::all(0.0); ends.len()];
    for (b, (n, block)) in places.blocks().enumerate() {
        field.gradient_block(n, block, &mut jets);
        run_widest(Distances { jets: &jets, rows: b * ROWS..b * ROWS + n / N, worst: &mut worst });
    }
    let error = |(k, [p, q]): (usize, &[&Vertex; 2])| {
        let (group, lane) = (k / N, k % N);
        let (distance, Mask(sound)) = (worst[group].0[lane], sound[group]);
        let usable = sound[lane] && distance.is_finite();
        if usable { distance } else { UNSOUND * (q.position - p.position).norm() }
    };
    edges.iter().enumerate().map(error).collect()
}

/// The samples of edges, eight edges a group. Row `N_SAMPLES * group + sample` of eight lanes holds
/// a sample of a group; rows fill the blocks one after another.
pub(crate) struct Places {
    n_rows: usize,
    blocks: Vec<Block>,
}

impl Places {
    #[inline(always)]
    pub(crate) fn row(&self, group: usize, sample: usize) -> Vectors {
        let row = N_SAMPLES * group + sample;
        vectors(&self.blocks[row / ROWS], row % ROWS)
    }

    #[inline(always)]
    pub(crate) fn set_row(&mut self, group: usize, sample: usize, vectors: Vectors) {
        let row = N_SAMPLES * group + sample;
        store(&mut self.blocks[row / ROWS], row % ROWS, vectors);
    }

    /// The blocks in use, each with the number of its points.
    fn blocks(&mut self) -> impl Iterator<Item = (usize, &mut Block)> {
        let n_rows = self.n_rows;
        let rows = move |b: usize| (n_rows - ROWS * b).min(ROWS);
        self.blocks.iter_mut().enumerate().map(move |(b, block)| (N * rows(b), block))
    }
}

#[inline(always)]
fn lanes(numbers: &[f64; BLOCK], row: usize) -> Lanes {
    Lanes(numbers.as_chunks().0[row])
}

#[inline(always)]
fn vectors([x, y, z]: &Block, row: usize) -> Vectors {
    Vectors([lanes(x, row), lanes(y, row), lanes(z, row)])
}

#[inline(always)]
fn store(block: &mut Block, row: usize, vectors: Vectors) {
    for (axis, lanes) in block.iter_mut().zip(vectors.0) {
        axis.as_chunks_mut().0[row] = lanes.0;
    }
}

/// The ends of edges, eight together, and the samples on their chords.
struct Chords<'a> {
    samples: &'a Samples,
    edges: &'a [[&'a Vertex; 2]],
}

impl Kernel for Chords<'_> {
    type Output = (Vec<[End; 2]>, Places);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let n_groups = self.edges.len().div_ceil(N);
        let n_rows = N_SAMPLES * n_groups;
        let blocks = vec![[[0.0; BLOCK]; 3]; n_rows.div_ceil(ROWS)];
        let mut places = Places { n_rows, blocks };
        let mut all = Vec::with_capacity(n_groups);
        for (group, edges) in self.edges.chunks(N).enumerate() {
            // Idle lanes hold the last edge.
            let last = edges.len() - 1;
            let from = End::of(|k| edges[k.min(last)][0]);
            let to = End::of(|k| edges[k.min(last)][1]);
            let chord = to.position - from.position;
            for (s, &t) in self.samples.places.iter().enumerate() {
                places.set_row(group, s, from.position + chord.times(Lanes::all(t)));
            }
            all.push([from, to]);
        }
        (all, places)
    }
}

/// A step from each point of a block to the surface.
struct NewtonStep<'a> {
    block: &'a mut Block,
    jets: &'a Jets,
}

impl Kernel for NewtonStep<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [values, slopes @ ..] = self.jets;
        // Rows beyond the last point hold any numbers.
        for row in 0..ROWS {
            let gradient = vectors(slopes, row);
            let factor = lanes(values, row) / gradient.dot(gradient);
            store(self.block, row, vectors(self.block, row) - gradient.times(factor));
        }
    }
}

/// Takes the distances of the samples in some rows in.
struct Distances<'a> {
    jets: &'a Jets,
    rows: std::ops::Range<usize>,
    /// Largest distances so far, a group; infinite where one is no number.
    worst: &'a mut [Lanes],
}

impl Kernel for Distances<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [values, slopes @ ..] = self.jets;
        for (row, of_all) in self.rows.enumerate() {
            let gradient = vectors(slopes, row);
            let size = gradient.dot(gradient).map(f64::sqrt);
            let distance = lanes(values, row).map(f64::abs) / size;
            let worst = &mut self.worst[of_all / N_SAMPLES];
            *worst = worst.with(distance, |worst, distance| {
                if distance.is_finite() { worst.max(distance) } else { f64::INFINITY }
            });
        }
    }
}
