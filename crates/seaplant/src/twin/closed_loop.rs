//! Closed-loop simulation of the twin.

use super::motion::{TrueState, simulate_with_force};
use super::random::Streams;
use super::vehicle::InstrumentNoise;
use super::water::Water;
use super::{Plan, STEPS_PER_TICK, TICK_HZ, TwinSpec, tick_time};
use crate::random::normal;
use crate::{Dof, Error, Role};

/// The measurements of one degree of freedom, ten times a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Time, s.
    pub time_s: f64,
    /// Displacement from the start, m or rad: the integral of measured velocity, as by DVLNAV, or
    /// the heading.
    pub position: f64,
    /// Velocity over ground, m/s or rad/s: that of the DVL, or the filtered derivative of heading.
    pub velocity: f64,
}

/// True motion and force, ten times a second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosedLoop {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Displacement from the start, m or rad.
    pub position: Vec<f64>,
    /// Velocity over ground, m/s or rad/s.
    pub velocity: Vec<f64>,
    /// The requested force, N or N m.
    pub force: Vec<f64>,
    /// The measurements that the controller received.
    pub measured: Vec<Measured>,
}

/// Time constant of the derivative of heading, s: the twin has no gyroscope.
const SLOPE_S: f64 = 0.3;

/// The instruments of one degree of freedom.
struct Instruments {
    dof: Dof,
    noise: InstrumentNoise,
    random: rand_chacha::ChaCha8Rng,
    position: f64,
    velocity: f64,
    last: Option<f64>,
}

/// Simulates one degree of freedom of the twin under a controller: its thrusters with limits,
/// jitter, lag and delay, its water, and the noise of its instruments.
///
/// `controller` returns the requested force, N or N m, for a measurement.
///
/// # Errors
/// [`Error::TwinSpec`] for an invalid specification, or one without the degree of freedom;
/// [`Error::Setting`] for a force that is not finite; [`Error::Diverged`] if the motion diverges.
///
/// # Example
/// ```
/// use seaplant::Dof;
/// use seaplant::twin::{TwinSpec, close_loop};
/// // A proportional and derivative controller that holds position.
/// let mut hold = |at: &seaplant::twin::Measured| -2000.0 * at.position - 6000.0 * at.velocity;
/// let run = close_loop(&TwinSpec::jason2(), Dof::Surge, 60.0, &mut hold)?;
/// // The bias of 255.5 N displaces it forward.
/// assert!((run.position[599] - 0.128).abs() < 0.03);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn close_loop(
    spec: &TwinSpec,
    dof: Dof,
    duration_s: f64,
    controller: &mut dyn FnMut(&Measured) -> f64,
) -> Result<ClosedLoop, Error> {
    spec.validate()?;
    let plant = spec.plants.get(&dof).filter(|_| spec.dofs.contains(&dof)).ok_or_else(|| {
        super::validate::refused("dofs", dof.name(), "a degree of freedom that the twin has")
    })?;
    let name = format!("{dof} closed loop");
    let plan = Plan {
        name: name.clone(),
        role: Role::Fit,
        dof,
        plant: plant.physical(),
        duration_s,
        thrust: 0.0,
        spent: (0.0, 0.0),
    };
    let streams = Streams { seed: spec.seed, trial: &name };
    let water = Water::new(spec, dof, &streams, plan.ticks());
    let mut instruments = Instruments::new(spec, dof, &streams);
    let mut run = ClosedLoop::default();
    let mut refused = None;
    let mut decide = |tick: usize, at: &TrueState| {
        let measured = instruments.read(tick, at);
        let mut force = controller(&measured);
        if !force.is_finite() {
            refused.get_or_insert(measured.time_s);
            force = 0.0;
        }
        run.measured.push(measured);
        run.force.push(force);
        force
    };
    let moved = simulate_with_force(spec, &plan, &mut decide, &water, &streams)?;
    if let Some(time_s) = refused {
        return Err(Error::Setting {
            name: format!("the controller's {dof} force at {time_s:.1} s"),
            found: "not finite".to_owned(),
            expected: "a number".to_owned(),
        });
    }
    for tick in 0..plan.ticks() {
        run.time_s.push(tick_time(tick));
        run.position.push(moved.position[tick * STEPS_PER_TICK]);
        run.velocity.push(moved.velocity[tick * STEPS_PER_TICK]);
    }
    Ok(run)
}

impl TwinSpec {
    /// Returns the greatest force or moment of the thrusters in the weaker direction, N or N m.
    pub fn force_limit(&self, dof: Dof) -> f64 {
        self.reverse_limit(dof)
    }
}

impl Instruments {
    fn new(spec: &TwinSpec, dof: Dof, streams: &Streams<'_>) -> Self {
        Self {
            dof,
            noise: InstrumentNoise::from_level(spec.noise),
            random: streams.stream("instruments"),
            position: 0.0,
            velocity: 0.0,
            last: None,
        }
    }

    fn read(&mut self, tick: usize, at: &TrueState) -> Measured {
        let noise = normal(&mut self.random);
        if self.dof.is_rotation() {
            let heading = at.position + self.noise.heading * noise;
            let slope = self.last.map_or(0.0, |last| (heading - last) * TICK_HZ);
            let part = 1.0 - (-1.0 / (TICK_HZ * SLOPE_S)).exp();
            self.velocity += part * (slope - self.velocity);
            self.last = Some(heading);
            self.position = heading;
        } else {
            let velocity = at.velocity + self.noise.dvl * noise;
            // The first sample begins at the start; later ones add the displacement since the last.
            let before = self.last.unwrap_or(velocity);
            if self.last.is_some() {
                self.position += 0.5 * (before + velocity) / TICK_HZ;
            }
            self.last = Some(velocity);
            self.velocity = velocity;
        }
        Measured { time_s: tick_time(tick), position: self.position, velocity: self.velocity }
    }
}
