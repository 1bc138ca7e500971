//! Plans of complete vehicles: predicted intervals agree with those of fits to the logs, limits
//! hold, and impossible requests are refused by name.

use std::collections::BTreeMap;

use nalgebra::Vector6;
use seaplant::estimate::{Actuator, PlantFit};
use seaplant::estimate::{ExpectedNoise, ExpectedNoises, PRECISION, fit_plant, information};
use seaplant::exchange::{PlantFile, PlantModel};
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::Plant;
use seaplant::twin::TwinCampaign;
use seaplant::{
    Dof, QuadraticThrust, Role, ThrustCurve, Thruster, ThrusterInput, Timed, TrialRecord,
    TrialSetup, Vehicle,
};
use seaplant_plan::{
    Battery, ControllerGoal, Criterion, Error, Goal, HungWeight, Limits, Mission, Plan, Prior,
    Rehearsal, Request, Width, chart_svg, commands_csv, deck_page, plan, rehearse, words,
};

/// Returns a boat with surge and yaw and two propellers.
fn boat() -> (Prior, Vehicle) {
    let file: PlantFile = serde_json::from_value(serde_json::json!({
        "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
        "axes": ["surge", "yaw"], "mass_matrix": [120.0, 30.0], "linear_damping": [20.0, 8.0],
        "quadratic_damping": [45.0, 20.0],
        "thruster": [
            { "name": "port", "position_m": [0.0, -0.5, 0.0], "direction": [1.0, 0.0, 0.0],
              "curve": { "kind": "quadratic", "input": "command", "forward": 60.0, "reverse": 45.0 } },
            { "name": "starboard", "position_m": [0.0, 0.5, 0.0], "direction": [1.0, 0.0, 0.0],
              "curve": { "kind": "quadratic", "input": "command", "forward": 60.0, "reverse": 45.0 } }
        ]
    }))
    .expect("a table");
    let model: PlantModel = file.model().expect("a plant");
    let vehicle = Vehicle {
        name: model.name.clone(),
        thrusters: model.thrusters.clone(),
        ..Vehicle::default()
    };
    (Prior::of_model(&model, &[]).expect("thrusters"), vehicle)
}

fn quick() -> Request {
    Request { draws: 2, checks: 0, ..Request::default() }
}

fn planned(request: &Request) -> Result<Plan, Error> {
    let (prior, vehicle) = boat();
    plan(&prior, &vehicle, request)
}

fn records(campaign: &TwinCampaign, axes: &[Dof]) -> Vec<TrialRecord> {
    let fitted = campaign.trials.iter().filter(|trial| trial.role == Role::Fit);
    let record = |trial: &seaplant::twin::TwinTrial| {
        let (name, known) = (trial.name.clone(), trial.known.clone());
        let setup = TrialSetup { name, known, ..TrialSetup::default() };
        TrialRecord::new(&setup, &trial.recording, &campaign.vehicle, axes).expect("a record")
    };
    fitted.map(record).collect()
}

fn fit_of(campaign: &TwinCampaign, axes: &[Dof]) -> PlantFit {
    let records = records(campaign, axes);
    let all: Vec<&TrialRecord> = records.iter().collect();
    let structure = campaign.together[0].structure(&campaign.vehicle, |_| false).expect("terms");
    fit_plant(&structure, &all, None, false).expect("settles")
}

/// Returns the predicted standard deviations by coefficient, of a vehicle as believed.
fn promised(plan: &Plan) -> BTreeMap<String, f64> {
    plan.coefficients.iter().map(|one| (one.name.clone(), one.as_believed / 1.959_964)).collect()
}

/// Tolerance of fitted relative to predicted standard deviations: fits depend on the realised
/// disturbances of a trial of minutes.
const OF_PROMISE: f64 = 0.2;

/// The root mean square of 60 standardised errors has a standard deviation of 9 %: three of them.
const SCATTER: std::ops::Range<f64> = 0.73..1.27;

#[test]
fn fits_of_the_priors_vehicle_agree_with_the_predicted_uncertainty() {
    let (prior, vehicle) = boat();
    let request = Request { minutes: Some(6.0), ..quick() };
    let made = plan(&prior, &vehicle, &request).expect("a plan");
    let promise = promised(&made);
    let (mut squares, mut near, mut count) = (0.0, 0, 0_i32);
    for seed in 0..10 {
        let rehearsal = Rehearsal { seed, hold_out_s: 0.0, is_believed: true };
        let campaign = rehearse(&prior, &vehicle, &made, rehearsal).expect("driven");
        let truth = campaign.truth.vehicle.clone().expect("a whole vehicle").coefficients;
        let fit = fit_of(&campaign, &made.axes);
        for (k, name) in fit.plant.structure().names().iter().enumerate() {
            let std = fit.covariance[(k, k)].sqrt();
            near += i32::from((std / promise[name] - 1.0).abs() < OF_PROMISE);
            squares += ((fit.plant.coefficients()[k] - truth[name]) / std).powi(2);
            count += 1;
        }
    }
    assert!(10 * near >= 9 * count, "{near} of {count} are stated as promised");
    let scatter: f64 = (squares / f64::from(count)).sqrt();
    assert!(SCATTER.contains(&scatter), "errors are {scatter} times what fits state");
}

/// Nine of ten intervals of vehicles that differ from the prior are within the predicted range, which is
/// narrower than half to double.
#[test]
fn fits_of_other_vehicles_are_within_the_predicted_range() {
    let (prior, vehicle) = boat();
    let made = plan(&prior, &vehicle, &Request { minutes: Some(6.0), ..quick() }).expect("a plan");
    let range: BTreeMap<&str, [f64; 2]> = made
        .coefficients
        .iter()
        .map(|one| (one.name.as_str(), one.range90.expect("a spread")))
        .collect();
    let (mut within, mut count) = (0, 0_i32);
    for seed in 0..10 {
        let rehearsal = Rehearsal { seed, hold_out_s: 0.0, is_believed: false };
        let campaign = rehearse(&prior, &vehicle, &made, rehearsal).expect("driven");
        let fit = fit_of(&campaign, &made.axes);
        for (k, name) in fit.plant.structure().names().iter().enumerate() {
            let half = 1.959_964 * fit.covariance[(k, k)].sqrt();
            let [low, high] = range[name.as_str()];
            assert!(high < 4.0 * low, "{name}: {low} to {high}");
            within += i32::from((low..high).contains(&half));
            count += 1;
        }
    }
    assert!(10 * within >= 8 * count, "{within} of {count} are within their range");
}

/// Fits of ten dives of one plan predict velocity on the mission with an error of the promised size.
#[test]
fn velocity_on_a_mission_is_predicted_as_accurately_as_promised() {
    let (prior, vehicle) = boat();
    let mission = Mission {
        time_s: vec![0.0, 30.0, 50.0, 70.0, 100.0, 130.0],
        force: [
            (Dof::Surge, vec![25.0, 25.0, 10.0, -15.0, 0.0, 0.0]),
            (Dof::Yaw, vec![0.0, 4.0, -4.0, 2.0, 0.0, 0.0]),
        ]
        .into(),
    };
    let request =
        Request { minutes: Some(4.0), mission: Some(mission.clone()), draws: 1, ..quick() };
    let made = plan(&prior, &vehicle, &request).expect("a plan");
    let names: Vec<&str> = made.goals.iter().map(|goal| goal.name.as_str()).collect();
    assert_eq!(names, ["mission.surge", "mission.yaw"]);
    let velocity = |plant: &Plant| {
        let mut inputs = Inputs::default();
        for (dof, force) in &mission.force {
            let timed = Timed::new("force", mission.time_s.clone(), force.clone());
            inputs.force[dof.index()] = Some(timed.expect("finite"));
        }
        let times: Vec<f64> = (0..=260).map(|k| 0.5 * f64::from(k)).collect();
        simulate(plant, &inputs, &Vector6::zeros(), &times).expect("a motion").velocity
    };
    let mut squares = [0.0; 2];
    for seed in 0..10 {
        let rehearsal = Rehearsal { seed, hold_out_s: 0.0, is_believed: true };
        let campaign = rehearse(&prior, &vehicle, &made, rehearsal).expect("driven");
        let fit = fit_of(&campaign, &made.axes);
        let pairs: Vec<_> =
            velocity(&fit.plant).into_iter().zip(velocity(&prior.model.plant)).collect();
        for (sum, axis) in squares.iter_mut().zip([0, 5]) {
            let square =
                |(found, truth): &(Vector6<f64>, Vector6<f64>)| (found[axis] - truth[axis]).powi(2);
            *sum += pairs.iter().map(square).sum::<f64>() / (10 * pairs.len()) as f64;
        }
    }
    for (goal, square) in made.goals.iter().zip(squares) {
        let ratio = square.sqrt() / (goal.after / 1.959_964);
        // Of ten dives with few numbers each, the root mean square scatters by a quarter.
        assert!((0.5..1.5).contains(&ratio), "{}: {ratio}", goal.name);
    }
}

#[test]
fn a_phase_margin_is_a_goal_in_degrees() {
    let request = Request {
        minutes: Some(4.0),
        controller: Some(ControllerGoal { bandwidth_hz: 0.15, ..ControllerGoal::default() }),
        ..quick()
    };
    let made = planned(&request).expect("a plan");
    let names: Vec<&str> = made.goals.iter().map(|goal| goal.name.as_str()).collect();
    assert_eq!(names, ["margin.surge", "margin.yaw"]);
    for goal in &made.goals {
        assert!(goal.unit == "deg" && (30.0..180.0).contains(&goal.value), "{goal:?}");
        assert!(goal.after > 0.0 && goal.after < 5.0, "{goal:?}");
    }
    // A bandwidth beyond what sampling allows is no controller.
    let fast = ControllerGoal { bandwidth_hz: 40.0, ..ControllerGoal::default() };
    let refused = planned(&Request { controller: Some(fast), ..request });
    let refused = refused.expect_err("too fast").to_string();
    assert!(refused.starts_with("goal `margin.surge`"), "{refused}");
}

#[test]
fn goals_need_their_mission_and_their_controller() {
    let refused = |name: &str| {
        let goals = vec![Goal { name: name.to_owned(), width: Width::Part(0.05) }];
        planned(&Request { goals, ..quick() }).expect_err("refused").to_string()
    };
    let message = refused("mission.surge");
    assert!(message.contains("--mission FILE.csv"), "{message}");
    let message = refused("margin.surge");
    assert!(message.contains("--bandwidth 0.1"), "{message}");
    let force = [(Dof::Sway, vec![1.0, 1.0])].into();
    let mission = Mission { time_s: vec![0.0, 10.0], force };
    let message = planned(&Request { mission: Some(mission), ..quick() }).expect_err("no sway");
    assert!(message.to_string().contains("the plant has no sway; it has surge, yaw"), "{message}");
}

/// Returns a vehicle that rises and turns, by four propellers.
fn lifter() -> (Prior, Vehicle) {
    let thruster = |name: &str, position: [f64; 3], direction: [f64; 3]| {
        serde_json::json!({ "name": name, "position_m": position, "direction": direction,
            "curve": { "kind": "quadratic", "input": "command", "forward": 60.0, "reverse": 60.0 } })
    };
    let file: PlantFile = serde_json::from_value(serde_json::json!({
        "schema": "seaplant/plant/1", "name": "lifter", "source": "worked by hand",
        "axes": ["surge", "heave", "yaw"], "mass_matrix": [120.0, 150.0, 30.0],
        "linear_damping": [20.0, 30.0, 8.0], "quadratic_damping": [45.0, 90.0, 20.0],
        "thruster": [
            thruster("port", [0.0, -0.5, 0.0], [1.0, 0.0, 0.0]),
            thruster("starboard", [0.0, 0.5, 0.0], [1.0, 0.0, 0.0]),
            thruster("bow", [0.5, 0.0, 0.0], [0.0, 0.0, 1.0]),
            thruster("stern", [-0.5, 0.0, 0.0], [0.0, 0.0, 1.0])
        ]
    }))
    .expect("a table");
    let model = file.model().expect("a plant");
    let vehicle = Vehicle {
        name: model.name.clone(),
        thrusters: model.thrusters.clone(),
        ..Vehicle::default()
    };
    (Prior::of_model(&model, &[]).expect("thrusters"), vehicle)
}

/// Returns a heavy hull that one propeller lifts: its weight in water is not known well beside that.
fn hull() -> Vehicle {
    let law = QuadraticThrust { forward: 150.0, reverse: 130.0, ..QuadraticThrust::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
    let thruster = |name: &str, y: f64, direction: [f64; 3]| {
        Thruster::new(name, [0.0, y, 0.0], direction, curve.clone()).expect("a thruster")
    };
    Vehicle {
        name: "hull".to_owned(),
        dry_mass_kg: Some(500.0),
        size_m: Some([1.3, 0.9, 0.8]),
        thrusters: vec![
            thruster("port", -0.35, [1.0, 0.0, 0.0]),
            thruster("starboard", 0.35, [1.0, 0.0, 0.0]),
            thruster("lift", 0.0, [0.0, 0.0, -1.0]),
        ],
        ..Vehicle::default()
    }
}

/// However weakly it is driven, its weight takes such a vehicle from its depth, unless that is held more firmly.
#[test]
fn a_heavy_vehicle_whose_weight_in_water_is_unsure_gets_a_plan() {
    let vehicle = hull();
    let prior = Prior::of_vehicle(&vehicle, &[]).expect("a prior");
    let request = Request { minutes: Some(12.0), checks: 20, ..Request::default() };
    let made = plan(&prior, &vehicle, &request).expect("a plan");
    assert_eq!(made.check.broken, 0, "{:?}", made.check);
    let heave = made.manoeuvres.iter().find(|one| one.manoeuvre.waves.contains_key(&Dof::Heave));
    assert!(heave.is_some(), "{made:?}");
    let limits = Limits { depth_m: [4.7, 5.3], ..Limits::default() };
    let refused = plan(&prior, &vehicle, &Request { limits, ..request }).expect_err("too narrow");
    let message = refused.to_string();
    assert!(message.contains("heave") && message.contains("depth_m = [4.7, 5.3]"), "{message}");
}

/// Fits of six dives with a weight find the scale of thrust with the promised standard deviation.
#[test]
fn a_weight_determines_the_scale_of_thrust_as_promised() {
    let (prior, vehicle) = lifter();
    let weight = HungWeight { weight_n: 20.0, mass_kg: 2.5, position_m: [0.0, 0.0, 0.1] };
    let goals = vec![Goal { name: "thrust.scale".to_owned(), width: Width::Part(0.05) }];
    let request = Request { minutes: Some(6.0), weight: Some(weight), goals, draws: 1, ..quick() };
    let made = plan(&prior, &vehicle, &request).expect("a plan");
    let hover = made.manoeuvres.iter().find(|one| one.manoeuvre.weight.is_some());
    assert!(
        hover.expect("a hover").words.contains("weight of 20.0 N hangs for 60.0 s"),
        "{made:?}"
    );
    let promised = made.goals[0].after / 1.959_964;
    assert!(promised > 0.001 && promised < 0.1, "{promised}");
    let mut squares = 0.0;
    for seed in 0..6 {
        let rehearsal = Rehearsal { seed, hold_out_s: 0.0, is_believed: true };
        let campaign = rehearse(&prior, &vehicle, &made, rehearsal).expect("driven");
        let fit = fit_of(&campaign, &made.axes);
        let std = fit.actuator_std[Actuator::SCALE].expect("a scale");
        assert!((std / promised - 1.0).abs() < 0.5, "{std} and {promised}");
        squares += (fit.actuator.log_scale / std).powi(2) / 6.0;
    }
    // Three standard deviations of the root mean square of six.
    assert!((0.1..1.9).contains(&squares.sqrt()), "{}", squares.sqrt());
}

#[test]
fn weights_that_cannot_be_lifted_and_scales_without_one_are_refused() {
    let (prior, vehicle) = lifter();
    let of = |weight_n| Some(HungWeight { weight_n, mass_kg: 2.5, position_m: [0.0; 3] });
    let refused =
        |request: Request| plan(&prior, &vehicle, &request).expect_err("refused").to_string();
    let message = refused(Request { weight: of(90.0), ..quick() });
    assert!(
        message.contains("weight.weight_n is 90; expected above 0 and below 57.6 N"),
        "{message}"
    );
    let message = refused(Request { weight: of(30.0), ..quick() });
    assert!(message.contains("at most 24.5 N: what 2.5 kg weigh in air"), "{message}");
    let goals = vec![Goal { name: "thrust.scale".to_owned(), width: Width::Part(0.05) }];
    let message = refused(Request { goals, ..quick() });
    assert!(message.contains("--weight 20,2.5"), "{message}");
    let message = planned(&Request { weight: of(20.0), ..quick() }).expect_err("no heave");
    assert!(message.to_string().contains("nothing lifts it"), "{message}");
}

#[test]
fn a_plan_stays_within_its_battery() {
    let with = |energy_wh: f64, minutes| {
        let battery = Some(Battery { energy_wh, thruster_w: 200.0, other_w: 10.0 });
        planned(&Request { battery, minutes, ..quick() })
    };
    let ample = with(500.0, Some(12.0)).expect("a plan");
    let used = ample.energy_wh.expect("a battery");
    assert!(used > 2.0 && used < 500.0, "{used}");
    // Less energy for the same minutes: manoeuvres that need less power.
    let scarce = with(0.8 * used, Some(12.0)).expect("a plan");
    let less = scarce.energy_wh.expect("a battery");
    assert!(less < 0.85 * used, "{less} and {used}");
    let message = with(1.0, Some(12.0)).expect_err("empty after minutes").to_string();
    assert!(message.contains("more power than the battery has"), "{message}");
    // Without given minutes the battery ends the plan before the goals are met.
    let goals = vec![Goal { name: "drag.yaw".to_owned(), width: Width::Part(0.004) }];
    let battery = Some(Battery { energy_wh: 10.0, thruster_w: 200.0, other_w: 10.0 });
    let made = planned(&Request { battery, goals, ..quick() }).expect("a plan");
    assert!(made.energy_wh.expect("a battery") <= 10.0, "{:?}", made.energy_wh);
    assert!(made.notes.iter().any(|note| note.contains("the battery ends")), "{:?}", made.notes);
    let message = with(-1.0, None).expect_err("no battery").to_string();
    assert!(message.contains("battery.energy_wh is -1"), "{message}");
}

#[test]
fn minutes_meet_the_goals_and_the_certificate_holds() {
    let goals = vec![
        Goal { name: "mass.surge".to_owned(), width: Width::Part(0.03) },
        Goal { name: "drag.yaw".to_owned(), width: Width::Part(0.08) },
        Goal { name: "speed.surge".to_owned(), width: Width::Part(0.05) },
    ];
    for criterion in Criterion::ALL {
        let made =
            planned(&Request { goals: goals.clone(), criterion, ..quick() }).expect("a plan");
        assert!(made.certificate.gap < 0.01, "{criterion:?}: {}", made.certificate.gap);
        assert!(made.goals.iter().all(|goal| goal.after <= 1.1 * goal.goal.expect("a goal")));
        assert!(made.manoeuvres.iter().all(|one| one.minutes >= 1.0));
    }
    // Minutes are proportional to the inverse of the variance that remains above the fit's floor.
    let needed = |part: f64| {
        let goals = vec![Goal { name: "mass.surge".to_owned(), width: Width::Part(part) }];
        planned(&Request { goals, ..quick() }).expect("a plan").minutes_needed.expect("enough")
    };
    let left = |part: f64| (part / 1.959_964).powi(2) - PRECISION.powi(2);
    let (narrow, wide) = (0.0022, 0.003);
    let (long, short) = (needed(narrow), needed(wide));
    let ratio = long / short / (left(wide) / left(narrow));
    // They are steps of half a minute.
    assert!((ratio - 1.0).abs() < 0.03 + 0.25 / short, "{ratio} of {long} and {short} min");
    // No log determines mass to less.
    let goals = vec![Goal { name: "mass.surge".to_owned(), width: Width::Part(0.0019) }];
    let error = planned(&Request { goals, ..quick() }).expect_err("too narrow").to_string();
    assert!(error.contains("below ±0.20 %"), "{error}");
}

#[test]
fn no_limit_is_broken_in_disturbances_and_a_current() {
    let limits = Limits { box_m: [4.0, 4.0], speed_m_s: 0.7, ..Limits::default() };
    let request = Request {
        limits,
        checks: 60,
        minutes: Some(10.0),
        disturbance_part: 0.05,
        current_m_s: [0.05, 0.0],
        ..quick()
    };
    let made = planned(&request).expect("a plan");
    assert_eq!(made.check.runs, 60);
    assert_eq!(made.check.broken, 0, "{:?}", made.check);
    assert!(made.check.greatest > 0.3 && made.check.greatest <= 1.0, "{:?}", made.check);
}

#[test]
fn the_same_seed_makes_the_same_plan() {
    let request = Request { minutes: Some(5.0), checks: 4, ..quick() };
    let (one, other) = (planned(&request).expect("a plan"), planned(&request).expect("a plan"));
    assert_eq!(one, other);
    let json = serde_json::to_string(&one).expect("finite");
    let read: Plan = serde_json::from_str(&json).expect("its own schema");
    assert_eq!(read.manoeuvres.len(), one.manoeuvres.len());
}

#[test]
fn impossible_plans_are_refused_with_the_limit_that_prevents_them() {
    let refused = |request: Request| planned(&request).expect_err("refused").to_string();
    let goal = |name: &str| vec![Goal { name: name.to_owned(), width: Width::Part(0.05) }];
    let message = refused(Request { goals: goal("mass.sway"), ..quick() });
    assert!(message.contains("no such coefficient; it has mass.surge"), "{message}");
    let limits = Limits { box_m: [0.001, 0.001], ..Limits::default() };
    let message = refused(Request { limits, ..quick() });
    assert!(message.contains("box_m = [0.001, 0.001]"), "{message}");
    let limits = Limits { speed_m_s: -1.0, ..Limits::default() };
    let message = refused(Request { limits, ..quick() });
    assert!(message.contains("speed_m_s is -1"), "{message}");
    let message = refused(Request { minutes: Some(0.0), ..quick() });
    assert!(message.contains("minutes is 0; expected from 1 to 1440"), "{message}");
}

#[test]
fn a_goal_on_an_axis_without_thrust_names_it() {
    let file: PlantFile = serde_json::from_value(serde_json::json!({
        "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
        "axes": ["surge", "heave"], "mass_matrix": [120.0, 150.0],
        "linear_damping": [20.0, 30.0], "quadratic_damping": [45.0, 90.0],
        "thruster": [{ "name": "main", "position_m": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0],
            "curve": { "kind": "quadratic", "input": "command", "forward": 60.0, "reverse": 45.0 } }]
    }))
    .expect("a table");
    let model = file.model().expect("a plant");
    let prior = Prior::of_model(&model, &[]).expect("thrusters");
    let vehicle = Vehicle { thrusters: model.thrusters.clone(), ..Vehicle::default() };
    let goals = vec![Goal { name: "mass.heave".to_owned(), width: Width::Part(0.05) }];
    let request = Request { goals, ..quick() };
    let message = plan(&prior, &vehicle, &request).expect_err("nothing lifts it").to_string();
    assert!(message.contains("`mass.heave`") && message.contains("do not push heave"), "{message}");
}

#[test]
fn missing_channels_and_slow_logs_are_reported_before_the_dive() {
    let mut request = Request { minutes: Some(5.0), ..quick() };
    request.logging.thrusters_hz = 2.0;
    let made = planned(&request).expect("a plan");
    assert!(made.doubts.iter().any(|doubt| doubt.contains("lag and delay")), "{:?}", made.doubts);
    assert!(words(&made).contains("before the dive: thrusters are logged every 0.50 s"));
    let whole = planned(&Request { minutes: Some(5.0), ..quick() }).expect("a plan");
    assert!(whole.doubts.is_empty(), "{:?}", whole.doubts);
}

#[test]
fn commands_stay_within_the_thrust_that_is_allowed() {
    let (prior, vehicle) = boat();
    let request = Request { minutes: Some(5.0), ..quick() };
    let made = plan(&prior, &vehicle, &request).expect("a plan");
    for planned in &made.manoeuvres {
        let table = commands_csv(&prior, &made, planned).expect("driven");
        let mut lines = table.lines();
        let head = lines.next().expect("a head");
        assert_eq!(head, "time [s],port command [1],starboard command [1]");
        // 60 % of thrust is √0.6 of the command.
        let commands = lines.flat_map(|line| line.split(',').skip(1));
        let most = commands.map(|x| x.parse::<f64>().expect("a number").abs()).fold(0.0, f64::max);
        assert!(most > 0.1 && most <= 0.6_f64.sqrt() + 1e-4, "{most}");
        assert_eq!(table.lines().count(), 2 + (600.0 * planned.minutes).round() as usize);
        assert!(table.ends_with(",0.0000,0.0000\n"), "the last command is neutral");
    }
}

#[test]
fn the_page_holds_the_plan_and_escapes_names() {
    let (mut prior, vehicle) = boat();
    prior.model.name = "<b>boat</b>".to_owned();
    let request = Request { minutes: Some(5.0), ..quick() };
    let made = plan(&prior, &vehicle, &request).expect("a plan");
    let page = deck_page(&made).expect("a page");
    assert!(page.contains("&lt;b&gt;boat") && !page.contains("<b>boat"));
    assert!(page.contains(&format!("<p>{} min of driving.", made.minutes)));
    assert!(page.contains("mass.surge") && page.contains("<polyline") && !page.contains("<script"));
    assert_eq!(chart_svg(&made).matches("<polyline").count(), made.goals.len());
}

/// A record with twice the noise has less information on every coefficient.
#[test]
fn noise_reduces_information() {
    let (prior, vehicle) = boat();
    let made = plan(&prior, &vehicle, &Request { minutes: Some(2.0), ..quick() }).expect("a plan");
    let campaign = rehearse(&prior, &vehicle, &made, Rehearsal::default()).expect("driven");
    let record = &records(&campaign, &made.axes)[0];
    let plant = &prior.model.plant;
    let of = |factor: f64| {
        let own = |dof: &Dof| {
            let noise = ExpectedNoise {
                disturbance: 2.0 * factor,
                correlation_s: 10.0,
                velocity: 0.005 * factor,
            };
            (*dof, noise)
        };
        let axes = plant.axes().iter().map(own).collect();
        let noises = ExpectedNoises { axes, ..ExpectedNoises::default() };
        information(plant, &Default::default(), &noises, record).expect("moves").matrix
    };
    let (quiet, loud) = (of(1.0), of(2.0));
    for k in 0..quiet.nrows() {
        assert!(loud[(k, k)] < 0.5 * quiet[(k, k)], "{k}: {} {}", loud[(k, k)], quiet[(k, k)]);
    }
}
