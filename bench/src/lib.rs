//! Signals of known plants of any length.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::{
    AxisRecord, Dof, Error, Grid, LumpedParameters, Motion, PhysicalParameters, State, Timed,
    simulate,
};

/// The rate of every signal here, Hz.
pub const SAMPLE_HZ: f64 = 10.0;

/// The surge plant of Jason 2 from the paper.
pub const SURGE: PhysicalParameters =
    PhysicalParameters { mass: 12970.2, d_quadratic: 2230.9, d_linear: 0.0, bias_force: -255.5 };

/// The DVL's standard deviation, m/s.
const NOISE_M_S: f64 = 0.003;

/// A surge trial: force held from each sample to the next, and velocity as measured.
#[derive(Clone, Debug, PartialEq)]
pub struct SurgeSignals {
    /// Velocity with noise, m/s, shape (n,).
    pub v: Vec<f64>,
    /// Force, N, shape (n,).
    pub tau: Vec<f64>,
}

impl SurgeSignals {
    /// Returns `n` samples of [`SURGE`] under a sinusoid and a pilot's joystick; equal seeds give
    /// equal signals.
    ///
    /// # Errors
    /// As [`Timed::new`] for `n` of zero.
    pub fn seeded(n: usize, seed: u64) -> Result<Self, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let tau = thrust(n, &mut random);
        let mut v = simulated_velocity(&SURGE.to_lumped(), &tau)?;
        let noise = Normal::new(0.0, NOISE_M_S).expect("a positive deviation");
        v.iter_mut().for_each(|v| *v += noise.sample(&mut random));
        Ok(Self { v, tau })
    }

    /// Returns the record that an estimator takes.
    ///
    /// # Errors
    /// As [`Timed::new`].
    pub fn record(self) -> Result<AxisRecord, Error> {
        let velocity = Timed::on_grid("velocity", grid(self.v.len()), self.v)?;
        Ok(AxisRecord {
            acceleration: None,
            cuts: Vec::new(),
            dof: Dof::Surge,
            trial: "bench".to_owned(),
            thrusters: Vec::new(),
            force: velocity.with_values("force", self.tau)?,
            motion: Motion::Velocity(velocity),
            position: None,
            lever_rates: None,
            turning: None,
        })
    }
}

/// Returns the instants of `n` samples.
pub fn grid(n: usize) -> Grid {
    Grid { start_s: 0.0, period_s: 1.0 / SAMPLE_HZ, len: n }
}

/// Simulates the plant with a held force from rest.
///
/// # Errors
/// As [`Timed::new`] and [`simulate`].
pub fn simulated_velocity(plant: &LumpedParameters, tau: &[f64]) -> Result<Vec<f64>, Error> {
    let force = Timed::on_grid("force", grid(tau.len()), tau.to_vec())?;
    Ok(simulate(Dof::Surge, plant, &force, State::default(), force.time_s())?.velocity)
}

/// Returns `1800 sin 0.785 t` and a joystick that dwells for 5 to 20 s, released a third of the
/// time, else anywhere within ±500 N, through a lag of 1 s.
fn thrust(n: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let (mut wanted, mut joystick, mut dwell) = (0.0, 0.0, 0);
    (0..n)
        .map(|k| {
            if dwell == 0 {
                dwell = random.random_range(50..200);
                let released = random.random_bool(0.3);
                wanted = if released { 0.0 } else { random.random_range(-500.0..500.0) };
            }
            dwell -= 1;
            joystick += (wanted - joystick) / SAMPLE_HZ;
            1800.0 * (0.785 * k as f64 / SAMPLE_HZ).sin() + joystick
        })
        .collect()
}
