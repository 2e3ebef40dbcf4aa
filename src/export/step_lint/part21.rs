//! The syntax of ISO 10303-21, as far as it occurs: statements, entities, arguments.

use super::StepDefect;

/// An instance of the data section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entity<'a> {
    pub(super) number: u64,
    /// Its kind; empty for a complex entity.
    pub(super) kind: &'a str,
    /// What stands between its parentheses.
    pub(super) arguments: &'a str,
}

/// An argument.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value<'a> {
    Reference(u64),
    Number(f64),
    Flag(bool),
    List(Vec<Value<'a>>),
    /// A kind with arguments of its own, such as `LENGTH_MEASURE(1.)`.
    Typed(&'a str, Vec<Value<'a>>),
    /// A string, enumeration, `$` or `*`.
    Other(&'a str),
}

/// All entities of the data section, in the order of the file.
pub(super) fn parse(text: &str) -> Result<Vec<Entity<'_>>, StepDefect> {
    let statements: Vec<&str> = Statements { rest: text }.collect();
    if statements.first() != Some(&"ISO-10303-21") {
        return Err(StepDefect::Frame("ISO-10303-21 at the start"));
    }
    if statements.last() != Some(&"END-ISO-10303-21") {
        return Err(StepDefect::Frame("END-ISO-10303-21 at the end"));
    }
    if !statements.iter().any(|s| s.starts_with("FILE_SCHEMA")) {
        return Err(StepDefect::Frame("FILE_SCHEMA"));
    }
    let start = statements.iter().position(|s| *s == "DATA");
    let start = start.ok_or(StepDefect::Frame("DATA"))? + 1;
    let length = statements[start..].iter().position(|s| *s == "ENDSEC");
    let length = length.ok_or(StepDefect::Frame("ENDSEC after DATA"))?;
    let data = statements[start..start + length].iter();
    data.map(|&s| entity(s).ok_or_else(|| unreadable(s))).collect()
}

/// The arguments of an entity or of a part of one.
pub(super) fn arguments(text: &str) -> Option<Vec<Value<'_>>> {
    let mut cursor = Cursor { rest: text };
    let values = cursor.values(0)?;
    cursor.blank();
    cursor.rest.is_empty().then_some(values)
}

/// The parts of a complex entity: kind and what stands between the parentheses.
pub(super) fn parts(text: &str) -> Option<Vec<(&str, &str)>> {
    let mut rest = text.trim();
    let mut parts = Vec::new();
    while !rest.is_empty() {
        let open = rest.find('(')?;
        let close = open + closing(&rest[open..])?;
        parts.push((rest[..open].trim(), &rest[open + 1..close]));
        rest = rest[close + 1..].trim_start();
    }
    Some(parts)
}

/// Numbers of all entities that a text of arguments names.
pub(super) fn references(text: &str) -> impl Iterator<Item = u64> {
    let mut in_string = false;
    text.char_indices().filter_map(move |(at, c)| {
        in_string ^= c == '\'';
        let digits = (c == '#' && !in_string).then(|| &text[at + 1..])?;
        let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        digits[..end].parse().ok()
    })
}

/// Characters of a statement that a message shows.
const SHOWN: usize = 60;

fn unreadable(statement: &str) -> StepDefect {
    StepDefect::Syntax(statement.chars().take(SHOWN).collect())
}

/// Statements without the semicolons that end them.
struct Statements<'a> {
    rest: &'a str,
}

impl<'a> Iterator for Statements<'a> {
    type Item = &'a str;

    fn next(&mut self) -> Option<&'a str> {
        let rest = self.rest.trim_start();
        if rest.is_empty() {
            return None;
        }
        let mut in_string = false;
        let end = rest.bytes().position(|c| {
            in_string ^= c == b'\'';
            c == b';' && !in_string
        });
        // What no semicolon ends is a statement that nobody knows.
        let end = end.unwrap_or(rest.len());
        self.rest = rest.get(end + 1..).unwrap_or("");
        Some(rest[..end].trim_end())
    }
}

fn entity(statement: &str) -> Option<Entity<'_>> {
    let (number, body) = statement.strip_prefix('#')?.split_once('=')?;
    let (number, body) = (number.trim().parse().ok()?, body.trim());
    let open = body.find('(')?;
    if open + closing(&body[open..])? + 1 != body.len() {
        return None;
    }
    let (kind, arguments) = (body[..open].trim(), &body[open + 1..body.len() - 1]);
    let is_word = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
    kind.chars().all(is_word).then_some(Entity { number, kind, arguments })
}

/// Where the parenthesis closes that a text begins with.
fn closing(text: &str) -> Option<usize> {
    let (mut depth, mut in_string) = (0_usize, false);
    text.bytes().position(|c| {
        in_string ^= c == b'\'';
        match c {
            b'(' if !in_string => depth += 1,
            b')' if !in_string => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth == 0
    })
}

/// Lists deeper than this stand in no file that is written here.
const DEEPEST: usize = 8;

struct Cursor<'a> {
    rest: &'a str,
}

impl<'a> Cursor<'a> {
    fn blank(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn take(&mut self, c: char) -> Option<()> {
        self.rest = self.rest.strip_prefix(c)?;
        Some(())
    }

    /// Values between commas, to the end or a closing parenthesis, which stays.
    fn values(&mut self, depth: usize) -> Option<Vec<Value<'a>>> {
        let mut values = Vec::new();
        self.blank();
        if depth > DEEPEST || self.rest.is_empty() || self.rest.starts_with(')') {
            return (depth <= DEEPEST).then_some(values);
        }
        loop {
            values.push(self.value(depth)?);
            self.blank();
            if self.take(',').is_none() {
                return Some(values);
            }
        }
    }

    fn value(&mut self, depth: usize) -> Option<Value<'a>> {
        self.blank();
        match self.rest.chars().next()? {
            '(' => self.list(depth).map(Value::List),
            '\'' => self.string(),
            '$' | '*' => Some(Value::Other(self.cut(1))),
            '#' => {
                self.cut_while(1, |c| c.is_ascii_digit())[1..].parse().ok().map(Value::Reference)
            }
            '.' => {
                let word = self.cut_while(1, |c| c != '.');
                self.take('.')?;
                Some(match word {
                    ".T" => Value::Flag(true),
                    ".F" => Value::Flag(false),
                    _ => Value::Other(word),
                })
            }
            'A'..='Z' => {
                let kind = self.cut_while(1, |c| c.is_ascii_alphanumeric() || c == '_');
                self.list(depth).map(|inner| Value::Typed(kind, inner))
            }
            _ => self.number(),
        }
    }

    fn list(&mut self, depth: usize) -> Option<Vec<Value<'a>>> {
        self.take('(')?;
        let values = self.values(depth + 1)?;
        self.take(')')?;
        Some(values)
    }

    /// A string with its quotes; doubled ones inside do not end it.
    fn string(&mut self) -> Option<Value<'a>> {
        let (mut at, bytes) = (1, self.rest.as_bytes());
        loop {
            at += bytes[at..].iter().position(|&c| c == b'\'')? + 1;
            if bytes.get(at) != Some(&b'\'') {
                return Some(Value::Other(self.cut(at)));
            }
            at += 1;
        }
    }

    /// A number as the standard has it; Rust alone would take `inf` too.
    fn number(&mut self) -> Option<Value<'a>> {
        let text = self.cut_while(0, |c| c.is_ascii_digit() || "+-.E".contains(c));
        let has_point = !text.contains('E') || text.contains('.');
        text.parse().ok().filter(|x: &f64| x.is_finite() && has_point).map(Value::Number)
    }

    fn cut(&mut self, n: usize) -> &'a str {
        let (word, rest) = self.rest.split_at(n);
        self.rest = rest;
        word
    }

    /// The first `from` characters and those after them that belong.
    fn cut_while(&mut self, from: usize, belongs: impl Fn(char) -> bool) -> &'a str {
        let end = self.rest[from..].find(|c| !belongs(c)).map_or(self.rest.len(), |n| from + n);
        self.cut(end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_argument_is_read() {
        let found = arguments("'it''s; #9', #12,(1.,-2.5E-9) ,.T.,.F.,.METRE.,$,*,LENGTH(3),()");
        let number = |x| Value::Number(x);
        let expected = vec![
            Value::Other("'it''s; #9'"),
            Value::Reference(12),
            Value::List(vec![number(1.0), number(-2.5e-9)]),
            Value::Flag(true),
            Value::Flag(false),
            Value::Other(".METRE"),
            Value::Other("$"),
            Value::Other("*"),
            Value::Typed("LENGTH", vec![number(3.0)]),
            Value::List(vec![]),
        ];
        assert_eq!(found, Some(expected));
    }

    #[test]
    fn what_is_no_argument_is_refused() {
        for bad in
            ["1,", "nan", "inf", "1E5", "(1,2", "1)", "#x", ".T", "'open", "((((((((((1))))))))))"]
        {
            assert_eq!(arguments(bad), None, "{bad}");
        }
    }

    #[test]
    fn strings_hide_what_stands_in_them() {
        let text = "ISO-10303-21;\nFILE_SCHEMA(('A'));DATA;#1=A('x;)#7',#2);\n#2=(B()C(#1));\nENDSEC;\nEND-ISO-10303-21;\n";
        let entities = parse(text).unwrap();
        assert_eq!((entities[0].kind, entities[0].arguments), ("A", "'x;)#7',#2"));
        assert!(references(entities[0].arguments).eq([2]));
        assert_eq!(parts(entities[1].arguments), Some(vec![("B", ""), ("C", "#1")]));
    }
}
