//! The extended Kalman filter of one trial, with the sensitivities of its innovations.
//!
//! States velocity v, disturbance d and, where it is measured, position p:
//! `v̇ = α τ* + (β|r| + μ − α k_in γ) r + bias + d` with r = v − u, `ḋ = −d/T + w`, `ṗ = v`.

use nalgebra::{DMatrix, DVector};

use super::drive::{Drive, Push, SHAPING};
use super::parameters::{Active, Unknown, Values};
use super::schedule::{Measured, Measurements, Stop};

/// Where the filter starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Start {
    /// Mean velocity.
    pub(crate) velocity: f64,
    /// Its variance.
    pub(crate) velocity_variance: f64,
    /// Mean position.
    pub(crate) position: f64,
    /// Its variance.
    pub(crate) position_variance: f64,
}

/// The likelihood of one trial, and how it changes with the fitted unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Likelihood {
    /// ½ Σ (ln S + e²/S).
    pub(crate) cost: f64,
    /// Its gradient; shape (n,).
    pub(crate) gradient: DVector<f64>,
    /// The Fisher information, Σ (e_i e_j / S + ½ S_i S_j / S²); shape (n, n).
    pub(crate) information: DMatrix<f64>,
    /// e/√S of each measurement, if they were asked for.
    pub(crate) innovations: Vec<f64>,
}

/// How a state or covariance changes with each fitted unknown. N is at least their number;
/// the width is known to the compiler so that it works on several at once.
type Row<const N: usize> = [f64; N];

/// Mean and covariance of the states, with their sensitivities.
struct State<const N: usize> {
    v: f64,
    d: f64,
    p: f64,
    vv: f64,
    vd: f64,
    dd: f64,
    pp: f64,
    pv: f64,
    pd: f64,
    v_by: Row<N>,
    d_by: Row<N>,
    p_by: Row<N>,
    vv_by: Row<N>,
    vd_by: Row<N>,
    dd_by: Row<N>,
    pp_by: Row<N>,
    pv_by: Row<N>,
    pd_by: Row<N>,
}

/// What depends on the length of a step alone.
#[derive(Clone, Copy)]
struct Discrete {
    h: f64,
    /// d decays by this.
    rho: f64,
    rho_by_t: f64,
    /// Process noise.
    q_vv: f64,
    q_vd: f64,
    q_dd: f64,
    q_dd_by_t: f64,
}

/// The filter of one trial at one set of values, with `N` columns of sensitivities and
/// with or without a position state.
struct Kalman<'a, const N: usize, const POSITION: bool> {
    active: &'a Active,
    alpha: f64,
    beta: f64,
    mu: f64,
    bias: f64,
    current: f64,
    inflow: f64,
    turning: f64,
    lever: [f64; 2],
    offset: f64,
    sigma2: f64,
    inverse_t: f64,
    r_velocity: f64,
    r_position: f64,
    /// 1 in the column of an unknown, if it is fitted.
    is_beta: Row<N>,
    is_sigma: Row<N>,
    is_t: Row<N>,
    r_velocity_by: Row<N>,
    r_position_by: Row<N>,
    is_lever: [Row<N>; 2],
    is_offset: Row<N>,
    state: State<N>,
    cost: f64,
    gradient: Row<N>,
    information: [Row<N>; N],
    innovations: Option<Vec<f64>>,
}

/// What to find out beside the cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// Nothing.
    Cost,
    /// Gradient and information.
    Sensitivities,
    /// The normalised innovations.
    Innovations,
}

/// The likelihood of one trial.
pub(crate) fn likelihood(
    measurements: &Measurements,
    drive: Drive<'_>,
    active: &Active,
    values: &Values,
    start: Start,
    wanted: Wanted,
) -> Likelihood {
    let columns = if wanted == Wanted::Sensitivities { active.len() } else { 0 };
    let steps = measurements.steps();
    macro_rules! run {
        ($n:literal) => {
            if measurements.position().is_some() {
                Kalman::<$n, true>::new(active, values, start, wanted).run(steps, drive)
            } else {
                Kalman::<$n, false>::new(active, values, start, wanted).run(steps, drive)
            }
        };
    }
    match columns {
        0 => run!(0),
        1..=6 => run!(6),
        7..=8 => run!(8),
        9..=10 => run!(10),
        11..=12 => run!(12),
        13..=14 => run!(14),
        _ => run!(18),
    }
}

impl<'a, const N: usize, const POSITION: bool> Kalman<'a, N, POSITION> {
    fn new(active: &'a Active, values: &Values, start: Start, wanted: Wanted) -> Self {
        let of = |unknown| values.get(unknown);
        let one_at = |unknown, x: f64| {
            let mut row = [0.0; N];
            if let Some(j) = active.column(unknown).filter(|j| *j < N) {
                row[j] = x;
            }
            row
        };
        let sigma2 = (2.0 * of(Unknown::LogDisturbance)).exp();
        let r_velocity = (2.0 * of(Unknown::LogVelocityNoise)).exp();
        let r_position = (2.0 * of(Unknown::LogPositionNoise)).exp();
        let mut state = State::at(start, sigma2);
        state.dd_by = one_at(Unknown::LogDisturbance, 2.0 * sigma2);
        Self {
            active,
            alpha: of(Unknown::Alpha),
            beta: of(Unknown::Beta),
            mu: of(Unknown::Mu),
            bias: of(Unknown::Bias),
            current: of(Unknown::Current),
            inflow: of(Unknown::Inflow),
            turning: of(Unknown::Turning),
            lever: [of(Unknown::LeverFirst), of(Unknown::LeverSecond)],
            offset: of(Unknown::VelocityOffset),
            sigma2,
            inverse_t: (-of(Unknown::LogCorrelation)).exp(),
            r_velocity,
            r_position,
            is_beta: one_at(Unknown::Beta, 1.0),
            is_sigma: one_at(Unknown::LogDisturbance, 1.0),
            is_t: one_at(Unknown::LogCorrelation, 1.0),
            r_velocity_by: one_at(Unknown::LogVelocityNoise, 2.0 * r_velocity),
            r_position_by: one_at(Unknown::LogPositionNoise, 2.0 * r_position),
            is_lever: [one_at(Unknown::LeverFirst, 1.0), one_at(Unknown::LeverSecond, 1.0)],
            is_offset: one_at(Unknown::VelocityOffset, 1.0),
            state,
            cost: 0.0,
            gradient: [0.0; N],
            information: [[0.0; N]; N],
            innovations: (wanted == Wanted::Innovations).then(Vec::new),
        }
    }

    /// Runs the filter over the trial.
    fn run(mut self, steps: impl Iterator<Item = Stop>, mut drive: Drive<'_>) -> Likelihood {
        let mut discrete = self.discrete(0.0);
        for stop in steps {
            if stop.length_s > 0.0 {
                // Decimal time stamps differ in their last digits; steps do not.
                if (stop.length_s - discrete.h).abs() > 1e-9 {
                    discrete = self.discrete(stop.length_s);
                }
                self.predict(&drive.until(&stop), &discrete);
            }
            self.measure(&stop.measured);
        }
        let n = self.active.len().min(N);
        let is_finite = self.cost.is_finite() && self.state.v.is_finite();
        Likelihood {
            cost: if is_finite { self.cost } else { f64::INFINITY },
            gradient: DVector::from_fn(n, |j, _| self.gradient[j]),
            information: DMatrix::from_fn(n, n, |i, j| self.information[i.min(j)][i.max(j)]),
            innovations: self.innovations.unwrap_or_default(),
        }
    }

    fn discrete(&self, h: f64) -> Discrete {
        let rho = (-h * self.inverse_t).exp();
        let rho_by_t = rho * h * self.inverse_t;
        let q = 2.0 * self.sigma2 * self.inverse_t;
        Discrete {
            h,
            rho,
            rho_by_t,
            q_vv: q * h * h * h / 3.0,
            q_vd: 0.5 * q * h * h,
            q_dd: self.sigma2 * (1.0 - rho * rho),
            q_dd_by_t: -2.0 * self.sigma2 * rho * rho_by_t,
        }
    }

    /// One step: the mean by its Taylor series to third order, the covariance by the
    /// transition matrix to second.
    fn predict(&mut self, push: &Push, step: &Discrete) {
        let Discrete { h, rho, .. } = *step;
        let s = &self.state;
        let r = s.v - self.current;
        let (speed, sign) = (r.abs(), r.signum());
        let linear = self.mu - self.alpha * self.inflow * push.gamma;
        let a = 2.0 * self.beta * speed + linear;
        let f = self.alpha * push.tau
            + (self.beta * speed + linear) * r
            + self.bias
            + self.turning * push.turning
            + s.d;
        let bend = 2.0 * self.beta * sign;
        let t = self.inverse_t;
        let g2 = a * f - s.d * t;
        let g3 = a * g2 + bend * f * f + s.d * t * t;
        let (h2, h3) = (0.5 * h * h, h * h * h / 6.0);

        let phi = 1.0 + h * a + h2 * a * a;
        let psi = h + h2 * (a - t);
        let eta = h + h2 * a;
        let (cov_v, cov_d) = (phi * s.vv + psi * s.vd, phi * s.vd + psi * s.dd);
        let (cov_pv, cov_pd) = (s.pv + eta * s.vv + h2 * s.vd, s.pd + eta * s.vd + h2 * s.dd);
        let cov_p = s.pp + eta * s.pv + h2 * s.pd;

        if N > 0 {
            let (f_by, a_by) = self.partials(push, r, speed, sign);
            self.predict_sensitivities(&Step {
                step,
                f_by,
                a_by,
                a,
                f,
                g2,
                bend,
                sign,
                h2,
                h3,
                phi,
                psi,
                eta,
                cov_v,
                cov_d,
                cov_pv,
                cov_pd,
            });
        }

        let s = &mut self.state;
        if POSITION {
            s.p += h * s.v + h2 * f + h3 * g2;
            s.pp = cov_p + eta * cov_pv + h2 * cov_pd;
            s.pv = phi * cov_pv + psi * cov_pd;
            s.pd = rho * cov_pd;
        }
        s.v += h * f + h2 * g2 + h3 * g3;
        s.d *= rho;
        s.vv = phi * cov_v + psi * cov_d + step.q_vv;
        s.vd = rho * cov_d + step.q_vd;
        s.dd = rho * rho * s.dd + step.q_dd;
    }

    /// ∂f and ∂a by each fitted unknown, the states held.
    fn partials(&self, push: &Push, r: f64, speed: f64, sign: f64) -> (Row<N>, Row<N>) {
        let (mut f_by, mut a_by) = ([0.0; N], [0.0; N]);
        let gamma = push.gamma;
        let a = 2.0 * self.beta * speed + self.mu - self.alpha * self.inflow * gamma;
        let mut set = |unknown, f: f64, a: f64| {
            if let Some(j) = self.active.column(unknown).filter(|j| *j < N) {
                f_by[j] = f;
                a_by[j] = a;
            }
        };
        set(Unknown::Alpha, push.tau - self.inflow * gamma * r, -self.inflow * gamma);
        set(Unknown::Beta, speed * r, 2.0 * speed);
        set(Unknown::Mu, r, 1.0);
        set(Unknown::Bias, 1.0, 0.0);
        set(Unknown::Turning, push.turning, 0.0);
        set(Unknown::Current, -a, -2.0 * self.beta * sign);
        set(Unknown::Inflow, -self.alpha * gamma * r, -self.alpha * gamma);
        for (i, unknown) in SHAPING.into_iter().enumerate() {
            let lost = self.inflow * push.gamma_by[i];
            let f = self.alpha * (push.tau_by[i] - lost * r);
            set(unknown, f, -self.alpha * lost);
        }
        (f_by, a_by)
    }

    fn predict_sensitivities(&mut self, x: &Step<'_, N>) {
        let Discrete { h, rho, .. } = *x.step;
        let t = self.inverse_t;
        let s = &mut self.state;
        for j in 0..N {
            let (is_t, is_sigma, is_beta) = (self.is_t[j], self.is_sigma[j], self.is_beta[j]);
            let (v, d) = (s.v_by[j], s.d_by[j]);
            let f = x.f_by[j] + x.a * v + d;
            let a = x.a_by[j] + x.bend * v;
            let g2 = a * x.f + x.a * f - d * t + is_t * s.d * t;
            let g3 = a * x.g2
                + x.a * g2
                + 2.0 * x.bend * x.f * f
                + is_beta * 2.0 * x.sign * x.f * x.f
                + d * t * t
                - is_t * 2.0 * s.d * t * t;
            let phi = (h + 2.0 * x.h2 * x.a) * a;
            let psi = x.h2 * (a + is_t * t);
            let (vv, vd, dd) = (s.vv_by[j], s.vd_by[j], s.dd_by[j]);
            let rho_by = is_t * x.step.rho_by_t;
            let cov_v = phi * s.vv + x.phi * vv + psi * s.vd + x.psi * vd;
            let cov_d = phi * s.vd + x.phi * vd + psi * s.dd + x.psi * dd;
            if POSITION {
                let eta = x.h2 * a;
                let (pp, pv, pd) = (s.pp_by[j], s.pv_by[j], s.pd_by[j]);
                let cov_pv = pv + eta * s.vv + x.eta * vv + x.h2 * vd;
                let cov_pd = pd + eta * s.vd + x.eta * vd + x.h2 * dd;
                let cov_p = pp + eta * s.pv + x.eta * pv + x.h2 * pd;
                s.p_by[j] += h * v + x.h2 * f + x.h3 * g2;
                s.pp_by[j] = cov_p + eta * x.cov_pv + x.eta * cov_pv + x.h2 * cov_pd;
                s.pv_by[j] = phi * x.cov_pv + x.phi * cov_pv + psi * x.cov_pd + x.psi * cov_pd;
                s.pd_by[j] = rho_by * x.cov_pd + rho * cov_pd;
            }
            s.v_by[j] = v + h * f + x.h2 * g2 + x.h3 * g3;
            s.d_by[j] = rho * d + rho_by * s.d;
            s.vv_by[j] = phi * x.cov_v
                + x.phi * cov_v
                + psi * x.cov_d
                + x.psi * cov_d
                + (2.0 * is_sigma - is_t) * x.step.q_vv;
            s.vd_by[j] = rho_by * x.cov_d + rho * cov_d + (2.0 * is_sigma - is_t) * x.step.q_vd;
            s.dd_by[j] = 2.0 * rho * rho_by * s.dd
                + rho * rho * dd
                + 2.0 * is_sigma * x.step.q_dd
                + is_t * x.step.q_dd_by_t;
        }
    }

    /// Takes in what was measured at an instant.
    fn measure(&mut self, measured: &Measured) {
        if let Some(y) = measured.velocity {
            self.measure_velocity(y, measured.lever);
        }
        if let (true, Some(y)) = (POSITION, measured.position) {
            self.measure_position(y);
        }
    }

    fn measure_velocity(&mut self, y: f64, rates: [f64; 2]) {
        let (r, r_by) = (self.r_velocity, self.r_velocity_by);
        let s = &mut self.state;
        let turning = self.lever[0] * rates[0] + self.lever[1] * rates[1];
        let (e, total) = (y - turning - self.offset - s.v, s.vv + r);
        let (mut e_by, mut total_by) = ([0.0; N], [0.0; N]);
        let (gain_p, gain_v, gain_d) = (s.pv / total, s.vv / total, s.vd / total);
        for j in 0..N {
            e_by[j] = -s.v_by[j]
                - self.is_lever[0][j] * rates[0]
                - self.is_lever[1][j] * rates[1]
                - self.is_offset[j];
            total_by[j] = s.vv_by[j] + r_by[j];
            let gain_v_by = (s.vv_by[j] - gain_v * total_by[j]) / total;
            let gain_d_by = (s.vd_by[j] - gain_d * total_by[j]) / total;
            if POSITION {
                let gain_p_by = (s.pv_by[j] - gain_p * total_by[j]) / total;
                s.pp_by[j] -= gain_p_by * s.pv + gain_p * s.pv_by[j];
                s.pd_by[j] -= gain_p_by * s.vd + gain_p * s.vd_by[j];
                s.p_by[j] += gain_p_by * e + gain_p * e_by[j];
                s.pv_by[j] = r_by[j] * gain_p + r * gain_p_by;
            }
            s.dd_by[j] -= gain_d_by * s.vd + gain_d * s.vd_by[j];
            s.d_by[j] += gain_d_by * e + gain_d * e_by[j];
            s.v_by[j] += gain_v_by * e + gain_v * e_by[j];
            s.vv_by[j] = r_by[j] * gain_v + r * gain_v_by;
            s.vd_by[j] = r_by[j] * gain_d + r * gain_d_by;
        }
        if POSITION {
            s.p += gain_p * e;
            s.pp -= gain_p * s.pv;
            s.pd -= gain_p * s.vd;
            s.pv = r * gain_p;
        }
        s.v += gain_v * e;
        s.d += gain_d * e;
        s.dd -= gain_d * s.vd;
        s.vv = r * gain_v;
        s.vd = r * gain_d;
        self.account(e, total, &e_by, &total_by);
    }

    fn measure_position(&mut self, y: f64) {
        let (r, r_by) = (self.r_position, self.r_position_by);
        let s = &mut self.state;
        let (e, total) = (y - s.p, s.pp + r);
        let (mut e_by, mut total_by) = ([0.0; N], [0.0; N]);
        let gain_p = s.pp / total;
        let gain_v = s.pv / total;
        let gain_d = s.pd / total;
        for j in 0..N {
            e_by[j] = -s.p_by[j];
            total_by[j] = s.pp_by[j] + r_by[j];
            let gain_p_by = (s.pp_by[j] - gain_p * total_by[j]) / total;
            let gain_v_by = (s.pv_by[j] - gain_v * total_by[j]) / total;
            let gain_d_by = (s.pd_by[j] - gain_d * total_by[j]) / total;
            s.p_by[j] += gain_p_by * e + gain_p * e_by[j];
            s.v_by[j] += gain_v_by * e + gain_v * e_by[j];
            s.d_by[j] += gain_d_by * e + gain_d * e_by[j];
            s.vv_by[j] -= gain_v_by * s.pv + gain_v * s.pv_by[j];
            s.vd_by[j] -= gain_v_by * s.pd + gain_v * s.pd_by[j];
            s.dd_by[j] -= gain_d_by * s.pd + gain_d * s.pd_by[j];
            s.pp_by[j] = r_by[j] * gain_p + r * gain_p_by;
            s.pv_by[j] = r_by[j] * gain_v + r * gain_v_by;
            s.pd_by[j] = r_by[j] * gain_d + r * gain_d_by;
        }
        s.p += gain_p * e;
        s.v += gain_v * e;
        s.d += gain_d * e;
        s.vv -= gain_v * s.pv;
        s.vd -= gain_v * s.pd;
        s.dd -= gain_d * s.pd;
        s.pp = r * gain_p;
        s.pv = r * gain_v;
        s.pd = r * gain_d;
        self.account(e, total, &e_by, &total_by);
    }

    /// Adds an innovation to the likelihood.
    fn account(&mut self, e: f64, total: f64, e_by: &Row<N>, total_by: &Row<N>) {
        let weight = 1.0 / total;
        self.cost += 0.5 * (total.ln() + e * e * weight);
        if let Some(innovations) = &mut self.innovations {
            innovations.push(e * weight.sqrt());
        }
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

/// A step as its sensitivities need it.
struct Step<'a, const N: usize> {
    step: &'a Discrete,
    f_by: Row<N>,
    a_by: Row<N>,
    a: f64,
    f: f64,
    g2: f64,
    bend: f64,
    sign: f64,
    h2: f64,
    h3: f64,
    phi: f64,
    psi: f64,
    eta: f64,
    cov_v: f64,
    cov_d: f64,
    cov_pv: f64,
    cov_pd: f64,
}

impl<const N: usize> State<N> {
    fn at(start: Start, sigma2: f64) -> Self {
        Self {
            v: start.velocity,
            d: 0.0,
            p: start.position,
            vv: start.velocity_variance,
            vd: 0.0,
            dd: sigma2,
            pp: start.position_variance,
            pv: 0.0,
            pd: 0.0,
            v_by: [0.0; N],
            d_by: [0.0; N],
            p_by: [0.0; N],
            vv_by: [0.0; N],
            vd_by: [0.0; N],
            dd_by: [0.0; N],
            pp_by: [0.0; N],
            pv_by: [0.0; N],
            pd_by: [0.0; N],
        }
    }
}
