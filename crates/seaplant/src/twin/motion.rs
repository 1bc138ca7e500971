//! Motion of the vehicle in one degree of freedom: thrust, drag and disturbances.

use super::command::Pilot;
use super::propellers::Propellers;
use super::random::Streams;
use super::water::Water;
use super::{Plan, STEPS_PER_TICK, TICK_HZ, TwinSpec, tick_time};
use crate::{Dof, Error, PhysicalParameters};

pub(super) const STEP_S: f64 = 1.0 / (TICK_HZ * STEPS_PER_TICK as f64);

/// The motion of one trial: states at every step, propeller speeds at every tick.
#[derive(Default)]
pub(super) struct TrialMotion {
    /// Displacement along the degree of freedom, m or rad.
    pub(super) position: Vec<f64>,
    /// Velocity over ground, m/s or rad/s.
    pub(super) velocity: Vec<f64>,
    /// Depth below the start, m.
    pub(super) sunk: Vec<f64>,
    /// Speed of each propeller of the pair before lag and delay, rad/s.
    pub(super) speeds: [Vec<f64>; 2],
}

/// Simulates a trial with its pilot.
///
/// # Errors
/// [`Error::Diverged`] if the motion diverges.
pub(super) fn simulate_trial(
    spec: &TwinSpec,
    plan: &Plan,
    mut pilot: Pilot,
    water: &Water,
    streams: &Streams<'_>,
) -> Result<TrialMotion, Error> {
    let mut decide = |tick: usize, at: &TrueState| pilot.force(tick, at.sunk, at.velocity);
    simulate_with_force(spec, plan, &mut decide, water, streams)
}

/// The true state of the vehicle at a tick.
pub(super) struct TrueState {
    /// Displacement along the degree of freedom, m or rad.
    pub(super) position: f64,
    /// Velocity over ground, m/s or rad/s.
    pub(super) velocity: f64,
    /// Depth below the start, m.
    pub(super) sunk: f64,
}

/// Simulates a trial under the force that a function returns at each tick.
///
/// # Errors
/// [`Error::Diverged`] if the motion diverges.
pub(super) fn simulate_with_force(
    spec: &TwinSpec,
    plan: &Plan,
    decide: &mut dyn FnMut(usize, &TrueState) -> f64,
    water: &Water,
    streams: &Streams<'_>,
) -> Result<TrialMotion, Error> {
    let Plan { dof, plant, .. } = plan;
    let mut propellers = Propellers::new(spec, &spec.true_vehicle()?, plan, streams);
    let mut moved = TrialMotion::default();
    let (mut position, mut v, mut sunk) = (0.0, 0.0, 0.0);
    moved.push(position, v, sunk);
    for tick in 0..plan.ticks() {
        let force = decide(tick, &TrueState { position, velocity: v, sunk });
        let commands = propellers.allocate(force, tick);
        let vertical = vertical_part(water, *dof, tick_time(tick));
        moved.speeds.iter_mut().zip(commands).for_each(|(path, speed)| path.push(speed));
        for step in tick * STEPS_PER_TICK..(tick + 1) * STEPS_PER_TICK {
            let t = step as f64 * STEP_S;
            let speeds = propellers.advance(&moved.speeds, t);
            let acceleration = |stage: usize, v: f64| {
                let through_water = v - water.along(tick);
                let t = t + 0.5 * STEP_S * stage as f64;
                let force = propellers.force(speeds[stage], through_water, t);
                (force + water.force(tick, t, position) - drag(plant, through_water)) / plant.mass
            };
            let (moved_by, v_next) = rk4(v, acceleration);
            (position, v, sunk) = (position + moved_by, v_next, sunk + vertical * moved_by);
            moved.push(position, v, sunk);
        }
        if v.is_nan() || v.abs() > RUNAWAY {
            return Err(Error::Diverged { dof: *dof, after_s: tick as f64 / TICK_HZ });
        }
    }
    Ok(moved)
}

/// Velocity beyond which a simulation has diverged, m/s or rad/s.
const RUNAWAY: f64 = 1e3;

fn drag(plant: &PhysicalParameters, v: f64) -> f64 {
    plant.d_quadratic * v * v.abs() + plant.d_linear * v + plant.bias_force
}

/// Returns the downward component of a unit displacement along the degree of freedom.
fn vertical_part(water: &Water, dof: Dof, t_s: f64) -> f64 {
    if dof.is_rotation() {
        return 0.0;
    }
    // It does not depend on heading.
    water.attitude(t_s, 0.0, 0.0).rotation()[(2, dof.index())]
}

/// Takes one classical Runge–Kutta step; returns the displacement, and the velocity after it.
///
/// `acceleration(stage, v)` has stage 0 at the start of the step, 1 in its middle and 2 at its end.
fn rk4(v: f64, acceleration: impl Fn(usize, f64) -> f64) -> (f64, f64) {
    let h = STEP_S;
    let a1 = acceleration(0, v);
    let v2 = v + 0.5 * h * a1;
    let a2 = acceleration(1, v2);
    let v3 = v + 0.5 * h * a2;
    let a3 = acceleration(1, v3);
    let v4 = v + h * a3;
    let a4 = acceleration(2, v4);
    (h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4))
}

impl TrialMotion {
    fn push(&mut self, position: f64, v: f64, sunk: f64) {
        self.position.push(position);
        self.velocity.push(v);
        self.sunk.push(sunk);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Disturbance;
    use super::*;
    use crate::twin::plans;
    use crate::{State, Timed, simulate};

    fn moved(spec: &TwinSpec, name: &str) -> (Plan, TrialMotion) {
        let plan = plans(spec).into_iter().find(|plan| plan.name == name).expect("planned");
        let streams = Streams { seed: spec.seed, trial: name };
        let water = Water::new(spec, plan.dof, &streams, plan.ticks());
        let pilot = plan.pilot(spec, &streams);
        let moved = simulate_trial(spec, &plan, pilot, &water, &streams).expect("stable");
        (plan, moved)
    }

    fn simulated(spec: &TwinSpec, plan: &Plan, moved: &TrialMotion) -> Vec<f64> {
        let propellers = Propellers::new(
            spec,
            &spec.true_vehicle().expect("valid"),
            plan,
            &Streams { seed: spec.seed, trial: &plan.name },
        );
        let force = |tick: usize| propellers.force([0, 1].map(|i| moved.speeds[i][tick]), 0.0, 0.0);
        let times: Vec<f64> = (0..plan.ticks()).map(tick_time).collect();
        let force: Vec<f64> = (0..plan.ticks()).map(force).collect();
        let force = Timed::new("force", times.clone(), force).expect("finite");
        let plant = plan.plant.to_lumped();
        simulate(plan.dof, &plant, &force, State::default(), &times).expect("stable").velocity
    }

    /// Error of RK4 in steps of 0.02 s and 0.05 s: below a millionth of the velocity each.
    const SAME_VELOCITY: f64 = 1e-6;

    #[test]
    fn undisturbed_motion_agrees_with_the_plant_simulation() {
        let spec = TwinSpec::jason2();
        for name in ["surge 1", "sway hold-out", "heave 1", "yaw 1", "heave down 60 %"] {
            let (plan, moved) = moved(&spec, name);
            for (tick, v) in simulated(&spec, &plan, &moved).into_iter().enumerate() {
                let off = (moved.velocity[tick * STEPS_PER_TICK] - v).abs();
                assert!(off < SAME_VELOCITY, "{name}, {} s: {off}", tick_time(tick));
            }
        }
    }

    #[test]
    fn delayed_thrust_delays_the_motion() {
        let mut spec = TwinSpec::jason2();
        let prompt = moved(&spec, "surge 1").1;
        spec.disturbances.insert(Disturbance::Delay);
        let late = moved(&spec, "surge 1").1;
        assert_eq!(prompt.speeds, late.speeds, "what is logged is what was asked");
        // 0.2 s are 10 steps; the bias force acts during them, 0.004 m/s, and its effect decays.
        let after_20_s = prompt.velocity.iter().zip(&late.velocity[10..]).skip(1000);
        let apart = after_20_s.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-3, "{apart}");
    }
}
