//! From a fit triangle mesh to the base mesh: order, adjacency, frames.

use crate::order::{by_lowest, in_front_order};
use isospline_artifact::kinds::{BaseMesh, Bounds, EdgeKind, Fan, Frame};
use isospline_geometry::triangle_mesh::{BORDER, Defect};
use isospline_geometry::{HalfEdge, TriangleMesh, Vec3};
use isospline_implicit::{Field, Jet1};
use isospline_stage::Host;
use std::sync::OnceLock;

/// Why a mesh cannot be frozen.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FreezeError {
    /// The faces are not an oriented manifold.
    #[error("the mesh is not an oriented manifold: {0:?}")]
    NotManifold(Defect),
    /// The mesh has a border.
    #[error("the mesh is open: the edge from {from} to {to} has one face only")]
    Open {
        /// Position of an end of the border edge.
        from: Vec3,
        /// Position of its other end.
        to: Vec3,
    },
    /// The gradient vanishes or is not a number at a vertex.
    #[error("no normal at {place}: the gradient is {gradient}")]
    NoNormal {
        /// The vertex position.
        place: Vec3,
        /// The gradient found.
        gradient: Vec3,
    },
}

/// Orders the mesh and fills every row of the base mesh, on the host's threads. Positions keep their
/// bits.
///
/// # Errors
/// [`FreezeError`] for meshes that are open or not manifold, and where there is no normal.
pub fn freeze(
    mesh: &TriangleMesh,
    field: &dyn Field,
    host: &dyn Host,
) -> Result<BaseMesh, FreezeError> {
    let mesh = in_front_order(mesh);
    let opposite = mesh.opposites().map_err(FreezeError::NotManifold)?;
    mesh.check_fans(&opposite).map_err(FreezeError::NotManifold)?;
    refuse_borders(&mesh, &opposite)?;
    let (edges, about) = both(
        host,
        || Edges::of(&mesh, &opposite),
        || {
            let component = mesh.face_components(&opposite);
            let frames = frames(&mesh, field, &component)?;
            Ok((component, frames, Stars::of(&mesh, &opposite)))
        },
    );
    let (component, frame, stars) = about?;
    let corners = mesh.faces.as_flattened();
    let bounds = mesh.bounds();
    Ok(BaseMesh {
        position: mesh.positions.iter().map(|&p| p.into()).collect(),
        frame,
        shape: Vec::new(),
        face: mesh.faces.clone(),
        face_sheet: component,
        edge_kind: vec![EdgeKind::Smooth.code(); edges.ends.len()],
        edge: edges.ends,
        edge_half: edges.halves,
        edge_of: edges.of_half,
        sector: corners.to_vec(),
        fan: stars.fans(),
        star_first: stars.first,
        star: stars.halves,
        star_row: stars.row_of_half,
        bounds: vec![Bounds {
            min: bounds.min.into(),
            max: bounds.max.into(),
            diagonal: bounds.diagonal(),
        }],
        opposite,
    })
}

/// What two computations give, each on a thread.
fn both<A: Send + Sync, B: Send + Sync>(
    host: &dyn Host,
    first: impl Fn() -> A + Sync,
    second: impl Fn() -> B + Sync,
) -> (A, B) {
    let (a, b) = (OnceLock::new(), OnceLock::new());
    host.for_each(2, &|k| {
        // A host calls each index once.
        if k == 0 {
            let _ = a.set(first());
        } else {
            let _ = b.set(second());
        }
    });
    const RAN: &str = "invariant: each index ran";
    (a.into_inner().expect(RAN), b.into_inner().expect(RAN))
}

fn refuse_borders(mesh: &TriangleMesh, opposite: &[u32]) -> Result<(), FreezeError> {
    let Some(h) = opposite.iter().position(|&o| o == BORDER) else { return Ok(()) };
    let h = HalfEdge(h as u32);
    let at = |h| mesh.positions[mesh.origin(h) as usize];
    Err(FreezeError::Open { from: at(h), to: at(h.next()) })
}

/// One frame a vertex; the sheet is the component of its faces.
fn frames(
    mesh: &TriangleMesh,
    field: &dyn Field,
    component: &[u32],
) -> Result<Vec<Frame>, FreezeError> {
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; mesh.positions.len()];
    field.gradients(&mesh.positions, &mut jets);
    let mut sheet = vec![0; mesh.positions.len()];
    for (face, c) in mesh.faces.iter().zip(component) {
        for &v in face {
            sheet[v as usize] = *c;
        }
    }
    let frame = |v: usize| {
        let gradient = jets[v].gradient;
        let gradient_norm = gradient.norm();
        if !(gradient_norm > 0.0 && gradient_norm.is_finite()) {
            return Err(FreezeError::NoNormal { place: mesh.positions[v], gradient });
        }
        let normal = (gradient / gradient_norm).into();
        Ok(Frame { normal, gradient_norm, vertex: v as u32, sheet: sheet[v] })
    };
    (0..mesh.positions.len()).map(frame).collect()
}

struct Edges {
    ends: Vec<[u32; 2]>,
    halves: Vec<[u32; 2]>,
    of_half: Vec<u32>,
}

impl Edges {
    /// Edges sorted by their vertices; each from the half-edge that runs from low to high.
    fn of(mesh: &TriangleMesh, opposite: &[u32]) -> Self {
        let ends = |h: HalfEdge| [mesh.origin(h), mesh.origin(h.next())];
        let rising = |h: &HalfEdge| ends(*h)[0] < ends(*h)[1];
        let all = (0..opposite.len() as u32).map(HalfEdge);
        let forward: Vec<([u32; 2], HalfEdge)> = all.filter(rising).map(|h| (ends(h), h)).collect();
        let (_, forward) = by_lowest(mesh.positions.len(), &forward, |(ends, _)| ends[0]);
        let mut of_half = vec![0; opposite.len()];
        for (e, (_, h)) in (0u32..).zip(&forward) {
            of_half[h.row()] = e;
            of_half[opposite[h.row()] as usize] = e;
        }
        Self {
            ends: forward.iter().map(|&(ends, _)| ends).collect(),
            halves: forward.iter().map(|(_, h)| [h.0, opposite[h.row()]]).collect(),
            of_half,
        }
    }
}

struct Stars {
    first: Vec<u32>,
    halves: Vec<u32>,
    row_of_half: Vec<u32>,
}

impl Stars {
    /// Outgoing half-edges of each vertex counter-clockwise, from its lowest one.
    fn of(mesh: &TriangleMesh, opposite: &[u32]) -> Self {
        let n_vertices = mesh.positions.len();
        let mut start = vec![BORDER; n_vertices];
        let mut first = vec![0u32; n_vertices + 1];
        for h in (0..opposite.len() as u32).map(HalfEdge) {
            let v = mesh.origin(h) as usize;
            start[v] = start[v].min(h.0);
            first[v + 1] += 1;
        }
        for v in 0..n_vertices {
            first[v + 1] += first[v];
        }
        let mut halves = Vec::with_capacity(opposite.len());
        let mut row_of_half = vec![0; opposite.len()];
        for v in 0..n_vertices {
            let mut h = start[v];
            for row in first[v]..first[v + 1] {
                halves.push(h);
                row_of_half[h as usize] = row;
                h = opposite[HalfEdge(h).prev().row()];
            }
        }
        Self { first, halves, row_of_half }
    }

    /// One closed fan a vertex.
    fn fans(&self) -> Vec<Fan> {
        let fan = |(v, rows): (usize, &[u32])| Fan {
            vertex: v as u32,
            first_half_edge: self.halves[rows[0] as usize],
            n_faces: rows[1] - rows[0],
            closed: 1,
        };
        self.first.windows(2).enumerate().map(fan).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;

    fn octahedron() -> TriangleMesh {
        let positions = vec![Vec3::x(), Vec3::y(), Vec3::z(), -Vec3::x(), -Vec3::y(), -Vec3::z()];
        let faces = vec![
            [0, 1, 2],
            [1, 3, 2],
            [3, 4, 2],
            [4, 0, 2],
            [1, 0, 5],
            [3, 1, 5],
            [4, 3, 5],
            [0, 4, 5],
        ];
        TriangleMesh { positions, faces }
    }

    fn sphere() -> ClosureField {
        ClosureField::new(2.0, |p: Vec3| p.norm() - 1.0).with_gradient(|p: Vec3| p / p.norm())
    }

    #[test]
    fn every_adjacency_row_of_an_octahedron_agrees_with_the_faces() {
        let base = freeze(&octahedron(), &sphere(), &Serial).unwrap();
        assert_eq!((base.edge.len(), base.star.len()), (12, 24));
        let origin = |h: u32| base.face[(h / 3) as usize][(h % 3) as usize];
        for (e, (&[a, b], &[h, g])) in base.edge.iter().zip(&base.edge_half).enumerate() {
            assert!(a < b);
            assert_eq!([origin(h), origin(g)], [a, b]);
            assert_eq!([base.opposite[h as usize], base.opposite[g as usize]], [g, h]);
            assert_eq!([base.edge_of[h as usize], base.edge_of[g as usize]], [e as u32; 2]);
        }
        for v in 0..6 {
            let rows = base.star_first[v] as usize..base.star_first[v + 1] as usize;
            assert_eq!(rows.len(), 4);
            for row in rows {
                let h = base.star[row];
                assert_eq!(origin(h), v as u32);
                assert_eq!(base.star_row[h as usize], row as u32);
                assert_eq!(base.sector[h as usize], v as u32);
            }
        }
    }

    #[test]
    fn stars_turn_counter_clockwise_about_the_outward_normal() {
        let base = freeze(&octahedron(), &sphere(), &Serial).unwrap();
        let origin = |h: u32| base.face[(h / 3) as usize][(h % 3) as usize] as usize;
        let at = |v: usize| Vec3::from(base.position[v]);
        for v in 0..6 {
            let (first, end) = (base.star_first[v] as usize, base.star_first[v + 1] as usize);
            for row in first..end {
                let next = if row + 1 == end { first } else { row + 1 };
                let to = |row: usize| at(origin(HalfEdge(base.star[row]).next().0)) - at(v);
                let turn = to(row).cross(&to(next)).dot(&Vec3::from(base.frame[v].normal));
                assert!(turn > 0.0);
            }
        }
    }

    #[test]
    fn an_open_mesh_is_refused_with_its_border() {
        let mut mesh = octahedron();
        mesh.faces.pop();
        let found = freeze(&mesh, &sphere(), &Serial).unwrap_err();
        assert!(matches!(found, FreezeError::Open { .. }), "{found:?}");
    }

    #[test]
    fn a_vertex_without_a_gradient_is_refused_with_its_place() {
        let flat = ClosureField::new(1.0, |_| 0.0).with_gradient(|_| Vec3::zeros());
        let found = freeze(&octahedron(), &flat, &Serial).unwrap_err();
        assert!(matches!(found, FreezeError::NoNormal { .. }), "{found:?}");
    }
}
