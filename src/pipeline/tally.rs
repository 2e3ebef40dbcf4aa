//! Counters as the note of a journal entry: every number with all its bits.

use isospline_stage::Counters;

/// The bytes of `counters`: for repairs, counts and maxima the number of entries, then of each
/// the length of its name, the name and eight bytes.
pub(crate) fn encode(counters: &Counters) -> Vec<u8> {
    let mut out = Vec::new();
    let whole = |(name, n): (&String, &u64)| (name.clone(), *n);
    put(&mut out, counters.repairs.iter().map(whole).collect());
    put(&mut out, counters.counts.iter().map(whole).collect());
    let bits = counters.maxima.iter().map(|(name, x)| (name.clone(), x.to_bits()));
    put(&mut out, bits.collect());
    out
}

/// The counters of `bytes`; `None` if another program wrote them.
pub(crate) fn decode(bytes: &[u8]) -> Option<Counters> {
    let mut rest = bytes;
    let repairs = take(&mut rest)?.into_iter().collect();
    let counts = take(&mut rest)?.into_iter().collect();
    let maxima = take(&mut rest)?.into_iter().map(|(name, bits)| (name, f64::from_bits(bits)));
    rest.is_empty().then(|| Counters { repairs, counts, maxima: maxima.collect() })
}

fn put(out: &mut Vec<u8>, entries: Vec<(String, u64)>) {
    out.extend_from_slice(&(entries.len() as u32).to_le_bytes());
    for (name, bits) in entries {
        out.extend_from_slice(&(name.len() as u32).to_le_bytes());
        out.extend_from_slice(name.as_bytes());
        out.extend_from_slice(&bits.to_le_bytes());
    }
}

fn take(rest: &mut &[u8]) -> Option<Vec<(String, u64)>> {
    let n = u32::from_le_bytes(split(rest, 4)?.try_into().ok()?);
    let entry = |rest: &mut &[u8]| {
        let length = u32::from_le_bytes(split(rest, 4)?.try_into().ok()?);
        let name = std::str::from_utf8(split(rest, length as usize)?).ok()?.to_owned();
        Some((name, u64::from_le_bytes(split(rest, 8)?.try_into().ok()?)))
    };
    (0..n).map(|_| entry(rest)).collect()
}

fn split<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (head, tail) = rest.split_at_checked(length)?;
    *rest = tail;
    Some(head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_come_back_with_all_bits() {
        let mut counters = Counters::default();
        assert_eq!(decode(&encode(&counters)).unwrap(), counters);
        counters.repair("split", 2);
        counters.count("faces", u64::MAX);
        counters.max("least", 5e-324);
        counters.max("endless", f64::INFINITY);
        let bytes = encode(&counters);
        assert_eq!(decode(&bytes).unwrap(), counters);
        counters.max("none", f64::NAN);
        assert!(decode(&encode(&counters)).unwrap().maxima["none"].is_nan());
        for length in 0..bytes.len() {
            assert_eq!(decode(&bytes[..length]), None, "{length}");
        }
    }
}
