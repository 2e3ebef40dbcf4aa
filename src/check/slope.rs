//! Angles between vectors, compared without an arc tangent each.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::lanes::{LANES, Lane, cross, dot};

/// An angle kept as (sine, cosine) times a common length.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slope {
    sine_sq: f64,
    cosine: f64,
    /// Grows with the angle, from 0 at 0 to 2 at half a turn; not-a-number for zero vectors.
    rank: f64,
}

impl Slope {
    /// What counts where one of two normals does not exist.
    pub(crate) const HALF_TURN: Self = Self { sine_sq: 0.0, cosine: -1.0, rank: 2.0 };

    /// The angle between two vectors of any length.
    #[inline(always)]
    pub(crate) fn between(a: [f64; 3], b: [f64; 3]) -> Self {
        let normal = cross(a, b);
        let (sine_sq, cosine) = (dot(normal, normal), dot(a, b));
        let part = sine_sq / (sine_sq + cosine * cosine);
        Self { sine_sq, cosine, rank: if cosine < 0.0 { 2.0 - part } else { part } }
    }

    /// Whether it is the larger angle; not-a-number is larger than all others.
    #[inline(always)]
    pub(crate) fn is_steeper_than(&self, other: &Self) -> bool {
        self.rank > other.rank || (self.rank.is_nan() && !other.rank.is_nan())
    }

    pub(crate) fn angle_deg(&self) -> f64 {
        if self.rank.is_nan() {
            return f64::NAN;
        }
        libm::atan2(self.sine_sq.sqrt(), self.cosine).to_degrees()
    }
}

/// Angles of many pairs of vectors, those of eight cases beside each other.
#[repr(C, align(64))]
pub(crate) struct Slopes<const N: usize> {
    sine_sq: [f64; N],
    pub(crate) cosine: [f64; N],
    rank: [f64; N],
}

impl<const N: usize> Slopes<N> {
    /// All zero.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { sine_sq: [0.0; N], cosine: [0.0; N], rank: [0.0; N] }
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, slope: Slope) {
        self.sine_sq[i] = slope.sine_sq;
        self.cosine[i] = slope.cosine;
        self.rank[i] = slope.rank;
    }

    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> Slope {
        Slope { sine_sq: self.sine_sq[i], cosine: self.cosine[i], rank: self.rank[i] }
    }
}

/// The largest angle of each case and where it is.
pub(crate) struct Steepest {
    sine_sq: Lane,
    cosine: Lane,
    rank: Lane,
    at: Lane,
}

impl Steepest {
    pub(crate) const NONE: Self =
        Self { sine_sq: [0.0; LANES], cosine: [0.0; LANES], rank: [0.0; LANES], at: [0.0; LANES] };

    /// Takes in those at place `at`, which stand from `first` on.
    #[inline(always)]
    pub(crate) fn enter<const N: usize>(&mut self, at: usize, slopes: &Slopes<N>, first: usize) {
        for k in 0..LANES {
            let (old, new) = (self.of(k), slopes.get(first + k));
            let is_new = new.is_steeper_than(&old);
            let kept = if is_new { new } else { old };
            (self.sine_sq[k], self.cosine[k], self.rank[k]) =
                (kept.sine_sq, kept.cosine, kept.rank);
            self.at[k] = if is_new { at as f64 } else { self.at[k] };
        }
    }

    /// That of a case.
    #[inline(always)]
    pub(crate) fn of(&self, k: usize) -> Slope {
        Slope { sine_sq: self.sine_sq[k], cosine: self.cosine[k], rank: self.rank[k] }
    }

    /// Where it is.
    pub(crate) fn at(&self, k: usize) -> usize {
        self.at[k] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const Z: [f64; 3] = [0.0, 0.0, 1.0];

    fn turned(angle: f64) -> [f64; 3] {
        [7.0 * libm::sin(angle), 0.0, 7.0 * libm::cos(angle)]
    }

    #[test]
    fn slopes_rank_as_their_angles_do() {
        let angles = [1e-9, 1e-4, 0.5, 1.5, 1.6, 3.0, 3.1];
        let slopes = angles.map(|a| Slope::between(Z, turned(a)));
        for pair in slopes.windows(2) {
            assert!(pair[1].is_steeper_than(&pair[0]) && !pair[0].is_steeper_than(&pair[1]));
        }
        for (slope, angle) in slopes.iter().zip(angles) {
            assert!((slope.angle_deg() - angle.to_degrees()).abs() < 1e-12);
        }
        let none = Slope::between([0.0; 3], Z);
        assert!(none.is_steeper_than(&slopes[6]) && none.angle_deg().is_nan());
        assert!(Slope::HALF_TURN.is_steeper_than(&slopes[6]));
        assert!((Slope::HALF_TURN.angle_deg() - 180.0).abs() < 1e-12);
    }

    #[test]
    fn a_known_dihedral_angle_is_measured_to_rounding() {
        for angle in [1e-9, 1e-3, 1.0, 90.0, 179.0] {
            let found = Slope::between(Z, turned(f64::to_radians(angle))).angle_deg();
            assert!((found - angle).abs() < 1e-13 * angle, "{found} {angle}");
        }
    }

    #[test]
    fn the_steepest_of_each_case_is_kept_with_its_place() {
        let mut steepest = Steepest::NONE;
        for at in 0..20_usize {
            // Case k is steepest at place k.
            let angle = |k: usize| 1.0 / (1.0 + at.abs_diff(k) as f64);
            let mut slopes: Slopes<LANES> = Slopes::new();
            (0..LANES).for_each(|k| slopes.set(k, Slope::between(Z, turned(angle(k)))));
            steepest.enter(at, &slopes, 0);
        }
        for k in 0..LANES {
            assert_eq!(steepest.at(k), k);
            assert!((steepest.of(k).angle_deg() - 1f64.to_degrees()).abs() < 1e-12);
        }
    }
}
