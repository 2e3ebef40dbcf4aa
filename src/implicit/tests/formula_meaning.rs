//! What formulas mean: precedence, lines, derivatives at kinks, canonical text.

#![expect(clippy::float_cmp, reason = "these values are exact")]

use isospline_geometry::Vec3;
use isospline_implicit::{Field, Formula, Interval, Jet2, Oriented};
use std::collections::BTreeMap;

fn formula(text: &str) -> Formula {
    Formula::parse(text, &BTreeMap::from([("r".to_owned(), 0.25)]))
        .unwrap_or_else(|error| panic!("{}", error.rendered()))
}

fn jet(text: &str, at: [f64; 3]) -> Jet2 {
    formula(text).hessian(Vec3::from(at))
}

#[track_caller]
fn check_value(text: &str, expected: f64) {
    let value = formula(text).value(Vec3::new(2.0, 3.0, 5.0));
    assert!((value - expected).abs() <= 1e-14 * expected.abs(), "{text} = {value}");
}

#[test]
fn precedence_is_that_of_mathematics() {
    check_value("-x^2", -4.0);
    check_value("2^x^y", 256.0);
    check_value("2^-1", 0.5);
    check_value("-x^-2", -0.25);
    check_value("x - y - z", -6.0);
    check_value("z/x/y", 5.0 / 6.0);
    check_value("x*-y", -6.0);
    check_value("--x + +y", 5.0);
    check_value("1.5e1*x - .5", 29.5);
}

#[test]
fn functions_are_what_their_names_say() {
    check_value("hypot(x, y, z)", 38.0_f64.sqrt());
    check_value("mod(-x, y)", 1.0);
    check_value("mod(7.5, x)", 1.5);
    check_value("clamp(z, 0, 4) + clamp(-z, 0, 4)", 4.0);
    check_value("smoothstep(1, 3, x)", 0.5);
    check_value("min(z, x, y) + max(x, z, y)", 7.0);
    check_value("log10(1000) + ln(e)", 4.0);
    check_value("atan2(0, -1) - pi + pow(x, y)", 8.0);
    check_value("smin(x, y, 0.5)", 2.0);
    check_value("smin(x, x, 3)", 1.5);
    check_value("smax(x, x, 3)", 2.5);
    check_value("0^0", 1.0);
    check_value("sign(-x)*abs(-y) + floor(-0.5)", -4.0);
}

#[test]
fn lines_definitions_and_comments_are_read_as_written() {
    check_value("\u{feff}# sum\r\nr2 = x^2 + y^2 # of squares\r\n\r\nr2 + 1", 14.0);
    check_value("a = x; b = a*y; b + r", 6.25);
    check_value("x +\n y * (1\n + z\n)\n", 20.0);
}

#[test]
fn the_exact_box_distance_has_finite_derivatives_everywhere() {
    let text = "qx = abs(x)-1; qy = abs(y)-1; qz = abs(z)-1
        sqrt(max(qx,0)^2 + max(qy,0)^2 + max(qz,0)^2) + min(max(qx, max(qy, qz)), 0)";
    let field = formula(text);
    let places = [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0];
    for (x, y, z) in places
        .iter()
        .flat_map(|x| places.map(|y| (*x, y)))
        .flat_map(|(x, y)| places.map(|z| (x, y, z)))
    {
        let jet = field.hessian(Vec3::new(x, y, z));
        assert!(jet.gradient.iter().chain(&jet.hessian).all(|d| d.is_finite()), "{x} {y} {z}");
    }
    let outside = field.gradient(Vec3::new(3.0, 0.5, 0.5));
    assert_eq!((outside.value, outside.gradient), (2.0, Vec3::x()));
    let corner = field.gradient(Vec3::new(2.0, 2.0, 2.0));
    assert!((corner.gradient - Vec3::repeat(1.0 / 3.0_f64.sqrt())).norm() < 1e-15);
}

#[test]
fn derivatives_at_kinks_are_those_of_the_table() {
    for (text, slope) in [
        ("abs(x)", 0.0),
        ("sqrt(x)", 0.0),
        ("hypot(x, y)", 0.0),
        ("x^0.25", 0.0),
        ("x^1.5", 0.0),
        ("sign(x)", 0.0),
        ("floor(x)", 0.0),
        ("mod(x, 1)", 1.0),
        ("min(x, 2*x)", 1.0),
        ("max(2*x, x)", 2.0),
        ("clamp(x, 0, 1)", 1.0),
        ("clamp(x, -1, 0)", 1.0),
        ("asin(x + 1)", 0.0),
        ("acos(x - 1)", 0.0),
        ("atan2(y, x)", 0.0),
        ("smin(x, 3*x, 1)", 2.0),
        ("x^2*y^0", 0.0),
    ] {
        let jet = jet(text, [0.0; 3]);
        assert_eq!(jet.gradient.x, slope, "{text}");
        assert!(jet.hessian.iter().all(|h| h.is_finite()), "{text}: {:?}", jet.hessian);
    }
}

#[test]
fn the_blend_has_continuous_second_derivatives() {
    let field = formula("smin(x, -x, 0.5) + smax(y, 0.5*y^2, 0.25)");
    // f'' of the first part has a slope of at most 4/k^2 = 16, of the second about 100.
    for step in -4000..4000 {
        let at = |t: f64| Vec3::new(t / 4000.0, t / 2000.0, 0.0);
        let (a, b) = (field.hessian(at(step.into())), field.hessian(at(f64::from(step) + 1.0)));
        for k in [0, 3] {
            assert!((a.hessian[k] - b.hessian[k]).abs() < 0.1, "step {step}: {k}");
        }
    }
    let far = jet("smin(x, y, 0.5)", [1.0, 1e9, 0.0]);
    assert_eq!((far.value, far.gradient), (1.0, Vec3::x()));
    // With respect to its width, against differences.
    let (h, width) = (1e-6, |z: f64| formula("smin(x, y, z)").value(Vec3::new(0.3, 0.5, z)));
    let slope = jet("smin(x, y, z)", [0.3, 0.5, 0.7]).gradient.z;
    assert!((slope - (width(0.7 + h) - width(0.7 - h)) / (2.0 * h)).abs() < 1e-9);
}

#[test]
fn undefined_values_are_data() {
    assert_eq!(formula("1/x").value(Vec3::zeros()), f64::INFINITY);
    assert!(formula("ln(x)").value(-Vec3::x()).is_nan());
    assert!(formula("min(x, sqrt(y))").value(-Vec3::y()).is_nan());
    assert!(
        formula("sqrt(x)").value_enclosure([Interval::new(-1.0, 1.0); 3]).unwrap().is_unknown()
    );
}

#[test]
fn enclosures_at_kinks_hold_both_sides() {
    let slope = |text: &str, lo: f64, hi: f64| {
        let domain = [Interval::new(lo, hi), Interval::ZERO, Interval::ZERO];
        formula(text).gradient_enclosure(domain).unwrap().gradient[0]
    };
    assert_eq!(slope("abs(x)", -1.0, 1.0), Interval::new(-1.0, 1.0));
    assert_eq!(slope("abs(x)", 1.0, 2.0), Interval::point(1.0));
    assert_eq!(slope("min(x, 2*x)", -1.0, 1.0), Interval::new(1.0, 2.0));
    assert_eq!(slope("min(x, 2*x)", 1.0, 2.0), Interval::point(1.0));
    assert_eq!(slope("floor(x)", -0.5, 0.5), Interval::ENTIRE);
    assert_eq!(slope("floor(x)", 0.25, 0.5), Interval::ZERO);
    for jump in ["atan2(x, 0)", "atan2(0, x)", "atan2(0*z, x)", "0^x", "atan2(x, y)"] {
        assert_eq!(slope(jump, -0.5, 0.5), Interval::ENTIRE, "{jump}");
    }
    assert_eq!(slope("atan2(0, x)", 0.5, 1.0), Interval::ZERO);
    assert_eq!(slope("sqrt(x)", 0.0, 4.0).hi, f64::INFINITY);
}

#[test]
fn canonical_text_ignores_writing_and_sees_meaning() {
    let plain = formula("x^2 + r*y").canonical();
    for same in ["x*x+r*y", "# note\nq = x^2;\n q +\n r*y", "x^2 + (y*0.25)", "u = 3*z; x^2 + r*y"]
    {
        assert_eq!(formula(same).canonical(), plain, "{same}");
    }
    for other in ["x^2 + 0.5*y", "x^2 - r*y", "x^2 + r*z"] {
        assert_ne!(formula(other).canonical(), plain, "{other}");
    }
    assert_eq!(plain, "t0 = x^2\nt1 = 0.25 * y\nt2 = t0 + t1\nt2");
}

#[test]
fn variables_that_do_not_count_are_known() {
    assert_eq!(formula("x^2 + z - 0*y").depends_on(), [true, false, true]);
    assert_eq!(formula("u = y; 3").depends_on(), [false; 3]);
}

#[test]
fn formulas_are_turned_by_level_and_sign() {
    let field = Oriented { inner: formula("x^2"), level: 1.0, flipped: true };
    let jet = field.hessian(Vec3::new(2.0, 0.0, 0.0));
    assert_eq!((jet.value, jet.gradient.x, jet.hessian[0]), (-3.0, -4.0, -2.0));
    let shared: std::sync::Arc<dyn Field> = std::sync::Arc::new(formula("x"));
    assert_eq!(Oriented { inner: shared, level: 1.0, flipped: false }.value(Vec3::x()), 0.0);
}
