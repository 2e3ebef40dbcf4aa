//! Changed copies of a corpus: structured enough to come past the first check.

use crate::reliability::dice::Dice;
use crate::reliability::seal::{places, seal_header, seal_rows};

/// Longest case, so that ten thousand of them take minutes.
const LONGEST: usize = 1 << 18;

/// Numbers at which readers break.
const NUMBERS: [&str; 12] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "99999999999999999999999999",
    "0.1e",
];

/// A text or archive with up to eight changes.
pub(crate) fn changed(dice: &mut Dice, corpus: &[Vec<u8>], words: &[&str]) -> Vec<u8> {
    let mut bytes = dice.pick(corpus).clone();
    for _ in 0..=dice.below(8) {
        let at = dice.below(bytes.len() + 1);
        let end = at + dice.below((bytes.len() - at).min(64) + 1);
        match dice.below(10) {
            0 if at < bytes.len() => bytes[at] ^= 1 << dice.below(8),
            1 if at < bytes.len() => bytes[at] = *dice.pick(&[0, 0xff, b'0', b' ', b'\n', 0x80]),
            2 => drop(bytes.drain(at..end)),
            3 => bytes.truncate(at),
            4 => {
                let copy = bytes[at..end].to_vec();
                insert(&mut bytes, at, &copy);
            }
            5 => replace_number(dice, &mut bytes, at),
            6 => {
                let other = dice.pick(corpus);
                let from = dice.below(other.len() + 1);
                let to = from + dice.below((other.len() - from).min(256) + 1);
                insert(&mut bytes, at, &other[from..to]);
            }
            7 if dice.below(64) == 0 => {
                // Depth and length: what recursion and quadratic loops do not bear.
                let word = dice.pick(words).repeat(1 << dice.below(15));
                insert(&mut bytes, at, word.as_bytes());
            }
            _ => insert(&mut bytes, at, dice.pick(words).as_bytes()),
        }
        bytes.truncate(LONGEST);
    }
    bytes
}

/// An artifact with changes: any, in its header, or in its rows; the checksums of the latter two
/// are put right.
pub(crate) fn changed_artifact(dice: &mut Dice, sound: &[u8]) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    let places = places(sound);
    let body = places.first().map_or(sound.len(), |first| first.offset);
    let n_changes = 1 + dice.below(4);
    match dice.below(4) {
        0 => return changed(dice, &[bytes], &["\u{1a}", "ISOSEND\n"]),
        1 | 2 => {
            for _ in 0..n_changes {
                let at = 8 + dice.below(body - 8);
                spoil(dice, &mut bytes, at);
            }
            seal_header(&mut bytes);
        }
        _ => {
            for _ in 0..n_changes {
                let place = dice.pick(&places);
                if place.rows > 0 {
                    let row = place.offset + place.stride * dice.below(place.rows);
                    let at = row + 4 * dice.below(place.stride.div_ceil(4));
                    spoil(dice, &mut bytes[..place.end()], at);
                }
            }
            seal_rows(&mut bytes, &places);
        }
    }
    bytes
}

/// Puts a number of one, four or eight bytes somewhere.
fn spoil(dice: &mut Dice, bytes: &mut [u8], at: usize) {
    let word = match dice.below(8) {
        0 => 0,
        1 => u64::MAX,
        2 => u64::from(u32::MAX),
        3 => 1 << 63,
        4 => f64::NAN.to_bits(),
        5 => f64::INFINITY.to_bits(),
        6 => 1 << dice.below(64),
        _ => dice.bits(),
    };
    let width = *dice.pick(&[1, 4, 8]);
    let end = (at + width).min(bytes.len());
    let place = &mut bytes[at.min(end)..end];
    place.copy_from_slice(&word.to_le_bytes()[..place.len()]);
}

/// Puts an awkward number in place of the digits at or after `at`.
fn replace_number(dice: &mut Dice, bytes: &mut Vec<u8>, at: usize) {
    let is_digit = |b: &u8| b.is_ascii_digit() || *b == b'.';
    let Some(start) = (at..bytes.len()).find(|&k| is_digit(&bytes[k])) else { return };
    let end = (start..bytes.len()).find(|&k| !is_digit(&bytes[k])).unwrap_or(bytes.len());
    bytes.splice(start..end, dice.pick(&NUMBERS).bytes());
}

fn insert(bytes: &mut Vec<u8>, at: usize, piece: &[u8]) {
    bytes.splice(at..at, piece.iter().copied());
}
