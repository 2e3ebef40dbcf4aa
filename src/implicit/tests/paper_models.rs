//! The models of TK Fig. 9-15: values, derivatives, enclosures and inside.

use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{Field, Formula, Inside, Interval, auto_box, resolve_inside};
use num_dual::{DualNum, HyperDual64};
use std::collections::BTreeMap;

struct Model {
    name: &'static str,
    formula: &'static str,
    /// Half sides of its box.
    limit: f64,
    by_hand: fn([HyperDual64; 3]) -> HyperDual64,
}

const MODELS: [Model; 6] = [
    Model {
        name: "torus",
        formula: "(sqrt(x^2 + y^2) - 5)^2 + z^2 - 1",
        limit: 10.0,
        by_hand: |[x, y, z]| ((x * x + y * y).sqrt() - 5.0).powi(2) + z * z - 1.0,
    },
    Model {
        name: "dodecahedron",
        formula: "x^6 + y^6 + z^6 + 20*(x^4*y^2 + y^4*z^2 + z^4*x^2) - 1",
        limit: 10.0,
        by_hand: |[x, y, z]| {
            let [a, b, c] = [x * x, y * y, z * z];
            a * a * a + b * b * b + c * c * c + (a * a * b + b * b * c + c * c * a) * 20.0 - 1.0
        },
    },
    Model {
        name: "double torus",
        formula: "x^8 - 2*x^6 + x^4 + 2*x^4*y^2 - 2*x^2*y^2 + y^4 + z^2 - 0.04",
        limit: 10.0,
        by_hand: |[x, y, z]| {
            let part = x * x * (x * x - 1.0) + y * y;
            part * part + z * z - 0.04
        },
    },
    Model {
        name: "mcmullen",
        formula: "(x^2 + 1)*(y^2 + 1)*(z^2 + 1) + 8*x*y*z - 2",
        limit: 2.0,
        by_hand: |[x, y, z]| (x * x + 1.0) * (y * y + 1.0) * (z * z + 1.0) + x * y * z * 8.0 - 2.0,
    },
    Model {
        name: "chair",
        formula: "s = x^2 + y^2 + z^2\n\
                  (s - a*k^2)^2 - b*((z-k)^2 - 2*x^2)*((z+k)^2 - 2*y^2)",
        limit: 6.0,
        by_hand: |[x, y, z]| {
            let ball = x * x + y * y + z * z - 0.95 * 25.0;
            let left = (z - 5.0).powi(2) - x * x * 2.0;
            ball * ball - left * ((z + 5.0).powi(2) - y * y * 2.0) * 0.8
        },
    },
    Model {
        name: "deccube",
        formula: "((x^2+y^2-r^2)^2 + (z^2-1)^2) * ((y^2+z^2-r^2)^2 + (x^2-1)^2)\n\
                  * ((z^2+x^2-r^2)^2 + (y^2-1)^2) - 0.02",
        limit: 10.0,
        by_hand: |[x, y, z]| {
            let [a, b, c] = [x * x, y * y, z * z];
            let part = |a, b, c: HyperDual64| {
                let (ring, slab): (HyperDual64, _) = (a + b - 0.64, c - 1.0);
                ring * ring + slab * slab
            };
            part(a, b, c) * part(b, c, a) * part(c, a, b) - 0.02
        },
    },
];

fn formula(model: &Model) -> Formula {
    let parameters = [("a", 0.95), ("b", 0.8), ("k", 5.0), ("r", 0.8)];
    let parameters: BTreeMap<_, _> =
        parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    // A line that begins with an operator needs parentheses around the whole.
    let text = if model.name == "deccube" {
        format!("({})", model.formula)
    } else {
        model.formula.to_owned()
    };
    Formula::parse(&text, &parameters).expect("the models are formulas")
}

fn points(half: f64) -> Vec<Vec3> {
    let at = |i: usize, step: f64| half * (2.0 * (f64::from(i as u32) * step).fract() - 1.0);
    (1..300).map(|i| Vec3::new(at(i, 0.819), at(i, 0.671), at(i, 0.549))).collect()
}

/// Largest magnitude of value, gradient and Hessian in the box, as the unit of errors.
fn scale(model: &Model, half: f64) -> f64 {
    let field = formula(model);
    let size = |p: &Vec3| {
        let jet = field.hessian(*p);
        jet.hessian.iter().fold(jet.value.abs().max(jet.gradient.amax()), |all, h| all.max(h.abs()))
    };
    points(half).iter().map(size).fold(0.0, f64::max)
}

#[test]
fn jets_agree_with_hyper_dual_numbers_to_twelve_digits() {
    for model in &MODELS {
        let (field, unit) = (formula(model), scale(model, 1.2));
        for p in points(1.2) {
            let jet = field.hessian(p);
            for (k, (i, j)) in
                [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate()
            {
                let one = |a, b| if a == b { 1.0 } else { 0.0 };
                let seed = [0, 1, 2].map(|a| HyperDual64::new(p[a], one(a, i), one(a, j), 0.0));
                let expected = (model.by_hand)(seed);
                for (found, expected) in [
                    (jet.value, expected.re),
                    (jet.gradient[i], expected.eps1),
                    (jet.hessian[k], expected.eps1eps2),
                ] {
                    let error = (found - expected).abs();
                    assert!(error <= 1e-12 * unit, "{}: {found} {expected}", model.name);
                }
            }
        }
    }
}

#[test]
fn values_are_equal_in_values_gradients_and_hessians() {
    for model in &MODELS {
        let field = formula(model);
        for p in points(1.2) {
            let (jet, gradient) = (field.hessian(p), field.gradient(p));
            assert_eq!(field.value(p).to_bits(), gradient.value.to_bits());
            assert_eq!(field.value(p).to_bits(), jet.value.to_bits());
            assert_eq!(gradient.gradient, jet.gradient);
        }
    }
}

#[test]
fn enclosures_shrink_to_the_value_as_boxes_do() {
    for model in &MODELS {
        let (field, unit) = (formula(model), scale(model, 1.2));
        for p in points(1.2).into_iter().take(50) {
            for half in [1e-1, 1e-2, 1e-4, 0.0] {
                let domain = [0, 1, 2].map(|k| Interval::new(p[k] - half, p[k] + half));
                let enclosure = field.value_enclosure(domain).unwrap();
                let tight = field.tight_value_enclosure(domain).unwrap();
                assert!(enclosure.contains(field.value(p)), "{}", model.name);
                assert!(enclosure.width() <= unit * (1e3 * half + 1e-12), "{}", model.name);
                let linear = 8.0 * half * field.gradient(p).gradient.amax();
                let square = unit * (1e3 * half * half + 1e-12);
                assert!(tight.width() <= linear + square, "{}: {tight:?}", model.name);
            }
        }
    }
}

#[test]
fn all_models_are_negative_inside_and_fit_their_boxes() {
    for model in &MODELS {
        let field = formula(model);
        let aabb: Aabb = auto_box(&field, model.limit).unwrap();
        assert_eq!(resolve_inside(&field, &aabb, Inside::Auto), Ok(false), "{}", model.name);
    }
}
