//! What a measurement tells the state and the likelihood.

use super::{Innovation, Kalman, Row};
use crate::estimate::filter_error::parameters::Unknown;
use crate::estimate::filter_error::schedule::{Instrument, Measured};

impl<const S: usize, const N: usize> Kalman<'_, S, N> {
    /// Takes in what was measured at an instant.
    pub(super) fn measure(&mut self, measured: &Measured) {
        if let Some(y) = measured.velocity {
            self.measure_velocity(y, measured.lever);
        }
        if let Some((y, p)) = measured.position.zip(self.layout.position) {
            let error = y - self.state.x[p];
            self.take_in(Instrument::Position, p, 1.0, error, [0.0; N]);
        }
        if let Some(g) = self.layout.gained.filter(|_| measured.opens) {
            if let Some((mean, over_s)) = measured.acceleration {
                let error = mean - self.acceleration_offset - self.state.x[g] / over_s;
                let mut own = [0.0; N];
                if let Some(j) = self.column(Unknown::AccelerationOffset) {
                    own[j] = -1.0;
                }
                self.take_in(Instrument::Acceleration, g, 1.0 / over_s, error, own);
            }
            self.state.forget(g);
        }
    }

    fn measure_velocity(&mut self, y: f64, rates: [f64; 2]) {
        let seen = self.layout.seen;
        let turning = self.lever[0] * rates[0] + self.lever[1] * rates[1];
        let shown = self.state.x[seen];
        let error = y - turning - self.offset - self.scale * shown;
        let mut own = [0.0; N];
        let by = [
            (Unknown::LeverFirst, -rates[0]),
            (Unknown::LeverSecond, -rates[1]),
            (Unknown::VelocityOffset, -1.0),
            (Unknown::VelocityScale, -shown),
        ];
        for (unknown, by) in by {
            if let Some(j) = self.column(unknown) {
                own[j] = by;
            }
        }
        self.take_in(Instrument::Velocity, seen, self.scale, error, own);
    }

    /// Takes in a measurement of `g x[i]`, with what its error changes by beside the state.
    fn take_in(&mut self, instrument: Instrument, i: usize, g: f64, e: f64, own: Row<N>) {
        let r = self.noise[instrument as usize];
        let noise_by = self.column(match instrument {
            Instrument::Velocity => Unknown::LogVelocityNoise,
            Instrument::Position => Unknown::LogPositionNoise,
            Instrument::Acceleration => Unknown::LogAccelerationNoise,
        });
        let scale_by = match instrument {
            Instrument::Velocity => self.column(Unknown::VelocityScale),
            Instrument::Position | Instrument::Acceleration => None,
        };
        let s = &mut self.state;
        let column: [f64; S] = std::array::from_fn(|k| g * s.p[i.min(k)][i.max(k)]);
        let total = g * column[i] + r;
        let weight = 1.0 / total;
        let (mut e_by, mut total_by) = (own, [0.0; N]);
        if N > 0 {
            let mut column_by: [Row<N>; S] = [[0.0; N]; S];
            for (k, row) in column_by.iter_mut().enumerate() {
                for (x, p) in row.iter_mut().zip(&s.p_by[i.min(k)][i.max(k)]) {
                    *x = g * p;
                }
            }
            if let Some(j) = scale_by {
                for (row, c) in column_by.iter_mut().zip(&column) {
                    row[j] += c / g;
                }
            }
            for j in 0..N {
                e_by[j] -= g * s.x_by[i][j];
                total_by[j] = g * column_by[i][j];
            }
            if let Some(j) = scale_by {
                total_by[j] += column[i];
            }
            if let Some(j) = noise_by {
                total_by[j] += 2.0 * r;
            }
            let (pull, pull_total) = (e * weight, e * weight * weight);
            for k in 0..S {
                for j in 0..N {
                    s.x_by[k][j] += column_by[k][j] * pull + column[k] * weight * e_by[j]
                        - column[k] * pull_total * total_by[j];
                }
                for l in k..S {
                    let both = column[k] * column[l] * weight * weight;
                    let (ck, cl) = (column[k] * weight, column[l] * weight);
                    for j in 0..N {
                        s.p_by[k][l][j] -=
                            column_by[k][j] * cl + ck * column_by[l][j] - both * total_by[j];
                    }
                }
            }
        }
        for k in 0..S {
            s.x[k] += column[k] * e * weight;
            for l in k..S {
                s.p[k][l] -= column[k] * column[l] * weight;
            }
        }
        if let Some(innovations) = &mut self.innovations {
            let gain = g * column[i] * weight;
            let (error, std, gain) = (e as f32, total.sqrt() as f32, gain as f32);
            innovations.push(Innovation { instrument, error, std, gain });
        }
        self.account(e, total, &e_by, &total_by);
    }

    /// Adds an innovation to the likelihood.
    fn account(&mut self, e: f64, total: f64, e_by: &Row<N>, total_by: &Row<N>) {
        let weight = 1.0 / total;
        self.cost += 0.5 * (total.ln() + e * e * weight);
        let half = 0.5 * weight * (1.0 - e * e * weight);
        for j in 0..N {
            self.gradient[j] += e_by[j] * e * weight + total_by[j] * half;
            let (by_e, by_total) = (e_by[j] * weight, 0.5 * total_by[j] * weight * weight);
            // It is symmetric: half of it will do.
            for i in j..N {
                self.information[j][i] += e_by[i] * by_e + total_by[i] * by_total;
            }
        }
    }
}
