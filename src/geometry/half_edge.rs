//! Half-edge indices of a triangle mesh.

/// Half-edge `3f + k` runs from corner `k` to corner `k + 1 (mod 3)` of face `f`.
///
/// Faces are counter-clockwise seen from outside, so the face lies to the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HalfEdge(pub u32);

impl HalfEdge {
    /// The half-edge that leaves corner `corner` (0, 1, 2) of `face`.
    #[inline]
    pub fn new(face: u32, corner: u32) -> Self {
        Self(3 * face + corner)
    }

    /// Row of this half-edge in sections that count half-edges.
    #[inline]
    pub fn row(self) -> usize {
        self.0 as usize
    }

    /// Its face.
    #[inline]
    pub fn face(self) -> u32 {
        self.0 / 3
    }

    /// The corner of its face that it leaves: 0, 1 or 2.
    #[inline]
    pub fn corner(self) -> u32 {
        self.0 % 3
    }

    /// The next half-edge around the face.
    #[inline]
    #[must_use]
    pub fn next(self) -> Self {
        Self(if self.corner() == 2 { self.0 - 2 } else { self.0 + 1 })
    }

    /// The previous half-edge around the face.
    #[inline]
    #[must_use]
    pub fn prev(self) -> Self {
        Self(if self.corner() == 0 { self.0 + 2 } else { self.0 - 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_steps_lead_around_the_face() {
        for h in (0..12).map(HalfEdge) {
            assert_eq!(h.next().next().next(), h);
            assert_eq!(h.next().prev(), h);
            assert_eq!(h.next().face(), h.face());
            assert_eq!(HalfEdge::new(h.face(), h.corner()), h);
        }
    }
}
