//! Kind `patches`: the finished surface, self-contained.

use crate::artifact;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::{raise_quartic_to_septic, raise_quartic_to_sextic};
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, interior_indices, net_of_boundary};
use isospline_geometry::degree_change::lower_to_sextic;

/// How the patches were built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// G1 triangular spline of Tong and Kim.
    TongKim,
}

impl Scheme {
    /// The stored code.
    pub fn code(self) -> u32 {
        match self {
            Self::TongKim => 0,
        }
    }
}

/// One row: what the control points mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PatchMeta {
    /// Code of the [`Scheme`].
    pub scheme: u32,
    /// Degree of the patches, 6 or 7; those of degree 6 are stored raised to degree 7.
    pub degree: u32,
    /// Degree of the boundary curves as stored.
    pub boundary_degree: u32,
    /// 1 if weights are stored.
    pub rational: u32,
}

impl PatchMeta {
    /// Whether these are patches as [`PatchesView::net`] gives them: polynomial, of degree 6 or 7, over
    /// quartic curves.
    pub fn is_known(&self) -> bool {
        matches!((self.degree, self.boundary_degree, self.rational), (6 | 7, 4, 0))
    }
}

artifact! {
    /// Triangular Bézier patches with quartic boundary curves (fairing, relax), as nets of degree 7.
    pub struct Patches / PatchesView = "patches", schema 1 {
        /// What the control points mean.
        meta: PatchMeta, One;
        /// Vertex positions.
        position: [f64; 3], Vertices;
        /// Corners of each face, counter-clockwise seen from outside.
        face: [u32; 3], Faces;
        /// Edge of each half-edge.
        edge_of: u32, HalfEdges;
        /// Control points q1, q2, q3 of each edge, from the lower to the higher vertex.
        boundary: [f64; 9], Edges;
        /// The 15 interior control points in storage order, raised where patches are of degree 6.
        interior: [f64; 45], Faces;
    }
}

impl PatchesView<'_> {
    /// The full net of `face`, in storage order.
    ///
    /// An edge's curve is raised from its lower vertex and copied, so the nets of neighbouring
    /// faces carry the same bits along their shared edge.
    pub fn net(&self, face: usize) -> [Vec3; N_CONTROL] {
        let curve = |corner| self.raised_edge(face, corner, raise_quartic_to_septic);
        let mut net = net_of_boundary(&[curve(0), curve(1), curve(2)]);
        let (inner, _) = self.interior[face].as_chunks();
        for (slot, &p) in const { interior_indices() }.into_iter().zip(inner) {
            net[slot] = Vec3::from(p);
        }
        net
    }

    /// Degree of the patches, 6 or 7.
    pub fn degree(&self) -> usize {
        self.meta.first().map_or(DEGREE, |meta| meta.degree as usize)
    }

    /// The net of `face` of the patches' own degree, in storage order: 28 or 36 points. Those of
    /// neighbours carry the same bits along their shared edge too.
    pub fn own_net(&self, face: usize) -> Vec<Vec3> {
        if self.degree() != 6 {
            return self.net(face).to_vec();
        }
        let curve = |corner| self.raised_edge(face, corner, raise_quartic_to_sextic);
        let net = net_of_boundary(&[0, 1, 2].map(curve));
        let row = &self.interior[face];
        let interior = |i: usize| Vec3::new(row[3 * i], row[3 * i + 1], row[3 * i + 2]);
        lower_to_sextic(net, &std::array::from_fn(interior)).to_vec()
    }

    /// The curve of the edge from `corner` to the next one, raised.
    fn raised_edge<const N: usize>(
        &self,
        face: usize,
        corner: usize,
        raise: impl Fn(&[Vec3; 5]) -> [Vec3; N],
    ) -> [Vec3; N] {
        let from = self.face[face][corner] as usize;
        let to = self.face[face][(corner + 1) % 3] as usize;
        let inner = &self.boundary[self.edge_of[3 * face + corner] as usize];
        let at = |k: usize| Vec3::new(inner[3 * k], inner[3 * k + 1], inner[3 * k + 2]);
        let end = |v: usize| Vec3::from(self.position[v]);
        let (low, high) = (from.min(to), from.max(to));
        let mut curve = raise(&[end(low), at(0), at(1), at(2), end(high)]);
        if from > to {
            curve.reverse();
        }
        curve
    }
}
