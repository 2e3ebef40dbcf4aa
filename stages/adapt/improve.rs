//! Rounds that move faces to where the edge curves are worst, at an equal number of faces.

use crate::AdaptParams;
use crate::curve_error::{JudgedEdge, Measure};
use crate::error_cache::{EdgeError, ErrorCache};
use crate::gate::{Gate, quality};
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;
use isospline_stage::{Counters, Ctx, Serial, Stopped, map};
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// A flip must make the curve of the edge this many times better.
const FLIP_GAIN: f64 = 1.2;
/// Part of the edges that are split a round, at most.
const SPLIT_SHARE: f64 = 0.02;
/// Edges above this part of a large error are split.
const SPLIT_ABOVE: f64 = 0.5;
/// The part of the edges with larger errors than that: they may be beyond mending, and must not
/// keep the rest from it.
const OUTLIER_SHARE: f64 = 0.002;
/// Collapses may leave this part of the error from which edges are split.
const COLLAPSE_BELOW: f64 = 0.7;
/// Badness (1 is unfit) that an edit may leave: short of the gate, so that later edits have room.
const ROOM: f64 = 0.85;
/// Rounds without a better mesh before giving up.
const PATIENCE: u32 = 2;
/// Candidates judged in a task, of some ten curves each.
const CANDIDATES_A_TASK: usize = 32;
/// Candidates judged together at least: two tasks.
const FEWEST_JUDGED: usize = 64;
/// Edges whose diagonals are judged together at least.
const FLIPS_AT_ONCE: usize = 1024;

/// Flips, collapses where curves are good and splits where they are bad; keeps the best round.
pub(crate) fn improve(
    ctx: &Ctx<'_>,
    surface: &mut SurfaceMesh<'_>,
    (params, n_faces): (&AdaptParams, usize),
    cache: &mut ErrorCache,
    counters: &mut Counters,
) -> Result<(), Stopped> {
    let gate = Gate::new(params);
    let mut best = surface.clone();
    let mut errors = cache.edges(surface);
    let mut best_score = Score::of(&errors);
    let mut failures = 0;
    let mut edits = Counters::default();
    let n_rounds = match surface.measure {
        Measure::Paper => params.improve_rounds,
        Measure::Normal(_) => params.normal_rounds,
    };
    for round in 0..n_rounds {
        ctx.host.progress(u64::from(round), u64::from(n_rounds))?;
        let flipped = flip_round(surface, &gate, &errors, cache);
        if flipped > 0 {
            errors = cache.edges(surface);
        }
        let (limit, n_splits) = split_limit(&errors);
        let excess = surface.mesh.face_count().saturating_sub(n_faces) / 2;
        let wanted = n_splits + excess;
        let collapsed = collapse_round(surface, &gate, &errors, (COLLAPSE_BELOW * limit, wanted));
        if collapsed > 0 {
            errors = cache.edges(surface);
        }
        let room = n_faces.saturating_sub(surface.mesh.face_count()) / 2;
        let split = split_round(surface, &gate, errors, room);
        edits.count("edges_flipped_for_error", flipped);
        edits.count("vertices_collapsed_for_error", collapsed);
        edits.count("edges_split_for_error", split);
        errors = cache.edges(surface);
        let score = Score::of(&errors);
        if score < best_score && surface.mesh.face_count() <= n_faces.max(best.mesh.face_count()) {
            best.keep(surface);
            (best_score, failures) = (score, 0);
            counters.merge(&std::mem::take(&mut edits));
        } else {
            failures += 1;
        }
        if failures > PATIENCE || flipped + collapsed + split == 0 {
            break;
        }
    }
    surface.go_back_to(best);
    Ok(())
}

/// Collapses where the curves stay best until at most `n_faces` are left or nothing can go.
pub(crate) fn trim(
    surface: &mut SurfaceMesh<'_>,
    (params, n_faces): (&AdaptParams, usize),
    cache: &mut ErrorCache,
    counters: &mut Counters,
) {
    let gate = Gate::new(params);
    // From collapses that nobody sees to any that the gate bears.
    for part in [0.25, 0.5, 1.0, 4.0, f64::INFINITY] {
        loop {
            let excess = surface.mesh.face_count().saturating_sub(n_faces).div_ceil(2);
            if excess == 0 {
                return;
            }
            let errors = cache.edges(surface);
            let limit = part * worst(&errors);
            let collapsed = collapse_round(surface, &gate, &errors, (limit, excess));
            counters.repair("vertices_collapsed_for_count", collapsed);
            if collapsed == 0 {
                break;
            }
        }
    }
}

/// Largest error of an edge curve, times the diagonal.
pub(crate) fn worst_curve_error_rel(surface: &SurfaceMesh<'_>, cache: &mut ErrorCache) -> f64 {
    worst(&cache.edges(surface)) / surface.diagonal
}

fn worst(errors: &[EdgeError]) -> f64 {
    errors.iter().map(|&(_, e)| e).fold(0.0, f64::max)
}

/// Errors of a mesh; meshes with the same worst edge are told apart by all others, so that one
/// stubborn edge does not stop the rest from getting better.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Score {
    worst: f64,
    sum_sq: f64,
}

impl Score {
    fn of(errors: &[EdgeError]) -> Self {
        Self { worst: worst(errors), sum_sq: errors.iter().map(|&(_, e)| e * e).sum() }
    }
}

/// The error above which edges are split, and how many they are.
fn split_limit(errors: &[EdgeError]) -> (f64, usize) {
    let mut errors: Vec<f64> = errors.iter().map(|&(_, e)| e).collect();
    let most = ((SPLIT_SHARE * errors.len() as f64) as usize).clamp(1, errors.len());
    let n_outliers = (OUTLIER_SHARE * errors.len() as f64) as usize;
    let (worse, &mut last, _) = errors.select_nth_unstable_by(most - 1, |x, y| y.total_cmp(x));
    worse.sort_unstable_by(|x, y| y.total_cmp(x));
    let large = worse.get(n_outliers).copied().unwrap_or(last);
    let limit = last.max(SPLIT_ABOVE * large);
    (limit, errors.iter().filter(|&&e| e >= limit).count())
}

/// Turns edges whose other diagonal has the better curve; worst first.
fn flip_round(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    errors: &[EdgeError],
    cache: &mut ErrorCache,
) -> u64 {
    let gains = |now: f64, then: f64| FLIP_GAIN * then < now;
    let may_gain =
        |&&(h, now): &&EdgeError| cache.known_diagonal(surface, h).is_none_or(|d| gains(now, d));
    let mut order: Vec<EdgeError> = errors.iter().filter(may_gain).copied().collect();
    order.sort_unstable_by(|x, y| y.1.total_cmp(&x.1).then(x.0.cmp(&y.0)));
    let mut touched = vec![false; surface.mesh.face_rows()];
    let mut n_flips = 0;
    // Batch by batch: a flip settles the edges about it, whose diagonals nobody asks for then.
    for batch in order.chunks(FLIPS_AT_ONCE.max(order.len() / 32)) {
        let is_free = |h: HalfEdge| {
            let faces = [Some(h), surface.mesh.opposite(h)].into_iter().flatten();
            faces.into_iter().all(|h| !touched[h.face() as usize])
        };
        let open: Vec<EdgeError> = batch.iter().filter(|&&(h, _)| is_free(h)).copied().collect();
        let halves: Vec<HalfEdge> = open.iter().map(|&(h, _)| h).collect();
        let others = cache.diagonals(surface, &halves, |h| keeps_shape(surface, h));
        for ((h, now), then) in open.into_iter().zip(others) {
            let Some(o) = surface.mesh.opposite(h) else { continue };
            let faces = [h.face() as usize, o.face() as usize];
            let is_free = !faces.iter().any(|&f| touched[f]);
            if gains(now, then) && is_free && flip_is_good(surface, gate, h) {
                surface.flip(h);
                for f in faces {
                    touched[f] = true;
                }
                n_flips += 1;
            }
        }
    }
    n_flips
}

fn flip_is_good(surface: &SurfaceMesh<'_>, gate: &Gate, h: HalfEdge) -> bool {
    let Some(wings) = surface.wings(h) else { return false };
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    ends.iter().all(|&v| surface.mesh.valence(v) > 4)
        && wings.iter().all(|&v| surface.mesh.valence(v) < 10)
        && keeps_shape(surface, h)
        && surface.flip_cost(gate, h).is_some_and(|[before, after]| after <= before.max(ROOM))
}

/// Whether a flip leaves no sliver. Unlike valences this stays so until a face beside the edge
/// changes: edges that a round begins without it cannot flip in that round.
fn keeps_shape(surface: &SurfaceMesh<'_>, h: HalfEdge) -> bool {
    let Some(wings) = surface.wings(h) else { return false };
    let [c, d] = wings.map(|v| surface.at(v));
    let [a, b] = surface.ends(h);
    let quality_of = |faces: [[&Vertex; 3]; 2]| quality(&faces[0]).min(quality(&faces[1]));
    let before = quality_of([[a, b, c], [b, a, d]]);
    quality_of([[d, c, a], [c, d, b]]) >= before.min(0.2)
}

/// Merges up to `n_wanted` edges whose new curves stay below `limit`; best first.
fn collapse_round(
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
    ring(surface, *h).map(spoke).collect()
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

/// The first `n` in order, sorted: most of a large mesh is never looked at.
fn first_by(
    mut edges: Vec<EdgeError>,
    n: usize,
    order: impl Fn(&EdgeError, &EdgeError) -> Ordering,
) -> Vec<EdgeError> {
    if n < edges.len() {
        edges.select_nth_unstable_by(n, &order);
        edges.truncate(n);
    }
    edges.sort_unstable_by(order);
    edges
}

/// The vertices about an edge: the neighbours of its ends without the ends; wings come twice.
fn ring<'s>(surface: &'s SurfaceMesh<'_>, h: HalfEdge) -> impl Iterator<Item = u32> + 's {
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    ends.into_iter().flat_map(|v| surface.mesh.neighbours(v)).filter(move |v| !ends.contains(v))
}

/// Splits up to `n_room` edges, the worst that can be, none beside another.
fn split_round(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    errors: Vec<EdgeError>,
    n_room: usize,
) -> u64 {
    let bad = first_by(errors, 12 * n_room, |x, y| y.1.total_cmp(&x.1).then(x.0.cmp(&y.0)));
    let mut touched = vec![false; surface.mesh.vertex_rows()];
    let mut n_split = 0;
    // Batch by batch: most of the later ones are not needed.
    for batch in bad.chunks(2 * n_room.max(16)) {
        if n_split == n_room {
            break;
        }
        let middles: Vec<_> = batch.iter().map(|&(h, _)| surface.middle(h)).collect();
        for (&(h, _), middle) in batch.iter().zip(surface.feet(&middles)) {
            let (Some(middle), Some(wings)) = (middle, surface.wings(h)) else { continue };
            let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
            let around = [ends[0], ends[1], wings[0], wings[1]];
            if n_split == n_room
                || around.iter().any(|&v| touched.get(v as usize).copied().unwrap_or(true))
                || !split_is_good(surface, gate, h, &middle)
            {
                continue;
            }
            if surface.split(h, middle).is_some() {
                for v in around {
                    touched[v as usize] = true;
                }
                n_split += 1;
            }
        }
    }
    n_split as u64
}

fn split_is_good(surface: &SurfaceMesh<'_>, gate: &Gate, h: HalfEdge, middle: &Vertex) -> bool {
    let [a, b] = surface.ends(h);
    let Some(wings) = surface.wings(h) else { return false };
    let [c, d] = wings.map(|v| surface.at(v));
    let halves = [[a, middle, c], [middle, b, c], [b, middle, d], [middle, a, d]];
    // An edge near the gate must stay open to the split that would mend it.
    let before = gate.face(&[a, b, c]).max(gate.face(&[b, a, d]));
    halves.iter().all(|face| gate.face_with_quality(face) < before.max(ROOM))
}
