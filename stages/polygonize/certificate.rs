//! The interval test that proves the topology.
//!
//! For a tetrahedron T with the linear interpolant `L` of the node values, every box that covers
//! a part of T must satisfy one of
//!
//! 1. `f` and `L` have the same strict sign on the box, by enclosures, or
//! 2. `grad L . grad f > 0` on the box, by the enclosure of `grad f`.
//!
//! Boxes that fail both are cut in eight, [`TEST_DEPTH`] times; what still fails is refined. The
//! crate's page proves what follows when all pass.

use crate::complex::{Complex, Tetrahedron};
use crate::grid::Site;
use isospline_geometry::Vec3;
use isospline_implicit::{Interval, IntervalJet};
use isospline_stage::Ctx;

/// How often a box is cut for the test alone. One more finds a few more proofs at four times
/// the cost; one less refines the mesh where only the enclosures were wide.
pub(crate) const TEST_DEPTH: u32 = 2;
/// Margin for the rounding of the interpolant, relative to the terms that are summed.
const ROUNDING: f64 = 1e-10;

/// The linear interpolant on a tetrahedron.
#[derive(Clone, Copy, Debug)]
struct Interpolant {
    corner: Vec3,
    /// Gradients of the barycentrics of corners 1, 2, 3.
    barycentric: [Vec3; 3],
    value: f64,
    gradient: Vec3,
    least: f64,
    most: f64,
}

/// The tetrahedra, of those given, that fail the test on the box `lo .. hi` that holds them all.
pub(crate) fn failing(
    ctx: &Ctx<'_>,
    complex: &Complex,
    tetrahedra: &[Tetrahedron],
    (lo, hi): (Site, Site),
) -> Vec<Tetrahedron> {
    let interpolants: Vec<_> = tetrahedra.iter().map(|t| Interpolant::of(complex, t)).collect();
    let test = Test { ctx, complex, interpolants: &interpolants };
    let failed = test.failing_on(lo, hi, (1 << tetrahedra.len()) - 1, TEST_DEPTH);
    (0..tetrahedra.len()).filter(|i| failed >> i & 1 == 1).map(|i| tetrahedra[i]).collect()
}

/// Box around a tetrahedron.
pub(crate) fn box_around(complex: &Complex, t: &Tetrahedron) -> (Site, Site) {
    let sites = t.map(|n| complex.site(n));
    let over = |k: usize| sites.iter().map(move |s| s[k]);
    let least = |k| over(k).min().expect("invariant: four nodes");
    let most = |k| over(k).max().expect("invariant: four nodes");
    ([0, 1, 2].map(least), [0, 1, 2].map(most))
}

struct Test<'a> {
    ctx: &'a Ctx<'a>,
    complex: &'a Complex,
    interpolants: &'a [Interpolant],
}

impl Test<'_> {
    /// The members of the bit set `open` that fail on the box.
    fn failing_on(&self, lo: Site, hi: Site, open: u32, depth: u32) -> u32 {
        let grid = &self.complex.grid;
        let Some(jet) = self.ctx.field.gradient_enclosure(grid.intervals(lo, hi)) else {
            return open;
        };
        let middle = 0.5 * (grid.point(lo) + grid.point(hi));
        let radius = 0.5 * (grid.point(hi) - grid.point(lo));
        let members = (0..self.interpolants.len()).filter(|i| open >> i & 1 == 1);
        let open = members
            .filter(|&i| !self.interpolants[i].passes(&jet, middle, radius))
            .fold(0, |set, i| set | 1 << i);
        if open == 0 || depth == 0 {
            return open;
        }
        let mut failed = 0;
        for (lo, hi) in octants(lo, hi) {
            // One failing box settles a tetrahedron: no need to look at its other boxes.
            let left = open & !failed;
            if left == 0 {
                break;
            }
            failed |= self.failing_on(lo, hi, left, depth - 1);
        }
        failed
    }
}

/// The eight parts of a box, fewer where a side is a single lattice step.
fn octants(lo: Site, hi: Site) -> impl Iterator<Item = (Site, Site)> {
    let middle = [0, 1, 2].map(|k| u32::midpoint(lo[k], hi[k]));
    (0..8u32).filter_map(move |i| {
        let upper = [i & 1 == 1, i >> 1 & 1 == 1, i >> 2 == 1];
        let from = [0, 1, 2].map(|k| if upper[k] { middle[k] } else { lo[k] });
        let to = [0, 1, 2].map(|k| if upper[k] { hi[k] } else { middle[k] });
        // A side of one step has its middle at the lower end: only the upper part is a box.
        (0..3).all(|k| from[k] < to[k]).then_some((from, to))
    })
}

impl Interpolant {
    fn of(complex: &Complex, t: &Tetrahedron) -> Self {
        let [p0, p1, p2, p3] = t.map(|n| complex.point(n));
        let f = t.map(|n| complex.value(n));
        let (a, b, c) = (p1 - p0, p2 - p0, p3 - p0);
        let volume = a.cross(&b).dot(&c);
        let barycentric = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|n| n / volume);
        let gradient = (0..3).map(|k| (f[k + 1] - f[0]) * barycentric[k]).sum();
        let [least, most] = [f64::min, f64::max].map(|pick| f.into_iter().reduce(pick));
        let (least, most) = least.zip(most).expect("invariant: four nodes");
        Self { corner: p0, barycentric, value: f[0], gradient, least, most }
    }

    fn passes(&self, jet: &IntervalJet, middle: Vec3, radius: Vec3) -> bool {
        self.is_transversal(&jet.gradient)
            || self.has_sign_of(jet.value, middle, radius)
            || self.is_beside(middle, radius)
    }

    /// `grad L . g > 0` for all `g` of the enclosure.
    fn is_transversal(&self, enclosure: &[Interval; 3]) -> bool {
        let (mut least, mut size) = (0.0, 0.0);
        for (g, slope) in self.gradient.iter().zip(enclosure) {
            least += (g * slope.lo).min(g * slope.hi);
            size += g.abs() * slope.lo.abs().max(slope.hi.abs());
        }
        // Unbounded or unknown slopes make the size infinite or NaN: no proof.
        least > ROUNDING * size && enclosure.iter().all(|i| i.lo.is_finite() && i.hi.is_finite())
    }

    /// `f` and `L` are both positive or both negative on what the box shares with T.
    fn has_sign_of(&self, value: Interval, middle: Vec3, radius: Vec3) -> bool {
        let center = self.value + self.gradient.dot(&(middle - self.corner));
        let rounding = ROUNDING * self.least.abs().max(self.most.abs());
        let spread = self.gradient.abs().dot(&radius) + rounding;
        // On T the interpolant also stays between the node values.
        (value.lo > 0.0 && (center - spread).max(self.least) > 0.0)
            || (value.hi < 0.0 && (center + spread).min(self.most) < 0.0)
    }

    /// The box does not meet the tetrahedron: a barycentric is negative on all of it.
    fn is_beside(&self, middle: Vec3, radius: Vec3) -> bool {
        let offset = middle - self.corner;
        let negative = |constant: f64, slope: Vec3| {
            constant + slope.dot(&offset) + slope.abs().dot(&radius) < -ROUNDING
        };
        let [b1, b2, b3] = self.barycentric;
        negative(1.0, -(b1 + b2 + b3)) || self.barycentric.iter().any(|&b| negative(0.0, b))
    }
}
