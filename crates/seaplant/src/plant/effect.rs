//! Forces that depend on logged signals as well as motion: of fins, rudders, propellers and wind.

use std::fmt;

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::foil::{Foil, PropellerAhead};
use super::{OpenWater, RudderFlow};
use crate::{Dof, Surface, Timed};

/// An input signal of an effect.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Signal {
    /// The angle of a rudder or fin, rad.
    Angle {
        /// The type of surface.
        kind: Surface,
        /// Its name.
        name: String,
    },
    /// Input of a thruster: its thrust if its curve is known, N; otherwise its speed, rad/s, or
    /// command, as a ratio.
    Drive(String),
    /// Propeller speed of a thruster with a known curve: n of its thrust k n|n|, rad/s or in units
    /// of its command; the root of thrust if only that is known.
    PropellerSpeed(String),
    /// The thrust of a thruster by its curve, N.
    Thrust(String),
    /// Change of the thrust of a thruster with a number of its own beyond that of all, N per unit.
    ThrustBy {
        /// The number.
        number: ThrusterNumber,
        /// Name of the thruster.
        thruster: String,
    },
    /// Velocity of the air over ground along the body's x axis, m/s.
    AirForward,
    /// Velocity of the air over ground along the body's y axis, m/s.
    AirStarboard,
}

impl Signal {
    /// Returns whether a sample is held until the next, as for thrusters; angles and wind are
    /// linear.
    pub fn is_held(&self) -> bool {
        matches!(self, Self::Drive(_)) || self.is_of_known_thruster()
    }

    /// Returns whether it belongs to a thruster with a known curve, and thus a known force.
    pub(crate) fn is_of_known_thruster(&self) -> bool {
        matches!(self, Self::PropellerSpeed(_) | Self::Thrust(_) | Self::ThrustBy { .. })
    }

    /// Returns whether it is an input of a vehicle without known forces.
    pub(crate) fn pushes(&self) -> bool {
        matches!(self, Self::Angle { .. } | Self::Drive(_))
    }

    /// Returns whether it is a component of wind.
    pub fn is_of_wind(&self) -> bool {
        matches!(self, Self::AirForward | Self::AirStarboard)
    }

    /// Returns its value at an instant.
    pub(crate) fn value(&self, series: &Timed, t_s: f64) -> f64 {
        if self.is_held() { series.held_at(t_s) } else { series.at(t_s) }
    }
}

impl fmt::Display for Signal {
    /// Formats the signal as in messages.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle { kind, name } => write!(f, "{}.{name}.angle", kind.name()),
            Self::Drive(name) => write!(f, "the drive of thruster `{name}`"),
            Self::PropellerSpeed(name) => write!(f, "the propeller speed of thruster `{name}`"),
            Self::Thrust(name) => write!(f, "the thrust of thruster `{name}`"),
            Self::ThrustBy { number, thruster } => {
                write!(f, "the {} of thruster `{thruster}`", number.name())
            }
            Self::AirForward | Self::AirStarboard => write!(f, "the wind"),
        }
    }
}

/// A number that a thruster may have of its own, beside that of all.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum ThrusterNumber {
    /// First-order lag of propeller speed, s.
    Lag,
    /// Part of full speed below which it does not turn.
    DeadBand,
}

impl ThrusterNumber {
    /// All of them.
    pub(crate) const ALL: [Self; 2] = [Self::Lag, Self::DeadBand];

    /// Returns its name in messages.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Lag => "lag",
            Self::DeadBand => "dead band",
        }
    }

    /// Returns its name in results: `lag` of `port.excess-lag`.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Lag => "lag",
            Self::DeadBand => "dead-band",
        }
    }

    /// Returns its unit.
    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::Lag => "s",
            Self::DeadBand => "1",
        }
    }

    /// Returns its prior standard deviation about that of all: propellers need tenths of a second, and controllers
    /// of motors have dead bands of some percent.
    const fn prior_std(self) -> f64 {
        match self {
            Self::Lag => 0.2,
            Self::DeadBand => 0.05,
        }
    }
}

/// A named force that is proportional to one coefficient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Effect {
    /// Name of its coefficient in results: `rudder.lift`, `wind.sway`.
    pub name: String,
    /// The force per unit of the coefficient.
    pub force: EffectForce,
}

/// A force per unit of its coefficient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum EffectForce {
    /// A fin in the flow along the hull: `F = −|V| (V·n)` along its normal n, V being its velocity
    /// through the water perpendicular to its axis; N/(m/s)², equal to ½ρA ∂C_L/∂α.
    ///
    /// Behind a propeller of thrust T it is in its race, whose square along the chord is greater than that of V by
    /// (s/k) T, with k this coefficient and s that of the slipstream; the force is then k of this and s of that.
    Lift {
        /// The fin.
        foil: Foil,
        /// The propeller ahead of it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        propeller_ahead: Option<PropellerAhead>,
    },
    /// A fin in a propeller's slipstream: what the race of positive thrust T adds to the fin's force along its normal
    /// per unit of s, `F = T sin δ` where there is no other flow.
    Slipstream {
        /// The fin.
        foil: Foil,
        /// The propeller ahead of it.
        #[serde(flatten)]
        propeller_ahead: PropellerAhead,
    },
    /// A rudder in the slipstream of a propeller with a known open-water curve: its normal force
    /// per `½ρA ∂C_L/∂α`, N/(m/s)², with the hull's influence on flow and force.
    Steering {
        /// The rudder.
        foil: Foil,
        /// The propeller ahead of it.
        behind: OpenWater,
        /// The influence of hull and slipstream on its inflow.
        flow: RudderFlow,
    },
    /// Thrust by an open-water curve along a direction; the coefficient is 1 − thrust deduction.
    OpenWater {
        /// The propeller.
        curve: OpenWater,
    },
    /// A propeller of unknown strength: `n|n|` along its direction.
    Thrust {
        /// The propeller.
        propeller: String,
        /// Point of application, m.
        position_m: [f64; 3],
        /// Direction of positive thrust, a unit vector.
        direction: [f64; 3],
    },
    /// Loss of a propeller's thrust by speed of advance: `−|n| (V·d)` along its direction d.
    Advance {
        /// The propeller.
        propeller: String,
        /// Point of application, m.
        position_m: [f64; 3],
        /// Direction of positive thrust, a unit vector.
        direction: [f64; 3],
    },
    /// Loss of all thrusters' thrust by speed of advance: `−Σ |n| (w·ν) w`, with w the wrench of
    /// each for one newton of thrust.
    Inflow {
        /// The thrusters, at most 16.
        thrusters: Vec<Pusher>,
        /// True if thrusters lose thrust in their direction of motion only, and gain none when
        /// braking.
        #[serde(default)]
        ahead: bool,
    },
    /// Thrust of one thruster beyond its curve: `T w`, with T the curve's thrust and w the wrench
    /// for one newton, so that the coefficient is the gain less 1.
    Gain {
        /// The thruster.
        thruster: Pusher,
        /// True if it applies to negative thrust only.
        reverse: bool,
    },
    /// Change of thrust of one thruster by a number λ of its own beyond that of all: `g (T(λ) − T(0))/λ w`, so that
    /// the coefficient is λ.
    Own {
        /// The thruster.
        thruster: Pusher,
        /// The number.
        number: ThrusterNumber,
    },
    /// Additional wrench of a propeller that turns astern: `n|n|` of negative n along a unit
    /// wrench, N and N m.
    Astern {
        /// The propeller.
        propeller: String,
        /// The unit wrench by axis.
        way: [f64; 6],
    },
    /// Lift of the hull at a place ahead of or behind the origin: `−|u| (v + x r)` to starboard, or
    /// `−|u| (w − x q)` downward.
    HullLift {
        /// Sway or heave, along which it acts.
        along: Dof,
        /// x of the place, m.
        at_m: f64,
    },
    /// Wind: `½ρ_a A |w| w_x` in surge, `½ρ_a A |w| w_y` in sway, `½ρ_a A L |w| w_y` in yaw, w
    /// being the air's velocity relative to the vehicle.
    Wind {
        /// The axis.
        on: Dof,
        /// `½ρ_a A`, or `½ρ_a A L` in yaw; 1 if areas are not known.
        scale: f64,
    },
    /// Yaw moment of wind on bow or quarter: `½ρ_a A L w_x w_y`.
    WindAcross {
        /// `½ρ_a A L`; 1 if areas are not known.
        scale: f64,
    },
}

/// Position and direction of a thruster, for the computation of inflow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pusher {
    /// Name in channels.
    pub name: String,
    /// Point of application, m.
    pub position_m: [f64; 3],
    /// Direction of positive thrust, a unit vector.
    pub direction: [f64; 3],
}

impl Pusher {
    /// Returns the wrench w for one newton of thrust.
    pub(crate) fn way(&self) -> Vector6<f64> {
        wrench_at(&self.position_m.into(), &self.direction.into())
    }
}

/// Largest number of signals of an effect.
pub(crate) const MOST_READ: usize = 16;

/// Below this speed the direction of flow at a foil is undefined, m/s.
pub(super) const SLOW: f64 = 1e-9;

/// Returns the wrench `[f; r × f]`.
pub(super) fn wrench_at(r: &Vector3<f64>, force: &Vector3<f64>) -> Vector6<f64> {
    let moment = r.cross(force);
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

impl Effect {
    /// Returns its input signals, in the order expected by [`Self::wrench`].
    pub fn signals(&self) -> Vec<Signal> {
        let angle = |foil: &Foil| Signal::Angle { kind: foil.kind, name: foil.name.clone() };
        match &self.force {
            EffectForce::Lift { foil, propeller_ahead: None } => vec![angle(foil)],
            EffectForce::Lift { foil, propeller_ahead: Some(ahead) }
            | EffectForce::Slipstream { foil, propeller_ahead: ahead } => {
                vec![angle(foil), Signal::Drive(ahead.propeller.clone())]
            }
            EffectForce::Steering { foil, behind, .. } => {
                vec![angle(foil), Signal::Drive(behind.propeller.clone())]
            }
            EffectForce::OpenWater { curve, .. } => vec![Signal::Drive(curve.propeller.clone())],
            EffectForce::Thrust { propeller, .. }
            | EffectForce::Advance { propeller, .. }
            | EffectForce::Astern { propeller, .. } => {
                vec![Signal::Drive(propeller.clone())]
            }
            EffectForce::Inflow { thrusters, .. } => {
                thrusters.iter().map(|own| Signal::PropellerSpeed(own.name.clone())).collect()
            }
            EffectForce::Gain { thruster, .. } => vec![Signal::Thrust(thruster.name.clone())],
            EffectForce::Own { thruster, number } => {
                vec![Signal::ThrustBy { number: *number, thruster: thruster.name.clone() }]
            }
            EffectForce::HullLift { .. } => Vec::new(),
            EffectForce::Wind { .. } | EffectForce::WindAcross { .. } => {
                vec![Signal::AirForward, Signal::AirStarboard]
            }
        }
    }

    /// Returns the fin and the propeller of a force in a race.
    pub(crate) fn in_race(&self) -> Option<(&Foil, &PropellerAhead)> {
        match &self.force {
            EffectForce::Lift { foil, propeller_ahead: Some(ahead) }
            | EffectForce::Slipstream { foil, propeller_ahead: ahead } => Some((foil, ahead)),
            _ => None,
        }
    }

    /// Returns the axis along which the lift of a hull acts, and its place, x in m.
    pub(crate) fn hull_lift(&self) -> Option<(Dof, f64)> {
        match self.force {
            EffectForce::HullLift { along, at_m } => Some((along, at_m)),
            _ => None,
        }
    }

    /// Returns the wrench for a unit coefficient, N and N m per unit, shape (6,).
    ///
    /// `velocity` is ν_r, shape (6,); `signals` are the values of [`Self::signals`], and a missing one is zero. Of a fin
    /// in a race, `race` is the coefficient of its slipstream over that of its lift; each is by itself where that is 0.
    pub fn wrench(&self, velocity: &Vector6<f64>, signals: &[f64], race: f64) -> Vector6<f64> {
        let mut wrench = Vector6::zeros();
        self.each_push(velocity, signals, race, |way, force, _| wrench += way * force);
        wrench
    }

    /// Passes on each force that it consists of: its unit wrench, its size, and `∂/∂ν` of that.
    pub(crate) fn each_push(
        &self,
        velocity: &Vector6<f64>,
        signals: &[f64],
        race: f64,
        mut along: impl FnMut(&Vector6<f64>, f64, Vector6<f64>),
    ) {
        let [first, second] = [0, 1].map(|k| signals.get(k).copied().unwrap_or(0.0));
        match &self.force {
            EffectForce::Lift { foil, propeller_ahead: ahead } => {
                let flow = foil.at(velocity, first);
                let (force, slope) = match ahead.as_ref().filter(|_| race > 0.0) {
                    Some(ahead) => foil.in_race(velocity, first, (ahead.thrust(second), race))[0],
                    None => flow.lift(foil.stall_rad),
                };
                along(&flow.normal, force, slope)
            }
            EffectForce::Slipstream { foil, propeller_ahead: ahead } => {
                let (flow, thrust) = (foil.at(velocity, first), ahead.thrust(second));
                let (force, slope) = match race > 0.0 {
                    true => foil.in_race(velocity, first, (thrust, race))[1],
                    false => (thrust * flow.sin, Vector6::zeros()),
                };
                along(&flow.normal, force, slope)
            }
            EffectForce::Steering { foil, behind, flow } => {
                let (way, force, slope) = flow.force(foil, behind, velocity, [first, second]);
                along(&way, force, slope)
            }
            EffectForce::OpenWater { curve } => {
                let way = wrench_at(&curve.position_m.into(), &curve.direction.into());
                let (inflow, by) = curve.inflow(velocity);
                let (thrust, slope) = curve.thrust(inflow, first);
                along(&way, thrust, by * slope)
            }
            EffectForce::Thrust { position_m, direction, .. } => {
                let way = wrench_at(&(*position_m).into(), &(*direction).into());
                along(&way, first * first.abs(), Vector6::zeros())
            }
            EffectForce::Advance { position_m, direction, .. } => {
                let way = wrench_at(&(*position_m).into(), &(*direction).into());
                along(&way, -first.abs() * way.dot(velocity), way * -first.abs())
            }
            EffectForce::Inflow { thrusters, ahead } => {
                for (thruster, speed) in thrusters.iter().zip(signals) {
                    let way = thruster.way();
                    let advance = way.dot(velocity);
                    if !ahead || speed * advance > 0.0 {
                        along(&way, -speed.abs() * advance, way * -speed.abs());
                    }
                }
            }
            EffectForce::Gain { thruster, reverse } => {
                let thrust = if *reverse { first.min(0.0) } else { first };
                along(&thruster.way(), thrust, Vector6::zeros())
            }
            EffectForce::Own { thruster, .. } => along(&thruster.way(), first, Vector6::zeros()),
            EffectForce::Astern { way, .. } => {
                let astern = first.min(0.0);
                along(&Vector6::from(*way), astern * astern.abs(), Vector6::zeros())
            }
            EffectForce::HullLift { along: axis, at_m } => {
                let way = hull_way(*axis, *at_m);
                let (u, across) = (velocity[0], way.dot(velocity));
                let slope = unit(Dof::Surge) * (u.signum() * across) + way * u.abs();
                along(&way, -u.abs() * across, -slope)
            }
            EffectForce::Wind { on, scale } => {
                let (x, y) = (first - velocity[0], second - velocity[1]);
                let speed = x.hypot(y).max(SLOW);
                let (force, by_x, by_y) = match on {
                    Dof::Surge => (speed * x, speed + x * x / speed, x * y / speed),
                    _ => (speed * y, x * y / speed, speed + y * y / speed),
                };
                along(&unit(*on), scale * force, air_slope(scale * by_x, scale * by_y))
            }
            EffectForce::WindAcross { scale } => {
                let (x, y) = (first - velocity[0], second - velocity[1]);
                along(&unit(Dof::Yaw), scale * x * y, air_slope(scale * y, scale * x))
            }
        }
    }

    /// Returns the unit of its coefficient.
    pub fn unit(&self) -> &'static str {
        match &self.force {
            EffectForce::Lift { .. }
            | EffectForce::Steering { .. }
            | EffectForce::HullLift { .. } => "N/(m/s)²",
            EffectForce::OpenWater { .. } | EffectForce::Gain { .. } => "1",
            EffectForce::Own { number, .. } => number.unit(),
            EffectForce::Slipstream { propeller_ahead, .. } if !propeller_ahead.squared => "1",
            EffectForce::Slipstream { .. } => "N/(rad/s)²",
            EffectForce::Thrust { .. } | EffectForce::Astern { .. } => "N/(rad/s)²",
            EffectForce::Advance { .. } => "N/((m/s)(rad/s))",
            // n has the unit of the thruster's curve.
            EffectForce::Inflow { .. } => "N/((m/s) n)",
            EffectForce::Wind { scale, on } if *scale == 1.0 && *on == Dof::Yaw => "N m/(m/s)²",
            EffectForce::WindAcross { scale } if *scale == 1.0 => "N m/(m/s)²",
            EffectForce::Wind { scale, .. } if *scale == 1.0 => "N/(m/s)²",
            EffectForce::Wind { .. } | EffectForce::WindAcross { .. } => "1",
        }
    }

    /// Returns the axes on which it acts.
    pub fn axes(&self) -> Vec<Dof> {
        let acts = |way: &Vector6<f64>| {
            Dof::ALL.into_iter().filter(|dof| way[dof.index()].abs() > NO_LEVER).collect()
        };
        match &self.force {
            EffectForce::Lift { foil, .. }
            | EffectForce::Steering { foil, .. }
            | EffectForce::Slipstream { foil, .. } => {
                let straight = foil.at(&Vector6::zeros(), 0.0).normal;
                let turned = foil.at(&Vector6::zeros(), 0.1).normal;
                acts(&(straight.abs() + turned.abs()))
            }
            EffectForce::Thrust { position_m, direction, .. }
            | EffectForce::Advance { position_m, direction, .. } => {
                acts(&wrench_at(&(*position_m).into(), &(*direction).into()))
            }
            EffectForce::Astern { way, .. } => acts(&Vector6::from(*way)),
            EffectForce::Gain { thruster, .. } | EffectForce::Own { thruster, .. } => {
                acts(&thruster.way())
            }
            EffectForce::Inflow { thrusters, .. } => {
                acts(&thrusters.iter().map(|own| own.way().abs()).sum())
            }
            EffectForce::OpenWater { curve } => {
                acts(&wrench_at(&curve.position_m.into(), &curve.direction.into()))
            }
            EffectForce::HullLift { along, at_m } => acts(&hull_way(*along, *at_m)),
            EffectForce::Wind { on, .. } => vec![*on],
            EffectForce::WindAcross { .. } => vec![Dof::Yaw],
        }
    }

    /// Returns whether a negative coefficient is impossible: for a fin or hull, which takes power out of
    /// its flow, and for a propeller, except for its difference astern or from its curve.
    pub fn is_positive(&self) -> bool {
        !matches!(
            self.force,
            EffectForce::Wind { .. }
                | EffectForce::WindAcross { .. }
                | EffectForce::Astern { .. }
                | EffectForce::Gain { .. }
                | EffectForce::Own { .. }
        )
    }

    /// Returns the prior standard deviation of its coefficient, if it is known to be small: for the
    /// gain of a thruster, whose curve was measured by its user or maker, and for numbers of its own.
    pub(crate) fn prior_std(&self) -> Option<f64> {
        match self.force {
            EffectForce::Gain { .. } => Some(GAIN_STD),
            EffectForce::Own { number, .. } => Some(number.prior_std()),
            _ => None,
        }
    }
}

/// Prior standard deviation of a thruster's gain about 1: 5 to 10 % are common between two of one
/// type, and a fouled or dead one is possible.
const GAIN_STD: f64 = 0.3;

/// A lever arm below a micrometre is the rounding of a rotated position.
const NO_LEVER: f64 = 1e-6;

fn unit(on: Dof) -> Vector6<f64> {
    let mut unit = Vector6::zeros();
    unit[on.index()] = 1.0;
    unit
}

/// Returns the wrench of a force to starboard at a place ahead of the origin; also its velocity by the vehicle's.
pub(crate) fn hull_way(along: Dof, at_m: f64) -> Vector6<f64> {
    let direction = if along == Dof::Heave { Vector3::z() } else { Vector3::y() };
    wrench_at(&Vector3::new(at_m, 0.0, 0.0), &direction)
}

/// Converts a derivative by the air's velocity to one by the vehicle's.
fn air_slope(by_x: f64, by_y: f64) -> Vector6<f64> {
    Vector6::new(-by_x, -by_y, 0.0, 0.0, 0.0, 0.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;

    use super::*;
    use crate::plant::WakeByDrift;

    /// Error of central differences over 1e-6 of numbers of order one to ten.
    const DIFFERENCE: f64 = 1e-7;

    fn foil(axis: [f64; 3], stall_rad: Option<f64>) -> Foil {
        let position_m = [-0.638, 0.0, 0.0];
        Foil { kind: Surface::Rudder, name: "rudder".into(), position_m, axis, stall_rad }
    }

    fn open_water() -> OpenWater {
        OpenWater {
            propeller: "propeller".into(),
            position_m: [-0.7, 0.2, 0.1],
            direction: [0.8, 0.6, 0.0],
            diameter_m: 4.0,
            k_t: [0.3, -0.25, -0.15],
            wake: 0.4,
            wake_by_drift: Some(WakeByDrift { rate: 2.0, greatest: [1.1, 1.6] }),
            density_kg_m3: 1.0,
        }
    }

    fn flow() -> RudderFlow {
        RudderFlow {
            wake_ratio: 1.1,
            race_factor: 0.5,
            diameter_to_span: 0.6,
            straightening: [0.4, 0.6],
            flow_at_m: -0.9,
            steering_deduction: 0.4,
            hull_increase: 0.3,
            hull_at_m: -0.6,
        }
    }

    /// Returns `∂/∂ν` of the wrench.
    fn slope(effect: &Effect, velocity: &Vector6<f64>, signals: &[f64]) -> Matrix6<f64> {
        let mut slope = Matrix6::zeros();
        effect.each_push(velocity, signals, 0.0, |way, _, by| slope += way * by.transpose());
        slope
    }

    fn effect(force: EffectForce) -> Effect {
        Effect { name: "it".into(), force }
    }

    #[test]
    fn fin_derivatives_agree_with_prestero() {
        // Y_uuδ = 9.64: N_uuδ = −6.15, Y_uv = −9.64, Y_ur = 6.15, N_uv = 6.15, N_ur = −3.92.
        let lift =
            effect(EffectForce::Lift { foil: foil([0.0, 0.0, 1.0], None), propeller_ahead: None });
        let at = |v: f64, r: f64, angle: f64| {
            9.64 * lift.wrench(&Vector6::new(1.0, v, 0.0, 0.0, 0.0, r), &[angle, 0.0], 0.0)
        };
        let small = 1e-4;
        let found = [at(0.0, 0.0, small), at(small, 0.0, 0.0), at(0.0, small, 0.0)];
        let parts = found.map(|wrench| [wrench[1] / small, wrench[5] / small]);
        let expected = [[9.64, -6.15], [-9.64, 6.15], [6.15, -3.92]];
        for (found, expected) in parts.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 5e-3, "{parts:?}");
        }
    }

    #[test]
    fn lift_of_the_hull_by_turning_equals_its_moment_by_drift() {
        // A place aft moves to starboard where the bow turns to port, and down where the bow rises.
        for (along, turns, sign) in [(Dof::Sway, Dof::Yaw, 1.0), (Dof::Heave, Dof::Pitch, -1.0)] {
            let lift = effect(EffectForce::HullLift { along, at_m: -0.6 });
            let at = |u: f64, across: f64, rate: f64| {
                let mut velocity = Vector6::zeros();
                velocity[0] = u;
                (velocity[along.index()], velocity[turns.index()]) = (across, sign * rate);
                let wrench = lift.wrench(&velocity, &[], 0.0);
                [wrench[along.index()], sign * wrench[turns.index()]]
            };
            let close = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
                assert!((a - c).hypot(b - d) < 1e-12, "{along}: {a} {b}, not {c} {d}");
            };
            close(at(2.0, 1.0, 0.0), [-2.0, 1.2]);
            close(at(2.0, 0.0, 1.0), [1.2, -0.72]);
            // It takes power astern, too.
            close(at(-2.0, 1.0, 0.0), [-2.0, 1.2]);
            assert_eq!(lift.axes(), [along, turns]);
        }
    }

    #[test]
    fn a_stern_plane_acts_along_the_vertical_axis() {
        // A rotation about +y lowers the trailing edge: the force on the stern is upward.
        let lift =
            effect(EffectForce::Lift { foil: foil([0.0, 1.0, 0.0], None), propeller_ahead: None });
        let wrench = lift.wrench(&Vector6::new(2.0, 0.0, 0.0, 0.0, 0.0, 0.0), &[0.1, 0.0], 0.0);
        assert!(wrench[2] < 0.0 && wrench[4] < 0.0 && wrench[1].abs() < 1e-12, "{wrench}");
        assert_eq!(lift.axes(), [Dof::Surge, Dof::Heave, Dof::Pitch]);
    }

    #[test]
    fn a_fin_dissipates_power_in_every_motion() {
        let lift = effect(EffectForce::Lift {
            foil: foil([0.0, 0.0, 1.0], Some(0.3)),
            propeller_ahead: None,
        });
        for k in 0..50 {
            let x = |j: f64| (1.7 * f64::from(k) + j).sin();
            let velocity = Vector6::new(x(0.0), x(1.0), x(2.0), x(3.0), x(4.0), x(5.0));
            assert!(lift.wrench(&velocity, &[x(6.0), 0.0], 0.0).dot(&velocity) <= 1e-15);
        }
    }

    #[test]
    fn inflow_reduces_thrust_along_each_thruster_and_dissipates_power() {
        let starboard = Pusher {
            name: "starboard".into(),
            position_m: [0.0, 0.3, 0.0],
            direction: [1.0, 0.0, 0.0],
        };
        let inflow_effect =
            |ahead| effect(EffectForce::Inflow { thrusters: vec![starboard.clone()], ahead });
        let inflow = inflow_effect(false);
        // 0.3 m to starboard, 1 rad/s reduces the advance of 0.5 m/s by 0.3 m/s.
        let velocity = Vector6::new(0.5, 0.0, 0.0, 0.0, 0.0, 1.0);
        let wrench = inflow.wrench(&velocity, &[-20.0], 0.0);
        let expected = Vector6::new(-20.0 * 0.2, 0.0, 0.0, 0.0, 0.0, 0.3 * 20.0 * 0.2);
        assert!((wrench - expected).amax() < 1e-12, "{wrench}");
        assert!(wrench.dot(&velocity) < 0.0);
        assert_eq!(inflow.axes(), [Dof::Surge, Dof::Yaw]);
        // A thruster that brakes gains no thrust.
        let ahead = inflow_effect(true);
        assert_eq!(ahead.wrench(&velocity, &[-20.0], 0.0), Vector6::zeros());
        assert_eq!(ahead.wrench(&velocity, &[20.0], 0.0), inflow.wrench(&velocity, &[20.0], 0.0));
        assert_eq!(slope(&ahead, &velocity, &[20.0]), slope(&inflow, &velocity, &[20.0]));
        assert_eq!(
            ahead.wrench(&-velocity, &[-20.0], 0.0),
            inflow.wrench(&-velocity, &[-20.0], 0.0)
        );
    }

    #[test]
    fn a_gain_scales_the_thrust_of_one_thruster() {
        let starboard = || Pusher {
            name: "starboard".into(),
            position_m: [0.0, 0.3, 0.0],
            direction: [1.0, 0.0, 0.0],
        };
        let excess = |reverse, thrust: f64| {
            let gain = effect(EffectForce::Gain { thruster: starboard(), reverse });
            gain.wrench(&Vector6::repeat(1.0), &[thrust], 0.0)
        };
        let expected = Vector6::new(-20.0, 0.0, 0.0, 0.0, 0.0, 6.0);
        assert!((excess(false, -20.0) - expected).amax() < 1e-12);
        assert!((excess(true, -20.0) - expected).amax() < 1e-12);
        assert!((excess(false, 20.0) + expected).amax() < 1e-12);
        assert_eq!(excess(true, 20.0), Vector6::zeros());
    }

    #[test]
    fn slopes_are_those_of_the_wrench() {
        let place = ([-0.7, 0.2, 0.1], [0.8, 0.6, 0.0]);
        let (position_m, direction) = place;
        let propeller = || "propeller".to_owned();
        let pusher = |name: &str| Pusher { name: name.into(), position_m, direction };
        let foils = || foil([0.0, 0.6, 0.8], None);
        let forces = [
            EffectForce::Lift { foil: foils(), propeller_ahead: None },
            EffectForce::Lift { foil: foil([0.0, 0.0, 1.0], Some(0.05)), propeller_ahead: None },
            EffectForce::Slipstream {
                foil: foils(),
                propeller_ahead: PropellerAhead { propeller: propeller(), squared: true },
            },
            EffectForce::Steering { foil: foils(), behind: open_water(), flow: flow() },
            EffectForce::Steering {
                foil: foil([0.0, 0.0, 1.0], Some(0.05)),
                behind: open_water(),
                flow: flow(),
            },
            EffectForce::OpenWater { curve: open_water() },
            EffectForce::Thrust { propeller: propeller(), position_m, direction },
            EffectForce::Advance { propeller: propeller(), position_m, direction },
            EffectForce::Inflow { thrusters: vec![pusher("a"), pusher("b")], ahead: false },
            EffectForce::Inflow { thrusters: vec![pusher("a"), pusher("b")], ahead: true },
            EffectForce::Gain { thruster: pusher("a"), reverse: false },
            EffectForce::Astern { propeller: propeller(), way: [0.0, 1.0, 0.0, 0.0, 0.0, -0.7] },
            EffectForce::HullLift { along: Dof::Sway, at_m: -0.7 },
            EffectForce::HullLift { along: Dof::Heave, at_m: 0.4 },
            EffectForce::Wind { on: Dof::Surge, scale: 0.3 },
            EffectForce::Wind { on: Dof::Yaw, scale: 0.3 },
            EffectForce::WindAcross { scale: 0.3 },
        ];
        let velocity = Vector6::new(1.5, 0.2, -0.1, 0.3, 0.1, 0.2);
        for force in forces {
            let effect = effect(force);
            let signals = if effect.signals().len() == 1 { [0.2, 0.0] } else { [0.2, 3.0] };
            let slope = slope(&effect, &velocity, &signals);
            for j in 0..6 {
                let at = |step: f64| {
                    let mut moved = velocity;
                    moved[j] += step;
                    effect.wrench(&moved, &signals, 0.0)
                };
                let found = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((found - slope.column(j)).amax() < DIFFERENCE, "{effect:?} by {j}");
            }
        }
    }
}
