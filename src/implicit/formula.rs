//! Formulas: text to a field with exact derivatives and enclosures.
//!
//! # Language
//! `+ - * / ^`, parentheses, numbers, `x y z`, `pi`, `e`, named parameters and the functions of
//! [`crate::FUNCTIONS`]. `-x^2` is `-(x^2)`, `^` binds to the right. Lines `name = expression`,
//! ended by a line break or `;`, define intermediate values; the last line is the value. `#`
//! starts a comment. A line goes on inside parentheses and after an operator.
//!
//! # Values
//! `0^0 = 1`; `0 * a = 0` whatever a is (only where the zero is constant). Division by zero and
//! logarithms of negative numbers give infinities and NaN. Integer powers up to 64 are products
//! in a fixed order, others libm's `pow`; `hypot` is the root of the sum of squares. All results
//! have the same bits on every machine, NaN payloads apart.
//!
//! # Derivatives at kinks
//! | where | first derivative | second |
//! |---|---|---|
//! | `abs(0)` | 0 | 0 |
//! | `min`, `max` with equal arguments, `clamp` at its ends | of the first argument (x) | same |
//! | `sqrt(0)`, `hypot(0, 0)`, `pow(0, p)` with 0 < p < 1 | 0 | 0 |
//! | `sign`, `floor` | 0 everywhere | 0 |
//! | `mod(a, b)` | of a minus `floor(a/b)` times that of b | same |
//! | `asin(1)`, `acos(1)`, `atan2(0, 0)` | 0 | 0 |
//! | `smin`, `smax` | continuous | continuous |
//!
//! Enclosures of derivatives hold every one-sided derivative (a kink gives the hull of both
//! sides); over a jump they are unbounded, so the mean value theorem holds with them.

use crate::affine_lanes;
use crate::dag::{Dag, Node, NodeId};
use crate::evaluator;
use crate::formula_error::FormulaError;
use crate::interval_evaluator::enclose;
use crate::interval_lanes::enclose_all;
use crate::kinks;
use crate::lowering::{self, Target};
use crate::tape::Tape;
use crate::{AffineJet, BLOCK, Field, Interval, IntervalJet, Jet1, Jet2};
use crate::{canonical, derivative, parser};
use isospline_geometry::Vec3;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// A field given by a formula.
///
/// # Examples
/// ```
/// use isospline_implicit::{Field, Formula};
/// use isospline_geometry::Vec3;
/// use std::collections::BTreeMap;
///
/// let parameters = BTreeMap::from([("r".to_owned(), 2.0)]);
/// let sphere = Formula::parse("d2 = x^2 + y^2 + z^2\nsqrt(d2) - r", &parameters)?;
/// let jet = sphere.gradient(Vec3::new(0.0, 0.0, 3.0));
/// assert_eq!((jet.value, jet.gradient), (1.0, Vec3::new(0.0, 0.0, 1.0)));
/// # Ok::<(), isospline_implicit::FormulaError>(())
/// ```
#[derive(Debug)]
pub struct Formula {
    dag: Dag,
    root: NodeId,
    // Compiled when first asked for: a formula of a million terms takes seconds and much memory.
    values: OnceLock<Tape>,
    value_intervals: OnceLock<Tape>,
    gradients: OnceLock<Tape>,
    gradient_intervals: OnceLock<Tape>,
    hessians: OnceLock<Tape>,
}

impl Formula {
    /// Reads a formula; `parameters` are the values of names that it may use.
    ///
    /// # Errors
    /// The first thing that cannot be read, with its place.
    pub fn parse(text: &str, parameters: &BTreeMap<String, f64>) -> Result<Self, FormulaError> {
        let (dag, root) = parser::parse(text, parameters)?;
        Ok(Self {
            values: OnceLock::new(),
            value_intervals: OnceLock::new(),
            gradients: OnceLock::new(),
            gradient_intervals: OnceLock::new(),
            hessians: OnceLock::new(),
            dag,
            root,
        })
    }

    /// The formula with parameters put in, one operation a line, as a formula again. Spacing,
    /// comments, names and repetitions leave it alone; the order of terms does not. For hashing.
    pub fn canonical(&self) -> String {
        canonical::canonical(&self.dag, self.root)
    }

    /// Which of x, y, z the value depends on.
    pub fn depends_on(&self) -> [bool; 3] {
        let needed = self.dag.reachable(&[self.root]);
        let occurs = |axis| {
            let is_axis = |&row: &usize| self.dag.node(NodeId(row as u32)) == Node::Variable(axis);
            (0..needed.len()).filter(|&row| needed[row]).any(|row| is_axis(&row))
        };
        [occurs(0), occurs(1), occurs(2)]
    }

    /// How many operations the formula has, each counted once however often it is written.
    pub fn n_operations(&self) -> usize {
        canonical::n_definitions(&self.dag, self.root)
    }

    fn value_tape(&self) -> &Tape {
        self.values.get_or_init(|| self.value_of(Target::Points))
    }

    fn value_interval_tape(&self) -> &Tape {
        self.value_intervals.get_or_init(|| self.value_of(Target::Intervals))
    }

    fn value_of(&self, target: Target) -> Tape {
        compile(&self.dag, &[self.root], self.dag.n_nodes(), target)
    }

    fn gradient_tape(&self) -> &Tape {
        self.gradients.get_or_init(|| self.first_derivatives(Target::Points))
    }

    fn gradient_interval_tape(&self) -> &Tape {
        self.gradient_intervals.get_or_init(|| self.first_derivatives(Target::Intervals))
    }

    fn first_derivatives(&self, target: Target) -> Tape {
        let mut dag = self.dag.clone();
        let [x, y, z] = derivative::gradient(&mut dag, self.root);
        compile(&dag, &[self.root, x, y, z], self.dag.n_nodes(), target)
    }

    fn hessian_tape(&self) -> &Tape {
        self.hessians.get_or_init(|| {
            let (dag, first, second) = self.second_derivatives();
            let roots: Vec<NodeId> = [self.root].into_iter().chain(first).chain(second).collect();
            compile(&dag, &roots, self.dag.n_nodes(), Target::Points)
        })
    }

    fn second_derivatives(&self) -> (Dag, [NodeId; 3], [NodeId; 6]) {
        let mut dag = self.dag.clone();
        let first = derivative::gradient(&mut dag, self.root);
        let second = derivative::hessian(&mut dag, first);
        (dag, first, second)
    }
}

fn compile(dag: &Dag, roots: &[NodeId], n_values: usize, target: Target) -> Tape {
    let (low, roots) = lowering::lower(dag, roots, n_values, target);
    Tape::new(&low, &roots, target)
}

impl Field for Formula {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        evaluator::evaluate::<1, _>(self.value_tape(), points, out, |[f]| f);
    }

    fn gradients(&self, points: &[Vec3], out: &mut [Jet1]) {
        evaluator::evaluate::<4, _>(self.gradient_tape(), points, out, |[f, x, y, z]| Jet1 {
            value: f,
            gradient: Vec3::new(x, y, z),
        });
    }

    fn gradient_block(&self, n: usize, points: &[[f64; BLOCK]; 3], out: &mut [[f64; BLOCK]; 4]) {
        evaluator::evaluate_block(self.gradient_tape(), n, points, out);
    }

    fn hessians(&self, points: &[Vec3], out: &mut [Jet2]) {
        let tape = self.hessian_tape();
        evaluator::evaluate::<10, _>(tape, points, out, |[f, x, y, z, hessian @ ..]| Jet2 {
            value: f,
            gradient: Vec3::new(x, y, z),
            hessian,
        });
    }

    fn value_enclosure(&self, domain: [Interval; 3]) -> Option<Interval> {
        let [value] = enclose(self.value_interval_tape(), domain);
        Some(value)
    }

    fn gradient_enclosure(&self, domain: [Interval; 3]) -> Option<IntervalJet> {
        let [value, x, y, z] = enclose(self.gradient_interval_tape(), domain);
        Some(IntervalJet { value, gradient: [x, y, z] })
    }

    fn value_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<Interval>]) {
        enclose_all::<1, _>(self.value_interval_tape(), domains, out, |[value]| Some(value));
    }

    fn gradient_enclosures(&self, domains: &[[Interval; 3]], out: &mut [Option<IntervalJet>]) {
        let tape = self.gradient_interval_tape();
        enclose_all::<4, _>(tape, domains, out, |[value, x, y, z]| {
            Some(IntervalJet { value, gradient: [x, y, z] })
        });
    }

    fn gradient_forms(&self, domains: &[[Interval; 3]], out: &mut [Option<AffineJet>]) {
        let tape = self.gradient_interval_tape();
        affine_lanes::enclose_all::<4, _>(tape, domains, out, |[value, x, y, z]| {
            Some(AffineJet { value, gradient: [x, y, z] })
        });
    }

    fn kinks_between(&self, a: Vec3, b: Vec3) -> Vec<&'static str> {
        kinks::between(&self.dag, self.root, a, b)
    }
}
