//! Forces that read what was logged beside motion: of fins, rudders, propellers and wind.

use std::fmt;

use nalgebra::{Matrix6, Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{OpenWater, RudderFlow};

use crate::Surface;
use crate::{Dof, Timed};

/// What an effect reads at an instant.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Signal {
    /// The angle of a rudder or fin, rad.
    Angle {
        /// What it is.
        kind: Surface,
        /// Its name.
        name: String,
    },
    /// How a thruster is driven: its thrust where its curve is known, N; else its speed, rad/s,
    /// or command, as a ratio.
    Drive(String),
    /// How fast the propeller of a thruster turns whose curve is known: n of its thrust k n|n|, rad/s
    /// or in units of its command; the root of thrust if only that is known.
    PropellerSpeed(String),
    /// The thrust of a thruster by its curve, N.
    Thrust(String),
    /// Velocity of the air over ground along the body's x axis, m/s.
    AirForward,
    /// Velocity of the air over ground along the body's y axis, m/s.
    AirStarboard,
}

impl Signal {
    /// Whether a sample holds until the next: of a drive or a propeller; angles and wind go straight.
    pub fn is_held(&self) -> bool {
        matches!(self, Self::Drive(_)) || self.is_of_known_thruster()
    }

    /// Whether it is of a thruster whose curve is known, so that its force is.
    pub(crate) fn is_of_known_thruster(&self) -> bool {
        matches!(self, Self::PropellerSpeed(_) | Self::Thrust(_))
    }

    /// Whether it pushes a vehicle on which no known force acts.
    pub(crate) fn pushes(&self) -> bool {
        matches!(self, Self::Angle { .. } | Self::Drive(_))
    }

    /// Whether it is of wind.
    pub fn is_of_wind(&self) -> bool {
        matches!(self, Self::AirForward | Self::AirStarboard)
    }

    /// Its value at an instant.
    pub(crate) fn value(&self, series: &Timed, t_s: f64) -> f64 {
        if self.is_held() { series.held_at(t_s) } else { series.at(t_s) }
    }
}

impl fmt::Display for Signal {
    /// As messages call it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle { kind, name } => write!(f, "{}.{name}.angle", kind.name()),
            Self::Drive(name) => write!(f, "the drive of thruster `{name}`"),
            Self::PropellerSpeed(name) => write!(f, "the propeller speed of thruster `{name}`"),
            Self::Thrust(name) => write!(f, "the thrust of thruster `{name}`"),
            Self::AirForward | Self::AirStarboard => write!(f, "the wind"),
        }
    }
}

/// A force that one coefficient scales, by its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Effect {
    /// What results call its coefficient: `rudder.lift`, `wind.sway`.
    pub name: String,
    /// What it does.
    pub force: EffectForce,
}

/// A control surface as its force reads it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Foil {
    /// What it is.
    pub kind: Surface,
    /// What channels call it.
    pub name: String,
    /// Where its force acts, m, body frame.
    pub position_m: [f64; 3],
    /// The axis that it turns about, a unit vector.
    pub axis: [f64; 3],
    /// Its stall angle, rad: beyond it, lift grows no more.
    pub stall_rad: Option<f64>,
}

/// What scales with one coefficient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum EffectForce {
    /// A fin in the flow past the hull: `F = −|V| (V·n)` along its normal n, V being its
    /// velocity through the water across its axis; N/(m/s)², equal to ½ρA ∂C_L/∂α.
    Lift {
        /// The fin.
        foil: Foil,
    },
    /// A fin in a propeller's race: `F = T sin δ` along its normal, by positive thrust T.
    Slipstream {
        /// The fin.
        foil: Foil,
        /// The propeller ahead of it.
        propeller: String,
        /// Whether the drive is a speed or command n, so that T is n².
        squared: bool,
    },
    /// What flow and race do together: `F = −|n| (V·n)` along its normal, n being √T.
    Race {
        /// The fin.
        foil: Foil,
        /// The propeller ahead of it.
        propeller: String,
        /// Whether the drive is a speed or command n, so that T is n².
        squared: bool,
    },
    /// A rudder in the race of a propeller whose open-water curve is known: its normal force by
    /// `½ρA ∂C_L/∂α`, N/(m/s)², with what the hull makes of flow and force.
    Steering {
        /// The rudder.
        foil: Foil,
        /// The propeller ahead of it.
        behind: OpenWater,
        /// What hull and race do to its flow.
        flow: RudderFlow,
    },
    /// Thrust by an open-water curve along a direction; 1 less the thrust deduction.
    OpenWater {
        /// The propeller.
        curve: OpenWater,
    },
    /// A propeller of unknown strength: `n|n|` along its direction.
    Thrust {
        /// The propeller.
        propeller: String,
        /// Where it pushes, m.
        position_m: [f64; 3],
        /// The way of positive thrust, a unit vector.
        direction: [f64; 3],
    },
    /// Thrust that a propeller loses by its speed ahead: `−|n| (V·d)` along its direction d.
    Advance {
        /// The propeller.
        propeller: String,
        /// Where it pushes, m.
        position_m: [f64; 3],
        /// The way of positive thrust, a unit vector.
        direction: [f64; 3],
    },
    /// Thrust that all thrusters lose by their speed ahead: `−Σ |n| (w·ν) w`, with w the force and
    /// moment of each for a newton of its thrust.
    Inflow {
        /// The thrusters, at most 16.
        thrusters: Vec<Pusher>,
        /// Whether only of those that push the way they move: none gains where it brakes.
        #[serde(default)]
        ahead: bool,
    },
    /// Thrust of one thruster beyond its curve: `T w`, with T what the curve says and w force and
    /// moment for a newton of thrust, so that the coefficient is the gain less 1.
    Gain {
        /// The thruster.
        thruster: Pusher,
        /// Whether only of thrust below zero.
        reverse: bool,
    },
    /// What a propeller does otherwise when it turns astern: `n|n|` of negative n along a unit
    /// force and moment, N and N m.
    Astern {
        /// The propeller.
        propeller: String,
        /// Force and moment by axis.
        way: [f64; 6],
    },
    /// Wind: `½ρ_a A |w| w_x` in surge, `½ρ_a A |w| w_y` in sway, `½ρ_a A L |w| w_y` in yaw, w
    /// being the air's velocity past the vehicle.
    Wind {
        /// On which axis.
        on: Dof,
        /// `½ρ_a A`, or `½ρ_a A L` in yaw; 1 if areas are not known.
        scale: f64,
    },
    /// What wind on bow or quarter does in yaw: `½ρ_a A L w_x w_y`.
    WindAcross {
        /// `½ρ_a A L`; 1 if areas are not known.
        scale: f64,
    },
}

/// A thruster as inflow acts on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pusher {
    /// What channels call it.
    pub name: String,
    /// Where it pushes, m.
    pub position_m: [f64; 3],
    /// The way of positive thrust, a unit vector.
    pub direction: [f64; 3],
}

impl Pusher {
    /// w, force and moment for a newton of thrust.
    pub(crate) fn way(&self) -> Vector6<f64> {
        at_place(&self.position_m.into(), &self.direction.into())
    }
}

/// An effect reads no more signals than this.
pub(crate) const MOST_READ: usize = 16;

/// A foil at an instant.
struct Flow {
    /// `[n; r × n]` of its normal.
    normal: Vector6<f64>,
    /// `[V; r × V]` of its velocity across its axis.
    across: Vector6<f64>,
    /// |V|.
    speed: f64,
    /// V·n.
    along_normal: f64,
    /// sin δ.
    sin: f64,
}

impl Foil {
    /// Its chord and its normal when it is not turned, unit vectors.
    pub(super) fn directions(&self) -> (Vector3<f64>, Vector3<f64>) {
        let axis = Vector3::from(self.axis);
        let chord = Vector3::x() - axis * axis.x;
        let chord = chord.try_normalize(1e-6).unwrap_or_else(Vector3::x);
        (chord, axis.cross(&chord))
    }

    fn at(&self, velocity: &Vector6<f64>, angle: f64) -> Flow {
        let (r, axis) = (Vector3::from(self.position_m), Vector3::from(self.axis));
        let (chord, side) = self.directions();
        let (sin, cos) = angle.sin_cos();
        let normal = side * cos - chord * sin;
        let own = velocity.fixed_rows::<3>(0) + velocity.fixed_rows::<3>(3).cross(&r);
        let own = Vector3::new(own.x, own.y, own.z);
        let across = own - axis * own.dot(&axis);
        Flow {
            normal: at_place(&r, &normal),
            across: at_place(&r, &across),
            speed: across.norm(),
            along_normal: own.dot(&normal),
            sin,
        }
    }
}

impl Flow {
    /// `−|V| (V·n)`, the part along the normal being no more than that at the stall angle; and
    /// its slope by ν.
    fn lift(&self, stall_rad: Option<f64>) -> (f64, Vector6<f64>) {
        let most = stall_rad.map_or(f64::INFINITY, |stall| stall.sin() * self.speed);
        if self.along_normal.abs() > most {
            let part = most.copysign(self.along_normal) / self.speed.max(f64::MIN_POSITIVE);
            return (-part * self.speed * self.speed, self.across * (-2.0 * part));
        }
        let by_speed = self.along_normal / self.speed.max(SLOW);
        let slope = -(self.across * by_speed + self.normal * self.speed);
        (-self.speed * self.along_normal, slope)
    }
}

/// Below this a foil's direction of flow is not told, m/s.
const SLOW: f64 = 1e-9;

/// `[f; r × f]`.
pub(super) fn at_place(r: &Vector3<f64>, force: &Vector3<f64>) -> Vector6<f64> {
    let moment = r.cross(force);
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

impl Effect {
    /// What it reads, in the order in which [`Self::wrench`] takes it.
    pub fn signals(&self) -> Vec<Signal> {
        let angle = |foil: &Foil| Signal::Angle { kind: foil.kind, name: foil.name.clone() };
        match &self.force {
            EffectForce::Lift { foil } => vec![angle(foil)],
            EffectForce::Slipstream { foil, propeller, .. }
            | EffectForce::Race { foil, propeller, .. } => {
                vec![angle(foil), Signal::Drive(propeller.clone())]
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
            EffectForce::Wind { .. } | EffectForce::WindAcross { .. } => {
                vec![Signal::AirForward, Signal::AirStarboard]
            }
        }
    }

    /// The force and moment that a coefficient of one makes on the vehicle, and `∂/∂ν` of it;
    /// shapes (6,) and (6, 6).
    ///
    /// `signals` are the values of [`Self::signals`]; one that is missing is zero.
    pub fn wrench(&self, velocity: &Vector6<f64>, signals: &[f64]) -> (Vector6<f64>, Matrix6<f64>) {
        let along = |way: &Vector6<f64>, force: f64, slope: Vector6<f64>| {
            (way * force, way * slope.transpose())
        };
        let [first, second] = [0, 1].map(|k| signals.get(k).copied().unwrap_or(0.0));
        match &self.force {
            EffectForce::Lift { foil } => {
                let flow = foil.at(velocity, first);
                let (force, slope) = flow.lift(foil.stall_rad);
                along(&flow.normal, force, slope)
            }
            EffectForce::Slipstream { foil, squared, .. } => {
                let flow = foil.at(velocity, first);
                let drive = second.max(0.0);
                let thrust = if *squared { drive * drive } else { drive };
                along(&flow.normal, thrust * flow.sin, Vector6::zeros())
            }
            EffectForce::Race { foil, squared, .. } => {
                let flow = foil.at(velocity, first);
                let drive = second.max(0.0);
                let speed = if *squared { drive } else { drive.sqrt() };
                along(&flow.normal, -speed * flow.along_normal, flow.normal * -speed)
            }
            EffectForce::Steering { foil, behind, flow } => {
                let (way, force, slope) = flow.force(foil, behind, velocity, [first, second]);
                along(&way, force, slope)
            }
            EffectForce::OpenWater { curve } => {
                let way = at_place(&curve.position_m.into(), &curve.direction.into());
                let (inflow, by) = curve.inflow(velocity);
                let (thrust, slope) = curve.thrust(inflow, first);
                along(&way, thrust, by * slope)
            }
            EffectForce::Thrust { position_m, direction, .. } => {
                let way = at_place(&(*position_m).into(), &(*direction).into());
                along(&way, first * first.abs(), Vector6::zeros())
            }
            EffectForce::Advance { position_m, direction, .. } => {
                let way = at_place(&(*position_m).into(), &(*direction).into());
                along(&way, -first.abs() * way.dot(velocity), way * -first.abs())
            }
            EffectForce::Inflow { thrusters, ahead } => {
                let mut slope = Matrix6::zeros();
                for (thruster, speed) in thrusters.iter().zip(signals) {
                    let way = thruster.way();
                    if !ahead || speed * way.dot(velocity) > 0.0 {
                        slope -= way * (way.transpose() * speed.abs());
                    }
                }
                (slope * velocity, slope)
            }
            EffectForce::Gain { thruster, reverse } => {
                let thrust = if *reverse { first.min(0.0) } else { first };
                along(&thruster.way(), thrust, Vector6::zeros())
            }
            EffectForce::Astern { way, .. } => {
                let astern = first.min(0.0);
                along(&Vector6::from(*way), astern * astern.abs(), Vector6::zeros())
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

    /// The unit of its coefficient.
    pub fn unit(&self) -> &'static str {
        match &self.force {
            EffectForce::Lift { .. } | EffectForce::Steering { .. } => "N/(m/s)²",
            EffectForce::OpenWater { .. } | EffectForce::Gain { .. } => "1",
            EffectForce::Slipstream { squared: false, .. } => "1",
            EffectForce::Slipstream { .. } => "N/(rad/s)²",
            EffectForce::Race { squared: false, .. } => "√N/(m/s)",
            EffectForce::Race { .. } => "N/((m/s)(rad/s))",
            EffectForce::Thrust { .. } | EffectForce::Astern { .. } => "N/(rad/s)²",
            EffectForce::Advance { .. } => "N/((m/s)(rad/s))",
            // n as the curve of the thruster reads it.
            EffectForce::Inflow { .. } => "N/((m/s) n)",
            EffectForce::Wind { scale, on } if *scale == 1.0 && *on == Dof::Yaw => "N m/(m/s)²",
            EffectForce::WindAcross { scale } if *scale == 1.0 => "N m/(m/s)²",
            EffectForce::Wind { scale, .. } if *scale == 1.0 => "N/(m/s)²",
            EffectForce::Wind { .. } | EffectForce::WindAcross { .. } => "1",
        }
    }

    /// The axes on which it acts.
    pub fn axes(&self) -> Vec<Dof> {
        let acts = |way: &Vector6<f64>| {
            Dof::ALL.into_iter().filter(|dof| way[dof.index()].abs() > NO_LEVER).collect()
        };
        match &self.force {
            EffectForce::Lift { foil }
            | EffectForce::Steering { foil, .. }
            | EffectForce::Slipstream { foil, .. }
            | EffectForce::Race { foil, .. } => {
                let straight = foil.at(&Vector6::zeros(), 0.0).normal;
                let turned = foil.at(&Vector6::zeros(), 0.1).normal;
                acts(&(straight.abs() + turned.abs()))
            }
            EffectForce::Thrust { position_m, direction, .. }
            | EffectForce::Advance { position_m, direction, .. } => {
                acts(&at_place(&(*position_m).into(), &(*direction).into()))
            }
            EffectForce::Astern { way, .. } => acts(&Vector6::from(*way)),
            EffectForce::Gain { thruster, .. } => acts(&thruster.way()),
            EffectForce::Inflow { thrusters, .. } => {
                acts(&thrusters.iter().map(|own| own.way().abs()).sum())
            }
            EffectForce::OpenWater { curve } => {
                acts(&at_place(&curve.position_m.into(), &curve.direction.into()))
            }
            EffectForce::Wind { on, .. } => vec![*on],
            EffectForce::WindAcross { .. } => vec![Dof::Yaw],
        }
    }

    /// Whether a coefficient below zero is impossible: of a fin, which takes power out of its
    /// flow, and of a propeller, but for what it does otherwise astern or beyond its curve.
    pub fn is_positive(&self) -> bool {
        !matches!(
            self.force,
            EffectForce::Wind { .. }
                | EffectForce::WindAcross { .. }
                | EffectForce::Astern { .. }
                | EffectForce::Gain { .. }
        )
    }

    /// The standard deviation of its coefficient before anything is measured, where it is known to
    /// be small: of the gain of a thruster, whose curve is measured or comes from its maker.
    pub(crate) fn prior_std(&self) -> Option<f64> {
        matches!(self.force, EffectForce::Gain { .. }).then_some(GAIN_STD)
    }
}

/// Standard deviation of the gain of a thruster about 1: between two of one kind 5 to 10 % are usual,
/// and one that is fouled or stands still is not ruled out.
const GAIN_STD: f64 = 0.3;

/// A lever below a micrometre is the rounding of a rotated position.
const NO_LEVER: f64 = 1e-6;

fn unit(on: Dof) -> Vector6<f64> {
    let mut unit = Vector6::zeros();
    unit[on.index()] = 1.0;
    unit
}

/// A slope by the air's velocity is one by the vehicle's, turned round.
fn air_slope(by_x: f64, by_y: f64) -> Vector6<f64> {
    Vector6::new(-by_x, -by_y, 0.0, 0.0, 0.0, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::WakeByDrift;

    /// Central differences over 1e-6 of numbers of order one to ten.
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

    fn effect(force: EffectForce) -> Effect {
        Effect { name: "it".into(), force }
    }

    #[test]
    fn a_fin_is_tied_to_its_derivatives_as_prestero_has_them() {
        // Y_uuδ = 9.64: N_uuδ = −6.15, Y_uv = −9.64, Y_ur = 6.15, N_uv = 6.15, N_ur = −3.92.
        let lift = effect(EffectForce::Lift { foil: foil([0.0, 0.0, 1.0], None) });
        let at = |v: f64, r: f64, angle: f64| {
            9.64 * lift.wrench(&Vector6::new(1.0, v, 0.0, 0.0, 0.0, r), &[angle, 0.0]).0
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
    fn a_stern_plane_pushes_along_the_vertical_axis() {
        // Turned about +y, its trailing edge goes down: the stern is pushed up, the bow down.
        let lift = effect(EffectForce::Lift { foil: foil([0.0, 1.0, 0.0], None) });
        let wrench = lift.wrench(&Vector6::new(2.0, 0.0, 0.0, 0.0, 0.0, 0.0), &[0.1, 0.0]).0;
        assert!(wrench[2] < 0.0 && wrench[4] < 0.0 && wrench[1].abs() < 1e-12, "{wrench}");
        assert_eq!(lift.axes(), [Dof::Surge, Dof::Heave, Dof::Pitch]);
    }

    #[test]
    fn a_fin_takes_power_out_of_every_motion() {
        let lift = effect(EffectForce::Lift { foil: foil([0.0, 0.0, 1.0], Some(0.3)) });
        for k in 0..50 {
            let x = |j: f64| (1.7 * f64::from(k) + j).sin();
            let velocity = Vector6::new(x(0.0), x(1.0), x(2.0), x(3.0), x(4.0), x(5.0));
            assert!(lift.wrench(&velocity, &[x(6.0), 0.0]).0.dot(&velocity) <= 1e-15);
        }
    }

    #[test]
    fn inflow_takes_thrust_along_each_thruster_and_power_out_of_every_motion() {
        let starboard = Pusher {
            name: "starboard".into(),
            position_m: [0.0, 0.3, 0.0],
            direction: [1.0, 0.0, 0.0],
        };
        let of = |ahead| effect(EffectForce::Inflow { thrusters: vec![starboard.clone()], ahead });
        let inflow = of(false);
        // 0.3 m to starboard, a turn of 1 rad/s takes 0.3 m/s of 0.5 m/s away.
        let velocity = Vector6::new(0.5, 0.0, 0.0, 0.0, 0.0, 1.0);
        let wrench = inflow.wrench(&velocity, &[-20.0]).0;
        let expected = Vector6::new(-20.0 * 0.2, 0.0, 0.0, 0.0, 0.0, 0.3 * 20.0 * 0.2);
        assert!((wrench - expected).amax() < 1e-12, "{wrench}");
        assert!(wrench.dot(&velocity) < 0.0);
        assert_eq!(inflow.axes(), [Dof::Surge, Dof::Yaw]);
        // One that brakes gains nothing.
        let ahead = of(true);
        assert_eq!(ahead.wrench(&velocity, &[-20.0]).0, Vector6::zeros());
        assert_eq!(ahead.wrench(&velocity, &[20.0]), inflow.wrench(&velocity, &[20.0]));
        assert_eq!(ahead.wrench(&-velocity, &[-20.0]), inflow.wrench(&-velocity, &[-20.0]));
    }

    #[test]
    fn a_gain_scales_the_thrust_of_one_thruster() {
        let starboard = || Pusher {
            name: "starboard".into(),
            position_m: [0.0, 0.3, 0.0],
            direction: [1.0, 0.0, 0.0],
        };
        let of = |reverse, thrust: f64| {
            let gain = effect(EffectForce::Gain { thruster: starboard(), reverse });
            gain.wrench(&Vector6::repeat(1.0), &[thrust]).0
        };
        let expected = Vector6::new(-20.0, 0.0, 0.0, 0.0, 0.0, 6.0);
        assert!((of(false, -20.0) - expected).amax() < 1e-12);
        assert!((of(true, -20.0) - expected).amax() < 1e-12);
        assert!((of(false, 20.0) + expected).amax() < 1e-12);
        assert_eq!(of(true, 20.0), Vector6::zeros());
    }

    #[test]
    fn slopes_are_those_of_the_wrench() {
        let place = ([-0.7, 0.2, 0.1], [0.8, 0.6, 0.0]);
        let (position_m, direction) = place;
        let propeller = || "propeller".to_owned();
        let pusher = |name: &str| Pusher { name: name.into(), position_m, direction };
        let foils = || foil([0.0, 0.6, 0.8], None);
        let forces = [
            EffectForce::Lift { foil: foils() },
            EffectForce::Lift { foil: foil([0.0, 0.0, 1.0], Some(0.05)) },
            EffectForce::Slipstream { foil: foils(), propeller: propeller(), squared: true },
            EffectForce::Steering { foil: foils(), behind: open_water(), flow: flow() },
            EffectForce::Steering {
                foil: foil([0.0, 0.0, 1.0], Some(0.05)),
                behind: open_water(),
                flow: flow(),
            },
            EffectForce::OpenWater { curve: open_water() },
            EffectForce::Race { foil: foils(), propeller: propeller(), squared: false },
            EffectForce::Thrust { propeller: propeller(), position_m, direction },
            EffectForce::Advance { propeller: propeller(), position_m, direction },
            EffectForce::Inflow { thrusters: vec![pusher("a"), pusher("b")], ahead: false },
            EffectForce::Inflow { thrusters: vec![pusher("a"), pusher("b")], ahead: true },
            EffectForce::Gain { thruster: pusher("a"), reverse: false },
            EffectForce::Astern { propeller: propeller(), way: [0.0, 1.0, 0.0, 0.0, 0.0, -0.7] },
            EffectForce::Wind { on: Dof::Surge, scale: 0.3 },
            EffectForce::Wind { on: Dof::Yaw, scale: 0.3 },
            EffectForce::WindAcross { scale: 0.3 },
        ];
        let velocity = Vector6::new(1.5, 0.2, -0.1, 0.3, 0.1, 0.2);
        for force in forces {
            let effect = effect(force);
            let signals = if effect.signals().len() == 1 { [0.2, 0.0] } else { [0.2, 3.0] };
            let slope = effect.wrench(&velocity, &signals).1;
            for j in 0..6 {
                let at = |step: f64| {
                    let mut moved = velocity;
                    moved[j] += step;
                    effect.wrench(&moved, &signals).0
                };
                let found = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((found - slope.column(j)).amax() < DIFFERENCE, "{effect:?} by {j}");
            }
        }
    }
}
