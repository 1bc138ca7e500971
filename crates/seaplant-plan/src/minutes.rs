//! Minutes of manoeuvres in whole steps.

use crate::allocate::Program;

/// Resolution of minutes.
pub(crate) const STEP_MIN: f64 = 0.5;

/// Minimum duration of a manoeuvre in steps of time.
const LEAST_STEPS: f64 = 2.0;

/// Rounds shares of the time to complete steps, at least two for a manoeuvre that is driven.
pub(crate) fn rounded(shares: &[f64], minutes: f64) -> Vec<f64> {
    let steps = (minutes / STEP_MIN).round().max(LEAST_STEPS);
    let exact: Vec<f64> = shares.iter().map(|share| share * steps).collect();
    let least = |x: &f64| if *x > 0.0 { x.floor().max(LEAST_STEPS) } else { 0.0 };
    let mut whole: Vec<f64> = exact.iter().map(least).collect();
    let mut order: Vec<usize> = (0..exact.len()).filter(|k| exact[*k] > 0.0).collect();
    order.sort_by(|a, b| (exact[*b] - whole[*b]).total_cmp(&(exact[*a] - whole[*a])));
    let left = (steps - whole.iter().sum::<f64>()).max(0.0) as usize;
    for k in order.iter().cycle().take(if order.is_empty() { 0 } else { left }) {
        whole[*k] += 1.0;
    }
    whole.iter().map(|x| x * STEP_MIN).collect()
}

/// Returns minutes that meet all goals, near given ones: steps are added where they narrow the widest interval most, up
/// to `most` minutes in all; then, if that is allowed, manoeuvres and steps of them that the goals do not need are left
/// out. Returns `None` if the goals cannot be met.
///
/// Short plans are far from their shares of the time, as no manoeuvre is driven for less than a minute: some then get
/// too little, and others are not worth a minute.
pub(crate) fn enough(
    program: &Program,
    mut minutes: Vec<f64>,
    most: f64,
    may_leave_out: bool,
) -> Option<Vec<f64>> {
    let driven: Vec<usize> = (0..minutes.len()).filter(|k| minutes[*k] > 0.0).collect();
    let mut at = Widths::after(program, &minutes);
    while at.widest > 1.0 && minutes.iter().sum::<f64>() + STEP_MIN <= most {
        let longer = |k: usize| with(&minutes, k, minutes[k] + STEP_MIN);
        let (longer, reached) = best(program, driven.iter().map(|k| longer(*k)))?;
        if reached.widest >= at.widest {
            return None;
        }
        (minutes, at) = (longer, reached);
    }
    if at.widest > 1.0 {
        return None;
    }
    let is_enough = |(_, at): &(Vec<f64>, Widths)| may_leave_out && at.widest <= 1.0;
    while let Some((shorter, _)) = shorter(program, &minutes, SHORT_MIN).filter(is_enough) {
        minutes = shorter;
    }
    Some(minutes)
}

/// Of manoeuvres that take longer than this, minutes, half a minute more or less is within their rounding.
const SHORT_MIN: f64 = 5.0;

/// Returns at most so many minutes in all, if the goals can be told in them: those steps are left out that widen the
/// widest interval least.
pub(crate) fn within(program: &Program, mut minutes: Vec<f64>, most: f64) -> Vec<f64> {
    while minutes.iter().sum::<f64>() > most {
        let found =
            shorter(program, &minutes, f64::INFINITY).filter(|(_, at)| at.widest.is_finite());
        let Some((shorter, _)) = found else { break };
        minutes = shorter;
    }
    minutes
}

/// Returns minutes with a step less of a manoeuvre that takes at most so many, or without one of the least duration: the
/// best that can be had so.
fn shorter(program: &Program, minutes: &[f64], most: f64) -> Option<(Vec<f64>, Widths)> {
    let fewer = |k: usize| match minutes[k] > LEAST_STEPS * STEP_MIN {
        true => minutes[k] - STEP_MIN,
        false => 0.0,
    };
    let driven = (0..minutes.len()).filter(|k| minutes[*k] > 0.0 && minutes[*k] <= most);
    best(program, driven.map(|k| with(minutes, k, fewer(k))))
}

/// Returns the minutes after which intervals are narrowest.
fn best(program: &Program, choices: impl Iterator<Item = Vec<f64>>) -> Option<(Vec<f64>, Widths)> {
    let all = choices.map(|minutes| {
        let widths = Widths::after(program, &minutes);
        (minutes, widths)
    });
    all.min_by(|a, b| a.1.order().total_cmp(&b.1.order()))
}

/// Intervals after some minutes, squared, in units of their goals; infinite where a goal is not told.
#[derive(Clone, Copy)]
struct Widths {
    widest: f64,
    sum: f64,
}

/// Weight of the sum of all intervals beside the widest one, which decides where this is the same.
const OF_SUM: f64 = 1e-3;

impl Widths {
    /// Computes the intervals after minutes of each manoeuvre.
    fn after(program: &Program, minutes: &[f64]) -> Self {
        let is_driven = minutes.iter().any(|x| *x > 0.0);
        let shares: Vec<f64> = minutes.iter().map(|x| 60.0 * x / program.seconds).collect();
        let ratios = if is_driven { program.ratios(&shares) } else { None };
        ratios.map_or(Self { widest: f64::INFINITY, sum: f64::INFINITY }, |ratios| Self {
            widest: ratios.iter().copied().fold(0.0, f64::max),
            sum: ratios.iter().sum(),
        })
    }

    fn order(self) -> f64 {
        self.widest + OF_SUM * self.sum
    }
}

fn with(minutes: &[f64], place: usize, own: f64) -> Vec<f64> {
    let mut changed = minutes.to_vec();
    changed[place] = own;
    changed
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, dmatrix};

    use super::*;
    use crate::allocate::{Criterion, Target};

    #[test]
    fn minutes_are_multiples_of_a_half_and_nothing_is_driven_for_seconds() {
        let minutes = rounded(&[0.505, 0.31, 0.185, 0.0], 10.0);
        assert_eq!(minutes.iter().sum::<f64>(), 10.0);
        assert_eq!(minutes[3], 0.0);
        assert!(minutes[..3].iter().all(|x| *x >= 1.0 && (x / STEP_MIN).fract() == 0.0));
    }

    /// Two numbers of which manoeuvres tell 1/`s` a minute: one manoeuvre for each, and one that tells the first less
    /// well.
    fn program(per_minute: [f64; 3]) -> Program {
        let [first, second, third] = per_minute.map(|x| x / 60.0);
        let rates = [
            dmatrix![first, 0.0; 0.0, 0.0],
            dmatrix![0.0, 0.0; 0.0, second],
            dmatrix![third, 0.0; 0.0, 0.0],
        ];
        Program {
            rates: rates.map(|rate| vec![rate]).to_vec(),
            before: DMatrix::zeros(2, 2),
            targets: [dmatrix![1.0; 0.0], dmatrix![0.0; 1.0]]
                .map(|g| Target { weights: vec![g], std: 1.0 })
                .to_vec(),
            criterion: Criterion::Worst,
            seconds: 180.0,
            power: None,
        }
    }

    #[test]
    fn a_short_plan_meets_its_goals_and_drives_nothing_else() {
        // The first goal is met at once; the second takes 2.4 minutes of its manoeuvre.
        let program = program([50.0, 1.0 / 2.4, 5.0]);
        let of =
            |may_leave_out| enough(&program, rounded(&[0.1, 0.8, 0.1], 3.0), 30.0, may_leave_out);
        assert_eq!(of(true), Some(vec![1.0, 2.5, 0.0]));
        assert_eq!(of(false), Some(vec![1.0, 2.5, 1.0]));
    }

    #[test]
    fn minutes_that_were_asked_for_are_kept() {
        let minutes = within(&program([50.0, 1.0 / 2.4, 5.0]), vec![1.0, 2.0, 1.0], 2.5);
        assert_eq!(minutes, [1.0, 1.5, 0.0]);
        // Without one of these the trial tells nothing of a goal.
        assert_eq!(within(&program([50.0, 1.0, 0.0]), vec![1.0, 1.0, 1.0], 1.0), [1.0, 1.0, 0.0]);
    }

    #[test]
    fn goals_that_take_too_long_are_not_met() {
        assert_eq!(enough(&program([50.0, 0.01, 5.0]), vec![1.0, 1.0, 0.0], 4.0, true), None);
    }
}
