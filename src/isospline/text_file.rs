//! Texts that users name, with an end to what is read.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Most bytes of a text: ten times a formula of a million terms. What goes on beyond it, such as
/// `/dev/zero`, would take all memory before it is found to be no text.
const MOST_BYTES: u64 = 200_000_000;

/// The text of a file.
///
/// # Errors
/// What the system says; a text that is too long or not in UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(io::Error::new(
            ErrorKind::FileTooLarge,
            format!("it is longer than {} MB", MOST_BYTES / 1_000_000),
        ));
    }
    String::from_utf8(bytes)
        .map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is not text in UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_artifact::{Durability, write_file_atomic};

    #[test]
    fn a_file_without_end_or_of_other_bytes_is_refused_with_the_reason() {
        let endless = read_text(Path::new("/dev/zero")).unwrap_err();
        assert_eq!(endless.to_string(), "it is longer than 200 MB");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        let write = |bytes: &'static [u8]| {
            write_file_atomic(&path, Durability::Fast, |file| file.write_all(bytes)).unwrap();
        };
        write(b"a\xff");
        assert_eq!(read_text(&path).unwrap_err().to_string(), "it is not text in UTF-8");
        write(b"ab\n");
        assert_eq!(read_text(&path).unwrap(), "ab\n");
    }
}
