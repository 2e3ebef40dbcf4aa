//! From text to tokens.

use crate::formula_error::{FormulaError, FormulaErrorKind};
use std::ops::Range;

/// A token and the bytes it comes from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Token {
    pub(crate) kind: TokenKind,
    pub(crate) span: Range<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TokenKind {
    Number(f64),
    Name,
    Plus,
    Minus,
    Star,
    Slash,
    Caret,
    Open,
    Close,
    Comma,
    Equals,
    /// A line break or `;`.
    Separator,
    End,
}

/// All tokens of `text`, an `End` last. A byte order mark at the start, spaces, carriage returns
/// and comments from `#` to the end of the line are skipped, and so are line breaks inside
/// parentheses.
pub(crate) fn tokens(text: &str) -> Result<Vec<Token>, FormulaError> {
    let mut tokens = Vec::new();
    let mut n_open = 0_usize;
    let mut at = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    while let Some(character) = text[at..].chars().next() {
        let start = at;
        let kind = match character {
            ' ' | '\t' | '\r' => None,
            '\n' if n_open > 0 => None,
            '#' => {
                at += text[at..].find('\n').unwrap_or(text.len() - at);
                continue;
            }
            '0'..='9' | '.' => {
                at += number_length(&text.as_bytes()[at..]);
                let kind = TokenKind::Number(number(text, start..at)?);
                tokens.push(Token { kind, span: start..at });
                continue;
            }
            'a'..='z' | 'A'..='Z' | '_' => {
                at += text[at..].bytes().take_while(|&b| is_name_byte(b)).count();
                tokens.push(Token { kind: TokenKind::Name, span: start..at });
                continue;
            }
            _ => Some(symbol(character).ok_or_else(|| {
                let kind = FormulaErrorKind::UnexpectedCharacter { character };
                FormulaError::new(kind, text, at..at + character.len_utf8())
            })?),
        };
        at += character.len_utf8();
        match kind {
            Some(TokenKind::Open) => n_open += 1,
            Some(TokenKind::Close) => n_open = n_open.saturating_sub(1),
            _ => {}
        }
        tokens.extend(kind.map(|kind| Token { kind, span: start..at }));
    }
    tokens.push(Token { kind: TokenKind::End, span: text.len()..text.len() });
    Ok(tokens)
}

/// Whether `text` is a name: a letter or `_`, then letters, digits or `_`.
pub(crate) fn is_name(text: &str) -> bool {
    text.bytes().all(is_name_byte) && text.bytes().next().is_some_and(|b| !b.is_ascii_digit())
}

fn is_name_byte(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

fn symbol(character: char) -> Option<TokenKind> {
    Some(match character {
        '+' => TokenKind::Plus,
        '-' => TokenKind::Minus,
        '*' => TokenKind::Star,
        '/' => TokenKind::Slash,
        '^' => TokenKind::Caret,
        '(' => TokenKind::Open,
        ')' => TokenKind::Close,
        ',' => TokenKind::Comma,
        '=' => TokenKind::Equals,
        '\n' | ';' => TokenKind::Separator,
        _ => return None,
    })
}

/// Digits, points and an exponent. A second point is taken in, to be refused as one number.
fn number_length(bytes: &[u8]) -> usize {
    let digits = |from: usize, point: bool| {
        bytes[from..].iter().take_while(|b| b.is_ascii_digit() || (point && **b == b'.')).count()
    };
    let mantissa = digits(0, true);
    if !matches!(bytes.get(mantissa), Some(b'e' | b'E')) {
        return mantissa;
    }
    let signed = usize::from(matches!(bytes.get(mantissa + 1), Some(b'+' | b'-')));
    match digits((mantissa + 1 + signed).min(bytes.len()), false) {
        0 => mantissa,
        exponent => mantissa + 1 + signed + exponent,
    }
}

fn number(text: &str, span: Range<usize>) -> Result<f64, FormulaError> {
    match text[span.clone()].parse() {
        Ok(value) if f64::is_finite(value) => Ok(value),
        _ => {
            let kind = FormulaErrorKind::BadNumber { text: text[span.clone()].into() };
            Err(FormulaError::new(kind, text, span))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<TokenKind> {
        tokens(text).unwrap().into_iter().map(|token| token.kind).collect()
    }

    #[test]
    fn comments_spaces_and_byte_order_marks_leave_no_token() {
        let expected = [TokenKind::Name, TokenKind::Separator, TokenKind::Name, TokenKind::End];
        assert_eq!(kinds("\u{feff} x # all * of = this\r\n\ty "), expected);
    }

    #[test]
    fn numbers_take_exponents_only_where_digits_follow() {
        assert_eq!(kinds("1.5e-3")[0], TokenKind::Number(1.5e-3));
        assert_eq!(kinds(".5")[0], TokenKind::Number(0.5));
        assert_eq!(kinds("2e"), [TokenKind::Number(2.0), TokenKind::Name, TokenKind::End]);
        for bad in ["1.2.3", "1e999", "."] {
            let error = tokens(bad).unwrap_err();
            assert_eq!(error.kind, FormulaErrorKind::BadNumber { text: bad.into() });
        }
    }
}
