//! From tokens to a graph, by recursive descent with a depth limit.
//!
//! ```text
//! formula   = { name "=" sum separator } sum
//! sum       = product { ("+" | "-") product }
//! product   = signed { ("*" | "/") signed }
//! signed    = { "-" | "+" } power
//! power     = primary [ "^" signed ]          right-associative; -x^2 is -(x^2)
//! primary   = number | name | name "(" sum { "," sum } ")" | "(" sum ")"
//! separator = line break | ";"
//! ```
//! A line break does not end a line inside parentheses or where a value is expected. Sums and
//! products are loops, so their length is not limited; nesting is.

use crate::dag::{Dag, NodeId};
use crate::formula_error::{FormulaError, FormulaErrorKind as Kind};
use crate::functions::{self, Function, Rule};
use crate::lexer::{self, Token, TokenKind};
use crate::operation::{BinaryOp, UnaryOp};
use std::collections::BTreeMap;
use std::ops::Range;

/// Levels of parentheses, calls and exponents. Each takes about 1 kB of stack in debug builds;
/// threads have 2 MB, and no formula seen nests deeper than 30.
const DEPTH_LIMIT: usize = 200;

/// The graph of a formula and its value.
pub(crate) fn parse(
    text: &str,
    parameters: &BTreeMap<String, f64>,
) -> Result<(Dag, NodeId), FormulaError> {
    let mut parser = Parser {
        text,
        tokens: lexer::tokens(text)?,
        at: 0,
        depth: 0,
        names: BTreeMap::new(),
        dag: Dag::default(),
    };
    parser.declare(parameters)?;
    let root = parser.formula()?;
    Ok((parser.dag, root))
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<Token>,
    at: usize,
    depth: usize,
    /// Parameters and definitions.
    names: BTreeMap<&'a str, NodeId>,
    dag: Dag,
}

impl<'a> Parser<'a> {
    fn declare(&mut self, parameters: &'a BTreeMap<String, f64>) -> Result<(), FormulaError> {
        for (name, &value) in parameters {
            let refuse = |kind| Err(FormulaError::new(kind, self.text, 0..0));
            if !lexer::is_name(name) {
                return refuse(Kind::ParameterName { name: name.clone() });
            }
            if functions::is_reserved(name) {
                return refuse(Kind::ParameterReserved { name: name.clone() });
            }
            if !value.is_finite() {
                return refuse(Kind::ParameterValue { name: name.clone(), value });
            }
            let id = self.dag.constant(value);
            self.names.insert(name, id);
        }
        Ok(())
    }

    fn formula(&mut self) -> Result<NodeId, FormulaError> {
        let mut value = None;
        loop {
            self.skip_separators();
            let start = self.span().start;
            if self.kind() == TokenKind::End {
                break;
            }
            if let Some((_, span)) = value {
                return Err(self.error(Kind::ValueNotLast, span));
            }
            if self.kind() == TokenKind::Name && self.kind_at(self.at + 1) == TokenKind::Equals {
                self.definition()?;
            } else {
                value = Some((self.sum()?, start..self.tokens[self.at - 1].span.end));
            }
            self.end_of_line()?;
        }
        let defined = self.tokens.iter().any(|token| token.kind == TokenKind::Equals);
        let missing = if defined { Kind::NoValue } else { Kind::Empty };
        value.map(|(id, _)| id).ok_or_else(|| self.error(missing, self.span()))
    }

    fn definition(&mut self) -> Result<(), FormulaError> {
        let span = self.span();
        let name = &self.text[span.clone()];
        if functions::is_reserved(name) {
            return Err(self.error(Kind::Reserved { name: name.into() }, span));
        }
        if self.names.contains_key(name) {
            return Err(self.error(Kind::DefinedTwice { name: name.into() }, span));
        }
        self.at += 2;
        let value = self.sum()?;
        self.names.insert(name, value);
        Ok(())
    }

    fn end_of_line(&self) -> Result<(), FormulaError> {
        match self.kind() {
            TokenKind::Separator | TokenKind::End => Ok(()),
            TokenKind::Close => Err(self.error(Kind::Unopened, self.span())),
            TokenKind::Comma => Err(self.error(Kind::StrayComma, self.span())),
            _ => Err(self.expected_operator()),
        }
    }

    fn sum(&mut self) -> Result<NodeId, FormulaError> {
        let mut total = self.product()?;
        loop {
            let op = match self.kind() {
                TokenKind::Plus => BinaryOp::Add,
                TokenKind::Minus => BinaryOp::Sub,
                _ => return Ok(total),
            };
            self.at += 1;
            let term = self.product()?;
            total = self.dag.binary(op, total, term);
        }
    }

    fn product(&mut self) -> Result<NodeId, FormulaError> {
        let mut total = self.signed()?;
        loop {
            let op = match self.kind() {
                TokenKind::Star => BinaryOp::Mul,
                TokenKind::Slash => BinaryOp::Div,
                _ => return Ok(total),
            };
            self.at += 1;
            let factor = self.signed()?;
            total = self.dag.binary(op, total, factor);
        }
    }

    fn signed(&mut self) -> Result<NodeId, FormulaError> {
        let mut negative = false;
        loop {
            self.continue_line();
            match self.kind() {
                TokenKind::Minus => negative = !negative,
                TokenKind::Plus => {}
                _ => break,
            }
            self.at += 1;
        }
        let value = self.power()?;
        Ok(if negative { self.dag.unary(UnaryOp::Neg, value) } else { value })
    }

    fn power(&mut self) -> Result<NodeId, FormulaError> {
        let base = self.primary()?;
        if self.kind() != TokenKind::Caret {
            return Ok(base);
        }
        self.deeper()?;
        self.at += 1;
        let exponent = self.signed()?;
        self.depth -= 1;
        Ok(self.dag.binary(BinaryOp::Pow, base, exponent))
    }

    fn primary(&mut self) -> Result<NodeId, FormulaError> {
        match self.kind() {
            TokenKind::Number(value) => {
                self.at += 1;
                Ok(self.dag.constant(value))
            }
            TokenKind::Name if self.kind_at(self.at + 1) == TokenKind::Open => self.call(),
            TokenKind::Name => self.name(),
            TokenKind::Open => {
                let values = self.parenthesis(1)?;
                Ok(values[0])
            }
            _ => {
                let kind = Kind::ExpectedValue { found: self.found() };
                Err(self.error(kind, self.span()))
            }
        }
    }

    /// `(` up to `most` values `)`.
    fn parenthesis(&mut self, most: usize) -> Result<Vec<NodeId>, FormulaError> {
        let opening = self.span();
        self.deeper()?;
        self.at += 1;
        let mut values = Vec::new();
        loop {
            if self.kind() == TokenKind::End {
                return Err(self.error(Kind::Unclosed, opening));
            }
            values.push(self.sum()?);
            match self.kind() {
                TokenKind::Comma if values.len() < most => self.at += 1,
                TokenKind::Comma => return Err(self.error(Kind::StrayComma, self.span())),
                TokenKind::Close => break,
                TokenKind::End => return Err(self.error(Kind::Unclosed, opening)),
                _ if self.begins_line() => return Err(self.error(Kind::Unclosed, opening)),
                _ => return Err(self.expected_operator()),
            }
        }
        self.at += 1;
        self.depth -= 1;
        Ok(values)
    }

    /// Whether a line break stands before the token.
    fn begins_line(&self) -> bool {
        let before = self.tokens[self.at - 1].span.end;
        self.text[before..self.span().start].contains('\n')
    }

    fn name(&mut self) -> Result<NodeId, FormulaError> {
        let span = self.span();
        let name = &self.text[span.clone()];
        self.at += 1;
        if let Some(axis) = functions::VARIABLES.iter().position(|variable| *variable == name) {
            return Ok(self.dag.variable(axis as u8));
        }
        if let Some((_, value)) = functions::CONSTANTS.iter().find(|(known, _)| *known == name) {
            return Ok(self.dag.constant(*value));
        }
        if let Some(id) = self.names.get(name) {
            return Ok(*id);
        }
        let kind = match functions::function(name) {
            Some(function) => Kind::NoArguments { name: function.name },
            None if name == "log" => Kind::AmbiguousLog,
            None => Kind::UnknownName { name: name.into(), nearest: self.nearest_name(name) },
        };
        Err(self.error(kind, span))
    }

    fn nearest_name(&self, name: &str) -> Option<String> {
        let variables = functions::VARIABLES.iter().copied();
        let constants = functions::CONSTANTS.iter().map(|(name, _)| *name);
        nearest(name, self.names.keys().copied().chain(variables).chain(constants))
    }

    fn call(&mut self) -> Result<NodeId, FormulaError> {
        let span = self.span();
        let name = &self.text[span.clone()];
        let Some(function) = functions::function(name) else {
            let names = functions::FUNCTIONS.iter().map(|function| function.name);
            let known = self.names.contains_key(name) || functions::is_reserved(name);
            let kind = match name {
                "log" => Kind::AmbiguousLog,
                _ if known => Kind::NotAFunction { name: name.into() },
                _ => Kind::UnknownFunction { name: name.into(), nearest: nearest(name, names) },
            };
            return Err(self.error(kind, span));
        };
        self.at += 1;
        let arguments = if self.kind_at(self.at + 1) == TokenKind::Close {
            self.at += 2;
            Vec::new()
        } else {
            self.parenthesis(usize::MAX)?
        };
        let span = span.start..self.tokens[self.at - 1].span.end;
        let Function { name, least, most, .. } = *function;
        if arguments.len() < least || arguments.len() > most {
            let kind = Kind::ArgumentCount { name, least, most, found: arguments.len() };
            return Err(self.error(kind, span));
        }
        self.blend_width(function, &arguments, &span)?;
        Ok(apply(&mut self.dag, function.rule, &arguments))
    }

    fn blend_width(
        &self,
        function: &Function,
        arguments: &[NodeId],
        span: &Range<usize>,
    ) -> Result<(), FormulaError> {
        if !matches!(function.rule, Rule::Smin | Rule::Smax) {
            return Ok(());
        }
        match self.dag.value_of(arguments[2]) {
            Some(width) if width.is_nan() || width <= 0.0 => {
                Err(self.error(Kind::BlendWidth { width }, span.clone()))
            }
            _ => Ok(()),
        }
    }

    fn deeper(&mut self) -> Result<(), FormulaError> {
        self.depth += 1;
        if self.depth > DEPTH_LIMIT {
            return Err(self.error(Kind::TooDeep { limit: DEPTH_LIMIT }, self.span()));
        }
        Ok(())
    }

    fn skip_separators(&mut self) {
        while self.kind() == TokenKind::Separator {
            self.at += 1;
        }
    }

    /// Where a value must follow, a line break does not end the line; `;` does.
    fn continue_line(&mut self) {
        while self.kind() == TokenKind::Separator && self.text[self.span()].starts_with('\n') {
            self.at += 1;
        }
    }

    fn kind(&self) -> TokenKind {
        self.tokens[self.at].kind
    }

    fn kind_at(&self, at: usize) -> TokenKind {
        self.tokens.get(at).map_or(TokenKind::End, |token| token.kind)
    }

    fn span(&self) -> Range<usize> {
        self.tokens[self.at].span.clone()
    }

    fn found(&self) -> String {
        match self.kind() {
            TokenKind::End => "the end of the formula".into(),
            TokenKind::Separator => "the end of the line".into(),
            _ => format!("`{}`", &self.text[self.span()]),
        }
    }

    fn expected_operator(&self) -> FormulaError {
        self.error(Kind::ExpectedOperator { found: self.found() }, self.span())
    }

    fn error(&self, kind: Kind, span: Range<usize>) -> FormulaError {
        FormulaError::new(kind, self.text, span)
    }
}

/// The known name that differs least, if it differs by less than half.
fn nearest<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> Option<String> {
    let allowed = (name.len() / 2).min(2);
    known
        .map(|candidate| {
            let same = candidate.eq_ignore_ascii_case(name);
            let distance = if same { 0 } else { strsim::damerau_levenshtein(name, candidate) };
            (distance, candidate)
        })
        .filter(|(distance, _)| *distance <= allowed)
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

fn apply(dag: &mut Dag, rule: Rule, arguments: &[NodeId]) -> NodeId {
    match (rule, arguments) {
        (Rule::Unary(op), &[a]) => dag.unary(op, a),
        (Rule::Binary(op), &[a, b]) => dag.binary(op, a, b),
        (Rule::Chain(op), &[first, ref rest @ ..]) => {
            rest.iter().fold(first, |total, &next| dag.binary(op, total, next))
        }
        (Rule::Hypot, &[first, ref rest @ ..]) => {
            let square = dag.power(first, 2);
            let sum = rest.iter().fold(square, |total, &next| {
                let square = dag.power(next, 2);
                dag.binary(BinaryOp::Add, total, square)
            });
            dag.unary(UnaryOp::Sqrt, sum)
        }
        (Rule::Mod, &[a, b]) => {
            let quotient = dag.binary(BinaryOp::Div, a, b);
            let turns = dag.unary(UnaryOp::Floor, quotient);
            let whole = dag.binary(BinaryOp::Mul, b, turns);
            dag.binary(BinaryOp::Sub, a, whole)
        }
        (Rule::Clamp, &[x, lo, hi]) => clamp(dag, x, lo, hi),
        (Rule::Smoothstep, &[e0, e1, x]) => smoothstep(dag, e0, e1, x),
        (Rule::Smin, &[a, b, k]) => dag.blend(a, b, k),
        (Rule::Smax, &[a, b, k]) => {
            let [a, b] = [a, b].map(|argument| dag.unary(UnaryOp::Neg, argument));
            let smallest = dag.blend(a, b, k);
            dag.unary(UnaryOp::Neg, smallest)
        }
        _ => unreachable!("invariant: the number of arguments is checked"),
    }
}

fn clamp(dag: &mut Dag, x: NodeId, lo: NodeId, hi: NodeId) -> NodeId {
    let raised = dag.binary(BinaryOp::Max, x, lo);
    dag.binary(BinaryOp::Min, raised, hi)
}

/// `t^2 (3 - 2t)`, `t = clamp((x - e0)/(e1 - e0), 0, 1)`.
fn smoothstep(dag: &mut Dag, e0: NodeId, e1: NodeId, x: NodeId) -> NodeId {
    let (from, length) = (dag.binary(BinaryOp::Sub, x, e0), dag.binary(BinaryOp::Sub, e1, e0));
    let ratio = dag.binary(BinaryOp::Div, from, length);
    let [zero, one, two, three] = [0.0, 1.0, 2.0, 3.0].map(|value| dag.constant(value));
    let t = clamp(dag, ratio, zero, one);
    let square = dag.power(t, 2);
    let double = dag.binary(BinaryOp::Mul, two, t);
    let rest = dag.binary(BinaryOp::Sub, three, double);
    dag.binary(BinaryOp::Mul, square, rest)
}
