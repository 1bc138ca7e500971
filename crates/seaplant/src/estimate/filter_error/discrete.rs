//! What the states beside velocity do over a step, in closed form.

use super::parameters::{Sensor, Unknown, Values};

/// A slow disturbance, `ḋ = −d/T + w`: an Ornstein–Uhlenbeck process, and its integrals.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slow {
    /// d decays by this.
    pub(super) rho: f64,
    /// `∫ e^(−s/T) ds`, s, what one of d does to velocity.
    pub(super) once: f64,
    /// `∫∫ e^(−s/T) ds`, s², what it does to position.
    pub(super) twice: f64,
    /// Process noise of velocity, of both, and of d.
    pub(super) q_vv: f64,
    pub(super) q_vd: f64,
    pub(super) q_dd: f64,
}

impl Slow {
    /// Over a step of h seconds, with standard deviation σ; and the derivative of each number
    /// by ln T.
    pub(super) fn over(h: f64, sigma2: f64, inverse_t: f64) -> (Self, Self) {
        let y = h * inverse_t;
        let t = 1.0 / inverse_t;
        let rho = (-y).exp();
        let gone = -(-y).exp_m1();
        let once = t * gone;
        let twice = integral_twice(y) * t * t;
        let (g, g_by_y) = variance_of_integral(y);
        let here = Self {
            rho,
            once,
            twice,
            q_vv: sigma2 * t * t * g,
            q_vd: sigma2 * t * gone * gone,
            q_dd: -sigma2 * (-2.0 * y).exp_m1(),
        };
        // y changes by −y, T by T, for each unit of ln T.
        let by = Self {
            rho: rho * y,
            once: once - h * rho,
            twice: 2.0 * twice - h * once,
            q_vv: sigma2 * t * t * (2.0 * g - y * g_by_y),
            q_vd: sigma2 * t * gone * (gone - 2.0 * y * rho),
            q_dd: -2.0 * sigma2 * y * rho * rho,
        };
        (here, by)
    }
}

/// Below this the closed forms lose digits to cancellation, and their series do not.
const SMALL: f64 = 1e-2;

/// `y − 1 + e^(−y)`.
fn integral_twice(y: f64) -> f64 {
    if y < SMALL {
        y * y * (0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y / 120.0)))
    } else {
        y + (-y).exp_m1()
    }
}

/// `2 y − 3 + 4 e^(−y) − e^(−2y)` and its slope `2 (1 − e^(−y))²`.
fn variance_of_integral(y: f64) -> (f64, f64) {
    let gone = -(-y).exp_m1();
    let slope = 2.0 * gone * gone;
    if y < SMALL {
        let series = 2.0 / 3.0 - y * (0.5 - y * (7.0 / 30.0 - y / 12.0));
        return (y * y * y * series, slope);
    }
    (2.0 * y - 2.0 * gone - gone * gone, slope)
}

/// What a velocity sensor makes of velocity, over a step: with v = v₀ + g₁ t + ½ g₂ t²,
/// `s(h) = E s(0) + J₀ v₀ + J₁ g₁ + ½ J₂ g₂`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sensing {
    pub(super) e: [[f64; 2]; 2],
    pub(super) j0: [f64; 2],
    pub(super) j1: [f64; 2],
    pub(super) j2: [f64; 2],
}

impl Sensing {
    /// How many states a sensor has.
    pub(super) const fn states(sensor: Sensor) -> usize {
        match sensor {
            Sensor::Prompt => 0,
            Sensor::Lag => 1,
            Sensor::Window => 2,
        }
    }

    /// Over a step of h seconds, and the derivative of each number by the logarithm of the
    /// sensor's time.
    pub(super) fn over(sensor: Sensor, h: f64, values: &Values) -> (Self, Self) {
        match sensor {
            Sensor::Prompt => Default::default(),
            Sensor::Lag => Self::lag(h, values.get(Unknown::LogSensorLag).exp()),
            Sensor::Window => Self::window(h, values.get(Unknown::LogSensorWindow).exp()),
        }
    }

    /// `ṡ = (v − s)/T`.
    fn lag(h: f64, t: f64) -> (Self, Self) {
        let u = h / t;
        let e = (-u).exp();
        let gone = 1.0 - e;
        let first = |x: f64| [x, 0.0];
        let here = Self {
            e: [[e, 0.0], [0.0, 0.0]],
            j0: first(gone),
            j1: first(t * (u - gone)),
            j2: first(t * t * (u * u - 2.0 * u + 2.0 * gone)),
        };
        let by = Self {
            e: [[u * e, 0.0], [0.0, 0.0]],
            j0: first(-u * e),
            j1: first(t * (u * e - gone)),
            j2: first(2.0 * t * t * (-u + 2.0 * gone - u * e)),
        };
        (here, by)
    }

    /// An average over the last W seconds, `(1 − e^(−sW))/(sW)`, by its Padé approximant
    /// `1/(1 + sW/2 + s²W²/12)`: its gain is off by less than 0.2 % up to a period of 2π W.
    ///
    /// States are s and W ṡ; in u = t/W, `z₁' = z₂`, `z₂' = 12 (v − z₁) − 6 z₂`.
    fn window(h: f64, w: f64) -> (Self, Self) {
        let u = h / w;
        let (e, e_by_u) = window_transition(u);
        // The responses to v = 1, u, u² that have no transient, at u and at 0.
        let at = |u: f64| [[1.0, 0.0], [u - 0.5, 1.0], [u * u - u + 1.0 / 3.0, 2.0 * u - 1.0]];
        let slope = |u: f64| [[0.0, 0.0], [1.0, 0.0], [2.0 * u - 1.0, 2.0]];
        let (now, now_by_u, zero) = (at(u), slope(u), at(0.0));
        let response = |k: usize, i: usize| now[k][i] - dot(e[i], zero[k]);
        let by_u = |k: usize, i: usize| now_by_u[k][i] - dot(e_by_u[i], zero[k]);
        let scale = [1.0, w, w * w];
        let j = |k: usize| [0, 1].map(|i| scale[k] * response(k, i));
        let j_by =
            |k: usize| [0, 1].map(|i| scale[k] * (k as f64 * response(k, i) - u * by_u(k, i)));
        let here = Self { e, j0: j(0), j1: j(1), j2: j(2) };
        let by = Self {
            e: e_by_u.map(|row| row.map(|x| -u * x)),
            j0: j_by(0),
            j1: j_by(1),
            j2: j_by(2),
        };
        (here, by)
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// `exp(u [[0, 1], [−12, −6]])` and its derivative by u.
fn window_transition(u: f64) -> ([[f64; 2]; 2], [[f64; 2]; 2]) {
    // Eigenvalues −3 ± i√3.
    let omega = 3_f64.sqrt();
    let decay = (-3.0 * u).exp();
    let (sin, cos) = (omega * u).sin_cos();
    let (s, c) = (decay * sin / omega, decay * cos);
    let e = [[c + 3.0 * s, s], [-12.0 * s, c - 3.0 * s]];
    let by_u = [e[1], [-12.0 * e[0][0] - 6.0 * e[1][0], -12.0 * e[0][1] - 6.0 * e[1][1]]];
    (e, by_u)
}

/// Waves over a step: `ẅ + 2ζω ẇ + ω² w = white noise`, of which the rate ẇ pushes. States are
/// w and ẇ, so that the velocity that waves add in a step is the change of w.
///
/// # Source
/// [Fossen2021, ch. 10]: linear wave response model.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Waves {
    pub(super) e: [[f64; 2]; 2],
    /// Process noise: of w, of both, of ẇ.
    pub(super) q: [f64; 3],
}

/// The part of a frequency or damping by which it is varied for a derivative.
const VARIED: f64 = 1e-5;

impl Waves {
    /// Over a step of h seconds.
    pub(super) fn over(h: f64, values: &Values) -> Self {
        let of = |unknown| values.get(unknown);
        Self::with(
            h,
            (2.0 * of(Unknown::LogSwell)).exp(),
            of(Unknown::LogSwellFrequency).exp(),
            of(Unknown::LogSwellDamping).exp(),
        )
    }

    /// The derivative by the logarithm of frequency or damping: central differences, good to
    /// ten digits, in place of the integral that it is.
    pub(super) fn by(unknown: Unknown, h: f64, values: &Values) -> Self {
        let at = |sign: f64| {
            let mut varied = *values;
            varied.set(unknown, values.get(unknown) + sign * VARIED);
            Self::over(h, &varied)
        };
        let (up, down) = (at(1.0), at(-1.0));
        let slope = |a: f64, b: f64| (a - b) / (2.0 * VARIED);
        Self {
            e: [0, 1].map(|i| [0, 1].map(|j| slope(up.e[i][j], down.e[i][j]))),
            q: [0, 1, 2].map(|i| slope(up.q[i], down.q[i])),
        }
    }

    /// Variance of ẇ and of w in waves that last.
    pub(super) fn variances(values: &Values) -> [f64; 2] {
        let sigma2 = (2.0 * values.get(Unknown::LogSwell)).exp();
        [sigma2 * (-2.0 * values.get(Unknown::LogSwellFrequency)).exp(), sigma2]
    }

    fn with(h: f64, sigma2: f64, omega: f64, zeta: f64) -> Self {
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let decay = (-zeta * omega * h).exp();
        let (sin, cos) = (damped * h).sin_cos();
        let (s, c) = (decay * sin / damped, decay * cos);
        let e = [[c + zeta * omega * s, s], [-omega * omega * s, c - zeta * omega * s]];
        let (w2, rate2) = (sigma2 / (omega * omega), sigma2);
        // What is lost to damping comes in as noise: P − E P Eᵀ of the lasting variance P.
        let kept = |i: usize, j: usize| e[i][0] * w2 * e[j][0] + e[i][1] * rate2 * e[j][1];
        Self { e, q: [w2 - kept(0, 0), -kept(0, 1), rate2 - kept(1, 1)] }
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::Shape;
    use super::*;

    /// Simpson's rule, to 1e-9 of what it integrates here.
    fn integral(f: impl Fn(f64) -> f64, to: f64) -> f64 {
        let n = 2000;
        let h = to / f64::from(n);
        let weight = |k: i32| match k {
            0 => 1.0,
            k if k == n => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        (0..=n).map(|k| weight(k) * f(h * f64::from(k))).sum::<f64>() * h / 3.0
    }

    #[test]
    fn a_disturbance_is_integrated_whether_quick_or_slow() {
        for (h, t) in [(0.1, 0.05), (0.1, 30.0), (0.02, 3000.0), (0.5, 1.0)] {
            let (sigma2, inverse) = (2.0, 1.0 / t);
            let (slow, by) = Slow::over(h, sigma2, inverse);
            let once = |h: f64| t * -(-h * inverse).exp_m1();
            let white = 2.0 * sigma2 * inverse;
            let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-6, "{h} {t}: {a} {b}");
            close(slow.once, once(h));
            close(slow.twice, integral(once, h));
            close(slow.q_vv, white * integral(|s| once(s).powi(2), h));
            close(slow.q_vd, white * integral(|s| once(s) * (-s * inverse).exp(), h));
            close(slow.q_dd, white * integral(|s| (-2.0 * s * inverse).exp(), h));
            let (up, down) =
                [1e-4, -1e-4].map(|x: f64| Slow::over(h, sigma2, inverse * (-x).exp()).0).into();
            let slope = |f: fn(&Slow) -> f64| (f(&up) - f(&down)) / 2e-4;
            for (f, found) in [
                ((|s| s.once) as fn(&Slow) -> f64, by.once),
                (|s| s.twice, by.twice),
                (|s| s.q_vv, by.q_vv),
                (|s| s.q_vd, by.q_vd),
                (|s| s.q_dd, by.q_dd),
                (|s| s.rho, by.rho),
            ] {
                let expected = slope(f);
                assert!((found - expected).abs() < 1e-5 * expected.abs() + 1e-12, "{h} {t}");
            }
        }
    }

    #[test]
    fn a_sensor_follows_a_parabola_as_its_equation_says() {
        let mut values = Values::none(Shape::default());
        values.set(Unknown::LogSensorLag, (0.4_f64).ln());
        values.set(Unknown::LogSensorWindow, (0.7_f64).ln());
        let v = |t: f64| 0.3 + 0.8 * t - 0.5 * t * t;
        for sensor in [Sensor::Lag, Sensor::Window] {
            let h = 0.25;
            let (sense, by) = Sensing::over(sensor, h, &values);
            let start = [0.2, 0.1];
            let found = |sense: &Sensing| {
                [0, 1].map(|i| {
                    dot(sense.e[i], start) + 0.3 * sense.j0[i] + 0.8 * sense.j1[i]
                        - 0.5 * sense.j2[i]
                })
            };
            let slope = |t: f64, s: [f64; 2]| match sensor {
                Sensor::Window => [s[1] / 0.7, (12.0 * (v(t) - s[0]) - 6.0 * s[1]) / 0.7],
                _ => [(v(t) - s[0]) / 0.4, 0.0],
            };
            let (mut s, n) = (start, 20_000);
            for k in 0..n {
                let (t, dt) = (h * f64::from(k) / f64::from(n), h / f64::from(n));
                let half = slope(t, s);
                let mid = [0, 1].map(|i| s[i] + 0.5 * dt * half[i]);
                let k2 = slope(t + 0.5 * dt, mid);
                s = [0, 1].map(|i| s[i] + dt * k2[i]);
            }
            let states = Sensing::states(sensor);
            for (i, s) in s.iter().enumerate().take(states) {
                assert!((found(&sense)[i] - s).abs() < 1e-8, "{sensor:?} {i}");
            }
            let at = |x: f64| {
                let mut moved = values;
                for unknown in [Unknown::LogSensorLag, Unknown::LogSensorWindow] {
                    moved.set(unknown, values.get(unknown) + x);
                }
                found(&Sensing::over(sensor, h, &moved).0)
            };
            let (up, down) = (at(1e-5), at(-1e-5));
            for i in 0..states {
                assert!((found(&by)[i] - (up[i] - down[i]) / 2e-5).abs() < 1e-8, "{sensor:?} {i}");
            }
        }
    }

    #[test]
    fn waves_keep_their_height_and_period() {
        let mut values = Values::none(Shape::default());
        values.set(Unknown::LogSwell, (0.3_f64).ln());
        values.set(Unknown::LogSwellFrequency, (2.0_f64).ln());
        values.set(Unknown::LogSwellDamping, (0.05_f64).ln());
        let [w2, rate2] = Waves::variances(&values);
        assert!((rate2 - 0.09).abs() < 1e-12 && (w2 - 0.09 / 4.0).abs() < 1e-12);
        let waves = Waves::over(0.1, &values);
        // Two steps of 0.1 s are one of 0.2 s.
        let twice = Waves::over(0.2, &values);
        for i in 0..2 {
            for j in 0..2 {
                let product = waves.e[i][0] * waves.e[0][j] + waves.e[i][1] * waves.e[1][j];
                assert!((product - twice.e[i][j]).abs() < 1e-12);
            }
        }
        assert!(waves.q[0] > 0.0 && waves.q[2] > 0.0);
    }
}
