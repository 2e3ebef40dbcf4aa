//! The interval test that proves the topology.
//!
//! For a tetrahedron T with the linear interpolant `L` of the node values, every box that covers
//! a part of T must satisfy one of
//!
//! 1. `f` and `L` have the same strict sign on the box, by enclosures, or
//! 2. `grad L . grad f > 0` on the box, by the enclosure of `grad f`.
//!
//! A box that fails both is halved along the axis that widens the enclosure most, within a budget;
//! what still fails is refined. The crate's page proves what follows when all pass.

use crate::complex::{Complex, Tetrahedron};
use crate::interpolant::Interpolant;
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Interval, IntervalJet, Jet1};

/// Boxes that one cube may take. Expanded polynomials of high degree (the double torus) need a few
/// hundred where their gradient is small; more only delays refinement where it is due.
const MOST_BOXES: u32 = 400;
/// Halvings of a cube, over all axes, after which a box counts as failed.
const MOST_HALVINGS: u32 = 15;
/// Tetrahedra that turn from the gradient so far that their cosine is below this, at points of
/// their own piece, are refined without asking for a proof: it would take many boxes.
const HOPELESS_COSINE: f64 = 0.25;

/// The tetrahedra, of those given, that fail the test; all lie in the box `cube`.
pub(crate) fn failing(
    field: &dyn Field,
    complex: &Complex,
    tetrahedra: &[Tetrahedron],
    cube: [Interval; 3],
) -> Vec<Tetrahedron> {
    // One word holds the set of open tetrahedra; a cube has 24 of one kind at most.
    tetrahedra.chunks(64).flat_map(|some| failing_of_few(field, complex, some, cube)).collect()
}

fn failing_of_few(
    field: &dyn Field,
    complex: &Complex,
    tetrahedra: &[Tetrahedron],
    cube: [Interval; 3],
) -> Vec<Tetrahedron> {
    let interpolants: Vec<_> = tetrahedra.iter().map(|t| Interpolant::of(complex, t)).collect();
    let mut failed = hopeless(field, &interpolants);
    let open = set(0..interpolants.len()) & !failed;
    let mut test = Test { field, interpolants: &interpolants, boxes: MOST_BOXES, gains: [0.0; 3] };
    failed |= test.failing_on(cube, open, [0; 3]);
    members(failed).map(|i| tetrahedra[i]).collect()
}

/// Those whose own piece is seen to turn too far from the gradient.
fn hopeless(field: &dyn Field, interpolants: &[Interpolant]) -> u64 {
    let (mut points, mut owners) = (Vec::new(), Vec::new());
    for (i, interpolant) in interpolants.iter().enumerate() {
        points.extend(interpolant.crossings());
        owners.resize(points.len(), i);
    }
    let mut jets = vec![Jet1 { value: 0.0, gradient: Vec3::zeros() }; points.len()];
    field.gradients(&points, &mut jets);
    set(owners.iter().zip(&jets).filter_map(|(&i, jet)| {
        let (l, f) = (interpolants[i].gradient, jet.gradient);
        (l.dot(&f) < HOPELESS_COSINE * l.norm() * f.norm()).then_some(i)
    }))
}

fn set(members: impl IntoIterator<Item = usize>) -> u64 {
    members.into_iter().fold(0, |set, i| set | 1 << i)
}

fn members(set: u64) -> impl Iterator<Item = usize> {
    (0..64).filter(move |i| set >> i & 1 == 1)
}

/// The middle and half the size of a box; the half covers rounding of the middle.
fn middle_and_radius(domain: &[Interval; 3]) -> (Vec3, Vec3) {
    let middle = domain.map(|i| f64::midpoint(i.lo, i.hi));
    let radius = [0, 1, 2].map(|k| (domain[k].hi - middle[k]).max(middle[k] - domain[k].lo));
    (middle.into(), radius.into())
}

struct Test<'a> {
    field: &'a dyn Field,
    interpolants: &'a [Interpolant],
    /// Boxes left.
    boxes: u32,
    /// What halving the whole cube along each axis takes from the width of the enclosure.
    gains: [f64; 3],
}

impl Test<'_> {
    /// The members of the set `open` that fail on a box made by so many halvings along each axis.
    fn failing_on(&mut self, domain: [Interval; 3], open: u64, halvings: [u32; 3]) -> u64 {
        let (middle, radius) = middle_and_radius(&domain);
        let pick = |open: u64, keep: &dyn Fn(&Interpolant) -> bool| {
            set(members(open).filter(|&i| keep(&self.interpolants[i])))
        };
        let open = pick(open, &|i| !i.is_beside(middle, radius));
        if open == 0 || self.boxes == 0 {
            return open;
        }
        self.boxes -= 1;
        let Some(jet) = self.field.gradient_enclosure(domain) else { return open };
        let open = pick(open, &|i| {
            !i.is_transversal(&jet.gradient) && !i.has_sign_of(jet.value, middle, radius)
        });
        if open == 0 {
            return 0;
        }
        let mut open = open;
        // Near the surface the interpolants change sign themselves: no form of f would help.
        if members(open).any(|i| self.interpolants[i].has_sign(middle, radius)) {
            let value = self.mean_value_form(&jet, middle, radius);
            open = pick(open, &|i| !i.has_sign_of(value, middle, radius));
        }
        if open == 0 || halvings.iter().sum::<u32>() >= MOST_HALVINGS {
            return open;
        }
        if halvings == [0; 3] {
            self.gains = self.gains_of(&domain, &jet, open);
        }
        self.failing_on_halves(domain, open, halvings)
    }

    fn failing_on_halves(&mut self, domain: [Interval; 3], open: u64, halvings: [u32; 3]) -> u64 {
        let gain = |k: usize| self.gains[k] / (1_u64 << halvings[k]) as f64;
        let axis = (0..3).max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
        let axis = axis.expect("invariant: three axes");
        let mut deeper = halvings;
        deeper[axis] += 1;
        let middle = f64::midpoint(domain[axis].lo, domain[axis].hi);
        let (mut lower, mut upper) = (domain, domain);
        lower[axis].hi = middle;
        upper[axis].lo = middle;
        let failed = self.failing_on(lower, open, deeper);
        // One failing box settles a tetrahedron: no need to look at its other boxes.
        if open == failed { open } else { failed | self.failing_on(upper, open & !failed, deeper) }
    }

    /// `f(m) + grad f . (x - m)`: its excess shrinks with the square of the box.
    fn mean_value_form(&self, jet: &IntervalJet, middle: Vec3, radius: Vec3) -> Interval {
        let at_middle = [0, 1, 2].map(|k| Interval::new(middle[k], middle[k]));
        let Some(f) = self.field.value_enclosure(at_middle) else { return jet.value };
        let spread = spread(&jet.gradient, &radius) * (1.0 + 1e-12);
        let form = Interval::new((f.lo - spread).next_down(), (f.hi + spread).next_up());
        if form.lo.is_finite() && form.hi.is_finite() { form } else { jet.value }
    }

    /// How much narrower `grad L . grad f` gets where an axis shrinks to its middle.
    fn gains_of(&self, domain: &[Interval; 3], jet: &IntervalJet, open: u64) -> [f64; 3] {
        let weights = members(open).map(|i| self.interpolants[i].gradient.abs());
        let weights: Vec3 = weights.sum();
        let width = |jet: &IntervalJet| {
            (0..3).map(|k| weights[k] * (jet.gradient[k].hi - jet.gradient[k].lo)).sum::<f64>()
        };
        let whole = width(jet);
        [0, 1, 2].map(|axis| {
            let mut thin = *domain;
            let middle = f64::midpoint(thin[axis].lo, thin[axis].hi);
            thin[axis] = Interval::new(middle, middle);
            let gain = self.field.gradient_enclosure(thin).map_or(0.0, |jet| whole - width(&jet));
            // Where slopes are unbounded all axes count alike; a thousandth keeps every axis in
            // play, since the sign of f needs them too.
            if gain.is_finite() { gain.max(1e-3 * whole) } else { 1.0 }
        })
    }
}

/// Largest value of `g . d` over `g` in an enclosure and `|d| <= radius` by components.
pub(crate) fn spread(enclosure: &[Interval; 3], radius: &Vec3) -> f64 {
    (0..3).map(|k| enclosure[k].lo.abs().max(enclosure[k].hi.abs()) * radius[k]).sum()
}
