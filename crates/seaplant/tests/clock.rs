//! Offsets of clocks, found in recordings whose offset is known.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::twin::{Disturbance, TwinSpec, make};
use seaplant::{ClockOffset, Dof, Error, Quantity, Recording, Timed, Vehicle, estimate_offset};

/// A turn to and fro of many periods, none of which returns.
struct Turn {
    waves: Vec<[f64; 3]>,
}

impl Turn {
    fn new(rng: &mut ChaCha8Rng) -> Self {
        let wave = |_| {
            let hz: f64 = rng.random_range(0.01..0.6);
            [hz * TAU, rng.random_range(0.0..TAU), 0.02 / (0.2 + hz)]
        };
        Self { waves: (0..40).map(wave).collect() }
    }

    fn rate(&self, t: f64) -> f64 {
        self.waves.iter().map(|[w, phase, a]| a * (w * t + phase).cos()).sum()
    }

    fn heading(&self, t: f64) -> f64 {
        self.waves.iter().map(|[w, phase, a]| a / w * (w * t + phase).sin()).sum()
    }
}

/// A signal as an instrument logs it: every `period_s` over `span_s`, with noise, on a clock that
/// is `behind_s` behind.
struct Instrument {
    period_s: f64,
    span_s: [f64; 2],
    noise: f64,
    behind_s: f64,
}

impl Instrument {
    fn logs(&self, what: &str, rng: &mut ChaCha8Rng, of: impl Fn(f64) -> f64) -> Recording {
        let noise = Normal::new(0.0, self.noise).expect("a deviation");
        let [from_s, to_s] = self.span_s;
        let count = ((to_s - from_s) / self.period_s) as usize;
        let true_s: Vec<f64> = (0..count).map(|k| from_s + k as f64 * self.period_s).collect();
        let values: Vec<f64> = true_s.iter().map(|t| of(*t) + noise.sample(rng)).collect();
        let times: Vec<f64> = true_s.iter().map(|t| t - self.behind_s).collect();
        recording(what, Timed::new(what, times, values).expect("valid"))
    }
}

fn recording(what: &str, series: Timed) -> Recording {
    [(what.parse::<Quantity>().expect("a quantity"), series)].into()
}

const GYRO: Instrument =
    Instrument { period_s: 0.02, span_s: [0.0, 300.0], noise: 0.002, behind_s: 0.0 };
const COMPASS: Instrument =
    Instrument { period_s: 0.1, span_s: [20.0, 280.0], noise: 0.0017, behind_s: 0.0 };

fn gyro_and_compass(seed: u64, gyro: &Instrument, compass: &Instrument) -> [Recording; 2] {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let turn = Turn::new(rng);
    let rate = gyro.logs("rate.yaw", rng, |t| turn.rate(t));
    [rate, compass.logs("attitude.heading", rng, |t| turn.heading(t))]
}

fn between([reference, other]: &[Recording; 2]) -> ClockOffset {
    estimate_offset(reference, other, &Vehicle::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn why_not([reference, other]: &[Recording; 2]) -> String {
    match estimate_offset(reference, other, &Vehicle::default()) {
        Err(Error::ClockOffset { found, .. }) => found,
        other => panic!("{other:?}"),
    }
}

#[test]
fn offsets_whole_and_fractional_and_either_way_are_found_within_a_part_of_a_sample() {
    for (seed, behind_s) in [(1, 0.0), (2, 7.0), (3, -3.137), (4, 0.043), (5, 91.99), (6, -60.0)] {
        let found = between(&gyro_and_compass(seed, &GYRO, &Instrument { behind_s, ..COMPASS }));
        let off_s = found.offset_s - behind_s;
        assert!(off_s.abs() < 0.01, "{behind_s}: {found:?}");
        assert!(off_s.abs() < 4.0 * found.std_s && found.std_s < 0.02, "{behind_s}: {found:?}");
        let [pair] = &found.pairs[..] else { panic!("one pair") };
        assert_eq!(
            [pair.reference.as_str(), pair.other.as_str()],
            ["rate.yaw", "the rate of attitude.heading"]
        );
        assert!(pair.correlation > Some(0.9) && pair.second_peak < Some(0.3), "{pair:?}");
    }
}

/// How often the truth lies within 1.96 standard errors, and the mean square of errors in them.
fn coverage(runs: u64, gyro: &Instrument, compass: &Instrument) -> (f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let (mut within, mut squares) = (0.0, 0.0);
    for seed in 0..runs {
        let behind_s = rng.random_range(-40.0..40.0);
        let compass = Instrument { behind_s, ..*compass };
        let found = between(&gyro_and_compass(1000 + seed, gyro, &compass));
        let z = (found.offset_s - behind_s) / found.std_s;
        within += if z.abs() < 1.96 { 1.0 } else { 0.0 };
        squares += z * z;
    }
    (within / runs as f64, squares / runs as f64)
}

#[test]
fn intervals_hold_what_they_promise() {
    for (name, gyro, compass) in [
        ("as it is", GYRO, COMPASS),
        ("noisy", Instrument { noise: 0.05, ..GYRO }, Instrument { noise: 0.01, ..COMPASS }),
        ("equal rates", Instrument { period_s: 0.1, noise: 0.02, ..GYRO }, COMPASS),
        ("rates 2 % apart", Instrument { period_s: 0.098, noise: 0.02, ..GYRO }, COMPASS),
        ("slow", Instrument { period_s: 0.5, ..GYRO }, Instrument { period_s: 0.7, ..COMPASS }),
    ] {
        let (within, mean_square) = coverage(40, &gyro, &compass);
        assert!(within >= 0.85, "{name}: {within}, {mean_square}");
        // Far too wide would be no better than no interval; a thousandth of a second is enough.
        assert!(mean_square > 0.1 || name == "as it is", "{name}: {mean_square}");
    }
}

#[test]
fn clocks_of_other_epochs_are_brought_together() {
    let boot = Instrument { behind_s: -1_700_000_000.25, ..COMPASS };
    let found = between(&gyro_and_compass(7, &GYRO, &boot));
    assert!((found.offset_s + 1_700_000_000.25).abs() < 0.01, "{found:?}");
}

#[test]
fn a_short_record_is_found_anywhere_in_a_long_one() {
    let part = Instrument { span_s: [200.0, 260.0], behind_s: 200.0, ..COMPASS };
    let found = between(&gyro_and_compass(8, &GYRO, &part));
    assert!((found.offset_s - 200.0).abs() < 0.02, "{found:?}");
}

#[test]
fn gaps_in_either_record_do_no_harm() {
    let [rate, heading] = gyro_and_compass(9, &GYRO, &Instrument { behind_s: 5.5, ..COMPASS });
    let holed = |recording: &Recording, hole: [f64; 2]| {
        let (what, series) = recording.iter().next().expect("one series");
        let kept = series.time_s().iter().zip(series.values());
        let kept = kept.filter(|(t, _)| **t < hole[0] || **t > hole[1]);
        let (t, x): (Vec<f64>, Vec<f64>) = kept.unzip();
        recording_of(what, t, x)
    };
    let found = between(&[holed(&rate, [60.0, 81.0]), holed(&heading, [150.0, 170.0])]);
    assert!((found.offset_s - 5.5).abs() < 0.02, "{found:?}");
}

fn recording_of(what: &Quantity, t: Vec<f64>, x: Vec<f64>) -> Recording {
    recording(&what.to_string(), Timed::new("x", t, x).expect("valid"))
}

#[test]
fn of_a_sinusoid_every_period_is_as_good() {
    for (seed, noise) in [(1, 1e-5), (2, 0.002), (3, 0.02)] {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let w = TAU / 8.0;
        let gyro = Instrument { noise, ..GYRO };
        let compass = Instrument { noise, behind_s: 1.7, ..COMPASS };
        let rate = gyro.logs("rate.yaw", rng, |t| 0.1 * w * (w * t).cos());
        let heading = compass.logs("attitude.heading", rng, |t| 0.1 * (w * t).sin());
        let found = why_not(&[rate, heading]);
        assert!(
            found.contains("the motion is periodic") || found.contains("than by chance"),
            "{noise}: {found}"
        );
    }
}

#[test]
fn motions_of_other_days_are_not_brought_together() {
    for seed in 0..20 {
        let [rate, _] = gyro_and_compass(seed, &GYRO, &COMPASS);
        let [_, heading] = gyro_and_compass(seed + 500, &GYRO, &COMPASS);
        why_not(&[rate, heading]);
    }
}

#[test]
fn a_sign_that_is_turned_is_told() {
    let [rate, heading] = gyro_and_compass(4, &GYRO, &Instrument { behind_s: 3.0, ..COMPASS });
    let turned = rate.iter().map(|(what, series)| (what.clone(), series.map(|x| -x))).collect();
    let found = why_not(&[turned, heading]);
    assert!(found.contains("they have opposite signs at 3."), "{found}");
    assert!(found.contains("negate = true"), "{found}");
}

#[test]
fn a_clock_that_was_set_by_years_is_refused_in_no_time() {
    let [rate, heading] = gyro_and_compass(4, &GYRO, &COMPASS);
    let leap = |(what, series): (&Quantity, &Timed)| {
        let late = |t: &f64| if *t < 150.0 { *t } else { *t + 1.6e9 };
        recording_of(what, series.time_s().iter().map(late).collect(), series.values().to_vec())
    };
    let rate = rate.iter().map(leap).next().expect("one series");
    assert!(why_not(&[rate, heading]).starts_with("the files have no quantity in common"));
}

#[test]
fn files_that_share_nothing_are_refused_with_what_would_do() {
    let [rate, _] = gyro_and_compass(1, &GYRO, &COMPASS);
    let depth = COMPASS.logs("depth", &mut ChaCha8Rng::seed_from_u64(1), |t| (0.1 * t).sin());
    assert!(why_not(&[rate, depth]).starts_with("the files have no quantity in common to compare"));
}

/// The fitted trial of a degree of freedom of a twin, in two parts of which the second is
/// behind.
fn parted(spec: &TwinSpec, dof: Dof, behind_s: f64, part: &str) -> ([Recording; 2], Vehicle) {
    let twin = make(spec).expect("the twin can be made");
    let trial = twin.trials.iter().find(|trial| trial.dofs == [dof]).expect("a trial");
    let (other, reference): (Recording, Recording) = trial
        .recording
        .clone()
        .into_iter()
        .partition(|(what, _)| what.to_string().starts_with(part));
    let other = other.iter().map(|(what, x)| (what.clone(), x.shifted(-behind_s))).collect();
    ([reference, other], twin.vehicle)
}

#[test]
fn thrust_tells_the_clock_of_what_it_moves() {
    for (dof, part) in [(Dof::Surge, "dvl"), (Dof::Sway, "dvl"), (Dof::Yaw, "attitude")] {
        let spec = TwinSpec { duration_s: 240.0, dofs: [dof].into(), ..TwinSpec::jason2() };
        let ([reference, other], vehicle) = parted(&spec, dof, 12.34, part);
        let found = estimate_offset(&reference, &other, &vehicle)
            .unwrap_or_else(|error| panic!("{dof}: {error}"));
        assert!((found.offset_s - 12.34).abs() < 0.05, "{dof}: {found:?}");
        // A lag of thrusters would look the same.
        assert!((0.3..0.4).contains(&found.std_s), "{dof}: {found:?}");
    }
}

#[test]
fn the_lag_of_thrusters_is_within_the_interval_of_an_offset_from_thrust() {
    let disturbances = [Disturbance::Lag, Disturbance::Delay, Disturbance::Tether].into();
    let spec = TwinSpec { duration_s: 240.0, disturbances, ..TwinSpec::jason2() };
    let ([reference, other], vehicle) = parted(&spec, Dof::Surge, -4.0, "dvl");
    let found =
        estimate_offset(&reference, &other, &vehicle).unwrap_or_else(|error| panic!("{error}"));
    let late_s = found.offset_s + 4.0;
    // Motion follows late, as if its clock were ahead.
    assert!(late_s < 0.0 && late_s.abs() < 2.0 * found.std_s, "{found:?}");
}

#[test]
fn depth_tells_the_clock_of_a_dvl_that_goes_up_and_down() {
    let spec = TwinSpec { duration_s: 480.0, dofs: [Dof::Heave].into(), ..TwinSpec::jason2() };
    let ([reference, other], vehicle) = parted(&spec, Dof::Heave, 12.34, "dvl");
    let found =
        estimate_offset(&reference, &other, &vehicle).unwrap_or_else(|error| panic!("{error}"));
    assert!((found.offset_s - 12.34).abs() < 0.2 && found.std_s < 0.5, "{found:?}");
    assert_eq!(found.pairs[0].reference, "the rate of depth");
}
