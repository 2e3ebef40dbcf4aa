//! Numbers of a message as a person reads them: six digits.

/// Digits after the first.
const DIGITS: usize = 5;

/// The text with its long decimal numbers rounded to six digits; those of names and files stay.
pub(crate) fn rounded(text: &str) -> String {
    let is_end = |c: char| c.is_whitespace() || "()[],;:".contains(c);
    let mut out = String::with_capacity(text.len());
    for piece in text.split_inclusive(is_end) {
        let word = piece.trim_end_matches(is_end);
        match short(word) {
            Some(short) => out.push_str(&short),
            None => out.push_str(word),
        }
        out.push_str(&piece[word.len()..]);
    }
    out
}

/// The number in fewer characters, if the word is one of many digits.
fn short(word: &str) -> Option<String> {
    let is_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let n_digits = word.chars().filter(char::is_ascii_digit).count();
    if n_digits <= DIGITS + 1 || !word.contains('.') || !word.chars().all(is_number) {
        return None;
    }
    let value: f64 = word.parse().ok().filter(|x: &f64| x.is_finite())?;
    let value: f64 = format!("{value:.DIGITS$e}").parse().ok()?;
    // Debug writes very large and very small numbers with an exponent.
    let text = format!("{value:?}");
    Some(text.strip_suffix(".0").map_or(text.clone(), str::to_owned))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_have_six_digits_at_most() {
        let text =
            "singular at (-3.5428235364042795, 2.585437479080506e-96, -0.0043307814109347): f";
        assert_eq!(rounded(text), "singular at (-3.54282, 2.58544e-96, -0.00433078): f");
        let tiny = format!("at [0.{}12345678, 1.00000000001]", "0".repeat(30));
        assert_eq!(rounded(&tiny), "at [1.23457e-31, 1]");
    }

    #[test]
    fn whole_numbers_names_and_short_numbers_stay() {
        for text in
            ["100000000 faces", "file a1.23456789.toml", "0.25 and -1.5e-3", "1.2.3.4.5.6.7.8"]
        {
            assert_eq!(rounded(text), text);
        }
    }
}
