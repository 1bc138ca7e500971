//! Thrusters that do not push as their curves and logs say.

use super::differences::Difference;
use super::*;
use crate::ThrusterFault;
use crate::plant::{Basis, ThrusterNumber};

const NAMES: [&str; 4] = ["bow-port", "bow-starboard", "stern-port", "stern-starboard"];

/// Four thrusters at the corners of a vehicle, at 45° to its length.
fn pushers() -> Vec<Pusher> {
    let part = 0.5_f64.sqrt();
    let corners = [(0.3, -0.2, 1.0), (0.3, 0.2, -1.0), (-0.3, -0.2, -1.0), (-0.3, 0.2, 1.0)];
    let pusher = |(name, (x, y, side)): (&str, (f64, f64, f64))| Pusher {
        name: name.to_owned(),
        position_m: [x, y, 0.0],
        direction: [part, side * part, 0.0],
    };
    NAMES.into_iter().zip(corners).map(pusher).collect()
}

/// The plant of these tests without gains, which may be tried.
fn structure() -> Structure {
    let gain = |reverse: bool| {
        move |thruster: Pusher| {
            let what = if reverse { "excess-reverse-thrust" } else { "excess-thrust" };
            let name = format!("{}.{what}", thruster.name);
            Effect { name, force: EffectForce::Gain { thruster, reverse } }
        }
    };
    let own = |number: ThrusterNumber| {
        move |thruster: Pusher| {
            let name = format!("{}.excess-{}", thruster.name, number.key());
            Effect { name, force: EffectForce::Own { thruster, number } }
        }
    };
    let all = pushers().into_iter().map(gain(false)).chain(pushers().into_iter().map(gain(true)));
    let all = all.chain(pushers().into_iter().map(own(ThrusterNumber::Lag)));
    let all = all.chain(pushers().into_iter().map(own(ThrusterNumber::DeadBand)));
    let with = |structure: Structure, effect| structure.with_effect(effect, false);
    all.into_iter().try_fold(planar().structure().clone(), with).expect("new effects")
}

/// A trial in which thrusters give these parts of the thrust that is logged of them, ahead and in
/// reverse.
fn trial(name: &str, seed: u64, gains: [[f64; 2]; 4]) -> TrialRecord {
    trial_as(name, seed, |thruster, logged| {
        let [forward, reverse] = gains[thruster];
        logged.map(|x| x * if x < 0.0 { reverse } else { forward })
    })
}

/// A trial in which each thruster gives this in place of the thrust that is logged of it.
fn trial_as(name: &str, seed: u64, acts: impl Fn(usize, &Timed) -> Timed) -> TrialRecord {
    let mut random = random(seed);
    let time_s: Vec<f64> = (0..1500).map(|k| 0.1 * f64::from(k)).collect();
    let mut record = TrialRecord::until(name, time_s[time_s.len() - 1]);
    let mut sums: [[Option<Timed>; 6]; 2] = Default::default();
    for (thruster, pusher) in pushers().into_iter().enumerate() {
        let logged = stepped(&time_s, &mut random, (12.0, 31));
        let acting = acts(thruster, &logged);
        let wrench = pusher.way();
        for (sum, thrust) in sums.iter_mut().zip([&logged, &acting]) {
            for axis in PLANAR.map(Dof::index) {
                let own = thrust.map(|x| x * wrench[axis]);
                let before = sum[axis].take();
                sum[axis] = Some(match before {
                    Some(before) => {
                        let both = before.values().iter().zip(own.values());
                        let values = both.map(|(a, b)| a + b).collect();
                        before.with_values("force", values).expect("finite")
                    }
                    None => own,
                });
            }
        }
        let track = ThrusterTrack::of_force(1.0, &logged);
        record.thrusters.push(PlacedThruster { name: pusher.name, track, wrench });
    }
    record.signals = record.thrusters.iter().flat_map(PlacedThruster::signals).collect();
    let [logged, acting] = sums;
    record.force = logged;
    driven(&planar(), record, acting, (&time_s, 0.005, &mut random))
}

fn fitted(records: &[TrialRecord]) -> PlantFit {
    let records: Vec<&TrialRecord> = records.iter().collect();
    fit_plant(&structure(), &records, None, true).expect("an optimum")
}

fn excess(fit: &PlantFit, what: &str) -> Vec<Option<f64>> {
    let structure = fit.plant.structure();
    let of = |name: &str| fit.plant.coefficient(&structure.term_named(&format!("{name}.{what}"))?);
    NAMES.map(of).to_vec()
}

/// By how many standard deviations each coefficient of the planar plant is off.
fn off(fit: &PlantFit) -> Vec<(String, f64)> {
    let truth = planar();
    let of = |term: &Basis| {
        let found = fit.plant.coefficient(term).expect("fitted");
        let std = fit.std(term).expect("fitted");
        let off = (found - truth.coefficient(term).expect("true")) / std;
        (truth.structure().name_of(term), off)
    };
    truth.structure().terms().iter().map(of).collect()
}

#[test]
fn thrusters_that_are_not_alike_do_not_pass_for_mass_or_drag() {
    let gains = [0.96, 1.07, 1.03, 0.94];
    let records = ["a", "b"].map(|name| {
        let seed = if name == "a" { 21 } else { 22 };
        trial(name, seed, gains.map(|gain| [gain; 2]))
    });
    let fit = fitted(&records);
    let found = excess(&fit, "excess-thrust");
    let found: Vec<f64> = found.into_iter().map(|x| 1.0 + x.expect("admitted")).collect();
    // Motion shows gains beside each other; the mean of the true ones is 1 here.
    for (found, truth) in found.iter().zip(gains) {
        assert!((found - truth).abs() < 0.01, "{found} {truth}");
    }
    assert_eq!(excess(&fit, "excess-reverse-thrust"), [None; 4]);
    assert!(off(&fit).iter().all(|(_, off)| off.abs() < 3.5), "{:?}", off(&fit));
    // Their mean is known no better than they are alike.
    let mass = fit.plant.structure().term_named("mass.surge").expect("there");
    let part = fit.std(&mass).expect("fitted") / 20.0;
    assert!((0.01..0.08).contains(&part), "{part}");
    // Another trial tells mass beside that mean.
    let other = trial("c", 23, gains.map(|gain| [gain; 2]));
    let step = fit.likelihood_step(&[&other]).expect("a pass").expect("a step");
    let place = fit.plant.structure().index_of(&mass).expect("there");
    let [change, std] = [step.change[place], step.covariance[(place, place)].sqrt()];
    assert!(std < 0.01 * 20.0 && change.abs() < 3.5 * std, "{change} ± {std}");
}

#[test]
fn thrusters_that_do_not_lag_alike_have_lags_of_their_own() {
    let lags_s = [0.1, 0.4, 0.15, 0.1];
    let records = [("a", 41), ("b", 42)].map(|(name, seed)| {
        trial_as(name, seed, |thruster, logged| {
            let lag_s = lags_s[thruster];
            behind(logged, Actuator { lag_s, ..Actuator::default() }, true)
        })
    });
    let fit = fitted(&records);
    // One has the lag of all.
    let found = excess(&fit, "excess-lag");
    for (found, truth) in found.iter().zip(lags_s) {
        let found = fit.actuator.lag_s + found.unwrap_or(0.0);
        assert!((found - truth).abs() < 0.01, "{found} {truth}");
    }
    assert_eq!(excess(&fit, "excess-thrust"), [None; 4]);
    assert!(off(&fit).iter().all(|(_, off)| off.abs() < 3.5), "{:?}", off(&fit));
}

#[test]
fn thrusters_that_rest_at_small_thrust_have_dead_bands() {
    // Roots of thrust, √N.
    let dead_bands = [0.17, 0.42, 0.17, 0.17];
    let records = [("a", 43), ("b", 44)].map(|(name, seed)| {
        trial_as(name, seed, |thruster, logged| {
            logged.map(|x| (x.abs().sqrt() - dead_bands[thruster]).max(0.0).powi(2).copysign(x))
        })
    });
    let fit = fitted(&records);
    let found = excess(&fit, "excess-dead-band");
    let common = (fit.actuator.dead_band, fit.actuator_std[Actuator::DEAD_BAND].unwrap_or(0.0));
    for ((found, name), truth) in found.iter().zip(NAMES).zip(dead_bands) {
        let term = fit.plant.structure().term_named(&format!("{name}.excess-dead-band"));
        let std = common.1.hypot(term.and_then(|term| fit.std(&term)).unwrap_or(0.0));
        let [found, std] =
            [common.0 + found.unwrap_or(0.0), std].map(|x| x * fit.actuator.full_speed);
        let is_found = (found - truth).abs() < 3.5 * std && std < 0.1 * truth;
        assert!(is_found, "{name}: {found} ± {std}, {truth}; {:?}", fit.actuator);
    }
    assert_eq!(fit.actuator.beyond_square, 0.0);
}

#[test]
fn a_thruster_that_is_weak_in_reverse_is_named_so() {
    let gains = [[1.0; 2], [1.0, 0.7], [1.0; 2], [1.0; 2]];
    let fit = fitted(&[trial("a", 23, gains), trial("b", 24, gains)]);
    let found = excess(&fit, "excess-reverse-thrust");
    let found: Vec<f64> = found.into_iter().map(|x| x.expect("admitted")).collect();
    for (k, found) in found.iter().enumerate() {
        let truth = if k == 1 { -0.3 } else { 0.0 };
        assert!((found - truth).abs() < 0.03, "{k}: {found}");
    }
}

#[test]
fn a_thruster_that_stands_still_in_one_trial_is_found_there() {
    let mut dead = [[1.0; 2]; 4];
    dead[2] = [0.0; 2];
    let fit = fitted(&[trial("a", 25, [[1.0; 2]; 4]), trial("b", 26, dead)]);
    let thruster = NAMES[2].to_owned();
    let expected = ThrusterFault { trial: "b".to_owned(), thruster, gain: 0.0 };
    assert_eq!(fit.faults, [expected]);
    assert_eq!(excess(&fit, "excess-thrust"), [None; 4]);
    assert!(off(&fit).iter().all(|(_, off)| off.abs() < 3.5), "{:?}", off(&fit));
}

#[test]
fn a_thruster_that_stands_still_in_all_trials_is_found_before_anything_makes_up_for_it() {
    let mut dead = [[1.0; 2]; 4];
    dead[1] = [0.0; 2];
    let records = [trial("a", 27, dead), trial("b", 28, dead)];
    let records: Vec<&TrialRecord> = records.iter().collect();
    let structure = structure();
    let first_fit = |records: &[&TrialRecord]| {
        let problem = Problem::new(&structure, records, None, false, Attitude::Known);
        FirstFit::new(problem, &structure, records)
    };
    let first = first_fit(&records).expect("an optimum");
    let (found, wired) = first.with_wiring_that_shows(&records, first_fit).expect("an optimum");
    // Its log stays as it is, so that its gain has a standard deviation.
    assert_eq!(wired, []);
    let (problem, optimum) = found.fitted.parts();
    let plant = problem.plant(&optimum.point.free).expect("possible");
    let own = plant.structure().term_named("bow-starboard.excess-thrust").expect("an effect");
    let excess = plant.coefficient(&own).expect("fitted");
    assert!((excess + 1.0).abs() < 0.01, "{excess}");
    let fit = fit_plant(&structure, &records, None, true).expect("an optimum");
    for (k, gain) in NAMES.iter().map(|name| fit.gains[*name]).enumerate() {
        let truth = dead[k][0];
        assert!((gain.gain - truth).abs() < 0.02 && gain.std < 0.01, "{k}: {gain:?}");
    }
    assert!(off(&fit).iter().all(|(_, off)| off.abs() < 3.5), "{:?}", off(&fit));
}

#[test]
fn a_thruster_that_pushes_the_other_way_in_all_trials_has_a_gain_below_zero() {
    let mut reversed = [[1.0; 2]; 4];
    reversed[1] = [-1.0; 2];
    let fit = fitted(&[trial("a", 29, reversed), trial("b", 30, reversed)]);
    assert_eq!(fit.faults, []);
    // The others give what their curves say.
    assert_eq!(excess(&fit, "excess-thrust"), [None, Some(-2.0), None, None]);
    assert_eq!(excess(&fit, "excess-reverse-thrust"), [None; 4]);
    assert!(off(&fit).iter().all(|(_, off)| off.abs() < 3.5), "{:?}", off(&fit));
    let own = fit.gains[NAMES[1]];
    assert!(own.is_fitted && (own.gain + 1.0).abs() < 4.0 * own.std && own.std < 0.02, "{own:?}");
    let term = fit.plant.structure().term_named("bow-starboard.excess-thrust").expect("there");
    assert_eq!(fit.std(&term), Some(own.std));
}

#[test]
fn gains_of_a_thruster_that_pushes_the_other_way_are_those_of_its_log() {
    // As it acts, 1.1 ahead and 0.9 in reverse.
    let gains = [Difference::Gain, Difference::InReverse].map(|of| of.terms(&structure())[1]);
    let structure = super::search::with_all(&structure(), &gains).expect("fits");
    let n = structure.terms().len();
    let coefficients = [planar().coefficients(), &[0.1, -0.2]].concat();
    let mut covariance = DMatrix::zeros(n, n);
    let own = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 9.0]);
    covariance.view_mut((n - 2, n - 2), (2, 2)).copy_from(&own);
    let thrust_covariance = DMatrix::zeros(n, n);
    let plant = Plant::new(structure, coefficients).expect("finite");
    let scaled = gains::Scaled { plant, covariance, thrust_covariance, scale: 1.0 };
    let logged = scaled.with_reversed(NAMES[1], 0.5).expect("finite");
    let value = |k: usize| logged.plant.coefficients()[k];
    // −0.9 of a log ahead, and −1.1 of one in reverse.
    assert!((value(n - 2) + 1.9).abs() < 1e-12 && (value(n - 1) + 0.2).abs() < 1e-12);
    let found = logged.covariance.view((n - 2, n - 2), (2, 2)).into_owned();
    assert_eq!(found, DMatrix::from_row_slice(2, 2, &[11.0, -8.0, -8.0, 9.0]));
    // Another, of which nothing is said, has the standard deviation that it is told.
    let both = logged.with_reversed(NAMES[2], 0.5).expect("finite");
    assert_eq!(both.plant.coefficients()[n], -2.0);
    assert_eq!(both.covariance[(n, n)], 0.25);
}

#[test]
fn thrusters_that_do_as_they_say_have_no_gains() {
    let fit = fitted(&[trial("a", 27, [[1.0; 2]; 4]), trial("b", 28, [[1.0; 2]; 4])]);
    assert!(fit.faults.is_empty());
    for what in ["excess-thrust", "excess-reverse-thrust"] {
        assert_eq!(excess(&fit, what), [None; 4]);
    }
}

#[test]
fn an_exponent_that_is_not_fitted_moves_coefficients_as_one_that_is() {
    // The power 2.005 of speed in place of 2, for speeds below √12.
    let acts = |_: usize, logged: &Timed| logged.map(|x| x * (x.abs() / 12.0).powf(0.0025));
    let records = [trial_as("a", 27, acts), trial_as("b", 28, acts)];
    let records: Vec<&TrialRecord> = records.iter().collect();
    let problem = Problem::new(&structure(), &records, None, false, Attitude::Known);
    assert!(problem.can_show[Actuator::EXPONENT]);
    let fitted = |fits: bool| {
        let mut problem = problem.clone();
        problem.fits[Actuator::EXPONENT] = fits;
        begun(problem, &records).expect("an optimum").2
    };
    let (without, with) = (fitted(false), fitted(true));
    assert!(with.unseen_exponent(1.0).is_none());
    let unseen = without.unseen_exponent(1.0).expect("open");
    let found = with.optimum.point.actuator.beyond_square;
    let std = unseen.variance.sqrt();
    assert!(
        (unseen.x - found).abs() < 0.3 * std && (found - 0.005).abs() < 4.0 * std,
        "{unseen:?}"
    );
    let plants =
        [&without, &with].map(|one| one.problem.plant(&one.optimum.point.free).expect("a plant"));
    let [before, after] = plants.each_ref().map(Plant::coefficients);
    let (lean, full) = (without.covariance(), with.covariance());
    let second = |k: usize| lean[(k, k)] + unseen.variance * unseen.by[k].powi(2);
    for (k, (before, after)) in before.iter().zip(after).enumerate() {
        let moved = before - unseen.by[k] * unseen.x;
        assert!((moved - after).abs() < 0.3 * full[(k, k)].sqrt(), "{k}: {moved}, {after}");
        assert!(
            (second(k) / full[(k, k)] - 1.0).abs() < 0.1,
            "{k}: {} {}",
            second(k),
            full[(k, k)]
        );
    }
    // Coloured innovations make it less certain, and what it may move larger, until nothing speaks for it.
    let coloured = without.unseen_exponent(1.5).expect("open");
    assert!((coloured.variance / unseen.variance - 1.5).abs() < 0.01, "{coloured:?}");
    assert!(without.unseen_exponent(unseen.x.powi(2) / unseen.variance).is_none());
    assert!(coloured.covariance()[(0, 0)] > unseen.covariance()[(0, 0)]);
}

/// The optimum of two trials with a gain of each thruster but the first.
fn with_gains_of_others(gains: [f64; 4]) -> Fitted {
    let records =
        [("a", 27), ("b", 28)].map(|(name, seed)| trial(name, seed, gains.map(|gain| [gain; 2])));
    let records: Vec<&TrialRecord> = records.iter().collect();
    let problem = Problem::new(&structure(), &records, None, false, Attitude::Known);
    let (_, _, fitted) = begun(problem, &records).expect("an optimum");
    let group = Difference::Gain.terms(&structure());
    fitted.with_group(&group[1..], Difference::Gain).expect("an optimum")
}

#[test]
fn gains_are_left_out_again_where_thrusters_are_alike() {
    let count = |fitted: &Fitted| fitted.problem.structure.terms().len();
    let mut alike = with_gains_of_others([1.0; 4]);
    assert_eq!(count(&alike), structure().terms().len() + 3);
    let asked = alike.problem.structure.clone();
    let kept = alike.clone().without_gains_of_alike(&asked).expect("an optimum");
    assert_eq!(count(&kept), count(&alike), "asked for");
    let tried = Tried {
        name: "sway: |r|r".to_owned(),
        admitted: false,
        likelihood_ratio: 1.0,
        p_value: 0.3,
    };
    alike.tried = vec![tried];
    let left = alike.without_gains_of_alike(&structure()).expect("an optimum");
    assert_eq!(count(&left), structure().terms().len());
    assert_eq!(left.tried.len(), 1, "what was tried before");
    // Nine parts in a thousand are below what a user minds, but the likelihood needs them.
    for some in [[1.0, 1.05, 1.0, 1.0], [1.0, 1.009, 0.991, 1.009]] {
        let fitted = with_gains_of_others(some);
        let kept = fitted.without_gains_of_alike(&structure()).expect("an optimum");
        assert_eq!(count(&kept), structure().terms().len() + 3, "{some:?}");
    }
}

#[test]
fn information_on_gains_holds_their_mean_and_leaves_their_differences() {
    let group = Difference::Gain.terms(&structure());
    let with_gains = super::search::with_all(&structure(), &group).expect("fits");
    let (p, n) = (structure().terms().len(), group.len());
    let mut information = DMatrix::identity(p + n, p + n);
    gains::hold_mean(&with_gains, &mut information);
    let covariance = information.try_inverse().expect("positive definite");
    let variance = |weights: [f64; 4]| {
        let of = |i: usize, j: usize| weights[i] * weights[j] * covariance[(p + i, p + j)];
        (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| of(i, j)).sum::<f64>()
    };
    assert!((variance([0.25; 4]).sqrt() - 1e-3).abs() < 1e-5);
    assert!((variance([1.0, -1.0, 0.0, 0.0]) - 2.0).abs() < 1e-9);
    assert!((covariance[(0, 0)] - 1.0).abs() < 1e-12);
}

#[test]
fn gains_of_thrusters_that_are_alike_are_known_without_being_fitted() {
    let fit = fitted(&[trial("a", 27, [[1.0; 2]; 4]), trial("b", 28, [[1.0; 2]; 4])]);
    assert_eq!(fit.gains.len(), 4);
    for (name, own) in &fit.gains {
        assert!(!own.is_fitted && own.std < 0.02, "{name}: {own:?}");
        assert!((own.gain - 1.0).abs() < 4.0 * own.std, "{name}: {own:?}");
    }
}

#[test]
fn a_thruster_with_a_loss_is_beside_others_that_have_none() {
    let mut fouled = [[1.0; 2]; 4];
    fouled[2] = [0.8; 2];
    let fit = fitted(&[trial("a", 35, fouled), trial("b", 36, fouled)]);
    for (k, name) in NAMES.iter().enumerate() {
        let own = fit.gains[*name];
        let truth = if k == 2 { 0.8 } else { 1.0 };
        assert!(
            own.is_fitted && (own.gain - truth).abs() < 0.03 && own.std < 0.03,
            "{name}: {own:?}"
        );
    }
}
