//! Detects numbers that encode missing data, and pulse widths of zero.

use std::sync::Arc;

use seaplant::{Caveat, CaveatCode, Quantity, ThrusterInput, Vehicle};
use seaplant_log::Channel;

/// A number that encodes missing data, and the number of samples with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MissingCode {
    pub(crate) value: f64,
    pub(crate) count: usize,
    /// True if it is the limit of an integer type, which nobody chooses.
    is_limit: bool,
}

/// Limits of integer types, which instruments write where they have no measurement.
const LIMITS: [f64; 6] =
    [32_767.0, 32_768.0, 65_535.0, 2_147_483_647.0, 2_147_483_648.0, 4_294_967_295.0];

/// Numbers of nines, and those that marine and aeronautical libraries use for missing data.
const CHOSEN: [f64; 11] =
    [999.0, 9999.0, 99_999.0, 999_999.0, 9999.9, 999.9, 99.99, 999.99, 1e20, 1e30, 1e37];

/// Finds codes for missing data: [`LIMITS`] over a power of ten, or [`CHOSEN`], that are far from
/// all other values and occur more than once.
pub(crate) fn missing_codes(values: &[f64]) -> Vec<MissingCode> {
    const OFTEN: usize = 2;
    let mut codes: Vec<f64> = Vec::new();
    // A code far from all others is at an end of the range of the remaining values.
    let [low, high] = loop {
        let others = || values.iter().copied().filter(|x| !codes.contains(x));
        let low = others().fold(f64::INFINITY, f64::min);
        let high = others().fold(f64::NEG_INFINITY, f64::max);
        if low > high {
            return Vec::new();
        }
        match [low, high].into_iter().find(|end| apart_by(*end).is_some()) {
            Some(code) => codes.push(code),
            None => break [low, high],
        }
    };
    let size = (high - low).max(high.abs()).max(low.abs());
    let is_far = |x: f64| apart_by(x).is_some_and(|spans| (x - high).max(low - x) > spans * size);
    let count = |value: f64| values.iter().filter(|x| **x == value).count();
    let far = codes.iter().filter(|code| is_far(**code));
    let is_limit = |value: f64| !CHOSEN.contains(&value.abs());
    let counted =
        far.map(|&value| MissingCode { value, count: count(value), is_limit: is_limit(value) });
    let mut codes: Vec<MissingCode> = counted.filter(|code| code.count >= OFTEN).collect();
    codes.sort_by(|a, b| a.value.total_cmp(&b.value));
    codes
}

/// Returns the ratio by which a code must exceed all other values; `None` for a number that is no
/// code. The digits of an integer limit are evidence enough.
fn apart_by(x: f64) -> Option<f64> {
    const LIMIT: f64 = 0.5;
    const CHOICE: f64 = 3.0;
    if CHOSEN.contains(&x.abs()) {
        return Some(CHOICE);
    }
    LIMITS.iter().any(|limit| is_scaled(x.abs(), *limit)).then_some(LIMIT)
}

/// Returns whether a number is an integer over a power of ten, within the precision of its type.
fn is_scaled(x: f64, integer: f64) -> bool {
    const POWERS: std::ops::RangeInclusive<i32> = 0..=7;
    let is_single = f64::from(x as f32) == x;
    let rounding = if is_single { f64::from(f32::EPSILON) } else { 1e-12 };
    let power = (integer / x).log10().round();
    let scaled = x * 10f64.powf(power);
    x > 0.0 && POWERS.contains(&(power as i32)) && (scaled / integer - 1.0).abs() <= rounding
}

/// Removes codes for missing data from a column, and counts them in a caveat. Commands are exempt
/// because they may be any number, and a thruster's speed or pulse width may be 999.
pub(crate) fn without_codes(
    trial: &str,
    quantity: &Quantity,
    channel: Channel,
    caveats: &mut Vec<Caveat>,
) -> (Arc<[f64]>, Vec<f64>) {
    let mut codes = missing_codes(channel.values());
    match quantity {
        Quantity::Thruster { input: ThrusterInput::Speed | ThrusterInput::Pwm, .. } => {
            codes.retain(|code| code.is_limit);
        }
        quantity if quantity.is_of_thrust() => codes.clear(),
        _ => {}
    }
    if codes.is_empty() {
        return channel.into_samples();
    }
    let column = channel.column.clone();
    let (time_s, values) = channel.into_samples();
    for MissingCode { value, count, .. } in &codes {
        let first = values.iter().position(|x| x == value).unwrap_or_default();
        let message = format!(
            "trial `{trial}`: column {column:?} holds {value} in {count} samples, first at {:.2} s, far from all others: taken for a code of missing data and left out",
            time_s[first]
        );
        caveats.push(Caveat::warning(CaveatCode::Outliers, message));
    }
    let samples = time_s.iter().zip(&values);
    let present = samples.filter(|(_, x)| codes.iter().all(|code| code.value != **x));
    let (time_s, values): (Vec<f64>, Vec<f64>) = present.map(|(t, x)| (*t, *x)).unzip();
    (time_s.into(), values)
}

/// Pulse width at which a hobby speed controller stops, us.
pub(crate) const STOPPED_US: f64 = 1500.0;

/// Pulse widths of servos are longer, us.
const SHORTEST_US: f64 = 500.0;

/// Replaces pulses of 0 us, which a disarmed controller logs when it sends none, by the pulse that
/// stops the thruster, with a caveat.
pub(crate) fn stop_without_pulse(
    trial: &str,
    quantity: &Quantity,
    vehicle: &Vehicle,
    pulses_us: &mut [f64],
) -> Option<Caveat> {
    let Quantity::Thruster { name, input: ThrusterInput::Pwm } = quantity else { return None };
    let mut thrusters = vehicle.thrusters.iter().chain(&vehicle.propellers);
    let curve = thrusters.find(|thruster| thruster.name == *name).map(|thruster| &thruster.curve);
    let of_pulses = curve.filter(|curve| curve.input() == ThrusterInput::Pwm);
    let neutral = of_pulses.map_or(STOPPED_US, |curve| curve.neutral());
    let pulsed = |x: &f64| *x != 0.0;
    let (first, last) = (pulses_us.iter().position(pulsed)?, pulses_us.iter().rposition(pulsed)?);
    let is_interrupted = pulses_us[first..=last].contains(&0.0);
    let missing = pulses_us.iter_mut().filter(|x| **x == 0.0);
    if neutral < SHORTEST_US {
        return None;
    }
    let count = missing.map(|x| *x = neutral).count();
    let message = format!(
        "trial `{trial}`: {quantity} is 0 us in {count} samples: no pulse, as of a disarmed controller; taken as {neutral} us, which stops the thruster"
    );
    match (count, is_interrupted) {
        (0, _) => None,
        (_, true) => Some(Caveat::warning(
            CaveatCode::Log,
            message + "; some are between pulses: check that the controller was disarmed there",
        )),
        (_, false) => Some(Caveat::note(CaveatCode::Log, message)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(others: &[f64], code: f64) -> Vec<f64> {
        let values: Vec<f64> = others.iter().copied().chain([code, code]).collect();
        missing_codes(&values).iter().map(|code| code.value).collect()
    }

    #[test]
    fn ends_of_integers_are_codes_in_any_unit() {
        for code in [32767.0, -32768.0, 3276.7, 327.67, 32.767, -3.2768, 65.535, 2147.483647] {
            assert_eq!(codes(&[0.1, 0.2, 0.3], code), [code]);
        }
        // In single precision, and as a product.
        let (single, product) = (f64::from(3276.7_f32), 0.1 * 32767.0);
        assert_eq!(codes(&[-1500.0, 1500.0], single), [single]);
        assert_eq!(codes(&[-1500.0, 1500.0], product), [product]);
    }

    #[test]
    fn numbers_near_the_others_or_alone_are_values() {
        assert!(codes(&[3270.0, 3275.0], 3276.7).is_empty());
        assert!(codes(&[0.0, 30_000.0], 32_767.0).is_empty());
        assert!(codes(&[0.1, 0.2], 3276.8).contains(&3276.8));
        assert!(codes(&[0.1, 0.2], 3276.9).is_empty());
        assert!(missing_codes(&[0.1, 0.2, 3276.7]).is_empty());
        assert!(missing_codes(&[3276.7, 3276.7]).is_empty());
    }

    #[test]
    fn a_missing_pulse_stops_the_thruster() {
        let quantity: Quantity = "thruster.T1.pwm".parse().expect("a quantity");
        let stop =
            |pulses: &mut [f64]| stop_without_pulse("a", &quantity, &Vehicle::default(), pulses);
        let mut ends = [0.0, 1600.0, 1400.0, 0.0];
        let caveat = stop(&mut ends).expect("two are missing");
        assert_eq!(ends, [1500.0, 1600.0, 1400.0, 1500.0]);
        assert_eq!(caveat.severity, seaplant::Severity::Note);
        let caveat = stop(&mut [1600.0, 0.0, 1400.0]).expect("one is missing");
        assert_eq!(caveat.severity, seaplant::Severity::Warning);
        assert_eq!(stop(&mut [1600.0, 1500.0]), None);
        // A channel without pulses has no reference.
        assert_eq!(stop(&mut [0.0, 0.0]), None);
    }
}
