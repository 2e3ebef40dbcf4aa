//! The volume that nets enclose, by Gauss integration, against the one that is stated.

use super::StepDefect;
use super::borders::Net;
use super::entities::Model;

/// What rounding of a sum over many thousand patches may make, and far below any defect that
/// matters.
const AGREE: f64 = 1e-10;

/// The flux of the position through nets: three times the volume within.
#[derive(Debug, Default)]
pub(super) struct Flux {
    sum: f64,
    /// A point near the shell, which keeps the terms small.
    origin: Option<[f64; 3]>,
    basis: Vec<Basis>,
}

/// Values and slopes of the Bernstein polynomials of a degree at the nodes.
#[derive(Debug)]
struct Basis {
    degree: usize,
    rows: Vec<(f64, Vec<f64>, Vec<f64>)>,
}

impl Flux {
    pub(super) fn add(&mut self, net: &Net) {
        let origin = *self.origin.get_or_insert(net.points[0]);
        let [u, v] = net.degree.map(|degree| self.basis(degree));
        let n = net.degree[1] + 1;
        let mut flux = 0.0;
        for (weight_u, values_u, slopes_u) in &self.basis[u].rows {
            // Rows of the net summed over u: position and slope of a curve in v.
            let column = |weights: &[f64], j: usize| -> [f64; 3] {
                let terms = weights.iter().enumerate().map(|(i, w)| (w, net.points[i * n + j]));
                terms.fold([0.0; 3], |sum, (w, p)| {
                    std::array::from_fn(|k| sum[k] + w * (p[k] - origin[k]))
                })
            };
            let along: Vec<[f64; 3]> = (0..n).map(|j| column(values_u, j)).collect();
            let slope: Vec<[f64; 3]> = (0..n).map(|j| column(slopes_u, j)).collect();
            for (weight_v, values_v, slopes_v) in &self.basis[v].rows {
                let [p, du, dv] =
                    [(&along, values_v), (&slope, values_v), (&along, slopes_v)].map(combine);
                let normal = [
                    du[1] * dv[2] - du[2] * dv[1],
                    du[2] * dv[0] - du[0] * dv[2],
                    du[0] * dv[1] - du[1] * dv[0],
                ];
                let through = p[0] * normal[0] + p[1] * normal[1] + p[2] * normal[2];
                flux += weight_u * weight_v * through;
            }
        }
        self.sum += if net.is_turned { -flux } else { flux };
    }

    pub(super) fn volume(&self) -> f64 {
        self.sum / 3.0
    }

    fn basis(&mut self, degree: usize) -> usize {
        let known = self.basis.iter().position(|basis| basis.degree == degree);
        known.unwrap_or_else(|| {
            self.basis.push(Basis::new(degree));
            self.basis.len() - 1
        })
    }
}

fn combine((points, weights): (&Vec<[f64; 3]>, &Vec<f64>)) -> [f64; 3] {
    let terms = points.iter().zip(weights);
    terms.fold([0.0; 3], |sum, (p, w)| std::array::from_fn(|k| sum[k] + w * p[k]))
}

impl Basis {
    fn new(degree: usize) -> Self {
        // The flux has degree 3 n - 1 in each parameter; m nodes are exact to degree 2 m - 1.
        let rule = crate::mass::gauss_legendre(3 * degree / 2 + 1);
        let row = |(t, weight): (f64, f64)| {
            let below = bernstein(degree - 1, t);
            let at = |k: usize| below.get(k).copied().unwrap_or(0.0);
            let slope = |k: usize| degree as f64 * (k.checked_sub(1).map_or(0.0, at) - at(k));
            (weight, bernstein(degree, t), (0..=degree).map(slope).collect())
        };
        Self { degree, rows: rule.into_iter().map(row).collect() }
    }
}

/// Bernstein polynomials at `t`, by the recurrence of degrees.
fn bernstein(degree: usize, t: f64) -> Vec<f64> {
    let mut row = vec![1.0];
    for n in 1..=degree {
        let at = |k: usize| row.get(k).copied().unwrap_or(0.0);
        row = (0..=n)
            .map(|k| (1.0 - t) * at(k) + k.checked_sub(1).map_or(0.0, |below| t * at(below)))
            .collect();
    }
    row
}

/// Whether a volume is the one among the validation properties.
pub(super) fn against_stated(model: &Model<'_>, found: f64) -> Option<StepDefect> {
    let mut items = model.all("MEASURE_REPRESENTATION_ITEM");
    let volume = |item: super::entities::Found<super::entities::Node<'_>>| {
        item.ok()?.measure(1, "VOLUME_MEASURE")
    };
    let Some(stated) = items.find_map(volume) else {
        return Some(StepDefect::Unsaid("what volume it has"));
    };
    let agree = (found - stated).abs() <= AGREE * stated.abs();
    (!agree).then_some(StepDefect::Volume { found, stated })
}
