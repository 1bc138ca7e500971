//! Choice of the method whose plant is recommended.

use crate::caveat::{estimated, spoken};
use crate::estimate::t_quantile_975;
use crate::{Fit, Method, Vehicle};

use super::score::{Score, Scored};
use super::working::drag_at;

/// A plant of one method that may be recommended.
pub(crate) struct Contender<'a> {
    pub(crate) method: Method,
    /// Reason why the plant is physically impossible.
    pub(crate) impossible: Option<String>,
    /// Errors on trials outside the fit.
    pub(crate) tested: Option<&'a Scored>,
    /// Errors on the fitted trials.
    pub(crate) fitted: Option<&'a Scored>,
}

/// Ratio of errors above which the difference may be chance.
const BETTER_PART: f64 = 0.95;

/// Ratio of errors below which a plant is recommended in place of the first. A method that
/// minimises these errors has somewhat smaller ones where it attributes persistent slow forces to
/// drag.
const CLEARLY_BETTER_PART: f64 = 0.85;

/// Product of the ratios of errors, on fitted and on unseen trials, below which a plant may simulate the fitted ones
/// somewhat worse.
const FAR_BETTER: f64 = 0.5;

/// Returns the ratio of the errors of two plants, offsets removed.
fn ratio(own: &Scored, than: &Scored) -> Option<f64> {
    let (own, than) = own.score.offset_free_error.zip(than.score.offset_free_error)?;
    Some(own / than)
}

/// Returns the index of the plant to recommend: the first possible one, unless another predicts
/// unseen trials better by more than chance and simulates the fitted ones no worse, or predicts unseen ones so much
/// better that it does not matter, or explains both far better; then the best of those. `None` if none is possible.
///
/// A plant with less thrust loss, current or battery sag than there is may come close in one trial and be wrong.
///
/// The paper's method is kept for comparison with its known error, and is recommended only if it is
/// the only one.
///
/// Compares the mean |error| of many parts of the trials, pairwise, with an initial velocity, a
/// constant force and a current fitted to each trial: under a current the true plant may simulate
/// worse than a wrong one.
pub(crate) fn choose(contenders: &[Contender<'_>]) -> Option<usize> {
    let is_open = |&k: &usize| {
        let kept_for_comparison = contenders[k].method == Method::Paper && contenders.len() > 1;
        contenders[k].impossible.is_none() && !kept_for_comparison
    };
    let open: Vec<usize> = (0..contenders.len()).filter(is_open).collect();
    let first = *open.first()?;
    let parts = |k: usize| contenders[k].tested.map_or(&[][..], |tested| &tested.parts);
    let total = |parts: &[f64]| parts.iter().sum::<f64>();
    let is_better = |&k: &usize| {
        let Some((own, than)) = contenders[k].tested.zip(contenders[first].tested) else {
            return is_better(parts(k), parts(first));
        };
        let is_clear = total(parts(k)) < CLEARLY_BETTER_PART * total(parts(first));
        let by_parts = is_clear && is_better(parts(k), parts(first));
        let [own_fit, than_fit] = [k, first].map(|k| contenders[k].fitted);
        let explains = |one: &Scored, other: &Scored| leaves_less(&one.score, &other.score);
        let by_both = own_fit.zip(than_fit).is_some_and(|(a, b)| explains(a, b));
        let by_both = by_both && explains(own, than);
        let is_unseen_better = by_parts || is_better_throughout(own, than);
        let keeps_fit = || {
            let of_fit = own_fit.zip(than_fit).and_then(|(own, than)| ratio(own, than));
            let of_all = of_fit.zip(ratio(own, than)).map(|(fitted, unseen)| fitted * unseen);
            of_fit.is_none_or(|part| part <= 1.0) || of_all.is_some_and(|part| part < FAR_BETTER)
        };
        let is_better = by_both || is_unseen_better && keeps_fit();
        is_better && !loses_position(own, than)
    };
    let better = open[1..].iter().copied().filter(is_better);
    let mean = |k: usize| parts(k).iter().sum::<f64>() / parts(k).len() as f64;
    Some(better.min_by(|&a, &b| mean(a).total_cmp(&mean(b))).unwrap_or(first))
}

/// Returns true if a plant predicts unseen trials better than another: by more than chance, or each of them.
pub(crate) fn predicts_better(own: &Scored, than: &Scored) -> bool {
    is_better(&own.parts, &than.parts) || is_better_throughout(own, than)
}

/// Returns true if errors of parts are smaller than others, significantly and by a minimum ratio.
pub(crate) fn is_better(parts: &[f64], than: &[f64]) -> bool {
    if than.is_empty() {
        return !parts.is_empty();
    }
    let gains: Vec<f64> = than.iter().zip(parts).map(|(than, own)| than - own).collect();
    if parts.len() != than.len() || gains.len() < 3 {
        return false;
    }
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    let square: f64 = gains.iter().map(|gain| (gain - mean).powi(2)).sum();
    let product: f64 = gains.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum();
    // Correlated neighbours reduce the number of independent parts.
    let autocorrelation = if square > 0.0 { (product / square).clamp(0.0, 0.9) } else { 0.0 };
    let independent = (n * (1.0 - autocorrelation) / (1.0 + autocorrelation)).max(2.0);
    let std = (square / (n - 1.0) / independent).sqrt();
    let sums = (parts.iter().sum::<f64>(), than.iter().sum::<f64>());
    mean > t_quantile_975(independent - 1.0) * std && sums.0 < BETTER_PART * sums.1
}

/// Ratio of errors, in each of several trials, below which one is clearly smaller …
const CLEAR_PART: f64 = 0.9;
/// … if also below this ratio over all of them …
const CLEAR_PART_OVER_ALL: f64 = 0.8;

/// … and below this ratio after removal of offsets.
const CLEAR_PART_BESIDE_OFFSETS: f64 = 0.98;

/// Returns true if a plant leaves clearly less of the motion of some trials unexplained than
/// another, and not only because of a constant force in each.
fn leaves_less(own: &Score, than: &Score) -> bool {
    let below = |own: Option<f64>, than: Option<f64>, part: f64| {
        own.zip(than).is_some_and(|(own, than)| own < part * than)
    };
    let left = |score: &Score| score.r_squared.map(|r2| 1.0 - r2);
    // 1 − R² is a ratio of squared errors, so that the limit is squared.
    below(left(own), left(than), CLEARLY_BETTER_PART * CLEARLY_BETTER_PART)
        && below(own.offset_free_error, than.offset_free_error, CLEAR_PART_BESIDE_OFFSETS)
}

/// Ratio above which a position error is clearly larger.
const CLEARLY_LARGER: f64 = 1.2;

/// Returns true if the simulated position of a plant has a clearly larger error than another's,
/// where position was measured: a velocity sensor with a scale error fits the velocity of another
/// plant.
fn loses_position(own: &Scored, than: &Scored) -> bool {
    let pairs = own.of_trials().zip(than.of_trials());
    let (own, than) = pairs
        .filter_map(|(a, b)| a.position_mean_abs_error.zip(b.position_mean_abs_error))
        .fold((0.0, 0.0), |(own, than), (a, b)| (own + a, than + b));
    own > CLEARLY_LARGER * than
}

/// Returns true if a plant simulates each of several trials clearly better than another, and not
/// only because of a constant force in each: short trials have too few parts for [`is_better`].
fn is_better_throughout(own: &Scored, than: &Scored) -> bool {
    let below = |own: Option<f64>, than: Option<f64>, part: f64| {
        own.zip(than).is_some_and(|(own, than)| own < part * than)
    };
    // Where position was measured, velocity is derived from it and contains its noise.
    let error = |trial: &Score| trial.position_mean_abs_error.or(trial.mean_abs_error);
    let over_all = |scored: &Scored| -> Option<f64> {
        scored.of_trials().map(|trial| Some(error(trial)? * trial.samples as f64)).sum()
    };
    let mut pairs = own.of_trials().zip(than.of_trials());
    let free_errors = (own.score.offset_free_error, than.score.offset_free_error);
    own.trials.len() > 1
        && pairs.all(|(a, b)| below(error(a), error(b), CLEAR_PART))
        && below(over_all(own), over_all(than), CLEAR_PART_OVER_ALL)
        && below(free_errors.0, free_errors.1, CLEAR_PART_BESIDE_OFFSETS)
}

/// Returns the reason why a plant is physically impossible or undetermined; `speed` is the typical
/// speed.
pub(crate) fn impossible(
    fit: &Fit,
    vehicle: &Vehicle,
    speed: f64,
    tested: &Scored,
) -> Option<String> {
    let estimates = fit.estimates();
    let mass = estimates.mass;
    let name = if fit.dof.is_rotation() { "inertia" } else { "mass" };
    let units = fit.dof.units();
    if !(mass.value > 0.0 && mass.value.is_finite()) {
        return Some(format!("its {name} is {} {}", spoken(mass.value), units.mass));
    }
    if mass.std >= mass.value || mass.std.is_nan() {
        let known = estimated(mass.value, mass.std);
        return Some(format!("its {name} is {known} {}", units.mass));
    }
    let dry = vehicle.dry_mass_kg.filter(|_| !fit.dof.is_rotation());
    if let Some(dry) = dry.filter(|dry| mass.high95 < *dry) {
        let (high, dry) = (spoken(mass.high95), spoken(dry));
        return Some(format!("its mass is below {high} kg, while the vehicle has {dry} kg in air"));
    }
    let drag = drag_at(fit, speed);
    if drag.high95 < 0.0 {
        let (value, unit) = (spoken(drag.value), units.force);
        return Some(format!("its drag at {} {} is {value} {unit}", spoken(speed), units.velocity));
    }
    let has_run_away = tested.score.mean_abs_error.is_none();
    has_run_away.then(|| "its simulation diverges".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scored(parts: &[f64]) -> Scored {
        let mean_abs_error = Some(parts.iter().sum::<f64>() / parts.len() as f64);
        let score = Score { mean_abs_error, ..Score::default() };
        Scored { score, parts: parts.to_vec(), ..Scored::default() }
    }

    /// Returns errors about a mean with a deterministic scatter.
    fn errors(mean: f64, scatter: f64) -> Vec<f64> {
        (0..30).map(|k| mean + scatter * ((f64::from(k) * 0.618_034).fract() - 0.5)).collect()
    }

    fn contender<'a>(method: Method, tested: &'a Scored) -> Contender<'a> {
        Contender { method, impossible: None, tested: Some(tested), fitted: None }
    }

    #[test]
    fn recommends_the_first_unless_another_is_significantly_better() {
        let (first, equal) = (scored(&errors(1.0, 0.5)), scored(&errors(0.96, 0.5)));
        let clear = scored(&errors(0.7, 0.5));
        let choice = |other: &Scored| {
            choose(&[contender(Method::FilterError, &first), contender(Method::OutputError, other)])
        };
        assert_eq!(choice(&equal), Some(0));
        assert_eq!(choice(&clear), Some(1));
    }

    #[test]
    fn better_prediction_of_all_short_trials_counts() {
        let of = |errors: [f64; 3]| {
            let trial = |e: f64| {
                let score = Score { mean_abs_error: Some(e), samples: 1, ..Score::default() };
                ("a trial".to_owned(), score)
            };
            let mean = errors.iter().sum::<f64>() / 3.0;
            let trials = errors.map(trial).to_vec();
            let (mean_abs_error, offset_free_error) = (Some(mean), Some(mean));
            let score = Score { mean_abs_error, offset_free_error, ..Score::default() };
            Scored { score, trials, ..Scored::default() }
        };
        let first = of([1.0, 1.2, 0.8]);
        let choice = |errors: [f64; 3]| {
            let other = of(errors);
            choose(&[
                contender(Method::FilterError, &first),
                contender(Method::OutputError, &other),
            ])
        };
        assert_eq!(choice([0.6, 0.7, 0.6]), Some(1));
        assert_eq!(choice([0.4, 0.4, 0.8]), Some(0), "one trial is not predicted better");
        assert_eq!(choice([0.85, 1.0, 0.7]), Some(0), "hardly better over all");
        assert!(predicts_better(&of([0.6, 0.7, 0.6]), &first));
        assert!(!predicts_better(&of([0.4, 0.4, 0.8]), &first));
    }

    #[test]
    fn a_method_that_is_far_worse_in_fitted_and_unseen_trials_is_not_recommended() {
        let of = |r2: f64, e: f64| {
            let (r_squared, offset_free_error) = (Some(r2), Some(e));
            let score =
                Score { r_squared, offset_free_error, mean_abs_error: Some(e), ..Score::default() };
            Scored { score, ..Scored::default() }
        };
        let choice = |fitted: [&Scored; 2], tested: [&Scored; 2]| {
            let one = |k: usize, method| Contender {
                fitted: Some(fitted[k]),
                ..contender(method, tested[k])
            };
            choose(&[one(0, Method::FilterError), one(1, Method::OutputError)])
        };
        let (poor, good) = (of(0.64, 0.06), of(0.78, 0.045));
        assert_eq!(choice([&poor, &good], [&poor, &good]), Some(1));
        assert_eq!(choice([&good, &poor], [&poor, &good]), Some(0), "only unseen trials say so");
        assert_eq!(choice([&poor, &good], [&good, &poor]), Some(0), "only fitted trials say so");
        let offset = of(0.78, 0.06);
        assert_eq!(choice([&poor, &offset], [&poor, &offset]), Some(0), "by a constant force");
    }

    #[test]
    fn a_plant_that_simulates_fitted_trials_worse_is_not_recommended_for_unseen_ones() {
        let (first, other) = (scored(&errors(1.0, 0.5)), scored(&errors(0.7, 0.5)));
        let fitted = |e: f64| Scored {
            score: Score { offset_free_error: Some(e), ..Score::default() },
            ..Scored::default()
        };
        let choice = |of_first: f64, of_other: f64| {
            let (of_first, of_other) = (fitted(of_first), fitted(of_other));
            let one =
                Contender { fitted: Some(&of_first), ..contender(Method::FilterError, &first) };
            let two =
                Contender { fitted: Some(&of_other), ..contender(Method::OutputError, &other) };
            choose(&[one, two])
        };
        assert_eq!(choice(0.05, 0.04), Some(1));
        assert_eq!(choice(0.04, 0.05), Some(0));
        let (first, other) = (fitted(1.0), fitted(0.4));
        let (of_first, of_other) = (fitted(0.04), fitted(0.045));
        let with = |parts: &[f64], own: &Scored| Scored { parts: parts.to_vec(), ..own.clone() };
        let (first, other) = (with(&errors(1.0, 0.5), &first), with(&errors(0.4, 0.2), &other));
        let far = [
            Contender { fitted: Some(&of_first), ..contender(Method::FilterError, &first) },
            Contender { fitted: Some(&of_other), ..contender(Method::OutputError, &other) },
        ];
        assert_eq!(choose(&far), Some(1), "far better on unseen trials");
    }

    #[test]
    fn two_parts_of_a_trial_are_not_significant() {
        assert!(!is_better(&[0.1, 0.1], &[1.0, 1.0]));
        assert!(is_better(&[0.1; 8], &[1.0; 8]));
    }

    #[test]
    fn correlated_parts_count_once() {
        // A single long section of a trial causes the entire difference.
        let mut than = vec![1.0; 30];
        than[..8].iter_mut().for_each(|e| *e = 2.0);
        assert!(!is_better(&vec![1.0; 30], &than));
        let spread: Vec<f64> = (0..30).map(|k| if k % 4 == 0 { 2.0 } else { 1.0 }).collect();
        assert!(is_better(&vec![1.0; 30], &spread));
    }

    #[test]
    fn skips_impossible_plants_and_the_papers_method() {
        let good = scored(&errors(1.0, 0.1));
        let mut all = [
            contender(Method::FilterError, &good),
            contender(Method::Paper, &good),
            contender(Method::OutputError, &good),
        ];
        all[0].impossible = Some("its mass is -3 kg".to_owned());
        assert_eq!(choose(&all), Some(2));
        all[2].impossible = all[0].impossible.clone();
        assert_eq!(choose(&all), None);
        assert_eq!(choose(&[contender(Method::Paper, &good)]), Some(0));
    }
}
