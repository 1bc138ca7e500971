//! How mean and covariance change with the numbers of the noise.

use nalgebra::{Matrix2, SVector, Vector3};

use super::noise::{Impulse, Noise, push_by};
use super::state::{Covariance, Seen, State, Transition};
use super::{Pass, add_of_down};
use crate::motion::{times, with_down};
use crate::series::ROUNDING_S;

impl<const N: usize, const M: usize> Pass<'_, N, M> {
    /// What one axis's disturbance adds to the covariance over a step.
    pub(super) fn process_of(&self, axis: usize, h: f64) -> Covariance<N, M> {
        let (sigma, t) = (self.noise.disturbance[axis], self.noise.correlation_s[axis]);
        self.spread(axis, &Impulse::over(h, sigma, t))
    }

    pub(super) fn spread(&self, axis: usize, impulse: &Impulse) -> Covariance<N, M> {
        let of_velocity = self.plant.inverse().column(axis).into_owned();
        let column: SVector<f64, M> = with_down(&of_velocity, Vector3::zeros);
        let mut added = Covariance::zeros();
        added.xx = column * column.transpose() * impulse.variance;
        added.xf.set_column(axis, &(column * impulse.with_force));
        added.ff[(axis, axis)] = impulse.of_force;
        added
    }

    /// What all disturbances add to the covariance over a step.
    pub(super) fn process(&self, h: f64) -> Covariance<N, M> {
        let mut sum = Covariance::zeros();
        (0..N).for_each(|axis| sum.add(&self.process_of(axis, h), 1.0));
        sum.ww = Matrix2::identity() * self.noise.of_water().process(h);
        sum
    }

    /// How the k-th logarithm of the noise changes a step.
    pub(super) fn process_change(&self, k: usize, h: f64) -> Change<N, M> {
        let axis = k % N;
        let mut change = Change { process: Covariance::zeros(), fade: None, fade_of_water: 0.0 };
        if let Some(of_drift) = k.checked_sub(Noise::<N, M>::DRIFT) {
            let drift = self.noise.of_water();
            let by = match of_drift {
                0 => 2.0 * drift.process(h),
                _ => {
                    let rho = drift.fade(h);
                    change.fade_of_water = rho * h / drift.correlation_s;
                    -2.0 * drift.std_m_s.powi(2) * rho * change.fade_of_water
                }
            };
            change.process.ww = Matrix2::identity() * by;
            return change;
        }
        match k / N {
            0 => change.process.add(&self.process_of(axis, h), 2.0),
            1 => {
                let (sigma, t) = (self.noise.disturbance[axis], self.noise.correlation_s[axis]);
                let fade_by = self.fade(h)[axis] * h / t;
                change.process = self.spread(axis, &Impulse::by_correlation(h, sigma, t));
                change.fade = Some(Fade { axis, by: fade_by, push: push_by(h / t) });
            }
            _ => {}
        }
        change
    }

    pub(super) fn noise_followers(&self) -> Vec<Follower<N, M>> {
        let mut followers = vec![Follower::zeros(); self.noise.count()];
        if let Some(drift) = self.noise.drift {
            let by = 2.0 * drift.std_m_s.powi(2);
            followers[Noise::<N, M>::DRIFT].covariance.of_first_water(&self.first_water(), by);
        }
        for axis in 0..N {
            followers[axis].covariance.ff[(axis, axis)] =
                2.0 * self.noise.disturbance[axis].powi(2);
            followers[2 * N + axis].covariance.xx = self.first_of_velocity(axis) * 2.0;
        }
        if M > N {
            let of_down = self.first_of_down() * (2.0 * self.noise.attitude.powi(2));
            add_of_down(&mut followers[Noise::<N, M>::ATTITUDE].covariance.xx, &of_down);
        }
        followers
    }
}

/// What belongs to a step of a length, for the lengths that were met last.
pub(super) struct Steps<T>(Vec<(f64, T)>);

impl<T> Default for Steps<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Steps<T> {
    /// Steps of so many lengths are kept: instruments of different rates make few.
    const MOST: usize = 8;

    pub(super) fn of(&mut self, length_s: f64, make: impl FnOnce(f64) -> T) -> &T {
        let Self(met) = self;
        let is_it = |(known_s, _): &(f64, T)| (known_s - length_s).abs() < ROUNDING_S;
        let at = met.iter().position(is_it).unwrap_or_else(|| {
            if met.len() == Self::MOST {
                met.clear();
            }
            met.push((length_s, make(length_s)));
            met.len() - 1
        });
        &met[at].1
    }
}

/// What a step of a length adds to the covariance, and how the noise changes that.
pub(super) struct Process<const N: usize, const M: usize> {
    pub(super) whole: Covariance<N, M>,
    pub(super) changes: Vec<Change<N, M>>,
}

impl<const N: usize, const M: usize> Process<N, M> {
    pub(super) fn new(pass: &Pass<'_, N, M>, length_s: f64) -> Self {
        let change = |k| pass.process_change(k, length_s);
        let changes = (0..pass.noise.count()).map(change).collect();
        Self { whole: pass.process(length_s), changes }
    }
}

/// How a step of the filter changes with one number of the noise.
pub(super) struct Change<const N: usize, const M: usize> {
    pub(super) process: Covariance<N, M>,
    pub(super) fade: Option<Fade>,
    /// The change of what is left of the current's changes after a step.
    pub(super) fade_of_water: f64,
}

/// An axis whose disturbance fades otherwise.
pub(super) struct Fade {
    pub(super) axis: usize,
    /// The change of what is left of it after a step.
    pub(super) by: f64,
    /// The change of what it does to velocity, as a part of that.
    pub(super) push: f64,
}

/// How mean and covariance change with one number of the noise.
#[derive(Clone)]
pub(super) struct Follower<const N: usize, const M: usize> {
    pub(super) mean: State<N, M>,
    pub(super) covariance: Covariance<N, M>,
}

impl<const N: usize, const M: usize> Follower<N, M> {
    pub(super) fn zeros() -> Self {
        Self { mean: State::zeros(), covariance: Covariance::zeros() }
    }

    pub(super) fn predict(
        &mut self,
        step: &Transition<N, M>,
        covariance: &Covariance<N, M>,
        mean: &State<N, M>,
        change: &Change<N, M>,
    ) {
        self.covariance.predict(step, &change.process);
        self.mean.step(step);
        if let Some(fade) = &change.fade {
            self.fade(fade, step, covariance, mean);
        }
        if change.fade_of_water > 0.0 {
            self.fade_water(change.fade_of_water, step, covariance, mean);
        }
    }

    pub(super) fn fade_water(
        &mut self,
        by: f64,
        step: &Transition<N, M>,
        covariance: &Covariance<N, M>,
        mean: &State<N, M>,
    ) {
        self.mean.water += mean.water * by;
        let own = step.by_motion * covariance.xw + step.by_disturbance * covariance.fw;
        self.covariance.xw += own * by;
        for j in 0..2 {
            let faded = covariance.fw.column(j).component_mul(&step.fade) * by;
            self.covariance.fw.set_column(j, &(self.covariance.fw.column(j) + faded));
        }
        self.covariance.ww += covariance.ww * (2.0 * step.fade_of_water * by);
    }

    pub(super) fn fade(
        &mut self,
        fade: &Fade,
        step: &Transition<N, M>,
        covariance: &Covariance<N, M>,
        mean: &State<N, M>,
    ) {
        let axis = fade.axis;
        let push = step.by_disturbance.column(axis) * fade.push;
        self.mean.motion += push * mean.disturbance[axis];
        self.mean.disturbance[axis] += fade.by * mean.disturbance[axis];
        let v =
            times(&step.by_motion, &covariance.xf) + times(&step.by_disturbance, &covariance.ff);
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
        self.covariance.xw += push * covariance.fw.row(axis) * step.fade_of_water;
        let own = covariance.fw.row(axis) * (fade.by * step.fade_of_water);
        self.covariance.fw.set_row(axis, &(self.covariance.fw.row(axis) + own));
    }

    /// The changes of innovation and its variance; then of the state.
    pub(super) fn correct(
        &mut self,
        seen: &Seen,
        (e, s): (f64, f64),
        r_by: f64,
        column: &State<N, M>,
    ) -> (f64, f64) {
        let column_by = self.covariance.seen(seen);
        let s_by = column_by.seen(seen) + r_by;
        let e_by = -self.mean.seen(seen);
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
