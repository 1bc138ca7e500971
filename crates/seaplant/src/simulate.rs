//! Simulation of a plant under logged force.

use crate::{Dof, Error, LumpedParameters, Timed};

/// Longest integration step, s: at `|β v| = 2/s`, far above any vehicle, its error is below 1e-6 of
/// the velocity.
const LONGEST_STEP_S: f64 = 0.05;

/// Velocity beyond which a simulation has diverged, m/s or rad/s.
const RUNAWAY: f64 = 1e3;

/// The initial state of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Position along the degree of freedom, m or rad.
    pub position: f64,
    /// Velocity, m/s or rad/s.
    pub velocity: f64,
}

/// Simulated motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// Position at each instant, m or rad.
    pub position: Vec<f64>,
    /// Velocity at each instant, m/s or rad/s.
    pub velocity: Vec<f64>,
}

impl Response {
    pub(crate) fn with_capacity(instants: usize) -> Self {
        Self { position: Vec::with_capacity(instants), velocity: Vec::with_capacity(instants) }
    }
}

/// Integrates `v̇ = α τ + β v|v| + μ v + bias` under a held force, by RK4.
///
/// `start` is the state at `times_s[0]`; the result has one position and one velocity for each of
/// `times_s`, which must increase. Steps end at changes of force, so that none contains a jump.
///
/// # Errors
/// [`Error::Diverged`] if the velocity exceeds 1000 m/s or rad/s.
///
/// # Source
/// [Jason2, §4]: the identified plant, driven by the logged thrust.
///
/// ```
/// use seaplant::{Dof, PhysicalParameters, State, Timed, simulate};
/// // From rest under constant thrust: v = √(τ/d) tanh(t √(τ d)/m).
/// let plant = PhysicalParameters { mass: 100.0, d_quadratic: 50.0, ..Default::default() };
/// let thrust = Timed::new("thrust", vec![0.0], vec![200.0])?;
/// let moved = simulate(Dof::Surge, &plant.to_lumped(), &thrust, State::default(), &[0.0, 2.0])?;
/// let exact = 2.0 * (2.0_f64 * 100.0 / 100.0).tanh();
/// assert!((moved.velocity[1] - exact).abs() < 1e-6);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn simulate(
    dof: Dof,
    plant: &LumpedParameters,
    force: &Timed,
    start: State,
    times_s: &[f64],
) -> Result<Response, Error> {
    let mut response = Response::with_capacity(times_s.len());
    let Some(&first) = times_s.first() else { return Ok(response) };
    let (changes, taus) = (force.time_s(), force.values());
    let mut next = changes.partition_point(|&t| t <= first);
    let (mut t, mut state) = (first, start);
    for &until in times_s {
        while t < until {
            let tau = taus[next.max(1) - 1];
            let stop = changes.get(next).map_or(until, |change| change.min(until));
            state = advance(|v| plant.acceleration(tau, v), state, stop - t);
            t = stop;
            while changes.get(next).is_some_and(|change| *change <= t) {
                next += 1;
            }
        }
        if has_run_away(state) {
            return Err(Error::Diverged { dof, after_s: until - first });
        }
        response.position.push(state.position);
        response.velocity.push(state.velocity);
    }
    Ok(response)
}

/// Integrates over a time in which acceleration depends on velocity only, in equal steps of at most
/// [`LONGEST_STEP_S`].
pub(crate) fn advance(acceleration: impl Fn(f64) -> f64, mut state: State, span_s: f64) -> State {
    let steps = (span_s / LONGEST_STEP_S).ceil().max(1.0);
    let h = span_s / steps;
    for _ in 0..steps as usize {
        state = rk4(&acceleration, state, h);
    }
    state
}

/// Returns whether a simulated velocity has diverged.
pub(crate) fn has_run_away(state: State) -> bool {
    state.velocity.is_nan() || state.velocity.abs() > RUNAWAY
}

/// Takes one classical Runge–Kutta step of position and velocity.
fn rk4(acceleration: &impl Fn(f64) -> f64, state: State, h: f64) -> State {
    let v1 = state.velocity;
    let a1 = acceleration(v1);
    let v2 = v1 + 0.5 * h * a1;
    let a2 = acceleration(v2);
    let v3 = v1 + 0.5 * h * a2;
    let a3 = acceleration(v3);
    let v4 = v1 + h * a3;
    let a4 = acceleration(v4);
    State {
        position: state.position + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4),
        velocity: v1 + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PhysicalParameters;

    fn plant(d_quadratic: f64, bias_force: f64) -> LumpedParameters {
        PhysicalParameters { mass: 12970.0, d_quadratic, d_linear: 0.0, bias_force }.to_lumped()
    }

    fn thrust(values: &[(f64, f64)]) -> Timed {
        let (t, x): (Vec<f64>, Vec<f64>) = values.iter().copied().unzip();
        Timed::new("thrust", t, x).expect("valid")
    }

    #[test]
    fn coasting_agrees_with_the_closed_form() {
        let start = State { velocity: 0.8, ..Default::default() };
        let times: Vec<f64> = (0..600).map(f64::from).collect();
        let moved =
            simulate(Dof::Surge, &plant(2231.0, 0.0), &thrust(&[(0.0, 0.0)]), start, &times)
                .expect("stable");
        for (t, v) in times.iter().zip(&moved.velocity) {
            let exact = 0.8 / (1.0 + 2231.0 * 0.8 * t / 12970.0);
            assert!((v - exact).abs() < 1e-9, "{t} s: {v} and {exact}");
        }
        // ∫ v dt = m/d ln(1 + d v0 t/m).
        let exact = 12970.0 / 2231.0 * (1.0 + 2231.0 * 0.8 * 599.0 / 12970.0_f64).ln();
        assert!((moved.position[599] - exact).abs() < 1e-7);
    }

    #[test]
    fn force_changes_between_output_times() {
        // Without drag, velocity is the integral of force: 1 s of 100 N, then none.
        let force = thrust(&[(0.0, 100.0), (1.0, 0.0), (1.5, -50.0)]);
        let free = LumpedParameters { alpha: 0.01, ..Default::default() };
        let moved = simulate(Dof::Surge, &free, &force, State::default(), &[0.0, 0.7, 3.0])
            .expect("bounded");
        assert!((moved.velocity[1] - 0.7).abs() < 1e-12);
        assert!((moved.velocity[2] - (1.0 - 0.75)).abs() < 1e-12);
    }

    #[test]
    fn reversing_every_force_reverses_the_motion() {
        let force = thrust(&[(0.0, 700.0), (3.0, -400.0), (9.0, 150.0)]);
        let times: Vec<f64> = (0..120).map(|k| 0.1 * f64::from(k)).collect();
        let run = |force: &Timed, bias: f64| {
            simulate(Dof::Sway, &plant(9187.0, bias), force, State::default(), &times)
                .expect("stable")
                .velocity
        };
        let (there, back) = (run(&force, 80.0), run(&force.map(|x| -x), -80.0));
        assert!(there.iter().zip(&back).all(|(a, b)| (a + b).abs() < 1e-15));
    }

    #[test]
    fn an_unstable_plant_is_reported_as_divergent() {
        let start = State { velocity: 1.0, ..Default::default() };
        let times: Vec<f64> = (0..100).map(f64::from).collect();
        let run = simulate(Dof::Surge, &plant(-9000.0, 0.0), &thrust(&[(0.0, 0.0)]), start, &times);
        assert!(matches!(run, Err(Error::Diverged { dof: Dof::Surge, .. })), "{run:?}");
    }
}
