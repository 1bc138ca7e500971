//! What may be in the model beside the plant, and why it is or is not.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::parameters::Unknown;
use crate::AxisRecord;

/// Something that may or may not be part of the model.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Candidate {
    /// First-order lag of propeller speed.
    Lag,
    /// Delay of thrust.
    Delay,
    /// Reverse thrust that differs from its curve.
    ReverseRatio,
    /// A constant current along the degree of freedom, in each trial its own.
    Current,
    /// Thrust lost to inflow.
    Inflow,
    /// A lever arm of the velocity sensor that navigation did not know, along the first of
    /// [`lever_axes`](crate::lever_axes).
    LeverFirst,
    /// The same along the second.
    LeverSecond,
    /// Drag that is linear in speed.
    LinearDrag,
    /// A constant force.
    Bias,
    /// What turning does to body velocity: see [`AxisRecord::turning`].
    Turning,
    /// A lag of propellers that slow down which differs from that of those that speed up.
    LagRatio,
    /// Propellers that change speed at a limited rate.
    Slew,
    /// Thrust lost to inflow only by propellers that push the way the vehicle goes.
    InflowAhead,
    /// Thrust that grows with another power of propeller speed than the square.
    Exponent,
    /// A velocity sensor that reads a part too much, beside position.
    VelocityScale,
    /// A velocity sensor, or an accelerometer by itself, with a first-order lag.
    SensorLag,
    /// The same, if it averages.
    SensorWindow,
    /// Waves: a force in a narrow band of frequencies.
    Swell,
    /// A current that varies in each trial.
    CurrentDrift,
    /// Propeller speeds that move linearly from one logged sample to the next.
    LinearThrust,
}

/// When a candidate is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Turn {
    /// The search starts with it in the model: one of these faults hides another.
    First,
    /// It is tried when the logs contradict the model that the first make.
    Later,
}

impl Candidate {
    /// All of them.
    pub const ALL: [Self; 20] = [
        Self::Lag,
        Self::Delay,
        Self::ReverseRatio,
        Self::Current,
        Self::Inflow,
        Self::LeverFirst,
        Self::LeverSecond,
        Self::LinearDrag,
        Self::Bias,
        Self::Turning,
        Self::LagRatio,
        Self::Slew,
        Self::InflowAhead,
        Self::Exponent,
        Self::VelocityScale,
        Self::SensorLag,
        Self::SensorWindow,
        Self::Swell,
        Self::CurrentDrift,
        Self::LinearThrust,
    ];

    /// As files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lag => "lag",
            Self::Delay => "delay",
            Self::ReverseRatio => "reverse-ratio",
            Self::Current => "current",
            Self::Inflow => "inflow",
            Self::LeverFirst => "lever-first",
            Self::LeverSecond => "lever-second",
            Self::LinearDrag => "linear-drag",
            Self::Bias => "bias",
            Self::Turning => "turning",
            Self::LagRatio => "lag-ratio",
            Self::Slew => "slew",
            Self::InflowAhead => "inflow-ahead",
            Self::Exponent => "exponent",
            Self::VelocityScale => "velocity-scale",
            Self::SensorLag => "sensor-lag",
            Self::SensorWindow => "sensor-window",
            Self::Swell => "swell",
            Self::CurrentDrift => "current-drift",
            Self::LinearThrust => "linear-thrust",
        }
    }

    /// The unknowns that it adds, with the value that each starts from.
    pub(crate) fn unknowns(self) -> Vec<(Unknown, f64)> {
        let one = |unknown| vec![(unknown, 0.0)];
        match self {
            // At zero neither has anything to follow.
            Self::Lag => vec![(Unknown::Lag, 0.15)],
            Self::Slew => vec![(Unknown::Slew, 0.3)],
            Self::Delay => one(Unknown::Delay),
            Self::ReverseRatio => one(Unknown::LogReverseRatio),
            Self::Current => one(Unknown::Current),
            Self::Inflow => one(Unknown::Inflow),
            Self::LeverFirst => one(Unknown::LeverFirst),
            Self::LeverSecond => one(Unknown::LeverSecond),
            Self::LinearDrag => one(Unknown::Mu),
            Self::Bias => one(Unknown::Bias),
            Self::Turning => one(Unknown::Turning),
            Self::LagRatio => one(Unknown::LogLagRatio),
            Self::InflowAhead => one(Unknown::InflowAhead),
            Self::Exponent => one(Unknown::Exponent),
            Self::VelocityScale => one(Unknown::VelocityScale),
            Self::SensorLag => vec![(Unknown::LogSensorLag, (0.3_f64).ln())],
            Self::SensorWindow => vec![(Unknown::LogSensorWindow, (0.6_f64).ln())],
            // Where they start, the search finds out.
            Self::Swell => vec![
                (Unknown::LogSwell, 0.0),
                (Unknown::LogSwellFrequency, 0.0),
                (Unknown::LogSwellDamping, (0.1_f64).ln()),
            ],
            Self::CurrentDrift => vec![(Unknown::LogDrift, (0.05_f64).ln())],
            Self::LinearThrust => Vec::new(),
        }
    }

    /// Whether it adds an unknown.
    pub(crate) fn has(self, unknown: Unknown) -> bool {
        self.unknowns().iter().any(|(own, _)| *own == unknown)
    }

    /// Whether it can be at all: a rotation knows no current along it, and a lever arm
    /// shows only where the vehicle's turning was logged.
    pub(crate) fn exists_in(self, axes: &[AxisRecord]) -> bool {
        let has_velocity = || axes.iter().all(AxisRecord::measures_velocity);
        match self {
            // An accelerometer feels the same in every steady current.
            Self::Current | Self::CurrentDrift => {
                axes.iter().all(|axis| !axis.dof.is_rotation() && axis.knows_velocity())
            }
            Self::LeverFirst | Self::LeverSecond => {
                axes.iter().all(|axis| axis.lever_rates.is_some() && axis.knows_velocity())
            }
            Self::Turning => axes.iter().all(|axis| axis.turning.is_some()),
            Self::VelocityScale => {
                has_velocity() && axes.iter().all(|axis| axis.believable_position().is_some())
            }
            Self::SensorLag | Self::SensorWindow => {
                has_velocity() || axes.iter().all(|axis| !axis.knows_velocity())
            }
            // Acceleration alone does not tell what thrust loses with speed from drag.
            Self::Inflow | Self::InflowAhead | Self::Exponent => {
                axes.iter().all(AxisRecord::knows_velocity)
            }
            Self::LinearThrust => axes.iter().all(AxisRecord::thrust_is_slow),
            _ => true,
        }
    }

    /// Whether it is a term of the equation of motion, which a user may ask for.
    pub(crate) const fn is_term(self) -> bool {
        matches!(self, Self::LinearDrag | Self::Bias)
    }

    /// When it is tried.
    pub(crate) const fn turn(self) -> Turn {
        match self {
            Self::LagRatio
            | Self::Slew
            | Self::InflowAhead
            | Self::Exponent
            | Self::VelocityScale
            | Self::SensorLag
            | Self::SensorWindow
            | Self::Swell
            | Self::CurrentDrift
            | Self::LinearThrust => Turn::Later,
            _ => Turn::First,
        }
    }

    /// Whether the slope of the cost where it does nothing tells what it is worth: not of what
    /// starts at a limit, or of noise that is not there.
    pub(crate) const fn has_score(self) -> bool {
        !matches!(
            self,
            Self::Slew
                | Self::SensorLag
                | Self::SensorWindow
                | Self::Swell
                | Self::CurrentDrift
                | Self::LinearThrust
        )
    }

    /// What it does not stand beside: another law of the same thing.
    pub(crate) fn rivals(self) -> Vec<Self> {
        match self {
            Self::SensorLag => vec![Self::SensorWindow],
            Self::SensorWindow => vec![Self::SensorLag],
            Self::Inflow => vec![Self::InflowAhead],
            Self::InflowAhead => vec![Self::Inflow],
            _ => Vec::new(),
        }
    }

    /// What may be in the model in its place, so that it is tried without them, too: from a model
    /// that has them descent may not lead to one that has it instead.
    pub(crate) fn imitators(self) -> Vec<Self> {
        match self {
            Self::SensorLag | Self::SensorWindow => {
                vec![Self::Lag, Self::LagRatio, Self::Slew, Self::Delay]
            }
            Self::Slew => vec![Self::Lag, Self::LagRatio, Self::Inflow, Self::InflowAhead],
            Self::CurrentDrift => vec![Self::Current],
            _ => Vec::new(),
        }
    }

    /// Whether what imitates it may leave innovations white, so that it is tried all the same.
    pub(crate) const fn may_hide(self) -> bool {
        matches!(self, Self::SensorLag | Self::CurrentDrift)
    }

    /// What it changes, without which it is nothing.
    pub(crate) const fn needs(self) -> Option<Self> {
        match self {
            Self::LagRatio => Some(Self::Lag),
            _ => None,
        }
    }
}

/// Why a candidate was taken into the model, or left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Decision {
    /// Which.
    pub candidate: Candidate,
    /// Twice the gain in log-likelihood, at least 0: fitted, or where a fit was not worth it,
    /// by the score test.
    pub likelihood_ratio: f64,
    /// What the extended Bayesian information criterion asks for: numbers added times ln n, and
    /// 2 ln P of P candidates that are tried.
    pub needed: f64,
    /// How much it does, for a term: linear drag as a part of quadratic drag at the usual
    /// speed, zero unless both brake; a bias force, at the end of its interval that is farther
    /// from zero, as a part of the usual thrust.
    pub size: Option<f64>,
    /// Twice the gain in a bounded log-likelihood on held-out trials, with everything held that
    /// was fitted but what each trial has by itself and the noise; absent without such trials,
    /// or if it was not asked for.
    pub hold_out_ratio: Option<f64>,
    /// Whether it is part of the model.
    pub admitted: bool,
}
