//! The interval test that proves the topology.
//!
//! For a tetrahedron T with the linear interpolant `L` of the node values, every box that covers
//! a part of T must satisfy one of
//!
//! 1. `f` and `L` have the same strict sign on the box, or
//! 2. `grad L . grad f > 0` wherever on the box they have not.
//!
//! Both follow from affine forms of f and its gradient (`transversal`), whose excess shrinks with the
//! square of the box; where they know nothing plain enclosures may still tell. A box that fails is
//! halved along the axis that adds most to the doubt, within a budget. What still fails is refined.
//! The crate's page proves what follows when all pass.

use crate::complex::{Complex, Tetrahedron};
use crate::interpolant::Interpolant;
use crate::transversal::BoxForms;
use isospline_geometry::Vec3;
use isospline_implicit::{Affine, AffineJet, Field, Interval, IntervalJet, Jet1};

/// Boxes that one cube may take. Expanded polynomials of high degree (the double torus, the chair)
/// need a few hundred where their gradient is small; more only delays refinement where it is due.
/// With 400 the chair has a third more tetrahedra to refine.
const MOST_BOXES: u32 = 800;
/// Halvings of a cube, over all axes, after which a box counts as failed.
const MOST_HALVINGS: u32 = 15;
/// Tetrahedra that turn from the gradient so far that their cosine is below this, at points of
/// their own piece, are refined without asking for a proof: it would take many boxes.
const HOPELESS_COSINE: f64 = 0.25;
/// Boxes that are looked at together at least, if there are as many: what the field encloses at
/// a time.
const LEAST_BATCH: usize = 64;
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

/// The tetrahedra, of those given, that fail the test, in their order, each with the place of its
/// cube.
///
/// Every cube is searched depth first, for one failing box settles a tetrahedron; but in all cubes
/// at the same time, because fields enclose many boxes much faster than one by one.
pub(crate) fn failing(
    field: &dyn Field,
    complex: &Complex,
    cubes: &[Cube],
) -> Vec<(usize, Tetrahedron)> {
    // One word holds the set of open tetrahedra; a cube has 24 of one kind at most.
    let shares = cubes
        .iter()
        .enumerate()
        .flat_map(|(k, cube)| cube.tetrahedra.chunks(64).map(move |t| (k, cube.domain, t)));
    let (owners, mut tests): (Vec<usize>, Vec<Test<'_>>) =
        shares.map(|(k, domain, t)| (k, Test::new(field, complex, domain, t))).unzip();
    let mut jets = Jets::default();
    loop {
        let batch = next_batch(&mut tests);
        if batch.is_empty() {
            break;
        }
        look(field, &mut tests, batch, &mut jets);
    }
    let failed_of = |(owner, test): (usize, &Test<'_>)| {
        let tetrahedra = test.tetrahedra.to_vec();
        members(test.failed).map(move |i| (owner, tetrahedra[i]))
    };
    owners.into_iter().zip(&tests).flat_map(failed_of).collect()
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
    /// How often the cube was halved.
    halvings: u32,
}

/// What the field answers about a batch; kept to spare allocations.
#[derive(Default)]
struct Jets {
    domains: Vec<[Interval; 3]>,
    forms: Vec<Option<AffineJet>>,
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
fn look(field: &dyn Field, tests: &mut [Test<'_>], mut batch: Vec<Entry>, jets: &mut Jets) {
    batch.retain_mut(|(i, part)| tests[*i].admits(part));
    jets.domains.clear();
    jets.domains.extend(batch.iter().map(|(_, part)| part.domain));
    jets.forms.clear();
    jets.forms.resize(batch.len(), None);
    field.gradient_forms(&jets.domains, &mut jets.forms);
    let mut unknown = Vec::new();
    for ((i, mut part), jet) in batch.into_iter().zip(&jets.forms).rev() {
        let forms = jet.as_ref().and_then(|jet| BoxForms::new(jet, part.middle, part.radius));
        let Some(forms) = forms else {
            unknown.push((i, part));
            continue;
        };
        let spreads = tests[i].look(&mut part, &forms);
        if part.open != 0 {
            let axis = part.loosest_axis(spreads);
            tests[i].halve(&part, axis);
        }
    }
    unknown.reverse();
    look_plainly(field, tests, unknown);
}

/// Looks at boxes over which forms know nothing, by plain enclosures: those of products with zero
/// are known whatever the other factor is.
fn look_plainly(field: &dyn Field, tests: &mut [Test<'_>], batch: Vec<Entry>) {
    if batch.is_empty() {
        return;
    }
    let domains: Vec<_> = batch.iter().map(|(_, part)| part.domain).collect();
    let mut jets = vec![None; domains.len()];
    field.gradient_enclosures(&domains, &mut jets);
    for ((i, mut part), jet) in batch.into_iter().zip(jets).rev() {
        let Some(IntervalJet { value, gradient }) = jet else {
            tests[i].failed |= part.open;
            continue;
        };
        part.keep(&tests[i], |l, part| {
            !l.is_transversal(&gradient) && !l.has_sign_of(value, part.middle, part.radius)
        });
        if part.open != 0 {
            let axis = part.loosest_axis(part.radius);
            tests[i].halve(&part, axis);
        }
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
        parts.push(Part::new(cube, open, 0));
        Self { tetrahedra, interpolants, failed, parts, boxes: MOST_BOXES }
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

    /// Passes what is proved; how much each axis adds to the doubt about the others.
    fn look(&self, part: &mut Part, forms: &BoxForms<'_>) -> Vec3 {
        let mut spreads = Vec3::zeros();
        part.keep(self, |l, _| {
            let doubt = forms.doubt(l);
            spreads += doubt.unwrap_or_else(Vec3::zeros);
            doubt.is_some()
        });
        spreads
    }

    /// Puts the halves of a box back, or takes it for failed.
    fn halve(&mut self, part: &Part, axis: usize) {
        if part.halvings >= MOST_HALVINGS {
            self.failed |= part.open;
            return;
        }
        let (mut lower, mut upper) = (part.domain, part.domain);
        lower[axis].hi = part.middle[axis];
        upper[axis].lo = part.middle[axis];
        let deeper = part.halvings + 1;
        self.parts.extend([upper, lower].map(|half| Part::new(half, part.open, deeper)));
    }
}

impl Part {
    fn new(domain: [Interval; 3], open: u64, halvings: u32) -> Self {
        let [x, y, z] = domain.map(Affine::middle_and_half);
        let (middle, radius) = (Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]));
        Self { domain, middle, radius, open, halvings }
    }

    /// The axis along which the doubt spreads most; the longest where that is not known. A hundredth
    /// keeps long axes in play, since the sign of f needs them too.
    fn loosest_axis(&self, spreads: Vec3) -> usize {
        let all = spreads.x + spreads.y + spreads.z;
        let share = 0.01 * all / self.radius.max();
        let score = if all.is_finite() { spreads + share * self.radius } else { self.radius };
        (0..3).max_by(|&a, &b| score[a].total_cmp(&score[b])).expect("invariant: three axes")
    }

    /// Leaves those open that `is_open`.
    fn keep(&mut self, test: &Test<'_>, mut is_open: impl FnMut(&Interpolant, &Self) -> bool) {
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
