//! `.vm`: one operation a line, `name op arguments`; the last line is the result.
//!
//! Operations mean what they mean in fidget: `mod` has a result from 0 on, `compare` gives -1, 0
//! or 1, `and` gives its first argument where that is 0 and else its second, `or` the other way
//! round, `round` goes away from 0 at halves.

use super::{ForeignError, ForeignErrorKind, ForeignModel, finite};
use crate::functions::is_reserved;
use std::collections::{BTreeMap, BTreeSet};

pub(super) fn read(text: &str) -> Result<ForeignModel, ForeignError> {
    let mut program = Program::default();
    let mut count = 0;
    for (number, line) in text.lines().enumerate() {
        // A comment may follow an operation.
        let words = line.split_whitespace().take_while(|word| !word.starts_with('#'));
        let words: Vec<&str> = words.collect();
        count = number + 1;
        if let Some(name) = words.first() {
            let value = program.expression(&words, count)?;
            let defined = program.define(name, &value);
            defined.map_err(|kind| ForeignError { line: count, kind })?;
        }
    }
    let missing = ForeignErrorKind::Empty { expected: "operations" };
    let result = program.last.ok_or(ForeignError { line: count.max(1), kind: missing })?;
    let formula = format!("{}{result}", program.definitions);
    Ok(ForeignModel { formula, parameters: BTreeMap::new(), view_radius: None })
}

/// The lines so far.
#[derive(Default)]
struct Program {
    /// As lines `name = expression`.
    definitions: String,
    /// What each of their names is called in the formula.
    names: BTreeMap<String, String>,
    taken: BTreeSet<String>,
    last: Option<String>,
}

impl Program {
    /// What a line computes, as text of the formula language.
    fn expression(&self, words: &[&str], line: usize) -> Result<String, ForeignError> {
        let error = |kind| ForeignError { line, kind };
        let arguments = words.get(2..).unwrap_or(&[]);
        let op = words.get(1).copied().unwrap_or("");
        let expects = |expected: usize| {
            let (name, found) = (op.to_owned(), arguments.len());
            let wrong = ForeignErrorKind::Arguments { name, expected, found };
            if found == expected { Ok(()) } else { Err(error(wrong)) }
        };
        if op == "const" {
            expects(1)?;
            return Ok(format!("{:?}", finite(arguments[0], line)?));
        }
        let (arity, write) = operation(op)
            .ok_or_else(|| error(ForeignErrorKind::Operation { name: op.to_owned() }))?;
        expects(arity)?;
        let known = |name: &&str| {
            let undefined = || ForeignErrorKind::Undefined { name: (*name).to_owned() };
            self.names.get(*name).ok_or_else(|| error(undefined()))
        };
        let known = arguments.iter().map(known).collect::<Result<Vec<_>, _>>()?;
        let argument = |k: usize| known.get(k).map_or("", |name| name.as_str());
        Ok(write.replace("$1", argument(0)).replace("$2", argument(1)))
    }

    fn define(&mut self, name: &str, value: &str) -> Result<(), ForeignErrorKind> {
        if self.names.contains_key(name) {
            return Err(ForeignErrorKind::Twice { name: name.to_owned() });
        }
        let called = self.free_name(name);
        self.definitions.extend([&called, " = ", value, "\n"]);
        self.names.insert(name.to_owned(), called.clone());
        self.taken.insert(called.clone());
        self.last = Some(called);
        Ok(())
    }

    /// A name of the formula language that nothing else has, as near to `name` as may be.
    fn free_name(&self, name: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut called: String = name.chars().map(plain).collect();
        if called.starts_with(|c: char| c.is_ascii_digit()) {
            called.insert(0, '_');
        }
        while is_reserved(&called) || self.taken.contains(&called) {
            called.push('_');
        }
        called
    }
}

/// Number of arguments of an operation, and how the formula language writes it.
fn operation(name: &str) -> Option<(usize, &'static str)> {
    Some(match name {
        "var-x" => (0, "x"),
        "var-y" => (0, "y"),
        "var-z" => (0, "z"),
        "neg" => (1, "-$1"),
        "recip" => (1, "1 / $1"),
        "abs" => (1, "abs($1)"),
        "sqrt" => (1, "sqrt($1)"),
        "square" => (1, "$1^2"),
        "floor" => (1, "floor($1)"),
        "ceil" => (1, "-floor(-$1)"),
        "round" => (1, "sign($1) * floor(abs($1) + 0.5)"),
        "sin" => (1, "sin($1)"),
        "cos" => (1, "cos($1)"),
        "tan" => (1, "tan($1)"),
        "asin" => (1, "asin($1)"),
        "acos" => (1, "acos($1)"),
        "atan" => (1, "atan($1)"),
        "exp" => (1, "exp($1)"),
        "ln" => (1, "ln($1)"),
        "not" => (1, "1 - abs(sign($1))"),
        "add" => (2, "$1 + $2"),
        "sub" => (2, "$1 - $2"),
        "mul" => (2, "$1 * $2"),
        "div" => (2, "$1 / $2"),
        "min" => (2, "min($1, $2)"),
        "max" => (2, "max($1, $2)"),
        "atan2" => (2, "atan2($1, $2)"),
        "compare" => (2, "sign($1 - $2)"),
        "mod" => (2, "mod($1, abs($2))"),
        "and" => (2, "$2 * abs(sign($1))"),
        "or" => (2, "$1 + $2 * (1 - abs(sign($1)))"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Field as _, Formula};
    use isospline_geometry::Vec3;

    fn value(text: &str, at: [f64; 3]) -> f64 {
        let model = read(text).unwrap();
        Formula::parse(&model.formula, &model.parameters).unwrap().value(Vec3::from(at))
    }

    #[test]
    fn lines_are_operations_on_lines_before() {
        let sphere = "# a sphere\n\n_0 var-x\n1 var-y # height\nz var-z\na square _0\nb square 1\n\
            c square z\nd add a b\ne add d c\nsin sqrt e\nr const 1.5\nout sub sin r\n";
        assert!((value(sphere, [0.0, 3.0, 4.0]) - 3.5).abs() < 1e-15);
        let formula = read(sphere).unwrap().formula;
        assert!(formula.ends_with("r = 1.5\nout = sin_ - r\nout"), "{formula}");
    }

    #[test]
    fn names_that_collide_are_kept_apart() {
        let text = "a-b var-x\na_b var-y\nx const 7\nt sub a-b a_b\nu mul t x\n";
        assert_eq!(value(text, [5.0, 3.0, 0.0]).to_bits(), 14.0_f64.to_bits());
    }

    #[test]
    fn every_operation_means_what_it_means_in_fidget() {
        let unary = |op: &str, a: f64| value(&format!("a const {a}\nb {op} a"), [0.0; 3]);
        let binary = |op: &str, a: f64, b: f64| {
            value(&format!("a const {a}\nb const {b}\nc {op} a b"), [0.0; 3])
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{a} {b}");
        for a in [-2.5, -0.3, 0.0, 0.7, 2.5] {
            near(unary("neg", a), -a);
            near(unary("ceil", a), f64::ceil(a));
            near(unary("round", a), f64::round(a));
            near(unary("not", a), f64::from(u8::from(a == 0.0)));
            near(unary("square", a), a * a);
            near(unary("atan", a), libm::atan(a));
            near(unary("recip", a + 9.0), 1.0 / (a + 9.0));
            for b in [-1.5, 0.7, 2.0] {
                near(binary("sub", a, b), a - b);
                near(binary("div", a, b), a / b);
                near(binary("mod", a, b), a.rem_euclid(b));
                near(binary("atan2", a, b), libm::atan2(a, b));
                near(
                    binary("compare", a, b),
                    a.partial_cmp(&b).map_or(f64::NAN, |o| f64::from(o as i8)),
                );
                near(binary("and", a, b), if a == 0.0 { a } else { b });
                near(binary("or", a, b), if a == 0.0 { b } else { a });
                near(binary("max", a, b), a.max(b));
            }
        }
    }

    #[test]
    fn faults_are_told_with_their_line() {
        let says = |text: &str| read(text).unwrap_err().to_string();
        assert_eq!(says("a var-x\nb frob a\n"), "line 2: unknown operation `frob`");
        assert_eq!(says("a var-x\n\nb add a\n"), "line 3: `add` takes 2 arguments and has 1");
        assert_eq!(says("a neg b\n"), "line 1: `b` is not defined before this line");
        assert_eq!(says("a var-x\na var-y\n"), "line 2: `a` is defined twice");
        assert_eq!(says("a const one\n"), "line 1: `one` is not a finite number");
        assert_eq!(says("a\n"), "line 1: unknown operation ``");
        assert_eq!(says("# nothing\n"), "line 1: no operations");
    }
}
