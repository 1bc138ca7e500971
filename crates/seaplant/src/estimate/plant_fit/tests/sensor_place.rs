//! A velocity sensor elsewhere than stated, and couplings in damping, of a boat whose sway nothing pushes.

use super::*;

/// The place of the sensor and the centre of damping differ by so much from the origin, m.
const FAR_M: f64 = 0.5;

const INERTIA: f64 = 3.0;

/// Linear damping, of sway about a point this far ahead of the origin.
fn boat(ahead_m: f64) -> Plant {
    let structure = Structure::of(&PLANAR, Symmetry::PortStarboard).expect("three axes");
    let coupled = ["sway: r", "yaw: v"].map(|name| name.parse::<Basis>().expect("a term"));
    let with = |structure: Structure, term: &Basis| structure.with(*term).expect("fits");
    let structure = coupled.iter().fold(structure, with);
    let [of_sway, of_yaw] = [8.0, 1.5];
    let of = |term: &Basis| match term.to_string().as_str() {
        "mass.surge" => 20.0,
        "mass.sway" => 30.0,
        "mass.sway-yaw" => 1.0,
        "mass.yaw" => INERTIA,
        "surge: u" => 5.0,
        "sway: v" => of_sway,
        "yaw: r" => of_yaw + ahead_m * ahead_m * of_sway,
        "sway: r" | "yaw: v" => ahead_m * of_sway,
        _ => 0.0,
    };
    let coefficients = structure.terms().iter().map(of).collect();
    Plant::new(structure, coefficients).expect("possible")
}

/// Trials by a sensor this far ahead of the origin, where it is said to be.
fn trials(plant: &Plant, ahead_m: f64, pushes_sway: bool) -> [TrialRecord; 2] {
    [("a", 3), ("b", 4)].map(|(name, seed)| {
        let mut random = random(seed);
        let time_s: Vec<f64> = (0..1500).map(|k| 0.1 * f64::from(k)).collect();
        let mut series = |amplitude, dwell| Some(stepped(&time_s, &mut random, (amplitude, dwell)));
        let (surge, yaw) = (series(8.0, 37), series(2.0, 23));
        let sway = series(8.0, 29).filter(|_| pushes_sway);
        let force = [surge, sway, None, None, None, yaw];
        let empty = TrialRecord::until(name, time_s[time_s.len() - 1]);
        let logged = TrialRecord { force: force.clone(), ..empty };
        let mut record = driven(plant, logged, force, (&time_s, 0.004, &mut random));
        let [sway, yaw] = [1, 5].map(|axis| record.velocity[axis].clone().expect("measured"));
        let still = yaw.map(|_| 0.0);
        let swung = sway.values().iter().zip(yaw.values()).map(|(v, r)| v + ahead_m * r).collect();
        record.velocity[1] = Some(sway.with_values("sway", swung).expect("finite"));
        record.rates = Some([still.clone(), still, yaw]);
        record
    })
}

fn fitted(plant: &Plant, ahead_m: f64, pushes_sway: bool) -> PlantFit {
    let usual = Structure::of(&PLANAR, Symmetry::PortStarboard).expect("three axes");
    let records = trials(plant, ahead_m, pushes_sway);
    let fit = fit_plant(&usual, &records.each_ref(), None, true).expect("an optimum");
    let found = fit.plant.coefficient(&inertia()).expect("fitted");
    let std = fit.std(&inertia()).expect("fitted");
    assert!((found - INERTIA).abs() < 4.0 * std, "inertia {found} ± {std}");
    fit
}

fn inertia() -> Basis {
    Basis::Mass(Dof::Yaw, Dof::Yaw)
}

fn coupled(fit: &PlantFit) -> Vec<&str> {
    let admitted = fit.tried.iter().filter(|tried| tried.admitted);
    admitted.map(|tried| tried.name.as_str()).collect()
}

#[test]
fn a_sensor_elsewhere_does_not_pass_for_couplings_and_the_fit_has_those_beside_it() {
    let fit = fitted(&boat(0.0), FAR_M, false);
    let [x, ..] = fit.report.lever_m;
    assert!((x - FAR_M).abs() < 0.05, "{x}");
    assert_eq!(coupled(&fit), [""; 0]);
    let other = fit.other_place.as_ref().expect("as likely");
    assert_eq!(other.report.lever_m, [0.0; 3]);
    assert_eq!(coupled(other), ["sway: r", "yaw: v"]);
    let (of_other, own) = (other.plant.coefficient(&inertia()), fit.plant.coefficient(&inertia()));
    assert!(of_other > own.map(|own| 2.0 * own), "{of_other:?} {own:?}");
}

#[test]
fn couplings_in_damping_do_not_pass_for_a_sensor_elsewhere() {
    let fit = fitted(&boat(-FAR_M), 0.0, false);
    assert_eq!(fit.report.lever_m, [0.0; 3]);
    assert_eq!(coupled(&fit), ["sway: r", "yaw: v"]);
    assert!(fit.other_place.is_none());
}

#[test]
fn a_push_along_sway_tells_a_sensor_elsewhere_from_couplings() {
    let fit = fitted(&boat(-FAR_M), 0.0, true);
    assert_eq!((fit.report.lever_m, fit.other_place.is_none()), ([0.0; 3], true));
    let fit = fitted(&boat(0.0), FAR_M, true);
    let [x, ..] = fit.report.lever_m;
    assert!((x - FAR_M).abs() < 0.05 && fit.other_place.is_none(), "{x}");
}
