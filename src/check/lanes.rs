//! Eight cases side by side: what compilers turn into wide vectors.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

/// Cases together.
pub(crate) const LANES: usize = 8;

/// A number of each case.
pub(crate) type Lane = [f64; LANES];

/// A vector of each case: x of all, then y and z.
pub(crate) type Triple = [Lane; 3];

/// The sum of `weight * item` over all terms, in order; items are `C` numbers of each case.
#[inline(always)]
pub(crate) fn weighed<'a, const C: usize>(
    terms: impl Iterator<Item = (f64, &'a [Lane; C])>,
) -> [Lane; C] {
    let mut sum = [[0.0; LANES]; C];
    for (weight, item) in terms {
        for c in 0..C {
            for k in 0..LANES {
                sum[c][k] += weight * item[c][k];
            }
        }
    }
    sum
}

/// `a - b`.
#[inline(always)]
pub(crate) fn minus(a: &Triple, b: &Triple) -> Triple {
    let mut out = *a;
    for (out, b) in out.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
        *out -= b;
    }
    out
}

/// Writes vectors one after another.
#[inline(always)]
pub(crate) fn put<const N: usize>(parts: [Triple; N], out: &mut [Lane]) {
    for (out, part) in out.iter_mut().zip(parts.as_flattened()) {
        *out = *part;
    }
}

/// Number `i` of each array: the vector of one case out of the coordinates of many.
#[inline(always)]
pub(crate) fn vector<const N: usize>([x, y, z]: &[[f64; N]; 3], i: usize) -> [f64; 3] {
    [x[i], y[i], z[i]]
}

/// `a . b`.
#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x b`.
#[inline(always)]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The normal that two derivatives span, unnormalised, and whether they span a plane at all.
///
/// Below a sine of 1e-10 half of the digits of the normal are rounding.
#[inline(always)]
pub(crate) fn normal(along: [f64; 3], across: [f64; 3]) -> ([f64; 3], bool) {
    let normal = cross(along, across);
    let floor_sq = 1e-20 * dot(along, along) * dot(across, across);
    (normal, dot(normal, normal) > floor_sq)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearly_parallel_derivatives_span_no_plane() {
        let spans = |sine: f64| normal([0.3, 0.0, 0.0], [5.0, 5.0 * sine, 0.0]).1;
        assert!(spans(1e-9) && !spans(1e-11) && !spans(0.0) && !spans(f64::NAN));
    }

    #[test]
    fn a_weighed_sum_keeps_the_cases_apart() {
        let item = |x: f64| [std::array::from_fn(|k| x * k as f64), [x; LANES]];
        let (a, b) = (item(1.0), item(10.0));
        let [first, second] = weighed([(2.0, &a), (-1.0, &b)].into_iter());
        assert_eq!(first.map(|x| x as i64), [0, -8, -16, -24, -32, -40, -48, -56]);
        assert_eq!(second.map(|x| x as i64), [-8; LANES]);
    }
}
