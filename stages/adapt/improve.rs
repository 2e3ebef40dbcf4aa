//! Rounds that move faces to where the edge curves are worst, at an equal number of faces.

use crate::AdaptParams;
use crate::curve_error::Measure;
use crate::error_cache::{EdgeError, ErrorCache};
use crate::gate::{Gate, is_clearly_better, quality};
use crate::merging::collapse_round;
use crate::ranking::{First, ranked};
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;
use isospline_stage::{Counters, Ctx, Stopped};

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
pub(crate) const ROOM: f64 = 0.85;
/// Rounds without a better mesh before giving up.
const PATIENCE: u32 = 2;
/// Quality above which a face is no sliver, whatever it was before a flip.
const GOOD_QUALITY: f64 = 0.2;
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
        let limit = COLLAPSE_BELOW * limit;
        let collapsed = collapse_round(surface, &gate, &errors, (limit, wanted), &mut cache.merges);
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
            let collapsed =
                collapse_round(surface, &gate, &errors, (limit, excess), &mut cache.merges);
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
    let order = ranked(errors.iter().filter(may_gain).copied(), usize::MAX, First::Worst);
    let mut touched = vec![false; surface.mesh.face_rows()];
    let mut n_flips = 0;
    // Batch by batch: a flip settles the edges about it, whose diagonals nobody asks for then.
    for batch in order.chunks(FLIPS_AT_ONCE.max(order.len() / 32)) {
        let is_free = |h: HalfEdge| {
            let faces = [Some(h), surface.mesh.opposite(h)].into_iter().flatten();
            faces.into_iter().all(|h| !touched[h.face() as usize])
        };
        let open: Vec<EdgeError> = batch.iter().filter(|&&(h, _)| is_free(h)).copied().collect();
        let is_better = |h: HalfEdge, [now, then]: [f64; 2]| {
            gains(now, then) && keeps_shape(surface, h) && keeps_gate(surface, gate, h)
        };
        let better = cache.better_flips(surface, &open, |h| keeps_shape(surface, h), is_better);
        for h in better {
            let Some(o) = surface.mesh.opposite(h) else { continue };
            let faces = [h.face() as usize, o.face() as usize];
            let is_free = !faces.iter().any(|&f| touched[f]);
            if is_free && keeps_valences(surface, h) && surface.mesh.can_flip(h) {
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

fn keeps_valences(surface: &SurfaceMesh<'_>, h: HalfEdge) -> bool {
    let Some(wings) = surface.wings(h) else { return false };
    let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
    ends.iter().all(|&v| surface.mesh.valence(v) > 4)
        && wings.iter().all(|&v| surface.mesh.valence(v) < 10)
}

/// Whether the gate bears a flip. Like [`keeps_shape`] it stays so while the faces beside the edge
/// do.
fn keeps_gate(surface: &SurfaceMesh<'_>, gate: &Gate, h: HalfEdge) -> bool {
    let Some([before, after]) = surface.faces_of_flip(h) else { return false };
    let worst =
        |[x, y]: [[&Vertex; 3]; 2]| gate.face_with_quality(&x).max(gate.face_with_quality(&y));
    after.iter().all(|face| gate.is_clearly_below(face, ROOM))
        || worst(after) <= worst(before).max(ROOM)
}

/// Whether a flip leaves no sliver. Unlike valences this stays so until a face beside the edge
/// changes: edges that a round begins without it cannot flip in that round.
fn keeps_shape(surface: &SurfaceMesh<'_>, h: HalfEdge) -> bool {
    let Some([before, after]) = surface.faces_of_flip(h) else { return false };
    let worst = |[x, y]: [[&Vertex; 3]; 2]| quality(&x).min(quality(&y));
    after.iter().all(|face| is_clearly_better(face, GOOD_QUALITY))
        || worst(after) >= worst(before).min(GOOD_QUALITY)
}

/// Splits up to `n_room` edges, the worst that can be, none beside another.
fn split_round(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    errors: Vec<EdgeError>,
    n_room: usize,
) -> u64 {
    let bad = ranked(errors.into_iter(), 12 * n_room, First::Worst);
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
