//! Rounds of local edits until every face is fit.

use crate::gate::{Gate, slope, turning_deg};
use crate::surface_mesh::SurfaceMesh;
use crate::{AdaptError, AdaptParams};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::{Counters, Ctx, map};

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
const FACES_A_TASK: usize = 2048;

/// Makes every face fit, by flips, slides and collapses where they help and by splits where not.
///
/// # Errors
/// [`AdaptError::Unfit`] if faces are unfit after `params.max_rounds`.
pub(crate) fn make_fit(
    ctx: &Ctx<'_>,
    surface: &mut SurfaceMesh<'_>,
    params: &AdaptParams,
    counters: &mut Counters,
) -> Result<(), AdaptError> {
    let gate = Gate::new(params);
    let most_faces = (GROWTH * surface.mesh.face_count()).max(GROWTH_FLOOR);
    for round in 0..params.max_rounds {
        let unfit = faces_above(surface, |s, f| gate.face(&s.corners(f)), 1.0);
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
        let mut split_near = vec![false; surface.mesh.vertex_rows()];
        for &face in &unfit {
            let still =
                |s: &SurfaceMesh<'_>| s.mesh.is_face(face) && gate.face(&s.corners(face)) > 1.0;
            if still(surface) && mend(surface, &gate, face, counters).is_none() {
                split(surface, &gate, face, &mut split_near, counters);
            }
        }
    }
    match worst_edge(surface, &gate) {
        None => Ok(()),
        Some(error) => Err(error),
    }
}

/// Flips, slides and collapses slivers and edges near the gate; nothing is split.
pub(crate) fn soften(surface: &mut SurfaceMesh<'_>, params: &AdaptParams, counters: &mut Counters) {
    let gate = Gate::new(params);
    let cost = |s: &SurfaceMesh<'_>, f: u32| gate.face_with_quality(&s.corners(f));
    // What no edit mended stays so until something near it changes.
    let mut changed = vec![true; surface.mesh.vertex_rows()];
    for _ in 0..SOFT_ROUNDS {
        let before = std::mem::replace(&mut changed, vec![false; surface.mesh.vertex_rows()]);
        for face in faces_above(surface, cost, SOFT) {
            if !surface.mesh.is_face(face) || cost(surface, face) <= SOFT {
                continue;
            }
            let is_new = |&v: &u32| before[v as usize] || changed[v as usize];
            if !surface.mesh.face(face).iter().any(is_new) {
                continue;
            }
            if let Some(center) = mend(surface, &gate, face, counters) {
                changed[center as usize] = true;
                surface.mesh.neighbours(center).for_each(|v| changed[v as usize] = true);
            }
        }
    }
}

/// Faces above a limit, worst first.
fn faces_above(
    surface: &SurfaceMesh<'_>,
    cost: impl Fn(&SurfaceMesh<'_>, u32) -> f64 + Sync,
    limit: f64,
) -> Vec<u32> {
    let rows = surface.mesh.face_rows();
    let mut above: Vec<(f64, u32)> = map(surface.host, rows.div_ceil(FACES_A_TASK), |task| {
        let last = ((task + 1) * FACES_A_TASK).min(rows);
        let faces = (task * FACES_A_TASK..last).map(|f| f as u32);
        let costs = faces.filter(|&f| surface.mesh.is_face(f)).map(|f| (cost(surface, f), f));
        costs.filter(|&(c, _)| c > limit).collect::<Vec<_>>()
    })
    .concat();
    above.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    above.into_iter().map(|(_, f)| f).collect()
}

/// One edit that makes the face better without adding faces; the vertex in the middle of it.
fn mend(
    surface: &mut SurfaceMesh<'_>,
    gate: &Gate,
    face: u32,
    counters: &mut Counters,
) -> Option<u32> {
    let edits: [(&str, Edit); 3] =
        [("edges_flipped", flip), ("vertices_slid", slide), ("vertices_collapsed", collapse)];
    edits.into_iter().find_map(|(name, edit)| {
        let center = edit(surface, gate, face)?;
        counters.repair(name, 1);
        Some(center)
    })
}

/// An edit about a face, if one helps: a vertex whose neighbours include all that it touches.
type Edit = fn(&mut SurfaceMesh<'_>, &Gate, u32) -> Option<u32>;

fn halves(face: u32) -> [HalfEdge; 3] {
    [0, 1, 2].map(|k| HalfEdge::new(face, k))
}

/// The flip that leaves the best faces.
fn flip(surface: &mut SurfaceMesh<'_>, gate: &Gate, face: u32) -> Option<u32> {
    let mut best: Option<(f64, HalfEdge)> = None;
    for h in halves(face) {
        let Some([before, after]) = surface.flip_cost(gate, h) else { continue };
        if after < GAIN * before && best.is_none_or(|(least, _)| after < least) {
            best = Some((after, h));
        }
    }
    let turned = surface.mesh.flip(best?.1);
    Some(surface.mesh.origin(turned))
}

/// Moves a corner towards the middle of its neighbours, along the surface.
fn slide(surface: &mut SurfaceMesh<'_>, gate: &Gate, face: u32) -> Option<u32> {
    const PARTS: [f64; 3] = [1.0, 0.5, 0.25];
    let corners = surface.mesh.face(face);
    let steps = corners.map(|v| {
        let (n, sum) = surface
            .mesh
            .neighbours(v)
            .fold((0.0, Vec3::zeros()), |(n, sum), w| (n + 1.0, sum + surface.at(w).position));
        sum / n - surface.at(v).position
    });
    let target = |i: usize| surface.at(corners[i / 3]).position + PARTS[i % 3] * steps[i / 3];
    let reach = |i: usize| steps[i / 3].norm();
    let before = corners.map(|v| surface.fan_cost(gate, v));
    let feet: [_; 9] = surface.feet_within(std::array::from_fn(target), std::array::from_fn(reach));
    for (i, moved) in feet.into_iter().enumerate() {
        let (v, Some(moved)) = (corners[i / 3], moved) else { continue };
        if surface.move_is_better(gate, v, &moved, GAIN * before[i / 3]) {
            surface.place(v, moved);
            return Some(v);
        }
    }
    None
}

/// Merges the ends of an edge, shortest first, if the faces left are fit and better.
fn collapse(surface: &mut SurfaceMesh<'_>, gate: &Gate, face: u32) -> Option<u32> {
    let mut sides = halves(face).map(|h| {
        let [p, q] = surface.ends(h);
        ((q.position - p.position).norm(), h)
    });
    sides.sort_by(|x, y| x.0.total_cmp(&y.0));
    let middles = surface.feet_within(sides.map(|(_, h)| surface.middle(h)), sides.map(|s| s.0));
    for ((_, h), middle) in sides.into_iter().zip(middles) {
        let ends = surface.ends(h).map(|v| *v);
        let before =
            [surface.mesh.origin(h), surface.mesh.target(h)].map(|v| surface.fan_cost(gate, v));
        let limit = (GAIN * before[0].max(before[1])).min(SOFT);
        for merged in middle.into_iter().chain(ends) {
            if surface.collapse_is_better(gate, h, &merged, limit) {
                let kept = surface.mesh.origin(h);
                surface.collapse(h, merged);
                return Some(kept);
            }
        }
    }
    None
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
    let [Some(middle)] = surface.feet_within([surface.middle(h)], [length]) else { return };
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
    let unfit = faces_above(surface, |s, f| gate.face(&s.corners(f)), 1.0);
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
