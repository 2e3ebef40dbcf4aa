//! Which components of a surface bound which solids.

use crate::mass::{Integrator, Mass};
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::Vec3;

/// A connected part of the surface.
#[derive(Clone, Debug)]
pub(crate) struct Shell {
    /// Its faces, ascending.
    pub(crate) faces: Vec<usize>,
    /// Its integrals; the volume is negative where it bounds a hole.
    pub(crate) mass: Mass,
}

/// An outer shell and the holes in it.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub(crate) outer: Shell,
    pub(crate) voids: Vec<Shell>,
}

/// The solids of a surface, in the order of their first faces.
///
/// A shell of negative volume is a void of the smallest solid around it; one that no solid
/// surrounds bounds the outside of space and stands as a solid of its own.
pub(crate) fn solids(patches: &PatchesView<'_>) -> Vec<Solid> {
    let (mut solids, mut holes) = (Vec::new(), Vec::new());
    for shell in shells(patches) {
        if shell.mass.volume < 0.0 {
            holes.push(shell);
        } else {
            solids.push(Solid { outer: shell, voids: Vec::new() });
        }
    }
    for hole in holes {
        let point = Vec3::from(patches.position[patches.face[hole.faces[0]][0] as usize]);
        let around = solids.iter_mut().filter(|s| surrounds(patches, &s.outer, point));
        match around.min_by(|a, b| a.outer.mass.volume.total_cmp(&b.outer.mass.volume)) {
            Some(solid) => solid.voids.push(hole),
            None => solids.push(Solid { outer: hole, voids: Vec::new() }),
        }
    }
    solids
}

fn shells(patches: &PatchesView<'_>) -> Vec<Shell> {
    let mut parent: Vec<usize> = (0..patches.position.len()).collect();
    for face in patches.face {
        for k in 1..3 {
            let (a, b) = (root(&mut parent, face[0] as usize), root(&mut parent, face[k] as usize));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut shell_of = vec![usize::MAX; parent.len()];
    let mut faces: Vec<Vec<usize>> = Vec::new();
    for (f, face) in patches.face.iter().enumerate() {
        let root = root(&mut parent, face[0] as usize);
        if shell_of[root] == usize::MAX {
            shell_of[root] = faces.len();
            faces.push(Vec::new());
        }
        faces[shell_of[root]].push(f);
    }
    let integrator = Integrator::new();
    let shell = |faces: Vec<usize>| {
        let origin = Vec3::from(patches.position[patches.face[faces[0]][0] as usize]);
        let mass = integrator.integrate(patches, faces.iter().copied(), origin);
        Shell { faces, mass }
    };
    faces.into_iter().map(shell).collect()
}

/// The least vertex known to be connected; paths are halved on the way.
fn root(parent: &mut [usize], mut v: usize) -> usize {
    while parent[v] != v {
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    v
}

/// Whether the flat faces of a shell wind around a point: components of one surface do not meet,
/// so flat faces tell as well as patches.
fn surrounds(patches: &PatchesView<'_>, shell: &Shell, point: Vec3) -> bool {
    let corner = |v: u32| Vec3::from(patches.position[v as usize]) - point;
    let angles = shell.faces.iter().map(|&f| solid_angle(patches.face[f].map(corner)));
    angles.sum::<f64>() > 2.0 * std::f64::consts::PI
}

/// Solid angle of a triangle seen from the origin, by the formula of Van Oosterom and Strackee.
fn solid_angle([a, b, c]: [Vec3; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(|p| p.norm());
    let volume = a.dot(&b.cross(&c));
    let spread = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    2.0 * libm::atan2(volume, spread)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn apart_components_are_solids_of_their_own() {
        let patches = sample::ball_and_ring();
        let solids = solids(&patches.view());
        let counts: Vec<usize> = solids.iter().map(|s| s.outer.faces.len()).collect();
        assert_eq!(counts, [8, 192]);
        assert!(solids.iter().all(|s| s.voids.is_empty() && s.outer.mass.volume > 0.0));
    }

    #[test]
    fn an_inside_out_component_is_a_void_of_the_solid_around_it() {
        let patches = sample::hollow_ball_and_ring();
        let solids = solids(&patches.view());
        assert_eq!(solids.len(), 2);
        assert_eq!(solids[0].voids.len(), 1);
        let ratio = solids[0].voids[0].mass.volume / solids[0].outer.mass.volume;
        assert!((ratio + 0.064).abs() < 1e-13, "{ratio}");
        assert!(solids[1].voids.is_empty());
    }
}
