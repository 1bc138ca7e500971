//! What may be in the model beside the plant, and why it is or is not.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{AxisRecord, BetweenSamples};

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
    /// A lever arm of the velocity sensor that navigation did not know.
    Lever,
    /// Drag that is linear in speed.
    LinearDrag,
    /// A constant force.
    Bias,
    /// What turning does to body velocity: see [`AxisRecord::turning`].
    Turning,
    /// A lag of propellers that slow down which differs from that of those that speed up.
    LagRatio,
    /// A lag of propellers whose speed falls, towards full reverse, which differs from that of those whose speed rises.
    FallingLagRatio,
    /// Propellers that change speed at a limited rate.
    Slew,
    /// Thrust lost to inflow only by propellers that push the way the vehicle goes.
    InflowAhead,
    /// Thrust that grows with another power of propeller speed than the square.
    Exponent,
    /// Propellers that do not turn below a part of their greatest speed.
    DeadBand,
    /// Thrust that changes from the beginning of each trial to its end, beside what its log says.
    ThrustChangeWithin,
    /// The same from the first trial to the last.
    ThrustChangeBetween,
    /// Thrust that changes with the logged supply voltage.
    Voltage,
    /// A velocity sensor that reads a part too much, as position tells.
    VelocityScale,
    /// A velocity sensor with a first-order lag.
    SensorLag,
    /// The same, if it averages over a window.
    SensorWindow,
    /// Waves: a force in a narrow band of frequencies.
    Swell,
    /// A current that varies in each trial.
    CurrentDrift,
    /// Changes of thrust that act earlier or later than its log, lag and delay say.
    ThrustJitter,
    /// Propeller speeds that move smoothly from one logged sample to the next.
    #[serde(alias = "linear-thrust")]
    SmoothSpeed,
    /// Thrust that moves smoothly from one logged sample to the next.
    SmoothThrust,
}

impl Candidate {
    /// All of them.
    pub const ALL: [Self; 26] = [
        Self::Lag,
        Self::Delay,
        Self::ReverseRatio,
        Self::Current,
        Self::Inflow,
        Self::Lever,
        Self::LinearDrag,
        Self::Bias,
        Self::Turning,
        Self::LagRatio,
        Self::FallingLagRatio,
        Self::Slew,
        Self::InflowAhead,
        Self::Exponent,
        Self::DeadBand,
        Self::ThrustChangeWithin,
        Self::ThrustChangeBetween,
        Self::Voltage,
        Self::VelocityScale,
        Self::SensorLag,
        Self::SensorWindow,
        Self::Swell,
        Self::CurrentDrift,
        Self::ThrustJitter,
        Self::SmoothSpeed,
        Self::SmoothThrust,
    ];

    /// As files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lag => "lag",
            Self::Delay => "delay",
            Self::ReverseRatio => "reverse-ratio",
            Self::Current => "current",
            Self::Inflow => "inflow",
            Self::Lever => "lever",
            Self::LinearDrag => "linear-drag",
            Self::Bias => "bias",
            Self::Turning => "turning",
            Self::LagRatio => "lag-ratio",
            Self::FallingLagRatio => "falling-lag-ratio",
            Self::Slew => "slew",
            Self::InflowAhead => "inflow-ahead",
            Self::Exponent => "exponent",
            Self::DeadBand => "dead-band",
            Self::Voltage => "voltage",
            Self::ThrustChangeWithin => "thrust-change-within",
            Self::ThrustChangeBetween => "thrust-change-between",
            Self::VelocityScale => "velocity-scale",
            Self::SensorLag => "sensor-lag",
            Self::SensorWindow => "sensor-window",
            Self::Swell => "swell",
            Self::CurrentDrift => "current-drift",
            Self::ThrustJitter => "thrust-jitter",
            Self::SmoothSpeed => "smooth-speed",
            Self::SmoothThrust => "smooth-thrust",
        }
    }

    /// Returns whether it can be at all: a rotation knows no current along it.
    pub(super) fn exists_in(self, axes: &[AxisRecord]) -> bool {
        let all = |holds: fn(&AxisRecord) -> bool| axes.iter().all(holds);
        match self {
            // An accelerometer feels the same in every steady current.
            Self::Current | Self::CurrentDrift => {
                all(|axis| !axis.dof.is_rotation() && axis.knows_velocity())
            }
            Self::Lever => all(|axis| axis.lever_rates.is_some() && axis.measures_velocity()),
            Self::Turning => all(|axis| axis.turning.is_some()),
            Self::VelocityScale => all(|axis| axis.believable_position().is_some()),
            Self::SensorLag | Self::SensorWindow => {
                all(|axis| !axis.dof.is_rotation() && axis.measures_velocity())
            }
            // Acceleration alone does not tell what thrust loses with speed from drag.
            Self::Inflow | Self::InflowAhead | Self::Exponent | Self::DeadBand => {
                all(AxisRecord::knows_velocity)
            }
            Self::Voltage => axes.iter().any(AxisRecord::has_supply),
            Self::ThrustChangeBetween => axes.len() > 1,
            Self::SmoothSpeed | Self::SmoothThrust => all(AxisRecord::thrust_is_slow),
            _ => true,
        }
    }

    /// Returns what thrust does between its samples by these candidates.
    pub(crate) fn between_samples(candidates: impl IntoIterator<Item = Self>) -> BetweenSamples {
        let law = |candidate: Self| match candidate {
            Self::SmoothSpeed => Some(BetweenSamples::SmoothSpeed),
            Self::SmoothThrust => Some(BetweenSamples::SmoothThrust),
            _ => None,
        };
        candidates.into_iter().find_map(law).unwrap_or_default()
    }

    /// Returns whether a logged force can do it, of which no propeller is known.
    pub(super) fn is_of_force(self) -> bool {
        self != Self::SmoothSpeed
    }

    /// Returns whether it is a term of the equation of motion, which a user may ask for.
    pub(super) const fn is_term(self) -> bool {
        matches!(self, Self::LinearDrag | Self::Bias)
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
    /// Whether it is part of the model.
    pub admitted: bool,
}
