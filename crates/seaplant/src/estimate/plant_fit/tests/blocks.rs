//! What a fit has beside the plant only where the trials show it: constant forces, the lag of a
//! velocity sensor, and what thrusters push in reverse.

use std::f64::consts::TAU;

use super::*;
use crate::estimate::plant_fit::sensor_lag::SensorLag;
use crate::plant::Parameterisation;

fn admitted(fit: &PlantFit, structure: &Structure) -> Vec<String> {
    let own = fit.plant.structure().terms().iter();
    own.filter(|term| structure.index_of(term).is_none()).map(Basis::to_string).collect()
}

fn check_within(fit: &PlantFit, truth: &Plant) {
    for term in truth.structure().terms() {
        let (found, expected) = (fit.plant.coefficient(term), truth.coefficient(term));
        let off = found.zip(expected).map_or(f64::INFINITY, |(a, b)| (a - b).abs());
        let std = fit.std(term).expect("fitted");
        assert!(off < 4.0 * std, "{term}: {found:?} ± {std}, not {expected:?}");
    }
}

/// A tether that pulls astern, and a trim that turns: with them mass and drag come back; a search of
/// trials without has no constant force left.
#[test]
fn constant_forces_are_found_where_they_are_and_nowhere_else() {
    let usual = planar();
    let structure = usual.structure();
    let pulled = [Dof::Surge, Dof::Yaw].map(Basis::One);
    let structure_of_truth = search::with_all(structure, &pulled).expect("new terms");
    let coefficients = usual.coefficients().iter().copied().chain([-4.0, 0.2]).collect();
    let truth = Plant::new(structure_of_truth, coefficients).expect("possible");
    let fit = |plant: &Plant| {
        let records =
            [("a", 5), ("b", 6)].map(|(name, seed)| record(plant, name, seed, 150, 0.005));
        let records: Vec<&TrialRecord> = records.iter().collect();
        fit_plant(structure, &records, None, true).expect("an optimum")
    };
    let found = fit(&truth);
    assert_eq!(admitted(&found, structure), ["surge: 1", "yaw: 1"]);
    check_within(&found, &truth);
    let found = fit(&usual);
    assert_eq!(admitted(&found, structure), [""; 0]);
    check_within(&found, &usual);
}

/// Surge and sway of a vehicle that does not turn, and of which nothing tells how it does.
fn of_translations(lag_s: f64) -> (Plant, [TrialRecord; 2]) {
    let structure = Structure::of(&PLANAR[..2], Symmetry::Diagonal).expect("two axes");
    let truth = Plant::new(structure, vec![20.0, 21.0, 5.0, 40.0, 8.0, 90.0]).expect("possible");
    let report = VelocityReport { lag_s, ..VelocityReport::default() };
    let records = [("a", 5), ("b", 6)].map(|(name, seed)| {
        let mut random = random(seed + 100);
        let clean = record(&truth, name, seed, 150, 0.0);
        let mut velocity = [const { None }; 6];
        for (axis, velocity) in velocity.iter_mut().enumerate().take(2) {
            let actual = clean.velocity[axis].as_ref().expect("is logged");
            let behind = report.behind_lag(actual.time_s(), actual.values().to_vec());
            let noisy = behind.into_iter().map(|v| v + 0.005 * random()).collect();
            *velocity = Some(actual.with_values("velocity", noisy).expect("valid"));
        }
        TrialRecord { velocity, ..clean }
    });
    (truth, records)
}

#[test]
fn a_velocity_behind_a_filter_is_found_beside_thrust_alone() {
    let (truth, records) = of_translations(0.3);
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    let std = fit.report_std[1].expect("is shown");
    assert!((fit.report.lag_s - 0.3).abs() < 4.0 * std.max(0.005), "{:?} ± {std}", fit.report);
    assert_eq!(fit.report.delay_s, 0.0);
    check_within(&fit, &truth);
    let (truth, records) = of_translations(0.0);
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    assert_eq!(fit.report, VelocityReport::default());
    check_within(&fit, &truth);
}

/// A plant that is fitted without the delay makes up for it: no small step leads to it.
#[test]
fn a_velocity_that_is_late_beside_rates_is_found() {
    const LATE_S: f64 = 0.4;
    let truth = planar();
    let records = [("a", 5), ("b", 6)].map(|(name, seed)| {
        let mut late = record(&truth, name, seed, 150, 0.005);
        let translations = late.velocity.iter_mut().take(2).flatten();
        translations.for_each(|velocity| *velocity = velocity.shifted(LATE_S));
        late.window_s.0 += LATE_S;
        late
    });
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    let std = fit.report_std[0].expect("is shown");
    assert!((fit.report.delay_s - LATE_S).abs() < 4.0 * std.max(0.005), "{:?} ± {std}", fit.report);
    assert_eq!(fit.report.lag_s, 0.0);
    check_within(&fit, &truth);
}

/// Fixes of a satellite receiver that are late, and a heading that is turned against them.
#[test]
fn late_fixes_and_a_turned_heading_are_found() {
    const LATE_S: f64 = 0.3;
    const TURNED_RAD: f64 = 0.08;
    let truth = planar();
    let records = [("a", 5), ("b", 6)].map(|(name, seed)| {
        let mut random = random(seed + 200);
        let moved = record(&truth, name, seed, 150, 0.0);
        let [surge, sway] = [0, 1].map(|k| moved.velocity[k].clone().expect("is logged"));
        let heading = moved.attitude[2].clone().expect("is logged");
        let over_ground = |t: f64| {
            let (sin, cos) = heading.at(t).sin_cos();
            [cos * surge.at(t) - sin * sway.at(t), sin * surge.at(t) + cos * sway.at(t)]
        };
        let (mut place, mut places) = ([0.0; 2], [vec![0.0], vec![0.0]]);
        for pair in surge.time_s().windows(2) {
            let ends = [over_ground(pair[0]), over_ground(pair[1])];
            for k in 0..2 {
                place[k] += 0.5 * (pair[1] - pair[0]) * (ends[0][k] + ends[1][k]);
                places[k].push(place[k]);
            }
        }
        let fixes = places.map(|way| {
            let read = way.into_iter().map(|x| x + 0.01 * random()).collect();
            Some(surge.with_values("position", read).expect("valid").shifted(LATE_S))
        });
        let mut late = TrialRecord {
            by_slope: [true, true, false, false, false, false],
            attitude: [None, None, Some(heading.map(|x| x + TURNED_RAD))],
            fixes: Some(fixes),
            ..moved
        };
        let rate = late.velocity[5].take().expect("is logged");
        let read = rate.values().iter().map(|r| r + 0.002 * random()).collect();
        late.velocity[5] = rate.with_values("velocity", read).ok();
        late.window_s.0 += LATE_S;
        late
    });
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    let std = fit.report_std[0].expect("is shown");
    assert!((fit.report.delay_s - LATE_S).abs() < 4.0 * std.max(0.003), "{:?} ± {std}", fit.report);
    let [.., turned_rad] = fit.report.misalignment_rad;
    let std = fit.misalignment_std[2].expect("is shown");
    assert!((turned_rad - TURNED_RAD).abs() < 4.0 * std.max(0.002), "{turned_rad} ± {std}");
    assert!(fit.is_along_world);
    check_within(&fit, &truth);
}

/// Standard deviation of the waves' force on surge and sway, N, and their mean period, s.
const WAVES: (f64, f64) = (4.0, 6.0);

/// A trial in waves: forces of a dozen sines about one frequency.
fn in_waves(plant: &Plant, name: &str, seed: u64) -> TrialRecord {
    const SINES: usize = 12;
    let quiet = record(plant, name, seed, 300, 0.0);
    let time_s = quiet.velocity[0].as_ref().expect("is logged").time_s().to_vec();
    let mut random = random(seed + 200);
    let mut waves = || -> Vec<f64> {
        let amplitude = WAVES.0 * (2.0 / SINES as f64).sqrt();
        let sine = |(frequency, phase): (f64, f64)| {
            move |t: &f64| amplitude * (frequency * t + phase).sin()
        };
        let mut one = || sine((TAU / WAVES.1 * (1.0 + 0.05 * random()), 3.0 * random()));
        let sines: Vec<_> = (0..SINES).map(|_| one()).collect();
        time_s.iter().map(|t| sines.iter().map(|sine| sine(t)).sum::<f64>()).collect()
    };
    let mut acting = quiet.force.clone();
    for force in acting.iter_mut().take(2).flatten() {
        let pushed = time_s.iter().zip(waves()).map(|(t, wave)| force.held_at(*t) + wave);
        *force = Timed::new("force", time_s.clone(), pushed.collect::<Vec<f64>>()).expect("valid");
    }
    driven(plant, quiet, acting, (&time_s, 0.005, &mut random))
}

#[test]
fn waves_are_found_where_they_are_and_do_not_pass_for_mass_or_drag() {
    let truth = planar();
    let fit = |records: [TrialRecord; 2]| {
        let records: Vec<&TrialRecord> = records.iter().collect();
        fit_plant(truth.structure(), &records, None, false).expect("an optimum")
    };
    assert_eq!(fit([3, 4].map(|seed| record(&truth, "calm", seed, 300, 0.005))).swell, None);
    let found = fit([3, 4].map(|seed| in_waves(&truth, "waves", seed)));
    let swell = found.swell.as_ref().expect("is found");
    assert!((swell.period_s.0 / WAVES.1 - 1.0).abs() < 0.1, "{swell:?}");
    for dof in [Dof::Surge, Dof::Sway] {
        assert!((swell.force[&dof].0 / WAVES.0 - 1.0).abs() < 0.35, "{swell:?}");
    }
    assert!(swell.force[&Dof::Yaw].0 < 0.05, "{swell:?}");
    check_within(&found, &truth);
}

/// One thruster pushes ahead while the other pushes astern, by as much, or a fifth less.
fn pair(astern: f64) -> TrialRecord {
    let mut random = random(9);
    let time_s: Vec<f64> = (0..600).map(|k| 0.1 * f64::from(k)).collect();
    let speed = stepped(&time_s, &mut random, (3.0, 20));
    let thruster = |(name, sign): (&str, f64)| {
        let speed = speed.map(|n| sign * n * if sign * n < 0.0 { astern } else { 1.0 });
        let track = ThrusterTrack {
            lever: 1.0,
            speed,
            forward: 2.0,
            reverse: 1.5,
            uncertainty: ThrustUncertainty::default(),
            supply: None,
        };
        let wrench = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.3 * sign);
        PlacedThruster { name: name.into(), track, wrench }
    };
    let thrusters = [("port", 1.0), ("starboard", -1.0)].map(thruster).to_vec();
    let force = [Some(speed.clone()), None, None, None, None, Some(speed)];
    TrialRecord { force, thrusters, ..TrialRecord::until("a", 60.0) }
}

/// More thrust in reverse of a pair that only turns looks like more thrust of all.
#[test]
fn what_a_pair_pushes_in_reverse_is_fitted_only_where_that_can_be_told() {
    let fits = |astern: f64, axes: &[Dof]| Actuator::shown_by(&[&pair(astern)], axes)[2];
    assert!(!fits(1.0, &[Dof::Yaw]));
    assert!(!fits(0.8, &[Dof::Yaw]));
    // Along surge the two do not cancel in the same proportion.
    assert!(fits(1.0, &[Dof::Surge, Dof::Yaw]));
}

/// Over a gap a vehicle may turn round: whoever removes jumps loses a turn.
#[test]
fn a_heading_counts_without_the_whole_turns_that_a_log_lost() {
    let (plant, record) = without_velocity(5, 40);
    let later = record.heading.as_ref().expect("is logged");
    let turned = later.values().iter().enumerate().map(|(k, x)| if k < 150 { *x } else { x + TAU });
    let heading = Some(later.with_values("heading", turned.collect()).expect("valid"));
    let turned = TrialRecord { heading, ..record.clone() };
    let problem = |record: &TrialRecord| {
        Problem::new(plant.structure(), &[record], None, false, Attitude::Known)
    };
    let logged = problem(&record);
    let point = problem::Point {
        free: logged.physical.free(&DVector::from_row_slice(plant.coefficients())),
        actuator: Actuator::default(),
        currents: vec![[0.0; 2]],
        noise: problem::first_noise(&logged, &[1.0; 6]),
        jitter_of: Actuator::default(),
    };
    let slopes = |record: &TrialRecord| {
        let problem = problem(record);
        let (by_plant, gains) = problem.by_plant(&point).expect("bounded");
        let (_, by_noise) = problem.by_noise(&point).expect("bounded");
        let costs = [problem.cost(&point), problem.at_gains(&point, &gains)];
        (by_plant.gradient, by_noise, DVector::from(costs.to_vec()))
    };
    let (as_it_was, lost) = (slopes(&record), slopes(&turned));
    let near = |a: &DVector<f64>, b: &DVector<f64>| (a - b).amax() <= 1e-6 * a.amax();
    assert!(near(&as_it_was.0, &lost.0));
    assert!(near(&as_it_was.1, &lost.1));
    assert!(near(&as_it_was.2, &lost.2));
}

/// The same without what was measured in a window.
fn without(series: &Timed, gap: &std::ops::Range<f64>) -> Timed {
    let samples = series.time_s().iter().zip(series.values());
    let left = samples.filter(|(t, _)| !gap.contains(t));
    let (time_s, values): (Vec<f64>, Vec<f64>) = left.unzip();
    Timed::new("motion", time_s, values).expect("valid")
}

#[test]
fn after_a_gap_a_trial_begins_anew() {
    let truth = planar();
    let gap = 40.0..52.0;
    let with_gap = |record: TrialRecord| TrialRecord {
        velocity: record.velocity.map(|series| series.map(|series| without(&series, &gap))),
        ..record
    };
    let records =
        [("a", 5), ("b", 6)].map(|(name, seed)| with_gap(record(&truth, name, seed, 150, 0.005)));
    let records: Vec<&TrialRecord> = records.iter().collect();
    let schedules =
        Schedule::complete(&records, truth.structure(), Attitude::Known, SensorLag::default());
    let trials: Vec<usize> = schedules.iter().map(|schedule| schedule.trial).collect();
    assert_eq!(trials, [0, 0, 1, 1]);
    // What is measured first in a stretch is its start: 1380 samples of three axes are left.
    assert_eq!(schedules[..2].iter().map(Schedule::samples).sum::<usize>(), 3 * (1380 - 2));
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    check_within(&fit, &truth);
}

/// Lift of the hull of the test vehicle, N/(m/s)², and its place, m.
const LIFT: f64 = 30.0;
const PLACE_M: f64 = 0.1;

/// Returns the test vehicle's structure with lift of the hull at some places.
fn with_lift_at(places_m: &[f64], as_term: bool) -> Structure {
    let with = |structure: Structure, &at_m: &f64| {
        let (name, force) =
            (format!("hull at {at_m}"), EffectForce::HullLift { along: Dof::Sway, at_m });
        structure.with_effect(Effect { name, force }, as_term)
    };
    places_m.iter().try_fold(planar().structure().clone(), with).expect("new effects")
}

/// Returns the test vehicle with lift of the hull at some places.
fn lifted(places: &[(f64, f64)]) -> Plant {
    let (places_m, lifts): (Vec<f64>, Vec<f64>) = places.iter().copied().unzip();
    let coefficients = planar().coefficients().iter().copied().chain(lifts).collect();
    Plant::new(with_lift_at(&places_m, true), coefficients).expect("possible")
}

fn trials(truth: &Plant) -> [TrialRecord; 2] {
    [("a", 5), ("b", 6)].map(|(name, seed)| record(truth, name, seed, 150, 0.005))
}

/// Lift of the hull between two of the places that are tried is that of both; a hull without lift has none.
#[test]
fn lift_of_the_hull_is_found_between_places_and_nowhere_else() {
    let usual = planar();
    let tried = with_lift_at(&[0.4, 0.2, 0.0, -0.2, -0.4], false);
    let fit = |truth: &Plant| {
        fit_plant(&tried, &trials(truth).each_ref(), None, true).expect("an optimum").plant
    };
    let lift_and_moment = |plant: &Plant| {
        let of = |(term, x): (&Basis, &f64)| {
            plant.structure().lift_of_hull(term).map(|(_, at_m)| (*x, at_m))
        };
        let lifts = plant.structure().terms().iter().zip(plant.coefficients()).filter_map(of);
        lifts.fold((0.0, 0.0), |(lift, moment), (x, at_m)| (lift + x, moment + x * at_m))
    };
    let found = fit(&lifted(&[(PLACE_M, LIFT)]));
    // Two places with that lift and moment have more damping of turning, for which all numbers make up a little.
    let (lift, moment) = lift_and_moment(&found);
    assert!((lift / LIFT - 1.0).abs() < 0.15, "{lift}");
    assert!((moment / (LIFT * PLACE_M) - 1.0).abs() < 0.15, "{moment}");
    for dof in PLANAR {
        let mass = Basis::Mass(dof, dof);
        let [a, b] = [&found, &usual].map(|plant| plant.coefficient(&mass).expect("a mass"));
        assert!((a / b - 1.0).abs() < 0.03, "{dof}: {a}, not {b}");
    }
    assert_eq!(lift_and_moment(&fit(&usual)), (0.0, 0.0));
}

/// Returns the fit of trials of a vehicle with lift of the hull, without that lift, and what is tried.
fn begun_without_lift(records: &[&TrialRecord]) -> Fitted {
    let tried = with_lift_at(&[0.4, 0.2, 0.0, -0.2, -0.4], false);
    let problem = Problem::new(&tried, records, None, false, Attitude::Known);
    begun(problem, records).expect("an optimum").2
}

#[test]
fn two_lifts_of_a_hull_are_taken_next_to_where_they_act_together() {
    let nearer = |lifts: [f64; 5]| {
        let places = [0.4, 0.2, 0.0, -0.2, -0.4];
        let all: Vec<(f64, f64)> = places.into_iter().zip(lifts).collect();
        let plant = lifted(&all);
        let is_there = |k: &usize| lifts[*k] > 0.0;
        let terms: Vec<Basis> = (0..5).filter(is_there).map(Basis::Effect).collect();
        let found = search::nearer_lifts(&plant, &terms, Dof::Sway);
        assert!(search::nearer_lifts(&plant, &terms, Dof::Heave).is_none());
        found.map(|(_, near)| near)
    };
    // 0.4 · 20 − 0.2 · 10 over 30: at 0.2, which counts as the place aft.
    assert_eq!(nearer([20.0, 0.0, 0.0, 10.0, 0.0]), Some([1, 0].map(Basis::Effect)));
    assert_eq!(nearer([10.0, 0.0, 0.0, 20.0, 0.0]), Some([2, 1].map(Basis::Effect)));
    assert_eq!(nearer([0.0, 10.0, 5.0, 0.0, 0.0]), None);
    assert_eq!(nearer([0.0, 10.0, 0.0, 0.0, 0.0]), None);
    assert_eq!(nearer([10.0, 10.0, 10.0, 0.0, 0.0]), None);
}

/// A delay that was found where lift of the hull was missing is given up, that of a sensor which is late is not.
#[test]
fn a_delay_that_made_up_for_couplings_is_given_up() {
    let records = trials(&lifted(&[(PLACE_M, LIFT)]));
    let found = |late_s: f64| {
        let how = |delay_s: f64| VelocityReport { delay_s, ..VelocityReport::default() };
        let shifted = |delay_s: f64| {
            move |record: &TrialRecord| record.with_translations_before(&how(delay_s))
        };
        let logged = records.each_ref().map(shifted(-late_s));
        let prompt = logged.each_ref().map(shifted(0.03));
        let mut fitted = begun_without_lift(&prompt.each_ref());
        fitted.reported = Reported { how: how(0.03), std: [Some(0.01), None], ..<_>::default() };
        let found = fitted.searched_with_report(&prompt.each_ref()).expect("an optimum");
        (found.fitted.reported.how.delay_s, found.fitted.reported.std[0].is_some())
    };
    assert_eq!(found(0.0), (0.0, false));
    assert_eq!(found(0.03), (0.03, true));
}
