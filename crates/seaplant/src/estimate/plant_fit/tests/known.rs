//! Known forces: what they do to a motion, and that they reveal the scale of thrust.

use super::*;
use crate::motion::{KnownForce, KnownKind};
use crate::plant::Product;

/// Simulations in steps of 0.02 s against a plant with the weight in its own numbers.
const SAME: f64 = 1e-9;

fn weight(from_s: f64, to_s: f64) -> KnownForce {
    KnownForce {
        kind: KnownKind::Weight { weight_n: 15.0, mass_kg: 1.7 },
        position_m: [0.0, 0.0, 0.2],
        std_n: 0.0,
        from_s,
        to_s,
    }
}

fn six() -> Plant {
    let structure = Structure::of(&Dof::ALL, Symmetry::None).expect("six");
    let value = |term: &Basis| match term {
        Basis::Mass(i, j) if i == j => {
            if i.is_rotation() {
                2.0
            } else {
                20.0
            }
        }
        Basis::Mass(..) => 0.0,
        Basis::Product(on, product) if *product == Product::linear(*on) => 5.0,
        Basis::Product(..) => 20.0,
        Basis::WeightExcess => -1.0,
        Basis::Lever(2) => 6.0,
        _ => 0.0,
    };
    let coefficients = structure.terms().iter().map(value).collect();
    Plant::new(structure, coefficients).expect("possible")
}

/// A plant whose own numbers hold a weight.
fn laden(plant: &Plant, m: f64, w: f64, r: Vector3<f64>) -> Plant {
    let s = r.cross_matrix();
    let own = |i: usize, j: usize| match (i / 3, j / 3) {
        (0, 0) => {
            if i == j {
                m
            } else {
                0.0
            }
        }
        (0, 1) => -m * s[(i, j - 3)],
        (1, 0) => m * s[(i - 3, j)],
        _ => -m * (s * s)[(i - 3, j - 3)],
    };
    let terms = plant.structure().terms().iter().zip(plant.coefficients());
    let coefficients = terms.map(|(term, x)| match term {
        Basis::Mass(i, j) => x + own(i.index(), j.index()),
        Basis::WeightExcess => x + w,
        Basis::Lever(axis) => x + w * r[*axis],
        _ => *x,
    });
    Plant::new(plant.structure().clone(), coefficients.collect()).expect("possible")
}

#[test]
fn a_vehicle_with_a_weight_moves_like_one_that_has_it_in_its_numbers() {
    let plant = six();
    let known = vec![weight(-1.0, 100.0)];
    let mut inputs = Inputs { known, current: [0.2, -0.1], ..Inputs::default() };
    let time_s: Vec<f64> = (0..200).map(|k| 0.1 * f64::from(k)).collect();
    let mut random = random(3);
    for axis in 0..6 {
        inputs.force[axis] =
            Some(stepped(&time_s, &mut random, (if axis < 3 { 8.0 } else { 0.5 }, 20)));
    }
    let hung = simulate(&plant, &inputs, &Vector6::zeros(), &time_s).expect("bounded");
    inputs.known.clear();
    let own = laden(&plant, 1.7, 15.0, Vector3::new(0.0, 0.0, 0.2));
    let own = simulate(&own, &inputs, &Vector6::zeros(), &time_s).expect("bounded");
    for (hung, own) in hung.velocity.iter().zip(&own.velocity) {
        assert!((hung - own).amax() < SAME, "{hung} {own}");
    }
}

/// Heave with thrust that is `scale` times what is logged, hung with known forces.
fn heave(scale: f64, known: Vec<KnownForce>, seed: u64) -> TrialRecord {
    let structure = Structure::of(&[Dof::Heave], Symmetry::None).expect("one");
    let value = |term: &Basis| match term {
        Basis::Mass(..) => 30.0,
        Basis::Product(on, product) if *product == Product::linear(*on) => 8.0,
        Basis::Product(..) => 40.0,
        _ => -2.0,
    };
    let coefficients = structure.terms().iter().map(value).collect();
    let plant = Plant::new(structure, coefficients).expect("possible");
    let mut random = random(seed);
    let time_s: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
    let logged = stepped(&time_s, &mut random, (15.0, 40));
    let acting = logged.map(|x| scale * x);
    let mut inputs = Inputs { known: known.clone(), ..Inputs::default() };
    inputs.force[2] = Some(acting);
    let motion = simulate(&plant, &inputs, &Vector6::zeros(), &time_s).expect("bounded");
    let noisy: Vec<f64> = motion.velocity.iter().map(|v| v[2] + 0.004 * random()).collect();
    let mut record = TrialRecord { known, ..TrialRecord::until("hover", 299.9) };
    record.force[2] = Some(logged);
    record.velocity[2] = Some(Timed::new("heave", time_s, noisy).expect("valid"));
    record
}

fn fitted(record: &TrialRecord) -> PlantFit {
    let structure = Structure::of(&[Dof::Heave], Symmetry::None).expect("one");
    fit_plant(&structure, &[record], None, true).expect("fits")
}

const SCALE: usize = Actuator::SCALE;

#[test]
fn a_weight_that_is_hung_on_reveals_the_scale_of_thrust() {
    let known = vec![weight(60.0, 120.0), weight(180.0, 240.0)];
    let fit = fitted(&heave(1.2, known, 5));
    let (scale, std) = (fit.actuator.log_scale.exp(), fit.actuator_std[SCALE].expect("fitted"));
    assert!((scale - 1.2).abs() < 3.0 * 1.2 * std && std < 0.02, "{scale} {std}");
    // 30 kg without the weight's own 1.7 kg; without the scale it would be 25 kg.
    let mass = fit.plant.coefficients()[0];
    assert!((mass - 30.0).abs() < 1.0, "{mass}");
    assert_eq!(fit.thrust_covariance.amax(), 0.0);
}

#[test]
fn without_a_known_force_there_is_no_scale() {
    let fit = fitted(&heave(1.2, Vec::new(), 5));
    assert_eq!((fit.actuator.log_scale, fit.actuator_std[SCALE]), (0.0, None));
    let mass = fit.plant.coefficients()[0];
    assert!((mass - 25.0).abs() < 1.0, "{mass}");
}

#[test]
fn a_force_that_is_not_known_for_sure_widens_the_scale() {
    let line = |std_n: f64| KnownForce {
        kind: KnownKind::Line { force_n: 15.0, direction: [0.0, 0.0, 1.0] },
        std_n,
        ..weight(60.0, 180.0)
    };
    let std = |std_n: f64| {
        let fit = fitted(&heave(0.8, vec![line(std_n)], 7));
        let std = fit.actuator_std[SCALE].expect("fitted");
        let off = (fit.actuator.log_scale - 0.8_f64.ln()).abs();
        assert!(off < 3.0 * std, "{off} {std}");
        std
    };
    let (sure, unsure) = (std(0.0), std(1.5));
    // A pull that is 10 % off moves the scale by as much.
    let added = (unsure * unsure - sure * sure).sqrt();
    assert!((added - 0.1).abs() < 0.01, "{sure} {unsure}");
}

/// A line that pulls down.
fn line(force_n: f64, from_s: f64, to_s: f64) -> KnownForce {
    let kind = KnownKind::Line { force_n, direction: [0.0, 0.0, 1.0] };
    KnownForce { kind, ..weight(from_s, to_s) }
}

#[test]
fn known_forces_that_contradict_each_other_are_told_with_what_each_says() {
    let acting = vec![weight(30.0, 90.0), line(15.0, 120.0, 180.0), weight(210.0, 260.0)];
    let mut record = heave(1.0, acting.clone(), 5);
    assert_eq!(fitted(&record).claims, []);
    // A line that pulled with 15 N, while its scale was read as 19.5 N.
    record.known[1] = line(19.5, 120.0, 180.0);
    let claims = fitted(&record).claims;
    let said: Vec<(f64, f64)> =
        claims.iter().map(|claim| (claim.force.size_n(), claim.scale)).collect();
    assert_eq!(claims.len(), 2, "{said:?}");
    for (claim, truth) in claims.iter().zip([1.0, 1.3]) {
        assert!((claim.scale - truth).abs() < 3.0 * claim.std && claim.std < 0.03, "{said:?}");
    }
    // One that is known to 30 % only does not contradict.
    record.known[1].std_n = 5.0;
    assert_eq!(fitted(&record).claims, []);
}
