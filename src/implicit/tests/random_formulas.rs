//! Random formulas against oracles: values, derivatives, enclosures, canonical text.

use exmex::Express as _;
use isospline_geometry::Vec3;
use isospline_implicit::{Affine, AffineJet, Field, Formula, Interval, IntervalJet};
use num_dual::{DualNum, HyperDual64};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::collections::BTreeMap;

/// A formula that knows its text and its value in any number type.
#[derive(Clone, Debug)]
enum Expression {
    Axis(usize),
    Number(f64),
    Unary(&'static str, Box<Self>),
    Binary(&'static str, Box<Self>, Box<Self>),
    Power(Box<Self>, i32),
}

const SMOOTH: [&str; 7] = ["sin", "cos", "exp", "atan", "tanh", "sinh", "cosh"];

impl Expression {
    fn text(&self) -> String {
        match self {
            Self::Axis(axis) => ["x", "y", "z"][*axis].into(),
            Self::Number(value) => format!("({value:?})"),
            Self::Unary(name, a) => format!("{name}({})", a.text()),
            Self::Binary(op, a, b) if op.len() == 1 => format!("({} {op} {})", a.text(), b.text()),
            Self::Binary(name, a, b) => format!("{name}({}, {})", a.text(), b.text()),
            Self::Power(a, n) => format!("({})^{n}", a.text()),
        }
    }

    /// Smooth operations only.
    fn evaluate<D: DualNum<Primitive = f64> + Copy>(&self, at: &[D; 3]) -> D {
        match self {
            Self::Axis(axis) => at[*axis],
            Self::Number(value) => D::from(*value),
            Self::Power(a, n) => a.evaluate(at).powi(*n),
            Self::Unary(name, a) => {
                let a = a.evaluate(at);
                match *name {
                    "sin" => a.sin(),
                    "cos" => a.cos(),
                    "exp" => a.exp(),
                    "atan" => a.atan(),
                    "tanh" => a.tanh(),
                    "sinh" => a.sinh(),
                    _ => a.cosh(),
                }
            }
            Self::Binary(op, a, b) => {
                let (a, b) = (a.evaluate(at), b.evaluate(at));
                match *op {
                    "+" => a + b,
                    "-" => a - b,
                    "*" => a * b,
                    _ => a / b,
                }
            }
        }
    }
}

fn expressions(
    unary: &'static [&'static str],
    binary: &'static [&'static str],
) -> impl Strategy<Value = Expression> {
    let leaf = prop_oneof![
        4 => (0..3_usize).prop_map(Expression::Axis),
        1 => (-8..=8_i32).prop_map(|n| Expression::Number(f64::from(n) * 0.25)),
        1 => (-3.0..3.0).prop_map(Expression::Number),
    ];
    leaf.prop_recursive(5, 24, 2, move |inner| {
        let select = |names: &'static [&'static str]| prop::sample::select(names);
        prop_oneof![
            2 => (select(unary), inner.clone())
                .prop_map(|(name, a)| Expression::Unary(name, Box::new(a))),
            4 => (select(binary), inner.clone(), inner.clone())
                .prop_map(|(op, a, b)| Expression::Binary(op, Box::new(a), Box::new(b))),
            1 => (inner, 2..5_i32).prop_map(|(a, n)| Expression::Power(Box::new(a), n)),
        ]
    })
}

fn smooth() -> impl Strategy<Value = Expression> {
    expressions(&SMOOTH, &["+", "-", "*", "/"])
}

fn any_expression() -> impl Strategy<Value = Expression> {
    static UNARY: [&str; 12] =
        ["sin", "cos", "exp", "atan", "tanh", "cosh", "abs", "sqrt", "ln", "floor", "sign", "tan"];
    expressions(&UNARY, &["+", "-", "*", "/", "min", "max", "pow", "atan2", "mod", "hypot"])
}

fn formula(expression: &Expression) -> Formula {
    Formula::parse(&expression.text(), &BTreeMap::new()).expect("generated formulas are formulas")
}

fn points() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-2.0..2.0)
}

/// Equal up to `tolerance` relative to the larger and 1; both undefined counts as equal.
fn near(a: f64, b: f64, tolerance: f64) -> bool {
    let size = 1.0_f64.max(a.abs()).max(b.abs());
    (a - b).abs() <= tolerance * size || !a.is_finite() || !b.is_finite()
}

/// The same formulas in every run, so that a green run stays green; `PROPTEST_CASES` and
/// `PROPTEST_RNG_SEED` search further. No regression files: proptest would put them into a folder
/// of `src`, which is a crate each.
fn repeatable() -> ProptestConfig {
    let set = |name| std::env::var_os(name).is_some();
    let mut config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    if !set("PROPTEST_CASES") {
        config.cases = 2000;
    }
    if !set("PROPTEST_RNG_SEED") {
        config.rng_seed = RngSeed::Fixed(1);
    }
    config
}

proptest! {
    #![proptest_config(repeatable())]

    #[test]
    fn derivatives_agree_with_hyper_dual_numbers(e in smooth(), at in points()) {
        let jet = formula(&e).hessian(Vec3::from(at));
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        for (k, (i, j)) in pairs.into_iter().enumerate() {
            let seed = |axis: usize| {
                let unit = |other| if axis == other { 1.0 } else { 0.0 };
                HyperDual64::new(at[axis], unit(i), unit(j), 0.0)
            };
            let expected = e.evaluate(&[seed(0), seed(1), seed(2)]);
            // Where the value is huge, derivatives are differences of huger ones.
            let size = expected.re.abs().max(expected.eps1.abs()).max(expected.eps2.abs());
            if !size.is_finite() || size > 1e6 || expected.eps1eps2.abs() > 1e8 {
                continue;
            }
            prop_assert!(near(jet.value, expected.re, 1e-9), "{} {}", jet.value, expected.re);
            prop_assert!(near(jet.gradient[i], expected.eps1, 1e-7), "{e:?} d{i}: {} {}", jet.gradient[i], expected.eps1);
            prop_assert!(near(jet.hessian[k], expected.eps1eps2, 1e-5), "{e:?} d{i}{j}: {} {}", jet.hessian[k], expected.eps1eps2);
        }
    }

    #[test]
    fn values_agree_with_exmex(e in smooth(), at in points()) {
        let text = e.text();
        let oracle = exmex::parse::<f64>(&text).unwrap();
        let used: Vec<f64> =
            oracle.var_names().iter().map(|name| at["xyz".find(name.as_str()).unwrap()]).collect();
        let expected = oracle.eval(&used).unwrap();
        let value = formula(&e).value(Vec3::from(at));
        prop_assert!(near(value, expected, 1e-9), "{text}: {value} {expected}");
    }

    #[test]
    fn values_and_gradients_lie_in_their_enclosures(
        e in any_expression(),
        at in points(),
        size in prop::array::uniform3(0.0..1.0_f64),
        shares in prop::collection::vec(prop::array::uniform3(0.0..=1.0_f64), 12),
    ) {
        let field = formula(&e);
        let domain: [Interval; 3] =
            std::array::from_fn(|k| Interval::new(at[k], at[k] + size[k] * size[k]));
        let IntervalJet { value, gradient } = field.gradient_enclosure(domain).unwrap();
        let tight = field.tight_value_enclosure(domain).unwrap();
        prop_assert_eq!(field.value_enclosure(domain).map(|v| v.lo.to_bits()), Some(value.lo.to_bits()));
        let mut together = [None; 5];
        field.gradient_enclosures(&[domain; 5], &mut together);
        let alone = field.gradient_enclosure(domain);
        // As text, for NaN is not equal to itself.
        prop_assert_eq!(format!("{:?}", together), format!("{:?}", [alone; 5]));
        for share in shares {
            let point = Vec3::from_fn(|k, _| {
                (domain[k].lo + share[k] * domain[k].width()).clamp(domain[k].lo, domain[k].hi)
            });
            let jet = field.gradient(point);
            prop_assert!(jet.value.is_nan() || value.contains(jet.value), "{}: {} not in {value:?}", e.text(), jet.value);
            let slack = 1e-9 * (1.0 + jet.value.abs());
            let around = Interval::new(tight.lo - slack, tight.hi + slack);
            prop_assert!(jet.value.is_nan() || around.contains(jet.value), "{}: {} not in mean value form {tight:?}", e.text(), jet.value);
            // Where there is no value there is no slope.
            for k in (0..3).filter(|_| !jet.value.is_nan()) {
                let slope = jet.gradient[k];
                prop_assert!(slope.is_nan() || gradient[k].contains(slope), "{} d{k}: {slope} not in {:?}", e.text(), gradient[k]);
            }
        }
    }

    #[test]
    fn values_and_gradients_lie_in_their_affine_forms(
        e in any_expression(),
        at in points(),
        size in prop::array::uniform3(0.0..1.0_f64),
        shares in prop::collection::vec(prop::array::uniform3(0.0..=1.0_f64), 12),
    ) {
        let field = formula(&e);
        let domain: [Interval; 3] =
            std::array::from_fn(|k| Interval::new(at[k], at[k] + size[k] * size[k]));
        let mut jets = [None];
        field.gradient_forms(&[domain], &mut jets);
        let AffineJet { value, gradient } = jets[0].unwrap();
        let sides = domain.map(Affine::middle_and_half);
        for share in shares {
            let point = Vec3::from_fn(|k, _| {
                (domain[k].lo + share[k] * domain[k].width()).clamp(domain[k].lo, domain[k].hi)
            });
            let offset: [f64; 3] = std::array::from_fn(|k| {
                let [middle, half] = sides[k];
                if half > 0.0 { (point[k] - middle) / half } else { 0.0 }
            });
            let jet = field.gradient(point);
            let pairs = [(value, jet.value), (gradient[0], jet.gradient.x),
                (gradient[1], jet.gradient.y), (gradient[2], jet.gradient.z)];
            for (form, found) in pairs {
                let linear = form.middle + (0..3).map(|k| form.slopes[k] * offset[k]).sum::<f64>();
                // What the point evaluation rounds, some of it of larger terms.
                let slack = 1e-9 * (1.0 + found.abs() + form.middle.abs());
                let is_known = linear.is_finite() && form.rest.is_finite();
                // Where there is no value there is no slope.
                let is_there = !jet.value.is_nan() && !found.is_nan();
                prop_assert!(
                    !is_known || !is_there || (found - linear).abs() <= form.rest + slack,
                    "{}: {found} not in {form:?} at {offset:?}", e.text()
                );
            }
        }
    }

    #[test]
    fn canonical_text_reads_as_itself(e in any_expression()) {
        let text = formula(&e).canonical();
        let again = Formula::parse(&text, &BTreeMap::new()).unwrap();
        prop_assert_eq!(again.canonical(), text);
    }

    #[test]
    fn any_text_is_read_or_refused_without_panic(text in "[ -~\n\u{e9}\u{feff}]{0,40}") {
        if let Err(error) = Formula::parse(&text, &BTreeMap::new()) {
            let error_text = error.rendered();
            prop_assert!(error_text.ends_with('^'));
            prop_assert!(error.span.end <= text.len());
        }
    }

    #[test]
    fn tokens_in_any_order_are_read_or_refused_without_panic(
        words in prop::collection::vec(prop::sample::select(vec![
            "x", "y", "r", "2", ".5", "+", "-", "*", "/", "^", "(", ")", ",", "=", "\n", ";",
            "sin", "min(", "smin(", "log", "sqrt(", "#",
        ]), 0..20),
    ) {
        let parameters = BTreeMap::from([("r".to_owned(), 0.5)]);
        if let Err(error) = Formula::parse(&words.concat(), &parameters) {
            prop_assert!(error.line >= 1 && error.column >= 1);
        }
    }
}
