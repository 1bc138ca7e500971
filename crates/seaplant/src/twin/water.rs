//! Forces of current, tether and waves on the vehicle.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix2, Rotation3, Vector2};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::motion::STEP_S;
use super::random::{Streams, ornstein_uhlenbeck};
use super::{Disturbance, DisturbanceStrength, STEPS_PER_TICK, TwinSpec};
use crate::Dof;
use crate::random::normal;

/// All forces on the vehicle other than thrust, in one trial.
pub(super) struct Water {
    /// Current at each tick, m/s; along the degree of freedom, in yaw to the north.
    pub(super) current: Vec<f64>,
    /// The tether's force at each tick, N or N m.
    tether: Vec<f64>,
    swell: Sine,
    /// Narrow-band swell at every half step, N or N m; empty if it is disabled.
    waves: Vec<f64>,
    /// `A22 − A11` of the Munk moment, kg; zero except in yaw.
    munk: f64,
    /// Roll and pitch.
    wobble: [Vec<Sine>; 2],
    yawing: bool,
    heading: f64,
}

/// `amplitude · cos(omega t + phase)`.
#[derive(Clone, Copy)]
pub(super) struct Sine {
    pub(super) amplitude: f64,
    pub(super) omega: f64,
    pub(super) phase: f64,
}

/// Roll, pitch and heading, rad, and their rates, rad/s.
pub(super) struct Attitude {
    pub(super) angles: [f64; 3],
    pub(super) slopes: [f64; 3],
}

/// Band of the frequencies of roll and pitch, Hz.
const WOBBLE_BAND_HZ: std::ops::Range<f64> = 0.05..0.3;
/// Number of sinusoids in it: enough to look random.
const WOBBLE_LINES: usize = 20;

impl Water {
    pub(super) fn new(spec: &TwinSpec, dof: Dof, streams: &Streams<'_>, ticks: usize) -> Self {
        let strength = &spec.strength;
        let on = |disturbance, value| spec.strength_of(disturbance, value);
        let tether_std = on(Disturbance::Tether, strength.tether_n) * TwinSpec::arm(dof);
        let yawing = dof == Dof::Yaw;
        Self {
            current: current(spec, streams, ticks),
            tether: ornstein_uhlenbeck(
                streams.stream("tether"),
                tether_std,
                strength.tether_correlation_s,
                ticks,
            ),
            swell: Sine {
                amplitude: on(Disturbance::Swell, strength.swell_n) * TwinSpec::arm(dof),
                omega: TAU / strength.swell_period_s,
                phase: streams.stream("swell").random_range(0.0..TAU),
            },
            waves: if spec.has(Disturbance::SwellNarrowBand) {
                let std = strength.swell_std_n * TwinSpec::arm(dof);
                waves(streams.stream("narrow-band swell"), strength, std, ticks)
            } else {
                Vec::new()
            },
            munk: if yawing {
                spec.plants[&Dof::Sway].mass - spec.plants[&Dof::Surge].mass
            } else {
                0.0
            },
            wobble: ["roll wobble", "pitch wobble"].map(|axis| {
                // A trial of yaw has no roll and pitch, which would couple with it, and its heading
                // needs no DVL.
                let rate =
                    if yawing { 0.0 } else { on(Disturbance::Lever, strength.lever_rate_rad_s) };
                wobble(streams.stream(axis), rate)
            }),
            yawing,
            heading: streams.stream("start heading").random_range(0.0..TAU),
        }
    }

    /// Returns the current along the degree of freedom, m/s.
    pub(super) fn along(&self, tick: usize) -> f64 {
        if self.yawing { 0.0 } else { self.current[tick] }
    }

    /// Returns the sum of tether, both swells and Munk moment, N or N m.
    ///
    /// The Munk moment is `−(A22 − A11) u_r v_r`: a vehicle that turns on the spot moves at `u_r =
    /// −c cos ψ`, `v_r = c sin ψ` through a current c to the north. The difference of added masses
    /// is that of the plants' masses, sway less surge.
    ///
    /// # Source
    /// [Fossen2021, ch. 6]: row 6 of C_A(ν) ν.
    pub(super) fn force(&self, tick: usize, t_s: f64, turned: f64) -> f64 {
        let c = self.current[tick];
        let heading = self.heading + turned;
        let munk = self.munk * c * c * heading.sin() * heading.cos();
        self.tether[tick] + self.swell.at(t_s) + munk + self.wave(t_s)
    }

    /// Returns the narrow-band swell at the start, middle or end of a step, N or N m.
    fn wave(&self, t_s: f64) -> f64 {
        self.waves.get((2.0 * t_s / STEP_S).round() as usize).copied().unwrap_or(0.0)
    }

    /// Returns the attitude at a time; a vehicle in yaw has turned by `position` and turns at
    /// `velocity`.
    pub(super) fn attitude(&self, t_s: f64, position: f64, velocity: f64) -> Attitude {
        let (turned, turning) = if self.yawing { (position, velocity) } else { (0.0, 0.0) };
        let [roll, pitch] =
            [0, 1].map(|axis| self.wobble[axis].iter().map(|s| s.integral(t_s)).sum());
        let [roll_slope, pitch_slope] =
            [0, 1].map(|axis| self.wobble[axis].iter().map(|s| s.at(t_s)).sum());
        Attitude {
            angles: [roll, pitch, self.heading + turned],
            slopes: [roll_slope, pitch_slope, turning],
        }
    }
}

impl Attitude {
    /// Returns the rotation from body to world.
    pub(super) fn rotation(&self) -> Rotation3<f64> {
        let [roll, pitch, heading] = self.angles;
        Rotation3::from_euler_angles(roll, pitch, heading)
    }
}

impl Sine {
    pub(super) fn at(&self, t_s: f64) -> f64 {
        self.amplitude * (self.omega * t_s + self.phase).cos()
    }

    fn integral(&self, t_s: f64) -> f64 {
        self.amplitude / self.omega * (self.omega * t_s + self.phase).sin()
    }
}

/// Returns the current at each tick, m/s: its mean, variation and drift.
pub(super) fn current(spec: &TwinSpec, streams: &Streams<'_>, ticks: usize) -> Vec<f64> {
    let strength = &spec.strength;
    let mean = spec.strength_of(Disturbance::Current, strength.current_m_s);
    let std = spec.strength_of(Disturbance::Current, strength.current_std_m_s);
    let varying =
        ornstein_uhlenbeck(streams.stream("current"), std, strength.current_correlation_s, ticks);
    let drift_std = spec.strength_of(Disturbance::CurrentDrift, strength.drift_std_m_s);
    let drift = ornstein_uhlenbeck(
        streams.stream("current drift"),
        drift_std,
        strength.drift_correlation_s,
        ticks,
    );
    varying.into_iter().zip(drift).map(|(varying, drift)| mean + varying + drift).collect()
}

/// Draws narrow-band swell of a standard deviation, one value every half step, stationary from the
/// start.
///
/// `F̈ + 2 ζ ω Ḟ + ω² F = ẇ` with white noise ẇ: exact over each half step.
///
/// # Source
/// [Fossen2021, ch. 10]: the second-order wave model.
pub(super) fn waves(
    mut rng: ChaCha8Rng,
    strength: &DisturbanceStrength,
    std: f64,
    ticks: usize,
) -> Vec<f64> {
    let (damping, omega) = (strength.swell_damping, TAU / strength.swell_period_s);
    let (decay, ringing) = (damping * omega, omega * (1.0 - damping * damping).sqrt());
    let h = 0.5 * STEP_S;
    let (sin, cos) = (ringing * h).sin_cos();
    let keep = (-decay * h).exp();
    // State: ω ∫F and F; their stationary covariance is the identity.
    let across = keep * sin * omega / ringing;
    let slip = decay / ringing * sin;
    let step = Matrix2::new(keep * (cos + slip), across, -across, keep * (cos - slip));
    let renewed = Matrix2::identity() - step * step.transpose();
    // Cholesky factor of a positive definite matrix, from the entry that is not nearly zero.
    let from_both = renewed[(0, 1)] / renewed[(1, 1)].sqrt();
    let from_first = (renewed[(0, 0)] - from_both * from_both).max(0.0).sqrt();
    let mut state = Vector2::from_fn(|_, _| normal(&mut rng));
    let mut next = || {
        let now = std * state[1];
        let (first, both) = (normal(&mut rng), normal(&mut rng));
        let new =
            Vector2::new(from_first * first + from_both * both, renewed[(1, 1)].sqrt() * both);
        state = step * state + new;
        now
    };
    (0..=2 * STEPS_PER_TICK * ticks).map(|_| next()).collect()
}

fn wobble(mut rng: ChaCha8Rng, rms: f64) -> Vec<Sine> {
    if rms == 0.0 {
        return Vec::new();
    }
    let amplitude = rms * (2.0 / WOBBLE_LINES as f64).sqrt();
    let mut line = || Sine {
        amplitude,
        omega: 2.0 * PI * rng.random_range(WOBBLE_BAND_HZ),
        phase: rng.random_range(0.0..TAU),
    };
    (0..WOBBLE_LINES).map(|_| line()).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn a_current_turns_the_vehicle_broadside() {
        let mut spec = TwinSpec::jason2();
        spec.disturbances.insert(Disturbance::Current);
        let streams = Streams { seed: 1, trial: "yaw 1" };
        let water = Water { heading: 0.0, ..Water::new(&spec, Dof::Yaw, &streams, 10) };
        let moment = |heading: f64| water.force(0, 0.0, heading);
        // Headed to starboard of the stream, the bow turns further to starboard, until 90°.
        assert!(moment(0.1) > 0.0 && moment(-0.1) < 0.0);
        assert!(moment(FRAC_PI_2 - 0.1) > 0.0 && moment(FRAC_PI_2 + 0.1) < 0.0);
        // Drag in yaw depends on angular velocity only.
        assert_eq!(water.along(0), 0.0);
    }

    #[test]
    fn rolls_and_pitches_at_the_specified_rate() {
        let mut spec = TwinSpec::jason2();
        spec.disturbances.insert(Disturbance::Lever);
        let water = Water::new(&spec, Dof::Surge, &Streams { seed: 1, trial: "surge 1" }, 10);
        let square = |tick: i32| water.attitude(0.1 * f64::from(tick), 0.0, 0.0).slopes[1].powi(2);
        let rms = ((0..40_000).map(square).sum::<f64>() / 40_000.0).sqrt();
        // Over an hour the beats of twenty sinusoids average out.
        assert!((rms / 0.03 - 1.0).abs() < 0.05, "{rms}");
    }

    /// Returns ten hours of narrow-band swell of 10 s, one value every half step.
    fn long_swell() -> Vec<f64> {
        let strength = DisturbanceStrength::default();
        waves(Streams { seed: 1, trial: "t" }.stream("w"), &strength, strength.swell_std_n, 360_000)
    }

    fn correlation(x: &[f64], lag: usize) -> f64 {
        let pairs = x.iter().zip(&x[lag..]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / (x.len() - lag) as f64
    }

    #[test]
    fn narrow_band_swell_has_its_standard_deviation_period_and_bandwidth() {
        let swell = long_swell();
        let variance = correlation(&swell, 0);
        // Its correlation time is 1/(ζ ω) = 32 s: 1100 times in ten hours, so 3 % of variance.
        assert!((variance.sqrt() / 70.0 - 1.0).abs() < 0.05, "{}", variance.sqrt());
        // ρ(t) = e^(−ζωt) (cos ω_d t − ζ/√(1 − ζ²) sin ω_d t).
        let omega = TAU / 10.0;
        let (damped, part) = (omega * (1.0 - 0.05_f64.powi(2)).sqrt(), 0.05 / 0.9975_f64.sqrt());
        for t in [2.5, 5.0, 10.0, 20.0] {
            let phase = damped * t;
            let exact = (-0.05 * omega * t).exp() * (phase.cos() - part * phase.sin());
            let found = correlation(&swell, (t / (0.5 * STEP_S)).round() as usize) / variance;
            assert!((found - exact).abs() < 0.05, "{t} s: {found} beside {exact}");
        }
    }

    #[test]
    fn narrow_band_swell_is_smooth_between_the_stages_of_a_step() {
        let water = {
            let mut spec = TwinSpec::jason2();
            spec.disturbances.insert(Disturbance::SwellNarrowBand);
            Water::new(&spec, Dof::Surge, &Streams { seed: 1, trial: "surge 1" }, 100)
        };
        assert_eq!(water.waves.len(), 1001);
        for step in 0..499 {
            let t = f64::from(step) * STEP_S;
            let middle = 0.5 * (water.wave(t) + water.wave(t + STEP_S));
            // White noise adds σ √(4 ζ ω · 0.01 s) a half step, and 1/√2 of that here; five
            // deviations.
            let off = water.wave(t + 0.5 * STEP_S) - middle;
            assert!(off.abs() < 5.0 * 70.0 * 0.0251, "{step}: {off}");
        }
    }

    #[test]
    fn a_drifting_current_changes_over_minutes() {
        let mut spec = TwinSpec::jason2();
        spec.disturbances.insert(Disturbance::CurrentDrift);
        let streams = Streams { seed: 1, trial: "surge 1" };
        let current = Water::new(&spec, Dof::Surge, &streams, 600_000).current;
        // 400 correlation times.
        let std = correlation(&current, 0).sqrt();
        assert!((std / 0.05 - 1.0).abs() < 0.1, "{std}");
        let after_150_s = correlation(&current, 1500) / (std * std);
        assert!((after_150_s - (-1.0_f64).exp()).abs() < 0.1, "{after_150_s}");
        spec.disturbances.insert(Disturbance::Current);
        let both = Water::new(&spec, Dof::Surge, &streams, 600_000).current;
        let mean = both.iter().sum::<f64>() / both.len() as f64;
        assert!((mean - 0.1).abs() < 0.02, "it comes on top: {mean}");
    }
}
