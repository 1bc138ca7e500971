//! Velocities from measured positions.

use nalgebra::Vector3;

use crate::motion::{body_from_world, interpolated_attitude};
use crate::navigation::{Navigated, Recording};
use crate::quantity::World;
use crate::series::median;
use crate::signal::{rms, sample_noise};
use crate::{Dof, Error, Quantity, Timed};

/// Largest ratio of noise to signal of a difference quotient, if a longer interval can achieve it.
const NOISE_PART: f64 = 0.2;

/// Longest interval of a difference quotient, s: a longer one would smooth the motion of a small
/// vehicle.
const LONGEST_S: f64 = 1.0;

/// An interval of more than so many usual ones, and longer than [`LONGEST_S`], includes a gap of
/// the log.
const GAP: f64 = 3.0;

/// Returns the difference quotients of a position over intervals without overlap, at their middles.
///
/// For closely spaced samples they would be dominated by noise, so that an interval may be several
/// samples long. There is none across a gap of the log: heading may have turned in it.
pub(super) fn slope(path: &Timed) -> Result<Timed, Error> {
    let (time_s, values): (Vec<f64>, Vec<f64>) = spans(path.time_s(), samples_of_span(&[path]))
        .map(|Span { from, to, middle_s, length_s }| {
            (middle_s, (path.values()[to] - path.values()[from]) / length_s)
        })
        .unzip();
    Timed::new("velocity", time_s, values)
}

/// Returns surge and sway of the vehicle's origin from position fixes and heading, over the
/// intervals of [`slope`]; `None` without them.
///
/// `ν = R(η)ᵀ Δp/Δt`, with the attitude in the middle of the interval and p the position of the
/// origin.
pub(super) fn velocity_by_fixes(
    recording: &Recording,
    navigated: &Navigated,
) -> Result<Option<[Timed; 2]>, Error> {
    let Some([north, east]) = new_fixes(recording, navigated)? else { return Ok(None) };
    let Some(heading) = navigated.heading.as_ref() else { return Ok(None) };
    let angle_at = |dof: Dof, t: f64| interpolated_attitude(navigated.position.get(&dof), t);
    let (mut time_s, mut parts) = (Vec::new(), [Vec::new(), Vec::new()]);
    for span in spans(north.time_s(), samples_of_span(&[&north, &east])) {
        let t = span.middle_s;
        let moved = |displacement: &Timed| {
            displacement.values()[span.to] - displacement.values()[span.from]
        };
        let world = Vector3::new(moved(&north), moved(&east), 0.0) / span.length_s;
        let angles = [
            angle_at(Dof::Roll, t),
            angle_at(Dof::Pitch, t),
            interpolated_attitude(Some(heading), t),
        ];
        let body = body_from_world(angles) * world;
        time_s.push(t);
        parts.iter_mut().zip(body.iter()).for_each(|(part, x)| part.push(*x));
    }
    let [surge, sway] = parts.map(|part| Timed::new("velocity", time_s.clone(), part));
    Ok(Some([surge?, sway?]))
}

/// Returns the displacement of the origin north and east at each new fix; a log may repeat the last
/// one until the next.
pub(super) fn new_fixes(
    recording: &Recording,
    navigated: &Navigated,
) -> Result<Option<[Timed; 2]>, Error> {
    let logged = |direction, angle| {
        recording.get(&Quantity::Position(direction)).or_else(|| recording.get(&angle))
    };
    let first = logged(World::North, Quantity::Latitude);
    let second = logged(World::East, Quantity::Longitude);
    let (Some((first, second)), Some([north, east, _])) =
        (first.zip(second), &navigated.displacement_ned)
    else {
        return Ok(None);
    };
    let fix = |t: f64| (first.at(t), second.at(t));
    let times = north.time_s();
    let is_fresh = |k: &usize| *k == 0 || fix(times[*k]) != fix(times[*k - 1]);
    let kept: Vec<usize> = (0..times.len()).filter(is_fresh).collect();
    let at_fixes = |displacement: &Timed| {
        let at_kept = |all: &[f64]| kept.iter().map(|k| all[*k]).collect::<Vec<f64>>();
        Timed::new("position", at_kept(displacement.time_s()), at_kept(displacement.values()))
    };
    Ok(Some([at_fixes(north)?, at_fixes(east)?]))
}

/// An interval between two samples.
struct Span {
    from: usize,
    to: usize,
    middle_s: f64,
    length_s: f64,
}

fn spans(time_s: &[f64], samples: usize) -> impl Iterator<Item = Span> {
    let span = move |to: usize| {
        let from = to - samples;
        let length_s = time_s[to] - time_s[from];
        Span { from, to, middle_s: 0.5 * (time_s[from] + time_s[to]), length_s }
    };
    let all = move || (samples..time_s.len()).step_by(samples).map(span);
    let usual_s = median(&mut all().map(|span| span.length_s).collect::<Vec<f64>>()).unwrap_or(0.0);
    all().filter(move |span| span.length_s <= LONGEST_S.max(GAP * usual_s))
}

/// Returns the number of samples per interval, for paths with the same sampling.
fn samples_of_span(paths: &[&Timed]) -> usize {
    let period_s = paths.iter().map(|path| path.period_s()).fold(f64::MIN_POSITIVE, f64::max);
    let most = ((LONGEST_S / period_s).round() as usize).max(1);
    let moved = |path: &&Timed| {
        let slopes = spans(path.time_s(), most);
        rms(slopes.map(|span| (path.values()[span.to] - path.values()[span.from]) / span.length_s))
    };
    let noise_of = |path: &&Timed| sample_noise([*path]).unwrap_or(0.0);
    let both = |of: &dyn Fn(&&Timed) -> f64| paths.iter().map(of).fold(0.0, f64::hypot);
    // The difference of two samples has √2 times the noise of one.
    let (speed, noise) = (both(&moved), both(&noise_of));
    let needed = 2_f64.sqrt() * noise / (NOISE_PART * speed * period_s);
    if needed.is_finite() { (needed.ceil() as usize).clamp(1, most) } else { 1 }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::navigation::navigate;
    use crate::quantity::Attitude;
    use crate::{Sensor, Sensors};

    fn series(period_s: f64, f: impl Fn(f64) -> f64) -> Timed {
        let t: Vec<f64> = (0..(60.0 / period_s) as usize).map(|k| period_s * k as f64).collect();
        let x = t.iter().map(|&t| f(t)).collect::<Vec<_>>();
        Timed::new("test", t, x).expect("valid")
    }

    /// A boat that drifts to starboard while it circles, with its antenna ahead and to port.
    fn circling(fix: impl Fn(f64) -> f64) -> [Timed; 2] {
        let (u, v, r, antenna) = (1.2, 0.3, 0.1_f64, [0.8, -0.4]);
        let displacement = move |t: f64| {
            let (sin, cos) = (r * t).sin_cos();
            // ∫ R(rt) [u, v] dt, and the lever arm.
            let north = (u * sin - v * (1.0 - cos)) / r + cos * antenna[0] - sin * antenna[1];
            let east = (u * (1.0 - cos) + v * sin) / r + sin * antenna[0] + cos * antenna[1];
            [north, east]
        };
        let recording = Recording::from([
            (Quantity::Position(World::North), series(0.2, |t| displacement(fix(t))[0])),
            (Quantity::Position(World::East), series(0.2, |t| displacement(fix(t))[1])),
            (Quantity::Attitude(Attitude::Heading), series(0.1, |t| r * t)),
        ]);
        let position = Sensor {
            position_body: Vector3::new(antenna[0], antenna[1], 0.0),
            ..Sensor::default()
        };
        let sensors = Sensors { position, ..Sensors::default() };
        let navigated = navigate("circle", &recording, &sensors).expect("complete");
        velocity_by_fixes(&recording, &navigated).expect("complete").expect("fixes")
    }

    #[test]
    fn corrects_the_lever_arm_of_an_antenna() {
        let [surge, sway] = circling(|t| t);
        let off = |series: &Timed, truth: f64| {
            series.values().iter().map(|x| (x - truth).abs()).fold(0.0, f64::max)
        };
        assert!(off(&surge, 1.2) < 1e-3 && off(&sway, 0.3) < 1e-3, "{surge:?} {sway:?}");
    }

    #[test]
    fn a_repeated_fix_counts_once() {
        // Fixes once a second, in a log of five samples a second.
        let [surge, _] = circling(|t| (t + 1e-9).floor());
        assert!(surge.len() < 60, "{}", surge.len());
        let mean = surge.values().iter().sum::<f64>() / surge.len() as f64;
        assert!((mean - 1.2).abs() < 0.05, "{mean}");
    }

    #[test]
    fn there_is_no_difference_quotient_over_a_gap() {
        let t: Vec<f64> = (0..600).map(|k| 0.1 * f64::from(k)).collect();
        let kept: Vec<f64> = t.into_iter().filter(|t| !(20.0..30.0).contains(t)).collect();
        // At 1 rad/s, unwrapping loses 2π in the gap.
        let angle = |t: &f64| if *t < 25.0 { *t } else { t - std::f64::consts::TAU };
        let angles = kept.iter().map(angle).collect::<Vec<f64>>();
        let rate = slope(&Timed::new("heading", kept, angles).expect("valid")).expect("valid");
        assert!(rate.values().iter().all(|r| (r - 1.0).abs() < 1e-9), "{rate:?}");
        assert!(rate.time_s().iter().all(|t| !(20.0..29.9).contains(t)));
    }

    #[test]
    fn intervals_grow_with_the_noise_of_a_position() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut path = |noise: f64| {
            let clean = series(0.1, |t| (0.5 * t).sin());
            let noisy =
                clean.values().iter().map(|x| x + noise * random.sample::<f64, _>(StandardNormal));
            Timed::new("path", clean.time_s().to_vec(), noisy.collect::<Vec<_>>()).expect("valid")
        };
        let [fine, coarse, hopeless] =
            [1e-3, 0.02, 1.0].map(|noise| samples_of_span(&[&path(noise)]));
        assert_eq!((fine, hopeless), (1, 10));
        assert!((3..=6).contains(&coarse), "{coarse}");
    }
}
