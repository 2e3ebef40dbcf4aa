//! Projection onto the surface by Newton steps along the gradient [TK, Eq. (4)].
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::lanes::{Lanes, Mask, N, Vectors};
use isospline_geometry::Vec3;
use isospline_implicit::{BLOCK, Field, Kernel, run_widest};

/// Relative residual below which a point counts as on the surface (times the diagonal).
const REACHED_REL: f64 = 1e-9;
/// Steps before giving up; good starts need 2 or 3.
const MAX_STEPS: f64 = 60.0;
/// Longest step, as a fraction of the diagonal.
const STEP_CAP_REL: f64 = 0.1;

/// What became of a projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Points that did not come within 1e-9 of the diagonal.
    pub failed: usize,
    /// Gradient evaluations, over all points.
    pub evaluations: usize,
}

/// Moves every point onto the zero set of `field`.
///
/// Steps `-f grad f / |grad f|^2`, halved while they do not lower `|f| / |grad f|`. The step from
/// the first place that is within 1e-9 of the diagonal is the last and is not looked at: Newton
/// squares the residual, which leaves rounding, where residuals only flicker. Stopping at the
/// paper's 1e-6 would pollute every later stage, and a fixed 1e-15 is not reachable where f has
/// large terms. `diagonal` is that of the model's bounding box. Points that fail (counted) stay at
/// their best place.
pub fn project_all(field: &dyn Field, diagonal: f64, points: &mut [Vec3]) -> Figures {
    let mut figures = Figures::default();
    let mut walkers = Walkers::new();
    let mut waiting = 0..points.len();
    for index in waiting.by_ref().take(BLOCK) {
        walkers.push(index, points[index]);
    }
    let reached = REACHED_REL * diagonal;
    let mut jets = [[0.0; BLOCK]; 4];
    while walkers.n > 0 {
        let n = walkers.n;
        field.gradient_block(n, &walkers.trial, &mut jets);
        figures.evaluations += n;
        let ended = run_widest(Judge { walkers: &mut walkers, jets: &jets, diagonal });
        // From the last one on: what takes the place of another has been dealt with.
        for block in (0..n.div_ceil(N)).rev().filter(|&block| ended[block].any()) {
            for slot in (N * block..n.min(N * (block + 1))).rev() {
                if !ended[block].0[slot % N] {
                    continue;
                }
                let has_reached = walkers.residual[slot] <= reached;
                let end = if has_reached { &walkers.trial } else { &walkers.best };
                points[walkers.index[slot]] = place(end, slot);
                figures.failed += usize::from(!has_reached);
                match waiting.next() {
                    Some(index) => walkers.start(slot, index, points[index]),
                    None => walkers.remove(slot),
                }
            }
        }
    }
    figures
}

/// Coordinates, x of all, then y and z.
type Places = [[f64; BLOCK]; 3];

fn place([x, y, z]: &Places, slot: usize) -> Vec3 {
    Vec3::new(x[slot], y[slot], z[slot])
}

fn put(places: &mut Places, slot: usize, place: Vec3) {
    for (axis, x) in places.iter_mut().zip([place.x, place.y, place.z]) {
        axis[slot] = x;
    }
}

/// Points on their way at the same time, in the first `n` slots.
struct Walkers {
    n: usize,
    index: [usize; BLOCK],
    best: Places,
    residual: [f64; BLOCK],
    step: Places,
    steps: [f64; BLOCK],
    trial: Places,
}

impl Walkers {
    fn new() -> Self {
        let (zero, places) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
        let (best, step, trial) = (places, places, places);
        Self { n: 0, index: [0; BLOCK], best, residual: zero, step, steps: zero, trial }
    }

    fn push(&mut self, index: usize, start: Vec3) {
        self.n += 1;
        self.start(self.n - 1, index, start);
    }

    fn start(&mut self, slot: usize, index: usize, start: Vec3) {
        self.index[slot] = index;
        put(&mut self.trial, slot, start);
        put(&mut self.best, slot, start);
        put(&mut self.step, slot, Vec3::zeros());
        self.residual[slot] = f64::INFINITY;
        self.steps[slot] = 0.0;
    }

    /// Empties a slot: the last walker goes on there.
    fn remove(&mut self, slot: usize) {
        self.n -= 1;
        self.index[slot] = self.index[self.n];
        self.residual[slot] = self.residual[self.n];
        self.steps[slot] = self.steps[self.n];
        for places in [&mut self.trial, &mut self.best, &mut self.step] {
            let last = place(places, self.n);
            put(places, slot, last);
        }
    }
}

/// Takes the field at the trial points in, and says whose walk ends.
struct Judge<'a> {
    walkers: &'a mut Walkers,
    /// Values, then slopes.
    jets: &'a [[f64; BLOCK]; 4],
    diagonal: f64,
}

impl Kernel for Judge<'_> {
    type Output = [Mask; BLOCK / N];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { walkers, jets: [values, slopes @ ..], diagonal } = self;
        let (reached, cap) = (REACHED_REL * diagonal, STEP_CAP_REL * diagonal);
        let mut ended = [Mask([false; N]); BLOCK / N];
        // Lanes beyond the last walker hold any numbers.
        for b in 0..walkers.n.div_ceil(N) {
            let value = lanes(values, b);
            let gradient = vectors(slopes, b);
            let slope_sq = gradient.dot(gradient);
            let residual = value.map(f64::abs) / slope_sq.map(f64::sqrt);
            let old = lanes(&walkers.residual, b);
            let is_better = residual.is(old, |new, old| new < old);
            let best =
                is_better.pick_vectors(vectors(&walkers.trial, b), vectors(&walkers.best, b));
            let least = is_better.pick(residual, old);
            let newton = gradient.times(value.map(|value| -value) / slope_sq);
            let factor = residual.map(|r| if r > cap { cap / r } else { 1.0 });
            let half = vectors(&walkers.step, b).times(Lanes::all(0.5));
            let step = is_better.pick_vectors(newton.times(factor), half);
            let steps = lanes(&walkers.steps, b).map(|n| n + 1.0);
            ended[b] = least.is(steps, |r, n| r <= reached || n >= MAX_STEPS);
            store(&mut walkers.best, b, best);
            store(&mut walkers.step, b, step);
            store(&mut walkers.trial, b, best + step);
            walkers.residual.as_chunks_mut().0[b] = least.0;
            walkers.steps.as_chunks_mut().0[b] = steps.0;
        }
        ended
    }
}

#[inline(always)]
fn lanes(numbers: &[f64; BLOCK], block: usize) -> Lanes {
    Lanes(numbers.as_chunks().0[block])
}

#[inline(always)]
fn vectors([x, y, z]: &Places, block: usize) -> Vectors {
    Vectors([lanes(x, block), lanes(y, block), lanes(z, block)])
}

#[inline(always)]
fn store(places: &mut Places, block: usize, vectors: Vectors) {
    for (axis, lanes) in places.iter_mut().zip(vectors.0) {
        axis.as_chunks_mut().0[block] = lanes.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_implicit::ClosureField;

    fn torus() -> ClosureField {
        let value = |p: Vec3| {
            let r = (p.x * p.x + p.y * p.y).sqrt() - 5.0;
            r * r + p.z * p.z - 1.0
        };
        let gradient = |p: Vec3| {
            let radius = (p.x * p.x + p.y * p.y).sqrt();
            let k = 2.0 * (radius - 5.0) / radius;
            Vec3::new(k * p.x, k * p.y, 2.0 * p.z)
        };
        ClosureField::new(12.0, value).with_gradient(gradient)
    }

    #[test]
    fn points_near_a_torus_reach_it_to_rounding() {
        let field = torus();
        let mut points: Vec<Vec3> = (0..100)
            .map(|i| {
                let (a, b) = (0.37 * f64::from(i), 1.1 * f64::from(i));
                let r = 5.0 + 1.3 * b.cos();
                Vec3::new(r * a.cos(), r * a.sin(), 0.8 * b.sin())
            })
            .collect();
        let figures = project_all(&field, 17.0, &mut points);
        assert_eq!(figures.failed, 0);
        assert!(figures.evaluations < 800, "{figures:?}");
        for p in points {
            assert!(field.value(p).abs() < 5e-15, "{p}");
        }
    }

    #[test]
    fn a_point_where_the_gradient_vanishes_fails_and_is_counted() {
        let field = ClosureField::new(1.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p: Vec3| 2.0 * p);
        let mut points = [Vec3::zeros(), Vec3::new(0.9, 0.0, 0.0)];
        let figures = project_all(&field, 2.0, &mut points);
        assert_eq!(figures.failed, 1);
        assert!((points[1].norm() - 1.0).abs() < 1e-15);
    }
}
