//! Small dense solves on fixed-size arrays, rows first.
//!
//! Own code so that bytes agree between machines: no run-time kernel choice, no fused
//! multiply-add, sums in index order.

/// Lower Cholesky factor of a symmetric positive definite matrix, or the pivot that failed.
///
/// Only the lower triangle of `a` is read.
///
/// # Errors
/// The row whose pivot is not a positive finite number.
pub fn cholesky<const N: usize>(a: &[[f64; N]; N]) -> Result<[[f64; N]; N], usize> {
    let mut l = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let mut sum = a[i][j];
            for k in 0..j {
                sum -= l[i][k] * l[j][k];
            }
            if i == j {
                if !(sum > 0.0 && sum.is_finite()) {
                    return Err(i);
                }
                l[i][i] = sum.sqrt();
            } else {
                l[i][j] = sum / l[j][j];
            }
        }
    }
    Ok(l)
}

/// Solves `L L^T X = B` in place for `M` right-hand sides, `l` from [`cholesky`].
pub fn cholesky_solve<const N: usize, const M: usize>(l: &[[f64; N]; N], b: &mut [[f64; M]; N]) {
    for i in 0..N {
        for k in 0..i {
            for c in 0..M {
                b[i][c] -= l[i][k] * b[k][c];
            }
        }
        for c in 0..M {
            b[i][c] /= l[i][i];
        }
    }
    for i in (0..N).rev() {
        for k in i + 1..N {
            for c in 0..M {
                b[i][c] -= l[k][i] * b[k][c];
            }
        }
        for c in 0..M {
            b[i][c] /= l[i][i];
        }
    }
}

/// Solves `A x = b` by Gauss elimination with row pivoting; `None` if a pivot vanishes.
pub fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> Option<[f64; N]> {
    for col in 0..N {
        let pivot = (col..N).max_by(|&i, &j| a[i][col].abs().total_cmp(&a[j][col].abs()))?;
        // An exact zero (or NaN) column: the matrix is singular as it stands.
        if a[pivot][col].is_nan() || a[pivot][col] == 0.0 {
            return None;
        }
        a.swap(col, pivot);
        b.swap(col, pivot);
        for row in col + 1..N {
            let factor = a[row][col] / a[col][col];
            for k in col..N {
                a[row][k] -= factor * a[col][k];
            }
            b[row] -= factor * b[col];
        }
    }
    for row in (0..N).rev() {
        for k in row + 1..N {
            b[row] -= a[row][k] * b[k];
        }
        b[row] /= a[row][row];
    }
    b.iter().all(|x| x.is_finite()).then_some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [[f64; 3]; 3] = [[4.0, 1.0, -1.0], [1.0, 3.0, 0.5], [-1.0, 0.5, 5.0]];

    #[test]
    fn cholesky_solves_to_rounding() {
        let x = [1.0, -2.0, 0.25];
        let mut b = [[0.0]; 3];
        for i in 0..3 {
            b[i][0] = (0..3).map(|k| A[i][k] * x[k]).sum();
        }
        cholesky_solve(&cholesky(&A).unwrap(), &mut b);
        assert!((0..3).all(|i| (b[i][0] - x[i]).abs() < 1e-15));
    }

    #[test]
    fn an_indefinite_matrix_has_no_cholesky_factor() {
        assert_eq!(cholesky(&[[1.0, 2.0], [2.0, 1.0]]), Err(1));
    }

    #[test]
    fn elimination_pivots_past_a_zero_and_refuses_a_singular_matrix() {
        assert_eq!(solve([[0.0, 2.0], [1.0, 0.0]], [4.0, 3.0]), Some([3.0, 2.0]));
        assert_eq!(solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0]), None);
    }
}
