//! The part of a text that a message points into, cut to what a terminal can show.

use miette::{LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use std::ops::Range;

/// Lines up to this many bytes are shown whole; the printer cannot count columns beyond 65 535.
const LONGEST_LINE: usize = 160;

/// Bytes shown on each side of a place in a longer line.
const REACH: usize = 40;

/// A text, or a piece of one of its lines that knows where it stood.
#[derive(Debug)]
pub(crate) struct Excerpt {
    name: String,
    text: String,
    /// Line and column of the first byte, from 0.
    line: usize,
    column: usize,
}

impl Excerpt {
    /// What is shown of `text` for the bytes `range`, and the label within it.
    pub(crate) fn new(name: &str, text: &str, range: Range<usize>) -> (Self, LabeledSpan) {
        let name = name.to_owned();
        if text.split('\n').all(|line| line.len() <= LONGEST_LINE) {
            let whole = Self { name, text: text.to_owned(), line: 0, column: 0 };
            return (whole, LabeledSpan::at(range, "here"));
        }
        let start = floor(text, range.start);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let first = floor(text, start.saturating_sub(REACH).max(line_start));
        let last = floor(text, (start + REACH).min(line_end));
        let end = floor(text, range.end).clamp(start, last);
        let excerpt = Self {
            name,
            text: text[first..last].to_owned(),
            line: text[..first].matches('\n').count(),
            column: first - line_start,
        };
        (excerpt, LabeledSpan::at(start - first..end - first, "here"))
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let inner = self.text.read_span(span, before, after)?;
        let column = if inner.line() == 0 { self.column } else { 0 } + inner.column();
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            inner.data(),
            *inner.span(),
            self.line + inner.line(),
            column,
            inner.line_count(),
        )))
    }
}

/// The last boundary of characters at or before `at`.
fn floor(text: &str, at: usize) -> usize {
    let at = at.min(text.len());
    (0..=at).rev().find(|&k| text.is_char_boundary(k)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_are_cut_around_the_place_and_short_ones_are_not() {
        let long = format!("first\n{}ä?b{}\nlast", "é".repeat(200), "c".repeat(200_000));
        let at = long.find('?').unwrap();
        let (excerpt, label) = Excerpt::new("a", &long, at..at + 150_000);
        assert!(excerpt.text.len() <= 2 * REACH + 4, "{}", excerpt.text);
        assert!(excerpt.text[label.offset()..].starts_with("?b"));
        assert!(label.offset() + label.len() <= excerpt.text.len());
        assert_eq!((excerpt.line, excerpt.column + label.offset()), (1, at - "first\n".len()));
        let (whole, label) = Excerpt::new("a", "x + (y\n", 4..5);
        assert_eq!((whole.text.as_str(), label.offset()), ("x + (y\n", 4));
    }
}
