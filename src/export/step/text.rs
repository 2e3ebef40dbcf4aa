//! The text of a STEP file: numbered entities, numbers, strings (ISO 10303-21).

use crate::ExportError;
use std::fmt;
use std::io::Write;

/// Writes entities and numbers them from 1 on.
pub(super) struct Entities<'w> {
    out: &'w mut dyn Write,
    next: u64,
}

impl<'w> Entities<'w> {
    pub(super) fn new(out: &'w mut dyn Write) -> Self {
        Self { out, next: 1 }
    }

    /// The number that the next entity will have.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// Writes an entity and gives its number.
    pub(super) fn add(&mut self, entity: fmt::Arguments<'_>) -> Result<u64, ExportError> {
        writeln!(self.out, "#{}={entity};", self.next)?;
        self.next += 1;
        Ok(self.next - 1)
    }
}

/// A real number with the fewest digits that give back every bit.
pub(super) struct Real(pub(super) f64);

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Rust writes 1.5, 1e-7 and 1.5e-7; the standard wants a point in the mantissa.
        let text = format!("{:?}", self.0);
        match text.split_once('e') {
            None => f.write_str(&text),
            Some((mantissa, exponent)) => {
                let point = if mantissa.contains('.') { "" } else { "." };
                write!(f, "{mantissa}{point}E{exponent}")
            }
        }
    }
}

/// A list of references, `#1,#2`.
pub(super) struct References<I>(pub(super) I);

impl<I: Iterator<Item = u64> + Clone> fmt::Display for References<I> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        self.0.clone().try_for_each(|id| {
            let written = write!(f, "{separator}#{id}");
            separator = ",";
            written
        })
    }
}

/// A string with its quotes: those inside doubled, others than printable ASCII as UTF-16.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        match c {
            '\'' => out.push_str("''"),
            '\\' => out.push_str("\\\\"),
            ' '..='~' => out.push(c),
            _ => {
                out.push_str("\\X2\\");
                let mut units = [0; 2];
                let units = c.encode_utf16(&mut units).iter();
                out.extend(units.map(|u| format!("{u:04X}")));
                out.push_str("\\X0\\");
            }
        }
    }
    out.push('\'');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_all_their_bits() {
        for (x, text) in [
            (1.0, "1.0"),
            (-0.1, "-0.1"),
            (1e-7, "1.E-7"),
            (-2.5e-9, "-2.5E-9"),
            (1e300, "1.E300"),
            (0.0, "0.0"),
        ] {
            assert_eq!(Real(x).to_string(), text);
        }
    }

    #[test]
    fn strings_are_ascii() {
        assert_eq!(quoted("it's a \\ café"), r"'it''s a \\ caf\X2\00E9\X0\'");
        assert_eq!(quoted("𝄞\n"), r"'\X2\D834DD1E\X0\\X2\000A\X0\'");
    }

    #[test]
    fn entities_are_numbered_from_one() {
        let mut out = Vec::new();
        let mut entities = Entities::new(&mut out);
        let first = entities.add(format_args!("A()")).unwrap();
        entities.add(format_args!("B({})", References([first, first].into_iter()))).unwrap();
        assert_eq!(entities.next(), 3);
        assert_eq!(out, b"#1=A();\n#2=B(#1,#1);\n");
    }
}
