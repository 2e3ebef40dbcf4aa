//! A triangle mesh sampled from the patches, closed by construction.
//!
//! Points are numbered by what they lie on: the vertices, then `n - 1` points an edge from its
//! lower to its higher vertex, then the inner points of each face in storage order. A point on an
//! edge is evaluated from the edge's own curve, so every face that names it gets the same bits.

use crate::ExportError;
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, bernstein, boundary_index, exponents, index, n_control,
};
use isospline_geometry::{Vec3, bezier_curve};

/// Most steps a side: 65 536 triangles a patch.
const MAX_SAMPLES: u32 = 256;
/// No half-edge.
const NONE: u32 = u32::MAX;

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
    /// Steps a side.
    n: usize,
    /// One half-edge that leaves each vertex.
    half_of_vertex: Vec<u32>,
    /// One half-edge along each edge.
    half_of_edge: Vec<u32>,
    /// Linear forms of each grid point, in storage order.
    stencils: Vec<Stencil>,
    /// What each grid point lies on, in storage order.
    places: Vec<Place>,
}

impl<'a> Tessellation<'a> {
    pub(crate) fn new(patches: &'a PatchesView<'a>, samples: u32) -> Result<Self, ExportError> {
        if !(1..=MAX_SAMPLES).contains(&samples) {
            return Err(ExportError::Samples { samples, max: MAX_SAMPLES });
        }
        let n = samples as usize;
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
        let stencils = exponents(n).map(|e| Stencil::new(e.map(|x| x as f64 / n as f64))).collect();
        let places = places(n);
        let mesh = Self { patches, n, half_of_vertex, half_of_edge, stencils, places };
        mesh.require_countable()?;
        Ok(mesh)
    }

    pub(crate) fn n_points(&self) -> u64 {
        let (v, e) = (self.patches.position.len(), self.patches.boundary.len());
        let inner = self.patches.face.len() * self.inner_a_face();
        (v + e * (self.n - 1) + inner) as u64
    }

    pub(crate) fn n_triangles(&self) -> u64 {
        (self.patches.face.len() * self.n * self.n) as u64
    }

    pub(crate) fn n_faces(&self) -> usize {
        self.patches.face.len()
    }

    /// Hands all points to `take`, in order of their numbers, until it fails.
    pub(crate) fn for_each_point<E>(
        &self,
        mut take: impl FnMut(Sample) -> Result<(), E>,
    ) -> Result<(), E> {
        for (v, &h) in self.half_of_vertex.iter().enumerate() {
            let (f, corner) = (h as usize / 3, h as usize % 3);
            let stencil = &self.stencils[boundary_index(self.n, corner, 0)];
            let (_, normal) = stencil.evaluate(&self.patches.net(f));
            take(Sample { position: Vec3::from(self.patches.position[v]), normal })?;
        }
        for (e, &h) in self.half_of_edge.iter().enumerate() {
            let (f, corner) = (h as usize / 3, h as usize % 3);
            let net = self.patches.net(f);
            for step in 1..self.n {
                let at = boundary_index(self.n, corner, self.along(f, corner, step));
                let (_, normal) = self.stencils[at].evaluate(&net);
                take(Sample { position: self.on_edge(e, h, step), normal })?;
            }
        }
        for f in 0..self.patches.face.len() {
            let net = self.patches.net(f);
            for (place, stencil) in self.places.iter().zip(&self.stencils) {
                if let Place::Inner(_) = place {
                    let (position, normal) = stencil.evaluate(&net);
                    take(Sample { position, normal })?;
                }
            }
        }
        Ok(())
    }

    /// Numbers of the corners of the triangles of face `f`, counter-clockwise from outside.
    pub(crate) fn triangles(&self, f: usize) -> impl Iterator<Item = [u32; 3]> {
        let ids: Vec<u32> = self.places.iter().map(|&place| self.number(f, place)).collect();
        grid_triangles(self.n).map(move |t| t.map(|q| ids[q]))
    }

    /// Positions of the corners of the triangles of face `f`; the same bits as the points that
    /// [`Self::triangles`] numbers.
    pub(crate) fn triangle_positions(&self, f: usize) -> impl Iterator<Item = [Vec3; 3]> {
        let net = self.patches.net(f);
        let points: Vec<Vec3> = self
            .places
            .iter()
            .zip(&self.stencils)
            .map(|(&place, stencil)| match place {
                Place::Corner(corner) => self.corner(f, corner),
                Place::Edge { corner, step } => {
                    let half = 3 * f + corner;
                    let edge = self.patches.edge_of[half] as usize;
                    self.on_edge(edge, half as u32, self.along(f, corner, step))
                }
                Place::Inner(_) => stencil.evaluate(&net).0,
            })
            .collect();
        grid_triangles(self.n).map(move |t| t.map(|q| points[q]))
    }

    fn require_countable(&self) -> Result<(), ExportError> {
        // PLY and many readers count in i32; the other formats get the same limit.
        let limit = i32::MAX as u64;
        for (what, count) in [("points", self.n_points()), ("triangles", self.n_triangles())] {
            if count > limit {
                return Err(ExportError::TooLarge {
                    format: "a triangle mesh",
                    what,
                    count,
                    limit,
                });
            }
        }
        Ok(())
    }

    fn inner_a_face(&self) -> usize {
        if self.n < 3 { 0 } else { n_control(self.n - 3) }
    }

    fn number(&self, f: usize, place: Place) -> u32 {
        let (v, e) = (self.patches.position.len(), self.patches.boundary.len());
        let a_side = self.n - 1;
        let number = match place {
            Place::Corner(corner) => return self.patches.face[f][corner],
            Place::Edge { corner, step } => {
                let edge = self.patches.edge_of[3 * f + corner] as usize;
                v + edge * a_side + self.along(f, corner, step) - 1
            }
            Place::Inner(slot) => v + e * a_side + f * self.inner_a_face() + slot,
        };
        number as u32
    }

    /// Turns steps from `corner` into steps from the lower vertex of its edge, and back.
    fn along(&self, f: usize, corner: usize, step: usize) -> usize {
        let face = self.patches.face[f];
        if face[corner] < face[(corner + 1) % 3] { step } else { self.n - step }
    }

    fn corner(&self, f: usize, corner: usize) -> Vec3 {
        Vec3::from(self.patches.position[self.patches.face[f][corner] as usize])
    }

    /// Point `step` of edge `e`, counted from its lower vertex; `half` is a half-edge along it.
    fn on_edge(&self, e: usize, half: u32, step: usize) -> Vec3 {
        let (f, corner) = (half as usize / 3, half as usize % 3);
        let mut ends = [self.corner(f, corner), self.corner(f, (corner + 1) % 3)];
        if self.along(f, corner, 0) != 0 {
            ends.reverse();
        }
        let inner = &self.patches.boundary[e];
        let at = |k: usize| Vec3::new(inner[3 * k], inner[3 * k + 1], inner[3 * k + 2]);
        let curve = [ends[0], at(0), at(1), at(2), ends[1]];
        bezier_curve::evaluate(&curve, step as f64 / self.n as f64)
    }
}

/// What a grid point of a face lies on; steps are counted from the corner.
#[derive(Clone, Copy, Debug)]
enum Place {
    Corner(usize),
    Edge { corner: usize, step: usize },
    Inner(usize),
}

fn places(n: usize) -> Vec<Place> {
    let mut n_inner = 0;
    exponents(n)
        .map(|e| {
            if let Some(corner) = (0..3).find(|&c| e[c] == n) {
                return Place::Corner(corner);
            }
            if let Some(opposite) = (0..3).find(|&c| e[c] == 0) {
                let corner = (opposite + 1) % 3;
                return Place::Edge { corner, step: e[(corner + 1) % 3] };
            }
            n_inner += 1;
            Place::Inner(n_inner - 1)
        })
        .collect()
}

/// Grid indices of the `n^2` small triangles: those that point as the patch does, then the others.
fn grid_triangles(n: usize) -> impl Iterator<Item = [usize; 3]> {
    let upright = exponents(n - 1)
        .map(|[i, j, k]| [index([i + 1, j, k]), index([i, j + 1, k]), index([i, j, k + 1])]);
    let inverted = (n > 1).then(|| exponents(n - 2)).into_iter().flatten().map(|[i, j, k]| {
        [index([i + 1, j + 1, k]), index([i, j + 1, k + 1]), index([i + 1, j, k + 1])]
    });
    upright.chain(inverted)
}

fn require_all_used(what: &'static str, half_of: &[u32]) -> Result<(), ExportError> {
    match half_of.iter().position(|&h| h == NONE) {
        Some(row) => Err(ExportError::Incoherent { what, row, defect: "part of no face" }),
        None => Ok(()),
    }
}

/// Linear forms that give point and derivatives at one barycentric point from the net.
#[derive(Debug)]
struct Stencil {
    point: [f64; N_CONTROL],
    /// Derivative from corner 0 towards corner 1, without the factor 7.
    along: [f64; N_CONTROL],
    /// Derivative from corner 0 towards corner 2, without the factor 7.
    across: [f64; N_CONTROL],
}

impl Stencil {
    fn new(at: [f64; 3]) -> Self {
        let mut out =
            Self { point: [0.0; N_CONTROL], along: [0.0; N_CONTROL], across: [0.0; N_CONTROL] };
        out.point.copy_from_slice(&bernstein(DEGREE, at));
        for ([i, j, k], weight) in exponents(DEGREE - 1).zip(bernstein(DEGREE - 1, at)) {
            let [pu, pv, pw] = [index([i + 1, j, k]), index([i, j + 1, k]), index([i, j, k + 1])];
            out.along[pv] += weight;
            out.along[pu] -= weight;
            out.across[pw] += weight;
            out.across[pu] -= weight;
        }
        out
    }

    /// Point and unit normal; the normal of the flat triangle where the patch has none.
    fn evaluate(&self, net: &[Vec3; N_CONTROL]) -> (Vec3, Vec3) {
        let (mut point, mut along, mut across) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
        for (s, p) in net.iter().enumerate() {
            point += self.point[s] * p;
            along += self.along[s] * p;
            across += self.across[s] * p;
        }
        let unit = |normal: Vec3| normal.try_normalize(0.0);
        let chords = [1, 2].map(|corner| net[boundary_index(DEGREE, corner, 0)] - net[0]);
        let normal = unit(along.cross(&across)).or_else(|| unit(chords[0].cross(&chords[1])));
        (point, normal.unwrap_or_else(Vec3::z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use isospline_geometry::TriangleMesh;

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
        for samples in [1, 2, 3, 4, 7] {
            let view = patches.view();
            let tessellation = Tessellation::new(&view, samples).unwrap();
            let mesh = mesh(&tessellation);
            let opposite = mesh.opposites().unwrap();
            mesh.check_fans(&opposite).unwrap();
            assert!(!opposite.contains(&isospline_geometry::triangle_mesh::BORDER));
            // A sphere and a torus.
            assert_eq!(mesh.euler_characteristic(&opposite), 2, "{samples} samples");
            assert_eq!(mesh.faces.len() as u64, tessellation.n_triangles());
            assert_eq!(mesh.positions.len() as u64, tessellation.n_points());
        }
    }

    #[test]
    fn positions_of_triangles_are_those_of_the_points_in_all_bits() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let tessellation = Tessellation::new(&view, 5).unwrap();
        let mesh = mesh(&tessellation);
        for f in 0..tessellation.n_faces() {
            let by_number =
                tessellation.triangles(f).map(|t| t.map(|v| mesh.positions[v as usize]));
            assert!(by_number.eq(tessellation.triangle_positions(f)));
        }
    }

    #[test]
    fn points_lie_on_their_patches() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let n = 6;
        let tessellation = Tessellation::new(&view, n as u32).unwrap();
        for f in 0..tessellation.n_faces() {
            let corners: Vec<[Vec3; 3]> = tessellation.triangle_positions(f).collect();
            for (t, triangle) in grid_triangles(n).zip(corners) {
                for (q, p) in t.into_iter().zip(triangle) {
                    let e = exponents(n).nth(q).unwrap();
                    let at = e.map(|x| x as f64 / n as f64);
                    let net = view.net(f);
                    let exact = isospline_geometry::bezier_triangle::evaluate(7, &net, at);
                    assert!((p - exact).norm() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn normals_are_orthogonal_to_differences_and_point_outward() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let net = view.net(0);
        let at = [0.25, 0.5, 0.25];
        let (point, normal) = Stencil::new(at).evaluate(&net);
        let h = 1e-5;
        for step in [[-h, h, 0.0], [-h, 0.0, h]] {
            let moved = std::array::from_fn(|c| at[c] + step[c]);
            let slope = (Stencil::new(moved).evaluate(&net).0 - point) / h;
            assert!(slope.dot(&normal).abs() < 1e-4);
        }
        // Face 0 belongs to the ball about the origin.
        assert!(normal.dot(&point) > 0.0 && (normal.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_vertex_without_faces_is_refused() {
        let mut patches = sample::ball_and_ring();
        patches.position.push([0.0; 3]);
        let refused = Tessellation::new(&patches.view(), 2).unwrap_err();
        assert!(refused.to_string().contains("part of no face"), "{refused}");
    }
}
