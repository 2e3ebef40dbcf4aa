//! The weights of the G1 condition at one end of an edge, and the control points that they need.

use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::{HalfEdge, Vec3};

/// Control points q0..q4 of the curve of half-edge `h`, from its origin.
#[inline]
pub fn outgoing_curve(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    h: HalfEdge,
) -> [Vec3; 5] {
    let e = mesh.edge_of[h.row()] as usize;
    let [a, b] = mesh.edge[e].map(|v| Vec3::from(mesh.position[v as usize]));
    let c = &network.control[e];
    let inner = |k: usize| Vec3::new(c[3 * k], c[3 * k + 1], c[3 * k + 2]);
    if mesh.edge_half[e][0] == h.0 {
        [a, inner(0), inner(1), inner(2), b]
    } else {
        [b, inner(2), inner(1), inner(0), a]
    }
}

/// `q1 - q0` of the curve of half-edge `h`: a tangent at its origin.
#[inline]
pub fn outgoing_tangent(mesh: &BaseMeshView<'_>, network: &NetworkView<'_>, h: HalfEdge) -> Vec3 {
    let q = outgoing_curve(mesh, network, h);
    q[1] - q[0]
}

/// Next outgoing half-edge counter-clockwise about the origin of `h`.
///
/// # Panics
/// At a border.
#[inline]
pub fn ccw(mesh: &BaseMeshView<'_>, h: HalfEdge) -> HalfEdge {
    HalfEdge(mesh.opposite[h.prev().row()])
}

/// Next outgoing half-edge clockwise about the origin of `h`.
///
/// # Panics
/// At a border.
#[inline]
pub fn cw(mesh: &BaseMeshView<'_>, h: HalfEdge) -> HalfEdge {
    HalfEdge(mesh.opposite[h.row()]).next()
}

/// `lambda0` and `mu0` of the row k = 0 at the origin of an edge [TK, Eq. (15)].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndWeights {
    /// In (0, 1) exactly when both sector angles beside the edge lie in (0, 180) degrees.
    pub lambda0: f64,
    /// Any sign.
    pub mu0: f64,
}

/// Weights from the tangents `q1 - q0` of an edge and of its neighbours about the vertex.
///
/// With `P, R = 4/7` of the tangents `ccw`, `cw` of the neighbours and `Q = along`:
/// `lambda0 = [P,Q] / ([P,Q] - [R,Q])`, `mu0 = ((1 - lambda0) P + lambda0 R) . Q / |Q|^2`, where
/// `[a,b] = (a x b) . normal` [derived from TK, Eq. (15)].
#[inline]
pub fn end_weights(along: &Vec3, ccw: &Vec3, cw: &Vec3, normal: &Vec3) -> EndWeights {
    let (p, r, q) = (ccw * (4.0 / 7.0), cw * (4.0 / 7.0), along);
    let (pq, rq) = (p.cross(q).dot(normal), r.cross(q).dot(normal));
    let lambda0 = pq / (pq - rq);
    let mu0 = ((1.0 - lambda0) * p + lambda0 * r).dot(q) / q.norm_squared();
    EndWeights { lambda0, mu0 }
}

/// Weights at the origin of half-edge `h`.
pub fn weights_at_origin(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    h: HalfEdge,
) -> EndWeights {
    let normal = Vec3::from(mesh.frame[mesh.sector[h.row()] as usize].normal);
    let tangent = |h| outgoing_tangent(mesh, network, h);
    end_weights(&tangent(h), &tangent(ccw(mesh, h)), &tangent(cw(mesh, h)), &normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_satisfy_the_row_of_the_vertex() {
        let normal = Vec3::z();
        let along = Vec3::new(0.3, 0.0, 0.0);
        let (ccw, cw) = (Vec3::new(0.1, 0.4, 0.0), Vec3::new(0.2, -0.3, 0.0));
        let w = end_weights(&along, &ccw, &cw, &normal);
        let left = (1.0 - w.lambda0) * ccw * (4.0 / 7.0) + w.lambda0 * cw * (4.0 / 7.0);
        assert!((left - w.mu0 * along).norm() < 1e-16);
        assert!(w.lambda0 > 0.0 && w.lambda0 < 1.0);
    }

    #[test]
    fn a_reflex_sector_puts_lambda_out_of_range() {
        let along = Vec3::new(1.0, 0.0, 0.0);
        let (ccw, cw) = (Vec3::new(-1.0, 1.0, 0.0), Vec3::new(-1.0, 0.5, 0.0));
        let w = end_weights(&along, &ccw, &cw, &Vec3::z());
        assert!(!(w.lambda0 > 0.0 && w.lambda0 < 1.0), "{w:?}");
    }
}
