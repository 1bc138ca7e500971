//! A step of the filter: its map, its transition and its noise.

use super::{D, Discrete, Inflow, Kalman, Layout, Sources, Square, V};
use crate::estimate::filter_error::discrete::{Sensing, Slow, Waves};
use crate::estimate::filter_error::parameters::Unknown;
use crate::estimate::propellers::Push;

impl<const S: usize, const N: usize> Kalman<'_, S, N> {
    pub(super) fn discrete(&self, h: f64) -> Discrete {
        let (slow, slow_by_t) = Slow::over(h, self.sigma2, self.inverse_t);
        let (sense, sense_by) = Sensing::over(self.layout.sensor, h, self.values);
        let has_waves = self.layout.waves.is_some();
        let waves = |of: &dyn Fn() -> Waves| if has_waves { of() } else { Waves::default() };
        let by = |unknown| {
            waves(&|| match self.column(unknown) {
                Some(_) => Waves::by(unknown, h, self.values),
                None => Waves::default(),
            })
        };
        let drift = (2.0 * self.values.get(Unknown::LogDrift)).exp();
        let (leak, leak_by_t) = match self.layout.gained {
            Some(_) => {
                let sigma2 = (2.0 * self.values.get(Unknown::LogLeak)).exp();
                Slow::over(h, sigma2, (-self.values.get(Unknown::LogLeakCorrelation)).exp())
            }
            None => Default::default(),
        };
        Discrete {
            leak,
            leak_by_t,
            h,
            slow,
            slow_by_t,
            sense,
            sense_by,
            waves: waves(&|| Waves::over(h, self.values)),
            waves_by_frequency: by(Unknown::LogSwellFrequency),
            waves_by_damping: by(Unknown::LogSwellDamping),
            drift: Slow::over(h, drift, 1.0 / DRIFT_CORRELATION_S).0,
        }
    }

    /// One step: the mean by its Taylor series to third order, with what is linear in closed
    /// form, and the covariance by the derivative of the same map.
    pub(super) fn predict(&mut self, push: &Push, step: &Discrete) {
        let x = &self.state.x;
        let c = self.layout.current.map_or(0.0, |k| x[k]);
        let r = x[V] - self.current - c;
        let gamma = usize::from(r < 0.0);
        let (speed, sign) = (r.abs(), r.signum());
        let Inflow { all, ahead } = self.inflow;
        let lost = all * (push.gamma[0] + push.gamma[1]) + ahead * push.gamma[gamma];
        let linear = self.mu - self.alpha * lost;
        let a = 2.0 * self.beta * speed + linear;
        let f = self.alpha * push.tau
            + (self.beta * speed + linear) * r
            + self.bias
            + self.turning * push.turning;
        let bend = 2.0 * self.beta * sign;
        let reversal = Reversal::of(r, f, step.h);
        let mut map = self.map(f, a, bend, step);
        map.of_v += 2.0 * map.h3 * self.beta * f * f * (reversal.by_r + reversal.by_f * a);
        let now = Now { r, speed, gamma, lost, a, f, bend, reversal, map };
        // Covariances go by the slope of drag and leave its bend out.
        let straight = Now { bend: 0.0, map: self.map(f, a, 0.0, step), ..now };
        let phi = self.transition(&straight, step);
        let q = self.process_noise(step);
        if N > 0 {
            self.predict_sensitivities(push, &now, &phi, step);
        }
        self.state.x = self.moved(&now, step);
        self.state.p = self.spread(&phi, &q);
    }

    /// Coefficients of the map over a step.
    pub(super) fn map(&self, f: f64, a: f64, bend: f64, step: &Discrete) -> Map {
        let h = step.h;
        let (h2, h3) = (0.5 * h * h, h * h * h / 6.0);
        let x = &self.state.x;
        let wave = self.layout.waves.map_or(0.0, |w| {
            let [e, _] = step.waves.e;
            (e[0] - 1.0) * x[w] + e[1] * x[w + 1]
        });
        let pushed = step.slow.once * x[D] + wave;
        Map {
            h2,
            h3,
            wave,
            // Forces that vary in a step act on a sensor by their mean.
            g1: f + pushed / h,
            // ∂v(h)/∂v(0), but for what bend does to d and waves.
            of_v: 1.0
                + h * a
                + h2 * (a * a + bend * f)
                + h3 * (a * a * a + 4.0 * a * bend * f)
                + bend * (step.slow.twice * x[D] + 0.5 * h * wave),
        }
    }

    /// The states after a step.
    fn moved(&self, now: &Now, step: &Discrete) -> [f64; S] {
        let Now { a, f, reversal, map: Map { h2, h3, wave, g1, .. }, .. } = *now;
        let bend = 2.0 * self.beta * reversal.sign;
        let (h, slow) = (step.h, &step.slow);
        let from = &self.state.x;
        let mut to = *from;
        to[V] += h * f
            + h2 * a * f
            + h3 * (a * a * f + bend * f * f)
            + (slow.once + a * slow.twice) * from[D]
            + (1.0 + 0.5 * a * h) * wave;
        to[D] *= slow.rho;
        if let Some(p) = self.layout.position {
            to[p] += h * from[V] + h2 * f + h3 * a * f + slow.twice * from[D] + 0.5 * h * wave;
        }
        let (states, first) = (Sensing::states(self.layout.sensor), self.layout.seen);
        for i in 0..states {
            let Sensing { e, j0, j1, j2 } = &step.sense;
            let own: f64 = (0..states).map(|j| e[i][j] * from[first + j]).sum();
            to[first + i] = own + j0[i] * from[V] + j1[i] * g1 + 0.5 * j2[i] * a * g1;
        }
        if let Some(w) = self.layout.waves {
            let e = &step.waves.e;
            for i in 0..2 {
                to[w + i] = e[i][0] * from[w] + e[i][1] * from[w + 1];
            }
        }
        if let Some(c) = self.layout.current {
            to[c] *= step.drift.rho;
        }
        if let Some(g) = self.layout.gained {
            to[g] += to[first] - from[first] + step.leak.once * from[g + 1];
            to[g + 1] *= step.leak.rho;
        }
        to
    }

    /// Gives what is gained the row of what the sensor sees: it changes by as much.
    pub(super) fn mirror_row<T: Copy>(&self, rows: &mut [T; S]) {
        if let Some(g) = self.layout.gained {
            rows[g] = rows[self.layout.seen];
        }
    }

    /// Adds noise of the states to a covariance, and to what is gained what the sensor sees of it.
    pub(super) fn add_noise(&self, to: &mut Square<S>, add: impl Fn(&mut Square<S>)) {
        let Some(g) = self.layout.gained else { return add(to) };
        let mut q = [[0.0; S]; S];
        add(&mut q);
        let seen = self.layout.seen;
        let row: [f64; S] = std::array::from_fn(|k| q[seen.min(k)][seen.max(k)]);
        for k in 0..S {
            q[k.min(g)][k.max(g)] = if k == g { row[seen] } else { row[k] };
        }
        for (to, q) in to.iter_mut().zip(&q) {
            to.iter_mut().zip(q).for_each(|(to, q)| *to += q);
        }
    }

    /// The derivative of the states after a step by those before.
    pub(super) fn transition(&self, now: &Now, step: &Discrete) -> Square<S> {
        let Now { a, f, bend, map: Map { h2, h3, of_v, g1, .. }, .. } = *now;
        let (h, slow) = (step.h, &step.slow);
        let Layout { position, seen, waves, current, sensor, .. } = self.layout;
        let mut phi = [[0.0; S]; S];
        // A force that is one at the start of the step, by the states that it is from.
        let forces = |row: &mut [f64; S], by_d: f64, by_wave: f64| {
            row[D] += by_d;
            if let Some(w) = waves {
                let e = step.waves.e[0];
                row[w] += by_wave * (e[0] - 1.0);
                row[w + 1] += by_wave * e[1];
            }
        };
        let against = |row: &mut [f64; S], by_v: f64| {
            if let Some(c) = current {
                row[c] -= by_v;
            }
        };
        phi[V][V] = of_v;
        forces(&mut phi[V], slow.once + a * slow.twice, 1.0 + 0.5 * a * h);
        against(&mut phi[V], of_v - 1.0);
        phi[D][D] = slow.rho;
        if let Some(p) = position {
            let by_v = h2 * a + h3 * (a * a + bend * f);
            phi[p][p] = 1.0;
            phi[p][V] = h + by_v;
            forces(&mut phi[p], slow.twice, 0.5 * h);
            against(&mut phi[p], by_v);
        }
        let states = Sensing::states(sensor);
        for i in 0..states {
            let Sensing { e, j0, j1, j2 } = &step.sense;
            for j in 0..states {
                phi[seen + i][seen + j] = e[i][j];
            }
            let by_g1 = j1[i] + 0.5 * j2[i] * a;
            let by_r = by_g1 * a + 0.5 * j2[i] * bend * g1;
            phi[seen + i][V] = j0[i] + by_r;
            forces(&mut phi[seen + i], by_g1 * slow.once / h, by_g1 / h);
            against(&mut phi[seen + i], by_r);
        }
        if let Some(w) = waves {
            for i in 0..2 {
                phi[w + i][w] = step.waves.e[i][0];
                phi[w + i][w + 1] = step.waves.e[i][1];
            }
        }
        if let Some(c) = current {
            phi[c][c] = step.drift.rho;
        }
        self.mirror_row(&mut phi);
        if let Some(g) = self.layout.gained {
            phi[g][seen] -= 1.0;
            phi[g][g] = 1.0;
            phi[g][g + 1] = step.leak.once;
            phi[g + 1][g + 1] = step.leak.rho;
        }
        phi
    }

    /// How the transition of covariances changes with the slope of drag.
    pub(super) fn transition_by_slope(&self, now: &Now, step: &Discrete) -> Square<S> {
        let Now { a, map: Map { h2, h3, .. }, .. } = *now;
        let h = step.h;
        let Layout { position, seen, waves, current, sensor, .. } = self.layout;
        let mut phi = [[0.0; S]; S];
        phi[V][V] = h + h * h * a + 3.0 * h3 * a * a;
        phi[V][D] = step.slow.twice;
        if let Some(w) = waves {
            phi[V][w] = 0.5 * h * (step.waves.e[0][0] - 1.0);
            phi[V][w + 1] = 0.5 * h * step.waves.e[0][1];
        }
        if let Some(p) = position {
            phi[p][V] = h2 + 2.0 * h3 * a;
        }
        for i in 0..Sensing::states(sensor) {
            let Sensing { j1, j2, .. } = &step.sense;
            phi[seen + i][V] = j1[i] + j2[i] * a;
            let by_force = 0.5 * j2[i] / h;
            phi[seen + i][D] = by_force * step.slow.once;
            if let Some(w) = waves {
                phi[seen + i][w] = by_force * (step.waves.e[0][0] - 1.0);
                phi[seen + i][w + 1] = by_force * step.waves.e[0][1];
            }
        }
        if let Some(c) = current {
            for row in &mut phi {
                row[c] -= row[V];
            }
        }
        self.mirror_row(&mut phi);
        phi
    }

    pub(super) fn process_noise(&self, step: &Discrete) -> Square<S> {
        let mut q = [[0.0; S]; S];
        self.add_noise(&mut q, |q| {
            add_slow(q, &step.slow);
            if let Some(w) = self.layout.waves {
                add_waves(q, w, &step.waves);
            }
        });
        if let Some(c) = self.layout.current {
            q[c][c] = step.drift.q_dd;
        }
        if let Some(g) = self.layout.gained {
            add_leak(&mut q, g, &step.leak);
        }
        q
    }

    /// Φ P Φᵀ + Q, upper half.
    pub(super) fn spread(&self, phi: &Square<S>, q: &Square<S>) -> Square<S> {
        let p = &self.state.p;
        let mut half = [[0.0; S]; S];
        for (i, row) in half.iter_mut().enumerate() {
            for (k, x) in row.iter_mut().enumerate() {
                *x = self.over(i, |l| phi[i][l] * p[l.min(k)][l.max(k)]);
            }
        }
        let mut to = *q;
        for i in 0..S {
            for j in i..S {
                to[i][j] += self.over(j, |l| half[i][l] * phi[j][l]);
            }
        }
        to
    }

    /// A sum over the states that state `i` depends on.
    #[inline]
    pub(super) fn over(&self, i: usize, of: impl Fn(usize) -> f64) -> f64 {
        if S <= 3 {
            return (0..S).map(of).sum();
        }
        let Sources { at, len } = &self.sources[i];
        at[..*len].iter().map(|l| of(*l)).sum()
    }

    /// `Ψ P Φᵀ` and its transpose, upper half: what a change Ψ of the transition does.
    ///
    /// Most rows of Ψ are zero: an unknown changes few states.
    pub(super) fn turned(&self, psi: &Square<S>, phi: &Square<S>) -> Square<S> {
        let p = &self.state.p;
        let mut to = [[0.0; S]; S];
        for i in 0..S {
            let mut half = [0.0; S];
            for (l, &change) in psi[i].iter().enumerate().filter(|(_, change)| **change != 0.0) {
                for (k, x) in half.iter_mut().enumerate() {
                    *x += change * p[l.min(k)][l.max(k)];
                }
            }
            if half == [0.0; S] {
                continue;
            }
            for j in 0..S {
                let x = self.over(j, |l| half[l] * phi[j][l]);
                to[i.min(j)][i.max(j)] += if i == j { 2.0 * x } else { x };
            }
        }
        to
    }
}

/// A current of the sea changes over minutes, s.
const DRIFT_CORRELATION_S: f64 = 120.0;

pub(super) fn add_slow<const S: usize>(q: &mut Square<S>, slow: &Slow) {
    q[V][V] += slow.q_vv;
    q[V][D] += slow.q_vd;
    q[D][D] += slow.q_dd;
}

/// The leak moves what is gained by its integral.
pub(super) fn add_leak<const S: usize>(q: &mut Square<S>, g: usize, leak: &Slow) {
    q[g][g] += leak.q_vv;
    q[g][g + 1] += leak.q_vd;
    q[g + 1][g + 1] += leak.q_dd;
}

/// The velocity that waves add in a step is the change of w, and so is its noise.
pub(super) fn add_waves<const S: usize>(q: &mut Square<S>, w: usize, waves: &Waves) {
    let [of_w, both, of_rate] = waves.q;
    q[V][V] += of_w;
    q[V][w] += of_w;
    q[V][w + 1] += both;
    q[w][w] += of_w;
    q[w][w + 1] += both;
    q[w + 1][w + 1] += of_rate;
}

/// What the plant does at the start of a step.
pub(super) struct Now {
    /// Velocity through the water.
    pub(super) r: f64,
    pub(super) speed: f64,
    /// Which propellers push the way the vehicle goes.
    pub(super) gamma: usize,
    /// Thrust lost per speed.
    pub(super) lost: f64,
    /// Slope of the acceleration, and the acceleration but for d and waves.
    pub(super) a: f64,
    pub(super) f: f64,
    /// How the slope changes with velocity.
    pub(super) bend: f64,
    pub(super) reversal: Reversal,
    pub(super) map: Map,
}

/// The sign of the velocity through the water over a step, which may change in it: what makes
/// `∫ r|r| = |r|r h + |r| f h² + s f² h³/3` exact where `r` changes by `f` per second.
///
/// With the sign at the start the velocity after a step would jump as its start passes zero, and
/// with it the likelihood.
#[derive(Clone, Copy)]
pub(super) struct Reversal {
    pub(super) sign: f64,
    pub(super) by_r: f64,
    pub(super) by_f: f64,
}

impl Reversal {
    fn of(r: f64, f: f64, h: f64) -> Self {
        let reach = f * h;
        if r * f >= 0.0 || r.abs() >= reach.abs() {
            let sign = if r == 0.0 { f.signum() } else { r.signum() };
            return Self { sign, by_r: 0.0, by_f: 0.0 };
        }
        // From −1, where it turns at the end of the step, to 0, where it turns at the start.
        let x = r / reach;
        let sign = f.signum() * (1.0 + 2.0 * x * (3.0 + x * (3.0 + x)));
        let by_x = 6.0 * f.signum() * (1.0 + x) * (1.0 + x);
        Self { sign, by_r: by_x / reach, by_f: -by_x * x / f }
    }
}

/// The map over a step.
#[derive(Clone, Copy)]
pub(super) struct Map {
    pub(super) h2: f64,
    pub(super) h3: f64,
    /// The velocity that waves add.
    pub(super) wave: f64,
    /// Mean acceleration.
    pub(super) g1: f64,
    /// ∂v(h)/∂v(0).
    pub(super) of_v: f64,
}

#[cfg(test)]
mod tests {
    use super::Reversal;

    /// ∫ r|r| over a step, by the antiderivative |r|³/3f.
    fn exact(r: f64, f: f64, h: f64) -> f64 {
        ((r + f * h).abs().powi(3) - r.abs().powi(3)) / (3.0 * f)
    }

    fn series(r: f64, f: f64, h: f64) -> f64 {
        let speed = r.abs();
        speed * r * h + speed * f * h * h + Reversal::of(r, f, h).sign * f * f * h.powi(3) / 3.0
    }

    #[test]
    fn drag_over_a_step_is_exact_where_the_vehicle_turns() {
        let (h, delta) = (0.1, 1e-7);
        for f in [1.5, -1.5] {
            for tenth in -15..=15 {
                let r = 0.01 * f64::from(tenth) + 1e-3;
                assert!((series(r, f, h) - exact(r, f, h)).abs() < 1e-12, "{r} {f}");
                let Reversal { by_r, by_f, .. } = Reversal::of(r, f, h);
                let sign = |r: f64, f: f64| Reversal::of(r, f, h).sign;
                let of_r = (sign(r + delta, f) - sign(r - delta, f)) / (2.0 * delta);
                let of_f = (sign(r, f + delta) - sign(r, f - delta)) / (2.0 * delta);
                assert!((of_r - by_r).abs() < 1e-5 && (of_f - by_f).abs() < 1e-5, "{r} {f}");
            }
        }
        assert_eq!(Reversal::of(0.0, -1.0, h).sign, -1.0);
    }
}
