//! Derivatives of mean and covariance by the noise parameters.

use nalgebra::{SVector, Vector3};

use super::navigation::{Crossed, InstrumentNoise, MapChange};
use super::noise::{Impulse, Noise, impulse_by_correlation};
use super::state::{Covariance, Observation, State, Transition};
use super::{Sweep, add_down_covariance};
use crate::motion::{times, times_transposed, with_down};
use crate::series::ROUNDING_S;

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Computes the process noise covariance of one axis's disturbance over a step of `h` seconds.
    pub(super) fn axis_process(&self, axis: usize, h: f64) -> Covariance<N, M, K> {
        let (sigma, t) = (self.noise.disturbance[axis], self.noise.correlation_s[axis]);
        self.spread(axis, &Impulse::over(h, sigma, t))
    }

    pub(super) fn spread(&self, axis: usize, impulse: &Impulse) -> Covariance<N, M, K> {
        let of_velocity = self.plant.inverse().column(axis).into_owned();
        let column: SVector<f64, M> = with_down(&of_velocity, Vector3::zeros);
        let mut added = self.zero_covariance();
        added.xx = column * column.transpose() * impulse.variance;
        added.xf.set_column(axis, &(column * impulse.with_force));
        added.ff[(axis, axis)] = impulse.of_force;
        added
    }

    /// Computes the process noise covariance of all disturbances over a step.
    pub(super) fn process(&self, h: f64) -> Covariance<N, M, K> {
        let mut sum = self.zero_covariance();
        (0..N).for_each(|axis| sum.add(&self.axis_process(axis, h), 1.0));
        self.add_navigation_process(h, &mut sum);
        sum
    }

    /// Computes the derivative of a filter step by the k-th logarithm of the noise.
    pub(super) fn change(&self, k: usize, h: f64) -> Change {
        let axis = k % N;
        let mut change = Change::default();
        if let Some(of_swell) = k.checked_sub(self.noise.first_of_swell()) {
            self.set_swell_change(of_swell, h, &mut change);
            return change;
        }
        if let Some(of_drift) = k.checked_sub(self.noise.first_of_drift()) {
            let drift = self.noise.of_water();
            let by = match of_drift {
                0 => 2.0 * drift.process(h),
                _ => {
                    let rho = drift.fade(h);
                    let by = rho * h / drift.correlation_s;
                    change.map = [0, 1].map(|k| MapChange { row: k, from: k, by }).to_vec();
                    -2.0 * drift.std_m_s.powi(2) * rho * by
                }
            };
            change.process = vec![(0, by), (1, by)];
            return change;
        }
        if let Some(place) = k.checked_sub(Noise::<N, M>::INSTRUMENTS) {
            if let Some(number) = self.noise.instruments.needed().nth(place) {
                self.set_sensor_change(number, h, &mut change);
            }
            return change;
        }
        let (sigma, t) = (self.noise.disturbance[axis], self.noise.correlation_s[axis]);
        match k / N {
            0 => change.impulse = Some((axis, Impulse::over(h, sigma, t).doubled())),
            1 => {
                let fade_by = self.fade(h)[axis] * h / t;
                change.impulse = Some((axis, Impulse::by_correlation(h, sigma, t)));
                change.fade = Some(Fade { axis, by: fade_by, push: impulse_by_correlation(h / t) });
            }
            _ => {}
        }
        change
    }

    /// Returns the change of a step's process noise as a covariance.
    fn process_change(&self, change: &Change) -> Covariance<N, M, K> {
        let impulse = change.impulse.as_ref();
        let mut process = impulse
            .map_or_else(|| self.zero_covariance(), |(axis, impulse)| self.spread(*axis, impulse));
        change.process.iter().for_each(|(state, by)| process.oo[(*state, *state)] = *by);
        process
    }

    /// Returns the derivatives of a step by all logarithms of the noise.
    pub(super) fn changes(&self, h: f64) -> Vec<Change> {
        (0..self.noise.count()).map(|k| self.change(k, h)).collect()
    }

    pub(super) fn noise_sensitivities(&self) -> Vec<NoiseSensitivity<N, M, K>> {
        let none = NoiseSensitivity {
            mean: State::zeros(self.states()),
            covariance: self.zero_covariance(),
        };
        let mut sensitivities = vec![none; self.noise.count()];
        if let Some(drift) = self.noise.drift {
            let by = 2.0 * drift.std_m_s.powi(2);
            let first = self.noise.first_of_drift();
            sensitivities[first].covariance.add_initial_current(&self.initial_current_map(), by);
        }
        for axis in 0..N {
            sensitivities[axis].covariance.ff[(axis, axis)] =
                2.0 * self.noise.disturbance[axis].powi(2);
            if self.is_measured(axis) {
                sensitivities[2 * N + axis].covariance.xx =
                    self.initial_velocity_covariance(axis) * 2.0;
            }
        }
        if M > N {
            let of_down = self.initial_down_covariance() * (2.0 * self.noise.attitude.powi(2));
            add_down_covariance(
                &mut sensitivities[Noise::<N, M>::ATTITUDE].covariance.xx,
                &of_down,
            );
        }
        let instruments = &self.noise.instruments;
        if instruments.active[InstrumentNoise::OFFSET] {
            let place = Noise::<N, M>::INSTRUMENTS + instruments.place(InstrumentNoise::OFFSET);
            let by = 2.0 * instruments.numbers[InstrumentNoise::OFFSET].powi(2);
            let offsets = self.schedule.layout.offset.into_iter().flatten();
            offsets.for_each(|state| sensitivities[place].covariance.oo[(state, state)] = by);
        }
        for (axis, states) in self.swell_states() {
            let by = self.noise.swell.map_or(0.0, |swell| 2.0 * swell.std[axis].powi(2));
            let own = &mut sensitivities[self.noise.first_of_swell() + axis].covariance;
            states.into_iter().for_each(|state| own.oo[(state, state)] = by);
        }
        sensitivities
    }
}

/// Cache of values that depend on the step length only.
pub(super) struct StepCache<T>(Vec<(f64, T)>);

impl<T> Default for StepCache<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> StepCache<T> {
    /// Maximum number of step lengths kept: sensors of different rates produce few.
    const MOST: usize = 8;

    pub(super) fn get(&mut self, length_s: f64, make: impl FnOnce(f64) -> T) -> &T {
        let Self(met) = self;
        let is_known = |(known_s, _): &(f64, T)| (known_s - length_s).abs() < ROUNDING_S;
        let at = met.iter().position(is_known).unwrap_or_else(|| {
            if met.len() == Self::MOST {
                met.clear();
            }
            met.push((length_s, make(length_s)));
            met.len() - 1
        });
        &met[at].1
    }
}

/// Process noise covariance of a step, and its derivatives by the noise parameters.
pub(super) struct Process<const N: usize, const M: usize, const K: usize> {
    pub(super) whole: Covariance<N, M, K>,
    pub(super) changes: Vec<(Change, Covariance<N, M, K>)>,
}

impl<const N: usize, const M: usize, const K: usize> Process<N, M, K> {
    pub(super) fn new(pass: &Sweep<'_, N, M, K>, length_s: f64) -> Self {
        let with_covariance = |change: Change| {
            let process = pass.process_change(&change);
            (change, process)
        };
        let changes = pass.changes(length_s).into_iter().map(with_covariance).collect();
        Self { whole: pass.process(length_s), changes }
    }
}

/// Derivative of a filter step by one noise parameter.
#[derive(Default)]
pub(super) struct Change {
    /// Change of the process noise of an axis's disturbance.
    pub(super) impulse: Option<(usize, Impulse)>,
    /// Change of the process noise of navigation states, by state.
    pub(super) process: Vec<(usize, f64)>,
    pub(super) fade: Option<Fade>,
    /// Changes of the map of navigation states.
    pub(super) map: Vec<MapChange>,
}

/// Change of the decay of one axis's disturbance.
pub(super) struct Fade {
    pub(super) axis: usize,
    /// Derivative of the decay factor over the step.
    pub(super) by: f64,
    /// Relative change of the disturbance's effect on velocity.
    pub(super) push: f64,
}

/// Derivatives of mean and covariance by one noise parameter.
#[derive(Clone)]
pub(super) struct NoiseSensitivity<const N: usize, const M: usize, const K: usize> {
    pub(super) mean: State<N, M, K>,
    pub(super) covariance: Covariance<N, M, K>,
}

impl<const N: usize, const M: usize, const K: usize> NoiseSensitivity<N, M, K> {
    /// Propagates the derivatives; `covariance` and `mean` are nominal values before the step,
    /// `crossed` the nominal covariance between states before and after it.
    pub(super) fn predict(
        &mut self,
        step: &Transition<N, M, K>,
        (covariance, crossed): (&Covariance<N, M, K>, Option<&Crossed<N, M, K>>),
        mean: &State<N, M, K>,
        (change, process): &(Change, Covariance<N, M, K>),
    ) {
        let mut own = crossed.map(|_| (self.covariance, self.covariance.crossed(step)));
        self.covariance.predict_motion(step, process);
        let mut pushed = SVector::zeros();
        if let Some(fade) = &change.fade {
            pushed = self.fade(fade, step, covariance);
            if let Some((_, own)) = &mut own {
                own.fade(fade, &pushed, covariance);
            }
            pushed *= mean.disturbance[fade.axis];
        }
        self.mean.step(step, &pushed);
        if let Some(fade) = &change.fade {
            self.mean.disturbance[fade.axis] += fade.by * mean.disturbance[fade.axis];
        }
        if let (Some((before, own)), Some(crossed), Some(rows)) = (own, crossed, &step.rows) {
            self.covariance.predict_navigation(&before, &own, (rows, process));
            if !change.map.is_empty() {
                self.covariance.add_map_changes(&change.map, covariance, crossed, rows);
                for MapChange { row, from, by } in &change.map {
                    self.mean.navigation[*row] += by * mean.navigation[*from];
                }
            }
        }
    }

    /// Adds the effect of a changed disturbance decay on the covariance of motion and disturbance;
    /// returns the change of velocity per unit of disturbance.
    fn fade(
        &mut self,
        fade: &Fade,
        step: &Transition<N, M, K>,
        covariance: &Covariance<N, M, K>,
    ) -> SVector<f64, M> {
        let axis = fade.axis;
        let push = step.by_disturbance.column(axis) * fade.push;
        let mut v =
            times(&step.by_motion, &covariance.xf) + times(&step.by_disturbance, &covariance.ff);
        if let Some(pushing) = step.pushing() {
            v += times_transposed(pushing, &covariance.fo);
        }
        let own = v.column(axis).into_owned();
        self.covariance.xx += push * own.transpose() + own * push.transpose();
        self.covariance.xf +=
            push * covariance.ff.row(axis).transpose().component_mul(&step.fade).transpose();
        for i in 0..M {
            self.covariance.xf[(i, axis)] += own[i] * fade.by;
        }
        for i in 0..N {
            let cross = covariance.ff[(i, axis)] * step.fade[i] * fade.by;
            self.covariance.ff[(i, axis)] += cross;
            self.covariance.ff[(axis, i)] += cross;
        }
        push
    }

    /// Returns the derivatives of innovation and innovation variance, then updates those of the
    /// state.
    pub(super) fn correct(
        &mut self,
        observation: &Observation,
        (e, s): (f64, f64),
        r_by: f64,
        column: &State<N, M, K>,
    ) -> (f64, f64) {
        let column_by = self.covariance.observed_by(observation);
        let s_by = column_by.observed_by(observation) + r_by;
        let e_by = -self.mean.observed_by(observation);
        // K = c/S, so that ∂K = (∂c − K ∂S)/S, and ∂(c cᵀ/S) = w cᵀ + c wᵀ with w = (∂c − ½ K ∂S)/S.
        let gain = column.scaled(1.0 / s);
        let mut half = column_by.scaled(1.0 / s);
        half.add(&gain, -0.5 * s_by / s);
        self.mean.add(&half, e);
        self.mean.add(&gain, e_by - 0.5 * s_by / s * e);
        self.covariance.subtract_both(&half, column);
        (e_by, s_by)
    }
}

impl<const N: usize, const M: usize, const K: usize> Crossed<N, M, K> {
    /// Adds the effect of a changed disturbance decay on the covariance between states before and
    /// after the step; `push` is the change of velocity per unit of disturbance, `covariance` that
    /// before the step.
    fn fade(&mut self, fade: &Fade, push: &SVector<f64, M>, covariance: &Covariance<N, M, K>) {
        let axis = fade.axis;
        let own = covariance.xf.column(axis);
        self.xx += own * push.transpose();
        for i in 0..M {
            self.xf[(i, axis)] += own[i] * fade.by;
        }
        for k in 0..covariance.count {
            let with_force = covariance.fo[(axis, k)];
            for i in 0..M {
                self.xo[(i, k)] += push[i] * with_force;
            }
            self.fo[(axis, k)] += fade.by * with_force;
        }
    }
}
