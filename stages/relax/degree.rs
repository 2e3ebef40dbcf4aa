//! The degree of the patches, and where nets of degree 6 lie in those of degree 7.

use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_fitting::net::{boundary_net, boundary_net_sextic};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{
    DEGREE, INNERMOST_SLOTS, N_CONTROL, bernstein, boundary_index, exponents, first_inner_slot,
    interior_indices,
};

/// Degree of the patches.
///
/// Nets of degree 6 are kept in slots of septic nets, so that both share all that follows: boundary
/// rows without their last step, steps 1, 2, 3, 4 of first inner rows in steps 1, 2, 4, 5, which
/// keeps them symmetric, and the middle point in the first of the innermost slots. Slots without a
/// point weigh nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Degree {
    Six,
    Seven,
}

impl Degree {
    pub(crate) fn number(self) -> usize {
        match self {
            Self::Six => 6,
            Self::Seven => DEGREE,
        }
    }

    /// Slot of each control point, in storage order.
    pub(crate) fn slots(self) -> Vec<usize> {
        match self {
            Self::Six => exponents(6).map(sextic_slot).collect(),
            Self::Seven => (0..N_CONTROL).collect(),
        }
    }

    /// The Bernstein polynomials at barycentric coordinates, by slots.
    pub(crate) fn bernstein(self, at: [f64; 3]) -> [f64; N_CONTROL] {
        let mut out = [0.0; N_CONTROL];
        for (slot, value) in self.slots().into_iter().zip(bernstein(self.number(), at)) {
            out[slot] = value;
        }
        out
    }

    /// A net whose points lie evenly in a plane, by slots.
    #[cfg(test)]
    pub(crate) fn flat_net(self) -> [Vec3; N_CONTROL] {
        let mut net = [Vec3::zeros(); N_CONTROL];
        let places = isospline_geometry::bezier_triangle::grid(self.number());
        for ([_, v, w], slot) in places.zip(self.slots()) {
            net[slot] = Vec3::new(v, w, 0.0);
        }
        net
    }

    /// The net of `face` with its boundary in place, zero inside, by slots.
    pub(crate) fn boundary_net(
        self,
        mesh: &BaseMeshView<'_>,
        network: &NetworkView<'_>,
        face: usize,
    ) -> [Vec3; N_CONTROL] {
        match self {
            Self::Seven => boundary_net(mesh, network, face),
            Self::Six => {
                let net = boundary_net_sextic(mesh, network, face);
                let mut out = [Vec3::zeros(); N_CONTROL];
                self.slots().into_iter().zip(net).for_each(|(slot, p)| out[slot] = p);
                out
            }
        }
    }
}

fn sextic_slot(e: [usize; 3]) -> usize {
    if e == [2, 2, 2] {
        return interior_indices()[INNERMOST_SLOTS[0]];
    }
    for corner in 0..3 {
        let [_, along, inward] = [0, 1, 2].map(|k| e[(corner + k) % 3]);
        match inward {
            0 if along < 6 => return boundary_index(DEGREE, corner, along),
            1 if (1..=4).contains(&along) => {
                return interior_indices()[first_inner_slot(corner, sextic_step(along))];
            }
            _ => {}
        }
    }
    unreachable!("a point of degree 6 lies on a boundary or a first inner row, or in the middle")
}

/// Step in its septic slots of step `s` of a first inner row of degree 6.
pub(crate) const fn sextic_step(s: usize) -> usize {
    if s > 2 { s + 1 } else { s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::{first_inner_index, index, n_control};

    #[test]
    fn every_point_of_degree_6_has_a_slot_of_its_own_of_the_same_kind() {
        let mut slots = Degree::Six.slots();
        for corner in 0..3 {
            for s in 1..=4 {
                let slot = interior_indices()[first_inner_slot(corner, sextic_step(s))];
                assert_eq!(slots[first_inner_index(6, corner, s)], slot);
            }
            assert_eq!(slots[boundary_index(6, corner, 0)], boundary_index(7, corner, 0));
        }
        assert!(interior_indices().contains(&slots[index([2, 2, 2])]));
        slots.sort_unstable();
        slots.dedup();
        assert_eq!(slots.len(), n_control(6));
    }
}
