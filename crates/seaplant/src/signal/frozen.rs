use crate::Timed;
use crate::series::median;

/// Fewer samples do not show how seldom a signal repeats itself.
const LEAST_SAMPLES: usize = 50;

/// Least number of equal samples, one after the other, that are not equal by chance.
const LEAST_RUN: usize = 3;

/// A signal of which more than this part of the values are repeated is logged faster than it is measured, or
/// in coarse steps.
const MOST_REPEATED: f64 = 0.05;

/// Least jump after a run, in median steps of the signal: it went on while the sensor did not.
const LEAST_JUMP: f64 = 3.0;

/// Returns the indices of samples in which a sensor froze: they repeat the sample before, which others of the
/// signal do not, and the signal jumps when they end.
pub(crate) fn frozen(series: &Timed) -> Vec<usize> {
    let x = series.values();
    let runs = || x.chunk_by(|a, b| a == b);
    // However long it lasts, a sensor that freezes repeats one value.
    let repeated = runs().filter(|run| run.len() > 1).count();
    if x.len() < LEAST_SAMPLES || repeated as f64 > MOST_REPEATED * runs().count() as f64 {
        return Vec::new();
    }
    let steps = x.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    let least = LEAST_JUMP * median(&mut steps).unwrap_or(0.0);
    let mut found = Vec::new();
    let mut first = 0;
    for run in runs() {
        let end = first + run.len();
        let jumps = x.get(end).is_some_and(|next| (next - x[first]).abs() > least);
        if run.len() >= LEAST_RUN && jumps {
            found.extend(first + 1..end);
        }
        first = end;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: Vec<f64>) -> Timed {
        let time_s: Vec<f64> = (0..values.len()).map(|k| 0.1 * k as f64).collect();
        Timed::new("v", time_s, values).expect("valid")
    }

    fn waves(k: usize) -> f64 {
        0.3 * (0.2 * k as f64).sin() + 1e-4 * (k * k % 17) as f64
    }

    #[test]
    fn samples_that_repeat_one_while_the_signal_moves_on_are_frozen() {
        let mut values: Vec<f64> = (0..200).map(waves).collect();
        values[71..76].fill(waves(70));
        assert_eq!(frozen(&series(values)), [71, 72, 73, 74, 75]);
    }

    #[test]
    fn a_sensor_that_froze_for_half_of_the_log_is_told() {
        let mut values: Vec<f64> = (0..200).map(waves).collect();
        values[51..158].fill(waves(50));
        assert_eq!(frozen(&series(values)), (51..158).collect::<Vec<_>>());
    }

    #[test]
    fn a_vehicle_at_rest_a_coarse_sensor_and_a_fast_log_are_not_frozen() {
        let rest = (0..200_usize).map(|k| 0.3 * (0.02 * k.saturating_sub(9) as f64).sin());
        assert!(frozen(&series(rest.collect())).is_empty());
        let coarse = (0..200).map(|k| (waves(k) / 0.05).round() * 0.05);
        assert!(frozen(&series(coarse.collect())).is_empty());
        let fast = (0..200).map(|k| waves(k / 5 * 5));
        assert!(frozen(&series(fast.collect())).is_empty());
    }
}
