//! Tetrahedra that are not worth a proof.

use crate::certificate::set;
use crate::complex::Tetrahedron;
use crate::interpolant::{LANES, Octet};
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Jet1};

/// Tetrahedra that turn from the gradient so far that their cosine is below this, at points of
/// their own piece, are refined without asking for a proof: it would take many boxes.
const HOPELESS_COSINE: f64 = 0.25;

/// A corner of the mesh on an edge of a cube's tetrahedra.
#[derive(Clone, Copy)]
struct Corner {
    ends: [u32; 2],
    point: u32,
}

/// Of each group, at most 64 tetrahedra with their octets, those whose own piece is seen to turn too
/// far from the gradient.
pub(crate) fn hopeless<'a>(
    field: &dyn Field,
    groups: impl Iterator<Item = (&'a [Tetrahedron], &'a [Octet])> + Clone,
) -> Vec<u64> {
    let mut points = Vec::new();
    // The tetrahedra of a group have most edges in common.
    let mut corners: Vec<Corner> = Vec::new();
    let mut of_group: Vec<(u8, u32)> = Vec::new();
    let mut ends = Vec::new();
    for (tetrahedra, octets) in groups.clone() {
        corners.clear();
        for (l, t) in tetrahedra.iter().enumerate() {
            for ((a, b), at) in octets[l / LANES].crossings(l % LANES) {
                let ends = [t[a], t[b]];
                let known = corners.iter().find(|corner| corner.ends == ends).map(|c| c.point);
                let point = known.unwrap_or_else(|| {
                    corners.push(Corner { ends, point: points.len() as u32 });
                    points.push(at);
                    points.len() as u32 - 1
                });
                of_group.push((l as u8, point));
            }
        }
        ends.push(of_group.len());
    }
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    field.gradients(&points, &mut jets);
    let slopes: Vec<f64> = jets.iter().map(|jet| jet.gradient.norm()).collect();
    let mut first = 0;
    let groups = groups.zip(ends).map(|((_, octets), end)| {
        let found = of_group[first..end].iter().filter(|&&(l, point)| {
            let (l, f) =
                (octets[l as usize / LANES].gradient_of(l as usize % LANES), point as usize);
            l.dot(&jets[f].gradient) < HOPELESS_COSINE * l.norm() * slopes[f]
        });
        first = end;
        set(found.map(|&(l, _)| l as usize))
    });
    groups.collect()
}
