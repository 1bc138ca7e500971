//! What the water, the cable and the waves do to the vehicle.

use std::f64::consts::{PI, TAU};

use nalgebra::Rotation3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::random::{Streams, ornstein_uhlenbeck};
use super::{Disturbance, TwinSpec};
use crate::Dof;

/// Everything that acts on the vehicle beside its thrusters, in one trial.
pub(super) struct Water {
    /// Current of each tick, m/s; along the degree of freedom, in yaw to the north.
    pub(super) current: Vec<f64>,
    /// The tether's pull at each tick, N or N m.
    tether: Vec<f64>,
    swell: Sine,
    /// `(A22 − A11)` of the Munk moment, kg; zero but in yaw.
    munk: f64,
    /// Roll and pitch.
    wobble: [Vec<Sine>; 2],
    yawing: bool,
    heading: f64,
}

/// `amplitude · cos(omega t + phase)`.
#[derive(Clone, Copy)]
struct Sine {
    amplitude: f64,
    omega: f64,
    phase: f64,
}

/// Roll, pitch and heading, rad, and their slopes, rad/s.
pub(super) struct Attitude {
    pub(super) angles: [f64; 3],
    pub(super) slopes: [f64; 3],
}

/// The band of frequencies in which the vehicle rolls and pitches, Hz.
const WOBBLE_BAND_HZ: std::ops::Range<f64> = 0.05..0.3;
/// Sinusoids in it: enough to look random.
const WOBBLE_LINES: usize = 20;

impl Water {
    pub(super) fn of(spec: &TwinSpec, dof: Dof, streams: &Streams<'_>, ticks: usize) -> Self {
        let strength = &spec.strength;
        let on = |disturbance, value| spec.strength_of(disturbance, value);
        let mean = on(Disturbance::Current, strength.current_m_s);
        let std = on(Disturbance::Current, strength.current_std_m_s);
        let current =
            ornstein_uhlenbeck(streams.of("current"), std, strength.current_correlation_s, ticks);
        let tether_std = on(Disturbance::Tether, strength.tether_n) * TwinSpec::arm(dof);
        let yawing = dof == Dof::Yaw;
        Self {
            current: current.into_iter().map(|varying| mean + varying).collect(),
            tether: ornstein_uhlenbeck(
                streams.of("tether"),
                tether_std,
                strength.tether_correlation_s,
                ticks,
            ),
            swell: Sine {
                amplitude: on(Disturbance::Swell, strength.swell_n) * TwinSpec::arm(dof),
                omega: TAU / strength.swell_period_s,
                phase: streams.of("swell").random_range(0.0..TAU),
            },
            munk: if yawing {
                spec.plants[&Dof::Sway].mass - spec.plants[&Dof::Surge].mass
            } else {
                0.0
            },
            wobble: ["roll wobble", "pitch wobble"].map(|axis| {
                // Turning about one axis while rolling about another is no single degree
                // of freedom, and heading needs no DVL.
                let rate =
                    if yawing { 0.0 } else { on(Disturbance::Lever, strength.lever_rate_rad_s) };
                wobble(streams.of(axis), rate)
            }),
            yawing,
            heading: streams.of("start heading").random_range(0.0..TAU),
        }
    }

    /// The current that drag feels along the degree of freedom, m/s.
    pub(super) fn along(&self, tick: usize) -> f64 {
        if self.yawing { 0.0 } else { self.current[tick] }
    }

    /// Tether, swell and Munk moment, N or N m.
    ///
    /// The Munk moment is `−(A22 − A11) u_r v_r`, where the vehicle that turns on the spot
    /// moves with `u_r = −c cos ψ`, `v_r = c sin ψ` through a current c to the north. The
    /// difference of added masses is that of the plants' masses, sway less surge.
    ///
    /// # Source
    /// [Fossen2021, ch. 6]: row 6 of C_A(ν) ν.
    pub(super) fn push(&self, tick: usize, t_s: f64, turned: f64) -> f64 {
        let c = self.current[tick];
        let heading = self.heading + turned;
        let munk = self.munk * c * c * heading.sin() * heading.cos();
        self.tether[tick] + self.swell.at(t_s) + munk
    }

    /// The attitude at a time, where the vehicle has turned by `position` with `velocity`
    /// if it yaws.
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
    /// Body to world.
    pub(super) fn rotation(&self) -> Rotation3<f64> {
        let [roll, pitch, heading] = self.angles;
        Rotation3::from_euler_angles(roll, pitch, heading)
    }
}

impl Sine {
    fn at(&self, t_s: f64) -> f64 {
        self.amplitude * (self.omega * t_s + self.phase).cos()
    }

    fn integral(&self, t_s: f64) -> f64 {
        self.amplitude / self.omega * (self.omega * t_s + self.phase).sin()
    }
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
        let water = Water { heading: 0.0, ..Water::of(&spec, Dof::Yaw, &streams, 10) };
        let moment = |heading: f64| water.push(0, 0.0, heading);
        // Off the stream to starboard the bow goes on to starboard, until 90°.
        assert!(moment(0.1) > 0.0 && moment(-0.1) < 0.0);
        assert!(moment(FRAC_PI_2 - 0.1) > 0.0 && moment(FRAC_PI_2 + 0.1) < 0.0);
        // Drag in yaw sees turning only.
        assert_eq!(water.along(0), 0.0);
    }

    #[test]
    fn rolls_and_pitches_at_the_rate_that_was_asked_for() {
        let mut spec = TwinSpec::jason2();
        spec.disturbances.insert(Disturbance::Lever);
        let water = Water::of(&spec, Dof::Surge, &Streams { seed: 1, trial: "surge 1" }, 10);
        let square = |tick: i32| water.attitude(0.1 * f64::from(tick), 0.0, 0.0).slopes[1].powi(2);
        let rms = ((0..40_000).map(square).sum::<f64>() / 40_000.0).sqrt();
        // Over an hour, twenty sinusoids beat out.
        assert!((rms / 0.03 - 1.0).abs() < 0.05, "{rms}");
    }
}
