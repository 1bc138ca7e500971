//! How a step changes with the fitted unknowns.

use super::step::{Map, Now, add_leak, add_slow, add_waves};
use super::{D, Discrete, Kalman, Layout, Row, Sources, Square, V};
use crate::estimate::filter_error::discrete::{Sensing, Slow, Waves};
use crate::estimate::filter_error::driven::SHAPING;
use crate::estimate::filter_error::parameters::{Sensor, Unknown};
use crate::estimate::propellers::{DriveNumber, Push};

impl<const S: usize, const N: usize> Kalman<'_, S, N> {
    /// ∂f and ∂a by each fitted unknown, the states held.
    pub(super) fn partials(&self, push: &Push, now: &Now) -> (Row<N>, Row<N>) {
        let (mut f_by, mut a_by) = ([0.0; N], [0.0; N]);
        let Now { r, speed, gamma, lost, a, .. } = *now;
        let sign = r.signum();
        let mut set = |unknown, f: f64, a: f64| {
            if let Some(j) = self.active.column(unknown).filter(|j| *j < N) {
                f_by[j] = f;
                a_by[j] = a;
            }
        };
        set(Unknown::Alpha, push.tau - lost * r, -lost);
        set(Unknown::Beta, speed * r, 2.0 * speed);
        set(Unknown::Mu, r, 1.0);
        set(Unknown::Bias, 1.0, 0.0);
        set(Unknown::Turning, push.turning, 0.0);
        set(Unknown::Current, -a, -2.0 * self.beta * sign);
        for (unknown, by) in [
            (Unknown::Inflow, push.gamma[0] + push.gamma[1]),
            (Unknown::InflowAhead, push.gamma[gamma]),
        ] {
            set(unknown, -self.alpha * by * r, -self.alpha * by);
        }
        for (i, unknown) in SHAPING.into_iter().enumerate() {
            let lost = if i < DriveNumber::OF_SPEED {
                let [forward, backward] = push.gamma_by.map(|by| by[i]);
                self.inflow.all * (forward + backward) + self.inflow.ahead * push.gamma_by[gamma][i]
            } else {
                0.0
            };
            set(unknown, self.alpha * (push.tau_by[i] - lost * r), -self.alpha * lost);
        }
        (f_by, a_by)
    }

    pub(super) fn predict_sensitivities(
        &mut self,
        push: &Push,
        now: &Now,
        phi: &Square<S>,
        step: &Discrete,
    ) {
        let (f_by, a_by) = self.partials(push, now);
        let own = self.own_sensitivities(&f_by, &a_by, now, step);
        let slope = self.turned(&self.transition_by_slope(now, step), phi);
        let special = self.special(now, phi, step);
        let mut a_all = a_by;
        for (j, a) in a_all.iter_mut().enumerate() {
            let c = self.layout.current.map_or(0.0, |c| self.state.x_by[c][j]);
            *a += now.bend * (self.state.x_by[V][j] - c);
        }
        let exact = self.transition(now, step);
        let mut x_by = own;
        for (i, row) in x_by.iter_mut().enumerate() {
            self.each_source(i, |l| {
                for (x, from) in row.iter_mut().zip(&self.state.x_by[l]) {
                    *x += exact[i][l] * from;
                }
            });
        }
        let mut half = [[[0.0; N]; S]; S];
        for (i, rows) in half.iter_mut().enumerate() {
            for (k, row) in rows.iter_mut().enumerate() {
                self.each_source(i, |l| {
                    let p_by = &self.state.p_by[l.min(k)][l.max(k)];
                    for (x, p) in row.iter_mut().zip(p_by) {
                        *x += phi[i][l] * p;
                    }
                });
            }
        }
        let mut p_by = [[[0.0; N]; S]; S];
        for i in 0..S {
            for j in i..S {
                let row = &mut p_by[i][j];
                for (x, a) in row.iter_mut().zip(&a_all) {
                    *x = slope[i][j] * a;
                }
                self.each_source(j, |l| {
                    for (x, half) in row.iter_mut().zip(&half[i][l]) {
                        *x += half * phi[j][l];
                    }
                });
            }
        }
        for (column, change) in special.iter().flatten() {
            for i in 0..S {
                for j in i..S {
                    p_by[i][j][*column] += change[i][j];
                }
            }
        }
        self.state.x_by = x_by;
        self.state.p_by = p_by;
    }

    #[inline]
    fn each_source(&self, i: usize, mut with: impl FnMut(usize)) {
        if S <= 3 {
            (0..S).for_each(with);
            return;
        }
        let Sources { at, len } = &self.sources[i];
        at[..*len].iter().for_each(|l| with(*l));
    }

    /// How the states after a step change with the unknowns, those before held.
    fn own_sensitivities(
        &self,
        f_by: &Row<N>,
        a_by: &Row<N>,
        now: &Now,
        step: &Discrete,
    ) -> [Row<N>; S] {
        let Now { a, f, reversal, map: Map { h2, h3, wave, g1, .. }, .. } = *now;
        let bend = 2.0 * self.beta * (reversal.sign + 0.5 * f * reversal.by_f);
        let (h, slow) = (step.h, &step.slow);
        let x = &self.state.x;
        let mut own = [[0.0; N]; S];
        for j in 0..N {
            let (f_j, a_j) = (f_by[j], a_by[j]);
            own[V][j] = h * f_j
                + h2 * (a_j * f + a * f_j)
                + h3 * (2.0 * a * a_j * f + a * a * f_j + 2.0 * bend * f * f_j)
                + a_j * (slow.twice * x[D] + 0.5 * h * wave);
            if let Some(p) = self.layout.position {
                own[p][j] = h2 * f_j + h3 * (a_j * f + a * f_j);
            }
            for i in 0..Sensing::states(self.layout.sensor) {
                let Sensing { j1, j2, .. } = &step.sense;
                own[self.layout.seen + i][j] = j1[i] * f_j + 0.5 * j2[i] * (a_j * g1 + a * f_j);
            }
        }
        if let Some(j) = self.column(Unknown::Beta) {
            own[V][j] += 2.0 * h3 * reversal.sign * f * f;
        }
        self.own_of_noise(&mut own, now, step);
        self.mirror_row(&mut own);
        if let Some((g, j)) = self.layout.gained.zip(self.column(Unknown::LogLeakCorrelation)) {
            own[g][j] += step.leak_by_t.once * x[g + 1];
            own[g + 1][j] += step.leak_by_t.rho * x[g + 1];
        }
        own
    }

    /// The part of [`Kalman::own_sensitivities`] by what shapes the other states.
    fn own_of_noise(&self, own: &mut [Row<N>; S], now: &Now, step: &Discrete) {
        let Now { a, map: Map { g1, .. }, .. } = *now;
        let (h, x) = (step.h, &self.state.x);
        let seen = self.layout.seen;
        let sensing = Sensing::states(self.layout.sensor);
        if let Some(j) = self.column(Unknown::LogCorrelation) {
            let (by, d) = (&step.slow_by_t, x[D]);
            let effect = [(by.once + a * by.twice) * d, by.twice * d, by.once * d];
            self.force_by(own, j, effect, a, step);
            own[D][j] += by.rho * d;
        }
        for (unknown, by) in [
            (Unknown::LogSwellFrequency, &step.waves_by_frequency),
            (Unknown::LogSwellDamping, &step.waves_by_damping),
        ] {
            let Some((j, w)) = self.column(unknown).zip(self.layout.waves) else { continue };
            let change = [0, 1].map(|i| by.e[i][0] * x[w] + by.e[i][1] * x[w + 1]);
            let effect = [(1.0 + 0.5 * a * h) * change[0], 0.5 * h * change[0], change[0]];
            self.force_by(own, j, effect, a, step);
            own[w][j] += change[0];
            own[w + 1][j] += change[1];
        }
        for unknown in [Unknown::LogSensorLag, Unknown::LogSensorWindow] {
            let Some(j) = self.column(unknown) else { continue };
            let Sensing { e, j0, j1, j2 } = &step.sense_by;
            for i in 0..sensing {
                let past: f64 = (0..sensing).map(|k| e[i][k] * x[seen + k]).sum();
                own[seen + i][j] += past + j0[i] * x[V] + j1[i] * g1 + 0.5 * j2[i] * a * g1;
            }
        }
    }

    /// What a force that changes with an unknown does to velocity and position; a sensor sees
    /// the last, the velocity that it adds.
    fn force_by(
        &self,
        own: &mut [Row<N>; S],
        j: usize,
        [velocity, position, added]: [f64; 3],
        a: f64,
        step: &Discrete,
    ) {
        own[V][j] += velocity;
        if let Some(p) = self.layout.position {
            own[p][j] += position;
        }
        for i in 0..Sensing::states(self.layout.sensor) {
            let Sensing { j1, j2, .. } = &step.sense;
            own[self.layout.seen + i][j] += (j1[i] + 0.5 * j2[i] * a) * added / step.h;
        }
    }

    /// How the covariance after a step changes with what shapes the states beside velocity:
    /// the column of the unknown, and the change.
    fn special(
        &self,
        now: &Now,
        phi: &Square<S>,
        step: &Discrete,
    ) -> [Option<(usize, Square<S>)>; 9] {
        let a = now.a;
        let h = step.h;
        let Layout { position, seen, sensor, waves, current, .. } = self.layout;
        let sensing = Sensing::states(sensor);
        let correlation = self.column(Unknown::LogCorrelation).map(|j| {
            let by = &step.slow_by_t;
            let mut psi = [[0.0; S]; S];
            psi[V][D] = by.once + a * by.twice;
            psi[D][D] = by.rho;
            if let Some(p) = position {
                psi[p][D] = by.twice;
            }
            for i in 0..sensing {
                let by_g1 = step.sense.j1[i] + 0.5 * step.sense.j2[i] * a;
                psi[seen + i][D] = by_g1 * by.once / h;
            }
            self.mirror_row(&mut psi);
            let mut change = self.turned(&psi, phi);
            self.add_noise(&mut change, |q| add_slow(q, by));
            (j, change)
        });
        let disturbance = self.column(Unknown::LogDisturbance).map(|j| {
            let mut change = [[0.0; S]; S];
            let Slow { q_vv, q_vd, q_dd, .. } = step.slow;
            let twice = Slow { q_vv: 2.0 * q_vv, q_vd: 2.0 * q_vd, q_dd: 2.0 * q_dd, ..step.slow };
            self.add_noise(&mut change, |q| add_slow(q, &twice));
            (j, change)
        });
        let sensor_time = |unknown| {
            self.column(unknown).map(|j| {
                let Sensing { e, j0, j1, j2 } = &step.sense_by;
                let mut psi = [[0.0; S]; S];
                for i in 0..sensing {
                    for k in 0..sensing {
                        psi[seen + i][seen + k] = e[i][k];
                    }
                    let by_force = j1[i] + 0.5 * j2[i] * a;
                    psi[seen + i][V] = j0[i] + by_force * a;
                    psi[seen + i][D] = by_force * step.slow.once / h;
                    if let Some(w) = waves {
                        psi[seen + i][w] = by_force * (step.waves.e[0][0] - 1.0) / h;
                        psi[seen + i][w + 1] = by_force * step.waves.e[0][1] / h;
                    }
                    if let Some(c) = current {
                        psi[seen + i][c] = -by_force * a;
                    }
                }
                self.mirror_row(&mut psi);
                (j, self.turned(&psi, phi))
            })
        };
        let of_waves = |unknown, by: &Waves| {
            let (j, w) = self.column(unknown).zip(waves)?;
            let mut psi = [[0.0; S]; S];
            for k in 0..2 {
                psi[V][w + k] = (1.0 + 0.5 * a * h) * by.e[0][k];
                if let Some(p) = position {
                    psi[p][w + k] = 0.5 * h * by.e[0][k];
                }
                for i in 0..2 {
                    psi[w + i][w + k] = by.e[i][k];
                }
                for i in 0..sensing {
                    let by_force = (step.sense.j1[i] + 0.5 * step.sense.j2[i] * a) / h;
                    psi[seen + i][w + k] = by_force * by.e[0][k];
                }
            }
            self.mirror_row(&mut psi);
            let mut change = self.turned(&psi, phi);
            self.add_noise(&mut change, |q| add_waves(q, w, by));
            Some((j, change))
        };
        let swell = self.column(Unknown::LogSwell).zip(waves).map(|(j, w)| {
            let mut change = [[0.0; S]; S];
            let twice = Waves { q: step.waves.q.map(|q| 2.0 * q), ..step.waves };
            self.add_noise(&mut change, |q| add_waves(q, w, &twice));
            (j, change)
        });
        let drift = self.column(Unknown::LogDrift).zip(current).map(|(j, c)| {
            let mut change = [[0.0; S]; S];
            change[c][c] = 2.0 * step.drift.q_dd;
            (j, change)
        });
        let sensor_unknown = match sensor {
            Sensor::Window => Unknown::LogSensorWindow,
            _ => Unknown::LogSensorLag,
        };
        [
            correlation,
            disturbance,
            sensor_time(sensor_unknown),
            of_waves(Unknown::LogSwellFrequency, &step.waves_by_frequency),
            of_waves(Unknown::LogSwellDamping, &step.waves_by_damping),
            swell,
            drift,
            self.column(Unknown::LogLeak).zip(self.layout.gained).map(|(j, g)| {
                let mut change = [[0.0; S]; S];
                let Slow { q_vv, q_vd, q_dd, .. } = step.leak;
                let twice =
                    Slow { q_vv: 2.0 * q_vv, q_vd: 2.0 * q_vd, q_dd: 2.0 * q_dd, ..step.leak };
                add_leak(&mut change, g, &twice);
                (j, change)
            }),
            self.column(Unknown::LogLeakCorrelation).zip(self.layout.gained).map(|(j, g)| {
                let by = &step.leak_by_t;
                let mut psi = [[0.0; S]; S];
                psi[g][g + 1] = by.once;
                psi[g + 1][g + 1] = by.rho;
                let mut change = self.turned(&psi, phi);
                add_leak(&mut change, g, by);
                (j, change)
            }),
        ]
    }
}
