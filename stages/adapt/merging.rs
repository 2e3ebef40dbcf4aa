//! Merging edges where curves stay good: room for faces elsewhere.

use crate::curve_error::JudgedEdge;
use crate::error_cache::EdgeError;
use crate::gate::Gate;
use crate::improve::ROOM;
use crate::known_merges::{KnownMerges, Merge};
use crate::ranking::{First, ranked};
use crate::surface_mesh::SurfaceMesh;
use isospline_geometry::HalfEdge;
use isospline_stage::{Serial, map};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Candidates judged in a task, of some ten curves each.
const CANDIDATES_A_TASK: usize = 16;
/// Edges looked at in a task.
const EDGES_A_TASK: usize = 64;
/// Candidates judged together at least: some tasks for each thread.
const FEWEST_JUDGED: usize = 64;

/// Merges up to `n_wanted` edges whose new curves stay below `limit`; best first.
pub(crate) fn collapse_round(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    errors: &[EdgeError],
    (limit, n_wanted): (f64, usize),
    known: &mut KnownMerges,
) -> u64 {
    let time = surface.now();
    let mut merges = merges_looked_at(surface, gate, errors, (limit, n_wanted), known);
    judge_longest(surface, &mut merges);
    let is_below = |rank: &Rank| rank.error < limit || limit == f64::INFINITY;
    // The longest spoke tells of most candidates that they will not do.
    let bound =
        |(candidate, merge): (usize, &Merge)| Some(Rank { error: merge.longest?, candidate });
    let mut bounds: Vec<Rank> = merges.iter().enumerate().filter_map(bound).collect();
    bounds.retain(is_below);
    bounds.sort_unstable();
    let mut bounds = bounds.as_slice();
    let mut ranks = BinaryHeap::new();
    let mut touched = vec![false; surface.mesh.vertex_rows()];
    let mut n_collapsed = 0;
    while n_collapsed < n_wanted {
        if bounds.first().is_none_or(|bound| ranks.peek().is_some_and(|Reverse(r)| r < bound)) {
            let Some(Reverse(Rank { candidate, .. })) = ranks.pop() else { break };
            n_collapsed += usize::from(collapsed(surface, gate, &merges[candidate], &mut touched));
            continue;
        }
        // The others are judged by all spokes when their turn may have come.
        let n = FEWEST_JUDGED.max(n_wanted - n_collapsed).min(bounds.len());
        let (batch, rest) = bounds.split_at(n);
        bounds = rest;
        let is_open = |bound: &&Rank| is_free(surface, merges[bound.candidate].h, &touched);
        let open: Vec<usize> = batch.iter().filter(is_open).map(|bound| bound.candidate).collect();
        judge_whole(surface, &mut merges, &open);
        let rank = |candidate: usize| Some(Rank { error: merges[candidate].whole?, candidate });
        ranks.extend(open.into_iter().filter_map(rank).filter(is_below).map(Reverse));
    }
    known.keep(time, merges);
    n_collapsed as u64
}

/// A merge by the error of the curves that it gives: the least first, then in their order.
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
    &Merge { h, merged, .. }: &Merge,
    touched: &mut [bool],
) -> bool {
    let Some(merged) = merged else { return false };
    // The surroundings are as they were, but the link condition may look beyond them.
    if !is_free(surface, h, touched) || !surface.collapse_is_better(gate, h, &merged, ROOM) {
        return false;
    }
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    for v in ring(surface, h).chain(ends) {
        touched[v as usize] = true;
    }
    surface.collapse(h, merged);
    true
}

/// Whether an edge is there and nothing about it was touched.
fn is_free(surface: &SurfaceMesh<'_>, h: HalfEdge, touched: &[bool]) -> bool {
    surface.mesh.is_face(h.face())
        && ring(surface, h).chain([surface.mesh.origin(h)]).all(|v| !touched[v as usize])
}

/// Judges the longest curve of each merge of which it is not known.
fn judge_longest(surface: &SurfaceMesh<'_>, merges: &mut [Merge]) {
    let is_open = |k: &usize| merges[*k].longest.is_none() && merges[*k].merged.is_some();
    let open: Vec<usize> = (0..merges.len()).filter(is_open).collect();
    let errors = judged(surface, merges, &open, |fan, edges| edges.push(take_longest(fan)));
    for (k, error) in open.into_iter().zip(errors) {
        merges[k].longest = Some(error);
    }
}

/// Judges the other curves of those merges of `among` of which they are not known.
fn judge_whole(surface: &SurfaceMesh<'_>, merges: &mut [Merge], among: &[usize]) {
    let open = among.iter().copied().filter(|&k| merges[k].whole.is_none());
    let open: Vec<usize> = open.collect();
    let errors = judged(surface, merges, &open, |fan, edges| {
        take_longest(fan);
        edges.extend_from_slice(fan);
    });
    for (k, error) in open.into_iter().zip(errors) {
        merges[k].whole = merges[k].longest.map(|longest| longest.max(error));
    }
}

/// Of each chosen merge the largest error of those curves about the merged vertex that are picked;
/// 0 if none are.
fn judged(
    surface: &SurfaceMesh<'_>,
    merges: &[Merge],
    chosen: &[usize],
    pick: impl for<'s> Fn(&mut Vec<JudgedEdge<'s>>, &mut Vec<JudgedEdge<'s>>) + Sync,
) -> Vec<f64> {
    let tasks: Vec<_> = chosen.chunks(CANDIDATES_A_TASK).collect();
    let errors = map(surface.host, tasks.len(), |task| {
        let most = 12 * tasks[task].len();
        let (mut owners, mut edges) = (Vec::with_capacity(most), Vec::with_capacity(most));
        let mut about = Vec::with_capacity(16);
        for (k, &candidate) in tasks[task].iter().enumerate() {
            about.clear();
            fan(surface, &merges[candidate], &mut about);
            pick(&mut about, &mut edges);
            owners.resize(edges.len(), k);
        }
        let mut errors = vec![0.0f64; tasks[task].len()];
        let found = surface.measure.errors(surface.field, &Serial, &edges);
        for (k, error) in owners.into_iter().zip(found) {
            errors[k] = errors[k].max(error);
        }
        errors
    });
    errors.concat()
}

/// Adds the edges about a merged vertex; none if there is no such vertex.
fn fan<'s>(surface: &'s SurfaceMesh<'_>, merge: &'s Merge, edges: &mut Vec<JudgedEdge<'s>>) {
    let (h, Some(merged)) = (merge.h, &merge.merged) else { return };
    let spoke = |v: u32| JudgedEdge { ends: [merged, surface.at(v)], wings: None };
    // A wing comes twice, and its curve need not be judged twice.
    let end = surface.mesh.origin(h);
    let second = surface.mesh.valence(end) - 1;
    let wings = surface.wings(h).unwrap_or([end; 2]);
    let places = ring(surface, h).enumerate();
    let places = places.filter(|(k, v)| *k < second || !wings.contains(v));
    edges.extend(places.map(|(_, v)| spoke(v)));
}

fn take_longest<'s>(fan: &mut Vec<JudgedEdge<'s>>) -> JudgedEdge<'s> {
    let length_sq = |e: &JudgedEdge<'_>| (e.ends[1].position - e.ends[0].position).norm_squared();
    let longest = (0..fan.len()).max_by(|&i, &j| length_sq(&fan[i]).total_cmp(&length_sq(&fan[j])));
    fan.swap_remove(longest.expect("invariant: an edge has vertices about it"))
}

/// Edges in the quietest places that can be merged, with what is known of it and whether the gate
/// bears it.
fn merges_looked_at(
    surface: &SurfaceMesh<'_>,
    gate: &Gate,
    errors: &[EdgeError],
    (limit, n_wanted): (f64, usize),
    known: &KnownMerges,
) -> Vec<Merge> {
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
    let quiet = errors.iter().map(|&(h, _)| (h, score(h))).filter(|&(_, e)| e < limit);
    // Neighbours exclude each other and the gate refuses some: look at more than are wanted.
    let quiet = ranked(quiet, 6 * n_wanted + 32, First::Least);
    let tasks: Vec<_> = quiet.chunks(EDGES_A_TASK).collect();
    map(surface.host, tasks.len(), |task| {
        let edges = tasks[task].iter().map(|&(h, _)| h).filter(|&h| surface.can_collapse(h));
        looked_at(surface, gate, edges, known)
    })
    .concat()
}

/// The merges of edges that can be merged.
fn looked_at(
    surface: &SurfaceMesh<'_>,
    gate: &Gate,
    edges: impl Iterator<Item = HalfEdge>,
    known: &KnownMerges,
) -> Vec<Merge> {
    let unknown = |h| Merge { h, merged: None, longest: None, whole: None };
    let (mut merges, mut new): (Vec<Merge>, Vec<usize>) = (Vec::new(), Vec::new());
    for h in edges {
        let merge = known.get(surface, h);
        if merge.is_none() {
            new.push(merges.len());
        }
        merges.push(merge.unwrap_or_else(|| unknown(h)));
    }
    let tries = new.iter().map(|&k| (surface.middle(merges[k].h), f64::INFINITY));
    let feet = surface.feet_within(tries);
    for (k, foot) in new.into_iter().zip(feet) {
        let h = merges[k].h;
        merges[k].merged =
            foot.filter(|merged| surface.faces_left_are_better(gate, h, merged, ROOM));
    }
    merges
}

/// The vertices about an edge: the neighbours of its ends without the ends; wings come twice.
fn ring<'s>(surface: &'s SurfaceMesh<'_>, h: HalfEdge) -> impl Iterator<Item = u32> + 's {
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    ends.into_iter().flat_map(|v| surface.mesh.neighbours(v)).filter(move |v| !ends.contains(v))
}
