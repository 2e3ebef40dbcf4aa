//! A vertex on the surface with what the field says there.

use crate::AdaptError;
use isospline_fitting::projection::project_all;
use isospline_fitting::shape::second_fundamental_form;
use isospline_geometry::Vec3;
use isospline_implicit::field::SymMat3;
use isospline_implicit::{Field, Jet2};
use isospline_stage::{Host, map};

/// Distance from the surface at which a projected point counts as lost (times the diagonal).
const LOST_REL: f64 = 1e-9;
/// Points a task: full evaluation blocks, and enough work to be worth handing out.
const SHARE: usize = 256;

/// A point of the surface, its outward unit normal and its second fundamental form [1/length].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) shape: SymMat3,
}

/// The vertices at `positions`, which stay in all bits.
///
/// # Errors
/// [`AdaptError::SingularPoint`] where the gradient is zero or not finite.
pub(crate) fn vertices_at(
    field: &dyn Field,
    host: &dyn Host,
    positions: &[Vec3],
) -> Result<Vec<Vertex>, AdaptError> {
    let found = shared_out(host, positions, |points| {
        let jets = jets_at(field, points);
        points.iter().zip(&jets).map(|(&p, jet)| vertex(p, jet)).collect()
    });
    let pairs = positions.iter().zip(found);
    pairs.map(|(&p, found)| found.ok_or(AdaptError::SingularPoint { place: p })).collect()
}

/// Projects `points` onto the surface; `None` where that fails.
pub(crate) fn feet(
    field: &dyn Field,
    host: &dyn Host,
    diagonal: f64,
    points: &[Vec3],
) -> Vec<Option<Vertex>> {
    let near = |jet: &Jet2| jet.value.abs() <= LOST_REL * diagonal * jet.gradient.norm();
    shared_out(host, points, |points| {
        let mut points = points.to_vec();
        project_all(field, diagonal, &mut points);
        let jets = jets_at(field, &points);
        let pairs = points.iter().zip(&jets);
        pairs.map(|(&p, jet)| vertex(p, jet).filter(|_| near(jet))).collect()
    })
}

/// What `make` says of all points, in their order, [`SHARE`] a task.
fn shared_out(
    host: &dyn Host,
    points: &[Vec3],
    make: impl Fn(&[Vec3]) -> Vec<Option<Vertex>> + Sync,
) -> Vec<Option<Vertex>> {
    if points.len() <= SHARE {
        return make(points);
    }
    let shares: Vec<_> = points.chunks(SHARE).collect();
    map(host, shares.len(), |k| make(shares[k])).concat()
}

fn jets_at(field: &dyn Field, points: &[Vec3]) -> Vec<Jet2> {
    let empty = Jet2 { value: 0.0, gradient: Vec3::zeros(), hessian: [0.0; 6] };
    let mut jets = vec![empty; points.len()];
    field.hessians(points, &mut jets);
    jets
}

/// A shape that is not finite (a kink of the field) counts as flat.
fn vertex(position: Vec3, jet: &Jet2) -> Option<Vertex> {
    let slope = jet.gradient.norm();
    if !(slope > 0.0 && slope.is_finite()) {
        return None;
    }
    let shape = second_fundamental_form(jet);
    let shape = if shape.iter().all(|m| m.is_finite()) { shape } else { [0.0; 6] };
    Some(Vertex { position, normal: jet.gradient / slope, shape })
}
