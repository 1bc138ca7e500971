//! A rudder that follows its orders late and slowly, and one whose angles are logged.

use super::*;
use crate::Surface;
use crate::plant::Foil;
use crate::trial::SteeringGear;

/// Lift of the rudder at 1 m/s, N/rad.
const LIFT: f64 = 60.0;

/// A vehicle that turns in about a second, with a rudder 0.6 m aft.
fn steered() -> Plant {
    let foil = Foil {
        kind: Surface::Rudder,
        name: "rudder".to_owned(),
        position_m: [-0.6, 0.0, 0.0],
        axis: [0.0, 0.0, 1.0],
        stall_rad: None,
    };
    let force = EffectForce::Lift { foil, propeller_ahead: None };
    let lift = Effect { name: "rudder.lift".to_owned(), force };
    let structure = planar().structure().clone().with_effect(lift, true).expect("a new effect");
    let (mass, damping) = ([20.0, 21.0, 0.8, 12.0], [5.0, 40.0, 8.0, 90.0, 0.3, 10.0, 6.0]);
    let coefficients = mass.into_iter().chain(damping).chain([LIFT]).collect();
    Plant::new(structure, coefficients).expect("possible")
}

fn fitted(gear: SteeringGear) -> PlantFit {
    let plant = steered();
    let records = [("a", 7), ("b", 8)].map(|(name, seed)| {
        let mut random = random(seed);
        let time_s: Vec<f64> = (0..1500).map(|k| 0.1 * f64::from(k)).collect();
        let ahead = stepped(&time_s, &mut random, (6.0, 37)).map(|force| 30.0 + force);
        let order = stepped(&time_s, &mut random, (0.3, 23)).map(|x| x.clamp(-0.5, 0.5));
        let angle = Signal::Angle { kind: Surface::Rudder, name: "rudder".to_owned() };
        let force = [Some(ahead), None, None, None, None, None];
        let empty = TrialRecord::until(name, time_s[time_s.len() - 1]);
        let signals = BTreeMap::from([(angle, order)]);
        let logged = TrialRecord { force: force.clone(), signals, ..empty };
        let acting = logged.with_surfaces_behind(&logged, &gear).expect("finite");
        let moved = driven(&plant, acting, force, (&time_s, 0.004, &mut random));
        TrialRecord { signals: logged.signals, ..moved }
    });
    fit_plant(plant.structure(), &records.each_ref(), None, true).expect("an optimum")
}

#[test]
fn a_rudder_that_follows_its_orders_late_and_slowly_does_not_pass_for_mass() {
    let gear = SteeringGear { delay_s: 0.25, slew_s_rad: 1.5 };
    let fit = fitted(gear);
    let found = fit.actuator.steering;
    // Angles bend between the instants of 0.1 s by which the vehicle is simulated.
    assert!((found.delay_s - gear.delay_s).abs() < 0.03, "{found:?}");
    assert!((found.slew_s_rad / gear.slew_s_rad - 1.0).abs() < 0.05, "{found:?}");
    assert!(fit.steering_std.iter().all(Option::is_some), "{:?}", fit.steering_std);
    for dof in PLANAR {
        let mass = Basis::Mass(dof, dof);
        let [a, b] =
            [&fit.plant, &steered()].map(|plant| plant.coefficient(&mass).expect("a mass"));
        assert!((a / b - 1.0).abs() < 0.1, "{dof}: {a}, not {b}");
    }
}

#[test]
fn a_rudder_whose_angles_are_logged_has_no_gear() {
    let fit = fitted(SteeringGear::default());
    assert_eq!((fit.actuator.steering, fit.steering_std), (SteeringGear::default(), [None; 2]));
}
