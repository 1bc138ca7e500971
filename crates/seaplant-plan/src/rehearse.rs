//! Drives the plan with a simulated vehicle, for logs before the dive.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use seaplant::plant::{Basis, Plant, Symmetry};
use seaplant::quantity::Axis;
use seaplant::twin::{NoiseLevel, TrueNuisances, TrueVehicle, Truth, TwinCampaign, TwinTrial};
use seaplant::{Dof, PlantPlan, Quantity, Role, Sensor, Sensors, Vehicle};

use crate::Error;
use crate::drive::{Pilot, Sea, drive};
use crate::manoeuvre::{Kind, Manoeuvre};
use crate::plan::{Plan, Planned};
use crate::prior::Prior;
use crate::rig::Rig;
use crate::wave::{Wave, seed_of};

/// Settings of a rehearsal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rehearsal {
    /// Seed of all random numbers, and of the true plant, which is drawn from the prior.
    pub seed: u64,
    /// Length of the held-out trial, s; none of zero.
    pub hold_out_s: f64,
    /// True to drive the prior's mean plant in place of a draw.
    pub is_believed: bool,
}

impl Default for Rehearsal {
    fn default() -> Self {
        Self { seed: 7, hold_out_s: 120.0, is_believed: false }
    }
}

/// Drives a plan with a vehicle whose plant is a draw from the prior, in disturbances, and returns its
/// logs with the truth.
///
/// Instruments are at the vehicle's origin. The held-out trial is joystick steps on all axes.
///
/// # Errors
/// As [`plan`](crate::plan()); [`Error::Plant`] if the motion runs away.
pub fn rehearse(
    prior: &Prior,
    vehicle: &Vehicle,
    plan: &Plan,
    rehearsal: Rehearsal,
) -> Result<TwinCampaign, Error> {
    let request = &plan.request;
    let rig = Rig::new(&prior.model, request.limits.thrust_part, request.full_input)?;
    let plants = prior.draws(2, seed_of(rehearsal.seed, "truth"))?;
    let believed = &plants[0];
    let truth = if rehearsal.is_believed { believed } else { &plants[plants.len() - 1] };
    let noises = request.noises(prior, &rig);
    let mut trials = Vec::new();
    let held_out = hold_out(plan, rehearsal);
    let fitted = plan.manoeuvres.iter().map(|planned| (planned, Role::Fit));
    for (planned, role) in fitted.chain(held_out.iter().map(|planned| (planned, Role::HoldOut))) {
        let manoeuvre = &planned.manoeuvre;
        let pilot = Pilot::new(believed, &rig, &request.limits, manoeuvre);
        let seed = seed_of(rehearsal.seed, &manoeuvre.name);
        let logging = &request.logging;
        let sea = Sea { noises: &noises, logging, current: request.current_m_s, seed };
        let driven = drive(truth, &pilot, 60.0 * planned.minutes, Some(sea))?;
        let depth_m = request.limits.start_depth_m;
        let mut recording = logging.recording(&rig, &driven, &plan.axes, depth_m)?;
        let axes = [(Dof::Surge, Axis::X), (Dof::Sway, Axis::Y), (Dof::Heave, Axis::Z)];
        for (dof, axis) in axes {
            if let Some(velocity) = recording.remove(&Quantity::Velocity(dof)) {
                recording.insert(Quantity::DvlVelocity(axis), velocity);
            }
        }
        trials.push(TwinTrial {
            name: manoeuvre.name.clone(),
            role,
            dofs: Vec::new(),
            recording,
            known: manoeuvre.known(60.0 * planned.minutes),
        });
    }
    let currents = trials.iter().map(|trial| (trial.name.clone(), request.current_m_s)).collect();
    Ok(TwinCampaign {
        vehicle: believed_vehicle(vehicle, prior, plan),
        trials,
        together: vec![plan_of(believed)],
        truth: truth_of(truth, prior, plan, rehearsal.seed, currents),
        bollard_pull: Vec::new(),
    })
}

/// Makes joystick steps on all axes that the plan drives, half as strong.
fn hold_out(plan: &Plan, rehearsal: Rehearsal) -> Option<Planned> {
    if rehearsal.hold_out_s <= 0.0 {
        return None;
    }
    let strongest = |dof: Dof| {
        let peak =
            |wave: &Wave| (0..600).map(|k| wave.at(0.2 * f64::from(k)).abs()).fold(0.0, f64::max);
        let own = plan.manoeuvres.iter().filter_map(|one| one.manoeuvre.waves.get(&dof));
        own.map(peak).fold(0.0, f64::max)
    };
    let driven = plan.axes.iter().copied().filter(|dof| strongest(*dof) > 0.0);
    let wave = |dof: Dof| {
        let seed = seed_of(rehearsal.seed, &format!("hold-out {dof}"));
        (dof, Wave::joystick(0.5 * strongest(dof), [3.0, 9.0], seed))
    };
    let waves: BTreeMap<Dof, Wave> = driven.map(wave).collect();
    let slowest = plan.manoeuvres.iter().map(|one| one.manoeuvre.hold_rad_s);
    let hold_rad_s = slowest.fold([0.6; 6], |least, own| {
        std::array::from_fn(|k| if own[k] < least[k] { own[k] } else { least[k] })
    });
    let first = plan.manoeuvres.first()?;
    let manoeuvre = Manoeuvre {
        name: "hold-out".to_owned(),
        kind: Kind::Joystick,
        axes: waves.keys().copied().collect(),
        period_s: 9.0,
        waves,
        opposing: None,
        weight: None,
        hold_rad_s,
    };
    Some(Planned { manoeuvre, minutes: rehearsal.hold_out_s / 60.0, ..first.clone() })
}

/// Returns the vehicle as its analyst describes it, with instruments at its origin.
fn believed_vehicle(vehicle: &Vehicle, prior: &Prior, plan: &Plan) -> Vehicle {
    let logging = &plan.request.logging;
    let at_origin = |std: f64| Sensor { std: Some(std), ..Sensor::default() };
    debug_assert_eq!(at_origin(1.0).position_body, Vector3::zeros());
    let sensors = Sensors {
        dvl: at_origin(logging.velocity_std_m_s),
        depth: at_origin(logging.depth_std_m),
        attitude: at_origin(logging.attitude_std_rad),
        position: at_origin(logging.position_std_m),
        ..Sensors::default()
    };
    let name = prior.model.name.clone();
    let thrusters = prior.model.thrusters.clone();
    Vehicle { name, thrusters, sensors, rigid_body: prior.model.rigid_body, ..vehicle.clone() }
}

/// Returns the plant that the plan was made for.
fn plan_of(believed: &Plant) -> PlantPlan {
    let structure = believed.structure();
    let couples = |symmetry: Symmetry| {
        structure.terms().iter().all(|term| match term {
            Basis::Mass(i, j) => symmetry.couples(*i, *j),
            _ => true,
        })
    };
    let symmetric = couples(Symmetry::PortStarboard);
    PlantPlan {
        axes: believed.axes().to_vec(),
        symmetry: if symmetric { Symmetry::PortStarboard } else { Symmetry::None },
        model: None,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: BTreeMap::new(),
        search: true,
    }
}

fn truth_of(
    truth: &Plant,
    prior: &Prior,
    plan: &Plan,
    seed: u64,
    mean_current_m_s: BTreeMap<String, [f64; 2]>,
) -> Truth {
    let names = truth.structure().names().into_iter();
    let coefficients = names.zip(truth.coefficients().iter().copied()).collect();
    let lag = prior.model.actuation.values().filter_map(|own| own.lag.as_ref());
    let lag_s = lag.map(|lag| lag.value).fold(0.0, f64::max);
    Truth {
        seed,
        noise: NoiseLevel::Middle,
        disturbances: BTreeSet::new(),
        plants: BTreeMap::new(),
        steady: BTreeMap::new(),
        nuisances: TrueNuisances {
            lag_s,
            lag_up_s: lag_s,
            lag_down_s: lag_s,
            ..TrueNuisances::default()
        },
        mean_current_m_s: BTreeMap::new(),
        vehicle: Some(TrueVehicle {
            name: plan.vehicle.clone(),
            coefficients,
            tether: BTreeMap::new(),
            mean_current_m_s,
        }),
    }
}
