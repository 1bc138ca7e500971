//! Velocity integrated from acceleration, high-passed because offsets of the accelerometer hide
//! slow changes.

use nalgebra::{Vector3, Vector6};

use crate::navigation::{MeanAcceleration, MeanOver};
use crate::series::ROUNDING_S;
use crate::{Error, Timed, TrialRecord};

/// Time constant of the high-pass of velocity from acceleration, and of the estimate of the
/// instrument's offset, s.
pub const GAINED_S: f64 = 10.0;

/// Longest time between means, s; after a longer gap, velocity restarts from zero.
const GAP_S: f64 = 1.0;

/// Velocity w from acceleration a, on the axes with acceleration: with T of [`GAINED_S`], `ṁ = (a −
/// m)/T`, `ẇ = a − m − ω × w − w/T`; on the others w is measured.
struct Gained {
    is_gained: [bool; 3],
    velocity: Vector3<f64>,
    mean: Vector3<f64>,
}

impl Gained {
    fn new(is_gained: [bool; 3], velocity: Vector3<f64>) -> Self {
        Self { is_gained, velocity, mean: Vector3::zeros() }
    }

    fn axes(&self) -> impl Iterator<Item = usize> + use<> {
        let is_gained = self.is_gained;
        (0..3).filter(move |axis| is_gained[*axis])
    }

    fn restart(&mut self) {
        self.axes().for_each(|axis| self.velocity[axis] = 0.0);
    }

    fn step(&mut self, acceleration: &Vector3<f64>, omega: &Vector3<f64>, h: f64) {
        let turned = omega.cross(&self.velocity);
        let half = 0.5 * h / GAINED_S;
        let keep = |x: f64, driven: f64| (x * (1.0 - half) + h * driven) / (1.0 + half);
        for axis in self.axes() {
            let (own, before) = (acceleration[axis], self.mean[axis]);
            self.mean[axis] = keep(before, own / GAINED_S);
            let left = own - 0.5 * (before + self.mean[axis]) - turned[axis];
            self.velocity[axis] = keep(self.velocity[axis], left);
        }
    }
}

fn turning(rates: Option<&[Timed; 3]>, t: f64) -> Vector3<f64> {
    rates.map_or_else(Vector3::zeros, |rates| Vector3::from_fn(|k, _| rates[k].at(t)))
}

/// Sets missing velocities from `ν̇ + ω × v`, m/s²; returns the axes so set.
///
/// # Errors
/// As [`Timed::new`].
pub(super) fn gained(
    acceleration: &[Option<MeanAcceleration>; 3],
    rates: Option<&[Timed; 3]>,
    velocity: &mut [Option<Timed>; 6],
) -> Result<[bool; 3], Error> {
    let is_gained = [0, 1, 2].map(|k| acceleration[k].is_some() && velocity[k].is_none());
    let own = |k: usize| acceleration[k].as_ref().filter(|_| is_gained[k]);
    let Some(base) = (0..3).find_map(own) else { return Ok(is_gained) };
    let mut gained = Gained::new(is_gained, Vector3::zeros());
    let mut before: Option<f64> = None;
    let (mut time_s, mut made) = (Vec::new(), Vec::new());
    for (&from_s, &to_s) in base.from_s.iter().zip(base.mean.time_s()) {
        for k in (0..3).filter(|k| !is_gained[*k]) {
            gained.velocity[k] = velocity[k].as_ref().map_or(0.0, |known| known.at(to_s));
        }
        if before.is_some_and(|before| from_s - before > GAP_S) {
            gained.restart();
        }
        let a = Vector3::from_fn(|k, _| own(k).map_or(0.0, |felt| felt.mean.at(to_s)));
        gained.step(&a, &turning(rates, 0.5 * (from_s + to_s)), to_s - from_s);
        before = Some(to_s);
        time_s.push(to_s);
        made.push(gained.velocity);
    }
    for k in (0..3).filter(|k| is_gained[*k]) {
        let values: Vec<f64> = made.iter().map(|w| w[k]).collect();
        velocity[k] = Some(Timed::new("velocity", time_s.clone(), values)?);
    }
    Ok(is_gained)
}

/// Averages acceleration between instants, which increase, over at least a tenth of a second; a
/// slower instrument is unchanged.
pub(super) fn between(
    felt: &MeanAcceleration,
    instants: &[f64],
) -> Result<MeanAcceleration, Error> {
    let windows: Vec<MeanOver> = felt.windows().collect();
    let (mut from_s, mut to_s, mut means) = (Vec::new(), Vec::new(), Vec::new());
    let (mut first, mut begin) = (0, None);
    for &instant in instants {
        let Some(from) = begin.filter(|from| instant - from > LEAST_SPAN_S - ROUNDING_S) else {
            begin.get_or_insert(instant);
            continue;
        };
        begin = Some(instant);
        first += windows[first..].partition_point(|window| window.to_s <= from);
        let inside = windows[first..].iter().take_while(|window| window.from_s < instant);
        let (sum, covered) = inside.fold((0.0, 0.0), |(sum, covered), window| {
            let shared = window.to_s.min(instant) - window.from_s.max(from);
            (sum + shared * window.mean, covered + shared)
        });
        if covered > (1.0 - ROUNDING_S) * (instant - from) {
            from_s.push(from);
            to_s.push(instant);
            means.push(sum / covered);
        }
    }
    let is_slow = felt.mean.period_s() > LEAST_SPAN_S || from_s.len() < 2;
    if is_slow {
        return Ok(felt.clone());
    }
    Ok(MeanAcceleration { mean: Timed::new("acceleration", to_s, means)?, from_s: from_s.into() })
}

/// Least averaging time, s: below the time scale of a vehicle and its propellers.
const LEAST_SPAN_S: f64 = 0.1;

impl TrialRecord {
    /// Applies to a simulated motion the high-pass of velocity from acceleration; axes with a
    /// measured velocity are unchanged.
    pub(crate) fn as_gained(&self, times: &[f64], motion: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let mut seen = motion.to_vec();
        if self.by_acceleration == [false; 3] {
            return seen;
        }
        let translation = |of: &Vector6<f64>| of.fixed_rows::<3>(0).into_owned();
        let start = times.first().map_or_else(Vector6::zeros, |t| self.velocity_at(*t));
        let mut gained = Gained::new(self.by_acceleration, translation(&start));
        for k in 1..seen.len() {
            let (v, before) = (translation(&motion[k]), translation(&motion[k - 1]));
            let (h, t) = (times[k] - times[k - 1], 0.5 * (times[k] + times[k - 1]));
            let omega = turning(self.rates.as_ref(), t);
            let a = (v - before) / h + omega.cross(&(0.5 * (v + before)));
            for axis in (0..3).filter(|axis| !self.by_acceleration[*axis]) {
                gained.velocity[axis] = v[axis];
            }
            if h > GAP_S {
                gained.restart();
            }
            gained.step(&a, &omega, h);
            gained.axes().for_each(|axis| seen[k][axis] = gained.velocity[axis]);
        }
        if let Some(first) = seen.first_mut() {
            for axis in (0..3).filter(|axis| self.by_acceleration[*axis]) {
                first[axis] = start[axis];
            }
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_between_instants_include_fractions_of_samples() {
        let ends: Vec<f64> = (1..=50).map(|k| 0.02 * f64::from(k)).collect();
        let middles = ends.iter().map(|t| t - 0.01).collect::<Vec<f64>>();
        let from_s = ends.iter().map(|t| t - 0.02).collect();
        let felt =
            MeanAcceleration { mean: Timed::new("ramp", ends, middles).expect("valid"), from_s };
        let instants = [0.03, 0.08, 0.15, 0.31, 0.5, 2.0];
        let found = between(&felt, &instants).expect("valid");
        let windows: Vec<(f64, f64)> = found.windows().map(|x| (x.from_s, x.to_s)).collect();
        assert_eq!(windows, [(0.03, 0.15), (0.15, 0.31), (0.31, 0.5)]);
        for window in found.windows() {
            // Halves of samples of a ramp are off by at most a quarter of a step.
            let off = window.mean - 0.5 * (window.from_s + window.to_s);
            assert!(off.abs() < 1e-3, "{window:?}");
        }
    }

    /// A vehicle that circles and accelerates: the high-passed readings of its accelerometer equal
    /// its high-passed motion.
    #[test]
    fn high_passed_readings_equal_the_high_passed_motion() {
        let h = 0.05;
        let times: Vec<f64> = (0..2000).map(|k| h * f64::from(k)).collect();
        let speed = |t: f64| Vector3::new(0.8 * (0.4 * t).sin(), 0.2 * (0.3 * t).cos() - 0.2, 0.0);
        let slope = |t: f64| Vector3::new(0.32 * (0.4 * t).cos(), -0.06 * (0.3 * t).sin(), 0.0);
        let yaw = |t: f64| 0.3 * (0.2 * t).cos();
        let omega = |t: f64| Vector3::new(0.0, 0.0, yaw(t));
        let series = |of: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
            Timed::new("test", times.clone(), values).expect("valid")
        };
        let rates = [series(&|_| 0.0), series(&|_| 0.0), series(&yaw)];
        let mean = |axis: usize| {
            let ends = times[1..].to_vec();
            let felt = |t: &f64| {
                let t = t - 0.5 * h;
                (slope(t) + omega(t).cross(&speed(t)))[axis]
            };
            let values: Vec<f64> = ends.iter().map(felt).collect();
            let mean = Timed::new("felt", ends, values).expect("valid");
            MeanAcceleration { mean, from_s: times[..1999].into() }
        };
        let acceleration = [Some(mean(0)), Some(mean(1)), None];
        let mut velocity = [const { None }; 6];
        let by = gained(&acceleration, Some(&rates), &mut velocity).expect("valid");
        assert_eq!(by, [true, true, false]);
        let motion: Vec<Vector6<f64>> = times
            .iter()
            .map(|t| {
                let (v, w) = (speed(*t), omega(*t));
                Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
            })
            .collect();
        let record = TrialRecord {
            by_acceleration: by,
            rates: Some(rates),
            ..TrialRecord::until("circling", 100.0)
        };
        let seen = record.as_gained(&times, &motion);
        for axis in 0..2 {
            let made = velocity[axis].as_ref().expect("made");
            let off = made.time_s().iter().zip(made.values()).enumerate();
            let off = off.map(|(k, (_, x))| (x - seen[k + 1][axis]).abs()).fold(0.0, f64::max);
            assert!(off < 2e-3, "axis {axis}: {off} m/s");
            // The high-pass removes an offset of the instrument.
            let shifted = acceleration.clone().map(|felt| {
                let felt = felt?;
                Some(MeanAcceleration { mean: felt.mean.map(|x| x + 0.1), ..felt })
            });
            let mut velocity = [const { None }; 6];
            gained(&shifted, record.rates.as_ref(), &mut velocity).expect("valid");
            let with_offset = velocity[axis].as_ref().expect("made");
            let late = made.values().iter().zip(with_offset.values()).skip(1200);
            let off = late.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 0.02, "axis {axis}: an offset leaves {off} m/s");
        }
    }
}
