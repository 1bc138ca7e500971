//! Thrust curves.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use seaplant::plant::WakeByDrift;
use seaplant::results::InputFile;
use seaplant::{
    EXPONENTS, PropellerCurve, QuadraticThrust, ThrustCurve, ThrustTable, ThrusterInput, exact,
};
use serde::{Deserialize, Serialize};

use crate::bench::{BenchColumns, read_bench};
use crate::preset::{CurvePreset, PRESET_STD};
use crate::{Error, toml_file};

/// A thrust curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum CurveEntry {
    /// Force proportional to the squared input, or to another power of it.
    Quadratic(QuadraticEntry),
    /// Force interpolated between measured points.
    Table(TableEntry),
    /// The published curve of a known thruster.
    Preset(PresetCurveEntry),
    /// A curve of unknown strength, `k n|n|`, to be estimated by a plant of several axes.
    Estimate(EstimateCurveEntry),
    /// A propeller with known open-water curve, for plants of several axes.
    OpenWater(OpenWaterEntry),
}

/// `T = (1 − t) ρ n² D⁴ K_T(J)`, `J = u (1 − w)/(n D)`, `K_T = k0 + k1 J + k2 J²`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenWaterEntry {
    /// Diameter D, m.
    pub diameter_m: f64,
    /// k0, k1, k2.
    #[serde(deserialize_with = "exact::numbers")]
    pub k_t: [f64; 3],
    /// Wake fraction w: 0 for a propeller without a hull ahead of it.
    pub wake: f64,
    /// Change of the wake with drift: `{ rate = C1, greatest = [C2 of flow from starboard, C2 of
    /// flow from port] }`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wake_by_drift: Option<WakeByDrift>,
    /// Thrust deduction fraction t; estimated if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_deduction: Option<f64>,
}

impl OpenWaterEntry {
    pub(super) fn curve(&self, path: &Path, thruster: &str) -> Result<PropellerCurve, Error> {
        let Self { diameter_m, k_t, wake, wake_by_drift, thrust_deduction } = *self;
        PropellerCurve { diameter_m, k_t, wake, wake_by_drift, thrust_deduction }
            .checked(thruster)
            .map_err(Error::model(path))
    }
}

/// Standard deviations of thrust, as fractions of it: 0.05 for 5 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct UncertaintyEntry {
    /// For positive thrust.
    pub forward: f64,
    /// For negative thrust.
    pub reverse: f64,
}

/// An unknown curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EstimateCurveEntry {
    /// The logged quantity n: speed (rad/s) or command (−1 to 1).
    #[serde(default = "speed")]
    pub input: ThrusterInput,
}

/// The published curve of a known thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PresetCurveEntry {
    /// The curve.
    pub name: CurvePreset,
    /// The supply voltage, V; the logged supply.voltage if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voltage_v: Option<f64>,
}

/// `F = forward s^p` or `−reverse |s|^p`, s being the input beyond the deadband, and p the exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadraticEntry {
    /// N per squared unit of input, for positive input: N/(rad/s)² for a speed.
    pub forward: f64,
    /// N per squared unit of input, for negative input.
    pub reverse: f64,
    /// The exponent p: 2 by default. Both coefficients are then N per unit of input to the power p.
    #[serde(default = "square", skip_serializing_if = "is_square")]
    pub exponent: f64,
    /// The logged quantity: speed (rad/s), pwm (us) or command (−1 to 1).
    #[serde(default = "speed")]
    pub input: ThrusterInput,
    /// Inputs this close to neutral give no thrust; rad/s, us or a ratio.
    #[serde(default)]
    pub deadband: f64,
    /// The input at zero thrust: 0 by default, 1500 for pwm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub neutral: Option<f64>,
    /// The supply voltage at which the curve was measured, V: thrust at a logged supply.voltage is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voltage_v: Option<f64>,
}

const fn square() -> f64 {
    2.0
}

fn is_square(exponent: &f64) -> bool {
    *exponent == square()
}

const fn speed() -> ThrusterInput {
    ThrusterInput::Speed
}

/// Points, or a file of them; several files for several supply voltages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TableEntry {
    /// The logged quantity: speed (rad/s), pwm (us) or command (−1 to 1).
    pub input: Option<ThrusterInput>,
    /// Points `[input, force in N]`, input in rad/s, us or as a ratio.
    #[serde(deserialize_with = "exact::rows_of_numbers", skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// A table with a column of inputs and one of forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Its columns; recognised by their units and names if left out.
    #[serde(skip_serializing_if = "BenchColumns::is_default")]
    pub columns: BenchColumns,
    /// The supply voltage at which the points or the file were measured, V: thrust at a logged supply.voltage is
    /// another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voltage_v: Option<f64>,
    /// Tables measured at several supply voltages, in place of one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub voltages: Vec<VoltageEntry>,
}

/// A table measured at one supply voltage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VoltageEntry {
    /// Supply voltage, V.
    pub voltage_v: f64,
    /// The table.
    pub file: PathBuf,
}

impl CurveEntry {
    /// Returns the uncertainty of a curve's strength if none is stated: for a preset, the spread
    /// between thrusters.
    pub(super) fn usual_uncertainty(&self) -> UncertaintyEntry {
        match self {
            Self::Preset(_) => UncertaintyEntry { forward: PRESET_STD, reverse: PRESET_STD },
            Self::Quadratic(_) | Self::Table(_) | Self::Estimate(_) | Self::OpenWater(_) => {
                UncertaintyEntry::default()
            }
        }
    }

    pub(super) fn read(
        &self,
        path: &Path,
        thruster: &str,
        inputs: &mut Vec<InputFile>,
    ) -> Result<ThrustCurve, Error> {
        let key = format!("thruster `{thruster}`, curve");
        match self {
            Self::Quadratic(entry) => entry.curve(path, &key),
            Self::Table(entry) => entry.curve(path, &key, inputs),
            Self::Preset(PresetCurveEntry { name, voltage_v }) => {
                name.curve(*voltage_v).map_err(|reason| Error::value(path, key, reason))
            }
            // Only its input matters: the plant's own terms determine its thrust.
            Self::OpenWater(_) => {
                let law =
                    QuadraticThrust { forward: 1.0, reverse: 1.0, ..QuadraticThrust::default() };
                Ok(ThrustCurve::Quadratic { input: ThrusterInput::Speed, law })
            }
            Self::Estimate(EstimateCurveEntry { input }) => match input {
                ThrusterInput::Speed | ThrusterInput::Command => {
                    let (forward, reverse) = (1.0, 1.0);
                    let law = QuadraticThrust { forward, reverse, ..QuadraticThrust::default() };
                    Ok(ThrustCurve::Quadratic { input: *input, law })
                }
                ThrusterInput::Pwm | ThrusterInput::Force => {
                    let reason = "is to be estimated from a speed or a command; map one of these, pulse widths by scale and offset as a command from -1 to 1";
                    Err(Error::value(path, key, reason))
                }
            },
        }
    }
}

/// Upper limit of plausible thrust per input, in SI units.
const LARGEST: f64 = 1e9;

/// Checks the stated supply voltage of a curve.
fn check_voltage(
    voltage_v: Option<f64>,
    input: ThrusterInput,
    path: &Path,
    key: &str,
) -> Result<(), Error> {
    let Some(volts) = voltage_v else { return Ok(()) };
    if !(volts > 0.0 && volts <= HIGHEST_V) {
        let reason = format!("voltage_v is {volts}, and must be above 0 and at most {HIGHEST_V} V");
        return Err(Error::value(path, key, reason));
    }
    if matches!(input, ThrusterInput::Speed | ThrusterInput::Force) {
        let reason = "voltage_v is for curves of pwm or command: thrust at a known propeller speed does not depend on the supply; take it away";
        return Err(Error::value(path, key, reason));
    }
    Ok(())
}

/// Upper limit of a plausible supply voltage, V.
const HIGHEST_V: f64 = 10_000.0;

/// Pulse width at which a hobby speed controller stops, us.
const STOPPED_US: f64 = 1500.0;

impl QuadraticEntry {
    pub(super) fn curve(&self, path: &Path, key: &str) -> Result<ThrustCurve, Error> {
        if self.input == ThrusterInput::Force {
            let reason = "input = \"force\" needs no curve; use speed, pwm or command";
            return Err(Error::value(path, key, reason));
        }
        let numbers = [self.forward, self.reverse, self.deadband];
        if numbers.iter().any(|x| !(x.is_finite() && *x >= 0.0)) || self.forward == 0.0 {
            let reason = "forward must be positive, reverse and deadband not negative; the sign of reverse thrust comes from the input";
            return Err(Error::value(path, key, reason));
        }
        if numbers.iter().any(|x| *x > LARGEST) {
            let reason = format!("holds a number above {LARGEST:e}; check its unit");
            return Err(Error::value(path, key, reason));
        }
        if !EXPONENTS.contains(&self.exponent) {
            let reason = format!(
                "exponent is {}, and must be between {} and {}: thrust grows with the square of propeller speed or about that",
                self.exponent,
                EXPONENTS.start(),
                EXPONENTS.end()
            );
            return Err(Error::value(path, key, reason));
        }
        let neutral = match self.input {
            ThrusterInput::Pwm => STOPPED_US,
            _ => 0.0,
        };
        let law = QuadraticThrust {
            forward: self.forward,
            reverse: self.reverse,
            exponent: self.exponent,
            deadband: self.deadband,
            neutral: self.neutral.unwrap_or(neutral),
            voltage: self.voltage_v,
        };
        check_voltage(self.voltage_v, self.input, path, key)?;
        Ok(ThrustCurve::Quadratic { input: self.input, law })
    }
}

impl TableEntry {
    /// Rejects repeated inputs in written points, of which one must be wrong; a measured table may
    /// repeat an input.
    pub(super) fn check_points(&self, path: &Path, key: &str) -> Result<(), Error> {
        if self.points.iter().flatten().any(|x| x.abs() > LARGEST) {
            let reason = format!("holds a number above {LARGEST:e}; check its unit");
            return Err(Error::value(path, key, reason));
        }
        let mut inputs: Vec<f64> = self.points.iter().map(|[input, _]| *input).collect();
        inputs.sort_by(f64::total_cmp);
        if let Some(twice) = inputs.windows(2).find(|pair| pair[0] == pair[1]) {
            let reason = format!("points hold input {} twice; give each input one force", twice[0]);
            return Err(Error::value(path, key, reason));
        }
        Ok(())
    }

    pub(super) fn curve(
        &self,
        path: &Path,
        key: &str,
        inputs: &mut Vec<InputFile>,
    ) -> Result<ThrustCurve, Error> {
        let given = [!self.points.is_empty(), self.file.is_some(), !self.voltages.is_empty()];
        if given.iter().filter(|given| **given).count() != 1 {
            let reason =
                "give one of points = [[input, N], ...], file = \"...\" or voltages = [...]";
            return Err(Error::value(path, key, reason));
        }
        if self.voltage_v.is_some() && !self.voltages.is_empty() {
            let reason = "voltage_v is stated beside voltages, which have their own; take it away";
            return Err(Error::value(path, key, reason));
        }
        let bad = |source: seaplant::Error| Error::value(path, key, source.to_string());
        let mut found = self.input;
        let mut from_file = |file: &Path, voltage| -> Result<ThrustTable, Error> {
            let bench = read_bench(&toml_file::resolve(path, file)?, &self.columns, self.input)?;
            inputs.push(bench.source.clone());
            found = Some(bench.input);
            ThrustTable::new(voltage, bench.points).map_err(bad)
        };
        let tables = if let Some(file) = &self.file {
            vec![from_file(file, self.voltage_v)?]
        } else if self.voltages.is_empty() {
            self.check_points(path, key)?;
            let points = self.points.iter().map(|[x, force]| (*x, *force)).collect();
            vec![ThrustTable::new(self.voltage_v, points).map_err(bad)?]
        } else {
            let of = |entry: &VoltageEntry| from_file(&entry.file, Some(entry.voltage_v));
            self.voltages.iter().map(of).collect::<Result<_, _>>()?
        };
        let input = found.ok_or_else(|| {
            Error::value(path, key, "points need input = \"speed\", \"pwm\" or \"command\"")
        })?;
        check_voltage(self.voltage_v, input, path, key)?;
        ThrustCurve::tables(input, tables).map_err(bad)
    }
}
