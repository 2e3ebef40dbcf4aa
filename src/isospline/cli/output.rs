//! Standard output and standard error, closed pipes included.

use crate::cli::failure::Failure;
use std::io::{self, ErrorKind, Write};

/// Writes a line to standard output; a reader that has gone away is no error.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::io(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error, where progress and warnings go; failures are ignored.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// A time in the unit that keeps three digits.
pub(crate) fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() => "-".to_owned(),
        s if s >= 100.0 => format!("{s:.0} s"),
        s if s >= 1.0 => format!("{s:.2} s"),
        s if s >= 0.1 => format!("{:.0} ms", 1e3 * s),
        s => format!("{:.1} ms", 1e3 * s),
    }
}

/// A size in the unit that keeps three digits.
pub(crate) fn size(bytes: u64) -> String {
    match bytes as f64 {
        b if b >= 1e9 => format!("{:.2} GB", b / 1e9),
        b if b >= 1e6 => format!("{:.2} MB", b / 1e6),
        b if b >= 1e3 => format!("{:.1} kB", b / 1e3),
        b => format!("{b} B"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sizes_keep_three_digits() {
        let times = [0.00123, 0.0456, 0.789, 12.345, 678.9].map(duration);
        assert_eq!(times, ["1.2 ms", "45.6 ms", "789 ms", "12.35 s", "679 s"]);
        assert_eq!([12, 4_567, 8_912_345].map(size), ["12 B", "4.6 kB", "8.91 MB"]);
    }
}
