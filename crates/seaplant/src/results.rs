//! The results of an identification as data: the contract of `results.json`.
//!
//! Every number in a report is also here, or in the series of its figures.

mod campaign;
mod coefficients;
mod consequence;
mod drag;
mod model;
mod plan_outcome;
mod plant;
mod series;
mod steady;
mod steering;
mod vehicle;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::judge::{
    ConfirmedMotion, GoodFor, LikelyChange, MayBeOff, NullModel, NullScore, OffBecause, Part,
    PlantChange, PlantScore, Score, Trust, Verdict, WorseTrial,
};
use crate::{Caveat, Dof, Error, Method, Role};

pub use crate::estimate::online::{OnlineHistory, PlantChanged};
pub use campaign::{
    AxisResult, BollardPullResult, FileOffset, SensorResult, ThrusterResult, TrialResult,
};
pub(crate) use consequence::two_digits;
pub use consequence::{Consequence, Driven};
pub use drag::DragCurve;
pub use plan_outcome::{AxisOutcome, DrivenStretch, GoalOutcome, ManoeuvreOutcome, PlanOutcome};
pub use plant::{
    AccumulatedPlant, Alone, Parameter, Parameters, PlantResult, RegressionResult,
    SteadyTestResult, SubsetResult, ThrustPart, TruePlant,
};
pub use series::{
    ComparisonFigure, FittedModel, Identification, Series, SpectrumFigure, SteadyFigure,
};
pub use steady::{PairResult, SegmentResult, SteadyResult};
pub use steering::{NomotoResult, SecondOrder};
pub use vehicle::{BuoyancyResult, CurveResult, CurveTable, RigidBodyResult};

pub(crate) use coefficients::is_of_thruster;
pub use coefficients::{
    Coefficient, Correlation, Identifiability, MatrixResult, PrimeCoefficient, PrimeSystem,
    TermDecision, ThrusterEstimate, ThrusterGain, ToldBy, plant_of_result,
};

/// Name and version of this contract.
pub const SCHEMA: &str = "seaplant/results/2";

/// The results of an identification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Results {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of Seaplant that wrote the file.
    pub version: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Its mass in air, kg.
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of its hull, m.
    #[serde(default)]
    pub size_m: Option<[f64; 3]>,
    /// Its rigid body, if known.
    #[serde(default)]
    pub rigid_body: Option<RigidBodyResult>,
    /// Its displacement and centre of buoyancy, if known.
    #[serde(default)]
    pub buoyancy: Option<BuoyancyResult>,
    /// Source of the results, and the command to repeat them.
    pub provenance: Provenance,
    /// The recommended plants by their axes: `surge`, `surge-sway-yaw`.
    pub plants: BTreeMap<String, PlantResult>,
    /// Every method's plants by their axes.
    pub methods: BTreeMap<String, BTreeMap<Method, PlantResult>>,
    /// Nomoto's models of steering, if a plant has yaw among its axes and a rudder is logged.
    #[serde(default)]
    pub steering: Vec<NomotoResult>,
    /// The plants of the recommended method for every subset of terms.
    pub subsets: BTreeMap<Dof, Vec<SubsetResult>>,
    /// Drag from steady stretches.
    pub steady: BTreeMap<Dof, SteadyResult>,
    /// The thrusters as used.
    pub thrusters: Vec<ThrusterResult>,
    /// The thrust curve fitted to bollard-pull data, if any.
    pub bollard_pull: Option<BollardPullResult>,
    /// The instruments as used.
    pub sensors: Vec<SensorResult>,
    /// The trials.
    pub trials: Vec<TrialResult>,
    /// True coefficients by name, as in a plant's `parameters`, if the logs are those of a twin.
    pub truth: Option<BTreeMap<String, f64>>,
    /// Consequences of the recommended plants at the greatest force of the trials: top speeds, time
    /// constants, stopping distances, natural periods.
    #[serde(default)]
    pub consequences: Vec<Consequence>,
    /// The plan of the dive compared with what was driven and found, if one was named.
    #[serde(default)]
    pub plan: Option<PlanOutcome>,
    /// Failures with their reasons.
    pub failures: Vec<Failure>,
    /// Caveats of the campaign.
    pub caveats: Vec<Caveat>,
}

impl Results {
    /// Returns the range of motion and force on each axis in all trials, without steady runs that ask for
    /// another plant than the recommended one.
    pub fn driven(&self) -> BTreeMap<Dof, Driven> {
        let mut driven: BTreeMap<Dof, Driven> = BTreeMap::new();
        let is_of_steady = |own: &Alone| own.steady_test.as_ref().is_some_and(|test| test.agrees);
        let is_of_plant = |trial: &TrialResult, dof: &Dof| {
            let alone = self.plants.get(dof.name()).and_then(|plant| plant.alone.as_ref());
            trial.role != Role::Steady || alone.is_none_or(is_of_steady)
        };
        let mut add = |dof: Dof, more: Driven| {
            let known = driven.entry(dof).or_default();
            *known = known.or(more);
        };
        for trial in &self.trials {
            for (&dof, axis) in trial.axes.iter().filter(|(dof, _)| is_of_plant(trial, dof)) {
                // Without measured velocity, the greatest speed is unknown.
                if let Some(speed_max) = axis.speed_max {
                    add(dof, Driven { speed_max, force_max: axis.force_max });
                }
            }
        }
        for plant in self.plants.values() {
            plant.driven.iter().for_each(|(&dof, &more)| add(dof, more));
        }
        driven
    }

    /// Checks that there are results.
    ///
    /// # Errors
    /// [`Error::NothingFound`], with every method's reason, if there is neither a plant nor steady
    /// drag.
    pub fn check(&self) -> Result<(), Error> {
        if !self.plants.is_empty() || !self.steady.is_empty() || !self.steering.is_empty() {
            return Ok(());
        }
        let reason = |(dof, methods, why)| format!("\n  {dof} by {methods}: {why}");
        let mut reasons: String = self.reasons().into_iter().map(reason).collect();
        if reasons.is_empty() {
            reasons = "\n  no trial has role = \"fit\" or \"steady\"".to_owned();
        }
        Err(Error::NothingFound { reasons })
    }

    /// Returns the reason of each failure once: the axis, the methods, and the message.
    pub fn reasons(&self) -> Vec<(Dof, String, &str)> {
        let mut all: Vec<(Dof, String, &str)> = Vec::new();
        for Failure { dof, method, message } in &self.failures {
            match all.iter_mut().find(|(of, _, why)| of == dof && why == message) {
                Some((_, methods, _)) => *methods += &format!(", {method}"),
                None => all.push((*dof, method.clone(), message)),
            }
        }
        all
    }

    /// Returns the recommended plants of axes that were identified alone, in SNAME order.
    pub fn alone(&self) -> impl Iterator<Item = (Dof, &PlantResult, &Alone)> {
        Dof::ALL.into_iter().filter_map(|dof| {
            let plant = self.plants.get(dof.name())?;
            Some((dof, plant, plant.alone.as_ref()?))
        })
    }

    /// Returns the plants of several axes, and those of one that a `[[plant]]` asked for, by name.
    pub fn together(&self) -> impl Iterator<Item = (&String, &PlantResult)> {
        self.plants.iter().filter(|(_, plant)| !plant.is_alone())
    }

    /// Returns the plant to use for an axis: the one of several axes that has it, or else that of the axis alone.
    pub fn preferred(&self, dof: Dof) -> Option<&PlantResult> {
        let together = self.together().map(|(_, plant)| plant);
        let mut together = together.filter(|plant| plant.axes.contains(&dof));
        together.next().or_else(|| self.plants.get(dof.name()))
    }

    /// Returns the names of all plants: of axes alone in SNAME order, then of several axes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let alone = self.alone().map(|(dof, ..)| dof.name());
        alone.chain(self.together().map(|(name, _)| name.as_str()))
    }

    /// Returns the plants of an axis alone by every method.
    pub fn methods_of(
        &self,
        dof: Dof,
    ) -> impl Iterator<Item = (Method, &PlantResult, &Alone)> + Clone {
        let all = self.methods.get(dof.name()).into_iter().flatten();
        all.filter_map(|(method, plant)| Some((*method, plant, plant.alone.as_ref()?)))
    }

    /// Returns the plant of an axis alone by a method, also where none is recommended.
    pub fn method_of(&self, dof: Dof, method: Method) -> Option<&PlantResult> {
        self.methods_of(dof).find(|(own, ..)| *own == method).map(|(_, plant, _)| plant)
    }

    /// Returns the plant of a degree of freedom by a method, or the recommended one.
    ///
    /// # Errors
    /// [`Error::NoPlant`].
    pub fn plant_of(&self, dof: Dof, method: Option<Method>) -> Result<&PlantResult, Error> {
        let refuse = |found: String| Error::NoPlant { found };
        let recommended = self.plants.get(dof.name()).ok_or_else(|| {
            let all: Vec<&str> = self.names().collect();
            let all = if all.is_empty() { "none at all".to_owned() } else { all.join(", ") };
            refuse(format!("no {dof} plant, but {all}"))
        })?;
        let Some(method) = method else { return Ok(recommended) };
        let of_dof = self.methods.get(dof.name()).and_then(|methods| methods.get(&method));
        of_dof.ok_or_else(|| refuse(format!("no {dof} plant by {method}")))
    }

    /// Returns the true plant of an axis, if the logs are those of a twin that has it.
    pub fn truth_of(&self, dof: Dof) -> Option<TruePlant> {
        TruePlant::of(dof, self.truth.as_ref()?)
    }
}

/// Source of the results.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Provenance {
    /// The command to repeat them.
    pub command: String,
    /// Every file that was read.
    pub inputs: Vec<InputFile>,
    /// Seed of all random numbers; absent if none was drawn.
    pub seed: Option<u64>,
    /// The effective settings, defaults included.
    pub settings: BTreeMap<String, String>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InputFile {
    /// Path in the campaign.
    pub path: String,
    /// Size, bytes.
    pub bytes: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
}

/// A failed fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Failure {
    /// The degree of freedom.
    pub dof: Dof,
    /// The method, or `steady`.
    pub method: String,
    /// Reason and advice.
    pub message: String,
}
