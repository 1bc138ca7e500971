//! Open-loop simulation of a plant.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3, Vector6};

use super::held::held_turn;
use super::{KnownForce, Load, Prepared, body_from_world, interpolated_attitude, known_changes};
use crate::plant::{Plant, Signal};
use crate::quantity::WindFrame;
use crate::series::ROUNDING_S;
use crate::{Dof, Error, Timed};

/// The inputs of a simulation, and the motion of axes outside the plant.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    /// Force and moment on each axis in SNAME order, held between samples, N and N m; zero if
    /// absent.
    pub force: [Option<Timed>; 6],
    /// Velocity of axes outside the plant, m/s and rad/s. If absent, a translation has zero
    /// velocity; a rotation has the rate that holds its angle, or zero if `attitude` has a changing
    /// angle.
    pub velocity: [Option<Timed>; 6],
    /// Roll, pitch and heading, rad; of an angle that the plant's own axes rotate, only the initial
    /// value is used.
    pub attitude: [Option<Timed>; 3],
    /// North and east velocity of the water, m/s.
    pub current: [f64; 2],
    /// Signals of the plant's effects: angles, inputs of propellers, velocity of the air.
    pub signals: BTreeMap<Signal, Timed>,
    /// Wind, instead of velocities of the air among `signals`, if the simulated heading is to
    /// rotate it.
    pub wind: Option<Wind>,
    /// Weights hung on the vehicle and lines with a scale, in the time of the other inputs.
    pub known: Vec<KnownForce>,
}

/// Logged or forecast wind.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    /// Relative to the ground or to the vehicle.
    pub frame: WindFrame,
    /// Its speed, m/s.
    pub speed: Timed,
    /// Direction from which it blows, clockwise from north or from the bow, rad; held between
    /// samples.
    pub from: Timed,
}

impl Wind {
    /// Creates a constant wind.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a speed or direction that is not finite.
    pub fn steady(frame: WindFrame, speed: f64, from: f64) -> Result<Self, Error> {
        let constant = |x: f64| Timed::new("wind", vec![0.0], vec![x]);
        Ok(Self { frame, speed: constant(speed)?, from: constant(from)? })
    }

    /// Returns the velocity of the air along the axes of its frame, opposite to `from`.
    fn at(&self, t: f64) -> Vector3<f64> {
        let (speed, (sin, cos)) = (self.speed.at(t), self.from.held_at(t).sin_cos());
        Vector3::new(-speed * cos, -speed * sin, 0.0)
    }
}

/// Simulated motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulated {
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Velocity over ground in body axes at each, m/s and rad/s, shape (6,).
    pub velocity: Vec<Vector6<f64>>,
    /// Roll, pitch and heading at each, rad.
    pub attitude: Vec<[f64; 3]>,
    /// North, east and down relative to the first instant, m.
    pub position: Vec<Vector3<f64>>,
}

/// Longest step, s.
const STEP_S: f64 = 0.02;

/// Velocity beyond which a simulation has diverged, m/s and rad/s.
const RUNAWAY: f64 = 1e3;

/// Simulates a plant from a velocity at the first of several instants.
///
/// Position, attitude and velocity are integrated by the classical Runge–Kutta method in steps of
/// at most 0.02 s. If the plant has roll, pitch and yaw, attitude is a quaternion; if it has some
/// of them, their Euler angles follow from its rates and the others are those of `inputs`.
///
/// An axis outside the plant does not move by itself: an angle keeps its value, by
/// [`Plant::with_held_angles`], and the velocity of a translation is that of `inputs`.
///
/// `start` is velocity over ground, shape (6,); `time_s` increases.
///
/// # Errors
/// [`Error::Diverged`] if the velocity diverges; [`Error::Plant`] if M is singular, or if `inputs`
/// lack a signal of the plant's effects.
///
/// # Example
/// ```
/// use nalgebra::Vector6;
/// use seaplant::motion::{Inputs, simulate};
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// use seaplant::{Dof, Timed};
/// let surge = Structure::of(&[Dof::Surge], Symmetry::None)?;
/// let plant = Plant::new(surge, vec![100.0, 0.0, 20.0])?;
/// let mut inputs = Inputs::default();
/// inputs.force[0] = Some(Timed::new("thrust", vec![0.0], vec![80.0])?);
/// // Top speed: √(τ/d_Q).
/// let motion = simulate(&plant, &inputs, &Vector6::zeros(), &[0.0, 60.0])?;
/// assert!((motion.velocity[1][0] - 2.0).abs() < 1e-6);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn simulate(
    plant: &Plant,
    inputs: &Inputs,
    start: &Vector6<f64>,
    time_s: &[f64],
) -> Result<Simulated, Error> {
    Run::new(plant, inputs)?.over(start, time_s)
}

/// The simulator.
struct Run<'a> {
    plant: Prepared<6>,
    /// The plant under known forces from each instant, s; `None` from one at which none acts.
    loaded: Vec<(f64, Option<Prepared<6>>)>,
    /// The signals of its effects, in order.
    signals: Vec<(&'a Signal, &'a Timed)>,
    first: Dof,
    inputs: &'a Inputs,
    /// North and east velocity of the water, m/s.
    current: [f64; 2],
    has: [bool; 6],
    /// Rotations with a rate from the plant or the inputs; the angles of others are held.
    turns: [bool; 3],
}

/// State of a simulation, and its derivative.
#[derive(Clone, Copy)]
struct Moved {
    /// Velocity through the water on the plant's axes.
    relative: Vector6<f64>,
    turned: Turned,
    /// North, east and down relative to the start, m.
    position: Vector3<f64>,
}

impl Moved {
    fn plus(self, slope: Self, step: f64) -> Self {
        Self {
            relative: self.relative + slope.relative * step,
            turned: self.turned.plus(slope.turned, step),
            position: self.position + slope.position * step,
        }
    }
}

/// Attitude, or its derivative.
#[derive(Clone, Copy)]
enum Turned {
    /// All rotations are axes of the plant.
    Freely(Quaternion<f64>),
    /// Euler angles, some of which are inputs.
    Partly([f64; 3]),
}

impl Turned {
    fn plus(self, slope: Self, step: f64) -> Self {
        match (self, slope) {
            (Self::Freely(q), Self::Freely(rate)) => Self::Freely(q + rate * step),
            (Self::Partly(x), Self::Partly(rate)) => {
                Self::Partly(std::array::from_fn(|k| x[k] + step * rate[k]))
            }
            (same, _) => same,
        }
    }
}

impl<'a> Run<'a> {
    fn new(plant: &Plant, inputs: &'a Inputs) -> Result<Self, Error> {
        let has = Dof::ALL.map(|dof| plant.axes().contains(&dof));
        let find = |signal: &Signal| {
            inputs.signals.get_key_value(signal).ok_or_else(|| Error::Plant {
                axes: plant.structure().name(),
                reason: format!("its inputs lack {signal}, which it reads; add it"),
            })
        };
        let signals = plant.structure().signals().iter().map(find).collect::<Result<_, _>>()?;
        let (first, current) = (plant.axes()[0], inputs.current);
        let changes = |angle: &Option<Timed>| angle.as_ref().is_some_and(|a| a.values().len() > 1);
        let turns = std::array::from_fn(|k| {
            has[3 + k] || inputs.velocity[3 + k].is_some() || changes(&inputs.attitude[k])
        });
        let under = |from_s: f64| {
            // Loads change at the ends of steps only.
            let load = Load::at(&inputs.known, from_s + ROUNDING_S);
            let loaded = load.map(|load| Prepared::of_six(plant, Some(&load))).transpose()?;
            Ok((from_s, loaded))
        };
        let loaded = known_changes(&inputs.known).into_iter().map(under);
        let loaded = loaded.collect::<Result<_, Error>>()?;
        let plant = Prepared::of_six(plant, None)?;
        Ok(Self { plant, loaded, signals, first, inputs, current, has, turns })
    }

    /// Returns the plant under the known forces at an instant.
    fn plant_at(&self, t: f64) -> &Prepared<6> {
        let begun = self.loaded.partition_point(|(from_s, _)| *from_s <= t);
        let last = begun.checked_sub(1).and_then(|k| self.loaded[k].1.as_ref());
        last.unwrap_or(&self.plant)
    }

    /// Returns the attitude of the inputs at an instant.
    fn turned_at(&self, t: f64) -> Turned {
        let angles = self.inputs.attitude.each_ref().map(|a| interpolated_attitude(a.as_ref(), t));
        if !self.has[3..].iter().all(|has| *has) {
            return Turned::Partly(angles);
        }
        let [roll, pitch, heading] = angles;
        Turned::Freely(*UnitQuaternion::from_euler_angles(roll, pitch, heading).quaternion())
    }

    fn over(&self, start: &Vector6<f64>, time_s: &[f64]) -> Result<Simulated, Error> {
        let mut found = Simulated {
            time_s: time_s.to_vec(),
            velocity: Vec::new(),
            attitude: Vec::new(),
            position: Vec::new(),
        };
        let Some(&first) = time_s.first() else { return Ok(found) };
        let mut moved = self.started(start, first);
        let mut now = first;
        for &until in time_s {
            while now < until {
                let h = self.next_step(now, until);
                moved = self.step(&self.force_at(now + 0.5 * h), moved, now, h);
                if !moved.relative.iter().all(|v| v.abs() < RUNAWAY) {
                    return Err(Error::Diverged { dof: self.first, after_s: now - first });
                }
                now += h;
            }
            found.velocity.push(self.over_ground(&moved, now));
            found.attitude.push(self.angles(moved.turned, now));
            found.position.push(moved.position);
        }
        Ok(found)
    }

    /// Returns the state for a velocity over ground at the inputs' attitude at a time.
    fn started(&self, start: &Vector6<f64>, t: f64) -> Moved {
        let turned = self.turned_at(t);
        let relative = self.on_own(start - self.water(turned, t));
        Moved { relative, turned, position: Vector3::zeros() }
    }

    /// Returns the step to the next change of a force or the next requested instant, divided if it
    /// is too long.
    fn next_step(&self, now: f64, until: f64) -> f64 {
        let change = |force: &Timed| force.time_s().get(force.reached(now + 1e-9)).copied();
        let held = self.signals.iter().filter(|(signal, _)| signal.is_held());
        let held = held.map(|(_, series)| *series);
        let changes = self.inputs.force.iter().flatten().chain(held).filter_map(change);
        let until = changes.fold(until, f64::min);
        let of_loads = self.loaded.iter().map(|(from_s, _)| *from_s);
        let until = of_loads.filter(|from_s| *from_s > now + 1e-9).fold(until, f64::min);
        let steps = ((until - now) / STEP_S).ceil().max(1.0);
        (until - now) / steps
    }

    /// Returns the force in the middle of a step: it changes at the ends of steps only.
    fn force_at(&self, middle: f64) -> Vector6<f64> {
        Vector6::from_fn(|k, _| {
            self.inputs.force[k].as_ref().map_or(0.0, |force| force.held_at(middle))
        })
    }

    fn step(&self, force: &Vector6<f64>, from: Moved, now: f64, h: f64) -> Moved {
        let held_at_s = now + 0.5 * h;
        let (middle, end) = (now + 0.5 * h, now + h);
        let slope = |at: Moved, t: f64| self.slope(force, at, t, held_at_s);
        let a = slope(from, now);
        let b = slope(from.plus(a, 0.5 * h), middle);
        let c = slope(from.plus(b, 0.5 * h), middle);
        let d = slope(from.plus(c, h), end);
        let mut moved = from.plus(a, h / 6.0).plus(b, h / 3.0).plus(c, h / 3.0).plus(d, h / 6.0);
        if let Turned::Freely(q) = moved.turned {
            moved.turned = Turned::Freely(Unit::new_normalize(q).into_inner());
        }
        moved
    }

    /// Returns the derivative of the state at a time; held signals are those at `held_at_s`.
    fn slope(&self, force: &Vector6<f64>, at: Moved, t: f64, held_at_s: f64) -> Moved {
        let to_body = self.to_body(at.turned, t);
        let down = to_body * Vector3::z();
        let six = self.six(&at.relative, &down, t);
        let air = self.air(at.turned, &six, t);
        let value = |(signal, series): &(&Signal, &Timed)| {
            match (air, signal) {
                (Some(air), Signal::AirForward) => return air.x,
                (Some(air), Signal::AirStarboard) => return air.y,
                _ => {}
            }
            // Like force, a held signal is that in the middle of the step.
            signal.value(series, if signal.is_held() { held_at_s } else { t })
        };
        let signals: Vec<f64> = self.signals.iter().map(value).collect();
        let water = self.on_own(self.water(at.turned, t));
        let through_ground = (six + water).fixed_rows::<3>(0).into_owned();
        Moved {
            relative: self.plant_at(held_at_s).rate(&six, &down, force, &signals),
            turned: self.turning(at.turned, &six, t),
            position: to_body.tr_mul(&through_ground),
        }
    }

    /// Returns velocity through the water on the plant's axes, with prescribed velocities of the
    /// others and the rates that hold angles.
    fn six(&self, relative: &Vector6<f64>, down: &Vector3<f64>, t: f64) -> Vector6<f64> {
        let mut six = relative + self.others(t);
        if self.turns != [true; 3] {
            let rates = six.fixed_rows::<3>(3).into_owned();
            six.fixed_rows_mut::<3>(3).copy_from(&held_turn(self.turns, &rates, down).omega);
        }
        six
    }

    /// Returns velocity over ground in body axes.
    fn over_ground(&self, moved: &Moved, t: f64) -> Vector6<f64> {
        let down = self.to_body(moved.turned, t) * Vector3::z();
        self.six(&moved.relative, &down, t) + self.on_own(self.water(moved.turned, t))
    }

    /// Returns the derivative of attitude.
    fn turning(&self, turned: Turned, six: &Vector6<f64>, t: f64) -> Turned {
        let (p, q, r) = (six[3], six[4], six[5]);
        match turned {
            Turned::Freely(attitude) => {
                Turned::Freely(attitude * Quaternion::from_parts(0.0, Vector3::new(p, q, r)) * 0.5)
            }
            Turned::Partly(_) => {
                let [roll, pitch, _] = self.angles(turned, t);
                let across = q * roll.sin() + r * roll.cos();
                let slopes = [
                    p + pitch.tan() * across,
                    q * roll.cos() - r * roll.sin(),
                    across / pitch.cos(),
                ];
                Turned::Partly(slopes)
            }
        }
    }

    /// Returns roll, pitch and heading: integrated on the plant's axes, otherwise those of the
    /// inputs.
    fn angles(&self, turned: Turned, t: f64) -> [f64; 3] {
        match turned {
            Turned::Freely(q) => {
                let (roll, pitch, heading) = Unit::new_normalize(q).euler_angles();
                [roll, pitch, heading]
            }
            Turned::Partly(angles) => std::array::from_fn(|k| {
                if self.has[k + 3] {
                    angles[k]
                } else {
                    interpolated_attitude(self.inputs.attitude[k].as_ref(), t)
                }
            }),
        }
    }

    fn to_body(&self, turned: Turned, t: f64) -> Matrix3<f64> {
        match turned {
            Turned::Freely(q) => *Unit::new_normalize(q).inverse().to_rotation_matrix().matrix(),
            Turned::Partly(_) => body_from_world(self.angles(turned, t)),
        }
    }

    /// Returns the velocity of the air in body axes, if the inputs have a wind; `six` is the
    /// vehicle's velocity.
    fn air(&self, turned: Turned, six: &Vector6<f64>, t: f64) -> Option<Vector3<f64>> {
        let wind = self.inputs.wind.as_ref()?;
        Some(match wind.frame {
            WindFrame::True => self.to_body(turned, t) * wind.at(t),
            WindFrame::Relative => wind.at(t) + six.fixed_rows::<3>(0),
        })
    }

    /// Returns the current in body axes.
    fn water(&self, turned: Turned, t: f64) -> Vector6<f64> {
        let [north, east] = self.current;
        let body = self.to_body(turned, t) * Vector3::new(north, east, 0.0);
        Vector6::new(body.x, body.y, body.z, 0.0, 0.0, 0.0)
    }

    /// Returns the prescribed velocities of axes outside the plant.
    fn others(&self, t: f64) -> Vector6<f64> {
        Vector6::from_fn(|k, _| {
            let known = self.inputs.velocity[k].as_ref().filter(|_| !self.has[k]);
            known.map_or(0.0, |velocity| velocity.at(t))
        })
    }

    fn on_own(&self, six: Vector6<f64>) -> Vector6<f64> {
        Vector6::from_fn(|k, _| if self.has[k] { six[k] } else { 0.0 })
    }
}

/// A simulation whose forces are computed from its motion.
pub(crate) struct Moving<'a> {
    run: Run<'a>,
    moved: Moved,
    now: f64,
}

impl<'a> Moving<'a> {
    /// Starts at rest over ground, at the inputs' attitude at time zero; their forces are ignored.
    ///
    /// # Errors
    /// As [`simulate`].
    pub(crate) fn at_rest(plant: &Plant, inputs: &'a Inputs) -> Result<Self, Error> {
        let run = Run::new(plant, inputs)?;
        let moved = run.started(&Vector6::zeros(), 0.0);
        Ok(Self { run, moved, now: 0.0 })
    }

    /// Advances by `h`, s, under a force, N and N m.
    ///
    /// # Errors
    /// [`Error::Diverged`].
    pub(crate) fn advance(&mut self, force: &Vector6<f64>, h: f64) -> Result<(), Error> {
        self.moved = self.run.step(force, self.moved, self.now, h);
        self.now += h;
        if self.moved.relative.iter().all(|v| v.abs() < RUNAWAY) {
            return Ok(());
        }
        Err(Error::Diverged { dof: self.run.first, after_s: self.now })
    }

    /// Changes the current, north and east, m/s; velocity over ground is kept.
    pub(crate) fn set_current(&mut self, current: [f64; 2]) {
        let before = self.run.water(self.moved.turned, self.now);
        self.run.current = current;
        let change = before - self.run.water(self.moved.turned, self.now);
        self.moved.relative += self.run.on_own(change);
    }

    /// Returns velocity through the water, body axes.
    pub(crate) fn through_water(&self) -> &Vector6<f64> {
        &self.moved.relative
    }

    /// Returns velocity over ground, body axes.
    pub(crate) fn velocity(&self) -> Vector6<f64> {
        self.run.over_ground(&self.moved, self.now)
    }

    /// Returns roll, pitch and heading, rad.
    pub(crate) fn attitude(&self) -> [f64; 3] {
        self.run.angles(self.moved.turned, self.now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{Effect, EffectForce, Structure, Symmetry};

    /// Relative error of the integration in steps of 0.02 s over ten seconds.
    const INTEGRATION: f64 = 1e-5;

    fn free_body(lever: f64) -> Plant {
        let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
        let structure = structure.without(|term| matches!(term, crate::plant::Basis::Product(..)));
        let mass = [20.0, 0.0, 0.9, 21.0, -0.9, 0.3, 32.0, 0.3, 0.5, 0.0, 0.4, 0.6];
        let coefficients = mass.into_iter().chain([0.0, lever]).collect();
        Plant::new(structure, coefficients).expect("possible")
    }

    #[test]
    fn a_body_without_damping_keeps_its_energy() {
        let lever = 6.6;
        let plant = free_body(lever);
        let start = Vector6::new(0.8, -0.3, 0.2, 0.5, -0.9, 1.1);
        let time_s: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
        let motion = simulate(&plant, &Inputs::default(), &start, &time_s).expect("bounded");
        let mass = plant.mass_matrix_of_six();
        let energy = |k: usize| {
            let v = motion.velocity[k];
            let [roll, pitch, _] = motion.attitude[k];
            0.5 * v.dot(&(mass * v)) - lever * super::super::down_body(roll, pitch).z
        };
        let worst = (0..100).map(|k| (energy(k) - energy(0)).abs()).fold(0.0, f64::max);
        assert!(worst < INTEGRATION * energy(0).abs().max(1.0), "{worst}");
    }

    #[test]
    fn a_current_carries_a_vehicle_without_thrust() {
        let structure =
            Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::None).expect("3");
        let mut coefficients = vec![20.0, 0.0, 0.0, 25.0, 0.0, 1.0];
        coefficients.extend([5.0, 50.0, 5.0, 50.0, 1.0, 1.0]);
        let plant = Plant::new(structure, coefficients).expect("possible");
        let heading = Timed::new("heading", vec![0.0], vec![0.7]).expect("valid");
        let inputs = Inputs {
            attitude: [None, None, Some(heading)],
            current: [0.3, 0.1],
            ..Inputs::default()
        };
        let motion = simulate(&plant, &inputs, &Vector6::zeros(), &[0.0, 200.0]).expect("bounded");
        let (u, v) = (motion.velocity[1][0], motion.velocity[1][1]);
        assert!((u.hypot(v) - 0.3_f64.hypot(0.1)).abs() < 1e-3, "{u} {v}");
    }

    #[test]
    fn a_vehicle_drifts_with_the_wind_at_any_heading() {
        let sail = |on: Dof| {
            let force = EffectForce::Wind { on, scale: 2.0 };
            Effect { name: format!("wind.{on}"), force }
        };
        let axes = [Dof::Surge, Dof::Sway];
        let structure = Structure::of(&axes, Symmetry::Diagonal).expect("two axes");
        let structure = axes.into_iter().fold(structure, |structure, on| {
            structure.with_effect(sail(on), true).expect("acts there")
        });
        // Masses, then linear and quadratic drag of each axis, then the wind's coefficients.
        let numbers = vec![100.0, 100.0, 0.0, 50.0, 0.0, 50.0, 1.0, 1.0];
        let plant = Plant::new(structure, numbers).expect("a plant");
        let still = || Timed::new("air", vec![0.0], vec![0.0]).expect("one");
        let drift = |frame: WindFrame, from: f64, heading: f64| {
            let heading = Timed::new("heading", vec![0.0], vec![heading]).expect("one");
            let wind = Wind::steady(frame, 6.0, from).expect("finite");
            let signals = [Signal::AirForward, Signal::AirStarboard].map(|x| (x, still())).into();
            let attitude = [None, None, Some(heading)];
            let inputs = Inputs { attitude, signals, wind: Some(wind), ..Inputs::default() };
            let moved = simulate(&plant, &inputs, &Vector6::zeros(), &[0.0, 300.0]);
            moved.expect("bounded").velocity[1]
        };
        // Steady state 2 (6 − v)² = 50 v²: v = 6 / (1 + 5).
        let headed = drift(WindFrame::True, std::f64::consts::PI, 0.0);
        assert!((headed[0] - 1.0).abs() < 1e-6, "{headed}");
        // Wind from the south on a vehicle heading east comes from its starboard side.
        let across = drift(WindFrame::True, std::f64::consts::PI, std::f64::consts::FRAC_PI_2);
        assert!((across[1] + 1.0).abs() < 1e-6 && across[0].abs() < 1e-9, "{across}");
        // Wind relative to the vehicle stays constant: 2 · 6² = 50 v².
        let felt = drift(WindFrame::Relative, std::f64::consts::PI, 1.0);
        assert!((felt[0] - 1.2).abs() < 1e-6, "{felt}");
    }

    /// Returns a plant without restoring forces, with masses of 10 and drag of 1.
    fn plant_of(axes: &[Dof]) -> Plant {
        let structure = Structure::of(axes, Symmetry::Diagonal).expect("axes");
        let structure = structure.without(|term| matches!(term, crate::plant::Basis::Lever(_)));
        let value = |term: &crate::plant::Basis| match term {
            crate::plant::Basis::Mass(..) => 10.0,
            crate::plant::Basis::WeightExcess => 0.0,
            _ => 1.0,
        };
        let coefficients = structure.terms().iter().map(value).collect();
        Plant::new(structure, coefficients).expect("possible")
    }

    #[test]
    fn a_vehicle_without_roll_keeps_its_roll_angle_in_a_climbing_turn() {
        let plant = plant_of(&[Dof::Surge, Dof::Sway, Dof::Heave, Dof::Pitch, Dof::Yaw]);
        let pitch = Timed::new("pitch", vec![0.0], vec![0.5]).expect("one");
        let mut inputs = Inputs { attitude: [None, Some(pitch), None], ..Inputs::default() };
        inputs.force[5] = Some(Timed::new("yaw", vec![0.0], vec![1.0]).expect("one"));
        let start = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.3);
        let time_s: Vec<f64> = (0..=2000).map(|k| 0.005 * f64::from(k)).collect();
        let moved = simulate(&plant, &inputs, &start, &time_s).expect("bounded");
        // The rate is that of the attitude, to which a gyroscope's readings integrate.
        for k in [1, 700, 1999] {
            let turned = |k: usize| {
                let [roll, pitch, heading] = moved.attitude[k];
                UnitQuaternion::from_euler_angles(roll, pitch, heading)
            };
            let turn = (turned(k - 1).inverse() * turned(k + 1)).scaled_axis() / 0.01;
            let rate = moved.velocity[k].fixed_rows::<3>(3).into_owned();
            assert!((turn - rate).norm() < 1e-5, "{turn} {rate}");
            assert_eq!(moved.attitude[k][0], 0.0);
        }
        assert!(moved.attitude[2000][2] > 2.0, "it turns");
    }

    #[test]
    fn position_does_not_depend_on_the_requested_instants() {
        // u̇ = −(u + u²)/10 from 3 m/s.
        let plant = plant_of(&[Dof::Surge]);
        let distance = |t: f64| {
            // u = c/(1 − c), c = c₀ e^{−t/10}: x = 10 ln((1 − c)/(1 − c₀)).
            let c0 = 3.0_f64 / 4.0;
            10.0 * ((1.0 - c0 * (-0.1 * t).exp()) / (1.0 - c0)).ln()
        };
        let start = Vector6::new(3.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for interval in [0.1, 1.0, 10.0] {
            let count = (60.0_f64 / interval).round() as usize;
            let time_s: Vec<f64> = (0..=count).map(|k| interval * k as f64).collect();
            let moved = simulate(&plant, &Inputs::default(), &start, &time_s).expect("bounded");
            let found = moved.position[count].x;
            assert!((found - distance(60.0)).abs() < 1e-8, "{interval}: {found}");
        }
    }
}
