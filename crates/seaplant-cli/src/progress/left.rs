//! Estimates how long fits will take: first from their sizes, then from the duration of the
//! completed ones.

use seaplant::Stage;

/// Ratio of elapsed to processor time for a fit that uses all cores.
const PARALLEL: f64 = 0.6;

/// Factor by which the remaining fits may be faster or slower than the completed ones.
const UNEVEN: f64 = 1.5;

/// Fraction of completed work from which the measured pace is used.
const SEEN: f64 = 0.1;

/// Returns the bounds of the duration of all fits, s elapsed.
pub fn total(stages: &[Stage]) -> (f64, f64) {
    let of = |cost_s: fn(&Stage) -> f64| stages.iter().map(cost_s).sum::<f64>();
    (PARALLEL * of(|stage| stage.cost_s.0), of(|stage| stage.cost_s.1))
}

/// Returns the bounds of the remaining time, s; `done` fits took `before_s`, and the next one has
/// taken `now_s`.
pub fn left(stages: &[Stage], done: usize, before_s: f64, now_s: f64) -> (f64, f64) {
    let usual = |stages: &[Stage]| stages.iter().map(Stage::usual_s).sum::<f64>();
    let (ended, rest) = stages.split_at(done.min(stages.len()));
    let (seen, of) = (usual(ended), usual(stages));
    if seen < SEEN * of {
        let (least, most) = total(rest);
        return ((least - now_s).max(0.0), (most - now_s).max(0.0));
    }
    let left = before_s / seen * usual(rest);
    ((left / UNEVEN - now_s).max(0.0), (UNEVEN * left - now_s).max(0.0))
}

/// Formats `10 s to 2 min`, each rounded up.
pub fn formatted((least, most): (f64, f64)) -> String {
    match (round(least), round(most)) {
        (_, most) if most < 2.0 => "a second".to_owned(),
        (least, most) if least < 1.0 => format!("up to {}", time(most)),
        (least, most) if least >= most => format!("about {}", time(most)),
        (least, most) => format!("{} to {}", time(least), time(most)),
    }
}

/// Rounds to 1, 2, 5, 10, 20 or 30, of seconds, minutes or hours.
fn round(seconds: f64) -> f64 {
    const STEPS: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 30.0];
    let units = [1.0, 60.0, 3600.0];
    let steps = units.iter().flat_map(|unit| STEPS.map(|step| unit * step));
    let distance = |step: &f64| (step / seconds).ln().abs();
    if seconds < 0.7 {
        return 0.0;
    }
    steps.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(seconds)
}

fn time(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{s:.0} s"),
        s if s < 3600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use seaplant::{Dof, Method};

    fn four_equal() -> Vec<Stage> {
        let of = |done| Stage {
            axes: vec![Dof::Surge],
            method: Method::FilterError,
            done,
            samples: 4800,
            cost_s: (1.0, 16.0),
        };
        (0..4).map(of).collect()
    }

    #[test]
    fn remaining_time_follows_from_sizes_at_first_and_then_from_the_pace() {
        let stages = four_equal();
        assert_eq!(total(&stages), (2.4, 64.0));
        let (least, most) = left(&stages, 0, 0.0, 2.0);
        assert!((least - 0.4).abs() < 1e-9 && most == 62.0);
        // The first took 30 s, so that the three others take 90 s, of which 10 s are over.
        assert_eq!(left(&stages, 1, 30.0, 10.0), (50.0, 125.0));
        // A fit that takes far longer than those before it may end at any moment.
        assert_eq!(left(&stages, 3, 9.0, 60.0), (0.0, 0.0));
        assert_eq!(left(&stages, 9, 9.0, 0.0), (0.0, 0.0));
        assert_eq!(left(&[], 0, 0.0, 0.0), (0.0, 0.0));
    }

    #[test]
    fn times_are_said_in_round_numbers() {
        for (range, words) in [
            ((2.4, 64.0), "2 s to 1 min"),
            ((0.2, 12.0), "up to 10 s"),
            ((48.0, 130.0), "1 min to 2 min"),
            ((28.0, 33.0), "about 30 s"),
            ((0.0, 0.3), "a second"),
            ((600.0, 9000.0), "10 min to 2 h"),
        ] {
            assert_eq!(formatted(range), words, "{range:?}");
        }
    }
}
