//! A trial: a time window of one log of one vehicle, checked once.

mod agreement;
mod as_trial;
mod axis;
mod force;
mod gained;
mod logged;
mod plausible;
mod propeller;
mod records;
mod report;
mod signals;
mod slopes;
mod start;
mod steering_gear;
mod trial_record;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use axis::{AxisRecord, UniformAxis, UniformStretch, lever_axes};
pub(crate) use axis::{ReadyAxis, ReadyStretch};
pub(crate) use trial_record::Miswired;
pub use trial_record::{PlacedThruster, ThrusterFault, TrialRecord};

use crate::motion::KnownForce;
pub(crate) use crate::navigation::Beside;
use crate::navigation::{Navigated, Recording, navigate_along};
use crate::series::Cutter;
use crate::{Caveat, CaveatCode, Dof, Error, Quantity, Vehicle};
use axis::rate_hz;
use force::{Saturation, Thrusts};
pub use force::{Supply, ThrusterTrack};
pub(crate) use force::{ThrustError, force_along};
pub use gained::GAINED_S;
pub(crate) use logged::{Logged, LoggedEffect, OverGround};
pub(crate) use plausible::{HIGHEST_SURFACE_ANGLE_RAD, without_outliers};
use plausible::{coarse_thrust, mask, suspicious_units};
use records::Records;
pub use report::VelocityReport;
pub(crate) use start::starting_velocity;
pub use steering_gear::SteeringGear;

/// The role of a trial.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// For estimation.
    #[default]
    Fit,
    /// For validation of fitted plants.
    HoldOut,
    /// With stretches at constant speed.
    Steady,
}

impl Role {
    /// Returns the name in campaign files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::HoldOut => "hold-out",
            Self::Steady => "steady",
        }
    }
}

/// The preferred source of velocity, if the trial has several.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VelocitySource {
    /// The instrument that measures velocity, otherwise the derivative of position.
    Measured,
    /// The derivative of navigated position, otherwise the instrument.
    Position,
}

/// Name, role and time window of a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrialSetup {
    /// Name in tables and messages.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// The degrees of freedom that it excites.
    pub dofs: Vec<Dof>,
    /// Its start, in the recording's time, s.
    pub from_s: Option<f64>,
    /// Its end, in the recording's time, s.
    pub to_s: Option<f64>,
    /// Steady stretches `[from, to]`, in the recording's time, s; detected if empty.
    pub segments_s: Vec<[f64; 2]>,
    /// The axes of each plant of several axes to be fitted to the trial.
    pub together: Vec<Vec<Dof>>,
    /// Known forces: weights hung on the vehicle, and lines with a scale.
    pub known: Vec<KnownForce>,
}

/// A time window of one log, for one vehicle.
///
/// It provides raw measurements and resampled records, by degree of freedom.
#[derive(Clone, Debug)]
pub struct Trial {
    setup: TrialSetup,
    /// Records, or the reason why one is unusable if others are usable.
    records: BTreeMap<Dof, Result<Records, Error>>,
    mean_heading_rad: Option<f64>,
    beside: Beside,
    rates_hz: BTreeMap<Quantity, f64>,
    saturated: Vec<Saturation>,
    caveats: Vec<Caveat>,
    together: Vec<Result<TrialRecord, Error>>,
    logged: Option<Logged>,
}

impl Trial {
    /// Navigates a recording, converts thruster readings to forces and checks both.
    ///
    /// # Errors
    /// [`Error::MissingChannel`] if a degree of freedom of the trial lacks force or motion,
    /// [`Error::NoOverlap`] if they do not overlap in time, [`Error::TooShort`] if fewer than ten
    /// samples of motion are in the trial's window.
    pub fn new(setup: TrialSetup, recording: &Recording, vehicle: &Vehicle) -> Result<Self, Error> {
        Self::using_up(setup, recording.clone(), vehicle)
    }

    /// Creates a trial as [`Trial::new`], but consumes the recording and frees each channel after
    /// its use, which saves most of the memory of a long log.
    ///
    /// # Errors
    /// As [`Trial::new`].
    pub fn using_up(
        setup: TrialSetup,
        mut recording: Recording,
        vehicle: &Vehicle,
    ) -> Result<Self, Error> {
        let mut caveats = suspicious_units(&recording, vehicle);
        caveats.extend(propeller::impossible(&recording, vehicle));
        caveats.extend(coarse_thrust(&setup.name, &recording));
        mask(&mut recording, &mut caveats);
        let rates_hz = recording.iter().map(|(what, x)| (what.clone(), rate_hz(x))).collect();
        let record_of = |axes: &Vec<Dof>| TrialRecord::new(&setup, &recording, vehicle, axes);
        let together: Vec<_> = setup.together.iter().map(record_of).collect();
        let logged = Logged::new(&setup, &recording, vehicle);
        let (of_thrust, recording) =
            recording.into_iter().partition(|(quantity, _)| quantity.is_of_thrust());
        let mut thrusts = Thrusts::new(&setup, of_thrust, vehicle);
        let along = |&dof: &Dof| Ok((dof, thrusts.along(dof)?));
        let thrust = setup.dofs.iter().map(along).collect::<Result<Vec<_>, Error>>()?;
        let saturated = thrusts.into_saturated();

        // Heading shows whether trials were driven in both directions.
        let wanted: Vec<Dof> = setup.dofs.iter().copied().chain([Dof::Yaw]).collect();
        let mut navigated = navigate_along(&setup.name, recording, &vehicle.sensors, &wanted)?;
        caveats.append(&mut navigated.caveats);
        let mut cutter = Cutter::default();
        let mut records = BTreeMap::new();
        for (dof, thrust) in thrust {
            records.insert(dof, Records::new(&setup, dof, thrust, &navigated, &mut cutter));
        }
        check_records(&setup, &records, &together)?;
        let mean_heading_rad = mean_heading_rad(&navigated);
        let beside = navigated.beside;
        Ok(Self {
            setup,
            records,
            mean_heading_rad,
            beside,
            rates_hz,
            saturated,
            caveats,
            together,
            logged,
        })
    }

    /// Adds caveats from the log's reader.
    pub fn with_caveats(mut self, caveats: impl IntoIterator<Item = Caveat>) -> Self {
        self.caveats.extend(caveats);
        self
    }

    /// Changes the role.
    pub fn with_role(mut self, role: Role) -> Self {
        self.setup.role = role;
        self
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        &self.setup.name
    }

    /// Returns the role.
    pub fn role(&self) -> Role {
        self.setup.role
    }

    /// Returns the degrees of freedom that it excites.
    pub fn dofs(&self) -> &[Dof] {
        &self.setup.dofs
    }

    /// Returns its name, role and window.
    pub fn setup(&self) -> &TrialSetup {
        &self.setup
    }

    /// Returns the mean direction of the heading, rad; `None` if it was not logged.
    pub fn mean_heading_rad(&self) -> Option<f64> {
        self.mean_heading_rad
    }

    /// Returns the motion of other axes, as far as it was logged.
    pub(crate) fn beside(&self) -> &Beside {
        &self.beside
    }

    /// Returns the median rate at which a quantity was logged, Hz; `None` if it was not.
    pub fn rate_hz(&self, quantity: &Quantity) -> Option<f64> {
        self.rates_hz.get(quantity).copied()
    }

    /// Returns the raw record of one degree of freedom, cut to the trial's window.
    ///
    /// # Errors
    /// As [`Trial::new`].
    pub fn axis(&self, dof: Dof, source: VelocitySource) -> Result<AxisRecord, Error> {
        let records = self.records.get(&dof).ok_or_else(|| Error::MissingChannel {
            trial: self.setup.name.clone(),
            what: format!("force for {dof}"),
            advice: "name the degree of freedom in the trial's dof = [...]".to_owned(),
        })?;
        records.as_ref().map_err(Clone::clone)?.from(source)
    }

    /// Returns the record for a plant of several axes.
    ///
    /// # Errors
    /// As [`TrialRecord::new`], if the log is insufficient; [`Error::Plant`] if the setup does
    /// not name such a plant.
    pub fn record(&self, axes: &[Dof]) -> Result<&TrialRecord, Error> {
        let found = self.setup.together.iter().position(|known| known == axes);
        let Some(found) = found.and_then(|at| self.together.get(at)) else {
            let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
            let reason = format!(
                "trial `{}` was not made for these axes; state them where it is made",
                self.setup.name
            );
            return Err(Error::Plant { axes: names.join("-"), reason });
        };
        found.as_ref().map_err(Clone::clone)
    }

    /// Returns the log of all axes on one grid; `None` for a trial that is too short.
    pub(crate) fn logged(&self) -> Option<&Logged> {
        self.logged.as_ref()
    }

    /// Returns the caveats of every fit to this trial: of units, outliers and the logging of
    /// thrust.
    pub(crate) fn caveats_of_log(&self) -> &[Caveat] {
        &self.caveats
    }

    /// Returns the caveats of every fit of a degree of freedom to this trial.
    pub fn caveats(&self, dof: Dof) -> Vec<Caveat> {
        let mut caveats = self.caveats.clone();
        caveats.extend(saturations(&self.setup.name, &self.saturated));
        let axis = self.axis(dof, VelocitySource::Measured);
        caveats.extend(axis.iter().filter_map(AxisRecord::contradiction));
        let ready = axis.as_ref().map(|axis| axis.ready(LEAST_SAMPLES));
        if let Ok(Ok(ready)) = &ready
            && let Some(first) = ready.gaps.first()
        {
            let lost: f64 = ready.gaps.iter().map(|gap| gap.to_s - gap.from_s).sum();
            let message = format!(
                "trial `{}`: {} without samples, {lost:.1} s in all, the first from {:.1} to {:.1} s; they are left out, and simulation starts anew after each gap in thrust",
                self.setup.name,
                count(ready.gaps.len(), "stretch", "stretches"),
                first.from_s,
                first.to_s
            );
            caveats.push(Caveat::note(CaveatCode::Gaps, message));
        }
        caveats.extend(axis.iter().filter_map(AxisRecord::lost_turns));
        caveats
    }
}

/// Refuses a trial without a usable record, or without a channel.
fn check_records(
    setup: &TrialSetup,
    records: &BTreeMap<Dof, Result<Records, Error>>,
    together: &[Result<TrialRecord, Error>],
) -> Result<(), Error> {
    let is_of_log =
        |error: &Error| matches!(error, Error::TooShort { .. } | Error::NoOverlap { .. });
    let is_usable = records.values().any(Result::is_ok) || together.iter().any(Result::is_ok);
    let mut refused = setup.dofs.iter().filter_map(|dof| records.get(dof)?.as_ref().err());
    match refused.find(|error| !is_usable || !is_of_log(error)) {
        Some(error) => Err(error.clone()),
        None => Ok(()),
    }
}

/// Returns caveats on thrusters driven beyond their curves.
fn saturations(trial: &str, saturated: &[Saturation]) -> impl Iterator<Item = Caveat> {
    saturated.iter().map(move |Saturation { thruster, part }| {
        let message = format!(
            "trial `{trial}`: thruster `{thruster}` is driven beyond its measured curve for {:.0} % of the log, where its thrust is taken as the curve's last; measure the curve further out or leave those stretches out",
            100.0 * part
        );
        Caveat::warning(CaveatCode::ThrusterSaturated, message)
    })
}

/// Returns the direction of the mean of unit vectors, which does not depend on whole turns.
fn mean_heading_rad(navigated: &Navigated) -> Option<f64> {
    let heading = navigated.position.get(&Dof::Yaw)?;
    let sum = |of: fn(f64) -> f64| heading.values().iter().map(|x| of(*x)).sum::<f64>();
    Some(sum(f64::sin).atan2(sum(f64::cos)))
}

/// Least number of samples of a trial: an order-2 filter alone needs ten.
const LEAST_SAMPLES: usize = 10;

pub(crate) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}
