//! Rounds of local edits until every face is fit.

use crate::gate::{Gate, slope, turning_deg};
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use crate::{AdaptError, AdaptParams};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::{Counters, Ctx, map};
use std::collections::VecDeque;

/// An edit must leave at most this part of the badness, or no unfit face: smaller gains would let
/// edits chase each other.
const GAIN: f64 = 0.95;
/// Badness (1 is unfit) from which faces are repaired where the mesh may be improved: above it
/// lie slivers and edges near the gate.
const SOFT: f64 = 0.9;
/// Least part of an edge that a split leaves on either side.
const SHORTEST_HALF: f64 = 0.1;
/// Splits may grow the mesh to this many times its faces: a sharp edge is not rounded by any number
/// of faces, and what a smooth surface needs beyond this it should get from `target.faces`.
const GROWTH: usize = 4;
/// Faces that a small mesh may grow to in any case.
const GROWTH_FLOOR: usize = 4000;
/// Rounds of the soft repair: what two passes of flips and slides do not mend, they never do.
const SOFT_ROUNDS: u32 = 3;
/// Faces judged in a task.
const FACES_A_TASK: usize = 512;
/// Faces for which edits are sought together, before any of them is made.
const MENDS_AT_ONCE: usize = 128;
/// Faces for which edits are sought in a task.
const MENDS_A_TASK: usize = 16;

/// Makes every face fit, by flips, slides and collapses where they help and by splits where not.
///
/// # Errors
/// [`AdaptError::Unfit`] if faces are unfit after `params.max_rounds`.
pub(crate) fn make_fit(
    ctx: &Ctx<'_>,
    surface: &mut SurfaceMesh<'_>,
    params: &AdaptParams,
    search: &mut Search,
    counters: &mut Counters,
) -> Result<(), AdaptError> {
    let gate = Gate::new(params);
    let most_faces = (GROWTH * surface.mesh.face_count()).max(GROWTH_FLOOR);
    for round in 0..params.max_rounds {
        let unfit = search.faces_above(surface, &gate, |s, f| gate.face(&s.corners(f)), 1.0);
        if unfit.is_empty() {
            return Ok(());
        }
        if surface.mesh.face_count() > most_faces {
            break;
        }
        if round == 0 {
            counters.count("unfit_faces_in", unfit.len() as u64);
        }
        ctx.host.progress(u64::from(round), u64::from(params.max_rounds))?;
        fit_round(surface, &gate, &unfit, search, counters);
    }
    match worst_edge(surface, &gate) {
        None => Ok(()),
        Some(error) => Err(error),
    }
}

/// Makes an edit of each of these faces that is still unfit, the worst first.
fn fit_round(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    unfit: &[u32],
    search: &mut Search,
    counters: &mut Counters,
) {
    let is_unfit =
        |s: &SurfaceMesh<'_>, face: u32| s.mesh.is_face(face) && gate.face(&s.corners(face)) > 1.0;
    let mut split_near = vec![false; surface.mesh.vertex_rows()];
    for batch in unfit.chunks(MENDS_AT_ONCE) {
        let is_due = |&f: &u32| is_unfit(surface, f) && !search.is_vain(surface, f);
        let due = batch.iter().copied().filter(is_due).collect();
        let mut sought = Sought::of(surface, gate, due);
        for &face in batch {
            let known = sought.take(surface, face);
            if !is_unfit(surface, face) {
                continue;
            }
            let mend = match known {
                Known::Mend(mend) => Some(mend),
                Known::Nothing => None,
                Known::Open if search.is_vain(surface, face) => None,
                Known::Open => mend_of(surface, gate, face),
            };
            if let Some(mend) = mend {
                mend.make(surface, counters);
            } else {
                search.note_vain(surface.now(), face);
                split(surface, gate, face, &mut split_near, counters);
            }
        }
    }
}

/// Flips, slides and collapses slivers and edges near the gate; nothing is split.
pub(crate) fn soften(
    surface: &mut SurfaceMesh<'_>,
    params: &AdaptParams,
    search: &mut Search,
    counters: &mut Counters,
) {
    let gate = Gate::new(params);
    let cost = |s: &SurfaceMesh<'_>, f: u32| gate.face_with_quality(&s.corners(f));
    // What no edit mended stays so until something near it changes.
    let mut changed = vec![true; surface.mesh.vertex_rows()];
    for _ in 0..SOFT_ROUNDS {
        let before = std::mem::replace(&mut changed, vec![false; surface.mesh.vertex_rows()]);
        for batch in search.faces_above(surface, &gate, cost, SOFT).chunks(MENDS_AT_ONCE) {
            let is_due = |s: &SurfaceMesh<'_>, changed: &[bool], face: u32| {
                let is_new = |&v: &u32| before[v as usize] || changed[v as usize];
                s.mesh.is_face(face) && s.mesh.face(face).iter().any(is_new) && cost(s, face) > SOFT
            };
            let due = batch.iter().copied().filter(|&f| is_due(surface, &changed, f)).collect();
            let mut sought = Sought::of(surface, &gate, due);
            for &face in batch {
                let known = sought.take(surface, face);
                if !is_due(surface, &changed, face) {
                    continue;
                }
                let mend = match known {
                    Known::Mend(mend) => Some(mend),
                    Known::Nothing => None,
                    Known::Open => mend_of(surface, &gate, face),
                };
                let Some(mend) = mend else {
                    search.note_vain(surface.now(), face);
                    continue;
                };
                let center = mend.make(surface, counters);
                changed[center as usize] = true;
                surface.mesh.neighbours(center).for_each(|v| changed[v as usize] = true);
            }
        }
    }
}

/// What one round of the repair knows from those before it, whose limit was not higher.
#[derive(Debug, Default)]
pub(crate) struct Search {
    /// When an edit of each face was last sought in vain; 0 is never.
    vain: Vec<u32>,
    /// When all faces were known; 0 is before all.
    complete: u32,
    /// The faces above the limit then, ascending.
    above: Vec<u32>,
}

impl Search {
    fn note_vain(&mut self, time: u32, face: u32) {
        let n_faces = self.vain.len().max(face as usize + 1);
        self.vain.resize(n_faces, 0);
        self.vain[face as usize] = time;
    }

    /// Whether an edit was sought and nothing that it would depend on has changed since.
    fn is_vain(&self, surface: &SurfaceMesh<'_>, face: u32) -> bool {
        let time = self.vain.get(face as usize).copied().unwrap_or(0);
        time > 0 && is_as_at(surface, time, face)
    }

    /// Faces whose `cost`, at most [`Gate::face_with_quality`], is above a limit, worst first. Only
    /// those that were edited or were above before can be.
    fn faces_above(
        &mut self,
        surface: &SurfaceMesh<'_>,
        gate: &Gate,
        cost: impl Fn(&SurfaceMesh<'_>, u32) -> f64 + Sync,
        limit: f64,
    ) -> Vec<u32> {
        let may_be =
            |f: u32| !surface.is_as_at(self.complete, f) || self.above.binary_search(&f).is_ok();
        let above = faces_above(surface, gate, may_be, cost, limit);
        self.above.clone_from(&above);
        self.above.sort_unstable();
        self.complete = surface.now();
        above
    }
}

/// Faces that `may_be` above a limit and whose `cost`, at most [`Gate::face_with_quality`], is, worst
/// first.
fn faces_above(
    surface: &SurfaceMesh<'_>,
    gate: &Gate,
    may_be: impl Fn(u32) -> bool + Sync,
    cost: impl Fn(&SurfaceMesh<'_>, u32) -> f64 + Sync,
    limit: f64,
) -> Vec<u32> {
    let rows = surface.mesh.face_rows();
    let mut above: Vec<(f64, u32)> = map(surface.host, rows.div_ceil(FACES_A_TASK), |task| {
        let last = ((task + 1) * FACES_A_TASK).min(rows);
        let faces = (task * FACES_A_TASK..last).map(|f| f as u32);
        let may_be = |&f: &u32| {
            surface.mesh.is_face(f)
                && may_be(f)
                && !gate.is_clearly_below(&surface.corners(f), limit)
        };
        let costs = faces.filter(may_be).map(|f| (cost(surface, f), f));
        costs.filter(|&(c, _)| c > limit).collect::<Vec<_>>()
    })
    .concat();
    above.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    above.into_iter().map(|(_, f)| f).collect()
}

/// An edit that makes a face better without adding faces.
#[derive(Clone, Copy, Debug)]
enum Mend {
    Flip(HalfEdge),
    Slide(u32, Vertex),
    Collapse(HalfEdge, Vertex),
}

impl Mend {
    /// Makes it; the vertex in the middle, whose neighbours include all that it touches.
    fn make(self, surface: &mut SurfaceMesh<'_>, counters: &mut Counters) -> u32 {
        match self {
            Self::Flip(h) => {
                counters.repair("edges_flipped", 1);
                let turned = surface.flip(h);
                surface.mesh.origin(turned)
            }
            Self::Slide(vertex, moved) => {
                counters.repair("vertices_slid", 1);
                surface.place(vertex, moved);
                vertex
            }
            Self::Collapse(h, merged) => {
                counters.repair("vertices_collapsed", 1);
                let kept = surface.mesh.origin(h);
                surface.collapse(h, merged);
                kept
            }
        }
    }
}

/// Edits sought together, before any of them is made.
struct Sought {
    time: u32,
    /// Of each face, in their order.
    mends: VecDeque<(u32, Option<Mend>)>,
}

impl Sought {
    fn of(surface: &SurfaceMesh<'_>, gate: &Gate, faces: Vec<u32>) -> Self {
        let found = mends(surface, gate, &faces);
        Self { time: surface.now(), mends: faces.into_iter().zip(found).collect() }
    }

    /// What was found for the next face, if it is this one.
    fn take(&mut self, surface: &SurfaceMesh<'_>, face: u32) -> Known {
        match self.mends.pop_front_if(|(next, _)| *next == face) {
            Some((_, mend)) if is_as_at(surface, self.time, face) => {
                mend.map_or(Known::Nothing, Known::Mend)
            }
            _ => Known::Open,
        }
    }
}

/// What is known of a face.
enum Known {
    Mend(Mend),
    /// No edit helps.
    Nothing,
    /// Nobody has looked, or something has changed that its edit depends on.
    Open,
}

fn mend_of(surface: &SurfaceMesh<'_>, gate: &Gate, face: u32) -> Option<Mend> {
    mends(surface, gate, &[face]).pop().flatten()
}

/// For each face the first edit that helps, as if it were the only one; on the host's threads.
fn mends(surface: &SurfaceMesh<'_>, gate: &Gate, faces: &[u32]) -> Vec<Option<Mend>> {
    let tasks: Vec<_> = faces.chunks(MENDS_A_TASK).collect();
    map(surface.host, tasks.len(), |task| {
        let mut found: Vec<Option<Mend>> =
            tasks[task].iter().map(|&face| flip(surface, gate, face)).collect();
        for edit in [slides, collapses] {
            let open: Vec<usize> = (0..found.len()).filter(|&i| found[i].is_none()).collect();
            let faces: Vec<u32> = open.iter().map(|&i| tasks[task][i]).collect();
            for (i, mend) in open.into_iter().zip(edit(surface, gate, &faces)) {
                found[i] = mend;
            }
        }
        found
    })
    .concat()
}

/// Whether all that the edit of a face depends on is as it was at a time: itself, the faces about its
/// corners and about the vertices opposite to its sides.
fn is_as_at(surface: &SurfaceMesh<'_>, time: u32, face: u32) -> bool {
    if !surface.mesh.is_face(face) {
        return false;
    }
    let opposite = |h: HalfEdge| surface.mesh.opposite(h).map(|o| surface.mesh.origin(o.prev()));
    let beside = halves(face).into_iter().filter_map(opposite);
    surface.mesh.face(face).into_iter().chain(beside).all(|v| surface.fan_is_as_at(time, v))
}

fn halves(face: u32) -> [HalfEdge; 3] {
    [0, 1, 2].map(|k| HalfEdge::new(face, k))
}

/// The flip that leaves the best faces.
fn flip(surface: &SurfaceMesh<'_>, gate: &Gate, face: u32) -> Option<Mend> {
    let mut best: Option<(f64, HalfEdge)> = None;
    for h in halves(face) {
        let Some([before, after]) = surface.faces_of_flip(h) else { continue };
        let worst =
            |[x, y]: [[&Vertex; 3]; 2]| gate.face_with_quality(&x).max(gate.face_with_quality(&y));
        let limit = GAIN * worst(before);
        if !after.iter().all(|face| gate.is_below(face, limit)) || !surface.mesh.can_flip(h) {
            continue;
        }
        let after = worst(after);
        if after < limit && best.is_none_or(|(least, _)| after < least) {
            best = Some((after, h));
        }
    }
    best.map(|(_, h)| Mend::Flip(h))
}

/// For each face the move of a corner towards the middle of its neighbours, along the surface.
fn slides(surface: &SurfaceMesh<'_>, gate: &Gate, faces: &[u32]) -> Vec<Option<Mend>> {
    const PARTS: [f64; 3] = [1.0, 0.5, 0.25];
    let step = |v: u32| {
        let (n, sum) = surface
            .mesh
            .neighbours(v)
            .fold((0.0, Vec3::zeros()), |(n, sum), w| (n + 1.0, sum + surface.at(w).position));
        sum / n - surface.at(v).position
    };
    let tries = |face: &u32| {
        let corners = surface.mesh.face(*face);
        let steps = corners.map(step);
        let target = |i: usize| surface.at(corners[i / 3]).position + PARTS[i % 3] * steps[i / 3];
        let reach = |i: usize| steps[i / 3].norm();
        (0..9).map(|i| (target(i), reach(i))).collect::<Vec<_>>()
    };
    let feet = surface.feet_within(faces.iter().flat_map(tries));
    let best = |(&face, feet): (&u32, &[Option<Vertex>; 9])| {
        let corners = surface.mesh.face(face);
        let before = corners.map(|v| surface.fan_cost(gate, v));
        (0..9).find_map(|i| {
            let (v, moved) = (corners[i / 3], feet[i]?);
            let is_better = surface.move_is_better(gate, v, &moved, GAIN * before[i / 3]);
            is_better.then_some(Mend::Slide(v, moved))
        })
    };
    faces.iter().zip(feet.as_chunks::<9>().0).map(best).collect()
}

/// For each face the merging of the ends of a side, shortest first, if the faces left are fit and
/// better.
fn collapses(surface: &SurfaceMesh<'_>, gate: &Gate, faces: &[u32]) -> Vec<Option<Mend>> {
    let sides = |face: &u32| {
        let mut sides = halves(*face).map(|h| {
            let [p, q] = surface.ends(h);
            ((q.position - p.position).norm(), h)
        });
        sides.sort_by(|x, y| x.0.total_cmp(&y.0));
        sides
    };
    let sides: Vec<(f64, HalfEdge)> = faces.iter().flat_map(sides).collect();
    let middles = surface.feet_within(sides.iter().map(|&(length, h)| (surface.middle(h), length)));
    let merge = |(&(_, h), middle): (&(f64, HalfEdge), &Option<Vertex>)| {
        let ends = surface.ends(h).map(|v| *v);
        let before =
            [surface.mesh.origin(h), surface.mesh.target(h)].map(|v| surface.fan_cost(gate, v));
        let limit = (GAIN * before[0].max(before[1])).min(SOFT);
        let mut choices = middle.iter().copied().chain(ends);
        let merged = choices.find(|merged| surface.collapse_is_better(gate, h, merged, limit))?;
        Some(Mend::Collapse(h, merged))
    };
    let of_face = |(sides, middles): (&[(f64, HalfEdge)], &[Option<Vertex>])| {
        sides.iter().zip(middles).find_map(merge)
    };
    sides.chunks(3).zip(middles.chunks(3)).map(of_face).collect()
}

/// Splits the worst edge of the face at its middle, unless a corner has a new edge already.
fn split(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    face: u32,
    split_near: &mut [bool],
    counters: &mut Counters,
) {
    let mut sides = halves(face).map(|h| {
        let [p, q] = surface.ends(h);
        // Only an unfit edge is worth its own measure: of a folded face the longest edge goes.
        (gate.edge(p, q).max(1.0), (q.position - p.position).norm(), h)
    });
    sides.sort_by(|x, y| y.0.total_cmp(&x.0).then(y.1.total_cmp(&x.1)));
    let (_, length, h) = sides[0];
    let Some(wings) = surface.wings(h) else { return };
    let around = [wings[0], wings[1], surface.mesh.origin(h), surface.mesh.target(h)];
    // Vertices of this round lie beyond the list: next to them all is new.
    if around.iter().any(|&v| split_near.get(v as usize).copied().unwrap_or(true)) {
        return;
    }
    let Some(middle) = surface.foot_within(surface.middle(h), length) else { return };
    // Where the surface folds away below an edge the foot falls to an end: halves no shorter.
    let ends = surface.ends(h).map(|v| (v.position - middle.position).norm());
    if ends.iter().any(|&half| half < SHORTEST_HALF * length) {
        return;
    }
    if surface.split(h, middle).is_some() {
        counters.repair("edges_split", 1);
        for v in around {
            split_near[v as usize] = true;
        }
    }
}

/// The error that names the worst edge of an unfit face, if there is one.
fn worst_edge(surface: &SurfaceMesh<'_>, gate: &Gate) -> Option<AdaptError> {
    let unfit = faces_above(surface, gate, |_| true, |s, f| gate.face(&s.corners(f)), 1.0);
    let badness = |h: HalfEdge| {
        let [p, q] = surface.ends(h);
        gate.edge(p, q)
    };
    let h = halves(*unfit.first()?)
        .into_iter()
        .max_by(|&x, &y| badness(x).total_cmp(&badness(y)))
        .expect("invariant: a face has edges");
    let [p, q] = surface.ends(h);
    Some(AdaptError::Unfit {
        unfit_faces: unfit.len() as u32,
        place: surface.middle(h),
        turning_deg: turning_deg(p, q),
        slope: slope(p, q),
    })
}
