//! Rounds that move faces to where the edge curves are worst, at an equal number of faces.

use crate::AdaptParams;
use crate::curve_error::{JudgedEdge, Measure};
use crate::error_cache::{EdgeError, ErrorCache};
use crate::gate::{Gate, quality};
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;
use isospline_stage::{Counters, Ctx, Serial, Stopped, map};
use std::cmp::Ordering;

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
        let others = cache.diagonals(surface, |h| keeps_shape(surface, h));
        let flipped = flip_round(surface, &gate, &errors, &others);
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
            (best, best_score, failures) = (surface.clone(), score, 0);
            counters.merge(&std::mem::take(&mut edits));
        } else {
            failures += 1;
        }
        if failures > PATIENCE || flipped + collapsed + split == 0 {
            break;
        }
    }
    *surface = best;
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
    others: &[EdgeError],
) -> u64 {
    let pairs = errors.iter().zip(others);
    let gains = pairs.filter(|((_, now), (_, then))| FLIP_GAIN * then < *now);
    let mut gains: Vec<EdgeError> = gains.map(|(&edge, _)| edge).collect();
    gains.sort_by(|x, y| y.1.total_cmp(&x.1).then(x.0.cmp(&y.0)));
    let mut touched = vec![false; surface.mesh.face_rows()];
    let mut n_flips = 0;
    for (h, _) in gains {
        let Some(o) = surface.mesh.opposite(h) else { continue };
        let faces = [h.face() as usize, o.face() as usize];
        if faces.iter().any(|&f| touched[f]) || !flip_is_good(surface, gate, h) {
            continue;
        }
        surface.mesh.flip(h);
        for f in faces {
            touched[f] = true;
        }
        n_flips += 1;
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
    let mut order: Vec<(f64, usize)> = merged_errors(surface, &candidates, limit);
    order.retain(|&(e, _)| e < limit || limit == f64::INFINITY);
    order.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    let mut touched = vec![false; surface.mesh.vertex_rows()];
    let mut n_collapsed = 0;
    for (_, k) in order {
        let (h, merged) = &candidates[k];
        if n_collapsed == n_wanted as u64 || !surface.mesh.is_face(h.face()) {
            continue;
        }
        let around: Vec<u32> = ring(surface, *h).chain([surface.mesh.origin(*h)]).collect();
        if around.iter().any(|&v| touched[v as usize]) {
            continue;
        }
        // The surroundings are as they were, but the link condition may look beyond them.
        if surface.collapse_is_better(gate, *h, merged, ROOM) {
            for v in around {
                touched[v as usize] = true;
            }
            touched[surface.mesh.target(*h) as usize] = true;
            surface.collapse(*h, *merged);
            n_collapsed += 1;
        }
    }
    n_collapsed
}

/// For each candidate the largest error of the curves that merging gives, and its place; of those
/// that reach `limit` one such error.
fn merged_errors(
    surface: &SurfaceMesh<'_>,
    candidates: &[(HalfEdge, Vertex)],
    limit: f64,
) -> Vec<(f64, usize)> {
    let tasks: Vec<_> = candidates.chunks(CANDIDATES_A_TASK).collect();
    let errors = map(surface.host, tasks.len(), |task| {
        let fans = tasks[task].iter().map(|candidate| fan(surface, candidate)).collect();
        merged_errors_of(surface, fans, limit)
    });
    errors.concat().into_iter().zip(0..).collect()
}

fn merged_errors_of(
    surface: &SurfaceMesh<'_>,
    mut fans: Vec<Vec<JudgedEdge<'_>>>,
    limit: f64,
) -> Vec<f64> {
    let judge = |edges: &[JudgedEdge<'_>]| surface.measure.errors(surface.field, &Serial, edges);
    // The longest spoke tells of most candidates that they will not do.
    let longest: Vec<JudgedEdge<'_>> = fans.iter_mut().map(take_longest).collect();
    let mut errors = judge(&longest);
    let (mut owners, mut rest) = (Vec::new(), Vec::new());
    for (k, fan) in fans.into_iter().enumerate() {
        if errors[k] < limit || limit == f64::INFINITY {
            rest.extend(fan);
            owners.resize(rest.len(), k);
        }
    }
    for (k, error) in owners.into_iter().zip(judge(&rest)) {
        errors[k] = errors[k].max(error);
    }
    errors
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
    surface: &mut SurfaceMesh<'_>,
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
    let mut candidates = Vec::new();
    for (&(h, _), merged) in quiet.iter().zip(&merged) {
        let Some(merged) = merged else { continue };
        if surface.collapse_is_better(gate, h, merged, ROOM) {
            candidates.push((h, *merged));
        }
    }
    candidates
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
    let middles: Vec<_> = bad.iter().map(|&(h, _)| surface.middle(h)).collect();
    let middles = surface.feet(&middles);
    let mut touched = vec![false; surface.mesh.vertex_rows()];
    let mut n_split = 0;
    for (&(h, _), middle) in bad.iter().zip(&middles) {
        let (Some(middle), Some(wings)) = (middle, surface.wings(h)) else { continue };
        let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
        let around = [ends[0], ends[1], wings[0], wings[1]];
        if n_split == n_room as u64
            || around.iter().any(|&v| touched.get(v as usize).copied().unwrap_or(true))
            || !split_is_good(surface, gate, h, middle)
        {
            continue;
        }
        if surface.split(h, *middle).is_some() {
            for v in around {
                touched[v as usize] = true;
            }
            n_split += 1;
        }
    }
    n_split
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
