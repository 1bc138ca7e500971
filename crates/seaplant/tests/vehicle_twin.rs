//! The twin of a whole vehicle, from its plant through its logs and back.

use std::collections::BTreeMap;

use seaplant::exchange::{PlantFile, PlantModel};
use seaplant::plant::RigidBody;
use seaplant::results::{OffBecause, Parameter, PlantResult, PlantScore, Trust};
use seaplant::twin::{Disturbance, Driving, TwinCampaign, VehicleTwinSpec, make_vehicle};
use seaplant::{
    Caveat, CaveatCode, Dof, IdentifyOptions, Method, Quantity, Role, Severity, ThrustUncertainty,
    Trial, identify, plant_of_result,
};
use serde_json::{Value, json};

/// A vehicle of three axes whose two thrusters push surge and yaw and whose third pushes sway.
pub(crate) fn boat() -> PlantModel {
    model(table())
}

fn table() -> Value {
    let curve =
        json!({ "kind": "quadratic", "input": "command", "forward": 40.0, "reverse": 30.0 });
    let thruster = |name: &str, position: [f64; 3], direction: [f64; 3]| json!({ "name": name, "position_m": position, "direction": direction, "curve": curve });
    json!({
        "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
        "axes": ["surge", "sway", "yaw"],
        "mass_matrix": [[60.0, 0.0, 0.0], [0.0, 90.0, 3.0], [0.0, 3.0, 12.0]],
        "linear_damping": [6.0, 20.0, 5.0],
        "quadratic_damping": [40.0, 120.0, 10.0],
        "thruster": [
            thruster("port", [0.0, -0.4, 0.0], [1.0, 0.0, 0.0]),
            thruster("starboard", [0.0, 0.4, 0.0], [1.0, 0.0, 0.0]),
            thruster("bow", [0.3, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ],
    })
}

fn model(table: Value) -> PlantModel {
    let file: PlantFile = serde_json::from_value(table).expect("a table");
    file.model().expect("possible")
}

fn short(change: impl FnOnce(&mut VehicleTwinSpec)) -> VehicleTwinSpec {
    let mut spec =
        VehicleTwinSpec { duration_s: 150.0, hold_out_s: 100.0, ..VehicleTwinSpec::default() };
    change(&mut spec);
    spec
}

fn trials(twin: &TwinCampaign) -> Vec<Trial> {
    twin.trials.iter().map(|log| log.trial(twin).expect("complete")).collect()
}

/// Of a dozen 99.7 % intervals all hold the truth; what is known better than to this part of it
/// may be off by as much, which rounded commands cost.
const DEVIATIONS: f64 = 3.0;
const PART: f64 = 0.02;
/// The motion of a held-out trial is predicted, but for noise of the instruments.
const HELD_OUT: f64 = 0.98;

fn identified(twin: &TwinCampaign) -> PlantResult {
    let options = IdentifyOptions { together: twin.together.clone(), ..IdentifyOptions::default() };
    let plants = identify(&twin.vehicle, &trials(twin), &options).results.plants;
    plants.into_values().max_by_key(|plant| plant.axes.len()).expect("a plant")
}

fn assert_recovered(spec: &VehicleTwinSpec) -> PlantResult {
    let twin = make_vehicle(spec, &boat()).expect("can be made");
    let found = identified(&twin);
    let truth = &twin.truth.vehicle.as_ref().expect("a whole vehicle").coefficients;
    plant_of_result(&found).expect("a plant");
    for (name, expected) in truth {
        let x = &found.parameters[name];
        let off = (x.value - expected).abs();
        let near = off < DEVIATIONS * x.std || off < PART * expected.abs();
        assert!(near, "{name}: {} ± {}, {expected}", x.value, x.std);
    }
    for (dof, score) in &found.hold_out.as_ref().expect("held out").by_axis {
        let r2 = score.r_squared.expect("bounded");
        assert!(r2 > HELD_OUT, "{dof}: R² {r2}");
    }
    found
}

#[test]
fn a_freely_driven_twin_comes_back_as_it_is() {
    assert_recovered(&short(|_| ()));
}

/// Masses to ± 10 % and drag to ± 20 % are what a user takes those of a usable plant for.
#[test]
fn what_a_tether_leaves_unknown_is_one_warning() {
    let wide = |plant: &PlantResult| {
        let is_wide = |caveat: &&Caveat| caveat.code == CaveatCode::WideInterval;
        plant.caveats.iter().filter(is_wide).cloned().collect::<Vec<Caveat>>()
    };
    let calm = short(|_| ());
    assert_eq!(wide(&found(&calm, |_| ())), []);
    let plant = found(
        &short(|spec| {
            spec.duration_s = 60.0;
            spec.disturbances = Disturbance::parse_list("tether").expect("known");
            spec.tether_part = 0.3;
        }),
        |_| (),
    );
    let told = wide(&plant);
    assert_eq!((told.len(), told[0].severity), (1, Severity::Warning), "{told:?}");
    for (name, axis) in [("mass.surge", "surge mass"), ("mass.sway", "sway mass")] {
        let x = &plant.parameters[name];
        let part = 0.5 * (x.high95 - x.low95) / x.value;
        let is_told = told[0].message.contains(&format!("the {axis} to ±"));
        assert_eq!(is_told, part > 0.1, "{name}: ± {part}: {}", told[0].message);
    }
    assert!(told[0].message.contains("drag in "), "{}", told[0].message);
}

#[test]
fn sweeps_and_a_current_lead_to_the_same_plant() {
    assert_recovered(&short(|spec| {
        spec.driving = Driving::Mixture;
        spec.disturbances = Disturbance::parse_list("current").expect("known");
        // What varies no held-out prediction knows.
        spec.strength.current_std_m_s = 0.0;
    }));
}

#[test]
fn propellers_that_lag_and_are_weak_in_reverse_are_found_to() {
    let spec = short(|spec| {
        spec.disturbances = Disturbance::parse_list("lag,delay,thrcoef").expect("known");
    });
    let found = assert_recovered(&spec).nuisances;
    let truth = [
        ("lag", spec.strength.lag_s, 0.005),
        ("delay", spec.strength.delay_s, 0.005),
        // By how much the propellers of Jason 2 are weaker in reverse.
        ("reverse_ratio", 0.0328 / 0.0402, 0.01),
    ];
    for (name, expected, near) in truth {
        let off = (found[name].value - expected).abs();
        assert!(off < near, "{name}: {} ± {}", found[name].value, found[name].std);
    }
}

#[test]
fn thrust_by_another_power_of_speed_is_found_and_its_scale_doubted() {
    let expected = VehicleTwinSpec::default().strength.thrust_exponent;
    assert_law_found("thrust-exponent", expected, |found| found["thrust_exponent"].value);
}

#[test]
fn a_dead_band_of_propellers_is_found_and_the_scale_of_thrust_doubted() {
    let expected = VehicleTwinSpec::default().strength.dead_band;
    // Of the greatest command of the trials, where that of all is 1.
    assert_law_found("dead-band", expected, |found| {
        found["dead_band"].value * found["full_speed"].value
    });
}

fn assert_law_found(
    disturbance: &str,
    expected: f64,
    law: impl Fn(&BTreeMap<String, Parameter>) -> f64,
) {
    let spec = short(|spec| {
        spec.disturbances = Disturbance::parse_list(disturbance).expect("known");
    });
    let twin = make_vehicle(&spec, &boat()).expect("can be made");
    let options = IdentifyOptions { together: twin.together.clone(), ..IdentifyOptions::default() };
    let found = identify(&twin.vehicle, &trials(&twin), &options).results;
    let found = &found.plants["surge-sway-yaw"];
    let law = law(&found.nuisances);
    assert!((law - expected).abs() < 0.01, "{law}");
    let is_doubted = |caveat: &Caveat| {
        (caveat.code, caveat.severity) == (CaveatCode::ThrustScale, Severity::Warning)
    };
    assert!(found.caveats.iter().any(is_doubted), "{:?}", found.caveats);
    // At which speed the curve is right nobody tells the fit; the intervals know that.
    for (name, expected) in MASSES {
        let x = &found.parameters[name];
        assert!(x.low95 < expected && expected < x.high95, "{name}: {x:?}, {expected}");
    }
}

/// What is identified of a body that three thrusters push along its axes, with a stated mass in air.
fn pushed_body(dry_kg: f64) -> PlantResult {
    let curve =
        json!({ "kind": "quadratic", "input": "command", "forward": 20.0, "reverse": 20.0 });
    let thruster = |name: &str, direction: [f64; 3]| json!({ "name": name, "position_m": [0.0, 0.0, 0.0], "direction": direction, "curve": curve });
    let body = model(json!({
        "schema": "seaplant/plant/1", "name": "body", "source": "worked by hand",
        "axes": ["surge", "sway", "heave"],
        "mass_matrix": [[17.0, 0.0, 0.0], [0.0, 19.0, 0.0], [0.0, 0.0, 19.0]],
        "linear_damping": [4.0, 6.0, 6.0],
        "quadratic_damping": [20.0, 40.0, 40.0],
        "thruster": [
            thruster("main", [1.0, 0.0, 0.0]),
            thruster("side", [0.0, 1.0, 0.0]),
            thruster("down", [0.0, 0.0, 1.0]),
        ],
    }));
    let mut twin = make_vehicle(&short(|_| ()), &body).expect("can be made");
    twin.vehicle.dry_mass_kg = Some(dry_kg);
    identified(&twin)
}

/// Of 11 kg it is a body like others; of 5.5 or 16 kg thrust seems twice too large or 1.5 times too small.
#[test]
fn masses_of_another_scale_of_thrust_say_how_far_numbers_are_off() {
    let scale = |plant: &PlantResult| {
        let off = plant.verdict.may_be_off.iter();
        let mut own = off.filter(|off| off.because == OffBecause::ThrustScale);
        own.find(|off| off.number == "mass.sway").and_then(|off| off.part)
    };
    // The interval holds what mass is at either scale.
    let holds = |plant: &PlantResult, kg: f64| {
        let mass = &plant.parameters["mass.sway"];
        mass.low95 < kg && kg < mass.high95 && mass.low95 < 19.0 && 19.0 < mass.high95
    };
    let usual = pushed_body(11.0);
    assert_eq!(scale(&usual), None, "{:?}", usual.verdict);
    assert!(!holds(&usual, 19.5), "{:?}", usual.parameters["mass.sway"]);
    let large = pushed_body(5.5);
    assert_eq!(large.verdict.trust, Trust::UsableWithCare, "{:?}", large.verdict);
    let part = scale(&large).expect("twice too large");
    assert!((0.8..1.1).contains(&part), "{part}");
    assert!(holds(&large, 19.0 / 2.0), "{:?}", large.parameters["mass.sway"]);
    let small = pushed_body(16.0);
    assert_eq!(small.verdict.trust, Trust::Doubtful, "{:?}", small.verdict);
    assert!(small.verdict.reason.contains("less than those of any body"), "{:?}", small.verdict);
    let part = scale(&small).expect("too small");
    assert!((0.45..0.6).contains(&part), "{part}");
    assert!(holds(&small, 19.0 * 1.5), "{:?}", small.parameters["mass.sway"]);
}

#[test]
fn unsure_thrust_curves_widen_a_whole_plant_together_and_change_nothing_else() {
    let fitted = |uncertainty: f64| {
        let mut twin = make_vehicle(&short(|_| ()), &boat()).expect("can be made");
        let both = ThrustUncertainty { forward: uncertainty, reverse: uncertainty };
        for thruster in &mut twin.vehicle.thrusters {
            thruster.uncertainty = both;
        }
        let options = IdentifyOptions {
            together: twin.together.clone(),
            methods: vec![Method::FilterError, Method::Ekf],
            ..IdentifyOptions::default()
        };
        identify(&twin.vehicle, &trials(&twin), &options).results
    };
    let name = "surge-sway-yaw";
    let (sure, unsure) = (fitted(0.0), fitted(0.1));
    let online = &unsure.methods[name][&Method::Ekf];
    let (sure, unsure) = (&sure.plants[name], &unsure.plants[name]);
    for (name, x) in &unsure.parameters {
        // As of a single axis: motion tells the ratio of both ways, 10 % / √2 are left of the scale.
        let (own, part) = (sure.parameters[name].std / x.value.abs(), x.std / x.value.abs());
        assert!((part - own.hypot(0.1 / 2_f64.sqrt())).abs() < 0.004, "{name}: {part}, {own}");
        assert!(online.parameters[name].std > 0.07 * x.value.abs(), "{name}");
        assert_eq!(x.value, sure.parameters[name].value, "{name}");
    }
    let scores =
        |of: &PlantScore| of.by_axis.values().map(|axis| axis.r_squared).collect::<Vec<_>>();
    assert_eq!(scores(&unsure.fit), scores(&sure.fit));
    let held_out = |of: &PlantResult| of.hold_out.as_ref().map(scores).expect("a trial is kept");
    assert_eq!(held_out(unsure), held_out(sure));
    assert_eq!(unsure.verdict, sure.verdict);
    // Coefficients that scale together are not for that ones that the trials hardly separate.
    let is_new = |caveat: &&Caveat| !sure.caveats.contains(caveat);
    let new: Vec<&Caveat> = unsure.caveats.iter().filter(is_new).collect();
    assert!(
        matches!(new[..], [caveat] if caveat.message.starts_with("thrust is not known better than ± 13.")
        && caveat.severity == Severity::Note),
        "{new:?}"
    );
}

/// Masses of the boat, with what the water adds.
const MASSES: [(&str, f64); 3] = [("mass.surge", 60.0), ("mass.sway", 90.0), ("mass.yaw", 12.0)];

#[test]
fn equal_seeds_give_equal_logs_and_others_do_not() {
    let made = |seed| make_vehicle(&short(|spec| spec.seed = seed), &boat()).expect("can be made");
    assert_eq!(made(3), made(3));
    assert_ne!(made(3).trials, made(4).trials);
}

#[test]
fn each_disturbance_changes_the_log_or_its_analyst() {
    let calm = make_vehicle(&short(|_| ()), &boat()).expect("can be made");
    for disturbance in Disturbance::ALL {
        let disturbed = short(|spec| {
            spec.disturbances.insert(disturbance);
            // Two minutes are short for gaps that are rare.
            spec.strength.gap_interval_s = 5.0;
        });
        let disturbed = make_vehicle(&disturbed, &boat()).expect("can be made");
        let differs = disturbed.trials != calm.trials || disturbed.vehicle != calm.vehicle;
        assert!(differs, "{disturbance}");
    }
}

#[test]
fn a_sweep_moves_its_axis_most_and_its_thrusters_alone() {
    let spec = short(|spec| spec.driving = Driving::Sweeps);
    let twin = make_vehicle(&spec, &boat()).expect("can be made");
    let names: Vec<&str> = twin.trials.iter().map(|trial| trial.name.as_str()).collect();
    assert_eq!(names, ["surge sweep", "sway sweep", "yaw sweep", "hold-out"]);
    assert_eq!(twin.trials[3].role, Role::HoldOut);
    let most = |trial: usize, thruster: &str| {
        let quantity: Quantity = format!("thruster.{thruster}.command").parse().expect("known");
        let values = twin.trials[trial].recording[&quantity].values();
        values.iter().fold(0.0_f64, |most, x| most.max(x.abs()))
    };
    // What does not push jitters by 0.3 % of full command.
    assert!(most(0, "bow") < 0.02 && most(0, "port") > 0.2, "{}", most(0, "bow"));
}

fn refused(change: impl FnOnce(&mut VehicleTwinSpec), model: &PlantModel) -> String {
    make_vehicle(&short(change), model).expect_err("cannot be").to_string()
}

#[test]
fn a_twin_that_cannot_be_says_why() {
    let boat = boat();
    let roll = refused(|spec| spec.axes = vec![Dof::Roll], &boat);
    assert!(roll.contains("with roll") && roll.contains("do not push it"), "{roll}");
    let rpm = refused(|spec| spec.max_rpm = Some(900.0), &boat);
    assert!(rpm.contains("max_rpm is 900") && rpm.contains("by command"), "{rpm}");
    let newtons = refused(|spec| spec.strength.tether_n = 5.0, &boat);
    assert!(newtons.contains("tether_part"), "{newtons}");
    let tilt = refused(|spec| spec.tilt_rad = 2.0, &boat);
    assert!(tilt.contains("tilt_rad is 2; it must be from 0 to 0.6"), "{tilt}");
    let still = refused(|spec| spec.speed_m_s = f64::NAN, &boat);
    assert!(still.contains("speed_m_s is NaN"), "{still}");
}

#[test]
fn a_vehicle_without_thrusters_is_refused() {
    let mut bare = table();
    bare["thruster"] = json!([]);
    let error = refused(|_| (), &model(bare));
    assert!(error.contains("without thrusters") && error.contains("[[thruster]]"), "{error}");
    let mut mixed = table();
    mixed["thruster"][1]["curve"]["forward"] = json!(50.0);
    let error = refused(|_| (), &model(mixed));
    assert!(error.contains("`starboard`, whose curve is unlike"), "{error}");
}

/// Moments of exchanged thrusters look like a disturbance of yaw beside twice the inertia, and gains do not explain them.
#[test]
fn exchanged_thrusters_are_found_where_a_disturbance_explains_them() {
    let mut table = table();
    let mut stern = table["thruster"][2].clone();
    stern["name"] = json!("stern");
    stern["position_m"] = json!([-0.3, 0.0, 0.0]);
    table["thruster"].as_array_mut().expect("thrusters").push(stern);
    let exchanged = vec![["bow".to_owned(), "stern".to_owned()]];
    let spec = short(|spec| spec.thrusters_exchanged.clone_from(&exchanged));
    let twin = make_vehicle(&spec, &model(table)).expect("can be made");
    let options = IdentifyOptions { together: twin.together.clone(), ..IdentifyOptions::default() };
    let results = identify(&twin.vehicle, &trials(&twin), &options).results;
    let found = &results.plants["surge-sway-yaw"];
    assert_eq!(found.thrusters_exchanged, exchanged);
    assert!(found.caveats.iter().any(|caveat| caveat.message.contains("are exchanged")));
    let inertia = found.parameters["mass.yaw"].value;
    assert!((inertia - 12.0).abs() < 0.1, "{inertia}");
}

/// Identified by its own campaign, after a change of what is claimed of the vehicle.
fn found(spec: &VehicleTwinSpec, claim: impl FnOnce(&mut TwinCampaign)) -> PlantResult {
    let mut twin = make_vehicle(spec, &boat()).expect("can be made");
    claim(&mut twin);
    let options = IdentifyOptions { together: twin.together.clone(), ..IdentifyOptions::default() };
    let results = identify(&twin.vehicle, &trials(&twin), &options).results;
    results.plants["surge-sway-yaw"].clone()
}

#[test]
fn a_rigid_body_heavier_than_the_trials_ask_for_is_severe() {
    // The truth is 60 and 90 kg with added mass.
    let plant = found(&short(|_| ()), |twin| {
        let body =
            RigidBody::new(150.0, [0.0; 3], [[9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 9.0]]);
        twin.vehicle.rigid_body = Some(body.expect("possible"));
    });
    assert_eq!(plant.verdict.trust, Trust::DoNotUse, "{}", plant.verdict.reason);
    let severe = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::Implausible);
    let message = &severe.expect("below the rigid body").message;
    assert!(
        message.contains("150 kg of the stated") && message.contains("kg in surge and"),
        "{message}"
    );
    // The plant is that of the trials, which the stated body would have made another in every number.
    let truth = [("mass.surge", 60.0), ("mass.sway", 90.0), ("mass.yaw", 12.0)];
    for (name, expected) in truth {
        let mass = plant.parameters[name].value;
        assert!((mass / expected - 1.0).abs() < 0.01, "{name}: {mass}");
    }
}

#[test]
fn velocities_that_are_late_beside_rates_do_not_pass_for_mass() {
    let late_s = 0.2;
    let plant = found(&short(|_| ()), |twin| {
        for trial in &mut twin.trials {
            for axis in ["x", "y"] {
                let quantity = format!("dvl.velocity.{axis}").parse().expect("known");
                let late = trial.recording[&quantity].shifted(late_s);
                trial.recording.insert(quantity, late);
            }
        }
    });
    let delay = &plant.nuisances["translation_delay"];
    assert!((delay.value - late_s).abs() < 0.01, "{} ± {}", delay.value, delay.std);
    for (name, expected) in MASSES {
        let x = &plant.parameters[name];
        let off = (x.value - expected).abs();
        assert!(
            off < DEVIATIONS * x.std || off < PART * expected,
            "{name}: {} ± {}",
            x.value,
            x.std
        );
    }
    let told = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::ClockOffset);
    assert!(told.expect("allowed for").message.contains("later than thrust"));
}

#[test]
fn velocities_behind_a_lag_do_not_pass_for_mass() {
    let spec = short(|spec| {
        spec.disturbances = Disturbance::parse_list("velocity-lag").expect("known");
    });
    let found = assert_recovered(&spec);
    let lag = &found.nuisances["translation_lag"];
    let off = (lag.value - spec.strength.velocity_lag_s).abs();
    assert!(off < 0.02, "{} ± {}", lag.value, lag.std);
    let told = found.caveats.iter().find(|caveat| caveat.code == CaveatCode::ClockOffset);
    let message = &told.expect("a note").message;
    assert!(message.contains("behind a lag of"), "{message}");
}

/// Inertia of the boat in yaw, kg m².
const INERTIA: f64 = 12.0;

/// The boat without its bow thruster, with damping about a point 0.3 m aft.
fn skegged(disturbances: &str) -> PlantResult {
    let mut table = table();
    table["thruster"].as_array_mut().expect("thrusters").truncate(2);
    table["linear_damping"] = json!([[6.0, 0.0, 0.0], [0.0, 60.0, -18.0], [0.0, -18.0, 10.4]]);
    let spec = short(|spec| {
        spec.disturbances = Disturbance::parse_list(disturbances).expect("known");
    });
    identified(&make_vehicle(&spec, &model(table)).expect("can be made"))
}

#[test]
fn a_skeg_does_not_pass_for_a_dvl_elsewhere() {
    let found = skegged("none");
    assert!(!found.nuisances.keys().any(|name| name.starts_with("lever")), "{:?}", found.nuisances);
    let inertia = &found.parameters["mass.yaw"];
    assert!((inertia.value / INERTIA - 1.0).abs() < 0.05, "{inertia:?}");
    let is_of_place = |caveat: &Caveat| caveat.code == CaveatCode::InstrumentElsewhere;
    assert!(!found.caveats.iter().any(is_of_place), "{:?}", found.caveats);
}

#[test]
fn with_a_skeg_and_a_dvl_elsewhere_the_other_inertia_of_yaw_is_told() {
    let found = skegged("lever");
    let of_yaw = &found.verdicts[&Dof::Yaw];
    assert_eq!(of_yaw.trust, Trust::Doubtful, "{of_yaw:?}");
    let is_of_place = |caveat: &&Caveat| caveat.code == CaveatCode::InstrumentElsewhere;
    let told = found.caveats.iter().find(is_of_place).expect("a warning");
    assert!(told.message.starts_with("inertia in yaw is"), "{told:?}");
    let off = of_yaw.may_be_off.iter().find(|off| off.number == "mass.yaw");
    let off = off.expect("a possible error");
    assert_eq!(off.because, OffBecause::SensorPlace);
    // The truth is beyond the interval, and within the error that is told.
    let inertia = &found.parameters["mass.yaw"];
    let factor = 1.05 * (1.0 + off.part.expect("a factor"));
    assert!((INERTIA / factor..INERTIA * factor).contains(&inertia.value), "{inertia:?} {off:?}");
    assert!(inertia.low95 > INERTIA || inertia.high95 < INERTIA, "{inertia:?}");
}

/// A vehicle whose file states a DVL that is turned by four degrees, which it is not.
#[test]
fn a_turned_dvl_does_not_pass_for_couplings_of_mass() {
    let stated_rad = 4_f64.to_radians();
    let found = found(&short(|_| ()), |twin| {
        twin.vehicle.sensors.dvl.rotation_rad[2] += stated_rad;
    });
    let turned = &found.nuisances["misalignment_z"];
    let off = turned.value + stated_rad;
    assert!(off.abs() < 3.0 * turned.std && turned.std < 0.003, "{turned:?}");
    for (name, truth) in [("mass.surge", 60.0), ("mass.sway", 90.0), ("mass.yaw", 12.0)] {
        let mass = found.parameters[name].value;
        assert!((mass / truth - 1.0).abs() < 0.01, "{name}: {mass}");
    }
    let coupling = found.parameters.get("mass.surge-sway").map_or(0.0, |x| x.value);
    assert!(coupling.abs() < 0.5, "{coupling}");
    let told = found.caveats.iter().find(|caveat| caveat.code == CaveatCode::InstrumentElsewhere);
    assert!(told.is_some_and(|told| told.message.contains("° about z")), "{told:?}");
}

/// A vehicle whose DVL sits further forward and down than its file states; of one that hardly rolls and
/// pitches only the first shows.
#[test]
fn a_dvl_elsewhere_does_not_pass_for_mass() {
    let spec = short(|spec| {
        spec.disturbances = Disturbance::parse_list("lever").expect("known");
    });
    let twin = make_vehicle(&spec, &boat()).expect("can be made");
    let off = twin.truth.nuisances.lever_m;
    let found = assert_recovered(&spec);
    let lever = &found.nuisances["lever_x"];
    assert!((lever.value - off).abs() < 0.02, "{} ± {}, {off}", lever.value, lever.std);
    let told = found.caveats.iter().find(|caveat| caveat.code == CaveatCode::InstrumentElsewhere);
    let told = told.expect("a warning");
    assert_eq!(told.severity, Severity::Warning);
    assert!(told.message.contains(" m forward"), "{told:?}");
    let calm = assert_recovered(&short(|_| ()));
    assert!(!calm.nuisances.keys().any(|name| name.starts_with("lever")), "{:?}", calm.nuisances);
}
