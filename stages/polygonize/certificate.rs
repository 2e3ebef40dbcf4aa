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
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::complex::{Complex, Tetrahedron};
use crate::hopeless::hopeless;
use crate::interpolant::{Frame, LANES, Octet};
use crate::transversal::BoxForms;
use isospline_geometry::Vec3;
use isospline_implicit::{Affine, AffineJet, Field, Interval, IntervalJet, Kernel, run_widest};

/// Boxes that one cube may take. Expanded polynomials of high degree (the double torus, the chair)
/// need a few hundred where their gradient is small; more only delays refinement where it is due.
/// With 400 the chair has a third more tetrahedra to refine.
const MOST_BOXES: u32 = 800;
/// Halvings of a cube, over all axes, after which a box counts as failed.
const MOST_HALVINGS: u32 = 15;
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
    let mut search = Search::new(field, complex, cubes);
    while !search.batch.is_empty() {
        search.look();
        search.take_batch();
    }
    let failed_of = |test: &Test<'_>| {
        let (cube, tetrahedra) = (test.cube, test.tetrahedra.to_vec());
        members(test.failed).map(move |i| (cube, tetrahedra[i]))
    };
    search.tests.iter().flat_map(failed_of).collect()
}

/// The tests of all cubes, and the boxes that are looked at next.
struct Search<'a> {
    field: &'a dyn Field,
    tests: Vec<Test<'a>>,
    /// Of the tetrahedra of all tests; those of each begin with an octet of their own.
    octets: Vec<Octet>,
    batch: Vec<Entry>,
    domains: Vec<[Interval; 3]>,
    forms: Vec<Option<AffineJet>>,
}

/// The test of some tetrahedra of one cube.
struct Test<'a> {
    /// Place of the cube.
    cube: usize,
    tetrahedra: &'a [Tetrahedron],
    first_octet: usize,
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
    /// Half its size covers the rounding of the middle.
    frame: Frame,
    /// The tetrahedra that have not passed on all of the box.
    open: u64,
    /// How often the cube was halved.
    halvings: u32,
}

/// A box with its test.
struct Entry {
    test: usize,
    part: Part,
    /// How much each axis adds to the doubt about the tetrahedra that are open; `None` where forms
    /// know nothing.
    spreads: Option<Vec3>,
}

impl Entry {
    fn new(test: usize, part: Part) -> Self {
        Self { test, part, spreads: None }
    }
}

impl<'a> Search<'a> {
    fn new(field: &'a dyn Field, complex: &Complex, cubes: &'a [Cube]) -> Self {
        // One word holds the set of open tetrahedra; a cube has 24 of one kind at most.
        let shares = cubes
            .iter()
            .enumerate()
            .flat_map(|(k, cube)| cube.tetrahedra.chunks(64).map(move |t| (k, t)));
        let mut octets = Vec::with_capacity(cubes.len());
        let mut tests = Vec::with_capacity(cubes.len());
        for (cube, tetrahedra) in shares {
            let (first_octet, parts) = (octets.len(), Vec::new());
            octets.resize(first_octet + tetrahedra.len().div_ceil(LANES), Octet::EMPTY);
            run_widest(Fill { complex, tetrahedra, octets: &mut octets[first_octet..] });
            tests.push(Test { cube, tetrahedra, first_octet, failed: 0, parts, boxes: MOST_BOXES });
        }
        let groups = tests.iter().map(|test| (test.tetrahedra, &octets[test.first_octet..]));
        let failed = hopeless(field, groups);
        let mut batch = Vec::with_capacity(tests.len().max(LEAST_BATCH));
        for (k, (test, failed)) in tests.iter_mut().zip(failed).enumerate() {
            test.failed = failed;
            let all = u64::MAX >> (64 - test.tetrahedra.len());
            batch.push(Entry::new(k, Part::new(cubes[test.cube].domain, all, 0)));
        }
        Self { field, tests, octets, batch, domains: Vec::new(), forms: Vec::new() }
    }

    /// The next boxes of all tests: one of each, or some if few tests are left.
    fn take_batch(&mut self) {
        let active = self.tests.iter().filter(|test| !test.parts.is_empty()).count();
        let each = LEAST_BATCH.div_ceil(active.max(1));
        self.batch.clear();
        for (k, test) in self.tests.iter_mut().enumerate() {
            let rest = test.parts.len().saturating_sub(each);
            self.batch.extend(test.parts.drain(rest..).rev().map(|part| Entry::new(k, part)));
        }
    }

    /// Looks at the batch; what fails is halved and put back.
    fn look(&mut self) {
        let Self { field, tests, octets, batch, domains, forms } = self;
        run_widest(LeaveBeside { tests, octets, batch });
        batch.retain_mut(|entry| tests[entry.test].admits(&mut entry.part));
        domains.clear();
        domains.extend(batch.iter().map(|entry| entry.part.domain));
        forms.clear();
        forms.resize(batch.len(), None);
        field.gradient_forms(domains, forms);
        run_widest(LookClosely { tests, octets, batch, forms });
        let mut unknown = Vec::new();
        for entry in batch.iter().rev() {
            let Some(spreads) = entry.spreads else {
                unknown.push((entry.test, entry.part));
                continue;
            };
            if entry.part.open != 0 {
                tests[entry.test].halve(&entry.part, entry.part.loosest_axis(spreads));
            }
        }
        unknown.reverse();
        self.look_plainly(unknown);
    }

    /// Looks at boxes over which forms know nothing, by plain enclosures: those of products with zero
    /// are known whatever the other factor is.
    fn look_plainly(&mut self, batch: Vec<(usize, Part)>) {
        if batch.is_empty() {
            return;
        }
        let domains: Vec<_> = batch.iter().map(|(_, part)| part.domain).collect();
        let mut jets = vec![None; domains.len()];
        self.field.gradient_enclosures(&domains, &mut jets);
        for ((k, mut part), jet) in batch.into_iter().zip(jets).rev() {
            let test = &mut self.tests[k];
            let Some(IntervalJet { value, gradient }) = jet else {
                test.failed |= part.open;
                continue;
            };
            let octets = &self.octets[test.first_octet..];
            let is_open = |&l: &usize| {
                let (octet, i) = (&octets[l / LANES], l % LANES);
                !octet.is_transversal(i, &gradient) && !octet.has_sign_of(i, value, &part.frame)
            };
            part.open = set(members(part.open).filter(is_open));
            if part.open != 0 {
                test.halve(&part, part.loosest_axis(Vec3::from(part.frame[1])));
            }
        }
    }
}

/// Fills the octets of some tetrahedra.
struct Fill<'a> {
    complex: &'a Complex,
    tetrahedra: &'a [Tetrahedron],
    octets: &'a mut [Octet],
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (octet, tetrahedra) in self.octets.iter_mut().zip(self.tetrahedra.chunks(LANES)) {
            octet.fill(self.complex, tetrahedra);
        }
    }
}

/// Closes tetrahedra in boxes that do not meet them.
struct LeaveBeside<'a> {
    tests: &'a [Test<'a>],
    octets: &'a [Octet],
    batch: &'a mut [Entry],
}

impl Kernel for LeaveBeside<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // All tetrahedra of a cube meet the whole of it.
        for entry in self.batch.iter_mut().filter(|entry| entry.part.halvings > 0) {
            let first = self.tests[entry.test].first_octet;
            let part = &mut entry.part;
            for k in occupied(part.open) {
                part.open &= !(self.octets[first + k].beside(&part.frame) << (LANES * k));
            }
        }
    }
}

/// Closes tetrahedra that pass in boxes, and tells of the others how much each axis adds to the doubt.
struct LookClosely<'a> {
    tests: &'a [Test<'a>],
    octets: &'a [Octet],
    batch: &'a mut [Entry],
    forms: &'a [Option<AffineJet>],
}

impl Kernel for LookClosely<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (entry, jet) in self.batch.iter_mut().zip(self.forms) {
            let first = self.tests[entry.test].first_octet;
            let part = &mut entry.part;
            let Some(jet) = jet else { continue };
            let Some(forms) = BoxForms::new(jet, &part.frame) else { continue };
            let (mut open, mut spreads) = (0, Vec3::zeros());
            for k in occupied(part.open) {
                let doubts = forms.doubts(&self.octets[first + k]);
                let left = part.open >> (LANES * k) & doubts.open & OCTET;
                open |= left << (LANES * k);
                for i in members(left) {
                    let [x, y, z] = &doubts.spreads;
                    spreads += Vec3::new(x[i], y[i], z[i]);
                }
            }
            part.open = open;
            entry.spreads = Some(spreads);
        }
    }
}

/// The tetrahedra of an octet, as bits.
const OCTET: u64 = (1 << LANES) - 1;

/// Octets with tetrahedra of a set.
#[inline(always)]
fn occupied(set: u64) -> impl Iterator<Item = usize> {
    (0..64 / LANES).filter(move |k| set >> (LANES * k) & OCTET != 0)
}

impl Test<'_> {
    /// Whether a box needs a look. If none is left, what is open there fails.
    fn admits(&mut self, part: &mut Part) -> bool {
        part.open &= !self.failed;
        if self.boxes == 0 {
            self.failed |= part.open;
        }
        if part.open == 0 || self.boxes == 0 {
            return false;
        }
        self.boxes -= 1;
        true
    }

    /// Puts the halves of a box back, or takes it for failed.
    fn halve(&mut self, part: &Part, axis: usize) {
        if part.halvings >= MOST_HALVINGS {
            self.failed |= part.open;
            return;
        }
        let (mut lower, mut upper) = (part.domain, part.domain);
        lower[axis].hi = part.frame[0][axis];
        upper[axis].lo = part.frame[0][axis];
        let deeper = part.halvings + 1;
        if self.parts.capacity() == 0 {
            self.parts.reserve(USUAL_PARTS);
        }
        self.parts.extend([upper, lower].map(|half| Part::new(half, part.open, deeper)));
    }
}

impl Part {
    fn new(domain: [Interval; 3], open: u64, halvings: u32) -> Self {
        let [x, y, z] = domain.map(Affine::middle_and_half);
        Self { domain, frame: [[x[0], y[0], z[0]], [x[1], y[1], z[1]]], open, halvings }
    }

    /// The axis along which the doubt spreads most; the longest where that is not known. A hundredth
    /// keeps long axes in play, since the sign of f needs them too.
    fn loosest_axis(&self, spreads: Vec3) -> usize {
        let radius = Vec3::from(self.frame[1]);
        let all = spreads.x + spreads.y + spreads.z;
        let share = 0.01 * all / radius.max();
        let score = if all.is_finite() { spreads + share * radius } else { radius };
        (0..3).max_by(|&a, &b| score[a].total_cmp(&score[b])).expect("invariant: three axes")
    }
}

/// The set of some places below 64, as bits.
pub(crate) fn set(members: impl IntoIterator<Item = usize>) -> u64 {
    members.into_iter().fold(0, |set, i| set | 1 << i)
}

/// The places in a set, ascending.
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
