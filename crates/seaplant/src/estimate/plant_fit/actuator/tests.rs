//! Tests of how thrust follows its log.

use super::*;
use crate::estimate::propellers::SignalIntegral;
use crate::plant::{
    Effect, EffectForce, Plant, Pusher, Signal, Structure, Symmetry, ThrusterNumber,
};
use crate::{ThrustUncertainty, ThrusterTrack};

fn steps() -> Timed {
    Timed::new("force", vec![0.0, 0.3, 0.5, 1.0], vec![0.0, 10.0, -4.0, 3.0]).expect("valid")
}

fn of_wrench(axis: usize) -> LoggedThrust {
    let mut wrench = [const { None }; 6];
    wrench[axis] = Some(steps());
    LoggedThrust { wrench, ..logged(Vec::new()) }
}

fn of(numbers: [f64; Actuator::COUNT]) -> Actuator {
    Actuator { full_speed: 10.0, ..Actuator::default() }.with(numbers)
}

const WRENCH: [f64; 6] = [0.8, -0.6, 0.0, 0.0, 0.0, 0.3];

/// A propeller with the speeds of [`steps`], that pushes obliquely.
fn thruster() -> PlacedThruster {
    let track = ThrusterTrack {
        lever: 1.0,
        speed: steps(),
        forward: 2.0,
        reverse: 1.5,
        uncertainty: ThrustUncertainty::default(),
        supply: None,
    };
    PlacedThruster { name: "a".to_owned(), track, wrench: WRENCH.into() }
}

fn logged(thrusters: Vec<PlacedThruster>) -> LoggedThrust {
    let load = total_load(&thrusters);
    let (wrench, window_s) = ([const { None }; 6], (0.0, 2.0));
    LoggedThrust { thrusters, wrench, window_s, between: 0.3, load }
}

fn of_thruster() -> LoggedThrust {
    logged(vec![thruster()])
}

/// The thruster with a supply voltage that falls, and its curve's own if that is stated.
fn of_battery(of_curve: Option<f64>) -> LoggedThrust {
    let volts = Timed::new("supply.voltage", vec![0.0, 0.6, 1.5], vec![16.0, 14.0, 15.0]);
    let ln_volts = volts.expect("finite").map(f64::ln);
    let supply = Some(Arc::new(Supply { ln_volts, of_curve }));
    let PlacedThruster { track, name, wrench } = thruster();
    logged(vec![PlacedThruster { track: ThrusterTrack { supply, ..track }, name, wrench }])
}

fn of_two_thrusters() -> LoggedThrust {
    let astern = PlacedThruster { wrench: -0.4 * thruster().wrench, ..thruster() };
    logged(vec![thruster(), astern])
}

/// What lags behind steps, and the integral of what that makes, by many small steps of Euler's
/// method.
fn by_small_steps(actuator: Actuator, until_s: f64, makes: impl Fn(f64) -> f64) -> (f64, f64) {
    let (u, h) = (steps(), 1e-6);
    let (mut x, mut integral) = (0.0, 0.0);
    for k in 0..(until_s / h).round() as usize {
        let t = (k as f64 + 0.5) * h - actuator.delay_s;
        integral += makes(x) * h;
        x += h / actuator.lag_s * (u.held_at(t.max(0.0)) - x);
    }
    (x, integral)
}

fn slices(length_s: f64, count: usize) -> Vec<Slice> {
    let slice = |k: usize| Slice { from_s: length_s * k as f64, length_s, ..Slice::default() };
    (0..count).map(slice).collect()
}

#[test]
fn a_wrench_lags_as_its_equation_says() {
    let actuator = Actuator { lag_s: 0.2, delay_s: 0.13, ..Actuator::default() };
    let u = steps();
    let lagging = Lagging::new(&u, actuator);
    let mut reader = lagging.reader();
    let (from, to) = (reader.at(0.0), reader.at(0.9));
    let (expected, integral) = by_small_steps(actuator, 0.9, |x| x);
    assert!((to.force - expected).abs() < 1e-3, "{} {expected}", to.force);
    let (mean, _) = lagging.mean(&from, &to, 0.9);
    assert!((mean * 0.9 - integral).abs() < 1e-4, "{} {integral}", mean * 0.9);
}

#[test]
fn a_smooth_wrench_acts_as_its_cubics_do() {
    let actuator = Actuator { between: BetweenSamples::SmoothThrust, ..Actuator::default() };
    let mut pushes = actuator.pushes(&of_wrench(0), &slices(0.1, 10), &[Dof::Surge]);
    let u = steps();
    let (mut cubics, mut sum) = (SignalIntegral::new(&u, BetweenSamples::SmoothSpeed), 0.0);
    for (k, (force, _)) in pushes.each_mut().enumerate() {
        let t = 0.1 * (k + 1) as f64;
        sum += 0.1 * force[0];
        // Exact from sample to sample, and nearly so within.
        let most = if u.time_s().iter().any(|own| (own - t).abs() < 1e-9) { 1e-9 } else { 0.02 };
        assert!((sum - cubics.until(t).0).abs() < most, "{t}: {sum}");
    }
}

#[test]
fn a_propeller_lags_in_speed() {
    let ratio: f64 = 0.7;
    let actuator = of([0.2, 0.13, ratio.ln(), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let pushes = actuator.pushes(&of_thruster(), &slices(0.05, 18), &Dof::ALL);
    let thrust = |n: f64| if n < 0.0 { -1.5 * ratio * n * n } else { 2.0 * n * n };
    let (_, integral) = by_small_steps(actuator, 0.9, thrust);
    for (axis, lever) in WRENCH.into_iter().enumerate() {
        let found: f64 = pushes.each().map(|push| 0.05 * push.force[axis]).sum();
        // The speed asked for changes within a slice, by a third at most of the greatest.
        let off = (found - lever * integral).abs();
        assert!(off < 5e-3 * integral.abs(), "{found}, {}", lever * integral);
    }
}

#[test]
fn a_piece_of_a_trial_begins_with_propellers_on_their_way() {
    let actuator = Actuator { lag_s: 0.2, delay_s: 0.13, ..Actuator::default() };
    let all = slices(0.05, 30);
    let whole = actuator.pushes(&of_thruster(), &all, &Dof::ALL);
    let piece = actuator.pushes(&of_thruster(), &all[13..], &Dof::ALL);
    for (piece, whole) in piece.each().zip(whole.over(13..30)) {
        let [piece, whole] = [piece, whole].map(|push| Vector6::from_column_slice(push.force));
        let off = (piece - whole).norm();
        assert!(off < 1e-3 * whole.norm().max(1.0), "{piece:?} {whole:?}");
    }
}

/// A propeller slows down as late as it speeds up, but later towards full reverse than towards full ahead.
#[test]
fn a_propeller_lags_by_the_way_in_which_its_speed_changes() {
    let ratio: f64 = 3.0;
    let actuator =
        Actuator { lag_s: 0.15, log_falling_lag_ratio: ratio.ln(), ..of([0.0; Actuator::COUNT]) };
    let pushes = actuator.pushes(&of_thruster(), &slices(0.05, 18), &[Dof::Surge]);
    let (u, h) = (steps(), 1e-6);
    let (mut n, mut integral) = (0.0, 0.0);
    for k in 0..900_000 {
        let off = u.held_at((f64::from(k) + 0.5) * h) - n;
        integral += h * WRENCH[0] * if n < 0.0 { -1.5 * n * n } else { 2.0 * n * n };
        n += h / if off < 0.0 { 0.45 } else { 0.15 } * off;
    }
    let found: f64 = pushes.each().map(|push| 0.05 * push.force[0]).sum();
    assert!((found / integral - 1.0).abs() < 1e-3, "{found} {integral}");
}

#[test]
fn derivatives_are_those_of_the_means() {
    let slices = slices(0.05, 30);
    for logged in [of_wrench(0), of_thruster(), of_two_thrusters(), of_battery(Some(2.7))] {
        // With another exponent, how long a propeller reverses within a slice is held.
        let some = [
            ([0.2, 0.13, -0.4, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3),
            ([0.03, 0.01, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, -0.2, 0.1, 0.0, 0.0, 0.0], 1e-3),
            ([0.2, 0.13, -0.4, 0.3, -0.2, 0.0, 0.0, 0.0, 0.2, -0.1, 0.0, 0.0, 0.0], 0.15),
            ([0.0, 0.013, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3),
            ([0.2, -0.07, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3),
            ([0.05, 0.01, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3),
            ([0.03, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0], 1e-3),
            ([0.1, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.12, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3),
            ([0.1, 0.01, 0.1, 0.0, 0.0, 0.0, 1.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-3),
            ([0.2, 0.01, 0.1, 0.4, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.7], 1e-3),
        ];
        let laws =
            [BetweenSamples::Held, BetweenSamples::SmoothSpeed, BetweenSamples::SmoothThrust];
        for (between, (base, near)) in laws.into_iter().flat_map(|law| some.map(|x| (law, x))) {
            let actuator = |numbers| Actuator { between, ..of(numbers) };
            let pushes = |k: usize, step: f64| {
                let mut moved = base;
                moved[k] += step;
                actuator(moved).pushes(&logged, &slices, &Dof::ALL)
            };
            let here = actuator(base).pushes(&logged, &slices, &Dof::ALL);
            let has_slope = |k: &usize| match *k {
                Actuator::SLEW | Actuator::LAG | Actuator::DEAD_BAND => base[*k] > 0.0,
                _ => true,
            };
            for k in (0..Actuator::COUNT).filter(has_slope) {
                let (up, down) = (pushes(k, 1e-6), pushes(k, -1e-6));
                for ((here, up), down) in here.each().zip(up.each()).zip(down.each()) {
                    let slope = (up.force[0] - down.force[0]) / 2e-6;
                    let by = here.by(k)[0];
                    let off = (slope - by).abs();
                    let is_near = off < near * slope.abs().max(1.0);
                    assert!(is_near, "{between:?}, {k}: {slope}, {here:?}");
                }
            }
        }
    }
}

#[test]
fn thrust_that_changes_is_that_of_its_log_in_the_middle() {
    let actuator = of([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.2, 0.1, 0.0, 0.0, 0.0]);
    let slices = slices(0.05, 40);
    let (logged, changed) = [Actuator::default(), actuator]
        .map(|actuator| actuator.pushes(&of_wrench(0), &slices, &Dof::ALL))
        .into();
    for (slice, (logged, changed)) in slices.iter().zip(logged.each().zip(changed.each())) {
        let within = (slice.from_s + 0.025) / 2.0 - 0.5;
        let expected = logged.force[0] * (0.3_f64 * 0.1 - 0.2 * within).exp();
        assert!((changed.force[0] - expected).abs() < 1e-9, "{} s", slice.from_s);
    }
}

#[test]
fn thrust_under_the_load_of_all_thrusters_is_less_by_its_share() {
    let actuator = of([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, 0.0]);
    let slices = slices(0.1, 12);
    let (logged, changed) = [Actuator::default(), actuator]
        .map(|actuator| actuator.pushes(&of_two_thrusters(), &slices, &Dof::ALL))
        .into();
    for (slice, (logged, changed)) in slices.iter().zip(logged.each().zip(changed.each())) {
        let n = steps().held_at(slice.from_s + 0.05);
        let k: f64 = if n < 0.0 { 1.5 } else { 2.0 };
        // Both are as fast, so that the load is that of one.
        let load = (k * n * n).powf(1.5) / (2.0_f64 * 100.0).powf(1.5);
        let expected = logged.force[0] * (-0.3 * load).exp();
        assert!((changed.force[0] - expected).abs() < 1e-9, "{} s", slice.from_s);
    }
    // One thruster has no others, whose load it could feel.
    let alone = actuator.pushes(&of_thruster(), &slices, &Dof::ALL);
    let plain = Actuator::default().pushes(&of_thruster(), &slices, &Dof::ALL);
    assert!(alone.each().zip(plain.each()).all(|(a, b)| a.force == b.force));
}

#[test]
fn thrust_is_in_proportion_to_a_power_of_voltage() {
    let slices = slices(0.1, 12);
    let actuator =
        Actuator { voltage_exponent: 1.3, ln_voltage: [2.75; 2], ..of([0.0; Actuator::COUNT]) };
    for (of_curve, reference) in [(None, 2.75), (Some(2.7), 2.7)] {
        let [logged, changed] = [Actuator::default(), actuator]
            .map(|actuator| actuator.pushes(&of_battery(of_curve), &slices, &Dof::ALL));
        let supply = of_battery(of_curve).thrusters[0].track.supply.clone().expect("logged");
        for (slice, (logged, changed)) in slices.iter().zip(logged.each().zip(changed.each())) {
            let ln_volts = supply.ln_volts.at(slice.from_s + 0.05);
            let expected = logged.force[0] * (1.3 * (ln_volts - reference)).exp();
            assert!((changed.force[0] - expected).abs() < 1e-9, "{} s", slice.from_s);
        }
    }
}

#[test]
fn a_wrench_that_changes_where_a_slice_ends_lags_alike() {
    let slices = slices(0.1, 12);
    let pushes = |delay_s| {
        let actuator = Actuator { lag_s: 0.2, delay_s, ..Actuator::default() };
        actuator.pushes(&of_wrench(0), &slices, &Dof::ALL)
    };
    for (at, later) in pushes(0.0).each().zip(pushes(1e-9).each()) {
        assert!((at.force[0] - later.force[0]).abs() < 1e-6, "{at:?} {later:?}");
    }
}

#[test]
fn the_speed_of_a_propeller_that_lags_has_the_sign_of_its_thrust() {
    let record = TrialRecord { thrusters: vec![thruster()], ..TrialRecord::until("a", 2.0) };
    let signals = of([0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        .signals(&record, &surge(&[]))
        .expect("finite");
    let [speed, thrust] = [Signal::PropellerSpeed("a".into()), Signal::Thrust("a".into())]
        .map(|signal| signals[&signal].values().to_vec());
    assert!(speed.iter().zip(&thrust).all(|(n, t)| n * t >= 0.0));
    assert!(speed.iter().any(|n| *n < -0.1) && speed.iter().any(|n| *n > 0.1));
}

/// A plant of surge, whose thruster has these numbers beyond those of all.
fn surge(own: &[(ThrusterNumber, f64)]) -> Plant {
    let plain = Structure::of(&[Dof::Surge], Symmetry::Diagonal).expect("an axis");
    let mut coefficients = vec![1.0; plain.terms().len()];
    let with = |structure: Structure, (number, value): &(ThrusterNumber, f64)| {
        coefficients.push(*value);
        let thruster =
            Pusher { name: "a".to_owned(), position_m: [0.0; 3], direction: [1.0, 0.0, 0.0] };
        let force = EffectForce::Own { thruster, number: *number };
        structure.with_effect(Effect { name: number.name().to_owned(), force }, true)
    };
    let structure = own.iter().try_fold(plain, with).expect("new effects");
    Plant::new(structure, coefficients).expect("finite")
}

#[test]
fn thrust_with_what_its_own_numbers_change_is_that_of_a_thruster_with_these() {
    let record = TrialRecord { thrusters: vec![thruster()], ..TrialRecord::until("a", 2.0) };
    let of = |lag_s: f64, dead_band: f64| Actuator {
        lag_s,
        dead_band,
        full_speed: 10.0,
        ..Actuator::default()
    };
    for (late_s, dead) in [(0.3, 0.0), (-0.15, 0.04), (0.1, -0.05)] {
        let own = [(ThrusterNumber::Lag, late_s), (ThrusterNumber::DeadBand, dead)];
        let signals = of(0.2, 0.1).signals(&record, &surge(&own)).expect("finite");
        let pushes = of(0.2 + late_s, 0.1 + dead);
        let pushes = pushes.pushes(&of_thruster(), &slices(0.05, 20), &Dof::ALL);
        for (k, push) in pushes.each().enumerate() {
            // In the middle of a slice of both, up to the last change.
            let t = 0.05 * k as f64 + 0.025;
            let at = |signal: Signal| signals[&signal].held_at(t);
            let changes = own.map(|(number, value)| {
                value * at(Signal::ThrustBy { number, thruster: "a".to_owned() })
            });
            let found = at(Signal::Thrust("a".into())) + changes[0] + changes[1];
            let expected = push.force[0] / WRENCH[0];
            assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{t}: {found}");
        }
    }
}

#[test]
fn what_acts_is_what_the_filter_is_pushed_by() {
    let force = |axis: usize| {
        let lever = WRENCH[axis];
        let thrust = move |n: f64| lever * n * n.abs() * if n < 0.0 { 1.5 } else { 2.0 };
        (lever != 0.0).then(|| steps().map(thrust))
    };
    let record = TrialRecord {
        force: std::array::from_fn(force),
        thrusters: vec![thruster()],
        ..TrialRecord::until("a", 2.0)
    };
    assert_eq!(Actuator::default().acting(&record).expect("finite"), record.force);
    let some = [
        [0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.3, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.2, 0.1, -0.3, 0.5, -0.2, 0.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.0],
        [0.1, -0.15, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.1, 0.0, 0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    for numbers in some {
        let actuator = of(numbers);
        let acting = actuator.acting(&record).expect("finite");
        let surge = acting[0].as_ref().expect("pushed");
        let pushes = actuator.pushes(&of_thruster(), &slices(0.01, 200), &Dof::ALL);
        let sum: f64 = pushes.each().map(|push| 0.01 * push.force[0]).sum();
        let held: f64 = (0..2000).map(|k| 0.001 * surge.held_at(0.001 * f64::from(k))).sum();
        assert!((sum - held).abs() < 0.02 * sum.abs(), "{numbers:?}: {sum}, {held}");
        assert!(acting[2].is_none());
    }
}
