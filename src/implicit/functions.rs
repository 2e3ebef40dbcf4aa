//! The functions, constants and variables a formula may name.

/// A function of the formula language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name.
    pub name: &'static str,
    /// Fewest arguments.
    pub least: usize,
    /// Most arguments; `usize::MAX` if there is no limit.
    pub most: usize,
    /// What it gives, in one line.
    pub meaning: &'static str,
    pub(crate) rule: Rule,
}

/// How the parser builds a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rule {
    Unary(crate::operation::UnaryOp),
    Binary(crate::operation::BinaryOp),
    /// Left-associative chain.
    Chain(crate::operation::BinaryOp),
    Hypot,
    Mod,
    Clamp,
    Smoothstep,
    Smin,
    Smax,
}

const fn unary(
    name: &'static str,
    op: crate::operation::UnaryOp,
    meaning: &'static str,
) -> Function {
    Function { name, least: 1, most: 1, meaning, rule: Rule::Unary(op) }
}

const fn other(name: &'static str, n: usize, rule: Rule, meaning: &'static str) -> Function {
    let most = if matches!(rule, Rule::Chain(_) | Rule::Hypot) { usize::MAX } else { n };
    Function { name, least: n, most, meaning, rule }
}

/// All functions, in the order of the manual.
pub const FUNCTIONS: &[Function] = {
    use crate::operation::BinaryOp as B;
    use crate::operation::UnaryOp as U;
    &[
        unary("sqrt", U::Sqrt, "square root; slope 0 at 0"),
        unary("exp", U::Exp, "e^x"),
        unary("ln", U::Ln, "natural logarithm"),
        unary("log10", U::Log10, "decimal logarithm"),
        unary("abs", U::Abs, "magnitude; slope 0 at 0"),
        unary("sign", U::Sign, "-1, 0 or 1; slope 0"),
        unary("floor", U::Floor, "largest integer not above x; slope 0"),
        unary("sin", U::Sin, "sine, x in radians"),
        unary("cos", U::Cos, "cosine, x in radians"),
        unary("tan", U::Tan, "tangent, x in radians"),
        unary("asin", U::Asin, "inverse sine; slope 0 at -1 and 1"),
        unary("acos", U::Acos, "inverse cosine; slope 0 at -1 and 1"),
        unary("atan", U::Atan, "inverse tangent"),
        unary("sinh", U::Sinh, "hyperbolic sine"),
        unary("cosh", U::Cosh, "hyperbolic cosine"),
        unary("tanh", U::Tanh, "hyperbolic tangent"),
        other(
            "atan2",
            2,
            Rule::Binary(B::Atan2),
            "atan2(y, x): angle in (-pi, pi]; slope 0 at 0, 0",
        ),
        other("pow", 2, Rule::Binary(B::Pow), "a^b"),
        other("mod", 2, Rule::Mod, "a - b floor(a/b): the sign of b"),
        other("min", 2, Rule::Chain(B::Min), "smallest; on a tie the slope of the first"),
        other("max", 2, Rule::Chain(B::Max), "largest; on a tie the slope of the first"),
        other("hypot", 2, Rule::Hypot, "sqrt(a^2 + b^2 + ...); slope 0 at 0"),
        other(
            "clamp",
            3,
            Rule::Clamp,
            "clamp(x, lo, hi) = min(max(x, lo), hi); slope 1 at the ends",
        ),
        other(
            "smoothstep",
            3,
            Rule::Smoothstep,
            "smoothstep(e0, e1, x): t^2 (3-2t), t = clamp((x-e0)/(e1-e0), 0, 1)",
        ),
        other(
            "smin",
            3,
            Rule::Smin,
            "smin(a, b, k): C2 blend min(a, b) - k (1-|a-b|/k)^3/6 where |a-b| < k; k > 0",
        ),
        other("smax", 3, Rule::Smax, "smax(a, b, k) = -smin(-a, -b, k)"),
    ]
};

/// Constants by name.
pub const CONSTANTS: &[(&str, f64)] = &[("pi", std::f64::consts::PI), ("e", std::f64::consts::E)];

/// Variables, in the order of axes.
pub const VARIABLES: [&str; 3] = ["x", "y", "z"];

pub(crate) fn function(name: &str) -> Option<&'static Function> {
    FUNCTIONS.iter().find(|function| function.name == name)
}

/// Whether a parameter or a definition may not take this name.
pub(crate) fn is_reserved(name: &str) -> bool {
    name == "log"
        || VARIABLES.contains(&name)
        || function(name).is_some()
        || CONSTANTS.iter().any(|(constant, _)| *constant == name)
}
