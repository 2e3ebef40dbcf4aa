//! A triangle mesh sampled from the patches, closed by construction.
//!
//! Every edge is cut into some number of segments, every face is tiled to fit its three edges
//! ([`tiling`]); how many is either the same everywhere or follows from a tolerance ([`plan`]).
//! Points are numbered by what they lie on: the vertices, then those inside each edge from its
//! lower to its higher vertex, then the inner points of each face in storage order. A point on an
//! edge is evaluated from the edge's own curve, so every face that names it gets the same bits.

mod piece;
mod plan;
mod tiling;

use crate::ExportError;
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, boundary_index};
use isospline_geometry::{Vec3, bezier_curve};
use piece::reduced_to_plane;
use plan::Plan;
use tiling::{Place, Tiling};

/// How finely patches are cut into triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// As many segments along every edge, 1 ..= 256; the square of it triangles a patch.
    Samples(u32),
    /// No point of a patch is farther from the triangles than this part of the diagonal of the
    /// box around the vertices; above 0, below 1.
    Relative(f64),
    /// The same as a length in model units, above 0.
    Length(f64),
}

impl Default for Density {
    /// A ten-thousandth of the diagonal: no facet of a model that fills the screen shows.
    fn default() -> Self {
        Self::Relative(1e-4)
    }
}

/// A point of the mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) position: Vec3,
    /// Unit normal of a patch at the point, outward.
    pub(crate) normal: Vec3,
}

#[derive(Debug)]
pub(crate) struct Tessellation<'a> {
    patches: &'a PatchesView<'a>,
    plan: Plan,
    /// One half-edge that leaves each vertex.
    half_of_vertex: Vec<u32>,
    /// One half-edge along each edge.
    half_of_edge: Vec<u32>,
    /// Number of the first point inside each edge, then that of the first in no edge.
    first_on_edge: Vec<u32>,
    /// Number of the first inner point of each face, then the number of all points.
    first_in_face: Vec<u32>,
    n_triangles: u64,
}

/// No half-edge.
const NONE: u32 = u32::MAX;

impl<'a> Tessellation<'a> {
    pub(crate) fn new(patches: &'a PatchesView<'a>, density: Density) -> Result<Self, ExportError> {
        let mut half_of_vertex = vec![NONE; patches.position.len()];
        let mut half_of_edge = vec![NONE; patches.boundary.len()];
        for (h, (&v, &e)) in
            patches.face.as_flattened().iter().zip(patches.edge_of).enumerate().rev()
        {
            half_of_vertex[v as usize] = h as u32;
            half_of_edge[e as usize] = h as u32;
        }
        require_all_used("vertex", &half_of_vertex)?;
        require_all_used("edge", &half_of_edge)?;
        let plan = Plan::new(patches, &half_of_edge, density)?;
        let [first_on_edge, first_in_face] = numbering(patches, &plan)?;
        let n_triangles = (0..patches.face.len()).map(|f| plan.shape(patches, f).n_triangles());
        let n_triangles = n_triangles.map(|n| n as u64).sum();
        require_countable("triangles", n_triangles)?;
        Ok(Self {
            patches,
            plan,
            half_of_vertex,
            half_of_edge,
            first_on_edge,
            first_in_face,
            n_triangles,
        })
    }

    pub(crate) fn n_points(&self) -> u64 {
        u64::from(*self.first_in_face.last().expect("invariant: numbers end with their count"))
    }

    pub(crate) fn n_triangles(&self) -> u64 {
        self.n_triangles
    }

    pub(crate) fn n_faces(&self) -> usize {
        self.patches.face.len()
    }

    /// Hands all points to `take`, in order of their numbers, until it fails.
    pub(crate) fn for_each_point<E>(
        &self,
        mut take: impl FnMut(Sample) -> Result<(), E>,
    ) -> Result<(), E> {
        (0..self.half_of_vertex.len()).try_for_each(|v| take(self.at_vertex(v)))?;
        for e in 0..self.half_of_edge.len() {
            self.on_edge(e).try_for_each(&mut take)?;
        }
        (0..self.n_faces()).try_for_each(|f| self.in_face(f).try_for_each(&mut take))
    }

    /// The point at a vertex.
    pub(crate) fn at_vertex(&self, v: usize) -> Sample {
        let (f, corner) = split(self.half_of_vertex[v]);
        let mut at = [0.0; 3];
        at[corner] = 1.0;
        let (_, normal) = evaluate(&self.patches.net(f), at);
        Sample { position: Vec3::from(self.patches.position[v]), normal }
    }

    /// The points inside an edge, from its lower vertex on.
    pub(crate) fn on_edge(&self, e: usize) -> impl Iterator<Item = Sample> {
        let (f, corner) = split(self.half_of_edge[e]);
        let (net, curve) = (self.patches.net(f), edge_curve(self.patches, f, corner));
        let n = self.plan.segments(e);
        let is_up = runs_up(self.patches, f, corner);
        (1..n).map(move |step| {
            let t = step as f64 / n as f64;
            let along = if is_up { t } else { 1.0 - t };
            let mut at = [0.0; 3];
            at[corner] = 1.0 - along;
            at[(corner + 1) % 3] = along;
            let (_, normal) = evaluate(&net, at);
            Sample { position: bezier_curve::evaluate(&curve, t), normal }
        })
    }

    /// The inner points of a face, in storage order.
    pub(crate) fn in_face(&self, f: usize) -> impl Iterator<Item = Sample> {
        let net = self.patches.net(f);
        self.plan.shape(self.patches, f).inner().map(move |at| {
            let (position, normal) = evaluate(&net, at);
            Sample { position, normal }
        })
    }

    /// Numbers of the points inside an edge, from its lower vertex on.
    pub(crate) fn numbers_on_edge(&self, e: usize) -> std::ops::Range<u32> {
        self.first_on_edge[e]..self.first_on_edge[e + 1]
    }

    /// Numbers of the inner points of a face.
    pub(crate) fn numbers_in_face(&self, f: usize) -> std::ops::Range<u32> {
        self.first_in_face[f]..self.first_in_face[f + 1]
    }

    /// Numbers of the corners of the triangles of face `f`, counter-clockwise from outside.
    pub(crate) fn triangles(&self, f: usize) -> impl Iterator<Item = [u32; 3]> {
        let Tiling { places, triangles } = self.plan.shape(self.patches, f).tiling();
        let ids: Vec<u32> = places.iter().map(|&place| self.number(f, place)).collect();
        triangles.into_iter().map(move |t| t.map(|q| ids[q as usize]))
    }

    /// Positions of the corners of the triangles of face `f`; the same bits as the points that
    /// [`Self::triangles`] numbers.
    pub(crate) fn triangle_positions(&self, f: usize) -> impl Iterator<Item = [Vec3; 3]> {
        let shape = self.plan.shape(self.patches, f);
        let Tiling { places, triangles } = shape.tiling();
        let net = self.patches.net(f);
        let curves = [0, 1, 2].map(|corner| edge_curve(self.patches, f, corner));
        let position = |place: &Place| match *place {
            Place::Corner(corner) => corner_point(self.patches, f, corner),
            Place::Edge { corner, step } => {
                let n = shape.segments[corner];
                let step = self.steps_up(f, corner, step);
                bezier_curve::evaluate(&curves[corner], step as f64 / n as f64)
            }
            Place::Inner { .. } => evaluate(&net, shape.at(*place)).0,
        };
        let points: Vec<Vec3> = places.iter().map(position).collect();
        triangles.into_iter().map(move |t| t.map(|q| points[q as usize]))
    }

    /// Numbers of all points of a face in storage order of a net of degree `n`, where all its
    /// edges have `n` segments.
    pub(crate) fn grid_numbers(&self, f: usize) -> Vec<u32> {
        let places = self.plan.shape(self.patches, f).grid_places();
        places.map(|place| self.number(f, place)).collect()
    }

    fn number(&self, f: usize, place: Place) -> u32 {
        match place {
            Place::Corner(corner) => self.patches.face[f][corner],
            Place::Edge { corner, step } => {
                let edge = self.patches.edge_of[3 * f + corner] as usize;
                self.first_on_edge[edge] + self.steps_up(f, corner, step) as u32 - 1
            }
            Place::Inner { slot, .. } => self.first_in_face[f] + slot as u32,
        }
    }

    /// Turns steps from `corner` into steps from the lower vertex of its edge, and back.
    fn steps_up(&self, f: usize, corner: usize, step: usize) -> usize {
        if runs_up(self.patches, f, corner) {
            return step;
        }
        self.plan.segments(self.patches.edge_of[3 * f + corner] as usize) - step
    }
}

fn split(half: u32) -> (usize, usize) {
    (half as usize / 3, half as usize % 3)
}

fn runs_up(patches: &PatchesView<'_>, f: usize, corner: usize) -> bool {
    let face = patches.face[f];
    face[corner] < face[(corner + 1) % 3]
}

fn corner_point(patches: &PatchesView<'_>, f: usize, corner: usize) -> Vec3 {
    Vec3::from(patches.position[patches.face[f][corner] as usize])
}

/// The curve of an edge of a face, from its lower vertex on.
fn edge_curve(patches: &PatchesView<'_>, f: usize, corner: usize) -> [Vec3; 5] {
    let mut ends = [corner_point(patches, f, corner), corner_point(patches, f, (corner + 1) % 3)];
    if !runs_up(patches, f, corner) {
        ends.reverse();
    }
    let inner = &patches.boundary[patches.edge_of[3 * f + corner] as usize];
    let at = |k: usize| Vec3::new(inner[3 * k], inner[3 * k + 1], inner[3 * k + 2]);
    [ends[0], at(0), at(1), at(2), ends[1]]
}

/// Point and unit normal of a patch; the normal of the flat triangle where the patch has none.
fn evaluate(net: &[Vec3; N_CONTROL], at: [f64; 3]) -> (Vec3, Vec3) {
    let [a, b, c] = reduced_to_plane(net, at);
    let point = at[0] * a + at[1] * b + at[2] * c;
    let unit = |normal: Vec3| normal.try_normalize(0.0);
    let chords = [1, 2].map(|corner| net[boundary_index(DEGREE, corner, 0)] - net[0]);
    let normal = unit((b - a).cross(&(c - a))).or_else(|| unit(chords[0].cross(&chords[1])));
    (point, normal.unwrap_or_else(Vec3::z))
}

/// First numbers of the points on edges and in faces, each list with the end of its last.
fn numbering(patches: &PatchesView<'_>, plan: &Plan) -> Result<[Vec<u32>; 2], ExportError> {
    let mut next = patches.position.len() as u64;
    let mut take = |counts: &mut dyn Iterator<Item = usize>| {
        let mut first = vec![next as u32];
        for count in counts {
            next += count as u64;
            first.push(next as u32);
        }
        require_countable("points", next).map(|()| first)
    };
    let on_edges = take(&mut (0..patches.boundary.len()).map(|e| plan.segments(e) - 1))?;
    let inner = |f| plan.shape(patches, f).n_inner();
    let in_faces = take(&mut (0..patches.face.len()).map(inner))?;
    Ok([on_edges, in_faces])
}

/// PLY and many readers count in i32; the other formats get the same limit.
fn require_countable(what: &'static str, count: u64) -> Result<(), ExportError> {
    let limit = i32::MAX as u64;
    if count > limit {
        return Err(ExportError::TooLarge { format: "a triangle mesh", what, count, limit });
    }
    Ok(())
}

fn require_all_used(what: &'static str, half_of: &[u32]) -> Result<(), ExportError> {
    match half_of.iter().position(|&h| h == NONE) {
        Some(row) => Err(ExportError::Incoherent { what, row, defect: "part of no face" }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use isospline_geometry::TriangleMesh;

    const DENSITIES: [Density; 7] = [
        Density::Samples(1),
        Density::Samples(2),
        Density::Samples(3),
        Density::Samples(7),
        Density::Relative(0.02),
        Density::Relative(2e-3),
        Density::Length(1e-2),
    ];

    fn mesh(tessellation: &Tessellation<'_>) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        let taken: Result<(), ()> = tessellation.for_each_point(|sample| {
            mesh.positions.push(sample.position);
            Ok(())
        });
        taken.unwrap();
        mesh.faces = (0..tessellation.n_faces()).flat_map(|f| tessellation.triangles(f)).collect();
        mesh
    }

    #[test]
    fn the_mesh_is_closed_and_keeps_the_topology_at_every_density() {
        let patches = sample::ball_and_ring();
        for density in DENSITIES {
            let view = patches.view();
            let tessellation = Tessellation::new(&view, density).unwrap();
            let mesh = mesh(&tessellation);
            let opposite = mesh.opposites().unwrap();
            mesh.check_fans(&opposite).unwrap();
            assert!(!opposite.contains(&isospline_geometry::triangle_mesh::BORDER));
            // A sphere and a torus.
            assert_eq!(mesh.euler_characteristic(&opposite), 2, "{density:?}");
            assert_eq!(mesh.faces.len() as u64, tessellation.n_triangles());
            assert_eq!(mesh.positions.len() as u64, tessellation.n_points());
        }
    }

    #[test]
    fn positions_of_triangles_are_those_of_the_points_in_all_bits() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        for density in DENSITIES {
            let tessellation = Tessellation::new(&view, density).unwrap();
            let mesh = mesh(&tessellation);
            for f in 0..tessellation.n_faces() {
                let by_number =
                    tessellation.triangles(f).map(|t| t.map(|v| mesh.positions[v as usize]));
                assert!(by_number.eq(tessellation.triangle_positions(f)), "{density:?}");
            }
        }
    }

    #[test]
    fn inner_points_lie_on_their_patches() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        for (at, f) in [([0.25, 0.5, 0.25], 0), ([0.1, 0.2, 0.7], 30), ([0.0, 0.4, 0.6], 60)] {
            let net = view.net(f);
            let exact = isospline_geometry::bezier_triangle::evaluate(DEGREE, &net, at);
            assert!((evaluate(&net, at).0 - exact).norm() < 1e-14);
        }
    }

    #[test]
    fn normals_are_orthogonal_to_differences_and_point_outward() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let net = view.net(0);
        let at = [0.25, 0.5, 0.25];
        let (point, normal) = evaluate(&net, at);
        let h = 1e-5;
        for step in [[-h, h, 0.0], [-h, 0.0, h]] {
            let moved = std::array::from_fn(|c| at[c] + step[c]);
            let slope = (evaluate(&net, moved).0 - point) / h;
            assert!(slope.dot(&normal).abs() < 1e-4);
        }
        // Face 0 belongs to the ball about the origin.
        assert!(normal.dot(&point) > 0.0 && (normal.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_vertex_without_faces_is_refused() {
        let mut patches = sample::ball_and_ring();
        patches.position.push([0.0; 3]);
        let refused = Tessellation::new(&patches.view(), Density::Samples(2)).unwrap_err();
        assert!(refused.to_string().contains("part of no face"), "{refused}");
    }
}
