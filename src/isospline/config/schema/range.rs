//! Which numbers a key takes, found by bisection.

use super::{ConfigError, fits, verdict};
use serde_json::{Value, json};

/// The form of a key that takes numbers.
pub(super) fn number(table: &str, key: &str) -> Value {
    if fits(table, key, 1.5) { real(table, key) } else { integer(table, key) }
}

/// Whether the reader takes a value and finds it in range.
fn is_sound(table: &str, key: &str, value: impl Into<toml::Value>) -> bool {
    let refused =
        |error| matches!(error, ConfigError::OutOfRange { .. } | ConfigError::WrongType { .. });
    !verdict(table, key, value.into()).is_err_and(refused)
}

fn integer(table: &str, key: &str) -> Value {
    let mut schema = json!({ "type": "integer" });
    let sound = |value: i64| is_sound(table, key, value);
    let Some(inside) = (0..64).map(|k| (1_i64 << k) - 1).find(|&value| sound(value)) else {
        return schema;
    };
    for (name, end) in [("minimum", i64::MIN), ("maximum", i64::MAX)] {
        if sound(end) {
            continue;
        }
        let (mut good, mut bad) = (inside, end);
        while good.abs_diff(bad) > 1 {
            // Their sum may be too large for the type.
            let middle = i64::midpoint(good, bad);
            if sound(middle) { good = middle } else { bad = middle }
        }
        schema[name] = json!(good);
    }
    schema
}

/// Farther than any bound of a key.
const FAR: f64 = 1e300;

fn real(table: &str, key: &str) -> Value {
    let mut schema = json!({ "type": "number" });
    let sound = |value: f64| is_sound(table, key, value);
    let candidates = [0.0, 0.5, 1.0].into_iter().chain((-12..13).map(|k| f64::from(k).exp2()));
    let mut candidates = candidates.chain([30.0, 60.0, 100.0]);
    let Some(inside) = candidates.find(|&value| sound(value)) else { return schema };
    for (end, within, without) in
        [(-FAR, "minimum", "exclusiveMinimum"), (FAR, "maximum", "exclusiveMaximum")]
    {
        if sound(end) {
            continue;
        }
        let (good, bad) = border(inside, end, sound);
        // Of the last value that is taken and the first that is not, the one people wrote.
        let length = |x: f64| format!("{x:?}").len();
        if length(good) <= length(bad) {
            schema[within] = json!(good);
        } else {
            schema[without] = json!(bad);
        }
    }
    schema
}

/// Neighbouring numbers of which one is taken and the other is not.
fn border(inside: f64, outside: f64, sound: impl Fn(f64) -> bool) -> (f64, f64) {
    // Bits of floats, turned so that they count up as the values do.
    let rank = |x: f64| {
        let bits = x.to_bits() as i64;
        if bits < 0 { i64::MIN - bits } else { bits }
    };
    let value = |rank: i64| {
        let bits = if rank < 0 { i64::MIN - rank } else { rank };
        f64::from_bits(bits as u64)
    };
    let (mut good, mut bad) = (rank(inside), rank(outside));
    while good.abs_diff(bad) > 1 {
        let middle = i64::midpoint(good, bad);
        if sound(value(middle)) { good = middle } else { bad = middle }
    }
    (value(good), value(bad))
}

#[cfg(test)]
mod tests {
    use super::border;

    #[test]
    fn borders_are_found_to_the_bit() {
        assert_eq!(border(1.0, 1e300, |x| x <= 2.5), (2.5, 2.5_f64.next_up()));
        assert_eq!(border(1.0, -1e300, |x| x > 0.0), (f64::from_bits(1), 0.0));
        assert_eq!(border(1.0, -1e300, |x| x >= -3.0), (-3.0, (-3.0_f64).next_down()));
    }
}
