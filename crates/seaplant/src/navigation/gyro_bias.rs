//! Biases of gyroscopes, by the attitude that was logged beside them.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::Recording;
use super::attitude::AttitudeRecord;
use crate::motion::euler_rates;
use crate::quantity::Axis;
use crate::series::Reader;
use crate::{Caveat, CaveatCode, Dof, Quantity, Timed};

/// Length of the spans over which attitude and integrated rates are compared, s: long in comparison
/// to noise of attitude, short in comparison to a trial.
const SPAN_S: f64 = 10.0;

/// Least number of spans.
const LEAST_SPANS: usize = 6;

/// Least bias that is subtracted, rad/s: less turns a vehicle by a degree in a minute and a half.
const LEAST_BIAS: f64 = 2e-4;

/// Significance of a bias, in standard errors.
const SIGMAS: f64 = 4.0;

/// Prior standard deviation of the error of a gyroscope's scale: beside it a vehicle that turns one way
/// all the time shows no bias.
const SCALE_STD: f64 = 0.5;

/// Error of scale above which a rate contradicts its angle in another way than by a bias.
const WRONG_SCALE: f64 = 0.1;

/// Least cosine of pitch, below which spans are left out.
const LEAST_LEVEL: f64 = 0.3;

/// Longest step of the integral, s.
const LONGEST_STEP_S: f64 = 1.0;

/// Subtracts the constant biases of rates that contradict the logged attitude; returns a note on them.
///
/// With Θ = [φ θ ψ] and `Θ̇ = T(Θ) ω`, the bias b and the errors of scale s follow by least squares from
/// `ΔΘ − ∫T ω dt = ∫T diag(ω) dt s − ∫T dt b` over spans of ten seconds, with a prior on s. Where a rate
/// contradicts its angle by its scale, as of another sign or unit, all rates stay as they are.
///
/// # Source
/// [Fossen2021, ch. 2]: T(Θ).
pub(super) fn subtract_biases(
    trial: &str,
    recording: &mut Recording,
    attitude: &AttitudeRecord,
) -> Option<Caveat> {
    let channels = channels(recording);
    let has_angle = attitude.parts().map(|angle| angle.is_some());
    let rates = channels.each_ref().map(|channel| recording.get(channel.as_ref()?));
    let is_sought = [0, 1, 2].map(|axis| has_angle[axis] && rates[axis].is_some());
    let spans = spans(rates, attitude, has_angle)?;
    let (errors, stds) = errors(&spans, is_sought)?;
    if errors.iter().skip(3).any(|scale| scale.abs() > WRONG_SCALE) {
        return None;
    }
    let mut found = Vec::new();
    for (axis, channel) in channels.iter().enumerate() {
        let (Some(channel), bias, std) = (channel, errors[axis], stds[axis]) else { continue };
        if !is_sought[axis] || bias.abs() <= LEAST_BIAS.max(SIGMAS * std) {
            continue;
        }
        let series = recording.get_mut(channel)?;
        *series = series.map(|rate| rate - bias);
        found.push(format!("{channel} {bias:.2e} ± {std:.0e}"));
    }
    (!found.is_empty()).then(|| {
        let message = format!(
            "trial `{trial}`: gyroscopes read turns that attitude does not show; these biases, rad/s, are subtracted: {}",
            found.join(", ")
        );
        Caveat::note(CaveatCode::Navigation, message)
    })
}

/// Returns the channels of the rates about the three body axes.
fn channels(recording: &Recording) -> [Option<Quantity>; 3] {
    let yaw = [Quantity::Rate(Axis::Z), Quantity::Velocity(Dof::Yaw)];
    let known = |quantity: &Quantity| recording.contains_key(quantity);
    [
        Some(Quantity::Rate(Axis::X)).filter(known),
        Some(Quantity::Rate(Axis::Y)).filter(known),
        yaw.into_iter().find(known),
    ]
}

/// A span: what integrated rates lack of the change of each angle, and what bias and scale change
/// that by.
struct Span {
    missing: [Option<f64>; 3],
    by: [Vector6<f64>; 3],
}

/// Compares attitude with integrated rates; `None` without any rate.
fn spans(
    rates: [Option<&Timed>; 3],
    attitude: &AttitudeRecord,
    has_angle: [bool; 3],
) -> Option<Vec<Span>> {
    let base = rates.into_iter().flatten().max_by_key(|rate| rate.len())?;
    let all = rates.into_iter().flatten().chain(attitude.parts().into_iter().flatten());
    let from_s = all.clone().map(Timed::first_s).fold(f64::NEG_INFINITY, f64::max);
    let to_s = all.map(Timed::last_s).fold(f64::INFINITY, f64::min);
    let mut readers: [Option<Reader<'_>>; 3] = rates.map(|rate| rate.map(Timed::reader));
    let mut reader = attitude.reader();
    let mut angles = |t: f64| {
        let (roll, pitch, heading) = reader.at(t).euler_angles();
        Vector3::new(roll, pitch, heading)
    };
    let times = base.time_s().iter().copied().filter(|t| (from_s..=to_s).contains(t));
    let mut spans = Vec::new();
    let mut open: Option<Open> = None;
    for t in times {
        let Some(span) = open.as_mut() else {
            open = Some(Open::new(t, angles(t)));
            continue;
        };
        let (h, middle) = (t - span.until_s, 0.5 * (t + span.until_s));
        let about = angles(middle);
        let is_cut = attitude.cuts.iter().any(|cut| cut.from_s < t && cut.to_s > span.from_s);
        if h > LONGEST_STEP_S || about.y.cos() < LEAST_LEVEL || is_cut {
            open = Some(Open::new(t, angles(t)));
            continue;
        }
        let omega = Vector3::from_iterator(
            readers.iter_mut().map(|rate| rate.as_mut().map_or(0.0, |rate| rate.at(middle))),
        );
        span.add(h, &about, &omega);
        span.until_s = t;
        if t - span.from_s >= SPAN_S {
            let now = angles(t);
            spans.push(span.closed(&now, has_angle));
            open = Some(Open::new(t, now));
        }
    }
    Some(spans)
}

/// A span that has not ended.
struct Open {
    from_s: f64,
    until_s: f64,
    first: Vector3<f64>,
    /// ∫T ω dt, ∫T dt and ∫T diag(ω) dt.
    turned: Vector3<f64>,
    by_bias: Matrix3<f64>,
    by_scale: Matrix3<f64>,
}

impl Open {
    fn new(from_s: f64, first: Vector3<f64>) -> Self {
        let (turned, by_bias, by_scale) = (Vector3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        Self { from_s, until_s: from_s, first, turned, by_bias, by_scale }
    }

    /// Adds a step of h seconds.
    fn add(&mut self, h: f64, angles: &Vector3<f64>, omega: &Vector3<f64>) {
        let t = euler_rates(angles.x, angles.y);
        self.turned += t * omega * h;
        self.by_bias += t * h;
        self.by_scale += t * Matrix3::from_diagonal(omega) * h;
    }

    fn closed(&self, last: &Vector3<f64>, has_angle: [bool; 3]) -> Span {
        let change = |axis: usize| {
            let change = last[axis] - self.first[axis] - self.turned[axis];
            // Headings differ by whole turns.
            let turns = (change / std::f64::consts::TAU).round();
            change - turns * std::f64::consts::TAU
        };
        Span {
            missing: [0, 1, 2].map(|axis| has_angle[axis].then(|| change(axis))),
            by: [0, 1, 2].map(|axis| {
                let (bias, scale) = (self.by_bias.row(axis), self.by_scale.row(axis));
                Vector6::new(-bias[0], -bias[1], -bias[2], scale[0], scale[1], scale[2])
            }),
        }
    }
}

/// Returns b and s with their standard deviations; `None` where spans are too few.
fn errors(spans: &[Span], is_sought: [bool; 3]) -> Option<(Vector6<f64>, Vector6<f64>)> {
    if spans.len() < LEAST_SPANS {
        return None;
    }
    let free = Vector6::from_fn(|k, _| if is_sought[k % 3] { 1.0 } else { 0.0 });
    let rows: Vec<(f64, Vector6<f64>)> = spans
        .iter()
        .flat_map(|span| [0, 1, 2].map(|axis| Some((span.missing[axis]?, span.by[axis]))))
        .flatten()
        .map(|(missing, by)| (missing, by.component_mul(&free)))
        .collect();
    let unknowns = free.sum();
    let freedom = (rows.len() as f64 - unknowns).max(1.0);
    let mut variance = 1e-12;
    let mut found = None;
    // The first fit estimates the noise, which scales the prior.
    for _ in 0..2 {
        let mut normal = Matrix6::from_diagonal(&free.map(|free| 1.0 - free));
        (3..6).for_each(|k| normal[(k, k)] += variance / SCALE_STD.powi(2));
        let mut right = Vector6::zeros();
        for (missing, by) in &rows {
            normal += by * by.transpose();
            right += by * *missing;
        }
        let inverse = normal.try_inverse()?;
        let theta = inverse * right;
        let square = |(missing, by): &(f64, Vector6<f64>)| (missing - theta.dot(by)).powi(2);
        variance = rows.iter().map(square).sum::<f64>() / freedom;
        found = Some((theta, (inverse * variance).diagonal().map(f64::sqrt)));
    }
    found.filter(|(errors, std)| errors.iter().chain(std).all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::Sensors;
    use crate::quantity::Attitude;

    /// A vehicle that rolls, pitches and turns, sampled at 20 Hz, with noise of attitude.
    fn turning(bias: [f64; 3], scale: f64, noise: f64) -> Recording {
        let h = 0.05;
        let rate = |t: f64| {
            Vector3::new(0.2 * (0.9 * t).sin(), 0.1 * (0.5 * t).cos(), 0.15 + 0.3 * (0.2 * t).sin())
        };
        let (mut rotation, mut rates, mut angles) =
            (Rotation3::identity(), [vec![], vec![], vec![]], [vec![], vec![], vec![]]);
        let mut time_s = Vec::new();
        for k in 0..6000 {
            let t = h * f64::from(k);
            time_s.push(t);
            let (roll, pitch, heading) = rotation.euler_angles();
            for (axis, angle) in [roll, pitch, heading].into_iter().enumerate() {
                let chance = (7919.0 * (f64::from(k) + 0.3 * axis as f64)).sin();
                angles[axis].push(angle + noise * 2_f64.sqrt() * chance);
                rates[axis].push(scale * rate(t)[axis] + bias[axis]);
            }
            rotation *= Rotation3::new(rate(t + 0.5 * h) * h);
        }
        let series = |x: Vec<f64>| Timed::new("test", time_s.clone(), x).expect("valid");
        let rate = [Axis::X, Axis::Y, Axis::Z].map(Quantity::Rate);
        let angle = [Attitude::Roll, Attitude::Pitch, Attitude::Heading].map(Quantity::Attitude);
        rate.into_iter().chain(angle).zip(rates.into_iter().chain(angles).map(series)).collect()
    }

    fn subtracted(mut recording: Recording) -> ([f64; 3], Option<Caveat>) {
        let attitude = AttitudeRecord::take(&mut recording, &Sensors::default());
        let before = recording.clone();
        let caveat = subtract_biases("a", &mut recording, &attitude);
        let of = |axis| {
            before[&Quantity::Rate(axis)].values()[9] - recording[&Quantity::Rate(axis)].values()[9]
        };
        ([Axis::X, Axis::Y, Axis::Z].map(of), caveat)
    }

    #[test]
    fn biases_of_half_a_degree_a_second_are_subtracted() {
        let bias = [0.008, -0.005, 0.003];
        let (found, caveat) = subtracted(turning(bias, 1.0, 0.003));
        for (found, bias) in found.iter().zip(bias) {
            assert!((found - bias).abs() < LEAST_BIAS, "{found} and {bias}");
        }
        let message = caveat.expect("a note").message;
        assert!(message.contains("rate.roll 7.98e-3 ±"), "{message}");
    }

    #[test]
    fn rates_without_bias_stay_as_they_are() {
        for scale in [1.0, 1.01] {
            let (found, caveat) = subtracted(turning([0.0; 3], scale, 0.005));
            assert_eq!((found, caveat), ([0.0; 3], None), "{scale}");
        }
    }

    /// Of a vehicle that turns one way most of the time half of the rate would pass for a bias.
    #[test]
    fn a_rate_of_another_sign_or_scale_is_no_bias() {
        for scale in [-1.0, 0.5, 1.3] {
            let (found, caveat) = subtracted(turning([0.0; 3], scale, 0.003));
            assert_eq!((found, caveat), ([0.0; 3], None), "{scale}");
        }
    }

    #[test]
    fn a_rate_without_its_angle_stays_as_it_is() {
        let mut recording = turning([0.01; 3], 1.0, 0.003);
        recording.remove(&Quantity::Attitude(Attitude::Roll));
        let (found, _) = subtracted(recording);
        assert_eq!(found[0], 0.0);
    }
}
