//! Identifies plant models of marine vehicles: what they weigh in water, how they drag, how
//! sure that is, and what makes it doubtful.
//!
//! A vehicle with known thrusters is driven; its thruster speeds, velocities, depth and attitude
//! are logged. For each degree of freedom this crate finds the plant
//!
//! ```text
//! v̇ = α τ + β v|v| + μ v + bias
//! ```
//!
//! or, in physical terms, mass 1/α, quadratic drag −β/α, linear drag −μ/α and bias force −bias/α.
//! It starts from \[Jason2\] and mends it; sources are keys of `docs/src/references.md`. Numbers are SI
//! and radians. The crate reads no files, keeps no clock and prints nothing. Independent fits run on
//! all cores; how many there are changes no digit.
//!
//! # The whole story
//!
//! ```
//! use seaplant::twin::{TwinSpec, make};
//! use seaplant::{
//!     Dof, IdentifyOptions, Method, Role, Trial, TrialSetup, identify,
//! };
//!
//! // A digital twin stands in for the dive: its truth is known.
//! let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, ..TwinSpec::jason2() };
//! let dive = make(&spec)?;
//!
//! // A recording is what instruments and thrusters said; a trial is that, navigated and
//! // turned into forces.
//! let trials = dive
//!     .trials
//!     .iter()
//!     .map(|log| {
//!         let setup = TrialSetup {
//!             name: log.name.clone(),
//!             role: log.role,
//!             dofs: log.dofs.clone(),
//!             ..TrialSetup::default()
//!         };
//!         Trial::new(setup, &log.recording, &dive.vehicle)
//!     })
//!     .collect::<Result<Vec<_>, _>>()?;
//! assert!(trials.iter().any(|trial| trial.role() == Role::HoldOut));
//!
//! // Every method, every score, every doubt.
//! let found = identify(&dive.vehicle, &trials, &IdentifyOptions::default()).results;
//! let surge = &found.plants["surge"];
//! let mass = &surge.parameters["mass.surge"];
//! assert!((mass.value / 12_970.2 - 1.0).abs() < 0.01);
//! let held_out = surge.held_out(Dof::Surge).expect("the dive has a held-out trial");
//! assert!(held_out.mean_abs_error.expect("stable") < 0.1 * held_out.null_error);
//!
//! // The paper's method stands beside, with its fault named.
//! let paper = &found.methods["surge"][&Method::Paper];
//! assert!(paper.parameters["mass.surge"].value > 1.5 * mass.value);
//! assert!(paper.caveats.iter().any(|caveat| caveat.message.contains("2.0")));
//! # Ok::<(), seaplant::Error>(())
//! ```
//!
//! # One axis, several, and a simulation
//!
//! A plant has the same form whatever its axes, and what is written for one axis works for six:
//!
//! ```
//! use nalgebra::Vector6;
//! use seaplant::exchange::{PlantFile, PlantModel};
//! use seaplant::motion::{Inputs, simulate};
//! use seaplant::results::Results;
//! use seaplant::twin::{TwinCampaign, TwinSpec, VehicleTwinSpec, make, make_vehicle};
//! use seaplant::{Dof, Error, IdentifyOptions, Timed, identify};
//!
//! fn identified(dive: &TwinCampaign) -> Result<Results, Error> {
//!     let trials = dive.trials.iter().map(|log| log.trial(dive)).collect::<Result<Vec<_>, _>>()?;
//!     let options =
//!         IdentifyOptions { together: dive.together.clone(), ..IdentifyOptions::default() };
//!     Ok(identify(&dive.vehicle, &trials, &options).results)
//! }
//!
//! // The speed ahead after a minute of 30 N.
//! fn speed(found: &Results) -> Result<f64, Error> {
//!     let plant = PlantModel::of_results(found, "results.json", None)?.plant;
//!     let mut inputs = Inputs::default();
//!     inputs.force[0] = Some(Timed::new("thrust", vec![0.0], vec![30.0])?);
//!     Ok(simulate(&plant, &inputs, &Vector6::zeros(), &[0.0, 60.0])?.velocity[1][0])
//! }
//!
//! let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, ..TwinSpec::jason2() };
//! let rov = make(&spec)?;
//! let boat: PlantFile = serde_json::from_value(serde_json::json!({
//!     "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
//!     "axes": ["surge", "yaw"], "mass_matrix": [100.0, 20.0], "linear_damping": [30.0, 15.0],
//!     "thruster": [
//!         { "name": "port", "position_m": [0.0, -0.5, 0.0], "direction": [1.0, 0.0, 0.0],
//!           "curve": { "kind": "quadratic", "input": "command", "forward": 40.0, "reverse": 30.0 } },
//!         { "name": "starboard", "position_m": [0.0, 0.5, 0.0], "direction": [1.0, 0.0, 0.0],
//!           "curve": { "kind": "quadratic", "input": "command", "forward": 40.0, "reverse": 30.0 } }
//!     ]
//! })).expect("a table");
//! let spec = VehicleTwinSpec { duration_s: 120.0, hold_out_s: 60.0, ..VehicleTwinSpec::default() };
//! let boat = make_vehicle(&spec, &boat.model()?)?;
//! for (dive, name, mass) in [(&rov, "surge", 12_970.2), (&boat, "surge-yaw", 100.0)] {
//!     let found = identified(dive)?;
//!     let plant = &found.plants[name];
//!     assert!((plant.parameters["mass.surge"].value / mass - 1.0).abs() < 0.02);
//!     assert_eq!(plant.by_axis[&Dof::Surge].mass.value, plant.parameters["mass.surge"].value);
//!     let held_out = plant.held_out(Dof::Surge).expect("each has a held-out trial");
//!     assert!(held_out.r_squared.expect("bounded") > 0.99);
//!     assert!(speed(&found)? > 0.3);
//! }
//! # Ok::<(), seaplant::Error>(())
//! ```
//!
//! One method by itself takes the records of an axis, as [`Trial::axis`] cuts them:
//! [`FilterError::default().fit(&records)`](estimate::FilterError::fit); a plant of several axes is
//! fitted by [`estimate::fit_plant`].

mod axes;
mod bollard;
mod caveat;
mod clock;
mod compare;
mod diagnose;
mod dof;
mod error;
pub mod estimate;
mod evaluate;
#[doc(hidden)]
pub mod exact;
pub mod exchange;
mod excursion;
mod identify;
mod judge;
pub mod monte_carlo;
pub mod motion;
mod navigation;
#[doc(hidden)]
pub mod parallel;
pub mod plant;
pub mod quantity;
#[doc(hidden)]
pub mod random;
pub mod regression;
pub mod results;
mod series;
pub mod signal;
mod simulate;
mod statistics;
mod terms;
mod thrust;
mod trial;
pub mod twin;
mod vehicle;

pub use axes::{axes_by_name, schema_of_axes};
pub use bollard::{BollardFit, fit_bollard_pull};
#[doc(hidden)]
pub use caveat::spoken;
pub use caveat::{Caveat, CaveatCode, Severity};
pub use clock::{ClockOffset, OffsetPair, estimate_offset};
pub use compare::{
    Compared, DifferenceTest, Differences, DiveThrusters, DofDifference, ParameterDifference,
    Stated, ThrusterCause, ThrusterChange, ThrusterHistory, differences, follow_thrusters,
    other_thrusters,
};
pub use dof::{Dof, Units};
pub use error::Error;
pub use estimate::PlantPlan;
pub use estimate::fit::{Estimate, Fit};
pub use estimate::method::Method;
pub use estimate::model::Model;
pub use evaluate::{Agreement, Comparison, PositionComparison, ScoredMotion, evaluate};
pub use identify::{
    IdentifyOptions, Stage, accumulated_plant, compare_fitted_plant, identify, identify_watched,
    likely_mistakes, score_fitted_plant, score_table, stages, steady_drag,
};
pub use judge::{box_pierce, score_plant};
pub use navigation::{Beside, MeanAcceleration, Motion, Navigated, Recording, navigate};
pub use plant::lumped::{LumpedParameters, PhysicalParameters, Stability};
pub use quantity::ThrusterInput;
pub use quantity::channel::{Quantity, Surface};
pub use results::plant_of_result;
pub use series::{Gap, Grid, Timed};
pub use simulate::{Response, State, simulate};
pub use statistics::robust_covariance;
pub use terms::{Term, Terms};
pub use thrust::{
    BetweenSamples, EXPONENTS, QuadraticThrust, ThrustCurve, ThrustModel, ThrustTable,
};
pub use trial::{
    AxisRecord, GAINED_S, PlacedThruster, Role, SteeringGear, Supply, ThrusterFault, ThrusterTrack,
    Trial, TrialRecord, TrialSetup, UniformAxis, UniformStretch, VelocityReport, VelocitySource,
    lever_axes,
};
pub use vehicle::{
    Fin, PropellerCurve, SEA_WATER_KG_M3, Sensor, Sensors, ThrustUncertainty, Thruster, Vehicle,
    VehicleEffect, VelocitySensor, Windage,
};
