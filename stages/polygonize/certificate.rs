//! The interval test that proves the topology.
//!
//! For a tetrahedron T with the linear interpolant `L` of the node values, every box that covers
//! a part of T must satisfy one of
//!
//! 1. `f` and `L` have the same strict sign on the box, by enclosures, or
//! 2. `grad L . grad f > 0` on the box, by the enclosure of `grad f` or, where f has one, by
//!    `grad f(m) + H (x - m)` with the enclosure H of its second derivatives: the excess of that
//!    form shrinks with the square of the box, so most cells pass whole.
//!
//! A box that fails both is halved along the axis that widens the enclosure most, within a budget;
//! H over a box also holds over its halves, which therefore need but a look at their middles. What
//! still fails is refined. The crate's page proves what follows when all pass.

use crate::complex::{Complex, Tetrahedron};
use crate::interpolant::{Bend, HESSIAN_ROWS, Interpolant};
use isospline_geometry::Vec3;
use isospline_implicit::{Field, HessianIntervals, Interval, IntervalJet, Jet1};

/// Boxes that one cube may take. Expanded polynomials of high degree (the double torus) need a few
/// hundred where their gradient is small; more only delays refinement where it is due.
const MOST_BOXES: u32 = 400;
/// Halvings of a cube, over all axes, after which a box counts as failed.
const MOST_HALVINGS: u32 = 15;
/// Tetrahedra that turn from the gradient so far that their cosine is below this, at points of
/// their own piece, are refined without asking for a proof: it would take many boxes.
const HOPELESS_COSINE: f64 = 0.25;
/// Boxes that are looked at together at least, if there are as many: what the field encloses at
/// a time.
const LEAST_BATCH: usize = 64;
/// Halvings after which a box gets second derivatives of its own. With 1 the decorative cube takes
/// a half more of them, with 3 a tenth more boxes.
const OLD: u32 = 2;
/// Room for boxes of a test: depth first search rarely needs more.
const USUAL_PARTS: usize = 16;

/// A cube and tetrahedra in it.
#[derive(Clone, Debug)]
pub(crate) struct Cube {
    /// It.
    pub(crate) domain: [Interval; 3],
    /// All lie in the cube.
    pub(crate) tetrahedra: Vec<Tetrahedron>,
}

/// The tetrahedra, of those given, that fail the test, in their order.
///
/// Every cube is searched depth first, for one failing box settles a tetrahedron; but in all cubes
/// at the same time, because fields enclose many boxes much faster than one by one.
pub(crate) fn failing(field: &dyn Field, complex: &Complex, cubes: &[Cube]) -> Vec<Tetrahedron> {
    // One word holds the set of open tetrahedra; a cube has 24 of one kind at most.
    let shares = cubes.iter().flat_map(|cube| cube.tetrahedra.chunks(64).map(move |t| (cube, t)));
    let mut tests: Vec<Test<'_>> = shares
        .map(|(cube, tetrahedra)| Test::new(field, complex, cube.domain, tetrahedra))
        .collect();
    loop {
        let batch = next_batch(&mut tests);
        if batch.is_empty() {
            break;
        }
        look(field, &mut tests, batch);
    }
    let failed_of = |test: &Test<'_>| {
        let tetrahedra = test.tetrahedra.to_vec();
        members(test.failed).map(move |i| tetrahedra[i])
    };
    tests.iter().flat_map(failed_of).collect()
}

/// The test of some tetrahedra of one cube.
struct Test<'a> {
    tetrahedra: &'a [Tetrahedron],
    interpolants: Vec<Interpolant>,
    /// Those found to fail.
    failed: u64,
    /// Boxes to look at, the next one last.
    parts: Vec<Part>,
    /// Boxes left.
    boxes: u32,
    /// What halving the whole cube along each axis takes from the width of the enclosure.
    gains: [f64; 3],
}

/// A box in a cube.
#[derive(Clone, Copy)]
struct Part {
    domain: [Interval; 3],
    middle: Vec3,
    /// Half its size; covers the rounding of the middle.
    radius: Vec3,
    /// The tetrahedra that have not passed on all of the box.
    open: u64,
    /// How often the cube was halved along each axis.
    halvings: [u32; 3],
    /// Second derivatives over this box or one around it, if they are known.
    bend: Option<Inherited>,
}

/// Enclosures of second derivatives, and how often the box that they hold over was halved since.
#[derive(Clone, Copy)]
struct Inherited {
    hessian: HessianIntervals,
    age: u32,
}

/// A part with its test.
type Entry = (usize, Part);

/// The next boxes of all tests: one of each, or some if few tests are left.
fn next_batch(tests: &mut [Test<'_>]) -> Vec<Entry> {
    let active = tests.iter().filter(|test| !test.parts.is_empty()).count();
    let each = LEAST_BATCH.div_ceil(active.max(1));
    let mut batch = Vec::with_capacity(active * each);
    for (i, test) in tests.iter_mut().enumerate() {
        let rest = test.parts.len().saturating_sub(each);
        batch.extend(test.parts.drain(rest..).rev().map(|part| (i, part)));
    }
    batch
}

/// Looks at boxes; what fails is halved and put back.
fn look(field: &dyn Field, tests: &mut [Test<'_>], mut batch: Vec<Entry>) {
    batch.retain_mut(|(i, part)| tests[*i].admits(part));
    let (bent, new): (Vec<_>, Vec<_>) = batch.into_iter().partition(|(_, p)| p.bend.is_some());
    look_along_slopes(field, tests, bent);
    look_at_new(field, tests, new);
}

/// Boxes over which no second derivatives are known: whole cubes, or all if the field has none.
fn look_at_new(field: &dyn Field, tests: &mut [Test<'_>], batch: Vec<Entry>) {
    let mut open = with_jets(field, tests, batch, |part| part.domain);
    keep_unproved(tests, &mut open, Part::look);
    let mut bent: Vec<Entry> = open.iter().map(|(entry, _)| *entry).collect();
    if renew(field, bent.iter_mut().map(|(_, part)| part).collect()) {
        return look_along_slopes(field, tests, bent);
    }
    look_closer(field, tests, &mut open);
    measure_gains(field, tests, &open);
    for ((i, part), _) in open.iter().rev() {
        let axis = tests[*i].best_axis(part);
        tests[*i].halve(part, axis);
    }
}

/// Passes those that the forms of second order prove, first by the second derivatives over the
/// boxes that they were halved from, which cost nothing: the form needs but the middle.
fn look_along_slopes(field: &dyn Field, tests: &mut [Test<'_>], batch: Vec<Entry>) {
    let middle = |part: &Part| [0, 1, 2].map(|axis| Interval::point(part.middle[axis]));
    let mut open = with_jets(field, tests, batch, middle);
    keep_unproved(tests, &mut open, Part::look_along);
    look_at_old(field, tests, &mut open);
    for ((i, part), middle) in open.iter().rev() {
        let axis = tests[*i].loosest_axis(part, middle);
        tests[*i].halve(part, axis);
    }
}

/// Looks anew at boxes whose second derivatives are too old, by their own.
fn look_at_old(field: &dyn Field, tests: &mut [Test<'_>], open: &mut Vec<(Entry, IntervalJet)>) {
    let is_old = |part: &Part| part.bend.is_some_and(|bend| bend.age >= OLD);
    let (old, young) = std::mem::take(open).into_iter().partition(|((_, part), _)| is_old(part));
    let (entries, middles): (Vec<Entry>, Vec<IntervalJet>) = Vec::into_iter(old).unzip();
    // Plain enclosures too: where second derivatives vary much they are better.
    let mut old = with_jets(field, tests, entries, |part| part.domain);
    for (((i, part), jet), middle) in old.iter_mut().zip(middles) {
        part.look(&tests[*i], jet);
        *jet = middle;
    }
    old.retain(|((_, part), _)| part.open != 0);
    renew(field, old.iter_mut().map(|((_, part), _)| part).collect());
    keep_unproved(tests, &mut old, Part::look_along);
    *open = young;
    open.extend(old);
}

/// Boxes with what the field encloses over parts of them; those where it answers nothing fail.
fn with_jets(
    field: &dyn Field,
    tests: &mut [Test<'_>],
    batch: Vec<Entry>,
    domain: impl Fn(&Part) -> [Interval; 3],
) -> Vec<(Entry, IntervalJet)> {
    let domains: Vec<_> = batch.iter().map(|(_, part)| domain(part)).collect();
    let mut jets = vec![None; domains.len()];
    field.gradient_enclosures(&domains, &mut jets);
    let mut known = Vec::with_capacity(batch.len());
    for ((i, part), jet) in batch.into_iter().zip(jets) {
        match jet {
            Some(jet) => known.push(((i, part), jet)),
            None => tests[i].failed |= part.open,
        }
    }
    known
}

/// Gives boxes their own second derivatives; false if the field has none.
fn renew(field: &dyn Field, parts: Vec<&mut Part>) -> bool {
    let domains: Vec<_> = parts.iter().map(|part| part.domain).collect();
    let mut hessians = vec![None; domains.len()];
    field.hessian_enclosures(&domains, &mut hessians);
    let has_all = hessians.iter().all(Option::is_some);
    for (part, hessian) in parts.into_iter().zip(hessians) {
        part.bend = hessian.map(|hessian| Inherited { hessian, age: 0 });
    }
    has_all
}

/// Looks at boxes and drops those on which all tetrahedra pass.
fn keep_unproved(
    tests: &[Test<'_>],
    open: &mut Vec<(Entry, IntervalJet)>,
    look: impl Fn(&mut Part, &Test<'_>, &IntervalJet),
) {
    open.retain_mut(|((i, part), jet)| {
        look(part, &tests[*i], jet);
        part.open != 0
    });
}

/// `f(m) + grad f(m) . d + d . H d / 2` for `|d| <= r` by components, if bounded.
fn taylor_form(middle: &IntervalJet, hessian: &HessianIntervals, r: &Vec3) -> Interval {
    let size = |i: &Interval| i.lo.abs().max(i.hi.abs());
    let sizes = hessian.each_ref().map(size);
    let curved = |k: usize| (0..3).map(|j| sizes[HESSIAN_ROWS[k][j]] * r[j]).sum::<f64>();
    let spread: f64 = (0..3).map(|k| r[k] * (size(&middle.gradient[k]) + 0.5 * curved(k))).sum();
    let spread = spread * (1.0 + 1e-12);
    let value = middle.value;
    let form = Interval::new((value.lo - spread).next_down(), (value.hi + spread).next_up());
    if form.lo.is_finite() && form.hi.is_finite() { form } else { Interval::ENTIRE }
}

/// Passes those whose sign the mean value form tells.
fn look_closer(field: &dyn Field, tests: &[Test<'_>], open: &mut Vec<(Entry, IntervalJet)>) {
    // Near the surface the interpolants change sign themselves: no form of f would help.
    let may_help = |&((i, part), _): &(Entry, IntervalJet)| {
        members(part.open).any(|l| tests[i].interpolants[l].has_sign(part.middle, part.radius))
    };
    let places: Vec<usize> = (0..open.len()).filter(|&k| may_help(&open[k])).collect();
    let middle = |&k: &usize| [0, 1, 2].map(|axis| Interval::point(open[k].0.1.middle[axis]));
    let middles: Vec<_> = places.iter().map(middle).collect();
    let mut values = vec![None; middles.len()];
    field.value_enclosures(&middles, &mut values);
    for (k, value) in places.into_iter().zip(values) {
        let ((i, part), jet) = &mut open[k];
        let value = value.map_or(jet.value, |at_middle| mean_value_form(at_middle, jet, part));
        part.keep(&tests[*i], |l, part| !l.has_sign_of(value, part.middle, part.radius));
    }
    open.retain(|((_, part), _)| part.open != 0);
}

/// `f(m) + grad f . (x - m)`: its excess shrinks with the square of the box.
fn mean_value_form(at_middle: Interval, jet: &IntervalJet, part: &Part) -> Interval {
    let spread = spread(&jet.gradient, &part.radius) * (1.0 + 1e-12);
    let form =
        Interval::new((at_middle.lo - spread).next_down(), (at_middle.hi + spread).next_up());
    if form.lo.is_finite() && form.hi.is_finite() { form } else { jet.value }
}

/// Of whole cubes: how much narrower `grad L . grad f` gets where an axis shrinks to its middle.
fn measure_gains(field: &dyn Field, tests: &mut [Test<'_>], open: &[(Entry, IntervalJet)]) {
    let whole: Vec<_> = open.iter().filter(|((_, part), _)| part.halvings == [0; 3]).collect();
    let thin = |((_, part), _): &&(Entry, IntervalJet)| {
        [0, 1, 2].map(|axis| {
            let mut thin = part.domain;
            thin[axis] = Interval::point(part.middle[axis]);
            thin
        })
    };
    let domains: Vec<_> = whole.iter().flat_map(thin).collect();
    let mut jets = vec![None; domains.len()];
    field.gradient_enclosures(&domains, &mut jets);
    for (((i, part), jet), thin) in whole.into_iter().zip(jets.as_chunks::<3>().0) {
        let test = &mut tests[*i];
        let weights: Vec3 = members(part.open).map(|l| test.interpolants[l].gradient.abs()).sum();
        let width =
            |jet: &IntervalJet| (0..3).map(|k| weights[k] * jet.gradient[k].width()).sum::<f64>();
        let widest = width(jet);
        test.gains = thin.map(|jet| {
            let gain = jet.map_or(0.0, |jet| widest - width(&jet));
            // Where slopes are unbounded all axes count alike; a thousandth keeps every axis in
            // play, since the sign of f needs them too.
            if gain.is_finite() { gain.max(1e-3 * widest) } else { 1.0 }
        });
    }
}

impl<'a> Test<'a> {
    fn new(
        field: &dyn Field,
        complex: &Complex,
        cube: [Interval; 3],
        tetrahedra: &'a [Tetrahedron],
    ) -> Self {
        let interpolants: Vec<_> = tetrahedra.iter().map(|t| Interpolant::of(complex, t)).collect();
        let failed = hopeless(field, &interpolants);
        let open = set(0..interpolants.len()) & !failed;
        let mut parts = Vec::with_capacity(USUAL_PARTS);
        parts.push(Part::new(cube, open, [0; 3], None));
        Self { tetrahedra, interpolants, failed, parts, boxes: MOST_BOXES, gains: [0.0; 3] }
    }

    /// Whether a box needs a look. If none is left, what is open there fails.
    fn admits(&mut self, part: &mut Part) -> bool {
        part.open &= !self.failed;
        part.keep(self, |l, part| !l.is_beside(part.middle, part.radius));
        if self.boxes == 0 {
            self.failed |= part.open;
        }
        if part.open == 0 || self.boxes == 0 {
            return false;
        }
        self.boxes -= 1;
        true
    }

    /// The axis whose halving takes most from the width of the enclosure of the gradient.
    fn best_axis(&self, part: &Part) -> usize {
        let gain = |k: usize| self.gains[k] / (1_u64 << part.halvings[k]) as f64;
        let axis = (0..3).max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
        axis.expect("invariant: three axes")
    }

    /// The axis along which the slopes of `grad L . grad f` spread most over the box; the longest
    /// where that is not known. A hundredth keeps long axes in play, since the sign of f needs them
    /// too.
    fn loosest_axis(&self, part: &Part, middle: &IntervalJet) -> usize {
        let bend = part.bend(middle);
        let spreads = |bend| members(part.open).map(|l| self.interpolants[l].spreads(&bend)).sum();
        let spreads: Vec3 = bend.map_or_else(Vec3::zeros, spreads);
        let all = spreads.x + spreads.y + spreads.z;
        let share = 0.01 * all / part.radius.max();
        let score = if all.is_finite() { spreads + share * part.radius } else { part.radius };
        (0..3).max_by(|&a, &b| score[a].total_cmp(&score[b])).expect("invariant: three axes")
    }

    /// Puts the halves of a box back, or takes it for failed.
    fn halve(&mut self, part: &Part, axis: usize) {
        if part.halvings.iter().sum::<u32>() >= MOST_HALVINGS {
            self.failed |= part.open;
            return;
        }
        let mut deeper = part.halvings;
        deeper[axis] += 1;
        let (mut lower, mut upper) = (part.domain, part.domain);
        lower[axis].hi = part.middle[axis];
        upper[axis].lo = part.middle[axis];
        let bend = part.bend.map(|bend| Inherited { age: bend.age + 1, ..bend });
        self.parts.extend([upper, lower].map(|half| Part::new(half, part.open, deeper, bend)));
    }
}

impl Part {
    fn new(domain: [Interval; 3], open: u64, halvings: [u32; 3], bend: Option<Inherited>) -> Self {
        let middle = domain.map(|i| f64::midpoint(i.lo, i.hi));
        let radius = [0, 1, 2].map(|k| (domain[k].hi - middle[k]).max(middle[k] - domain[k].lo));
        Self { domain, middle: middle.into(), radius: radius.into(), open, halvings, bend }
    }

    fn bend(&self, middle: &IntervalJet) -> Option<Bend> {
        self.bend.map(|bend| Bend::new(&middle.gradient, &bend.hessian, &self.radius))
    }

    /// Passes what enclosures over the box prove.
    fn look(&mut self, test: &Test<'_>, jet: &IntervalJet) {
        self.keep(test, |l, part| {
            !l.is_transversal(&jet.gradient) && !l.has_sign_of(jet.value, part.middle, part.radius)
        });
    }

    /// Passes what enclosures in the middle and the second derivatives prove.
    fn look_along(&mut self, test: &Test<'_>, middle: &IntervalJet) {
        let Some((inherited, bend)) = self.bend.zip(self.bend(middle)) else { return };
        let value = taylor_form(middle, &inherited.hessian, &self.radius);
        self.keep(test, |l, part| {
            !l.has_sign_of(value, part.middle, part.radius) && !l.is_transversal_along(&bend)
        });
    }

    /// Leaves those open that `is_open`.
    fn keep(&mut self, test: &Test<'_>, is_open: impl Fn(&Interpolant, &Self) -> bool) {
        self.open = set(members(self.open).filter(|&l| is_open(&test.interpolants[l], self)));
    }
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
    let mut rest = set;
    std::iter::from_fn(move || {
        let first = rest.trailing_zeros() as usize;
        // Takes the lowest bit away.
        rest &= rest.wrapping_sub(1);
        (first < 64).then_some(first)
    })
}

/// Largest value of `g . d` over `g` in an enclosure and `|d| <= radius` by components.
pub(crate) fn spread(enclosure: &[Interval; 3], radius: &Vec3) -> f64 {
    (0..3).map(|k| enclosure[k].lo.abs().max(enclosure[k].hi.abs()) * radius[k]).sum()
}
