//! The paths along and about the body's vertical axis, from depth and heading.

use super::attitude::{AttitudeReader, AttitudeRecord};
use super::{Navigated, TRANSLATIONS};
use crate::series::Reader;
use crate::{Caveat, CaveatCode, Timed};

/// Beyond this tilt, as root mean square of the sine, surge and sway change depth significantly.
const TILT: f64 = 0.1;

/// Beyond this tilt depth does not determine heave: the cosine of 60°.
const LEAST_UPRIGHT: f64 = 0.5;

/// Contributions of each body velocity to the rate of depth: `ż = a u + b v + c w`.
#[derive(Clone, Copy)]
struct Contributions {
    of_surge: f64,
    of_sway: f64,
    of_heave: f64,
}

/// Computes the path q with `q̇ = w` from a depth z, with a caveat where it is uncertain.
///
/// `ż = −sin θ u + cos θ sin φ v + cos θ cos φ w`: where w was measured, all of ż that is not w is
/// subtracted; otherwise the contributions of u and v are subtracted, and the rest is divided by
/// cos θ cos φ. Without roll and pitch the vehicle is assumed level and q = z.
///
/// # Source
/// [Fossen2021]: the third row of the rotation from body to north-east-down.
pub(super) fn heave_path(
    trial: &str,
    depth: &Timed,
    attitude: &AttitudeRecord,
    nav: &Navigated,
) -> (Timed, Option<Caveat>) {
    if !attitude.knows_tilt() {
        return (depth.clone(), None);
    }
    let velocity = TRANSLATIONS.map(|dof| nav.measured.get(&dof));
    let mut beside = OtherMotion {
        attitude: attitude.reader(),
        velocity: velocity.map(|velocity| velocity.map(Timed::reader)),
        squares: [0.0; 2],
        instants: 0,
    };
    let (t, z) = (depth.time_s(), depth.values());
    let times = times(depth, velocity);
    let mut from = 0;
    let mut q = Vec::with_capacity(depth.len());
    q.push(z[0]);
    for k in 1..z.len() {
        let to = from + times[from..].partition_point(|time| *time <= t[k]);
        let (changed, upright) = beside.over(&times[from..to]);
        q.push(q[k - 1] + (z[k] - z[k - 1] - changed) / upright);
        from = to - 1;
    }
    let caveat = beside.doubt(trial);
    // Finite depths less finite paths are finite.
    (depth.with_values("the heave path", q).unwrap_or_else(|_| depth.clone()), caveat)
}

/// Computes the path q with `q̇ = r` from a heading ψ: `r = cos θ cos φ ψ̇ − sin φ θ̇`.
///
/// Without roll and pitch the vehicle is assumed level and q = ψ.
///
/// # Source
/// [Fossen2021]: the third row of the matrix from the rates of Euler's angles to those of the body.
pub(super) fn yaw_path(heading: &Timed, attitude: &AttitudeRecord) -> Timed {
    if !attitude.knows_tilt() {
        return heading.clone();
    }
    let mut tilt = attitude.tilt_reader();
    let mut before: Option<([f64; 2], f64, f64)> = None;
    let path = heading.time_s().iter().zip(heading.values()).map(|(&t, &psi)| {
        let now = tilt.each_mut().map(|angle| angle.as_mut().map_or(0.0, |angle| angle.at(t)));
        let Some((then, psi_then, q)) = before.replace((now, psi, psi)) else { return psi };
        let [roll, pitch] = [0, 1].map(|k| 0.5 * (then[k] + now[k]));
        let turned = pitch.cos() * roll.cos() * (psi - psi_then);
        let q = q + turned - roll.sin() * (now[1] - then[1]);
        before = Some((now, psi, q));
        q
    });
    // Finite angles make finite sums.
    heading.with_values("the yaw path", path.collect()).unwrap_or_else(|_| heading.clone())
}

/// Returns the times of depth, and between them those of the fastest velocity.
fn times(depth: &Timed, velocity: [Option<&Timed>; 3]) -> Vec<f64> {
    let fastest = velocity.into_iter().flatten().max_by_key(|velocity| velocity.len());
    let between = fastest.map_or(&[][..], |fastest| fastest.time_s()).iter();
    let inside = between.filter(|t| (depth.first_s()..=depth.last_s()).contains(*t));
    let mut times: Vec<f64> = depth.time_s().iter().chain(inside).copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

/// Changes of depth other than by heave.
struct OtherMotion<'a> {
    attitude: AttitudeReader<'a>,
    velocity: [Option<Reader<'a>>; 3],
    /// Σ of the squared contributions of surge and sway.
    squares: [f64; 2],
    instants: usize,
}

impl OtherMotion<'_> {
    /// Integrates the change of depth other than by heave over some times by the trapezoidal rule;
    /// returns it with the divisor of the rest.
    fn over(&mut self, times: &[f64]) -> (f64, f64) {
        let (mut changed, mut upright) = (0.0, 0.0);
        let mut before: Option<(f64, f64)> = None;
        for &t in times {
            let to_world = self.attitude.at(t);
            let [of_surge, of_sway, of_heave] = [0, 1, 2].map(|column| to_world[(2, column)]);
            let rate = self.rate(Contributions { of_surge, of_sway, of_heave }, t);
            if let Some((t_before, rate_before)) = before {
                changed += 0.5 * (t - t_before) * (rate + rate_before);
            }
            before = Some((t, rate));
            upright += of_heave;
            self.squares[0] += of_surge.powi(2);
            self.squares[1] += of_sway.powi(2);
            self.instants += 1;
        }
        let upright = match self.velocity[2] {
            Some(_) => 1.0,
            None => (upright / times.len() as f64).max(LEAST_UPRIGHT),
        };
        (changed, upright)
    }

    /// Returns the part of the rate of depth that is not heave.
    fn rate(&mut self, contributions: Contributions, t_s: f64) -> f64 {
        let [u, v, w] = self.velocity.each_mut().map(|v| v.as_mut().map(|v| v.at(t_s)));
        let of_heave = w.map_or(0.0, |w| (contributions.of_heave - 1.0) * w);
        contributions.of_surge * u.unwrap_or(0.0)
            + contributions.of_sway * v.unwrap_or(0.0)
            + of_heave
    }

    /// Returns a caveat for tilt of a vehicle whose horizontal velocity is unknown.
    fn doubt(&self, trial: &str) -> Option<Caveat> {
        let of = [("pitches", "surge"), ("rolls", "sway")];
        let tilts = self.squares.map(|squares| (squares / self.instants.max(1) as f64).sqrt());
        let tilted = |k: &usize| self.velocity[*k].is_none() && tilts[*k] > TILT;
        let k = [0, 1].into_iter().find(tilted)?;
        let (how, lacking) = of[k];
        let message = format!(
            "trial `{trial}`: the vehicle {how} by {:.0}° (root mean square) and its {lacking} velocity is not logged: part of its forward or sideways motion changes depth and is taken for heave; map velocity.{lacking} or dvl.velocity",
            tilts[k].asin().to_degrees()
        );
        Some(Caveat::warning(CaveatCode::Navigation, message))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::quantity::Attitude;
    use crate::{Dof, Quantity, Recording, Sensors};

    const PERIOD_S: f64 = 0.01;

    fn series(of: impl Fn(f64) -> f64) -> Timed {
        let time_s: Vec<f64> = (0..6000).map(|k| PERIOD_S * f64::from(k)).collect();
        let values = time_s.iter().map(|t| of(*t)).collect::<Vec<_>>();
        Timed::new("test", time_s, values).expect("valid")
    }

    fn pitch(t: f64) -> f64 {
        0.3 * (0.5 * t).sin()
    }
    fn roll(t: f64) -> f64 {
        0.2 * (0.7 * t).cos()
    }
    fn velocity(t: f64) -> [f64; 3] {
        [0.8 + 0.3 * (0.2 * t).sin(), 0.4 * (0.3 * t).cos(), 0.5 * (0.4 * t).sin()]
    }

    /// Integrates depth from body velocity, every 0.01 s.
    fn depth() -> Timed {
        let sink = |t: f64| {
            let ([u, v, w], (phi, theta)) = (velocity(t), (roll(t), pitch(t)));
            -theta.sin() * u + theta.cos() * (phi.sin() * v + phi.cos() * w)
        };
        let mut z = 5.0;
        let values: Vec<f64> = (0..6000)
            .map(|k| {
                let now = z;
                let t = PERIOD_S * f64::from(k);
                z += 0.5 * PERIOD_S * (sink(t) + sink(t + PERIOD_S));
                now
            })
            .collect();
        series(|_| 0.0).with_values("depth", values).expect("finite")
    }

    fn path(measured: &[Dof]) -> (Timed, Option<Caveat>) {
        let mut recording = Recording::from([
            (Quantity::Attitude(Attitude::Pitch), series(pitch)),
            (Quantity::Attitude(Attitude::Roll), series(roll)),
        ]);
        let attitude = AttitudeRecord::take(&mut recording, &Sensors::default());
        let of = |dof: &Dof| (*dof, series(|t| velocity(t)[dof.index()]));
        let measured: BTreeMap<Dof, Timed> = measured.iter().map(of).collect();
        let nav = Navigated { measured, ..Navigated::default() };
        heave_path("a", &depth(), &attitude, &nav)
    }

    /// Returns the greatest error of the path of a heave velocity, m.
    fn worst(path: &Timed) -> f64 {
        let exact = |t: f64| 5.0 + 0.5 / 0.4 * (1.0 - (0.4 * t).cos());
        let off = path.time_s().iter().zip(path.values()).map(|(t, q)| (q - exact(*t)).abs());
        off.fold(0.0, f64::max)
    }

    #[test]
    fn a_tilted_vehicle_turns_by_less_than_its_heading() {
        let (heading, rate) = (|t: f64| 0.9 * (0.25 * t).sin(), |t: f64| 0.225 * (0.25 * t).cos());
        let r = |t: f64| {
            let pitch_rate = 0.15 * (0.5 * t).cos();
            pitch(t).cos() * roll(t).cos() * rate(t) - roll(t).sin() * pitch_rate
        };
        let mut recording = Recording::from([
            (Quantity::Attitude(Attitude::Pitch), series(pitch)),
            (Quantity::Attitude(Attitude::Roll), series(roll)),
        ]);
        let attitude = AttitudeRecord::take(&mut recording, &Sensors::default());
        let path = yaw_path(&series(heading), &attitude);
        let slope = crate::signal::differentiate_timed(&path).expect("long enough");
        // Error of sums of increments at 100 Hz, rad/s.
        const RULE_RAD_S: f64 = 1e-4;
        let inside = slope.time_s().iter().zip(slope.values()).skip(1).take(5000);
        inside.for_each(|(t, v)| assert!((v - r(*t)).abs() < RULE_RAD_S, "{t} {v} {}", r(*t)));
    }

    #[test]
    fn a_pitching_vehicle_under_way_does_not_heave_by_its_surge() {
        // Error of the trapezoidal rule at 100 Hz, m.
        const RULE_M: f64 = 1e-3;
        let (all, doubt) = path(&[Dof::Surge, Dof::Sway, Dof::Heave]);
        assert!(worst(&all) < RULE_M && doubt.is_none(), "{}", worst(&all));
        let (without_heave, doubt) = path(&[Dof::Surge, Dof::Sway]);
        assert!(worst(&without_heave) < RULE_M && doubt.is_none(), "{}", worst(&without_heave));
        let (alone, doubt) = path(&[]);
        assert!(worst(&alone) > 0.5);
        let message = doubt.expect("surge is unknown").message;
        assert!(message.contains("pitches by 12°"), "{message}");
    }
}
