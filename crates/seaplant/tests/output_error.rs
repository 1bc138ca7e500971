//! Output error on motion whose plant is known.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::estimate::{Loss, OutputError, OutputErrorBootstrap, OutputErrorIntervals, Records};
use seaplant::{
    AxisRecord, Dof, Error, Fit, LumpedParameters, Motion, PhysicalParameters, State, Terms, Timed,
    simulate,
};

const SURGE: PhysicalParameters =
    PhysicalParameters { mass: 12970.0, d_quadratic: 2231.0, d_linear: 150.0, bias_force: -255.0 };

/// What is left where a simulation is fitted by itself, relative: steps of 0.05 s in the
/// one, of 0.1 s in the other.
const EXACT: f64 = 3e-6;

fn all_terms() -> Terms {
    "force,quadratic,linear,bias".parse().expect("a plant")
}

fn times(seconds: f64) -> Vec<f64> {
    (0..=(10.0 * seconds) as u32).map(|k| 0.1 * f64::from(k)).collect()
}

/// A sinusoid and steps of five to twenty seconds.
fn thrust(times: &[f64], seed: u64) -> Timed {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut level, mut until) = (0.0, 0.0);
    let at = |&t: &f64| {
        if t >= until {
            until = t + random.random_range(5.0..20.0);
            level = random.random_range(-600.0..600.0);
        }
        1500.0 * (0.785 * t).sin() + level
    };
    let values: Vec<f64> = times.iter().map(at).collect();
    Timed::new("thrust", times, values).expect("valid")
}

fn moved(plant: &PhysicalParameters, force: &Timed, start: State) -> (Vec<f64>, Vec<f64>) {
    let response = simulate(Dof::Surge, &plant.to_lumped(), force, start, force.time_s());
    let response = response.expect("a stable plant");
    (response.velocity, response.position)
}

fn axis(force: Timed, motion: Motion) -> AxisRecord {
    AxisRecord {
        dof: Dof::Surge,
        trial: "surge 1".to_owned(),
        force,
        thrusters: Vec::new(),
        motion,
        lever_rates: None,
        turning: None,
        position: None,
        acceleration: None,
        cuts: Vec::new(),
    }
}

fn velocity_axis(force: Timed, v: Vec<f64>) -> AxisRecord {
    let velocity = force.with_values("velocity", v).expect("finite");
    axis(force, Motion::Velocity(velocity))
}

fn position_axis(force: Timed, x: Vec<f64>) -> AxisRecord {
    let position = force.with_values("position", x).expect("finite");
    axis(force, Motion::Position(position))
}

fn noisy(mut values: Vec<f64>, std: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
    let noise = Normal::new(0.0, std).expect("a positive deviation");
    values.iter_mut().for_each(|x| *x += noise.sample(&mut random));
    values
}

fn fit_with(axes: &[AxisRecord], terms: Terms, loss: Loss) -> Result<Fit, Error> {
    let method = OutputError { loss, ..Default::default() };
    method.fit(Records::from(axes).with_terms(terms))
}

fn fit(axes: &[AxisRecord]) -> Fit {
    fit_with(axes, all_terms(), Loss::Squares).expect("an optimum")
}

/// The largest relative error of mass, drags and bias force.
fn worst(found: PhysicalParameters, truth: PhysicalParameters) -> f64 {
    let off = |found: f64, truth: f64| (found / truth - 1.0).abs();
    off(found.mass, truth.mass)
        .max(off(found.d_quadratic, truth.d_quadratic))
        .max(off(found.d_linear, truth.d_linear))
        .max(off(found.bias_force, truth.bias_force))
}

const MOVING: State = State { position: 3.0, velocity: 0.3 };

#[test]
fn finds_a_plant_from_its_own_velocity() {
    let force = thrust(&times(300.0), 1);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let found = fit(&[velocity_axis(force, v)]);
    let worst = worst(found.physical(), SURGE);
    assert!(worst < EXACT, "{worst:e}");
    assert!(found.residual_rms < 1e-7, "{}", found.residual_rms);
}

#[test]
fn finds_a_plant_from_its_own_position() {
    let force = thrust(&times(300.0), 1);
    let (_, x) = moved(&SURGE, &force, MOVING);
    let found = fit(&[position_axis(force, x)]);
    let worst = worst(found.physical(), SURGE);
    assert!(worst < EXACT, "{worst:e}");
}

#[test]
fn measures_and_thrusts_at_times_of_their_own() {
    // Thrust changes every 0.37 s, velocity is measured at uneven times around 0.23 s.
    let force_s: Vec<f64> = (0..900).map(|k| 0.37 * f64::from(k)).collect();
    let force = thrust(&force_s, 5);
    let times: Vec<f64> =
        (0..1300).map(|k| 0.23 * f64::from(k) + 0.1 * (7.3 * f64::from(k)).sin() + 0.2).collect();
    let response =
        simulate(Dof::Surge, &SURGE.to_lumped(), &force, MOVING, &times).expect("a stable plant");
    let velocity = Timed::new("velocity", times, response.velocity).expect("valid");
    let found = fit(&[axis(force, Motion::Velocity(velocity))]);
    let worst = worst(found.physical(), SURGE);
    assert!(worst < EXACT, "{worst:e}");
}

#[test]
fn several_trials_share_a_plant_but_not_its_start() {
    let starts = [0.0, 0.8, -0.6];
    let trial = |(k, velocity): (usize, f64)| {
        let force = thrust(&times(80.0), 20 + k as u64);
        let (v, x) = moved(&SURGE, &force, State { position: 0.0, velocity });
        // Velocity was measured in two of them, position in one.
        if k == 1 { position_axis(force, x) } else { velocity_axis(force, v) }
    };
    let axes: Vec<AxisRecord> = starts.into_iter().enumerate().map(trial).collect();
    let worst = worst(fit(&axes).physical(), SURGE);
    assert!(worst < EXACT, "{worst:e}");
}

#[test]
fn starts_anew_after_a_gap_in_force() {
    let times = times(400.0);
    let whole = thrust(&times, 3);
    let (v, _) = moved(&SURGE, &whole, MOVING);
    let is_logged = |t: &f64| !(150.0..=170.0).contains(t);
    let logged: Vec<f64> = times.iter().copied().filter(is_logged).collect();
    let taus: Vec<f64> = logged.iter().map(|&t| whole.held_at(t)).collect();
    let force = Timed::new("thrust", logged, taus).expect("valid");
    let velocity = whole.with_values("velocity", v).expect("finite");
    let found = fit(&[axis(force, Motion::Velocity(velocity))]);
    let worst = worst(found.physical(), SURGE);
    assert!(worst < EXACT, "{worst:e}");
    assert!(found.samples < 3850, "{} samples, some of them in the gap", found.samples);
}

#[test]
fn coasts_as_the_closed_form_does() {
    // v = v₀ / (1 + d v₀ t / m): without thrust only β shows, so thrust kicks once.
    let (mass, d) = (500.0, 200.0);
    let times = times(60.0);
    let kick = times.iter().map(|&t| if t < 0.95 { 1000.0 } else { 0.0 }).collect::<Vec<_>>();
    let force = Timed::new("thrust", times.as_slice(), kick).expect("valid");
    let exact = |&t: &f64| {
        let (top, rate) = ((1000.0_f64 / d).sqrt(), (1000.0 * d).sqrt() / mass);
        let after = top * (rate).tanh();
        if t <= 1.0 {
            top * (rate * t).tanh()
        } else {
            after / (1.0 + d * after * (t - 1.0) / mass)
        }
    };
    let v = times.iter().map(exact).collect();
    let terms: Terms = "force,quadratic".parse().expect("a plant");
    let found = fit_with(&[velocity_axis(force, v)], terms, Loss::Squares).expect("an optimum");
    let physical = found.physical();
    assert!((physical.mass / mass - 1.0).abs() < EXACT, "{}", physical.mass);
    assert!((physical.d_quadratic / d - 1.0).abs() < EXACT, "{}", physical.d_quadratic);
}

/// A push of 60 N that changes within 30 s, as a tether's, added to the thrust that is
/// not logged.
fn pushed(force: &Timed, seed: u64) -> Timed {
    let mut random = ChaCha8Rng::seed_from_u64(2000 + seed);
    let noise = Normal::new(0.0, 1.0).expect("a positive deviation");
    let keep = (-0.1_f64 / 30.0).exp();
    let mut push = 60.0 * noise.sample(&mut random);
    let with_push = |tau: &f64| {
        push = keep * push + 60.0 * (1.0 - keep * keep).sqrt() * noise.sample(&mut random);
        tau + push
    };
    let taus: Vec<f64> = force.values().iter().map(with_push).collect();
    force.with_values("thrust and push", taus).expect("finite")
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// As squares of position itself would have it, drag comes out four times as far off.
const POSITION_OVER_VELOCITY: f64 = 1.3;

#[test]
fn a_slow_push_costs_a_position_record_no_more_than_a_velocity_record() {
    let plant = PhysicalParameters { d_linear: 0.0, ..SURGE };
    let (mut by_velocity, mut by_position) = (Vec::new(), Vec::new());
    for seed in 0..15 {
        let force = thrust(&times(480.0), seed);
        let (v, x) = moved(&plant, &pushed(&force, seed), MOVING);
        let error = |axis| {
            let found = fit_with(&[axis], Terms::default(), Loss::Squares).expect("an optimum");
            (found.physical().d_quadratic / plant.d_quadratic - 1.0).abs()
        };
        by_velocity.push(error(velocity_axis(force.clone(), noisy(v, 0.003, seed))));
        by_position.push(error(position_axis(force, noisy(x, 0.002, seed))));
    }
    let (velocity, position) = (median(by_velocity), median(by_position));
    assert!(position < POSITION_OVER_VELOCITY * velocity, "{position} and {velocity}");
}

#[test]
fn velocity_and_position_at_their_own_times_say_more_than_either() {
    let (mut velocity, mut position, mut both) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..15 {
        let force = thrust(&times(300.0), seed);
        let (v, x) = moved(&SURGE, &force, MOVING);
        let v = noisy(v, 0.05, seed);
        // A position every 1.7 s, as rough beside it.
        let path = force.with_values("path", noisy(x, 0.05, 100 + seed)).expect("finite");
        let sparse: Vec<usize> = (0..path.len()).step_by(17).collect();
        let at = |series: &[f64]| sparse.iter().map(|&k| series[k]).collect::<Vec<f64>>();
        let path = Timed::new("path", at(path.time_s()), at(path.values())).expect("valid");
        let error = |axis| (fit(&[axis]).physical().bias_force / SURGE.bias_force - 1.0).abs();
        let with_path = |axis| AxisRecord { position: Some(path.clone()), ..axis };
        velocity.push(error(velocity_axis(force.clone(), v.clone())));
        position.push(error(axis(force.clone(), Motion::Position(path.clone()))));
        both.push(error(with_path(velocity_axis(force, v))));
    }
    let [velocity, position, both] = [velocity, position, both].map(median);
    assert!(both < velocity && both < position, "{both}, not {velocity} or {position}");
}

#[test]
fn finds_a_plant_from_velocity_and_position_that_agree() {
    let force = thrust(&times(300.0), 1);
    let (v, x) = moved(&SURGE, &force, MOVING);
    let position = force.with_values("position", x).expect("finite");
    let axis = AxisRecord { position: Some(position), ..velocity_axis(force, v) };
    let found = fit(&[axis]);
    assert_eq!(found.samples, 6002);
    let worst = worst(found.physical(), SURGE);
    assert!(worst < EXACT, "{worst:e}");
}

/// 95 % intervals of 60 trials cover 57 of them; outside of these bounds
/// chance takes them less than once in a hundred times.
const COVERAGE_PERCENT: std::ops::RangeInclusive<f64> = 88.0..=100.0;
const SEEDS: u64 = 60;

/// The part of 60 trials whose intervals hold the truth, in %, by parameter.
fn coverage(truth: PhysicalParameters, fit_of: impl Fn(u64) -> Fit) -> Vec<(&'static str, f64)> {
    let mut covered = [0_u64; 4];
    for seed in 0..SEEDS {
        let found = fit_of(seed).estimates();
        let hits = [
            found.mass.covers(truth.mass),
            found.d_quadratic.is_none_or(|d| d.covers(truth.d_quadratic)),
            found.d_linear.is_none_or(|d| d.covers(truth.d_linear)),
            found.bias_force.is_none_or(|b| b.covers(truth.bias_force)),
        ];
        covered.iter_mut().zip(hits).for_each(|(covered, hit)| *covered += u64::from(hit));
    }
    let percent = |covered: u64| 100.0 * covered as f64 / SEEDS as f64;
    ["mass", "d_Q", "d_L", "bias force"].into_iter().zip(covered.map(percent)).collect()
}

fn assert_covered(coverage: Vec<(&str, f64)>) {
    for (name, percent) in coverage {
        assert!(COVERAGE_PERCENT.contains(&percent), "{name}: {percent} %");
    }
}

#[test]
fn intervals_cover_the_plant_of_noisy_velocity() {
    assert_covered(coverage(SURGE, |seed| {
        let force = thrust(&times(300.0), seed);
        let (v, _) = moved(&SURGE, &force, MOVING);
        fit(&[velocity_axis(force, noisy(v, 0.003, seed))])
    }));
}

/// Twenty minutes of a push that lasts half a minute, in a vehicle that forgets within
/// another: eight minutes are too few, and cover the bias force in 82 %.
const PUSHED_S: f64 = 1200.0;

#[test]
fn intervals_cover_the_plant_that_is_slowly_pushed() {
    let plant = PhysicalParameters { d_linear: 0.0, ..SURGE };
    for as_position in [false, true] {
        assert_covered(coverage(plant, |seed| {
            let force = thrust(&times(PUSHED_S), seed);
            let (v, x) = moved(&plant, &pushed(&force, seed), MOVING);
            let axis = match as_position {
                true => position_axis(force, noisy(x, 0.002, seed)),
                false => velocity_axis(force, noisy(v, 0.003, seed)),
            };
            fit_with(&[axis], Terms::default(), Loss::Squares).expect("an optimum")
        }));
    }
}

/// What 60 trials and 200 draws each tell of a standard deviation.
const BOOTSTRAP_RATIO: std::ops::RangeInclusive<f64> = 0.75..=1.4;

#[test]
fn a_bootstrap_spreads_as_new_trials_do() {
    let bootstrap = OutputError {
        intervals: OutputErrorIntervals::Bootstrap { draws: 60, seed: 1 },
        ..Default::default()
    };
    let force = thrust(&times(200.0), 1);
    let (v, x) = moved(&SURGE, &force, MOVING);
    for as_position in [false, true] {
        let (mut masses, mut variances) = (Vec::new(), Vec::new());
        for seed in 0..SEEDS {
            let axes = [match as_position {
                true => position_axis(force.clone(), noisy(x.clone(), 0.002, seed)),
                false => velocity_axis(force.clone(), noisy(v.clone(), 0.003, seed)),
            }];
            let records = Records::from(&axes).with_terms(all_terms());
            let found = bootstrap.fit_from(records, &SURGE.to_lumped());
            let mass = found.expect("an optimum").estimates().mass;
            masses.push(mass.value);
            variances.push(mass.std.powi(2));
        }
        let n = masses.len() as f64;
        let mean = masses.iter().sum::<f64>() / n;
        let spread = (masses.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let ratio = (variances.iter().sum::<f64>() / n).sqrt() / spread;
        assert!(BOOTSTRAP_RATIO.contains(&ratio), "position: {as_position}, {ratio}");
    }
}

#[test]
fn a_bootstrap_draws_alike_in_any_order_and_refuses_too_few() {
    let force = thrust(&times(100.0), 1);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let axes = [velocity_axis(force, noisy(v, 0.003, 1))];
    let start = SURGE.to_lumped();
    let options = OutputError {
        intervals: OutputErrorIntervals::Bootstrap { draws: 60, seed: 5 },
        ..Default::default()
    };
    let records = Records::from(&axes).with_terms(all_terms());
    let whole = options.fit_from(records, &start);
    let (fit, bootstrap) = OutputErrorBootstrap::of(records, &start, &options).expect("an optimum");
    let mut draws: Vec<_> = (0..60).rev().filter_map(|number| bootstrap.draw(5, number)).collect();
    draws.reverse();
    assert_eq!(bootstrap.fit_with(&fit, &draws), whole);
    assert_ne!(bootstrap.draw(5, 0), bootstrap.draw(6, 0));
    let refused = bootstrap.fit_with(&fit, &draws[..20]);
    assert_eq!(refused, Err(Error::FewDraws { found: 20, needed: 50 }));
}

/// 2 % of 1 m/s bend a bias force by some tens of newtons, as squares see it; to Huber's
/// loss each is as large as one of 1.345 standard deviations of 3 mm/s.
const SQUARES_AT_LEAST_N: f64 = 5.0;
const HUBER_AT_MOST_N: f64 = 1.5;

#[test]
fn hubers_loss_shrugs_off_outliers() {
    let truth = PhysicalParameters { d_linear: 0.0, ..SURGE };
    let force = thrust(&times(300.0), 8);
    let (v, _) = moved(&truth, &force, MOVING);
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut v = noisy(v, 0.003, 8);
    v.iter_mut().filter(|_| random.random_bool(0.02)).for_each(|v| *v += 1.0);
    let axes = [velocity_axis(force, v)];
    let error = |loss| {
        let found = fit_with(&axes, Terms::default(), loss).expect("an optimum").physical();
        (found.bias_force - truth.bias_force).abs()
    };
    let (huber, squares) = (error(Loss::Huber(1.345)), error(Loss::Squares));
    assert!(squares > SQUARES_AT_LEAST_N, "squares: {squares} N");
    assert!(huber < HUBER_AT_MOST_N, "Huber: {huber} N");
}

#[test]
fn hubers_loss_costs_little_without_outliers() {
    let force = thrust(&times(300.0), 9);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let axes = [velocity_axis(force, noisy(v, 0.003, 9))];
    let huber = fit_with(&axes, all_terms(), Loss::Huber(1.345)).expect("an optimum").estimates();
    let squares = fit(&axes).estimates();
    let off = (huber.mass.value - squares.mass.value).abs() / squares.mass.std;
    assert!(off < 1.0, "{off} standard deviations");
    let ratio = huber.mass.std / squares.mass.std;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn refuses_a_huber_limit_that_is_none() {
    let force = thrust(&times(60.0), 1);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let refused = fit_with(&[velocity_axis(force, v)], all_terms(), Loss::Huber(-1.0));
    assert_eq!(refused, Err(Error::HuberLimit { found: -1.0 }));
}

#[test]
fn reversing_every_signal_flips_only_the_bias() {
    let force = thrust(&times(200.0), 4);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let v = noisy(v, 0.003, 4);
    let there = fit(&[velocity_axis(force.clone(), v.clone())]);
    let back = fit(&[velocity_axis(force.map(|x| -x), v.iter().map(|x| -x).collect())]);
    let (a, b) = (there.lumped, back.lumped);
    // Rounding alone: every operation is symmetric.
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    assert!(same(a.alpha, b.alpha) && same(a.beta, b.beta) && same(a.mu, b.mu), "{a:?} {b:?}");
    assert!(same(a.bias, -b.bias), "{a:?} {b:?}");
    assert!(same(there.covariance[(0, 0)], back.covariance[(0, 0)]));
}

#[test]
fn refuses_constant_thrust_from_rest() {
    let times = times(200.0);
    let force = Timed::new("thrust", times.as_slice(), vec![800.0; times.len()]).expect("valid");
    for noise in [None, Some(0.003)] {
        let (mut v, _) = moved(&SURGE, &force, State::default());
        if let Some(std) = noise {
            v = noisy(v, std, 2);
        }
        let axes = [velocity_axis(force.clone(), v)];
        let start = LumpedParameters { alpha: 1e-4, beta: -0.2, mu: -0.01, bias: 0.01 };
        let records = Records::from(&axes).with_terms(all_terms());
        let refused = OutputError::default().fit_from(records, &start);
        let is_refused =
            matches!(refused, Err(Error::NotExciting { .. } | Error::NotConverged { .. }));
        assert!(is_refused, "{refused:?}");
    }
}

#[test]
fn refuses_thrust_of_the_wrong_sign() {
    let force = thrust(&times(200.0), 6);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let axes = [velocity_axis(force.map(|x| -x), v)];
    let refused = fit_with(&axes, Terms::default(), Loss::Squares);
    assert!(matches!(refused, Err(Error::NotConverged { .. })), "{refused:?}");
}

#[test]
fn finds_the_same_plant_from_a_poor_start() {
    let force = thrust(&times(300.0), 7);
    let (v, _) = moved(&SURGE, &force, MOVING);
    let axes = [velocity_axis(force, noisy(v, 0.003, 7))];
    let near = fit(&axes).physical();
    let records = Records::from(&axes).with_terms(all_terms());
    for (mass, drag) in [(0.3, 3.0), (4.0, 0.2), (10.0, 10.0), (-1.0, -1.0)] {
        let poor = PhysicalParameters {
            mass: mass * SURGE.mass,
            d_quadratic: drag * SURGE.d_quadratic,
            ..Default::default()
        };
        let far = OutputError::default().fit_from(records, &poor.to_lumped());
        let worst = worst(far.expect("an optimum").physical(), near);
        // A ten-thousandth of a standard deviation, of which linear drag has a tenth of itself.
        assert!(worst < 1e-5, "from {mass} times the mass: {worst:e}");
    }
}
