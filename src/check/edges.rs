//! All that is measured edge by edge, from one look at the nets on both sides.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::continuity::{self, Angles, Continuity};
use crate::curvature::{CurvatureTable, FLAT_REL, Second, relative_jumps};
use crate::lanes::{LANES, Lane, Triple};
use crate::seam::{Both, Derivatives, EdgeTable, Seam};
use crate::sector::{Ends, Weights, both_ends};
use crate::surface::Surface;
use crate::topology::Joint;
use isospline_geometry::HalfEdge;
use isospline_implicit::{Jet1, Kernel, run_widest};

/// What shared edges one after another show.
#[derive(Debug, Default)]
pub(crate) struct Edges {
    pub(crate) continuity: Continuity,
    /// Relative jump of the normal curvature, by edge.
    pub(crate) jumps: Vec<f64>,
    pub(crate) weights: Weights,
}

/// What all edges are measured with.
pub(crate) struct Gauge<'a> {
    surface: &'a Surface<'a>,
    at_vertices: &'a [Jet1],
    table: EdgeTable,
    curvature_table: CurvatureTable,
    /// Curvature that counts as none.
    flat: f64,
}

impl<'a> Gauge<'a> {
    /// For a surface and the field at its vertices.
    pub(crate) fn new(surface: &'a Surface<'a>, at_vertices: &'a [Jet1]) -> Self {
        let flat = FLAT_REL / surface.diagonal();
        let (table, curvature_table) = (EdgeTable::new(), CurvatureTable::new());
        Self { surface, at_vertices, table, curvature_table, flat }
    }

    /// Measures some edges.
    pub(crate) fn measure(&self, joints: &[Joint]) -> Edges {
        let (mut out, mut desk) = (Edges::default(), Desk::new());
        for joints in joints.chunks(LANES) {
            desk.seam.set(self.surface, joints);
            desk.normals = self.normals(joints);
            let found = run_widest(Measure { gauge: self, desk: &mut desk });
            out.continuity.enter(&found.continuity, joints.iter().map(|joint| joint.left));
            out.jumps.extend(&found.jumps[..joints.len()]);
            for ends in &found.ends {
                out.weights.enter(ends, joints.len());
            }
        }
        out
    }

    /// Gradients at the origins of the half-edges on the left and on the right.
    fn normals(&self, joints: &[Joint]) -> [Triple; 2] {
        let mut out = [[[0.0; LANES]; 3]; 2];
        for (k, joint) in joints.iter().enumerate() {
            let normal = |h: HalfEdge| self.at_vertices[self.surface.origin(h) as usize].gradient;
            for (out, normal) in out.iter_mut().zip([joint.left, joint.right].map(normal)) {
                (0..3).for_each(|c| out[c][k] = normal[c]);
            }
        }
        out
    }
}

impl Edges {
    /// Takes in the edges that follow.
    pub(crate) fn append(&mut self, other: Self) {
        self.continuity.append(other.continuity);
        self.jumps.extend(other.jumps);
        self.weights.append(&other.weights);
    }
}

/// What is known of eight edges while they are measured.
struct Desk {
    seam: Seam,
    normals: [Triple; 2],
    first: Both<Derivatives>,
    second: Both<Second>,
    angles: Angles,
}

impl Desk {
    fn new() -> Self {
        Self {
            seam: Seam::new(),
            normals: [[[0.0; LANES]; 3]; 2],
            first: Both { left: Derivatives::new(), right: Derivatives::new() },
            second: Both { left: Second::new(), right: Second::new() },
            angles: Angles::new(),
        }
    }
}

struct Measure<'a> {
    gauge: &'a Gauge<'a>,
    desk: &'a mut Desk,
}

/// What eight edges show, each in its lane.
struct Found {
    continuity: continuity::Eight,
    jumps: Lane,
    ends: [Ends; 2],
}

impl Kernel for Measure<'_> {
    type Output = Found;

    #[inline(always)]
    fn run(self) -> Found {
        let Self { gauge, desk: Desk { seam, normals, first, second, angles } } = self;
        Derivatives::set_both(first, seam, &gauge.table);
        Second::set_both(second, seam, &gauge.curvature_table);
        angles.set(first);
        Found {
            continuity: continuity::Eight::of(seam, angles),
            jumps: relative_jumps(first, second, gauge.flat),
            ends: both_ends(seam, normals),
        }
    }
}
