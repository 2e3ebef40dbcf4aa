//! Where edges cross the surface: bracketed roots, once an edge.

use crate::bulk;
use crate::complex::Complex;
use isospline_geometry::Vec3;
use isospline_stage::Ctx;

/// Width of the last bracket, of the edge.
const ACCURACY: f64 = 1e-12;
/// Bisections that would reach [`ACCURACY`], and the one more that ITP may spend.
const MOST_STEPS: u32 = 41;

/// A root of f along an edge, within `lo .. hi` as parameters from the inside node.
#[derive(Clone, Copy, Debug)]
struct Bracket {
    from: Vec3,
    along: Vec3,
    lo: f64,
    hi: f64,
    f_lo: f64,
    f_hi: f64,
}

/// Positions of the crossings, to 1e-12 of the edge: a point where f changes sign.
pub(crate) fn positions(ctx: &Ctx<'_>, complex: &Complex, crossings: &[[u32; 2]]) -> Vec<Vec3> {
    bulk::shares(ctx.host, crossings, |share| {
        let mut brackets: Vec<_> = share.iter().map(|&e| Bracket::of(complex, e)).collect();
        narrow(ctx, &mut brackets);
        brackets.iter().map(Bracket::point).collect()
    })
}

/// Positions where the linear interpolant vanishes: for counting and comparing, not for output.
pub(crate) fn linear_positions(complex: &Complex, crossings: &[[u32; 2]]) -> Vec<Vec3> {
    let point = |&e: &[u32; 2]| {
        let bracket = Bracket::of(complex, e);
        let s = bracket.f_lo / (bracket.f_lo - bracket.f_hi);
        bracket.from + if s.is_finite() { s } else { 0.5 } * bracket.along
    };
    crossings.iter().map(point).collect()
}

fn narrow(ctx: &Ctx<'_>, brackets: &mut [Bracket]) {
    let mut open: Vec<u32> = (0..brackets.len() as u32).collect();
    let (mut points, mut places) = (Vec::new(), Vec::new());
    for step in 0..=MOST_STEPS {
        open.retain(|&i| brackets[i as usize].is_open());
        if open.is_empty() {
            return;
        }
        points.clear();
        places.clear();
        for &i in &open {
            let bracket = &brackets[i as usize];
            places.push(bracket.next_place(step));
            points.push(bracket.from + places[places.len() - 1] * bracket.along);
        }
        let values = bulk::values(ctx.field, &points);
        for ((&i, &place), &f) in open.iter().zip(&places).zip(&values) {
            brackets[i as usize].take(place, f);
        }
    }
}

impl Bracket {
    fn of(complex: &Complex, [inside, outside]: [u32; 2]) -> Self {
        let from = complex.point(inside);
        let along = complex.point(outside) - from;
        let (f_lo, f_hi) = (complex.value(inside), complex.value(outside));
        Self { from, along, lo: 0.0, hi: 1.0, f_lo, f_hi }
    }

    fn is_open(&self) -> bool {
        // An exact zero needs no narrowing; nodes with value zero count as outside.
        self.hi - self.lo > ACCURACY && self.f_hi != 0.0
    }

    /// The next place to look: interpolate, truncate, project [ITP, Algorithm 1], with
    /// `kappa_1 = 0.2`, `kappa_2 = 2`, `n_0 = 1`; at most one step more than bisection.
    fn next_place(&self, step: u32) -> f64 {
        // symbols: d truncation, r radius that keeps the step count, x_f regula falsi
        let half = f64::midpoint(self.lo, self.hi);
        let width = self.hi - self.lo;
        let r = 0.5 * ACCURACY * (1_u64 << (MOST_STEPS - step)) as f64 - 0.5 * width;
        let d = 0.2 * width * width;
        let x_f = (self.f_hi * self.lo - self.f_lo * self.hi) / (self.f_hi - self.f_lo);
        if !x_f.is_finite() {
            return half;
        }
        let towards = if half >= x_f { 1.0 } else { -1.0 };
        let x_t = if d <= (half - x_f).abs() { x_f + towards * d } else { half };
        if (x_t - half).abs() <= r { x_t } else { half - towards * r.max(0.0) }
    }

    /// Narrows to the side that still changes sign; NaN counts as outside, as at nodes it is
    /// refused before.
    fn take(&mut self, place: f64, f: f64) {
        if f < 0.0 {
            (self.lo, self.f_lo) = (place, f);
        } else {
            (self.hi, self.f_hi) = (place, f);
        }
    }

    fn point(&self) -> Vec3 {
        // The end whose value is smaller; both lie within the accuracy.
        let place = if self.f_lo.abs() < self.f_hi.abs() { self.lo } else { self.hi };
        self.from + place * self.along
    }
}
