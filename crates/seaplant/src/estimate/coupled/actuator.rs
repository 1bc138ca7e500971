//! How thrust follows what is logged of it: a first-order lag and a delay, the same on every axis.
//!
//! ```text
//! T τ̇(t) + τ(t) = u(t − D)
//! ```
//!
//! with u the logged force, held between its samples. A step of the filter takes the mean of τ
//! over each slice, which is exact whatever lag, delay and sampling are:
//! `∫τ dt = ∫u(t − D) dt − T [τ]`.

use crate::motion::{HeldForce, Slice};
use crate::{Error, Timed};

/// Lag and delay of thrust behind the logged force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Actuator {
    /// Time constant T of the lag, s.
    pub lag_s: f64,
    /// Delay D, s.
    pub delay_s: f64,
}

/// How finely a force that lags is held in a simulation, s.
const FINEST_S: f64 = 0.05;

/// So many time constants after the last change, a lag is over.
const OVER: f64 = 8.0;

/// A lag shorter than this is none, s.
const NO_LAG_S: f64 = 1e-6;

impl Actuator {
    /// How many numbers that is.
    pub(super) const COUNT: usize = 2;

    /// The force that acts, held over steps of at most 0.05 s, for one that is logged.
    ///
    /// # Errors
    /// [`Error::NotFinite`] or another of [`Timed::new`] if a number is not finite.
    pub fn applied(&self, logged: &Timed) -> Result<Timed, Error> {
        if *self == Self::default() {
            return Ok(logged.clone());
        }
        let (first, last) = (logged.first_s(), logged.last_s() + self.delay_s + OVER * self.lag_s);
        let steps = ((last - first) / FINEST_S).ceil().max(1.0) as usize;
        let lagging = Lagging::new(logged, *self);
        let mut reader = lagging.reader();
        let edge = |k: usize| first + FINEST_S * k as f64;
        let mut before = reader.at(edge(0));
        let (mut times, mut values) = (Vec::with_capacity(steps), Vec::with_capacity(steps));
        for k in 0..steps {
            let after = reader.at(edge(k + 1));
            times.push(edge(k));
            values.push(lagging.mean(&before, &after, FINEST_S).0);
            before = after;
        }
        Timed::new("force", times, values)
    }

    /// The mean force over each slice, with its derivatives by lag and delay.
    pub(super) fn pushes(&self, logged: &[Option<Timed>; 6], slices: &[Slice]) -> Vec<HeldForce> {
        let mut pushes = vec![HeldForce::default(); slices.len()];
        for (axis, series) in logged.iter().enumerate() {
            let Some(series) = series else { continue };
            let lagging = Lagging::new(series, *self);
            let mut reader = lagging.reader();
            for (push, slice) in pushes.iter_mut().zip(slices) {
                let before = reader.at(slice.from_s);
                let after = reader.at(slice.from_s + slice.length_s);
                let (mean, by) = lagging.mean(&before, &after, slice.length_s);
                push.force[axis] = mean;
                for (column, by) in push.by.iter_mut().zip(by) {
                    column[axis] = by;
                }
            }
        }
        pushes
    }
}

/// A logged force and what lags behind it at each of its samples.
struct Lagging<'a> {
    logged: &'a Timed,
    actuator: Actuator,
    /// τ and ∂τ/∂T at the samples, without the delay.
    states: Vec<(f64, f64)>,
    /// ∫u dt up to the samples.
    integrals: Vec<f64>,
}

/// What is known at an instant.
struct At {
    integral: f64,
    force: f64,
    by_lag: f64,
}

impl<'a> Lagging<'a> {
    fn new(logged: &'a Timed, actuator: Actuator) -> Self {
        let (t, u) = (logged.time_s(), logged.values());
        let mut lagging = Self {
            logged,
            actuator,
            states: Vec::with_capacity(t.len()),
            integrals: Vec::with_capacity(t.len()),
        };
        // Before its first sample the force was as there.
        lagging.states.push((u[0], 0.0));
        lagging.integrals.push(0.0);
        for k in 1..t.len() {
            let at = lagging.after(k - 1, t[k] - t[k - 1]);
            lagging.states.push((at.force, at.by_lag));
            lagging.integrals.push(at.integral);
        }
        lagging
    }

    /// Some time after a sample, before the next.
    fn after(&self, sample: usize, s: f64) -> At {
        let u = self.logged.values()[sample];
        let (state, by_lag) = self.states[sample];
        let lag = self.actuator.lag_s;
        let integral = self.integrals[sample] + u * s;
        if lag < NO_LAG_S {
            return At { integral, force: u, by_lag: 0.0 };
        }
        // Before the first sample there is no change that anything could lag behind.
        let s = s.max(0.0);
        let left = (-s / lag).exp();
        At {
            integral,
            force: u + (state - u) * left,
            by_lag: (by_lag + (state - u) * s / (lag * lag)) * left,
        }
    }

    fn reader(&'a self) -> Reader<'a> {
        Reader { lagging: self, sample: 0 }
    }

    /// The mean between two instants, and its derivatives by lag and delay.
    fn mean(&self, before: &At, after: &At, length_s: f64) -> (f64, [f64; Actuator::COUNT]) {
        let lag = self.actuator.lag_s;
        let change = after.force - before.force;
        let mean = (after.integral - before.integral - lag * change) / length_s;
        let by_lag = -(change + lag * (after.by_lag - before.by_lag)) / length_s;
        (mean, [by_lag, -change / length_s])
    }
}

/// Reads a force at instants that do not decrease by more than a slice.
struct Reader<'a> {
    lagging: &'a Lagging<'a>,
    sample: usize,
}

impl Reader<'_> {
    fn at(&mut self, t: f64) -> At {
        let times = self.lagging.logged.time_s();
        let t = t - self.lagging.actuator.delay_s;
        while self.sample > 0 && times[self.sample] > t {
            self.sample -= 1;
        }
        while times.get(self.sample + 1).is_some_and(|next| *next <= t) {
            self.sample += 1;
        }
        self.lagging.after(self.sample, t - times[self.sample])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> Timed {
        Timed::new("force", vec![0.0, 0.3, 0.5, 1.0], vec![0.0, 10.0, -4.0, 3.0]).expect("valid")
    }

    /// The lagged force by many small steps of Euler's method.
    fn by_small_steps(actuator: Actuator, until_s: f64) -> (f64, f64) {
        let (u, h) = (steps(), 1e-6);
        let (mut force, mut integral) = (0.0, 0.0);
        for k in 0..(until_s / h).round() as usize {
            let t = (k as f64 + 0.5) * h - actuator.delay_s;
            integral += force * h;
            force += h / actuator.lag_s * (u.held_at(t.max(0.0)) - force);
        }
        (force, integral)
    }

    #[test]
    fn a_force_lags_as_its_equation_says() {
        let actuator = Actuator { lag_s: 0.2, delay_s: 0.13 };
        let u = steps();
        let lagging = Lagging::new(&u, actuator);
        let mut reader = lagging.reader();
        let (from, to) = (reader.at(0.0), reader.at(0.9));
        let (expected, integral) = by_small_steps(actuator, 0.9);
        assert!((to.force - expected).abs() < 1e-3, "{} {expected}", to.force);
        let (mean, _) = lagging.mean(&from, &to, 0.9);
        assert!((mean * 0.9 - integral).abs() < 1e-4, "{} {integral}", mean * 0.9);
    }

    #[test]
    fn derivatives_are_those_of_the_means() {
        let slice =
            |k: usize| Slice { from_s: 0.05 * k as f64, length_s: 0.05, ..Slice::default() };
        let slices: Vec<Slice> = (0..30).map(slice).collect();
        let mut logged: [Option<Timed>; 6] = std::array::from_fn(|_| None);
        logged[2] = Some(steps());
        for base in
            [Actuator { lag_s: 0.2, delay_s: 0.13 }, Actuator { lag_s: 0.03, delay_s: 0.01 }]
        {
            let pushes = |lag: f64, delay: f64| {
                let moved = Actuator { lag_s: base.lag_s + lag, delay_s: base.delay_s + delay };
                moved.pushes(&logged, &slices)
            };
            let here = pushes(0.0, 0.0);
            for (column, step) in [(0, [1e-6, 0.0]), (1, [0.0, 1e-6])] {
                let (up, down) = (pushes(step[0], step[1]), pushes(-step[0], -step[1]));
                for ((here, up), down) in here.iter().zip(&up).zip(&down) {
                    let slope = (up.force[2] - down.force[2]) / 2e-6;
                    assert!((slope - here.by[column][2]).abs() < 1e-3, "{slope}");
                }
            }
        }
    }

    #[test]
    fn a_force_that_changes_where_a_slice_ends_lags_alike() {
        let slice = |k: usize| Slice { from_s: 0.1 * k as f64, length_s: 0.1, ..Slice::default() };
        let slices: Vec<Slice> = (0..12).map(slice).collect();
        let mut logged: [Option<Timed>; 6] = std::array::from_fn(|_| None);
        logged[0] = Some(steps());
        let pushes = |delay_s| Actuator { lag_s: 0.2, delay_s }.pushes(&logged, &slices);
        for (at, later) in pushes(0.0).iter().zip(pushes(1e-9)) {
            assert!((at.force[0] - later.force[0]).abs() < 1e-6, "{at:?} {later:?}");
        }
    }

    #[test]
    fn without_lag_and_delay_the_force_is_the_logged_one() {
        assert_eq!(Actuator::default().applied(&steps()).expect("finite"), steps());
        let delayed = Actuator { lag_s: 0.0, delay_s: 0.2 };
        let applied = delayed.applied(&steps()).expect("finite");
        assert!((applied.held_at(0.56) - 10.0).abs() < 1e-9, "{}", applied.held_at(0.56));
    }
}
