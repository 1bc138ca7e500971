//! One stretch of one log of one vehicle, checked once.

mod agreement;
mod axis;
mod force;
mod plausible;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use axis::{AxisRecord, UniformAxis, UniformStretch, lever_axes};
pub(crate) use axis::{ReadyAxis, ReadyStretch};

use crate::navigation::{Motion, Navigated, Recording, navigate};
use crate::{Caveat, CaveatCode, Dof, Error, Quantity, Timed, Vehicle};
use axis::{lever_rates, rate_hz};
pub(crate) use force::ThrustError;
pub use force::ThrusterTrack;
use force::{Saturation, total_force, tracks_along};
use plausible::{coarse_thrust, masked, suspicious_units};

/// What a trial is for.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Parameters are fitted to it.
    #[default]
    Fit,
    /// Fitted plants are judged on it.
    HoldOut,
    /// It holds stretches at constant speed.
    Steady,
}

impl Role {
    /// As campaign files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::HoldOut => "hold-out",
            Self::Steady => "steady",
        }
    }
}

/// Where an estimator takes velocity from, if the trial leaves a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VelocitySource {
    /// The instrument that measures velocity, else the derivative of position.
    Measured,
    /// The derivative of navigated position, else the instrument.
    Position,
}

/// What a trial is called, what it is for and which part of the log it takes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrialSetup {
    /// How tables and messages call it.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// The degrees of freedom that it exercises.
    pub dofs: Vec<Dof>,
    /// Its start, in the recording's time, s.
    pub from_s: Option<f64>,
    /// Its end, in the recording's time, s.
    pub to_s: Option<f64>,
    /// Steady stretches `[from, to]`, in the recording's time, s; empty to find them.
    pub segments_s: Vec<[f64; 2]>,
}

/// One stretch of one log for one vehicle.
///
/// It offers the raw timed measurements, and uniform views of them, by degree of freedom.
#[derive(Clone, Debug)]
pub struct Trial {
    setup: TrialSetup,
    thrust: BTreeMap<Dof, Thrust>,
    navigated: Navigated,
    rates_hz: BTreeMap<Quantity, f64>,
    saturated: Vec<Saturation>,
    caveats: Vec<Caveat>,
}

/// What drives one degree of freedom.
#[derive(Clone, Debug)]
struct Thrust {
    force: Timed,
    tracks: Vec<ThrusterTrack>,
}

impl Trial {
    /// Navigates a recording, turns thruster readings into forces and checks both.
    ///
    /// # Errors
    /// [`Error::MissingChannel`] if a degree of freedom of the trial lacks force or
    /// motion, [`Error::NoOverlap`] if they share no time, [`Error::TooShort`] if
    /// fewer than ten samples of motion are left in the trial's window.
    pub fn new(setup: TrialSetup, recording: &Recording, vehicle: &Vehicle) -> Result<Self, Error> {
        let mut caveats = suspicious_units(recording);
        caveats.extend(coarse_thrust(&setup.name, recording));
        let recording = masked(recording, &mut caveats);
        let mut navigated = navigate(&setup.name, &recording, &vehicle.sensors)?;
        caveats.append(&mut navigated.caveats);
        let mut saturated = Vec::new();
        let mut thrust = BTreeMap::new();
        for &dof in &setup.dofs {
            let tracks = tracks_along(&setup.name, dof, &recording, vehicle, &mut saturated)?;
            thrust.insert(dof, Thrust { force: total_force(&tracks)?, tracks });
        }
        let rates_hz = recording.iter().map(|(what, x)| (what.clone(), rate_hz(x))).collect();
        let trial = Self { setup, thrust, navigated, rates_hz, saturated, caveats };
        for &dof in &trial.setup.dofs {
            trial.axis(dof, VelocitySource::Measured)?;
        }
        Ok(trial)
    }

    /// Adds doubts that the log's reader had.
    pub fn with_caveats(mut self, caveats: impl IntoIterator<Item = Caveat>) -> Self {
        self.caveats.extend(caveats);
        self
    }

    /// What the trial is called.
    pub fn name(&self) -> &str {
        &self.setup.name
    }

    /// What the trial is for.
    pub fn role(&self) -> Role {
        self.setup.role
    }

    /// The degrees of freedom that it exercises.
    pub fn dofs(&self) -> &[Dof] {
        &self.setup.dofs
    }

    /// Its name, role and window.
    pub fn setup(&self) -> &TrialSetup {
        &self.setup
    }

    /// How the vehicle moved.
    pub fn navigated(&self) -> &Navigated {
        &self.navigated
    }

    /// The median rate at which a quantity was logged, Hz; `None` if it was not.
    pub fn rate_hz(&self, quantity: &Quantity) -> Option<f64> {
        self.rates_hz.get(quantity).copied()
    }

    /// The raw record of one degree of freedom, cut to the trial's window.
    ///
    /// # Errors
    /// As [`Trial::new`].
    pub fn axis(&self, dof: Dof, source: VelocitySource) -> Result<AxisRecord, Error> {
        let missing = |what: &str, advice: &str| Error::MissingChannel {
            trial: self.setup.name.clone(),
            what: format!("{what} for {dof}"),
            advice: advice.to_owned(),
        };
        let Thrust { force, tracks } = self.thrust.get(&dof).ok_or_else(|| {
            missing("force", "name the degree of freedom in the trial's dof = [...]")
        })?;
        let measured = self.navigated.measured.get(&dof).cloned().map(Motion::Velocity);
        let by_position = self.navigated.by_position.get(&dof).cloned();
        let motion = match source {
            VelocitySource::Measured => measured.or(by_position),
            VelocitySource::Position => by_position.or(measured),
        }
        .ok_or_else(|| missing("velocity or position", motion_advice(dof)))?;
        let (from_s, to_s) = self.overlap(dof, force, &motion)?;
        // Only an instrument that moves with the hull is misled by its turning.
        let is_velocity = matches!(motion, Motion::Velocity(_));
        let rates = self.navigated.rates.as_ref().filter(|_| is_velocity);
        let whole = AxisRecord {
            dof,
            trial: self.setup.name.clone(),
            force: force.clone(),
            thrusters: tracks.clone(),
            motion,
            lever_rates: rates.and_then(|rates| lever_rates(dof, rates)),
            turning: self.turning(dof),
            position: self.navigated.position.get(&dof).cloned(),
        };
        let record = whole.window([from_s, to_s]).map(AxisRecord::from_rest);
        let samples = record.as_ref().map_or(0, |record| record.motion.series().len());
        record.filter(|_| samples >= LEAST_SAMPLES).ok_or_else(|| Error::TooShort {
            name: format!("the {dof} motion of trial `{}`", self.setup.name),
            found: samples,
            needed: LEAST_SAMPLES,
        })
    }

    /// `−(ω × v)` along a translation, at the times of one of the other velocities.
    fn turning(&self, dof: Dof) -> Option<Timed> {
        let rates = self.navigated.rates.as_ref()?;
        let measured = |dof: Dof| self.navigated.measured.get(&dof);
        let [u, v, w] = [Dof::Surge, Dof::Sway, Dof::Heave].map(measured);
        let [p, q, r] = [0, 1, 2].map(|k| Some(&rates[k]));
        let (plus, minus) = match dof {
            Dof::Surge => ((r, v), (q, w)),
            Dof::Sway => ((p, w), (r, u)),
            Dof::Heave => ((q, u), (p, v)),
            Dof::Roll | Dof::Pitch | Dof::Yaw => return None,
        };
        let base = plus.1.or(minus.1)?;
        let product = |(rate, speed): (Option<&Timed>, Option<&Timed>), t: f64| {
            rate.zip(speed).map_or(0.0, |(rate, speed)| rate.at(t) * speed.at(t))
        };
        let at = |&t: &f64| product(plus, t) - product(minus, t);
        base.with_values("turning", base.time_s().iter().map(at).collect()).ok()
    }

    /// The caveats that every fit of a degree of freedom of this trial inherits.
    pub fn caveats(&self, dof: Dof) -> Vec<Caveat> {
        let mut caveats = self.caveats.clone();
        for Saturation { thruster, part } in &self.saturated {
            let message = format!(
                "trial `{}`: thruster `{thruster}` is driven beyond its measured curve for {:.0} % of the log, where its thrust is taken as the curve's last; measure the curve further out or leave those stretches out",
                self.setup.name,
                100.0 * part
            );
            caveats.push(Caveat::warning(CaveatCode::ThrusterSaturated, message));
        }
        let axis = self.axis(dof, VelocitySource::Measured);
        caveats.extend(axis.iter().filter_map(AxisRecord::contradiction));
        if let Ok(uniform) = axis.and_then(|axis| axis.uniform(LEAST_SAMPLES))
            && let Some(first) = uniform.gaps.first()
        {
            let lost: f64 = uniform.gaps.iter().map(|gap| gap.to_s - gap.from_s).sum();
            let message = format!(
                "trial `{}`: {} without samples, {lost:.1} s in all, the first from {:.1} to {:.1} s; they are left out, and simulation starts anew after each gap in thrust",
                self.setup.name,
                count(uniform.gaps.len(), "stretch", "stretches"),
                first.from_s,
                first.to_s
            );
            caveats.push(Caveat::note(CaveatCode::Gaps, message));
        }
        caveats
    }

    fn overlap(&self, dof: Dof, force: &Timed, motion: &Motion) -> Result<(f64, f64), Error> {
        let motion = motion.series();
        let wanted_from = self.setup.from_s.unwrap_or(f64::NEG_INFINITY);
        let wanted_to = self.setup.to_s.unwrap_or(f64::INFINITY);
        let span = |what: &str, from_s: f64, to_s: f64| {
            format!("{what}, from {from_s:.1} to {to_s:.1} s,")
        };
        let refuse = |second: String| Error::NoOverlap {
            trial: self.setup.name.clone(),
            first: span(&format!("the {dof} motion"), motion.first_s(), motion.last_s()),
            second,
        };
        // A thrust logged once holds until it is logged again, but for no more than
        // the rest of the trial.
        let held_to = if force.len() == 1 { f64::INFINITY } else { force.last_s() };
        let held_to = held_to + force.period_s();
        if motion.first_s() > held_to || motion.last_s() < force.first_s() {
            let thrust = format!("the {dof} thrust");
            return Err(refuse(span(&thrust, force.first_s(), force.last_s())));
        }
        if motion.first_s() > wanted_to || motion.last_s() < wanted_from {
            return Err(refuse(span("the trial's window", wanted_from, wanted_to)));
        }
        Ok((
            wanted_from.max(motion.first_s()).max(force.first_s()),
            wanted_to.min(motion.last_s()).min(held_to),
        ))
    }
}

/// Below this a trial says nothing: an order-2 filter alone needs ten samples.
const LEAST_SAMPLES: usize = 10;

fn motion_advice(dof: Dof) -> &'static str {
    match dof {
        Dof::Surge => {
            "map velocity.surge, dvl.velocity.x, or position.north and .east with attitude.heading"
        }
        Dof::Sway => {
            "map velocity.sway, dvl.velocity.y, or position.north and .east with attitude.heading"
        }
        Dof::Heave => "map depth, velocity.heave or dvl.velocity.z",
        Dof::Roll => "map attitude.roll or rate.roll",
        Dof::Pitch => "map attitude.pitch or rate.pitch",
        Dof::Yaw => "map attitude.heading or rate.yaw",
    }
}

pub(crate) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}
