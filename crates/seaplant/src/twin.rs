//! The digital twin: simulated logs of a vehicle with known true values.
//!
//! In [`make`] one degree of freedom moves at a time, driven by a pair of thrusters; in
//! [`make_vehicle`] a plant of several axes moves in all of them. Instruments have noise,
//! quantisation and lever arms. Disturbances of the vehicle and errors of its analyst are enabled
//! by name.

mod closed_loop;
mod command;
mod disturbance;
mod faults;
mod instruments;
mod motion;
mod propellers;
mod random;
mod several_axes;
mod spec;
mod strength;
mod truth;
mod validate;
mod vehicle;
mod water;

use std::collections::BTreeMap;
use std::f64::consts::PI;

pub use closed_loop::{ClosedLoop, Measured, close_loop};
pub use disturbance::Disturbance;
pub use several_axes::{Driving, TwinWeight, VehicleTwinSpec, make_vehicle};
pub use spec::{
    Excitation, NoiseLevel, SteadyRuns, TwinAccelerometer, TwinPlant, TwinSpec, TwinThrusters,
};
pub use strength::DisturbanceStrength;
pub use truth::{TrueNuisances, TrueParameters, TrueSteady, TrueVehicle, Truth};

use crate::motion::KnownForce;
use crate::navigation::Recording;
use crate::random::normal;
use crate::{Dof, Error, PhysicalParameters, PlantPlan, Role, Trial, TrialSetup, Vehicle};
use command::Pilot;
use instruments::{Observer, OneAxisPath, record};
use motion::{TrialMotion, simulate_trial};
use random::Streams;
use vehicle::InstrumentNoise;
use water::Water;

/// One rpm, rad/s.
const RPM: f64 = PI / 30.0;
/// Rate of thrust commands and of most instruments, Hz.
const TICK_HZ: f64 = 10.0;
/// Integration steps of 0.02 s per tick.
const STEPS_PER_TICK: usize = 5;

fn tick_time(tick: usize) -> f64 {
    tick as f64 / TICK_HZ
}

/// The logs of the twin, and its true values.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinCampaign {
    /// The vehicle as described by its analyst.
    pub vehicle: Vehicle,
    /// For each degree of freedom one trial to fit and one to hold out; then steady runs.
    pub trials: Vec<TwinTrial>,
    /// The plants of several axes to be fitted.
    pub together: Vec<PlantPlan>,
    /// The true values.
    pub truth: Truth,
    /// Propeller speed, rad/s, and thrust, N, of one thruster on a test bench.
    pub bollard_pull: Vec<(f64, f64)>,
}

/// The log of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinTrial {
    /// Its name: `surge 1`, `surge hold-out`, `heave down 30 %`.
    pub name: String,
    /// Its role in the identification.
    pub role: Role,
    /// The degree of freedom that moves; empty for a vehicle that moves in several at once.
    pub dofs: Vec<Dof>,
    /// Logged inputs and measurements, in SI units and radians.
    pub recording: Recording,
    /// Weights hung on the vehicle.
    pub known: Vec<KnownForce>,
}

impl TwinTrial {
    /// Creates the trial of a campaign from its log and the analyst's vehicle.
    ///
    /// # Errors
    /// As [`Trial::new`].
    ///
    /// ```
    /// use seaplant::twin::{TwinSpec, make};
    /// let dive = make(&TwinSpec { duration_s: 60.0, ..TwinSpec::jason2() })?;
    /// assert_eq!(dive.trials[0].trial(&dive)?.name(), "surge 1");
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn trial(&self, campaign: &TwinCampaign) -> Result<Trial, Error> {
        let setup = TrialSetup {
            name: self.name.clone(),
            role: self.role,
            dofs: self.dofs.clone(),
            together: campaign.together.iter().map(|plan| plan.axes.clone()).collect(),
            known: self.known.clone(),
            ..TrialSetup::default()
        };
        Trial::new(setup, &self.recording, &campaign.vehicle)
    }
}

/// Simulates the logs of a twin.
///
/// `τ = m v̇ + d_Q v_r|v_r| + d_L v_r + b` with v_r the velocity through the water, by RK4 in steps
/// of 0.02 s under thrust held for 0.1 s. Logged propeller speeds are commands, valid from their
/// time stamp: lag, delay and rate limit act after them.
///
/// # Errors
/// [`Error::TwinSpec`] for an invalid specification, or a vehicle that surfaces.
///
/// # Source
/// [Jason2, tables 3–6] for vehicle, instruments and trials.
///
/// ```
/// use seaplant::twin::{TwinSpec, make};
/// let spec = TwinSpec { duration_s: 60.0, ..TwinSpec::jason2() };
/// let campaign = make(&spec)?;
/// assert_eq!(campaign.trials[0].name, "surge 1");
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn make(spec: &TwinSpec) -> Result<TwinCampaign, Error> {
    spec.validate()?;
    let mut trials = Vec::new();
    let mut mean_current = BTreeMap::new();
    for plan in plans(spec) {
        let (trial, current) = plan.simulate(spec)?;
        mean_current.insert(trial.name.clone(), current);
        trials.push(trial);
    }
    Ok(TwinCampaign {
        vehicle: spec.believed_vehicle()?,
        trials,
        together: Vec::new(),
        truth: Truth::new(spec, mean_current),
        bollard_pull: bollard_pull(spec),
    })
}

/// The plan of a trial.
struct Plan {
    name: String,
    role: Role,
    dof: Dof,
    plant: PhysicalParameters,
    duration_s: f64,
    /// Constant thrust of a steady run, as a fraction of the greatest, positive downwards.
    thrust: f64,
    /// Running time before and after it, as fractions of that of all trials of its degree of
    /// freedom.
    spent: (f64, f64),
}

fn plans(spec: &TwinSpec) -> Vec<Plan> {
    let mut plans = Vec::new();
    for &dof in &spec.dofs {
        let plan = |name, role, duration_s| {
            let plant = spec.plants[&dof].physical();
            Plan { name, role, dof, plant, duration_s, thrust: 0.0, spent: (0.0, 0.0) }
        };
        plans.push(plan(format!("{dof} 1"), Role::Fit, spec.duration_s));
        plans.push(plan(format!("{dof} hold-out"), Role::HoldOut, spec.hold_out_s));
    }
    if spec.dofs.contains(&Dof::Heave) {
        let runs = &spec.steady;
        plans.extend(runs.down.iter().map(|&part| steady_plan(spec, "down", part, part)));
        plans.extend(runs.up.iter().map(|&part| steady_plan(spec, "up", part, -part)));
    }
    spec.dofs.iter().for_each(|dof| spend(&mut plans, *dof));
    plans
}

/// Sets the running times of the trials of a degree of freedom.
fn spend(plans: &mut [Plan], dof: Dof) {
    let total_s: f64 = plans.iter().filter(|p| p.dof == dof).map(|p| p.duration_s).sum();
    let mut elapsed_s = 0.0;
    for plan in plans.iter_mut().filter(|plan| plan.dof == dof) {
        let start_s = elapsed_s;
        elapsed_s += plan.duration_s;
        plan.spent = (start_s / total_s, elapsed_s / total_s);
    }
}

/// Formats a fraction: `30 %`, or `30.5 %`.
fn percent(part: f64) -> String {
    format!("{} %", (1000.0 * part).round() / 10.0)
}

fn steady_plan(spec: &TwinSpec, way: &str, part: f64, thrust: f64) -> Plan {
    let SteadyRuns { d_quadratic, bias_force, duration_s, .. } = spec.steady;
    let mass = spec.plants[&Dof::Heave].mass;
    Plan {
        name: format!("heave {way} {}", percent(part)),
        role: Role::Steady,
        dof: Dof::Heave,
        plant: PhysicalParameters { mass, d_quadratic, d_linear: 0.0, bias_force },
        duration_s,
        thrust,
        spent: (0.0, 0.0),
    }
}

impl Plan {
    fn ticks(&self) -> usize {
        (self.duration_s * TICK_HZ).round() as usize
    }

    /// Simulates the trial; returns it with its mean current, m/s.
    fn simulate(self, spec: &TwinSpec) -> Result<(TwinTrial, f64), Error> {
        let streams = Streams { seed: spec.seed, trial: &self.name };
        let water = Water::new(spec, self.dof, &streams, self.ticks());
        let pilot = self.pilot(spec, &streams);
        let moved = simulate_trial(spec, &self, pilot, &water, &streams)?;
        self.check_submerged(spec, &moved)?;
        let (vehicle, noise) = (spec.true_vehicle()?, InstrumentNoise::from_level(spec.noise));
        let observer = Observer { spec, vehicle: &vehicle, streams: &streams, noise };
        let path = OneAxisPath { dof: self.dof, moved: &moved, water: &water };
        let recording = record(&observer, &path)?;
        let current = water.current.iter().sum::<f64>() / self.ticks() as f64;
        let Self { name, role, dof, .. } = self;
        Ok((TwinTrial { name, role, dofs: vec![dof], recording, known: Vec::new() }, current))
    }

    fn pilot(&self, spec: &TwinSpec, streams: &Streams<'_>) -> Pilot {
        let (dof, ticks) = (self.dof, self.ticks());
        match self.role {
            Role::Fit => Pilot::of_fit(spec, dof, streams, ticks),
            Role::HoldOut => Pilot::of_hold_out(spec, dof, streams, ticks),
            Role::Steady => Pilot::of_steady(self.thrust * spec.reverse_limit(dof), ticks),
        }
    }

    fn check_submerged(&self, spec: &TwinSpec, moved: &TrialMotion) -> Result<(), Error> {
        let rises = -moved.sunk.iter().copied().fold(0.0, f64::min);
        spec.refuse_surfacing(rises, &self.name)
    }
}

/// Number of bollard-pull points in each direction, and standard deviation of the force gauge, N.
const BENCH_POINTS: usize = 10;
const BENCH_STD_N: f64 = 10.0;

fn bollard_pull(spec: &TwinSpec) -> Vec<(f64, f64)> {
    let mut rng = Streams { seed: spec.seed, trial: "bench" }.stream("bollard pull");
    let points = BENCH_POINTS as i32;
    let read = |point: i32| {
        let speed = spec.thrusters.max_speed() * f64::from(point) / f64::from(points);
        (speed, spec.true_thrust(speed) + BENCH_STD_N * normal(&mut rng))
    };
    (-points..=points).map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{Attitude, Axis};
    use crate::{Quantity, ThrusterInput, Timed};

    fn short(change: impl FnOnce(&mut TwinSpec)) -> TwinCampaign {
        let mut spec = TwinSpec { duration_s: 60.0, hold_out_s: 60.0, ..TwinSpec::jason2() };
        change(&mut spec);
        make(&spec).expect("can be made")
    }

    fn speed(thruster: &str) -> Quantity {
        Quantity::Thruster { name: thruster.to_owned(), input: ThrusterInput::Speed }
    }

    #[test]
    fn equal_seeds_give_equal_logs_and_other_seeds_do_not() {
        let all = |seed| {
            short(|spec| {
                spec.seed = seed;
                spec.disturbances = Disturbance::ALL.into();
            })
        };
        assert_eq!(all(3), all(3));
        assert_ne!(all(3).trials, all(4).trials);
    }

    /// A log with the first eight disturbances, written by version 0.1.0.
    #[test]
    fn a_seed_gives_the_log_of_version_0_1_0() {
        let plant =
            TwinPlant { mass: 9000.0, d_quadratic: 1500.0, d_linear: 100.0, bias_force: 0.0 };
        let campaign = make(&TwinSpec {
            seed: 7,
            noise: NoiseLevel::Low,
            duration_s: 120.0,
            hold_out_s: 100.0,
            disturbances: Disturbance::ALL[..8].iter().copied().collect(),
            plants: TwinSpec::jason2().plants.into_iter().chain([(Dof::Surge, plant)]).collect(),
            ..TwinSpec::jason2()
        })
        .expect("can be made");
        let at = |trial: &str, quantity: &Quantity, sample: usize| {
            let found = campaign.trials.iter().find(|made| made.name == trial).expect("made");
            found.recording[quantity].values()[sample]
        };
        let [x, z] = [Axis::X, Axis::Z].map(Quantity::DvlVelocity);
        // Half of the file's last decimal.
        for (trial, quantity, sample, logged, half) in [
            ("surge 1", &x, 999, 0.24827, 5e-6),
            ("heave hold-out", &z, 999, 0.27358, 5e-6),
            ("yaw 1", &x, 999, -0.09487, 5e-6),
            ("heave hold-out", &Quantity::Depth, 58, 152.32, 5e-4),
        ] {
            let now = at(trial, quantity, sample);
            assert!((now - logged).abs() <= half, "{trial}, {quantity}: {now}, not {logged}");
        }
        let heading = Quantity::Attitude(Attitude::Heading);
        assert!((at("yaw 1", &heading, 999).to_degrees() - 30.0222).abs() <= 5e-5);
        assert!((at("yaw 1", &speed("lateral aft"), 500) / RPM - 1600.0).abs() < 1e-9);
    }

    #[test]
    fn each_disturbance_changes_the_log_of_surge() {
        let calm = short(|spec| spec.dofs = [Dof::Surge].into());
        for disturbance in Disturbance::ALL {
            let disturbed = short(|spec| {
                spec.dofs = [Dof::Surge].into();
                spec.disturbances.insert(disturbance);
                // Gaps are rare in a minute.
                spec.strength.gap_interval_s = 5.0;
            });
            let misled = disturbed.vehicle != calm.vehicle;
            assert!(misled || disturbed.trials != calm.trials, "{disturbance}");
            assert_eq!(disturbed.truth.plants, calm.truth.plants, "{disturbance}");
        }
    }

    #[test]
    fn another_disturbance_leaves_other_noise_unchanged() {
        let heading = Quantity::Attitude(Attitude::Heading);
        let calm = short(|_| ());
        let pulled = short(|spec| {
            spec.disturbances.insert(Disturbance::Tether);
        });
        // Surge does not turn the vehicle: heading is its initial value with noise.
        assert_eq!(calm.trials[0].recording[&heading], pulled.trials[0].recording[&heading]);
        let port = speed("fore-aft port");
        assert_eq!(calm.trials[0].recording[&port], pulled.trials[0].recording[&port]);
        let dvl = Quantity::DvlVelocity(Axis::X);
        assert_ne!(calm.trials[0].recording[&dvl], pulled.trials[0].recording[&dvl]);
    }

    #[test]
    fn every_trial_is_present_with_its_role() {
        let campaign = short(|_| ());
        let names: Vec<&str> = campaign.trials.iter().map(|trial| trial.name.as_str()).collect();
        assert_eq!(names[..3], ["surge 1", "surge hold-out", "sway 1"]);
        assert_eq!(names[8], "heave down 30 %");
        assert_eq!(names[14], "heave up 100 %");
        let count = |role| campaign.trials.iter().filter(|trial| trial.role == role).count();
        assert_eq!([Role::Fit, Role::HoldOut, Role::Steady].map(count), [4, 4, 7]);
    }

    #[test]
    fn instruments_keep_their_rates() {
        let recording = &short(|_| ()).trials[0].recording;
        assert_eq!(recording.len(), 6 + 3 + 3 + 1);
        for (quantity, series) in recording {
            let hz = if *quantity == Quantity::Depth { 0.6 } else { 10.0 };
            let even = |pair: &[f64]| ((pair[1] - pair[0]) * hz - 1.0).abs() < 1e-9;
            assert!(series.time_s().windows(2).all(even), "{quantity}");
            assert!(series.last_s() <= 60.0 && series.last_s() > 58.3, "{quantity}");
        }
    }

    fn assert_on_grid(series: &Timed, quantum: f64) {
        for x in series.values() {
            assert!((x / quantum - (x / quantum).round()).abs() < 1e-9, "{x} is off the grid");
        }
    }

    #[test]
    fn propeller_speeds_are_logged_to_10_rpm() {
        for trial in short(|_| ()).trials {
            for (quantity, series) in &trial.recording {
                if matches!(quantity, Quantity::Thruster { .. }) {
                    assert_on_grid(series, 10.0 * RPM);
                    let most = series.values().iter().fold(0.0_f64, |most, n| most.max(n.abs()));
                    // Jitter of 5 rpm is added after the limit.
                    assert!(most < 1690.0 * RPM, "{}: {most}", trial.name);
                }
            }
        }
    }

    #[test]
    fn only_the_pair_of_the_degree_of_freedom_turns() {
        let campaign = short(|_| ());
        let yaw = campaign.trials.iter().find(|trial| trial.name == "yaw 1").expect("made");
        let turns = |name: &str| yaw.recording[&speed(name)].values().iter().any(|n| *n != 0.0);
        assert!(turns("lateral fore") && turns("lateral aft"));
        assert!(!turns("fore-aft port") && !turns("vertical starboard"));
    }

    #[test]
    fn depth_comes_in_steps_of_7_cm() {
        for noise in [NoiseLevel::Low, NoiseLevel::High] {
            let campaign = short(|spec| spec.noise = noise);
            assert_on_grid(&campaign.trials[4].recording[&Quantity::Depth], 0.07);
        }
    }

    #[test]
    fn heading_is_written_as_a_compass_does() {
        let campaign = short(|spec| spec.duration_s = 480.0);
        for trial in campaign.trials {
            let heading = &trial.recording[&Quantity::Attitude(Attitude::Heading)];
            assert!(heading.values().iter().all(|angle| (0.0..2.0 * PI).contains(angle)));
        }
    }

    #[test]
    fn refuses_to_surface() {
        let spec = TwinSpec { start_depth_m: 5.0, ..TwinSpec::jason2() };
        let message = make(&spec).expect_err("rises 70 m").to_string();
        assert!(message.starts_with("the twin's start_depth_m is 5; it must be"), "{message}");
    }

    #[test]
    fn truth_includes_the_errors_of_the_analyst() {
        let campaign = short(|spec| {
            spec.disturbances = Disturbance::parse_list("thrcoef,delay").expect("known");
        });
        let truth = campaign.truth;
        assert_eq!(truth.plants[&Dof::Surge].mass, 12970.2);
        assert_eq!(truth.steady[&Dof::Heave].quadratic_drag, 5500.0);
        assert_eq!((truth.nuisances.delay_s, truth.nuisances.lag_s), (0.2, 0.0));
        assert!((truth.nuisances.reverse_ratio - 0.0328 / 0.0402).abs() < 1e-12);
        assert_eq!(truth.mean_current_m_s["surge 1"], 0.0);
        let other = short(|spec| {
            spec.disturbances =
                Disturbance::parse_list("lag-two-way,thrust-exponent,dvl-scale").expect("known");
        });
        let nuisances = other.truth.nuisances;
        assert_eq!((nuisances.lag_s, nuisances.lag_up_s, nuisances.lag_down_s), (0.0, 0.15, 0.45));
        assert_eq!((nuisances.thrust_exponent, nuisances.dvl_scale), (1.8, 1.03));
    }

    #[test]
    fn truth_of_an_older_twin_can_be_read() {
        let truth = short(|_| ()).truth;
        let mut json = serde_json::to_value(&truth).expect("plain data");
        json["nuisances"].as_object_mut().expect("an object").retain(|key, _| key == "delay_s");
        assert_eq!(serde_json::from_value::<Truth>(json).expect("valid"), truth);
    }

    #[test]
    fn bollard_pull_has_both_directions() {
        let points = short(|_| ()).bollard_pull;
        assert_eq!(points.len(), 21);
        // Six standard deviations of the force gauge.
        assert!((points[0].1 + 0.0328 * (1650.0 * RPM).powi(2)).abs() < 60.0, "{points:?}");
        assert!((points[20].1 - 0.0402 * (1650.0 * RPM).powi(2)).abs() < 60.0, "{points:?}");
    }

    #[test]
    fn a_file_replaces_one_plant_and_keeps_the_others() {
        let text = r#"{"noise": "low", "plants": {"yaw": {"mass": 5000, "d_quadratic": 900}}}"#;
        let spec: TwinSpec = serde_json::from_str(text).expect("valid");
        assert_eq!(spec.plants[&Dof::Yaw].mass, 5000.0);
        assert_eq!(spec.plants[&Dof::Surge], TwinSpec::jason2().plants[&Dof::Surge]);
        let back = serde_json::to_string(&spec).expect("plain data");
        assert_eq!(serde_json::from_str::<TwinSpec>(&back).expect("valid"), spec);
    }

    #[test]
    fn an_unknown_key_is_an_error() {
        let refused = serde_json::from_str::<TwinSpec>(r#"{"duration": 60}"#);
        assert!(refused.expect_err("misspelt").to_string().contains("duration_s"));
    }
}
