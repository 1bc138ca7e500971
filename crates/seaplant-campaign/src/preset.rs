//! Vehicles and thrusters with published properties.

use schemars::JsonSchema;
use seaplant::{ThrustCurve, ThrustTable, ThrusterInput};
use serde::{Deserialize, Serialize};

/// A known vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VehiclePreset {
    /// Blue Robotics' BlueROV2: six thrusters, ArduSub's frame "vectored".
    #[serde(rename = "bluerov2")]
    BlueRov2,
    /// The same with eight thrusters, ArduSub's frame "vectored-6dof".
    #[serde(rename = "bluerov2-heavy")]
    BlueRov2Heavy,
}

/// A thruster of a known vehicle, as ArduSub numbers and drives it: positive input to a motor that
/// is not reversed gives force along `direction`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PresetThruster {
    pub name: &'static str,
    pub position_m: [f64; 3],
    pub direction: [f64; 3],
}

const fn thruster(name: &'static str, position_m: [f64; 3], direction: [f64; 3]) -> PresetThruster {
    PresetThruster { name, position_m, direction }
}

/// The horizontal thrusters of both vehicles: starboard bow, port bow, starboard stern, port stern.
const HORIZONTAL: [PresetThruster; 4] = [
    thruster("motor 1", [0.156, 0.111, 0.085], [-1.0, 1.0, 0.0]),
    thruster("motor 2", [0.156, -0.111, 0.085], [-1.0, -1.0, 0.0]),
    thruster("motor 3", [-0.156, 0.111, 0.085], [1.0, 1.0, 0.0]),
    thruster("motor 4", [-0.156, -0.111, 0.085], [1.0, -1.0, 0.0]),
];
const DOWN: [f64; 3] = [0.0, 0.0, 1.0];
const VERTICAL: [PresetThruster; 2] =
    [thruster("motor 5", [0.0, 0.111, 0.0], DOWN), thruster("motor 6", [0.0, -0.111, 0.0], DOWN)];
const VERTICAL_HEAVY: [PresetThruster; 4] = [
    thruster("motor 5", [0.12, 0.218, 0.0], DOWN),
    thruster("motor 6", [0.12, -0.218, 0.0], DOWN),
    thruster("motor 7", [-0.12, 0.218, 0.0], DOWN),
    thruster("motor 8", [-0.12, -0.218, 0.0], DOWN),
];

impl VehiclePreset {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::BlueRov2, Self::BlueRov2Heavy];

    /// Returns its name in a vehicle.toml.
    pub const fn key(self) -> &'static str {
        match self {
            Self::BlueRov2 => "bluerov2",
            Self::BlueRov2Heavy => "bluerov2-heavy",
        }
    }

    /// Returns its common name.
    pub const fn title(self) -> &'static str {
        match self {
            Self::BlueRov2 => "BlueROV2",
            Self::BlueRov2Heavy => "BlueROV2 Heavy",
        }
    }

    /// Returns its thrusters, by motor number.
    ///
    /// # Source
    /// Order and directions: [ArduSub], the mixes of frames 1 and 2. Positions: [Benzon2022] for
    /// the eight of the heavy vehicle, from its centre of mass; the two vertical ones of the
    /// other sit amidships, about as far out as its horizontal ones.
    pub(crate) fn thrusters(self) -> Vec<PresetThruster> {
        let vertical = match self {
            Self::BlueRov2 => &VERTICAL[..],
            Self::BlueRov2Heavy => &VERTICAL_HEAVY,
        };
        HORIZONTAL.iter().chain(vertical).copied().collect()
    }
}

/// A known thruster curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CurvePreset {
    /// Blue Robotics' T200, driven by their speed controller.
    T200,
}

/// Full throttle of the T200, forward and in reverse, kgf, at supply voltages, V.
///
/// # Source
/// [T200]: the maker's technical details.
const T200_FULL_KGF: [(f64, f64, f64); 3] =
    [(12.0, 3.71, 2.92), (16.0, 5.25, 4.1), (20.0, 6.7, 5.05)];

/// Exponent of thrust between the deadband and full throttle: less than 2, because the speed
/// controller gives less at full throttle. With it the published bench tables are met within 3 % of
/// full thrust at 12 and 16 V, 9 % at 20 V.
const T200_POWER: f64 = 1.35;

/// Pulse widths, us: stop, the deadband around it, and full throttle from it.
const STOP_US: f64 = 1500.0;
const DEADBAND_US: f64 = 25.0;
const FULL_US: f64 = 400.0;

/// Spacing of the points of the law, us.
const POINT_US: f64 = 20.0;

/// Standard deviation of a preset curve's strength, as a fraction of thrust.
pub(crate) const PRESET_STD: f64 = 0.05;

/// Returns thrust over full thrust, 0 to 1, at a distance from stop.
fn t200_part(distance_us: f64) -> f64 {
    ((distance_us - DEADBAND_US).max(0.0) / (FULL_US - DEADBAND_US)).powf(T200_POWER)
}

/// Returns the points of the law, us and N, at one of the voltages.
fn t200_points((_, forward, reverse): (f64, f64, f64)) -> Vec<(f64, f64)> {
    let steps = (FULL_US / POINT_US).round() as i32;
    let distances = (-steps..=steps).map(|k| POINT_US * f64::from(k));
    let edges = [-DEADBAND_US, DEADBAND_US];
    let all = distances.chain(edges);
    let point = |distance: f64| {
        let full = if distance < 0.0 { -reverse } else { forward };
        (STOP_US + distance, KGF * full * t200_part(distance.abs()))
    };
    all.map(point).collect()
}

/// N.
const KGF: f64 = 9.806_65;

impl CurvePreset {
    /// Returns the curve at one supply voltage, or the curves at all for a voltage that is logged.
    ///
    /// # Errors
    /// Why a voltage is refused.
    pub(crate) fn curve(self, voltage_v: Option<f64>) -> Result<ThrustCurve, String> {
        let tables =
            T200_FULL_KGF.iter().map(|&full| ThrustTable::new(Some(full.0), t200_points(full)));
        let all = tables.collect::<Result<Vec<_>, _>>();
        let all = all.and_then(|tables| ThrustCurve::tables(ThrusterInput::Pwm, tables));
        let all = all.map_err(|error| error.to_string())?;
        let Some(voltage_v) = voltage_v else { return Ok(all) };
        let (low, high) = (T200_FULL_KGF[0].0, T200_FULL_KGF[T200_FULL_KGF.len() - 1].0);
        if !(low..=high).contains(&voltage_v) {
            return Err(format!(
                "voltage_v is {voltage_v}, and the T200 is known from {low} to {high} V; give a \
                 table of your own"
            ));
        }
        let force = |pulse: f64| (pulse, all.force(pulse, Some(voltage_v)));
        let pulses = t200_points(T200_FULL_KGF[0]).into_iter().map(|(pulse, _)| pulse);
        let points = pulses.map(force).collect();
        ThrustTable::new(Some(voltage_v), points)
            .and_then(|table| ThrustCurve::tables(ThrusterInput::Pwm, vec![table]))
            .map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roll, pitch, yaw, throttle (up), forward, lateral (starboard): the factors with which
    /// ArduSub mixes commands into each motor, frames 1 and 2 [ArduSub].
    #[rustfmt::skip]
    const HEAVY_MIX: [[f64; 6]; 8] = [
        [ 0.0,  0.0,  1.0,  0.0, -1.0,  1.0],
        [ 0.0,  0.0, -1.0,  0.0, -1.0, -1.0],
        [ 0.0,  0.0, -1.0,  0.0,  1.0,  1.0],
        [ 0.0,  0.0,  1.0,  0.0,  1.0, -1.0],
        [ 1.0, -1.0,  0.0, -1.0,  0.0,  0.0],
        [-1.0, -1.0,  0.0, -1.0,  0.0,  0.0],
        [ 1.0,  1.0,  0.0, -1.0,  0.0,  0.0],
        [-1.0,  1.0,  0.0, -1.0,  0.0,  0.0],
    ];
    #[rustfmt::skip]
    const LIGHT_MIX: [[f64; 6]; 2] =
        [[1.0, 0.0, 0.0, -1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, -1.0, 0.0, 0.0]];

    /// Returns the force and the moment for which a motor is used, with the signs of the mix.
    fn used_for(thruster: &PresetThruster) -> [f64; 6] {
        let ([x, y, z], d) = (thruster.position_m, thruster.direction);
        let moment = [y * d[2] - z * d[1], z * d[0] - x * d[2], x * d[1] - y * d[0]];
        let sign = |value: f64| if value.abs() < 1e-9 { 0.0 } else { value.signum() };
        // Horizontal thrusters below the centre of mass pitch or roll the vehicle, which the mix
        // neglects.
        let tilts = if d[2] == 0.0 { [0.0, 0.0] } else { [sign(moment[0]), sign(moment[1])] };
        [tilts[0], tilts[1], sign(moment[2]), sign(-d[2]), sign(d[0]), sign(d[1])]
    }

    #[test]
    fn every_motor_does_what_ardusub_uses_it_for() {
        let heavy = VehiclePreset::BlueRov2Heavy.thrusters();
        let light = VehiclePreset::BlueRov2.thrusters();
        assert_eq!((heavy.len(), light.len()), (8, 6));
        for (thruster, mix) in heavy.iter().zip(HEAVY_MIX) {
            assert_eq!(used_for(thruster), mix, "{}", thruster.name);
        }
        let light_mix = HEAVY_MIX[..4].iter().chain(&LIGHT_MIX);
        for (thruster, mix) in light.iter().zip(light_mix) {
            assert_eq!(used_for(thruster), *mix, "{}", thruster.name);
        }
    }

    #[test]
    fn the_t200_has_the_thrust_that_its_maker_states() {
        // Blue Robotics' technical details: full throttle at 12, 16 and 20 V, kgf.
        for (voltage, forward, reverse) in
            [(12.0, 3.71, 2.92), (16.0, 5.25, 4.1), (20.0, 6.7, 5.05)]
        {
            let curve = CurvePreset::T200.curve(Some(voltage)).unwrap();
            assert!((curve.force(1900.0, None) / KGF - forward).abs() < 0.03);
            assert!((curve.force(1100.0, None) / KGF + reverse).abs() < 0.04);
            assert_eq!(curve.force(1500.0, None), 0.0);
            assert!(!curve.needs_voltage());
        }
        let between = CurvePreset::T200.curve(Some(14.0)).unwrap().force(1900.0, None) / KGF;
        assert!((between - 0.5 * (3.71 + 5.25)).abs() < 1e-9);
        assert!(CurvePreset::T200.curve(None).unwrap().needs_voltage());
        let refused = CurvePreset::T200.curve(Some(24.0)).unwrap_err();
        assert_eq!(
            refused,
            "voltage_v is 24, and the T200 is known from 12 to 20 V; give a table of your own"
        );
    }
}
