//! Values to places on a legend: a range that few values leave, and its ticks.

use crate::RenderError;

/// Where values lie on a legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Scale {
    /// Even steps are even differences.
    Linear {
        /// Value at the lower end.
        lo: f64,
        /// Value at the upper end.
        hi: f64,
    },
    /// Even steps are even ratios.
    Logarithmic {
        /// Value at the lower end, above 0.
        lo: f64,
        /// Value at the upper end.
        hi: f64,
    },
}

/// A labelled place on a legend.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    /// 0 at the lower end, 1 at the upper.
    pub(crate) place: f64,
    /// The value there.
    pub(crate) label: String,
}

/// A value, and how much of the surface has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weighted {
    pub(crate) value: f64,
    /// Area, in any unit.
    pub(crate) weight: f64,
}

/// Part of the surface whose values a range holds; the others take the colours of its ends.
const COVERED: f64 = 0.98;
/// Most decades of a logarithmic range: more would leave no colours for the largest errors.
const DECADES: i32 = 5;

impl Scale {
    /// An even range about zero that holds all but the largest of the values.
    pub(crate) fn about_zero(values: impl Iterator<Item = Weighted>) -> Self {
        let sizes = values.map(|v| Weighted { value: v.value.abs(), ..v });
        let reach = match quantile(sizes, COVERED) {
            Some(size) if size > f64::MIN_POSITIVE => rounded_up(size),
            _ => 1.0,
        };
        Self::Linear { lo: -reach, hi: reach }
    }

    /// From a power of ten up to the largest of the values.
    pub(crate) fn decades(values: impl Iterator<Item = Weighted> + Clone) -> Self {
        let sizes = values.filter(|v| v.value > f64::MIN_POSITIVE);
        let least = quantile(sizes.clone(), 1.0 - COVERED);
        let (Some(least), Some(most)) = (least, quantile(sizes, 1.0)) else {
            return Self::Logarithmic { lo: 1e-16, hi: 1e-15 };
        };
        let top = libm::log10(most).ceil() as i32;
        let lo = (libm::log10(least).floor() as i32).clamp(top - DECADES, top - 1);
        Self::Logarithmic { lo: power_of_ten(lo), hi: rounded_up(most) }
    }

    /// The same kind of scale over a range of the caller's.
    ///
    /// # Errors
    /// [`RenderError::Range`].
    pub(crate) fn over(self, [lo, hi]: [f64; 2], style: &'static str) -> Result<Self, RenderError> {
        let sound = lo < hi && (hi - lo).is_finite();
        match self {
            Self::Linear { .. } if sound => Ok(Self::Linear { lo, hi }),
            Self::Logarithmic { .. } if sound && lo > 0.0 => Ok(Self::Logarithmic { lo, hi }),
            _ => Err(RenderError::Range { lo, hi, style }),
        }
    }

    /// Place of a value, 0 at the lower end and 1 at the upper; beyond for others.
    pub(crate) fn place(&self, value: f64) -> f64 {
        match *self {
            Self::Linear { lo, hi } => (value - lo) / (hi - lo),
            Self::Logarithmic { lo, hi } => libm::log(value / lo) / libm::log(hi / lo),
        }
    }

    /// Five labels of a linear range, one for each decade of a logarithmic one.
    pub(crate) fn ticks(&self) -> Vec<Tick> {
        let tick = |value: f64| Tick { place: self.place(value), label: number(value) };
        match *self {
            Self::Linear { lo, hi } => {
                let at = |k: i32| lo + (hi - lo) * f64::from(k) / 4.0;
                (0..=4).map(|k| tick(at(k))).collect()
            }
            Self::Logarithmic { lo, hi } => {
                let first = (libm::log10(lo) - 1e-9).ceil() as i32;
                let last = (libm::log10(hi) + 1e-9).floor() as i32;
                let step = ((last - first) / 6).max(1) as usize;
                (first..=last).step_by(step).map(|e| tick(power_of_ten(e))).collect()
            }
        }
    }
}

/// The value that this part of the weight does not exceed; `None` without a finite one.
fn quantile(values: impl Iterator<Item = Weighted>, part: f64) -> Option<f64> {
    let is_sound = |v: &Weighted| v.value.is_finite() && v.weight.is_finite();
    let mut sorted: Vec<Weighted> = values.filter(is_sound).collect();
    sorted.sort_unstable_by(|a, b| {
        a.value.total_cmp(&b.value).then_with(|| a.weight.total_cmp(&b.weight))
    });
    let wanted = part * sorted.iter().map(|v| v.weight).sum::<f64>();
    let mut passed = 0.0;
    let reached = sorted.iter().find(|v| {
        passed += v.weight;
        passed >= wanted
    });
    // Rounding may leave the whole just out of reach.
    reached.or(sorted.last()).map(|v| v.value)
}

/// At most four digits, with an exponent where they would be far from the point.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    // An exact zero: the middle of an even range.
    if size == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if (1e-3..1e5).contains(&size) { format!("{rounded}") } else { format!("{rounded:e}") }
}

fn power_of_ten(exponent: i32) -> f64 {
    // The nearest number, which a product of tens is not.
    format!("1e{exponent}").parse().unwrap_or(f64::MIN_POSITIVE)
}

/// The next number with one digit of 1, 1.5, 2, 3, 4, 5, 6, 8.
fn rounded_up(size: f64) -> f64 {
    let decade = power_of_ten(libm::log10(size).floor() as i32);
    let steps = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0];
    steps.into_iter().map(|s| s * decade).find(|&s| s >= size).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_wild_values_do_not_stretch_the_range() {
        let values = (0..1000).map(|k| if k < 5 { 1e9 } else { -f64::from(k) / 1000.0 });
        assert_eq!(Scale::about_zero(even(values)), Scale::Linear { lo: -1.0, hi: 1.0 });
        let none = Scale::about_zero(even([f64::NAN, 0.0].into_iter()));
        assert_eq!(none, Scale::Linear { lo: -1.0, hi: 1.0 });
    }

    #[test]
    fn decades_hold_the_largest_value() {
        let found = Scale::decades(even((1..1000).map(|k| 2.5e-7 * f64::from(k) / 1000.0)));
        assert_eq!(found, Scale::Logarithmic { lo: 1e-9, hi: 3e-7 });
        let labels: Vec<String> = found.ticks().into_iter().map(|t| t.label).collect();
        assert_eq!(labels, ["1e-9", "1e-8", "1e-7"]);
    }

    #[test]
    fn what_covers_little_of_the_surface_counts_little() {
        let many_small = (0..900).map(|_| Weighted { value: 50.0, weight: 1e-6 });
        let few_large = (0..10).map(|_| Weighted { value: 0.9, weight: 1.0 });
        let found = Scale::about_zero(many_small.chain(few_large));
        assert_eq!(found, Scale::Linear { lo: -1.0, hi: 1.0 });
    }

    fn even<I: Iterator<Item = f64> + Clone>(values: I) -> impl Iterator<Item = Weighted> + Clone {
        values.map(|value| Weighted { value, weight: 2.0 })
    }

    #[test]
    fn ticks_stand_where_their_values_are() {
        for scale in
            [Scale::Linear { lo: -2.5, hi: 2.5 }, Scale::Logarithmic { lo: 3e-9, hi: 2e-3 }]
        {
            for tick in scale.ticks() {
                let value: f64 = tick.label.parse().unwrap();
                assert!((scale.place(value) - tick.place).abs() < 1e-3, "{tick:?}");
                assert!((0.0..=1.0).contains(&tick.place));
            }
        }
    }

    #[test]
    fn numbers_are_short() {
        let cases = [0.0, -1.0, 0.125, 1234.567, 1e-7, 2.5e12, -0.033_333_333];
        let told = cases.map(number);
        assert_eq!(told, ["0", "-1", "0.125", "1235", "1e-7", "2.5e12", "-0.03333"]);
    }

    #[test]
    fn a_range_without_values_is_refused() {
        let linear = Scale::Linear { lo: -1.0, hi: 1.0 };
        assert!(linear.over([1.0, 1.0], "curvature").is_err());
        assert!(linear.over([0.0, f64::NAN], "curvature").is_err());
        assert!(linear.over([-3.0, 1.0], "curvature").is_ok());
        let decades = Scale::Logarithmic { lo: 1e-9, hi: 1.0 };
        assert!(decades.over([0.0, 1.0], "error").unwrap_err().to_string().contains("error"));
    }
}
