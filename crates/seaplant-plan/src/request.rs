//! The request of a plan, and its check.

use schemars::JsonSchema;
use seaplant::Dof;
use seaplant::estimate::ExpectedNoises;
use seaplant::plant::{Basis, Plant, Product};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::allocate::Criterion;
use crate::battery::Battery;
use crate::goal::Goal;
use crate::limits::Limits;
use crate::logging::Logging;
use crate::manoeuvre::driving_force;
use crate::margin::ControllerGoal;
use crate::mission::Mission;
use crate::prior::Prior;
use crate::rig::Rig;
use crate::weight::HungWeight;

/// The request of a plan; every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Request {
    /// Goals; if empty, velocity on the mission to 5 % of each axis that it drives, and phase margins to
    /// 5° of each axis with thrust if a controller is given; without both, mass to 5 % and drag to
    /// 10 % of every axis with thrust, and the scale of thrust to 5 % if a weight is given.
    pub goals: Vec<Goal>,
    /// The objective that the minutes minimise.
    pub criterion: Criterion,
    /// Minutes of driving; as many as the goals need if left out.
    pub minutes: Option<f64>,
    /// Limits that no manoeuvre may exceed.
    pub limits: Limits,
    /// The battery, if it limits the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub battery: Option<Battery>,
    /// The weight that determines the scale of thrust, if there is one: the goal `thrust.scale`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<HungWeight>,
    /// The reference mission of goals `mission.AXIS`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mission: Option<Mission>,
    /// The controller of goals `margin.AXIS`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controller: Option<ControllerGoal>,
    /// Logged channels.
    pub logging: Logging,
    /// Standard deviation of the disturbance on each axis, as a fraction of the force that drives
    /// it within the limits; that of the trials where results state one.
    pub disturbance_part: f64,
    /// Its correlation time, s.
    pub disturbance_correlation_s: f64,
    /// The expected current, north and east, m/s.
    pub current_m_s: [f64; 2],
    /// The input of full thrust from neutral, for curves that state no end, in their own unit.
    pub full_input: Option<f64>,
    /// The number of plants drawn from the prior over which the plan is averaged.
    pub draws: usize,
    /// Runs in disturbances that check the limits.
    pub checks: usize,
    /// True to compare the minutes with those of driving without a plan.
    pub compare: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            goals: Vec::new(),
            criterion: Criterion::default(),
            minutes: None,
            limits: Limits::default(),
            battery: None,
            weight: None,
            mission: None,
            controller: None,
            logging: Logging::default(),
            disturbance_part: 0.03,
            disturbance_correlation_s: 10.0,
            current_m_s: [0.0; 2],
            full_input: None,
            draws: 4,
            checks: 100,
            compare: false,
            seed: 1,
        }
    }
}

impl Request {
    /// Checks limits, logging and numbers.
    ///
    /// # Errors
    /// [`Error::Limit`] and [`Error::Setting`], by name.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.limits.check()?;
        self.logging.check()?;
        self.battery.as_ref().map_or(Ok(()), Battery::check)?;
        self.mission.as_ref().map_or(Ok(()), Mission::check)?;
        let refuse = |name, found: String, expected| Err(Error::Setting { name, found, expected });
        if let Some(minutes) = self.minutes
            && !(1.0..=1440.0).contains(&minutes)
        {
            return refuse("minutes", minutes.to_string(), "from 1 to 1440");
        }
        if !(self.disturbance_part > 0.0 && self.disturbance_part <= 1.0) {
            let found = self.disturbance_part.to_string();
            return refuse("disturbance_part", found, "above 0 and at most 1");
        }
        if !(self.disturbance_correlation_s >= 0.2 && self.disturbance_correlation_s <= 300.0) {
            let found = self.disturbance_correlation_s.to_string();
            return refuse("disturbance_correlation_s", found, "from 0.2 to 300 s");
        }
        if !(1..=64).contains(&self.draws) {
            return refuse("draws", self.draws.to_string(), "from 1 to 64");
        }
        if !self.current_m_s.iter().all(|x| x.is_finite() && x.abs() < 5.0) {
            let found = format!("{:?}", self.current_m_s);
            return refuse("current_m_s", found, "north and east, below 5 m/s each");
        }
        if let Some(full) = self.full_input
            && !(full > 0.0 && full.is_finite())
        {
            return refuse("full_input", full.to_string(), "above 0");
        }
        Ok(())
    }

    /// Returns the disturbance of each axis, from earlier trials or as a fraction of the force that
    /// drives it, and the noise of the instruments.
    pub(crate) fn noises(&self, prior: &Prior, rig: &Rig) -> ExpectedNoises {
        let plant = &prior.model.plant;
        let of = |dof: &Dof| {
            let known = prior.model.disturbances.get(dof).map(|own| (own.std, own.correlation_s));
            let driving = driving_force(plant, rig, &self.limits, *dof);
            let force = driving.unwrap_or_else(|| resistance(plant, *dof, &self.limits));
            let part = self.disturbance_part * force;
            (*dof, known.unwrap_or((part, self.disturbance_correlation_s)))
        };
        let disturbances = plant.axes().iter().map(of).collect();
        self.logging.noises(&disturbances)
    }
}

/// Returns the resistance at its limits of an axis without thrust.
fn resistance(plant: &Plant, dof: Dof, limits: &Limits) -> f64 {
    let value = |term: Basis| plant.coefficient(&term).unwrap_or(0.0).abs();
    let v = if dof.is_rotation() { limits.rate_rad_s } else { limits.speed_m_s };
    let drag = value(Basis::Product(dof, Product::linear(dof))) * v
        + value(Basis::Product(dof, Product::quadratic(dof))) * v * v;
    let tilts = matches!(dof, Dof::Roll | Dof::Pitch);
    let righting = if tilts { value(Basis::Lever(2)) * limits.tilt_rad } else { 0.0 };
    drag.max(righting).max(1e-3 * value(Basis::Mass(dof, dof)))
}
