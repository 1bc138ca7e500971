//! Implausible values.

use super::count;
use crate::navigation::Recording;
use crate::quantity::Kind;
use crate::signal::{Hampel, Masked, frozen, spikes};
use crate::{Caveat, CaveatCode, Quantity, Timed, Vehicle};

/// Outlier detection of a measured velocity: a second of neighbours, eight standard deviations.
const VELOCITY_OUTLIERS: Hampel = Hampel { half_width: 5, threshold: 8.0, floor: 0.0 };
/// Least standard deviation of a velocity, m/s or rad/s.
const VELOCITY_NOISE_FLOOR: f64 = 0.02;

/// Removes implausible samples of measured motion, with a caveat.
pub(super) fn mask(recording: &mut Recording, caveats: &mut Vec<Caveat>) {
    for (quantity, series) in recording {
        caveats.extend(without_frozen(quantity, series));
        let Some(masked) = masked(quantity, series) else { continue };
        if let Some(first) = masked.removed_s.first() {
            let message = format!(
                "{} of {quantity} are outliers, far from their neighbours, and are left out, the first at {first:.1} s",
                count(masked.removed_s.len(), "sample", "samples")
            );
            caveats.push(Caveat::note(CaveatCode::Outliers, message));
            *series = masked.series;
        }
    }
}

/// Removes the samples in which a sensor of velocity froze.
fn without_frozen(quantity: &Quantity, series: &mut Timed) -> Option<Caveat> {
    let is_velocity = matches!(quantity, Quantity::DvlVelocity(_) | Quantity::Velocity(_));
    let masked = is_velocity.then(|| Masked::without(series, &frozen(series)))?;
    let first = *masked.removed_s.first()?;
    *series = masked.series;
    let message = format!(
        "{} of {quantity} repeat the one before, while the others do not: the sensor froze; they are left out, the first at {first:.1} s",
        count(masked.removed_s.len(), "sample", "samples")
    );
    Some(Caveat::note(CaveatCode::Outliers, message))
}

/// Removes implausible samples of a measured motion; `None` for other quantities.
fn masked(quantity: &Quantity, series: &Timed) -> Option<Masked> {
    let is_geographic = matches!(quantity, Quantity::Latitude | Quantity::Longitude);
    let angle = is_geographic || matches!(quantity, Quantity::Attitude(_));
    let of_spikes = |series: &Timed| Masked::without(series, &spikes(series, angle));
    match quantity {
        Quantity::DvlVelocity(_) | Quantity::Velocity(_) => {
            let gross = Hampel { floor: VELOCITY_NOISE_FLOOR, ..VELOCITY_OUTLIERS }.mask(series);
            let Masked { series, removed_s } = of_spikes(&gross.series);
            let mut removed_s = [gross.removed_s, removed_s].concat();
            removed_s.sort_by(f64::total_cmp);
            Some(Masked { series, removed_s })
        }
        Quantity::Attitude(_) | Quantity::Rate(_) | Quantity::Depth | Quantity::Position(_) => {
            Some(of_spikes(series))
        }
        _ if is_geographic => Some(of_spikes(series)),
        Quantity::WorldVelocity(_) | Quantity::GroundSpeed => {
            Some(Hampel { floor: VELOCITY_NOISE_FLOOR, ..VELOCITY_OUTLIERS }.mask(series))
        }
        _ => None,
    }
}

/// Returns a recording without implausible samples of measured motion.
pub(crate) fn without_outliers(mut recording: Recording) -> Recording {
    mask(&mut recording, &mut Vec::new());
    recording
}

/// Highest plausible size of a ratio: commands may be rounded, or trimmed, beyond 1.
const HIGHEST_RATIO: f64 = 1.02;

/// Returns caveats on values that are implausible in the stated unit.
pub(super) fn suspicious_units(recording: &Recording, vehicle: &Vehicle) -> Vec<Caveat> {
    let highest_rate = highest_rate(vehicle);
    let caveat = |(quantity, series)| suspicious(quantity, series, highest_rate);
    recording.iter().filter_map(caveat).collect()
}

/// Longest logging interval of thrust without a caveat, s.
const COARSE_S: f64 = 0.25;

/// Fraction of samples that change, above which a signal is not one of rare commands.
const RESTLESS_PART: f64 = 0.5;

/// Returns whether a signal is logged less often than every so many seconds, and mostly differs from one sample to
/// the next.
pub(super) fn is_slower_than(series: &Timed, least_s: f64) -> bool {
    let changes = series.values().windows(2).filter(|pair| pair[0] != pair[1]).count();
    series.period_s() > least_s && changes as f64 > RESTLESS_PART * (series.len() - 1) as f64
}

/// Returns a caveat on thrust that was logged slowly and changed in between.
pub(super) fn coarse_thrust(trial: &str, recording: &Recording) -> Option<Caveat> {
    // A battery's voltage changes slowly, and is interpolated.
    let is_held =
        |quantity: &Quantity| quantity.is_of_thrust() && *quantity != Quantity::SupplyVoltage;
    let (quantity, series) = recording
        .iter()
        .find(|(quantity, series)| is_held(quantity) && is_slower_than(series, COARSE_S))?;
    let message = format!(
        "trial `{trial}`: {quantity} is logged every {:.2} s and mostly differs from one sample to the next; filter error also tries smooth motion in between, all else holds each sample until the next, which is right for commands and can double or halve mass and drag if it moved: give its channel between = \"linear\" if it did, and log it faster next time",
        series.period_s()
    );
    Some(Caveat::warning(CaveatCode::ThrustBetweenSamples, message))
}

/// Beyond these limits, a wrong unit is more likely than such a motion.
const HIGHEST_SPEED_M_S: f64 = 20.0;
const HIGHEST_RATE_RAD_S: f64 = 6.0;
/// Highest speed of the ends of a small vehicle that rotates, m/s.
const HIGHEST_SPEED_OF_ENDS_M_S: f64 = 3.0;
/// Density of water, kg/m³, for the volume of a floating vehicle from its mass.
const WATER: f64 = 1000.0;
const DEEPEST_M: f64 = 12_000.0;
/// Greatest part of the samples of a motion that may be glitches; more of them beyond a limit say that its unit
/// is wrong.
const GLITCHES_PART: f64 = 0.02;
const HIGHEST_ANGLE_RAD: f64 = 8.0;
/// Of a rudder or fin.
pub(crate) const HIGHEST_SURFACE_ANGLE_RAD: f64 = 1.6;

/// Returns the angular velocity beyond which a wrong unit is more likely, rad/s: by the vehicle's
/// greatest length, or that of a cube of its mass.
fn highest_rate(vehicle: &Vehicle) -> f64 {
    let of_size = vehicle.size_m.map(|size| size.into_iter().fold(0.0, f64::max));
    let length = of_size.or(vehicle.dry_mass_kg.map(|mass| (mass / WATER).cbrt()));
    let of_ends = length.filter(|length| *length > 0.0);
    of_ends.map_or(HIGHEST_RATE_RAD_S, |length| {
        (2.0 * HIGHEST_SPEED_OF_ENDS_M_S / length).max(HIGHEST_RATE_RAD_S)
    })
}

fn suspicious(quantity: &Quantity, series: &Timed, highest_rate: f64) -> Option<Caveat> {
    let peak = series.values().iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
    let low = series.values().iter().copied().fold(f64::INFINITY, f64::min);
    let (limit, hint) = match quantity.kind() {
        Kind::Angle if matches!(quantity, Quantity::SurfaceAngle { .. }) => {
            (HIGHEST_SURFACE_ANGLE_RAD, "is it deg?")
        }
        Kind::Velocity => (HIGHEST_SPEED_M_S, "is it mm/s or cm/s?"),
        Kind::AngularVelocity if matches!(quantity, Quantity::Thruster { .. }) => {
            return None;
        }
        Kind::AngularVelocity => (highest_rate, "is it deg/s?"),
        Kind::Length => (DEEPEST_M, "is it mm or cm?"),
        // Headings range to 2π; an unwrapped log may exceed that, without jumps.
        Kind::Angle if has_jump(series, HIGHEST_ANGLE_RAD) || peak > 100.0 => {
            (HIGHEST_ANGLE_RAD, "is it deg?")
        }
        Kind::Ratio => (HIGHEST_RATIO, "is it %, or another quantity?"),
        Kind::PulseWidth if low < 500.0 || peak > 2500.0 => (0.0, "is it a pulse width at all?"),
        _ => return None,
    };
    (peak > limit).then(|| {
        let unit = Some(quantity.kind().unit()).filter(|unit| *unit != "1");
        let unit = unit.map_or_else(String::new, |unit| format!(" {unit}"));
        let message = format!(
            "{quantity} reaches {peak:.4}{unit}, which no vehicle does: check its unit ({hint})"
        );
        let beyond = series.values().iter().filter(|x| x.abs() > limit).count();
        let is_motion =
            matches!(quantity.kind(), Kind::Velocity | Kind::AngularVelocity | Kind::Angle);
        // A few samples may be glitches of the sensor.
        match is_motion && beyond as f64 > GLITCHES_PART * series.len() as f64 {
            true => Caveat::severe(CaveatCode::SuspiciousUnit, message),
            false => Caveat::warning(CaveatCode::SuspiciousUnit, message),
        }
    })
}

fn has_jump(series: &Timed, size: f64) -> bool {
    series.values().windows(2).any(|pair| (pair[1] - pair[0]).abs() > size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_vehicle_may_turn_once_a_second_and_a_large_one_may_not() {
        let small = Vehicle { size_m: Some([0.33, 0.28, 0.14]), ..Vehicle::default() };
        let light = Vehicle { dry_mass_kg: Some(13.5), ..Vehicle::default() };
        let large = Vehicle { size_m: Some([3.4, 2.2, 2.4]), ..Vehicle::default() };
        let highest = [&small, &light, &large, &Vehicle::default()].map(highest_rate);
        assert!(highest[0] > 6.3 && highest[1] > 6.3, "{highest:?}");
        assert_eq!(highest[2..], [HIGHEST_RATE_RAD_S; 2]);
        // Degrees for radians are far above the limit.
        assert!(highest[1] < 57.3);
    }

    /// A receiver loses its corrections for one fix, three metres off, near the meridian of 180°.
    #[test]
    fn fixes_that_jump_are_left_out() {
        let time_s: Vec<f64> = (0..200).map(|k| 0.2 * f64::from(k)).collect();
        let angle = |t: &f64| {
            let noise = 2e-9 * (7.0 * t * t).sin();
            let jump = if (*t - 20.0).abs() < 0.01 { 3.0 / 6.37e6 } else { 0.0 };
            let angle = std::f64::consts::PI - 1e-6 + 1.5e-7 * t + noise + jump;
            if angle > std::f64::consts::PI { angle - std::f64::consts::TAU } else { angle }
        };
        let values = time_s.iter().map(angle).collect::<Vec<f64>>();
        let longitude = Timed::new("longitude", time_s, values).expect("a series");
        let mut recording = Recording::from([(Quantity::Longitude, longitude)]);
        let mut caveats = Vec::new();
        mask(&mut recording, &mut caveats);
        assert_eq!(recording[&Quantity::Longitude].len(), 199);
        assert!(caveats[0].message.contains("the first at 20.0 s"), "{}", caveats[0].message);
    }
}
