//! Bézier triangles of degree 6 as ones of degree 7, and back.

use crate::Vec3;
use crate::bezier_triangle::{
    DEGREE, INNERMOST_SLOTS, N_CONTROL, N_INTERIOR, boundary_index, exponents, first_inner_index,
    first_inner_slot, index, n_control,
};

/// Control points of a triangle of degree 6.
pub const N_SEXTIC: usize = n_control(6);

/// A net of degree 6 raised to degree 7: `7 b = i b'(i-1,j,k) + j b'(i,j-1,k) + k b'(i,j,k-1)`.
pub fn raise_sextic(net: &[Vec3; N_SEXTIC]) -> [Vec3; N_CONTROL] {
    let mut out = [Vec3::zeros(); N_CONTROL];
    for e in exponents(DEGREE) {
        let mut sum = Vec3::zeros();
        for k in 0..3 {
            if let Some(less) = e[k].checked_sub(1) {
                let mut below = e;
                below[k] = less;
                sum += e[k] as f64 * net[index(below)];
            }
        }
        out[index(e)] = sum / 7.0;
    }
    out
}

/// The net of degree 6 with this boundary, whatever `net` holds inside, and these 15 interior points
/// once it is raised; where no such net exists, one near it with the same twists.
///
/// The twists follow from `7 b(5,1,1) = 5 b'(4,1,1) + b'(5,1,0) + b'(5,0,1)`, the rows beside the
/// edges from `7 b(4,2,1) = 4 b'(3,2,1) + 2 b'(4,1,1) + b'(4,2,0)`, the middle point from the mean of
/// three such equations.
pub fn lower_to_sextic(mut net: [Vec3; N_SEXTIC], raised: &[Vec3; N_INTERIOR]) -> [Vec3; N_SEXTIC] {
    let row = |corner: usize, s: usize| raised[first_inner_slot(corner, s)];
    for corner in 0..3 {
        let beside =
            net[boundary_index(6, corner, 1)] + net[boundary_index(6, (corner + 2) % 3, 5)];
        net[first_inner_index(6, corner, 1)] = (7.0 * row(corner, 1) - beside) / 5.0;
    }
    for corner in 0..3 {
        // Step of the point, of the twist beside it, and of the points on the boundary and inside
        // the raised net that belong to it.
        for (s, twist, across) in [(2, 1, 2), (3, 4, 4)] {
            let twist = net[first_inner_index(6, corner, twist)];
            let known = 2.0 * twist + net[boundary_index(6, corner, across)];
            net[first_inner_index(6, corner, s)] = (7.0 * row(corner, across) - known) / 4.0;
        }
    }
    let innermost = [[3, 2, 2], [2, 3, 2], [2, 2, 3]].iter().zip(INNERMOST_SLOTS);
    let mut middle = Vec3::zeros();
    for (e, slot) in innermost {
        let below = |k: usize| {
            let mut below = *e;
            below[k] -= 1;
            net[index(below)]
        };
        let known = (0..3).filter(|&k| e[k] == 2).map(below).sum::<Vec3>();
        middle += (7.0 * raised[slot] - 2.0 * known) / 9.0;
    }
    net[index([2, 2, 2])] = middle;
    net
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bezier_triangle::{evaluate, interior_indices};

    fn net() -> [Vec3; N_SEXTIC] {
        std::array::from_fn(|k| {
            let x = k as f64;
            Vec3::new(x * 0.3 - 2.0, ((k * k) % 7) as f64, 0.01 * x * x)
        })
    }

    #[test]
    fn raising_keeps_every_point() {
        let raised = raise_sextic(&net());
        for at in [[0.2, 0.5, 0.3], [0.0, 0.4, 0.6], [1.0, 0.0, 0.0], [0.7, 0.1, 0.2]] {
            assert!((evaluate(6, &net(), at) - evaluate(7, &raised, at)).norm() < 1e-14);
        }
    }

    #[test]
    fn lowering_undoes_raising() {
        let raised = raise_sextic(&net());
        let mut boundary = net();
        for e in exponents(6).filter(|e| e.iter().all(|&x| x > 0)) {
            boundary[index(e)] = Vec3::repeat(f64::NAN);
        }
        let lowered = lower_to_sextic(boundary, &interior_indices().map(|i| raised[i]));
        for (a, b) in lowered.iter().zip(&net()) {
            assert!((a - b).norm() < 1e-13, "{a} instead of {b}");
        }
    }
}
