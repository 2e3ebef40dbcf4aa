//! Keys: 32-byte BLAKE3 hashes, written as hexadecimal text outside the container.

use crate::Section;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use std::fmt;

/// A hash of what an artifact is made of, or of what it holds.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key(pub [u8; 32]);

/// Collects fields for a key; every field is preceded by its length, so no two lists of fields
/// give the same stream.
#[derive(Clone, Debug, Default)]
pub struct KeyHasher(blake3::Hasher);

/// The key of an artifact's rows: names, row sizes and bytes of its sections, no header.
///
/// Equal content keys mean equal bytes, whichever stage made them from whatever.
pub fn content_key<'a>(sections: impl IntoIterator<Item = (&'a str, Section<'a>)>) -> Key {
    let mut hasher = KeyHasher::new("isospline content");
    for (name, section) in sections {
        hasher.field(name.as_bytes());
        hasher.number(section.stride as u64);
        hasher.field(section.bytes);
    }
    hasher.finish()
}

impl KeyHasher {
    /// A hasher for one purpose; equal fields under another purpose give another key.
    pub fn new(purpose: &str) -> Self {
        let mut hasher = Self::default();
        hasher.field(purpose.as_bytes());
        hasher
    }

    /// Adds a field.
    pub fn field(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.update(bytes);
    }

    /// Adds a number.
    pub fn number(&mut self, value: u64) {
        self.0.update(&value.to_le_bytes());
    }

    /// The key of all fields so far.
    pub fn finish(&self) -> Key {
        Key(*self.0.finalize().as_bytes())
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Key({self})")
    }
}

impl Key {
    /// The key written as 64 hexadecimal digits.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.as_bytes();
        let mut bytes = [0; 32];
        if digits.len() != 2 * bytes.len() {
            return None;
        }
        for (byte, pair) in bytes.iter_mut().zip(digits.chunks_exact(2)) {
            let high = char::from(pair[0]).to_digit(16)?;
            let low = char::from(pair[1]).to_digit(16)?;
            *byte = (16 * high + low) as u8;
        }
        Some(Self(bytes))
    }
}

impl Serialize for Key {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.collect_str(self)
        } else {
            self.0.serialize(serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            let text = String::deserialize(deserializer)?;
            Self::from_hex(&text).ok_or_else(|| D::Error::custom("a key has 64 hex digits"))
        } else {
            <[u8; 32]>::deserialize(deserializer).map(Self)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_cannot_be_moved_across_their_border() {
        let key = |fields: &[&str]| {
            let mut hasher = KeyHasher::new("test");
            for field in fields {
                hasher.field(field.as_bytes());
            }
            hasher.finish()
        };
        assert_ne!(key(&["ab", "c"]), key(&["a", "bc"]));
        assert_ne!(key(&["ab"]), key(&["ab", ""]));
        assert_eq!(key(&["ab", "c"]), key(&["ab", "c"]));
    }

    #[test]
    fn text_form_survives_a_round_trip() {
        let key = content_key([("a", Section { stride: 8, bytes: &[1; 16] })]);
        assert_eq!(Key::from_hex(&key.to_string()), Some(key));
        assert_eq!(Key::from_hex("12"), None);
        assert_eq!(Key::from_hex(&"g".repeat(64)), None);
        let json = serde_json::to_string(&key).unwrap();
        assert_eq!(serde_json::from_str::<Key>(&json).unwrap(), key);
    }
}
