//! Merging edges where curves stay good: room for faces elsewhere.

use crate::curve_error::JudgedEdge;
use crate::error_cache::EdgeError;
use crate::gate::Gate;
use crate::improve::{ROOM, first_by};
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;
use isospline_stage::{Serial, map};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Candidates judged in a task, of some ten curves each.
const CANDIDATES_A_TASK: usize = 16;
/// Candidates judged together at least: some tasks for each thread.
const FEWEST_JUDGED: usize = 64;

/// Merges up to `n_wanted` edges whose new curves stay below `limit`; best first.
pub(crate) fn collapse_round(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    errors: &[EdgeError],
    (limit, n_wanted): (f64, usize),
) -> u64 {
    let candidates = collapse_candidates(surface, gate, errors, (limit, n_wanted));
    let is_below = |error: f64| error < limit || limit == f64::INFINITY;
    // The longest spoke tells of most candidates that they will not do.
    let mut bounds = judged(surface, &candidates, |fan| vec![take_longest(fan)]);
    bounds.retain(|rank| is_below(rank.error));
    bounds.sort_unstable();
    let mut bounds = bounds.as_slice();
    let mut ranks = BinaryHeap::new();
    let mut touched = vec![false; surface.mesh.vertex_rows()];
    let mut n_collapsed = 0;
    while n_collapsed < n_wanted {
        if bounds.first().is_none_or(|bound| ranks.peek().is_some_and(|Reverse(r)| r < bound)) {
            let Some(Reverse(Rank { candidate, .. })) = ranks.pop() else { break };
            let (h, merged) = &candidates[candidate];
            n_collapsed += usize::from(collapsed(surface, gate, (*h, merged), &mut touched));
            continue;
        }
        // The others are judged by all spokes when their turn may have come.
        let n = FEWEST_JUDGED.max(n_wanted - n_collapsed).min(bounds.len());
        let (batch, rest) = bounds.split_at(n);
        bounds = rest;
        let is_free = |bound: &&Rank| is_free(surface, candidates[bound.candidate].0, &touched);
        let open: Vec<Rank> = batch.iter().filter(is_free).copied().collect();
        let chosen: Vec<_> = open.iter().map(|bound| candidates[bound.candidate]).collect();
        let others = judged(surface, &chosen, |fan| {
            take_longest(fan);
            std::mem::take(fan)
        });
        let whole = open.iter().zip(others).map(|(bound, rest)| Rank {
            error: bound.error.max(rest.error),
            candidate: bound.candidate,
        });
        ranks.extend(whole.filter(|rank| is_below(rank.error)).map(Reverse));
    }
    n_collapsed as u64
}

/// A candidate by the error of the curves that merging gives: the least first, then in their order.
#[derive(Clone, Copy, Debug)]
struct Rank {
    error: f64,
    candidate: usize,
}

impl Ord for Rank {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then(self.candidate.cmp(&other.candidate))
    }
}

impl PartialOrd for Rank {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Rank {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Rank {}

/// Merges an edge if nothing about it has changed and the gate bears it.
fn collapsed(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    (h, merged): (HalfEdge, &Vertex),
    touched: &mut [bool],
) -> bool {
    // The surroundings are as they were, but the link condition may look beyond them.
    if !is_free(surface, h, touched) || !surface.collapse_is_better(gate, h, merged, ROOM) {
        return false;
    }
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    for v in ring(surface, h).chain(ends) {
        touched[v as usize] = true;
    }
    surface.collapse(h, *merged);
    true
}

/// Whether an edge is there and nothing about it was touched.
fn is_free(surface: &SurfaceMesh<'_>, h: HalfEdge, touched: &[bool]) -> bool {
    surface.mesh.is_face(h.face())
        && ring(surface, h).chain([surface.mesh.origin(h)]).all(|v| !touched[v as usize])
}

/// Of each candidate the largest error of those curves about the merged vertex that are picked;
/// 0 if none are.
fn judged<'s>(
    surface: &'s SurfaceMesh<'_>,
    candidates: &'s [(HalfEdge, Vertex)],
    pick: impl Fn(&mut Vec<JudgedEdge<'s>>) -> Vec<JudgedEdge<'s>> + Sync,
) -> Vec<Rank> {
    let tasks: Vec<_> = candidates.chunks(CANDIDATES_A_TASK).collect();
    let errors = map(surface.host, tasks.len(), |task| {
        let (mut owners, mut edges) = (Vec::new(), Vec::new());
        for (k, candidate) in tasks[task].iter().enumerate() {
            edges.extend(pick(&mut fan(surface, candidate)));
            owners.resize(edges.len(), k);
        }
        let mut errors = vec![0.0f64; tasks[task].len()];
        let found = surface.measure.errors(surface.field, &Serial, &edges);
        for (k, error) in owners.into_iter().zip(found) {
            errors[k] = errors[k].max(error);
        }
        errors
    });
    let ranks = errors.concat().into_iter().enumerate();
    ranks.map(|(candidate, error)| Rank { error, candidate }).collect()
}

/// The edges about a merged vertex.
fn fan<'s>(
    surface: &'s SurfaceMesh<'_>,
    (h, merged): &'s (HalfEdge, Vertex),
) -> Vec<JudgedEdge<'s>> {
    let spoke = |v: u32| JudgedEdge { ends: [merged, surface.at(v)], wings: None };
    // A wing comes twice, and its curve need not be judged twice.
    let end = surface.mesh.origin(*h);
    let second = surface.mesh.valence(end) - 1;
    let wings = surface.wings(*h).unwrap_or([end; 2]);
    let places = ring(surface, *h).enumerate();
    places.filter(|(k, v)| *k < second || !wings.contains(v)).map(|(_, v)| spoke(v)).collect()
}

fn take_longest<'s>(fan: &mut Vec<JudgedEdge<'s>>) -> JudgedEdge<'s> {
    let length_sq = |e: &JudgedEdge<'_>| (e.ends[1].position - e.ends[0].position).norm_squared();
    let longest = (0..fan.len()).max_by(|&i, &j| length_sq(&fan[i]).total_cmp(&length_sq(&fan[j])));
    fan.swap_remove(longest.expect("invariant: an edge has vertices about it"))
}

/// Edges in the quietest places whose merging the gate bears, with the merged vertex.
fn collapse_candidates(
    surface: &SurfaceMesh<'_>,
    gate: &Gate,
    errors: &[EdgeError],
    (limit, n_wanted): (f64, usize),
) -> Vec<(HalfEdge, Vertex)> {
    let mut around = vec![0.0f64; surface.mesh.vertex_rows()];
    for &(h, error) in errors {
        for v in [surface.mesh.origin(h), surface.mesh.target(h)] {
            around[v as usize] = around[v as usize].max(error);
        }
    }
    let score = |h: HalfEdge| {
        let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
        around[ends[0] as usize].max(around[ends[1] as usize])
    };
    let quiet: Vec<EdgeError> =
        errors.iter().map(|&(h, _)| (h, score(h))).filter(|&(_, e)| e < limit).collect();
    // Neighbours exclude each other and the gate refuses some: look at more than are wanted.
    let quiet = first_by(quiet, 6 * n_wanted + 32, |x, y| x.1.total_cmp(&y.1).then(x.0.cmp(&y.0)));
    let middles: Vec<_> = quiet.iter().map(|&(h, _)| surface.middle(h)).collect();
    let merged = surface.feet(&middles);
    let found: Vec<(HalfEdge, Vertex)> =
        quiet.iter().zip(merged).filter_map(|(&(h, _), merged)| Some((h, merged?))).collect();
    let tasks: Vec<_> = found.chunks(CANDIDATES_A_TASK).collect();
    map(surface.host, tasks.len(), |task| {
        let is_good =
            |(h, merged): &&(HalfEdge, Vertex)| surface.collapse_is_better(gate, *h, merged, ROOM);
        tasks[task].iter().filter(is_good).copied().collect::<Vec<_>>()
    })
    .concat()
}

/// The vertices about an edge: the neighbours of its ends without the ends; wings come twice.
fn ring<'s>(surface: &'s SurfaceMesh<'_>, h: HalfEdge) -> impl Iterator<Item = u32> + 's {
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    ends.into_iter().flat_map(|v| surface.mesh.neighbours(v)).filter(move |v| !ends.contains(v))
}
