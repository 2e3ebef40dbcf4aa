//! Rounds that were tried become the number of faces to try next, for an error just below a
//! tolerance.
//!
//! Curves cost a tenth of the patches that lie between them and tell nearly as much, so they are
//! fitted for several numbers of faces, and patches for those that promise to do. All errors here
//! are in units of the tolerance; nothing else of a round counts, so a search that was cut off goes
//! on as it would have.

use serde::{Deserialize, Serialize};

/// One number of faces that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Round {
    /// Faces asked for.
    pub faces: u32,
    /// What came of them.
    pub found: Found,
}

/// What came of a round.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Curves were fitted.
    Curves {
        /// Largest error of a curve, times the tolerance.
        curves: f64,
    },
    /// The surface was made and checked.
    Surface {
        /// Largest error of a curve, times the tolerance.
        curves: f64,
        /// Largest error of the surface, times the tolerance; absent if it could not be measured.
        surface: Option<f64>,
        /// Whether all else that the check looks at is in order.
        sound: bool,
    },
    /// A stage refused so many faces.
    TooMany,
    /// A stage refused so few faces.
    Refused {
        /// Its code.
        code: String,
    },
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Fit the curves for so many faces.
    Curves(u32),
    /// Make the surface of so many faces.
    Surface(u32),
    /// The search is over.
    End(Ending),
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ending {
    /// The faces of the best surface: the fewest that do, or else those with the least error.
    pub faces: u32,
    /// What decided.
    pub verdict: Verdict,
}

/// What decided the number of faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The error is below the tolerance, by less than a factor of three.
    Met,
    /// The error is far below the tolerance; fewer faces made no sound surface, or one beyond it.
    FewestSound,
    /// The error is far below the tolerance; the rounds are used up.
    Settled,
    /// No number of faces that was tried came below the tolerance.
    NotReached,
}

/// Faces of the first round where nothing is known: they take half a second, and what they show
/// tells how many are needed.
pub(crate) const FIRST_FACES: u32 = 1000;
/// Most faces tried: the patches take minutes.
const MOST_FACES: u32 = 200_000;
/// Error that is aimed at: estimates from curves are right within a factor of two.
const AIM: f64 = 0.5;
/// Least error that needs no fewer faces.
const LEAST: f64 = 1.0 / 3.0;
/// Error estimated from curves up to which the surface is made.
const PROMISING: f64 = 0.95;
/// Error of a surface beside that of its curves, where none was made yet: 1.0 to 1.5 on coarse
/// meshes, up to 4 where sweeps end before the finest are done, and a third of that where the few
/// faces beside the worst curves are split.
const FIRST_RATIO: f64 = 0.5;
/// The error falls by this power of the faces where two rounds do not tell; 3.5 to 4 in the long
/// run, less or more where meshes are of chance quality.
const ORDER: f64 = 3.0;
/// Factors on the faces of an unsound surface, the first, the second and later ones: few more are
/// enough as a rule (deccube is unsound with 1000 faces at 1e-4, sound with 1100), but what a
/// formula needs may be ten times as much.
const SOUND_STEPS: [f64; 3] = [1.3, 1.6, 2.0];
/// Unsound surfaces after which more faces are not thought to help.
const MOST_UNSOUND: usize = 6;
/// Rounds of surfaces, and of curves.
const MOST_SURFACES: usize = 8;
const MOST_CURVES: usize = 9;
/// Refusals after which the stage's own error is the answer.
pub(crate) const MOST_REFUSALS: usize = 4;
/// Numbers of faces within this factor are the same: meshes of one count vary as much.
const NEAR: f64 = 1.12;
/// The same where fewer made no sound surface: each trial is a whole surface, or several.
const SOUND_NEAR: f64 = 1.2;

/// What to do after these rounds.
pub fn next(rounds: &[Round]) -> Step {
    let Some(last) = rounds.last() else { return Step::Curves(FIRST_FACES) };
    let search = Search::new(rounds);
    if let Some(ending) = search.ending() {
        return Step::End(ending);
    }
    let estimate = search.estimate(last);
    if last.is_of_curves() && (LEAST..=PROMISING).contains(&estimate) {
        return Step::Surface(last.faces);
    }
    if let Some(faces) = search.faces_for_soundness() {
        return Step::Surface(faces);
    }
    let faces = search.faces();
    let tried = rounds.iter().any(|r| r.faces == faces);
    let n_curves = rounds.iter().filter(|r| r.is_of_curves()).count();
    if tried || n_curves >= MOST_CURVES || search.is_narrow() {
        return Step::Surface(if tried { faces } else { search.surface_faces(faces) });
    }
    Step::Curves(faces)
}

impl Round {
    fn is_of_curves(&self) -> bool {
        matches!(self.found, Found::Curves { .. })
    }

    fn is_of_surface(&self) -> bool {
        matches!(self.found, Found::Surface { .. })
    }

    /// Error of a surface that is sound.
    fn sound(&self) -> Option<f64> {
        match self.found {
            Found::Surface { surface, sound: true, .. } => surface,
            _ => None,
        }
    }
}

/// The rounds, and what they say together.
struct Search<'a> {
    rounds: &'a [Round],
    /// Error of surfaces beside that of their curves.
    ratio: f64,
    /// The most faces of an unsound surface, below the fewest that do.
    unsound: Option<u32>,
    /// The fewest faces that do, or are thought to.
    high: Option<&'a Round>,
    /// The most faces below `high` that do not.
    low: Option<&'a Round>,
    /// So many faces may not be asked for.
    limit: u32,
}

impl<'a> Search<'a> {
    fn new(rounds: &'a [Round]) -> Self {
        let ratio = |r: &Round| match r.found {
            Found::Surface { curves, surface: Some(surface), sound: true } if curves > 0.0 => {
                Some((surface / curves).clamp(0.5, 20.0))
            }
            _ => None,
        };
        let ratio = rounds.iter().rev().find_map(ratio).unwrap_or(FIRST_RATIO);
        let good = rounds.iter().filter(|r| r.sound().is_some_and(|e| e <= 1.0));
        let good = good.map(|r| r.faces).min().unwrap_or(u32::MAX);
        let is_unsound = |r: &&Round| r.is_of_surface() && r.sound().is_none() && r.faces < good;
        let unsound = rounds.iter().filter(is_unsound).map(|r| r.faces).max();
        let too_many = rounds.iter().filter(|r| r.found == Found::TooMany);
        let limit = too_many.map(|r| r.faces).min().unwrap_or(u32::MAX).min(MOST_FACES);
        let mut search = Self { rounds, ratio, unsound, high: None, low: None, limit };
        let rounds = || rounds.iter().filter(|r| r.found != Found::TooMany);
        let does = |r: &&Round| search.estimate(r) <= 1.0;
        let high = rounds().filter(does).min_by_key(|r| r.faces);
        let below = |r: &&Round| high.is_none_or(|high| r.faces < high.faces);
        let low = rounds().filter(|r| !does(r)).filter(below).max_by_key(|r| r.faces);
        (search.high, search.low) = (high, low);
        search
    }

    /// The error of a round, infinite where no sound surface came of it or of more faces. The
    /// surface of these faces counts before their curves.
    fn estimate(&self, round: &Round) -> f64 {
        if self.unsound.is_some_and(|unsound| round.faces <= unsound) {
            return f64::INFINITY;
        }
        let same = |r: &&Round| r.faces == round.faces && !r.is_of_curves();
        match self.rounds.iter().find(same).unwrap_or(round).found {
            Found::Curves { curves } => curves * self.ratio,
            Found::Surface { surface: Some(surface), sound: true, .. } => surface,
            Found::Surface { .. } | Found::Refused { .. } | Found::TooMany => f64::INFINITY,
        }
    }

    fn ending(&self) -> Option<Ending> {
        let n_surfaces = self.rounds.iter().filter(|r| r.is_of_surface()).count();
        let good = |r: &&Round| r.sound().is_some_and(|error| error <= 1.0);
        let end = |r: &Round, verdict| Some(Ending { faces: r.faces, verdict });
        if let Some(best) = self.rounds.iter().filter(good).min_by_key(|r| r.faces) {
            if best.sound().is_some_and(|error| error >= LEAST) {
                return end(best, Verdict::Met);
            }
            let near = |low: &Round| {
                let factor = if low.is_of_surface() { SOUND_NEAR } else { NEAR };
                f64::from(best.faces) <= factor * f64::from(low.faces)
            };
            if self.low.is_some_and(near) || best.faces <= 4 {
                return end(best, Verdict::FewestSound);
            }
            return if n_surfaces >= MOST_SURFACES { end(best, Verdict::Settled) } else { None };
        }
        let is_over = n_surfaces >= MOST_SURFACES
            || self.n_unsound() >= MOST_UNSOUND
            || (n_surfaces > 0 && self.is_stuck());
        // Without a sound one the last: it has the most faces as a rule.
        let order = |r: &&Round| r.sound().unwrap_or(f64::INFINITY);
        let surfaces = self.rounds.iter().rev().filter(|r| r.is_of_surface());
        let least = surfaces.min_by(|x, y| order(x).total_cmp(&order(y)));
        least.filter(|_| is_over).and_then(|r| end(r, Verdict::NotReached))
    }

    fn n_unsound(&self) -> usize {
        self.rounds.iter().filter(|r| r.is_of_surface() && r.sound().is_none()).count()
    }

    /// Whether faces have stopped to help: three times as many have no smaller error, or no more
    /// may be asked for.
    fn is_stuck(&self) -> bool {
        let Some(low) =
            self.low.filter(|low| self.high.is_none() && self.estimate(low).is_finite())
        else {
            return false;
        };
        let no_better =
            |r: &Round| 3 * r.faces <= low.faces && self.estimate(r) <= 1.5 * self.estimate(low);
        NEAR * f64::from(low.faces) >= f64::from(self.limit) || self.rounds.iter().any(no_better)
    }

    /// Whether too many and too few faces are known to be close together.
    fn is_narrow(&self) -> bool {
        let pair = self.low.zip(self.high);
        self.is_stuck()
            || pair.is_some_and(|(l, h)| f64::from(h.faces) <= NEAR * f64::from(l.faces))
    }

    /// The faces of a surface that is made although its curves say that it is not the best.
    fn surface_faces(&self, wanted: u32) -> u32 {
        self.high.or(self.low.filter(|_| self.is_stuck())).map_or(wanted, |r| r.faces)
    }

    /// The faces of the next surface where the last one was unsound, of which curves say nothing.
    fn faces_for_soundness(&self) -> Option<u32> {
        let low = self.unsound?;
        let sound = self.rounds.iter().filter(|r| r.sound().is_some() && r.faces > low);
        let fewest = sound.min_by_key(|r| r.faces);
        if fewest.and_then(Round::sound).is_some_and(|error| error > 1.0) {
            // The error asks for more.
            return None;
        }
        let low = f64::from(low);
        let step = SOUND_STEPS[self.n_unsound().clamp(1, SOUND_STEPS.len()) - 1];
        let faces = fewest.map_or(step * low, |high| power(low * f64::from(high.faces), 0.5));
        Some((faces.round() as u32).min(self.limit))
    }

    /// The faces that seem to have the error aimed at.
    fn faces(&self) -> u32 {
        let at = |r: &Round| (f64::from(r.faces), self.estimate(r));
        let faces = match (self.low.map(at), self.high.map(at)) {
            (Some((low, error)), None) if error.is_finite() => {
                let wanted = low * power(error / AIM, 1.0 / ORDER).clamp(1.15, 4.0);
                let limit = f64::from(self.limit);
                if wanted < limit { wanted } else { power(low * limit, 0.5) }
            }
            // Refused.
            (Some((low, _)), None) => 1.4 * low,
            (None, Some((high, error))) => high * power(error / AIM, 1.0 / ORDER).clamp(0.25, 0.9),
            (Some((low, coarse)), Some((high, fine))) => {
                // Curves of meshes near the least that is sound vary wildly: no steep descent.
                let part = if coarse.is_finite() && fine > 0.0 {
                    libm::log(coarse / AIM) / libm::log(coarse / fine)
                } else {
                    0.5
                };
                low * power(high / low, part.clamp(0.15, 0.85))
            }
            (None, None) => f64::from(FIRST_FACES),
        };
        (faces.round() as u32).clamp(4, self.limit)
    }
}

fn power(base: f64, exponent: f64) -> f64 {
    libm::exp(exponent * libm::log(base))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays a search of fewer than `most` rounds; `found` tells what a number of faces gives, and
    /// whether a surface is made of it.
    fn play_with(most: usize, found: impl Fn(u32, bool) -> Found) -> (Ending, Vec<Round>) {
        let mut rounds = Vec::new();
        loop {
            let (faces, is_surface) = match next(&rounds) {
                Step::Curves(faces) => (faces, false),
                Step::Surface(faces) => (faces, true),
                Step::End(ending) => return (ending, rounds),
            };
            rounds.push(Round { faces, found: found(faces, is_surface) });
            assert!(rounds.len() < most, "the search does not end: {rounds:?}");
        }
    }

    /// Plays a search on a surface whose curves and patches have these errors; sound from
    /// `least_sound` faces on.
    fn play(error: impl Fn(f64) -> f64, ratio: f64, least_sound: u32) -> (Ending, Vec<Round>) {
        play_with(40, |faces, is_surface| {
            let curves = error(f64::from(faces));
            if is_surface {
                let sound = faces >= least_sound;
                Found::Surface { curves, surface: Some(ratio * curves), sound }
            } else {
                Found::Curves { curves }
            }
        })
    }

    fn surfaces(rounds: &[Round]) -> usize {
        rounds.iter().filter(|r| r.is_of_surface()).count()
    }

    #[test]
    fn errors_of_any_order_and_ratio_are_met_within_a_factor_of_three() {
        for order in [2.0, 3.0, 4.0] {
            for needed in [60.0f64, 700.0, 4500.0, 30_000.0] {
                for ratio in [1.0, 2.0, 5.0] {
                    let error = |faces: f64| power(needed / faces, order);
                    let (ending, rounds) = play(error, ratio, 4);
                    assert_eq!(ending.verdict, Verdict::Met, "{order} {needed} {ratio}");
                    let found = ratio * error(f64::from(ending.faces));
                    assert!((LEAST..=1.0).contains(&found), "{order} {needed} {ratio}: {found}");
                    assert!(surfaces(&rounds) <= 4, "{order} {needed} {ratio}: {rounds:?}");
                }
            }
        }
    }

    #[test]
    fn errors_that_vary_by_a_factor_of_two_are_met_or_the_rounds_are_used_up() {
        for seed in 0..20 {
            let noise = |faces: f64| libm::exp(0.7 * libm::sin(faces * 0.37 + f64::from(seed)));
            let (ending, rounds) = play(|f| power(3000.0 / f, 3.5) * noise(f), 1.3, 4);
            assert_ne!(ending.verdict, Verdict::NotReached, "{seed}: {rounds:?}");
            assert!((1800..6000).contains(&ending.faces), "{seed}: {rounds:?}");
        }
    }

    #[test]
    fn where_coarse_meshes_are_unsound_the_fewest_sound_faces_are_taken() {
        let (ending, rounds) = play(|faces| power(300.0 / faces, 3.0), 1.0, 2600);
        assert_eq!(ending.verdict, Verdict::FewestSound, "{rounds:?}");
        assert!((2600..3600).contains(&ending.faces), "{rounds:?}");
    }

    #[test]
    fn just_below_the_fewest_sound_faces_few_more_are_tried_first() {
        let (ending, rounds) = play(|faces| power(1000.0 / faces, 3.0), 0.6, 1100);
        assert!((1100..1200).contains(&ending.faces), "{rounds:?}");
        assert!(surfaces(&rounds) <= 3, "{rounds:?}");
    }

    #[test]
    fn a_surface_that_does_is_never_given_up_for_one_with_more_faces() {
        for seed in 0..200 {
            let chance = |faces: f64| libm::sin(faces * 0.37 + f64::from(seed));
            let (ending, rounds) = play_with(40, |faces, is_surface| {
                let n = f64::from(faces);
                let curves = power(900.0 / n, 3.0) * libm::exp(0.5 * chance(n));
                // Soundness is a matter of luck up to 2500 faces.
                let sound = n > 2500.0 || n / 2500.0 > 0.4 + 0.6 * chance(1.7 * n);
                if is_surface {
                    Found::Surface { curves, surface: Some(curves), sound }
                } else {
                    Found::Curves { curves }
                }
            });
            let good = rounds.iter().filter(|r| r.sound().is_some_and(|error| error <= 1.0));
            let least = good.map(|r| r.faces).min();
            assert_eq!(least, Some(ending.faces), "{seed}: {rounds:?}");
            assert!(surfaces(&rounds) <= MOST_SURFACES, "{seed}: {rounds:?}");
        }
    }

    #[test]
    fn an_error_that_stays_ends_the_search_with_the_surface_of_least_error() {
        let (ending, rounds) = play(|faces| 50.0 + 1e3 / faces, 1.0, 4);
        assert_eq!(ending.verdict, Verdict::NotReached);
        assert!(surfaces(&rounds) <= 2 && rounds.len() <= 6, "{rounds:?}");
    }

    #[test]
    fn where_more_faces_are_refused_the_most_that_are_not_are_taken() {
        let (ending, rounds) = play_with(20, |faces, is_surface| {
            let curves = power(9000.0 / f64::from(faces), 3.0);
            match is_surface {
                _ if faces > 2500 => Found::TooMany,
                true => Found::Surface { curves, surface: Some(curves), sound: true },
                false => Found::Curves { curves },
            }
        });
        assert_eq!(ending.verdict, Verdict::NotReached, "{rounds:?}");
        assert!((2100..=2500).contains(&ending.faces), "{rounds:?}");
    }

    #[test]
    fn refusals_ask_for_more_faces() {
        let refused = |faces| Round { faces, found: Found::Refused { code: "few".to_owned() } };
        assert_eq!(next(&[refused(1000)]), Step::Curves(1400));
        assert_eq!(next(&[refused(1000), refused(1400)]), Step::Curves(1960));
    }
}
