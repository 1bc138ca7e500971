//! Derivatives of mean and covariance by the noise parameters.

use nalgebra::{SVector, Vector3};

use super::current::CurrentChange;
use super::navigation::{Crossed, InstrumentNoise, MapChange};
use super::noise::{Impulse, NoiseNumber, Swell, impulse_by_correlation};
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
        (0..self.noise.axes()).for_each(|axis| sum.add(&self.axis_process(axis, h), 1.0));
        self.add_navigation_process(h, &mut sum);
        sum
    }

    /// Computes the derivative of a filter step by the logarithm of one number of the noise.
    fn change(&self, number: NoiseNumber, h: f64) -> Change {
        let noise = self.noise;
        let of_swell =
            |of: &dyn Fn(&Swell) -> Change| noise.swell.as_ref().map(of).unwrap_or_default();
        match number {
            NoiseNumber::Disturbance(axis) => {
                let (sigma, t) = (noise.disturbance[axis], noise.correlation_s[axis]);
                let impulse = Some((axis, Impulse::over(h, sigma, t).doubled()));
                Change { impulse, ..Change::default() }
            }
            NoiseNumber::Correlation(axis) => {
                let (sigma, t) = (noise.disturbance[axis], noise.correlation_s[axis]);
                let by = self.fade(h)[axis] * h / t;
                let impulse = Some((axis, Impulse::by_correlation(h, sigma, t)));
                let fade = Some(Fade { axis, by, push: impulse_by_correlation(h / t) });
                Change { impulse, fade, ..Change::default() }
            }
            NoiseNumber::Velocity(_) | NoiseNumber::Attitude => Change::default(),
            NoiseNumber::Instrument(number) => self.sensor_change(number, h),
            NoiseNumber::Drift => {
                let added = 2.0 * noise.of_water().process(h);
                Change { current: Some(CurrentChange { fade: 0.0, added }), ..Change::default() }
            }
            NoiseNumber::DriftCorrelation => {
                let drift = noise.of_water();
                let rho = drift.fade(h);
                let by = rho * h / drift.correlation_s;
                let added = -2.0 * drift.std_m_s.powi(2) * rho * by;
                Change { current: Some(CurrentChange { fade: by, added }), ..Change::default() }
            }
            NoiseNumber::Swell(axis) => of_swell(&|swell| self.swell_force_change(swell, axis, h)),
            NoiseNumber::SwellFrequency => {
                of_swell(&|swell| self.swell_shape_change(swell, swell.turn_changes(h)[0], h))
            }
            NoiseNumber::SwellDamping => {
                of_swell(&|swell| self.swell_shape_change(swell, swell.turn_changes(h)[1], h))
            }
            NoiseNumber::Jitter => Change { jitter: 2.0, ..Change::default() },
        }
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
        self.noise.numbers().into_iter().map(|number| self.change(number, h)).collect()
    }

    pub(super) fn noise_sensitivities(&self) -> Vec<NoiseSensitivity<N, M, K>> {
        let none = NoiseSensitivity {
            mean: State::zeros(self.states()),
            covariance: self.zero_covariance(),
        };
        let of = |number: NoiseNumber| {
            let mut own = none.clone();
            let covariance = &mut own.covariance;
            let squared = |std: f64| 2.0 * std.powi(2);
            match number {
                NoiseNumber::Disturbance(axis) => {
                    covariance.ff[(axis, axis)] = squared(self.noise.disturbance[axis]);
                }
                NoiseNumber::Velocity(axis) if self.is_measured(axis) => {
                    covariance.xx = self.initial_velocity_covariance(axis) * 2.0;
                }
                NoiseNumber::Attitude => {
                    let std = self.noise.attitude.unwrap_or_default();
                    let of_down = self.initial_down_covariance() * squared(std);
                    add_down_covariance(&mut covariance.xx, &of_down);
                }
                NoiseNumber::Instrument(InstrumentNoise::OFFSET) => {
                    let by = squared(self.noise.instruments.numbers[InstrumentNoise::OFFSET]);
                    let offsets = self.schedule.layout.offset.into_iter().flatten();
                    offsets.for_each(|state| covariance.oo[(state, state)] = by);
                }
                NoiseNumber::Drift => {
                    let by = squared(self.noise.of_water().std_m_s);
                    covariance.add_current(&self.by_current(&self.schedule.instants[0]), by);
                }
                NoiseNumber::Swell(axis) => {
                    let by =
                        self.noise.swell.as_ref().map_or(0.0, |swell| squared(swell.std[axis]));
                    let own = self.swell_states().filter(|(other, _)| *other == axis);
                    own.flat_map(|(_, states)| states)
                        .for_each(|state| covariance.oo[(state, state)] = by);
                }
                _ => {}
            }
            own
        };
        self.noise.numbers().into_iter().map(of).collect()
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
    /// Change of the step of the current.
    pub(super) current: Option<CurrentChange>,
    /// Change of what the jitter of thrust adds to the covariance, relative to it.
    pub(super) jitter: f64,
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
        step.jitter.iter().for_each(|jitter| self.covariance.xx += **jitter * change.jitter);
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
            if let Some(current) = &step.current {
                self.covariance.fade_current(current);
                if let Some(change) = &change.current {
                    let changed = (current, change);
                    self.covariance.add_current_change(changed, covariance, (crossed, rows));
                    self.mean.add_current_change(changed, mean);
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
