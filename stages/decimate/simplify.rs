//! The loop of collapses.

use crate::guards::{Guards, LEVELS, Merge};
use crate::quadric::Quadric;
use crate::queue::EdgeQueue;
use crate::refusals::Refusals;
use crate::surface::SurfaceData;
use crate::tiles;
use crate::{DecimateError, DecimateParams};
use isospline_geometry::{EditMesh, HalfEdge, TriangleMesh, Vec3};
use isospline_stage::{Counters, Ctx, Host, Serial, map};

/// Part of the faces after which all edges are queued again: a refused collapse is dropped, and
/// may be allowed when its surroundings have changed. On deccube, 234 248 faces to 5000, one pass
/// alone left errors of 1.0e-2 where this leaves 3.4e-3; the queue costs 2 % of the time.
const REFILL: f64 = 0.67;

/// Faces whose edges are costed in a task.
const FACES_A_TASK: usize = 512;

/// Collapses edges until at most `params.faces` are left.
pub(crate) fn simplify(
    ctx: &Ctx<'_>,
    params: &DecimateParams,
    mut mesh: TriangleMesh,
    counters: &mut Counters,
) -> Result<TriangleMesh, DecimateError> {
    if let Some(v) = mesh.positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(DecimateError::NotFinite { vertex: v as u32 });
    }
    let surface = SurfaceData::of(ctx.field, ctx.host, &mesh);
    // Quadrics hold squared coordinates: about the centre they lose no digits to an offset.
    let center = mesh.bounds().center();
    for p in &mut mesh.positions {
        *p -= center;
    }
    let mut vertices = Vertices {
        quadrics: vertex_quadrics(&mesh, &surface.curvatures, params),
        weights: vertex_areas(&mesh),
        normals: surface.normals,
    };
    if tiles::are_worth_it(&mesh, params) {
        (mesh, vertices) = tiles::coarsen(ctx, params, mesh, vertices, counters)?;
    }
    let mut run = Run::new(EditMesh::new(mesh)?, vertices);
    run.reach(ctx, params, counters)?;
    let mut coarse = run.mesh.compact();
    for p in &mut coarse.positions {
        *p += center;
    }
    Ok(coarse)
}

/// What is known of the vertices of a mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Vertices {
    pub(crate) quadrics: Vec<Quadric>,
    /// Area that each vertex stands for: weighs normals when vertices merge.
    pub(crate) weights: Vec<f64>,
    pub(crate) normals: Vec<Vec3>,
}

/// A mesh on its way down.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) mesh: EditMesh,
    pub(crate) vertices: Vertices,
    /// Vertices that stay as they are; none if empty.
    pub(crate) locked: Vec<bool>,
    queue: EdgeQueue,
    refusals: Refusals,
}

impl Vertices {
    /// Those of some rows, in their order.
    pub(crate) fn of_rows(&self, rows: &[u32]) -> Self {
        let rows = || rows.iter().map(|&v| v as usize);
        Self {
            quadrics: rows().map(|v| self.quadrics[v]).collect(),
            weights: rows().map(|v| self.weights[v]).collect(),
            normals: rows().map(|v| self.normals[v]).collect(),
        }
    }
}

impl Run {
    pub(crate) fn new(mesh: EditMesh, vertices: Vertices) -> Self {
        let queue = EdgeQueue::new(3 * mesh.face_rows());
        let refusals = Refusals::new(&mesh);
        Self { mesh, vertices, locked: Vec::new(), queue, refusals }
    }

    /// Collapses what the guards allow until at most `wanted` faces are left or nothing can go.
    pub(crate) fn reach_or_stop(&mut self, params: &DecimateParams, wanted: usize) {
        let guards = Guards::at_level(params, 0);
        self.set_all_costs(&Serial);
        while self.mesh.face_count() > wanted {
            let before = self.mesh.face_count();
            self.refill_and_pass(&guards, wanted);
            if self.mesh.face_count() == before {
                return;
            }
        }
    }

    fn reach(
        &mut self,
        ctx: &Ctx<'_>,
        params: &DecimateParams,
        counters: &mut Counters,
    ) -> Result<(), DecimateError> {
        let wanted = params.faces as usize;
        let total = self.mesh.face_count() - wanted;
        let mut level = 0;
        self.set_all_costs(ctx.host);
        while self.mesh.face_count() > wanted {
            let before = self.mesh.face_count();
            ctx.host.progress((wanted + total - before) as u64, total as u64)?;
            self.refill_and_pass(&Guards::at_level(params, level), wanted);
            let collapses = (before - self.mesh.face_count()) as u64 / 2;
            match level {
                0 => counters.count("collapses", collapses),
                _ => counters.repair("collapses_past_guards", collapses),
            }
            if collapses == 0 {
                level += 1;
                self.refusals.forget();
            }
            if level == LEVELS {
                let least = self.mesh.face_count() as u32;
                return Err(DecimateError::TooFewFaces { wanted: params.faces, least });
            }
        }
        Ok(())
    }

    fn set_all_costs(&mut self, host: &dyn Host) {
        let Self { mesh, vertices, queue, .. } = self;
        let n_faces = mesh.face_rows();
        let found = map(host, n_faces.div_ceil(FACES_A_TASK), |task| {
            let first = task * FACES_A_TASK;
            let edges = mesh.edge_list(first..(first + FACES_A_TASK).min(n_faces));
            let cost = |h: HalfEdge| (h, best_merge(mesh, &vertices.quadrics, h).1);
            edges.into_iter().map(cost).collect::<Vec<_>>()
        });
        for (h, cost) in found.into_iter().flatten() {
            if let Some(o) = mesh.opposite(h) {
                queue.set(h, o, cost);
            }
        }
    }

    fn refill_and_pass(&mut self, guards: &Guards, wanted: usize) {
        self.queue.refill(&self.mesh);
        let until = wanted.max(libm::ceil(REFILL * self.mesh.face_count() as f64) as usize);
        while self.mesh.face_count() > until {
            let Some(h) = self.queue.pop(&self.mesh) else { return };
            self.collapse(h, guards);
        }
    }

    fn collapse(&mut self, h: HalfEdge, guards: &Guards) {
        let (a, b) = (self.mesh.origin(h) as usize, self.mesh.target(h) as usize);
        let Self { mesh, vertices, locked, queue, refusals } = self;
        let is_locked = |v: usize| locked.get(v).copied().unwrap_or(false);
        if is_locked(a) || is_locked(b) || refusals.still_hold(mesh, h) {
            return;
        }
        let Vertices { quadrics, weights, normals } = vertices;
        let (position, _) = best_merge(mesh, quadrics, h);
        let sum = weights[a] * normals[a] + weights[b] * normals[b];
        let merge = Merge { edge: h, position, normal: sum.try_normalize(0.0).unwrap_or(sum) };
        if !guards.allow(mesh, normals, &merge) || !mesh.can_collapse(h) {
            refusals.note(h);
            return;
        }
        mesh.collapse(h);
        mesh.positions[a] = position;
        normals[a] = merge.normal;
        weights[a] += weights[b];
        quadrics[a] = quadrics[a].plus(&quadrics[b]);
        refusals.note_change(mesh, a as u32);
        for s in mesh.spokes(a as u32) {
            if let Some(o) = mesh.opposite(s) {
                queue.push(s, o, best_merge(mesh, quadrics, s).1);
            }
        }
    }
}

/// Where the ends of `h` merge at least error, and the error.
fn best_merge(mesh: &EditMesh, quadrics: &[Quadric], h: HalfEdge) -> (Vec3, f64) {
    let (a, b) = (mesh.origin(h) as usize, mesh.target(h) as usize);
    let quadric = quadrics[a].plus(&quadrics[b]);
    let (p, q) = (mesh.positions[a], mesh.positions[b]);
    let middle = 0.5 * (p + q);
    // Farther than an edge length from the middle the planes are too parallel to trust.
    let near = |x: &Vec3| (x - middle).norm_squared() <= (q - p).norm_squared();
    if let Some(x) = quadric.minimum().filter(near) {
        return (x, quadric.error(&x));
    }
    let choices = [middle, p, q].map(|x| (x, quadric.error(&x)));
    choices.into_iter().fold(choices[0], |best, x| if x.1 < best.1 { x } else { best })
}

/// Sum over the faces about each vertex of a third of their weighted quadrics.
fn vertex_quadrics(
    mesh: &TriangleMesh,
    curvatures: &[f64],
    params: &DecimateParams,
) -> Vec<Quadric> {
    let mean = mean_curvature_of_area(mesh, curvatures);
    let weight = |v: u32| curvature_weight(curvatures[v as usize] / mean, params.curvature_power);
    let weights: Vec<f64> = (0..mesh.positions.len() as u32).map(weight).collect();
    let mut quadrics = vec![Quadric::default(); mesh.positions.len()];
    for f in 0..mesh.faces.len() as u32 {
        let area = vector_area(mesh, f);
        let Some(normal) = area.try_normalize(0.0) else { continue };
        let corners = mesh.faces[f as usize];
        let mean = corners.iter().map(|&v| weights[v as usize]).sum::<f64>() / 3.0;
        let weight = mean * area.norm() / 3.0;
        let plane = Quadric::plane(&normal, &mesh.positions[corners[0] as usize], weight);
        for v in corners {
            let spread = Quadric::point(&mesh.positions[v as usize], params.spread * weight);
            quadrics[v as usize] = quadrics[v as usize].plus(&plane).plus(&spread);
        }
    }
    quadrics
}

/// `bending^power`; `bending` is the curvature over its mean. Nearly flat places keep a weight, and
/// features finer than the input cannot claim all faces. NaN, where all is flat, weighs 1.
fn curvature_weight(bending: f64, power: f64) -> f64 {
    const RANGE: (f64, f64) = (0.1, 10.0);
    if bending.is_nan() { 1.0 } else { libm::pow(bending.clamp(RANGE.0, RANGE.1), power) }
}

/// Mean over the area of the curvatures at the vertices.
fn mean_curvature_of_area(mesh: &TriangleMesh, curvatures: &[f64]) -> f64 {
    let areas = vertex_areas(mesh);
    let sum: f64 = areas.iter().zip(curvatures).map(|(a, k)| a * k).sum();
    sum / areas.iter().sum::<f64>()
}

fn vertex_areas(mesh: &TriangleMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.positions.len()];
    for f in 0..mesh.faces.len() as u32 {
        let third = vector_area(mesh, f).norm() / 3.0;
        for v in mesh.faces[f as usize] {
            areas[v as usize] += third;
        }
    }
    areas
}

fn vector_area(mesh: &TriangleMesh, face: u32) -> Vec3 {
    let [a, b, c] = mesh.corners(face);
    0.5 * (b - a).cross(&(c - a))
}
