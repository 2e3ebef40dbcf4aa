//! Closed intervals with outward rounding.

/// A closed interval `[lo, hi]`; NaN bounds mean "nothing known".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
}

/// Enclosures of a value and its gradient over a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntervalJet {
    /// Enclosure of the value.
    pub value: Interval,
    /// Enclosure of each partial derivative.
    pub gradient: [Interval; 3],
}

impl Interval {
    /// The interval between two bounds.
    pub fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// Whether zero may be a member; true where nothing is known.
    pub fn may_be_zero(&self) -> bool {
        !(self.lo > 0.0 || self.hi < 0.0)
    }

    /// The interval moved down by `shift`, rounded outward.
    #[must_use]
    pub fn minus(self, shift: f64) -> Self {
        Self { lo: (self.lo - shift).next_down(), hi: (self.hi - shift).next_up() }
    }
}
